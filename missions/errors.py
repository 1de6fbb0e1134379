"""Errors of the missions package, caused by the user's input or environment."""

from __future__ import annotations

import errno
import inspect
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Self

from worldmodel import suggestion

LONGEST_VALUE, LONGEST_KEY = 200, 160  # greatest length of a value, and of a key or file, in messages


def cut(text: str, longest: int) -> str:
    """Shorten a text for a message, with an ellipsis."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


def takes(function: Callable[..., Any], n_arguments: int) -> bool:
    """Return True if a function accepts ``n_arguments``, or if its signature is unknown."""
    try:
        inspect.signature(function).bind(*[None] * n_arguments)
    except TypeError:
        return False
    except ValueError:
        return True
    return True


@dataclass(frozen=True, slots=True)
class ConfigurationFault:
    """Fault of a file: key, given value, allowed values; ``file`` if not the named one."""

    key: str
    given: str
    allowed: str
    line: int | None = None
    file: str | None = None

    def text(self, file: str) -> str:
        """Format the fault on one line."""
        name = cut(self.file or file, LONGEST_KEY)
        where = f"{name}:{self.line}" if self.line else name
        value = f" = {cut(self.given, LONGEST_VALUE)}" if self.given else ""
        return f"{where}: {cut(self.key, LONGEST_KEY)}{value}: {self.allowed}"


def one_of(key: str, value: Any, allowed: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Yield a fault, with the nearest name, if a text is not allowed."""
    if isinstance(value, str) and value not in allowed:
        hint = suggestion(value, allowed)
        yield ConfigurationFault(key, f'"{value}"', f"allowed: {', '.join(allowed) or 'none'}{hint}")


def repeated(names: Iterable[str]) -> list[tuple[str, int]]:
    """Return the names that occur several times, with their numbers."""
    return [(name, number) for name, number in Counter(names).items() if number > 1]


class MissionsError(Exception):
    """Base of the errors of ``missions``."""


class ConfigurationError(MissionsError):
    """Invalid scenario or study, with all faults."""

    def __init__(self, file: str, faults: Sequence[ConfigurationFault]) -> None:
        super().__init__(file, tuple(faults))  # constructor arguments, for pickling
        self.file = file
        self.faults = tuple(faults)

    @classmethod
    def of(cls, file: str, key: str, given: str, allowed: str, line: int | None = None) -> Self:
        """Create the error of one fault."""
        return cls(file, [ConfigurationFault(key, given, allowed, line)])

    def __str__(self) -> str:
        return "\n".join(fault.text(self.file) for fault in self.faults)


class OutputError(MissionsError):
    """Output folder not writable, or with results that would be overwritten."""


def check_name(what: str, name: str, known: Collection[str]) -> None:
    """Raise OutputError for an unknown name, with the nearest one; ``what`` is its kind or option."""
    if name not in known:
        listed = ", ".join(known) or "none"
        raise OutputError(f"{what} {cut(name, LONGEST_VALUE)!r}: allowed are {listed}{suggestion(name, known)}")


@contextmanager
def writing(where: object) -> Iterator[None]:
    """Convert an OSError inside the context to an OutputError that names ``where``, such as ``--out x``."""
    try:
        yield
    except OSError as error:
        kind = DiskFullError if error.errno in (errno.ENOSPC, errno.EDQUOT) else OutputError
        raise kind(f"{where}: cannot be written: {error.strerror}") from None


class DiskFullError(OutputError):
    """No space left for results."""


class ClusterError(MissionsError):
    """Cluster unreachable, lost, or with another version."""


class StudyChangedError(MissionsError):
    """Folder with runs of another study, or of another version of it."""
