"""The command that makes a page of a run to look at: replay."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from remoras.cli.app import command, fail

if TYPE_CHECKING:
    from missions.runs.results import Results


@command("replay")
def replay(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run.")],
    other: Annotated[
        Path | None, typer.Argument(metavar="[DIR2]", help="Results of another run of the same world, to see beside it.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="HTML file to write; DIR/replay.html if left out.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it is there.")] = False,
) -> None:
    """Write one HTML file in which a run can be watched; it is opened from disk and needs no network.

    For example: remoras replay first --out mission.html
    """
    from missions.runs.results import Results
    from visualisation.replay import check_output, missing, page, write

    target = out if out is not None else folder / "replay.html"
    for one in (folder, other):
        if one is not None and (one / "study.json").is_file():
            fail(f"{one}: holds a sweep; a replay shows one run")
    runs = [Results.read(one) for one in (folder, other) if one is not None]
    check_output(target, force)
    if len(runs) == 2:
        _check_pair(*runs, folder, other)
    payloads = [_payload(run) for run in runs]
    write(target, page(_title(runs), payloads), force)
    for one, run in zip((folder, other), runs, strict=False):
        if lacking := missing(run):
            print(f"remoras: {one}: recorded by an older version; not shown: {'; '.join(lacking)}", file=sys.stderr)
    print(target)


def _payload(run: Results) -> bytes:
    from missions.scenarios.parts import mission_of
    from visualisation.replay import payload

    mission = mission_of(run.scenario)
    return payload(run, mission.places, mission.jobs.values())


def _check_pair(first: Results, second: Results, folder: Path, other: Path | None) -> None:
    """Two runs are shown side by side if the same vehicles worked in the same world; strategy and loss may differ."""
    one, two = (run.scenario.model_dump(mode="json") for run in (first, second))
    for key, what in (("scenario", "scenario"), ("world", "world")):
        given, wanted = two[key], one[key]
        if key == "scenario":
            given, wanted = given["name"], wanted["name"]
        if given != wanted:
            fail(f"{other}: is of another {what} than {folder}; two runs are shown side by side in one world only")
    if [v["name"] for v in one["vehicle"]] != [v["name"] for v in two["vehicle"]]:
        fail(f"{other}: has other vehicles than {folder}; two runs are shown side by side with the same vehicles only")


def _title(runs: list[Results]) -> str:
    summary = runs[0].summary
    named = f"{summary['scenario']}, {summary['strategy']}, seed {summary['seed']}"
    return f"{named} - replay" if len(runs) == 1 else f"{named} and another run - replay"
