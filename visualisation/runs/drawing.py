"""Drawing of run figures by name; all are drawn before the first is written, so an error leaves no partial output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from missions.figure import Declared, Figure, Layer, Mark, Place, RunResults, faults_of_figure
from visualisation.output import (
    KINDS,
    SWEEP_KINDS,
    DrawingError,
    Drawn,
    check_format,
    check_kinds,
    check_width,
    write_folder,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from visualisation.page import DrawnPage

ORGANISATION, LINKS, TRAJECTORIES = "organisation", "links", "trajectories"
OF_RUNS = "kind of figure", SWEEP_KINDS, "a sweep, and these are results of one run"
HEATMAPS = ("delivery", "knowledge", LINKS)


def run_picture(
    results: RunResults,
    kind: str,
    figures: Sequence[Declared] = (),
    places: Sequence[Place] = (),
    width_in: float | None = None,
    at_s: float | None = None,
    viewer: str = "",
    panel: str = "",
    ax: Axes | None = None,
) -> DrawnPage:
    """Draw one figure of a run in memory, with its caption and notes on omissions.

    Args:
        kind: a name in ``KINDS``, or of a figure among ``figures``.
        width_in: None for the default of the kind.
        at_s, viewer: time and vehicle of the organisation shown; None for the end of the run, empty for each
            vehicle's own view.
        panel: letter of the only panel of the trajectories; empty for all.
        ax: axes of a user in place of a page, for the trajectories or a figure among ``figures``.

    Raises DrawingError for an unknown kind, missing tables, a width out of range, no such time, viewer or panel,
    ``ax`` for another kind, or failure of the mission's function.
    """
    check_width(width_in)
    own = _own(figures)
    check_kinds([kind], (*KINDS, *own), *OF_RUNS)
    if reason := _lacking(results, kind, own):
        raise DrawingError(f"{kind}: {reason}")
    widths = () if width_in is None else (width_in,)
    if ax and kind not in (TRAJECTORIES, *own):
        raise DrawingError(f"{kind}: fills a page of its own; allowed with ax: {', '.join((TRAJECTORIES, *own))}")
    if kind in own:
        from visualisation.runs import declared

        return declared.declared_picture(own[kind], results, width_in, ax)
    if kind == TRAJECTORIES:
        from visualisation.runs import trajectories

        layers = [figure for figure in figures if isinstance(figure, Layer)]
        marks = [figure for figure in figures if isinstance(figure, Mark)]
        return trajectories.picture(results, places, layers, marks, width_in, panel, ax)
    if kind == ORGANISATION:
        from visualisation.runs import organisation

        return organisation.picture(results, at_s, viewer, *widths)
    module = import_module(f"visualisation.runs.{'heatmaps' if kind in HEATMAPS else kind}")
    drawn: DrawnPage = getattr(module, kind if kind in HEATMAPS else "picture")(results, *widths)
    return drawn


def draw_run_figures(
    results: RunResults,
    kinds: Sequence[str],
    folder: Path,
    format: str = "png",
    figures: Sequence[Declared] = (),
    places: Sequence[Place] = (),
    width_in: float | None = None,
    at_s: float | None = None,
    viewer: str = "",
    panel: str = "",
) -> Drawn:
    """Write ``<kind>.<format>`` and its caption ``<kind>.txt`` for each kind; return the files and notes on omissions.

    Arguments and errors are as in ``run_picture``; empty ``kinds`` are all with tables, and must include the
    organisation if ``at_s`` or ``viewer`` is given, the trajectories for a ``panel``. A DrawingError leaves no file.
    """
    own = _own(figures)
    check_kinds(kinds, (*KINDS, *own), *OF_RUNS)
    check_width(width_in)
    options = {f"at {at_s:g} s": ORGANISATION} if at_s is not None else {}
    options |= {f"viewer {viewer}": ORGANISATION} if viewer else {}
    options |= {f"panel {panel}": TRAJECTORIES} if panel else {}
    for option, kind in options.items():
        if kinds and kind not in kinds:
            raise DrawingError(f"{option}: applies to the figure {kind} only; name it too")
    check_format(format)
    asked = list(dict.fromkeys(kinds)) or [*KINDS, *own]
    missing = {kind: reason for kind in asked if (reason := _lacking(results, kind, own))}
    if kinds and missing:
        raise DrawingError("; ".join(f"{kind}: {reason}" for kind, reason in missing.items()))
    from visualisation import output, style

    provenance = output.about_run(results)
    notes = [f"{kind} is left out: {reason}" for kind, reason in missing.items()]
    contents: list[tuple[str, bytes]] = []
    for kind in asked:
        if kind not in missing:
            drawn = run_picture(results, kind, figures, places, width_in, at_s, viewer, panel)
            contents.append((f"{kind}.{format}", style.rendered(drawn.figure, format, provenance)))
            contents.append((f"{kind}.txt", f"{drawn.caption}\n".encode()))
            notes += drawn.notes
    return Drawn(write_folder(folder, contents), notes)


def _own(figures: Sequence[Declared]) -> dict[str, Figure]:
    own: dict[str, Figure] = {}
    for figure in figures:
        if faults := "; ".join(faults_of_figure(figure)):
            raise DrawingError(f"the mission declares a figure {getattr(figure, 'name', figure)!r}: {faults}")
        if isinstance(figure, Figure):
            if figure.name in (*KINDS, *SWEEP_KINDS, *own):
                raise DrawingError(f"the mission declares a figure {figure.name!r}, a name that is taken; rename it")
            own[figure.name] = figure
    return own


def _lacking(results: RunResults, kind: str, own: Mapping[str, Figure]) -> str:
    lacking = [table for table in (own[kind].needs if kind in own else KINDS[kind]) if not results.has(table)]
    if lacking:
        return f"these results have no table {', '.join(lacking)}"
    if kind == LINKS and not results.rows("peers") and not any(row["p_loss"] for row in results.rows(LINKS)):
        return "no vehicle estimated a loss or declared another one absent"
    return ""
