"""Folders of results in which one thing is altered: the check that should name it does; the untouched one passes."""

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
    """A whole mission in an eastward current, with two faults, and parted for half a minute."""
    folder = tmp_path_factory.mktemp("made") / "run"
    write_results(run(load("mapping-rendezvous", [("--set", one) for one in SETTINGS]), 3), folder)
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


def setting(**values: Any) -> Callable[[Path], None]:
    """Set fields of the summary."""
    return in_summary(lambda summary: summary.update(values))


def _scaled(key: str, factor: float) -> Callable[[Path], None]:
    return in_summary(lambda summary: summary.update({key: summary[key] * factor}))


def _where(rows: Rows, **values: Any) -> dict[str, Any]:
    return next(row for row in rows if all(row[key] == value for key, value in values.items()))


def _without(**values: Any) -> Callable[[Rows], None]:
    return lambda rows: rows.remove(_where(rows, **values))


def _again(**values: Any) -> Callable[[Rows], None]:
    """The last row once more, with other values."""
    return lambda rows: rows.append({**rows[-1], **values})


def _moved(rows: Rows) -> None:
    rows[700]["y_m"] += 0.1


def _lower_energy(rows: Rows) -> None:
    rows[900]["energy_j"] -= 5


def _mirrored(rows: Rows) -> None:
    """The water carries all vehicles west, not east."""
    before: dict[str, tuple[float, float]] = {}
    for row in rows:
        time_s, x_m = before.get(row["vehicle"], (0.0, 0.0))
        before[row["vehicle"]] = row["time_s"], x_m - 0.6 * (row["time_s"] - time_s)
        row["x_m"] += before[row["vehicle"]][1]


def _cell_away(rows: Rows) -> None:
    """Of a vehicle that surveys more slowly than its sensor may; of another one, in a current, nothing is sure."""
    rows.remove(next(row for row in rows[100:] if row["vehicle"] == "AUV01"))


def _another_cell(rows: Rows) -> None:
    rows.append({**rows[-1], "cell_x": rows[0]["cell_x"], "cell_y": rows[0]["cell_y"], "vehicle": "AUV00"})


def _other_vehicle(rows: Rows) -> None:
    _where(rows, vehicle="AUV01")["vehicle"] = "AUV02"


def _to_lost(rows: Rows) -> None:
    row = next(row for row in rows if row["receivers"])
    row["lost_by"].append(row["receivers"].pop())
    row["arrivals_s"].pop()


def _unheard(rows: Rows) -> None:
    """A vehicle says a status of which it has lost the only packet."""
    row = next(row for row in rows if row["lost_by"] and row["status_uids"])
    teller = next(later for later in rows[rows.index(row) :] if later["sender"] == row["lost_by"][0])
    teller["status_uids"] += row["status_uids"]


def _across(rows: Rows) -> None:
    """A vehicle hears a packet from the other side of a cut."""
    row = next(row for row in rows if 420.0 < row["time_s"] < 450.0 and row["sender"] == "AUV00")
    row["lost_by"].remove("AUV01")
    row["receivers"].append("AUV01")
    row["arrivals_s"].append(row["end_s"] + 0.2)


def _to_nobody(rows: Rows) -> None:
    next(row for row in rows if row["lost_by"])["lost_by"].pop()


def _new_reception(rows: Rows) -> None:
    last = _where(rows, event="received", vehicle="AUV02")
    rows.append({**rows[-1], "vehicle": "AUV02", "item": last["item"], "origin": last["origin"], "event": "received"})


def _swapped(rows: Rows) -> None:
    rows[50], rows[60] = rows[60], rows[50]


def _other_origin(rows: Rows) -> None:
    row = _where(rows, kind="told")
    row["origin"] = "AUV02" if row["origin"] != "AUV02" else "AUV01"


def _other_time(summary: dict[str, Any]) -> None:
    stone = next(one for one in summary["milestones"] if one["name"] == "mapping_stopped")
    stone["time_s"] -= 30.0


def _earlier_meeting(summary: dict[str, Any]) -> None:
    stone = next(one for one in summary["milestones"] if one["name"] == "gathered")
    stone["time_s"] = 1000.0


def _no_meeting(summary: dict[str, Any]) -> None:
    summary["milestones"] = [one for one in summary["milestones"] if one["name"] != "gathered"]


def _other_unit(folder: Path) -> None:
    path = folder / "trajectories.parquet"
    table = pq.read_table(path)
    at = table.schema.get_field_index("x_m")
    field = table.schema.field(at).with_metadata({"unit": "km"})
    pq.write_table(table.cast(table.schema.set(at, field)), path)


def _damaged(folder: Path) -> None:
    (folder / "packets.parquet").write_bytes(b"PAR1 nothing PAR1")


CASES: dict[str, tuple[str, Callable[[Path], None]]] = {
    "distance": ("figures", _scaled("distance_m", 1.002)),
    "energy of all": ("figures", _scaled("energy_j", 0.999)),
    "modem energy": ("figures", _scaled("modem_energy_j", 1.01)),
    "latency": ("figures", _scaled("mean_latency_s", 0.99)),
    "delivery": ("figures", _scaled("delivery_ratio", 1.01)),
    "covered": ("figures", _scaled("coverage_fraction", 0.99)),
    "the 95 % latency is the 90 %": ("figures", _scaled("p95_latency_s", 0.7)),
    "packets": ("figures", in_summary(lambda s: s.update(n_packets=s["n_packets"] - 1))),
    "idle time": ("figures", _scaled("idle_s", 1.05)),
    "closest approach": ("figures", _scaled("closest_approach_m", 1.1)),
    "divergence of views": ("figures", setting(view_divergence=0.5)),
    "goal_fraction lowered": ("goal", setting(goal_fraction=0.9)),
    "completed flipped": ("verdict", setting(completed=False)),
    "another seed": ("identity", setting(seed=4)),
    "another strategy": ("identity", setting(strategy="cbba")),
    "milestone shifted": ("milestones", in_summary(_other_time)),
    "meeting too early": ("milestones", in_summary(_earlier_meeting)),
    "no meeting": ("verdict", in_summary(_no_meeting)),
    "a row moved": ("positions", in_table("trajectories", _moved)),
    "a tick missing": ("ticks", in_table("trajectories", lambda rows: rows.pop(800))),
    "energy lowered": ("energy", in_table("trajectories", _lower_energy)),
    "water flows west": ("positions", in_table("trajectories", _mirrored)),
    "another unit": ("units", _other_unit),
    "cell removed": ("swath", in_table("coverage", _cell_away)),
    "cell twice": ("coverage", in_table("coverage", _another_cell)),
    "cell of another": ("swath", in_table("coverage", _other_vehicle)),
    "goal row altered": ("goal", in_table("goal", lambda rows: rows[50].update(goal_fraction=0.9))),
    "received or not": ("figures", in_table("packets", _to_lost)),
    "relayed and not heard": ("senders", in_table("packets", _unheard)),
    "heard across a cut": ("receivers", in_table("packets", _across)),
    "a fate missing": ("receivers", in_table("packets", _to_nobody)),
    "another's slot": ("slots", in_table("packets", lambda rows: rows[30].update(slot=rows[30]["slot"] + 1))),
    "longer packet": ("sizes", in_table("packets", lambda rows: rows[30].update(size_bits=8 + rows[30]["size_bits"]))),
    "reception without packet": ("knowledge", in_table("knowledge", _new_reception)),
    "reception missing": ("received", in_table("knowledge", _without(event="received"))),
    "observation missing": ("observed", in_table("knowledge", _without(event="observed"))),
    "order of time": ("order", in_table("knowledge", _swapped)),
    "another origin": ("items", in_table("items", _other_origin)),
    "row twice": ("once", in_table("knowledge", lambda rows: rows.insert(21, dict(rows[20])))),
    "role left out": ("views", in_table("roles", _without(event="assigned"))),
    "role added": ("roles", in_table("roles", _again(role="LeftWinger", vehicle="ASV00", event="left"))),
    "fault removed": ("faults", in_table("faults", _without(kind="mute", detail="over"))),
    "fault added": ("faults", in_table("faults", _again(kind="deaf", detail="for good"))),
    "file unreadable": ("readable", _damaged),
}  # fmt: skip
"""What is altered: the check that should name it, and how."""


@pytest.mark.slow
def test_the_untouched_folder_passes(made: Path) -> None:
    report = verify(made)
    assert list(report.lines) == []
    assert sum(report.checked.values()) > 100_000


def named(check: str, alter: Callable[[Path], None], made: Path, folder: Path) -> bool:
    """True if a check finds what is altered in a folder."""
    shutil.copytree(made, folder)
    alter(folder)
    return check in verify(folder).n_findings


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_what_is_altered_is_named(case: str, made: Path, tmp_path: Path) -> None:
    assert named(*CASES[case], made, tmp_path / "altered")


def test_a_file_of_another_run_is_named(made: Path, other: Path, tmp_path: Path) -> None:
    folder = tmp_path / "mixed"
    shutil.copytree(made, folder)
    shutil.copy(other / "roles.parquet", folder / "roles.parquet")
    assert {one.table for one in verify(folder).findings if one.check == "run_id"} == {"roles"}
