"""What goes wrong when somebody asks for a figure or a file."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class VisualisationError(Exception):
    """Base of the errors of this package."""


class DrawingError(VisualisationError, ValueError):
    """A figure was asked for that cannot be drawn."""


class ExportError(VisualisationError, ValueError):
    """A file was asked for that cannot be made of these results, or cannot be written."""


def unknown(what: str, given: str, known: Iterable[str]) -> DrawingError:
    """The error for a name that is not known: what was given, what is allowed, and the nearest."""
    names = list(known)
    near = get_close_matches(given, names, n=1, cutoff=0.0)
    return DrawingError(f"unknown {what} {given!r}; known: {', '.join(names)}; nearest: {near[0]!r}")
