"""A drawn figure of a run, with its caption."""

from __future__ import annotations

from typing import NamedTuple

from matplotlib.figure import Figure


class Picture(NamedTuple):
    """A figure, its caption, and notes on what was left out of it."""

    figure: Figure
    caption: str
    notes: tuple[str, ...] = ()
