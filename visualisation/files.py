"""Files of figures: what was drawn becomes files only when all of it has been drawn."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from visualisation.errors import DrawingError, unknown

FORMATS = ("png", "svg", "pdf")
"""Formats of figures."""
MOVING = "gif"
"""Format of a figure that moves."""
LEAST_WIDTH_IN, MOST_WIDTH_IN = 3.0, 20.0
"""Widths of figures."""


class Drawn(NamedTuple):
    """Files written (a figure, what belongs to it, the next figure, ...), and notes for the user."""

    files: list[Path]
    notes: list[str]


def check_format(format: str) -> None:
    """Raise DrawingError unless the format is one of ``FORMATS``."""
    if format not in FORMATS:
        raise unknown("format", format, FORMATS)


def check_width(width_in: float | None) -> None:
    """Raise DrawingError unless the width is None (the figure's own) or one that a figure may have."""
    if width_in is not None and not LEAST_WIDTH_IN <= width_in <= MOST_WIDTH_IN:
        raise DrawingError(
            f"width {width_in:g} in: allowed are {LEAST_WIDTH_IN:g} to {MOST_WIDTH_IN:g} inches; a column of a "
            "paper has 3.5, a page 7.2"
        )


def write_folder(folder: Path, contents: Iterable[tuple[str, bytes]]) -> list[Path]:
    """Write files of these names and contents into a folder, which is made if it is not there.

    Raises:
        DrawingError: they cannot be written; what was there before is there still, and nothing else is.
    """
    ready: Sequence[tuple[str, bytes]] = list(contents)
    paths = [folder / name for name, _ in ready]
    drafts = [path.with_name(f".{path.name}.draft") for path in paths]
    path = folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, draft, (_, content) in zip(paths, drafts, ready, strict=True):  # noqa: B007  # the message names it
            draft.write_bytes(content)
        for path, draft in zip(paths, drafts, strict=True):
            draft.replace(path)
    except OSError as error:
        raise DrawingError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        for draft in drafts:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
    return paths
