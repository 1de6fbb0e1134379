"""Command ``report``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from remoras.cli.app import command, fail, note

if TYPE_CHECKING:
    from missions.runs.results import Results
    from missions.sweeps.folder import SweepResults
    from visualisation.page import DrawnPage
    from visualisation.report.document import Report


@command("report", "remoras report results/quick --out report")
def report(
    folder: Path,
    out: Path,
    metric: str | None = None,
    force: bool = False,
) -> None:
    """Write a report of a study or run: figure, table, statements and methods as HTML and LaTeX.

    Args:
        folder (DIR): Results of a run, or folder of a sweep.

    Options:
        out (FOLDER): Folder for report.html and latex.
        metric (METRIC): Sweep: compared summary field; default: the first of the study.
        force: Replace an earlier report.
    """
    from missions.disk import check_output, holds_sweep
    from visualisation.report import study_report, write_report

    check_output(out, force)
    results: SweepResults | None = None
    if holds_sweep(folder):
        from missions.sweeps.folder import SweepResults

        results = SweepResults.read(folder)
        made, notes = study_report(results, metric, lambda run: _drawn(run, "trajectories", "a"))
    else:
        from missions.runs.results import Results

        if metric is not None:
            fail(f"--metric {metric}: applies to the report of a sweep, and {folder} holds a single run")
        made, notes = _of_run(Results.read(folder)), []
    for text in notes:
        note(f"note: {text}")
    for path in write_report(made, out):
        print(path)
    if results is not None and (why := _not_repeated(results, out)):
        note(f"To repeat: {why}")


def _not_repeated(results: SweepResults, folder: Path) -> str:
    """Return why the study in the folder of a report does not repeat its runs; empty if it does."""
    from missions.errors import MissionsError
    from missions.sweeps.folder import STUDY_TEXT
    from missions.sweeps.plan import SweepPlan
    from missions.sweeps.study import load_study
    from remoras.errors import RemorasError
    from visualisation.report.study import added

    path = folder / STUDY_TEXT
    try:
        again = SweepPlan(load_study(str(path), added(path.read_text(encoding="utf-8")))).schedule
    except (MissionsError, RemorasError) as error:
        return f"{path.name} and the files copied beside it are not complete: {error}"
    lost = {label.digest for label in results.schedule.labels} - {label.digest for label in again.labels}
    return f"the scenario has changed since {len(lost)} configurations were run" if lost else ""


def _of_run(run: Results) -> Report:
    from missions.files import shipped
    from missions.runs.metrics import metrics_of
    from missions.scenarios import load
    from visualisation.report import run_report

    name = run.summary["scenario"]
    tables: dict[str, Any] | None = load(name).model_dump(mode="json") if name in shipped() else None
    return run_report(run, metrics_of(run.scenario), tables, lambda kind: _drawn(run, kind))


def _drawn(run: Results, kind: str, panel: str = "") -> DrawnPage:
    from visualisation.runs import run_picture
    from visualisation.style import COLUMN_IN

    return run_picture(run, kind, run.mission.figures, run.mission.places, COLUMN_IN, panel=panel)
