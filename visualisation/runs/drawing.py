"""Drawing figures of a run by their names: those of every run, and those that its mission declares.

Matplotlib is loaded when the first figure is drawn. All figures that were asked for are drawn before the first file is
written, so an error leaves nothing half written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from missions.figure import Declared, Figure, Layer, Mark, Place, RunResults
from visualisation.output import (
    KINDS,
    SWEEP_KINDS,
    DrawingError,
    Drawn,
    check_format,
    check_width,
    unknown,
    write_folder,
)

if TYPE_CHECKING:
    from visualisation.page import DrawnPage

ORGANISATION = "organisation"


@dataclass(frozen=True)
class ViewAt:
    """Of the organisation of a run: when, and in whose view.

    Attributes:
        at_s: the time; if left out, the last at which the most roles are held.
        viewer: name of a vehicle; empty for what every vehicle holds of itself.
    """

    at_s: float | None = None
    viewer: str = ""

    def __str__(self) -> str:
        at = "" if self.at_s is None else f"at {self.at_s:g} s"
        return ", ".join(part for part in (at, self.viewer and f"viewer {self.viewer}") if part)


ANY = ViewAt()


def run_picture(
    results: RunResults,
    kind: str,
    figures: Sequence[Declared] = (),
    places: Sequence[Place] = (),
    width_in: float | None = None,
    moment: ViewAt = ANY,
) -> DrawnPage:
    """One figure of a run with its caption, in memory.

    Args:
        results: of one run.
        kind: a name in ``KINDS``, or the name of a figure among ``figures``.
        figures: what the mission of the run declares.
        places: what the map of the tracks shows.
        width_in: of the figure; what suits its kind if left out.
        moment: of the organisation.

    Returns:
        The Matplotlib figure, the caption, and notes on what was left out.

    Raises:
        DrawingError: the kind is not known, its tables are missing, the width is out of range, the run has no such
            moment, or the mission's function failed.
    """
    check_width(width_in)
    own = _own(figures)
    _check_kinds([kind], own)
    if reason := _lacking(results, kind, own):
        raise DrawingError(f"{kind}: {reason}")
    widths = () if width_in is None else (width_in,)
    if kind in own:
        from visualisation.runs import declared

        return declared.declared_picture(own[kind], results, *widths)
    if kind == "trajectories":
        from visualisation.runs import trajectories

        layers = [figure for figure in figures if isinstance(figure, Layer)]
        marks = [figure for figure in figures if isinstance(figure, Mark)]
        return trajectories.picture(results, places, layers, marks, width_in)
    if kind == ORGANISATION:
        from visualisation.runs import organisation

        return organisation.picture(results, moment.at_s, moment.viewer, *widths)
    drawn: DrawnPage = import_module(f"visualisation.runs.{kind}").picture(results, *widths)
    return drawn


def draw_run_figures(
    results: RunResults,
    kinds: Sequence[str],
    folder: Path,
    format: str = "png",
    figures: Sequence[Declared] = (),
    places: Sequence[Place] = (),
    width_in: float | None = None,
    moment: ViewAt = ANY,
) -> Drawn:
    """Write ``<kind>.<format>`` and its caption ``<kind>.txt`` for each kind; no kinds means all that have tables.

    Args:
        results: of one run.
        kinds: names in ``KINDS``, or of figures among ``figures``.
        folder: made if it is not there.
        format: png, svg or pdf.
        figures: what the mission of the run declares.
        places: what the map of the tracks shows.
        width_in: of all figures; what suits each if left out.
        moment: of the organisation, which has to be among the kinds if it is given.

    Returns:
        The files written (a figure, its caption, the next figure, ...), and what was left out and why.

    Raises:
        DrawingError: a kind or the format is not known, the tables of a kind that was named are missing, or a figure of
            the mission is not one, or failed. Nothing is written then.
    """
    own = _own(figures)
    _check_kinds(kinds, own)
    check_width(width_in)
    if moment != ANY and kinds and ORGANISATION not in kinds:
        raise DrawingError(f"{moment}: is about the figure {ORGANISATION}; name that too")
    check_format(format)
    asked = list(dict.fromkeys(kinds)) or [*KINDS, *own]
    missing = {kind: reason for kind in asked if (reason := _lacking(results, kind, own))}
    if kinds and missing:
        raise DrawingError("; ".join(f"{kind}: {reason}" for kind, reason in missing.items()))
    from visualisation import output, style

    said = output.about_run(results)
    notes = [f"{kind} is left out: {reason}" for kind, reason in missing.items()]
    contents: list[tuple[str, bytes]] = []
    for kind in asked:
        if kind not in missing:
            drawn = run_picture(results, kind, figures, places, width_in, moment)
            contents.append((f"{kind}.{format}", style.rendered(drawn.figure, format, said)))
            contents.append((f"{kind}.txt", f"{drawn.caption}\n".encode()))
            notes += drawn.notes
    return Drawn(write_folder(folder, contents), notes)


def _own(figures: Sequence[Declared]) -> dict[str, Figure]:
    """Figures of the mission by name, each declared rightly and once."""
    found: dict[str, Figure] = {}
    for figure in figures:
        if not isinstance(figure, Figure | Layer | Mark):
            raise DrawingError(
                f"the mission lists {figure!r} as a figure, which is a {type(figure).__name__}; "
                "allowed: Figure, Layer and Mark of missions.figure"
            )
        if isinstance(figure, Figure):
            if not figure.name or figure.name.startswith(".") or "/" in figure.name or "\\" in figure.name:
                raise DrawingError(
                    f"the mission declares a figure {figure.name!r}, which is no name of a file: rename it, without / "
                    "and without a dot in front"
                )
            if figure.name in (*KINDS, *SWEEP_KINDS, *found):
                raise DrawingError(f"the mission declares a figure {figure.name!r}, a name that is taken; rename it")
            found[figure.name] = figure
    return found


def _check_kinds(kinds: Sequence[str], own: Mapping[str, Figure]) -> None:
    known = (*KINDS, *own)
    for kind in kinds:
        if kind in SWEEP_KINDS:
            names = ", ".join(known)
            raise DrawingError(f"{kind!r} is a figure of a sweep, and these are results of one run; known: {names}")
        if kind not in known:
            raise unknown("kind of figure", kind, known)


def _lacking(results: RunResults, kind: str, own: Mapping[str, Figure]) -> str:
    """Why a kind cannot be drawn; empty if it can."""
    lacking = [table for table in (own[kind].needs if kind in own else KINDS[kind]) if not results.has(table)]
    return f"these results have no table {', '.join(lacking)}" if lacking else ""
