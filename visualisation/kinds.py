"""Kinds of figures by name; matplotlib is loaded when the first one is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from visualisation.errors import DrawingError, unknown
from visualisation.sweeps.measures import COMPARISON_KINDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from missions.runs.results import Results

FORMATS = ("png", "svg", "pdf")


def trajectories(results: Results) -> Figure:
    """Where the vehicles went."""
    from visualisation.runs import trajectories as kind

    return kind.figure(results)


def roles(results: Results) -> Figure:
    """Which roles they held, and which drove them."""
    from visualisation.runs import timeline as kind

    return kind.figure(results)


def satisfaction(results: Results) -> Figure:
    """How satisfied each role was."""
    from visualisation.runs import satisfaction as kind

    return kind.figure(results)


def coverage(results: Results) -> Figure:
    """How much of the areas was mapped when."""
    from visualisation.runs import coverage as kind

    return kind.figure(results)


KINDS: Mapping[str, Callable[[Results], Figure]] = {
    "trajectories": trajectories,
    "roles": roles,
    "satisfaction": satisfaction,
    "coverage": coverage,
}


def caption(results: Results, kind: str) -> str:
    """Text to stand under a figure of that kind."""
    from visualisation.runs import captions

    texts: Mapping[str, Callable[[Results], str]] = {
        "trajectories": captions.trajectories,
        "roles": captions.roles,
        "satisfaction": captions.satisfaction,
        "coverage": captions.coverage,
    }
    return texts[kind](results)


def draw(results: Results, kinds: Sequence[str], folder: Path, format: str = "png") -> list[Path]:
    """Write ``<kind>.<format>`` and its caption ``<kind>.txt`` for each kind; no kinds means all.

    Args:
        results: of one run.
        kinds: names in ``KINDS``.
        folder: made if it is not there.
        format: png, svg or pdf.

    Returns:
        The files written: a figure, its caption, the next figure, ...

    Raises:
        DrawingError: a kind or the format is not known.
    """
    for kind in kinds:
        if kind in COMPARISON_KINDS and kind not in KINDS:
            raise DrawingError(
                f"{kind!r} is a figure of a sweep, and these are results of one run; known: {', '.join(KINDS)}"
            )
        if kind not in KINDS:
            raise unknown("kind of figure", kind, KINDS)
    if format not in FORMATS:
        raise unknown("format", format, FORMATS)
    from visualisation import style

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for kind in kinds or list(KINDS):
        picture, text = folder / f"{kind}.{format}", folder / f"{kind}.txt"
        style.save(KINDS[kind](results), picture, format)
        text.write_text(caption(results, kind) + "\n", encoding="utf-8")
        written += [picture, text]
    return written
