"""What can go wrong by the user's own doing. A peer's bad block is no exception but a ``facts.Fault``."""

import difflib
from collections.abc import Iterable, Sequence


class WorldModelError(Exception):
    """Base of every error this package raises."""


class OntologyError(WorldModelError):
    """The TBox cannot be compiled; ``faults`` holds all that is wrong with it, one line each."""

    def __init__(self, faults: Sequence[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(self.faults))

    def __reduce__(self) -> tuple[type["OntologyError"], tuple[tuple[str, ...]]]:
        return type(self), (self.faults,)


class UnknownNameError(OntologyError, LookupError):
    """No class, attribute or instance bears the name that was asked for."""


class FactError(WorldModelError, ValueError):
    """The owner tried to record something his own checks refuse."""


class NeedError(WorldModelError, ValueError):
    """An information need that says nothing, or two things at once."""


def suggestion(given: str, known: Iterable[str]) -> str:
    """Return the end of an error message that proposes the known name most like ``given``.

    This is the one "did you mean" of the project; it is written behind the list of what is allowed.

    Args:
        given: the name that the user wrote.
        known: the names that are allowed; of names equally alike the order decides, as in difflib.

    Returns:
        ``"; did you mean 'x'?"``, or nothing when no known name is similar (difflib's ratio is below 0.6).

    >>> suggestion("positon", ["position", "location"])
    "; did you mean 'position'?"
    >>> suggestion("xyz", ["position", "location"])
    ''
    """
    found = difflib.get_close_matches(given, list(known), n=1)
    return f"; did you mean {found[0]!r}?" if found else ""


def nearest(name: str, known: Iterable[str]) -> str:
    """Say which known name was probably meant.

    >>> nearest("positon", ["position", "location"])
    'nearest known name: position'
    >>> nearest("xyz", ["position", "location"])
    'known names: location, position'
    """
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    return f"nearest known name: {close[0]}" if close else f"known names: {', '.join(names)}"
