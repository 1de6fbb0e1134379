"""Results folders with one alteration: the responsible check reports it."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.verification import verify

SETTINGS = [
    "channel.per=0.3", "current.east_mps=0.3", "current.tide_period_h=4",
    'fault=[{kind="mute",vehicle="AUV01",at_s=100,until_s=160},{kind="slow",vehicle="AUV02",at_s=300,until_s=400}]',
    'channel.blackout=[{from_s=420,until_s=450,between=[["AUV00"],["AUV01","AUV02"]]}]',
]  # fmt: skip
Rows = list[dict[str, Any]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole mission in an eastward current, with two faults, and parted for half a minute; it passes untouched."""
    folder = tmp_path_factory.mktemp("made") / "run"
    write_results(run(load("mapping-rendezvous", [("--set", one) for one in SETTINGS]), 3), folder)
    report = verify(folder)
    assert list(report.lines) == []
    assert sum(report.checked.values()) > 100_000
    return folder


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same mission with another seed, cut off early."""
    folder = tmp_path_factory.mktemp("other") / "run"
    write_results(run(load("mapping-rendezvous", [("--set", "scenario.duration_s=200")]), 4), folder)
    return folder


def in_summary(change: Callable[[dict[str, Any]], None]) -> Callable[[Path], None]:
    """Alter the summary."""

    def alter(folder: Path) -> None:
        path = folder / "summary.json"
        summary = json.loads(path.read_text())
        change(summary)
        path.write_text(json.dumps(summary))

    return alter


def in_table(name: str, change: Callable[[Rows], None]) -> Callable[[Path], None]:
    """Alter the rows of a table; metadata stays."""

    def alter(folder: Path) -> None:
        path = folder / f"{name}.parquet"
        table = pq.read_table(path)
        rows = table.to_pylist()
        change(rows)
        pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), path)

    return alter


def _mirrored(rows: Rows) -> None:
    """The water carries all vehicles west, not east."""
    before: dict[str, tuple[float, float]] = {}
    for row in rows:
        time_s, x_m = before.get(row["vehicle"], (0.0, 0.0))
        before[row["vehicle"]] = row["time_s"], x_m - 0.6 * (row["time_s"] - time_s)
        row["x_m"] += before[row["vehicle"]][1]


def _unheard(rows: Rows) -> None:
    """A vehicle sends a status although it lost the only packet with it."""
    row = next(row for row in rows if row["lost_by"] and row["status_uids"])
    teller = next(later for later in rows[rows.index(row) :] if later["sender"] == row["lost_by"][0])
    teller["status_uids"] += row["status_uids"]


def _across(rows: Rows) -> None:
    """A vehicle receives a packet from the other side of a blackout."""
    row = next(row for row in rows if 420.0 < row["time_s"] < 450.0 and row["sender"] == "AUV00")
    row["lost_by"].remove("AUV01")
    row["receivers"].append("AUV01")
    row["arrivals_s"].append(row["end_s"] + 0.2)


def _other_time(summary: dict[str, Any]) -> None:
    stone = next(one for one in summary["milestones"] if one["name"] == "mapping_stopped")
    stone["time_s"] -= 30.0


def _no_meeting(summary: dict[str, Any]) -> None:
    summary["milestones"] = [one for one in summary["milestones"] if one["name"] != "gathered"]


def _other_unit(folder: Path) -> None:
    path = folder / "trajectories.parquet"
    table = pq.read_table(path)
    at = table.schema.get_field_index("x_m")
    field = table.schema.field(at).with_metadata({"unit": "km"})
    pq.write_table(table.cast(table.schema.set(at, field)), path)


CASES: dict[str, tuple[str, Callable[[Path], None]]] = {
    "milestone shifted": ("milestones", in_summary(_other_time)),
    "no meeting": ("verdict", in_summary(_no_meeting)),
    "water flows west": ("positions", in_table("trajectories", _mirrored)),
    "another unit": ("units", _other_unit),
    "relayed and not heard": ("senders", in_table("packets", _unheard)),
    "heard across a cut": ("receivers", in_table("packets", _across)),
}  # fmt: skip
"""What is altered: the check that should name it, and how."""


@pytest.mark.slow
def test_altered_figure_of_the_summary_is_reported(other: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(other, tmp_path / "altered"))
    summary, spared = json.loads((other / "summary.json").read_text()), {"milestones", *verify(other).not_checked}
    for name, value in summary.items():
        changed = 1.01 * value + 1.0 if isinstance(value, int | float) and value is not True else f"{value}x"
        (folder / "summary.json").write_text(json.dumps({**summary, name: changed}))
        assert name in spared or verify(folder).n_findings, name


def named(check: str, alter: Callable[[Path], None], made: Path, folder: Path) -> bool:
    """True if a check reports the alteration of a folder."""
    shutil.copytree(made, folder)
    alter(folder)
    return check in verify(folder).n_findings


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_altered_results_are_reported_by_their_check(case: str, made: Path, tmp_path: Path) -> None:
    assert named(*CASES[case], made, tmp_path / "altered")


def test_file_of_another_run_is_reported(made: Path, other: Path, tmp_path: Path) -> None:
    folder = tmp_path / "mixed"
    shutil.copytree(made, folder)
    shutil.copy(other / "roles.parquet", folder / "roles.parquet")
    assert {one.table for one in verify(folder).findings if one.check == "run_id"} == {"roles"}
