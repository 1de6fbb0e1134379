"""Folders of sweeps that the version before wrote: without declared metrics, with references that are gone."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from missions.comparison import compare, ranks
from missions.errors import OutputError, StudyChangedError
from missions.metric import Better
from missions.sweeps import SweepResults, load_study
from missions.sweeps.folder import SweepFolder
from missions.sweeps.plan import Demand, RunSchedule, SweepPlan
from missions.sweeps.study_file import StudyFile
from remoras.cli import app

DIGESTS = ["1b7c" * 16, "2b7c" * 16]
STUDY: dict[str, Any] = {
    "study": {
        "name": "older", "scenario": ["mapping-patches"], "strategies": ["remoras", "fixed-partition"],
        "policies": None, "vehicles": None, "repeats": 3, "seed": 2011,
        "metrics": ["mission_time_s", "coverage_fraction", "n_bytes"], "baseline": "fixed-partition",
        "sampling": "grid", "samples": 10, "keep_tables": 1,
    },
    "channel": [{"name": "bernoulli", "per": [0.6]}],
    "set": {}, "grid": {}, "point": [], "latin": {}, "stopping": None,
}  # fmt: skip
LINE = (
    '{"key": "KEY", "status": "done", "repeat": REPEAT, "settings": {"strategy.name": "STRATEGY", "channel.name": '
    '"bernoulli", "channel.per": 0.6}, "summary": {"scenario": "mapping-patches", "strategy": "STRATEGY", "policy": '
    '"ack", "channel": "bernoulli", "per": 0.6, "seed": 34555051360347, "n_vehicles": 4, "completed": true, "reason": '
    '"", "mission_time_s": TIME, "coverage_fraction": 1.0, "mapping_time_s": 1898.0, "duplicate_fraction": 0.0, '
    '"least_mapped_fraction": 0.28, "distance_m": 11276.854, "energy_j": 1115177.37, "modem_energy_j": 5075.42, '
    '"n_packets": 1242, "n_bytes": 29374, "delivery_ratio": 0.4, "mean_latency_s": 4.2122, "p95_latency_s": 7.4883, '
    '"consistency_time_s": 4.2764, "consistent_fraction": 1.0, "false_beliefs": 0, "milestones": [{"name": '
    '"mission_complete", "vehicle": "", "group": "", "time_s": 2201.0}]}, "error": "", "replay": "", "tables": false, '
    '"machine": {"wall_s": 0.2, "cpu_s": 0.2, "host": "h", "worker": 9, "finished_at": "2026-11-01T00:00:00Z"}}\n'
)
"""As the version before wrote it."""


@pytest.fixture
def older(tmp_path: Path) -> Path:
    """Four of six runs: mission times 2000 s and 2001 s with remoras, 2100 s and 2101 s with fixed-partition."""
    folder = tmp_path / "older"
    folder.mkdir()
    mission = {"name": "mapping-patches", "mission": "missions.mapping_rendezvous:MappingRendezvous"}
    record = {
        "version": "0.1.0", "study": STUDY, "scenario": {"mapping-patches": {"scenario": mission}}, "code": {},
        "digests": DIGESTS,
    }  # fmt: skip
    (folder / "study.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
    schedule = RunSchedule("0.1.0", Demand.of(StudyFile.model_validate(STUDY)), tuple(DIGESTS))
    lines = [
        LINE.replace("KEY", schedule.key(number, repeat)).replace("STRATEGY", strategy).replace("REPEAT", str(repeat))
        .replace("TIME", f"{time_s + repeat}")
        for number, (strategy, time_s) in enumerate({"remoras": 2000.0, "fixed-partition": 2100.0}.items())
        for repeat in range(2)
    ]  # fmt: skip
    (folder / "ledger.jsonl").write_text("".join(lines), encoding="utf-8")
    return folder


def test_it_says_how_far_it_is(older: Path) -> None:
    shown = CliRunner().invoke(app, ["status", str(older), "--json"])
    assert json.loads(shown.stdout) == {"planned": 6, "done": 4, "failed": 0, "censored": 0, "remaining": 2}


def test_all_metrics_of_its_study_are_compared(older: Path) -> None:
    rows = compare(SweepResults.read(older))
    assert [row.metric for row in rows] == [name for name in STUDY["study"]["metrics"] for _ in range(2)]
    assert next(row for row in rows if row.strategy == "remoras").diff_to_baseline == -100.0
    shown = CliRunner().invoke(app, ["compare", str(older), "--metric", "least_mapped_fraction", "--json"])
    assert [row["mean"] for row in json.loads(shown.stdout)] == [0.28, 0.28]


def test_metrics_of_every_run_have_their_direction(older: Path) -> None:
    results = SweepResults.read(older)
    assert {rank.strategy: rank.rank for rank in ranks(results, "mission_time_s")} == {
        "remoras": 1.0, "fixed-partition": 2.0,
    }  # fmt: skip
    assert results.metrics["consistent_fraction"].better is Better.HIGHER
    assert "seed" not in results.metrics


def test_a_metric_of_a_mission_that_is_still_there_has_the_direction_that_it_declares_now(older: Path) -> None:
    assert len(ranks(SweepResults.read(older), "coverage_fraction")) == 2
    assert SweepResults.read(older).metrics["duplicate_fraction"].better is Better.LOWER


def test_a_metric_of_a_mission_that_is_gone_is_compared_and_not_ranked(older: Path) -> None:
    path = older / "study.json"
    path.write_text(path.read_text().replace("missions.mapping_rendezvous:MappingRendezvous", "gone.mission:Mission"))
    assert len(compare(SweepResults.read(older), ["coverage_fraction"])) == 2
    with pytest.raises(
        OutputError, match=r"'coverage_fraction': cannot be ranked, .* not say .*; allowed are .*mission_t"
    ):
        ranks(SweepResults.read(older), "coverage_fraction")


@pytest.mark.parametrize("kind", ["mission-time", "ranking"])
def test_it_is_drawn(older: Path, tmp_path: Path, kind: str) -> None:
    shown = CliRunner().invoke(app, ["plot", str(older), kind, "--out", str(tmp_path / "figures")])
    assert shown.exit_code == 0, shown.output
    assert (tmp_path / "figures" / f"{kind}.png").stat().st_size


def test_it_does_not_go_on_and_nothing_of_it_is_lost(older: Path) -> None:
    before = {path.name: path.read_bytes() for path in older.iterdir()}
    with pytest.raises(StudyChangedError):
        SweepFolder(older, SweepPlan(load_study("strategies-quick")))
    assert {path.name: path.read_bytes() for path in older.iterdir() if path.name != "lock"} == before
