"""The command that makes a page of a run to look at: replay."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from remoras.cli.app import command, fail

if TYPE_CHECKING:
    from missions.runs.results import Results


@command("replay", "remoras replay results/lossy --out mission.html")
def replay(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run.")],
    other: Annotated[
        Path | None,
        typer.Argument(metavar="[DIR2]", help="Results of another run of that world, to see beside it."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="HTML file to write; DIR/replay.html if left out.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it is there.")] = False,
) -> None:
    """Write one HTML file in which a run can be watched; it is opened from disk and needs no network."""
    from missions.runs.folder import REPLAY
    from missions.runs.results import Results
    from visualisation.replay import check_page_output, missing, page_text, title_of, write_page

    target = out if out is not None else folder / REPLAY
    folders = [folder] if other is None else [folder, other]
    for one in folders:
        if (one / "study.json").is_file():
            fail(f"{one}: holds a sweep; a replay shows one run, or two side by side")
    runs = [Results.read(path) for path in folders]
    check_page_output(target, force)
    for second in runs[1:]:
        _check_pair(runs[0], second)
    payloads = [_data(run) for run in runs]
    write_page(target, page_text(title_of([run.summary for run in runs]), payloads), force)
    for run in runs:
        if lacking := missing(run):
            what = "; ".join(lacking)
            print(f"remoras: {run.folder}: an older version recorded it; not shown: {what}", file=sys.stderr)
    print(target)


def _data(run: Results) -> bytes:
    """What the page holds of a run. Without what its mission declares, if this version cannot read the scenario."""
    from missions.errors import ConfigurationError
    from missions.scenarios.parts import mission_of, strategy_of
    from visualisation.replay import run_data

    try:
        mission, strategy = mission_of(run.scenario), strategy_of(run.scenario)
    except ConfigurationError as error:
        print(f"remoras: {run.folder}: places and jobs are not shown: {error}", file=sys.stderr)
        return run_data(run)
    return run_data(run, mission.places, mission.jobs.values(), strategy.declaration.communicates)


def _check_pair(first: Results, second: Results) -> None:
    """Fail unless the same vehicles worked in the same world; strategy, loss and seed may differ."""
    one, two = first.scenario, second.scenario
    mission = one.scenario.mission == two.scenario.mission
    for what, same in (
        ("mission", mission),
        ("world", mission and (one.world, _places(first)) == (two.world, _places(second))),
        ("vehicles", [vehicle.name for vehicle in one.vehicle] == [vehicle.name for vehicle in two.vehicle]),
    ):
        if not same:
            fail(
                f"{second.folder}: {what} differ from {first.folder}; two runs are shown side by side if vehicles "
                "of the same names did the same mission in the same world"
            )


def _places(run: Results) -> Sequence[object]:
    from missions.scenarios.parts import mission_of

    return mission_of(run.scenario).places
