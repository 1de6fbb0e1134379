"""The errors that a user's mistake raises. A peer's bad block raises nothing; it is a ``facts.Fault``."""

import difflib
from collections.abc import Iterable, Sequence


class WorldModelError(Exception):
    """Base of every error that this package raises."""


class OntologyError(WorldModelError):
    """The ontology cannot be compiled; ``faults`` holds everything that is wrong with it, one line each."""

    def __init__(self, faults: Sequence[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(self.faults))

    def __reduce__(self) -> tuple[type["OntologyError"], tuple[tuple[str, ...]]]:
        return type(self), (self.faults,)


class UnknownNameError(OntologyError, LookupError):
    """No class, attribute or instance has the name that was asked for."""


class FactError(WorldModelError, ValueError):
    """A fact, or an argument of a world model, that the checks refuse."""


class NeedError(WorldModelError, ValueError):
    """An information need that names no existing attribute, class or instance, or two of them at once."""


class QueryError(WorldModelError, ValueError):
    """A SPARQL query that cannot be answered."""


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return the end of an error message that proposes the known name most like ``name``.

    This is the one "did you mean" of the project; it is written behind the list of what is allowed.

    Args:
        name: the name that the user wrote.
        known: the names that are allowed; of names equally alike the order decides, as in difflib.

    Returns:
        ``"; did you mean 'x'?"``, or nothing when no known name is similar (difflib's ratio is below 0.6).

    >>> suggestion("positon", ["position", "location"])
    "; did you mean 'position'?"
    >>> suggestion("xyz", ["position", "location"])
    ''
    """
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def unknown_name(what: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """Return the error for a name that nothing bears.

    Args:
        what: the kind of thing that was asked for, such as "class".
        name: the name that was asked for.
        known: the names that would have been found.
    """
    names = sorted(known)
    allowed = ", ".join(names) or "none"
    return UnknownNameError([f"no {what} is named {name!r}; allowed: {allowed}{suggestion(name, names)}"])
