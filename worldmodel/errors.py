"""Errors caused by the user; an invalid block of a peer gives a ``facts.Fault`` instead."""

import difflib
from collections.abc import Iterable, Sequence


class WorldModelError(Exception):
    """Base class of all errors of this package."""


class OntologyError(WorldModelError):
    """Invalid ontology; ``faults`` lists all faults, one line each."""

    def __init__(self, faults: Sequence[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(self.faults))

    # Unpickling would pass the joined message in place of the faults.
    def __reduce__(self) -> tuple[type["OntologyError"], tuple[tuple[str, ...]]]:
        return type(self), (self.faults,)


class UnknownNameError(OntologyError, LookupError):
    """No class, attribute or instance of this name."""


class FactError(WorldModelError, ValueError):
    """Fact or world-model argument refused by the checks."""


class NeedError(WorldModelError, ValueError):
    """Information need with an unknown uid, invalid requirements, or both class and instance."""


class QueryError(WorldModelError, ValueError):
    """SPARQL query that cannot be evaluated."""


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return the end of an error message that proposes the nearest known name; empty if none is near.

    >>> suggestion("positon", ["position", "location"]), suggestion("xyz", ["position", "location"])
    ("; did you mean 'position'?", '')
    """
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def unknown_name(what: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """Return the error for an unknown name; ``what`` is the kind of name, such as "class"."""
    names = sorted(known)
    allowed = ", ".join(names) or "none"
    return UnknownNameError([f"no {what} is named {name!r}; allowed: {allowed}{suggestion(name, names)}"])
