"""The checker shares no code with the simulator, and finds no fault in runs of all kinds."""

import json
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.verification import verify

ALONE = """
import sys
import missions
before = set(sys.modules)
import missions.verification
ours = ("worldmodel", "exchange", "remoras", "missions", "visualisation")
added = sorted(name for name in set(sys.modules) - before if name.split(".")[0] in ours)
print(*[name for name in added if not name.startswith("missions.verification")])
"""
DRAINED = 'fault=[{kind="drains",vehicle="AUV01",at_s=62,until_s=99,drain_w=9},{kind="deaf",vehicle="AUV00",at_s=181}]'
ADRIFT = 'fault=[{kind="lost",vehicle="AUV01",at_s=100,until_s=500}]'
SLOWED = 'fault=[{kind="slow",vehicle="AUV01",at_s=100,factor=0.2}]'
RUNS = {
    "drains, and one that leads since it is deaf": ("mapping-rendezvous", [DRAINED, "channel.per=0.3"]),
    "misses, spread, drift": (
        "mapping-corridor",
        ["uncertainty.p_miss=0.2", "uncertainty.speed_spread=0.2", "navigation.drift=0.01"],
    ),
    "acoustic": ("mapping-rendezvous", ["channel.name=acoustic", "communication.count_listening=true"]),
    "adrift beyond the border": ("mapping-rendezvous", [ADRIFT, "current.north_mps=-1.0"]),
    "slower than the water": ("mapping-rendezvous", [SLOWED, "current.north_mps=-1.2"]),
    "a sensor that no role uses": ("mapping-inspection", ["vehicle.ASV00.sensor={swath_m=30,speed_limit_mps=2}"]),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("arrows-archaeology", "vehicle.AUV03.sensor=[]"),
        ("pandora-inspection", "strategy.name=remoras"),
        ("trident-intervention", "choreography.state.surveying.within_s=60"),
    ],
)
def test_runs_in_edge_cases_have_no_findings(name: str, setting: str, tmp_path: Path) -> None:
    """The first is over as it begins, without a table of images; in the second AUV00 leaves off homing at 2231 s."""
    write_results(run(load(name, [("--set", setting)]), 1), tmp_path / "run")
    assert list(verify(tmp_path / "run").lines) == []


def test_checker_imports_no_other_package_of_the_simulator() -> None:
    found = subprocess.run([sys.executable, "-c", ALONE], capture_output=True, text=True, check=True)
    assert found.stdout.split() == []


@pytest.mark.slow
@pytest.mark.parametrize("case", RUNS)
def test_runs_of_all_kinds_have_no_findings(case: str, tmp_path: Path) -> None:
    name, settings = RUNS[case]
    given = [("--set", one) for one in (*settings, "scenario.duration_s=600")]
    write_results(run(load(name, given), 7), tmp_path / "run")
    report = verify(tmp_path / "run")
    assert list(report.lines) == []
    assert report.checked["positions"] > 100
    assert report.checked["figures"] > 10


def test_last_ledger_line_of_a_repeated_run_counts(tmp_path: Path) -> None:
    rows = [{"key": "a", "summary": {"seed": 1, "mission_time_s": time_s}, "tables": ""} for time_s in (50.0, 90.0)]
    (tmp_path / "ledger.jsonl").write_text("".join(f"{json.dumps(row)}\n" for row in rows))
    pq.write_table(pa.table({"key": ["a"], "seed": [1], "mission_time_s": [90.0]}), tmp_path / "runs.parquet")
    assert list(verify(tmp_path).lines) == []


@pytest.mark.slow
def test_command_lists_contradictions(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    write_results(run(load("mapping-rendezvous", [("--set", "scenario.duration_s=60")]), 1), folder)
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(json.dumps({**summary, "n_packets": 1}))
    command = [sys.executable, "-m", "remoras", "verify"]
    found = subprocess.run([*command, str(folder), "--json"], capture_output=True, text=True, check=False)
    value = json.loads(found.stdout)
    assert found.returncode == 1
    assert [one["stated"] for one in value["findings"]] == ["n_packets is 1"]
    assert "false_beliefs" in value["not_checked"]
    shown = subprocess.run([*command, str(folder)], capture_output=True, text=True, check=False).stdout
    n_checked, n_others = sum(value["checked"].values()), len(value["not_checked"])
    assert f": {n_checked - 1} of {n_checked} checked values follow; {n_others} kinds unchecked\n" in shown
    none = subprocess.run([*command, str(tmp_path)], capture_output=True, text=True, check=False)
    assert none.returncode == 2
    assert len(none.stderr.splitlines()) == 1
