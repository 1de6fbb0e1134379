"""Errors of the missions package: the user's scenario or study is at fault."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

LONGEST_VALUE, LONGEST_KEY = 200, 160
"""Characters of a value, and of a key or a file, that a message shows."""


def cut(text: str, longest: int) -> str:
    """A text as a message shows it, cut if it is long.

    >>> cut("abcdefgh", 6)
    'abc...'
    """
    return text if len(text) <= longest else text[: longest - 3] + "..."


def takes(function: Callable[..., Any], n_arguments: int) -> bool:
    """True if a function can be called with so many arguments, or if Python does not know."""
    try:
        inspect.signature(function).bind(*[None] * n_arguments)
    except TypeError:
        return False
    except ValueError:
        return True
    return True


@dataclass(frozen=True, slots=True)
class ConfigurationFault:
    """One thing wrong with a file: where, what was given, what is allowed.

    Attributes:
        file: that it stands in, where that is not the file that was named.
    """

    key: str
    given: str
    allowed: str
    line: int | None = None
    file: str | None = None

    def text(self, file: str) -> str:
        """The fault on one line, as a message shows it."""
        name = cut(self.file or file, LONGEST_KEY)
        where = f"{name}:{self.line}" if self.line else name
        given = f" = {cut(self.given, LONGEST_VALUE)}" if self.given else ""
        return f"{where}: {cut(self.key, LONGEST_KEY)}{given}: {self.allowed}"


class MissionsError(Exception):
    """Base of the errors that ``missions`` raises."""


class ConfigurationError(MissionsError):
    """A scenario or study is wrong; all faults are reported at once."""

    def __init__(self, file: str, faults: Sequence[ConfigurationFault]) -> None:
        super().__init__(file, tuple(faults))  # what it is made of, so that it goes from process to process
        self.file = file
        self.faults = tuple(faults)

    def __str__(self) -> str:
        return "\n".join(fault.text(self.file) for fault in self.faults)


class OutputError(MissionsError):
    """An output folder cannot be written, or holds something that would be overwritten."""


class DiskFullError(OutputError):
    """There is no room left for results."""


class ClusterError(MissionsError):
    """The cluster cannot be reached, was lost, or runs another version."""


class StudyChangedError(MissionsError):
    """A folder holds the runs of another study, or of the same study before it was changed."""
