"""Whole runs: the same seed, no messages at all, every strategy, conformance, and what is drawn."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pyarrow as pa
import pytest
from matplotlib.figure import Figure as Sheet
from sampling import sampled
from servicing import flown

from missions.figure import Mark
from missions.pandora.metrics import FIGURES, n_false_alarms
from missions.runs.run import Run, run
from missions.runs.summary import summary
from missions.scenarios import load
from remoras.strategies import strategies

STUCK = {"upset": [{"kind": "stuck", "part": "valve A1"}]}


def test_the_same_seed_gives_the_same_rows(tmp_path: Path) -> None:
    first, again, other = (flown(tmp_path, seed=seed, **STUCK).recorder for seed in (1, 1, 2))
    assert all(first.rows(table) == again.rows(table) for table in first.tables)
    assert first.items != other.items


def test_with_all_messages_lost_vehicles_work_and_come_home(tmp_path: Path) -> None:
    done = flown(tmp_path, channel={"per": 0.999999})
    assert summary(done)["delivery_ratio"] == 0.0
    assert len(done.recorder.rows("serviced")) == 5
    (dock,) = done.scenario.rally_point
    for row in done.recorder.trajectories[-2:]:
        assert abs(row[2] - dock.position_m[0]) <= 25.0
        assert abs(row[3] - dock.position_m[1]) <= 25.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", sampled([one for one in strategies() if one != "oracle"], "remoras", "central", "contract-net", "cbba")
)
def test_every_strategy_has_all_serviced(tmp_path: Path, name: str) -> None:
    done = flown(tmp_path, strategy={"name": name}, **STUCK)
    assert done.goal_fraction == 1.0, done.reason


@pytest.mark.slow
def test_without_faults_there_are_no_more_false_alarms_than_stated() -> None:
    """Seven tests on each of three vehicles, stated at 0.4 per hour each, over 5 runs of about 0.36 h: 15 at most.

    Readings come only at work, so there are fewer. A Poisson number of mean 15 exceeds 25 in 1 of 200.
    """
    alarms = 0
    for seed in range(1, 6):
        none = [
            ("--set", key) for key in ("fault=[]", "upset=[]", "current.surge=[]", "mission.false_alarms_per_h=0.4")
        ]
        done = run(load("pandora-inspection", none), seed)
        assert done.completed, done.reason
        alarms += n_false_alarms(done)
    assert alarms <= 25


class Style:
    """As the package that draws hands it in."""

    black, grey = "#000000", "#666666"
    looks: ClassVar = {name: SimpleNamespace(colour="red", line="-", marker="o") for name in ("AUV00", "AUV01")}

    def axis(self, label: str, unit: str = "") -> str:
        return f"{label} in {unit}"


def test_figures_show_what_was_taken_for_done_and_what_was_found(tmp_path: Path) -> None:
    done = flown(tmp_path, "tactical", **STUCK)
    drawn = {one.name: Sheet().subplots() for one in FIGURES if not isinstance(one, Mark)}
    tables = {name: pa.table(_columns(done, name)) for name in done.recorder.tables}
    results = SimpleNamespace(
        table=tables.__getitem__, has=tables.__contains__, manifest={"scenario": (tmp_path / "little.toml").read_text()}
    )
    captions = {one.name: one.draw(drawn[one.name], results, Style()) for one in FIGURES if not isinstance(one, Mark)}
    claimed, serviced = (line.get_ydata() for line in drawn["serviced"].get_lines())
    assert (max(claimed), max(serviced)) == (5, 4)
    assert [label.get_text() for label in drawn["findings"].get_yticklabels()] == ["stuck: valve A1", "resists"]
    assert captions["structure"] == "Parts that were not serviced: 1."


def _columns(done: Run, table: str) -> dict[str, list[Any]]:
    names, rows = done.recorder.tables[table].column_names, done.recorder.rows(table)
    return {name: [row[at] for row in rows] for at, name in enumerate(names)}
