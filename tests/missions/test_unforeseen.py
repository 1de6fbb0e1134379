"""Unforeseen events, and the number of vehicles, as axes of a study."""

import itertools
import json
import shlex
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from sweeping import study_text, written

from missions.comparison import compare, ranks
from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.scenarios import load
from missions.sweeps import SweepResults, load_study, sweep
from missions.sweeps.folder import RUNS
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan

NOTHING = '[[unforeseen]]\nname = "nothing"\n'
SPREAD = '[[unforeseen]]\nname = "speeds within 30 %"\n[unforeseen.set]\n"uncertainty.speed_spread" = 0.3\n'
LOST = '[[unforeseen]]\nname = "one lost"\n[[unforeseen.fault]]\nvehicle = "any"\nkind = "lost"\nat_s = [3.0, 15.0]\n'


def test_unforeseen_case_is_a_column_of_runs_and_comparisons(tmp_path: Path) -> None:
    """Pairs and ranks are within one entry: two policies, one loss rate, two entries."""
    text = study_text(repeats=2, per="[0.1]", extra=SPREAD + NOTHING)
    sweep(load_study(str(written(tmp_path, text))), tmp_path / "out")
    column = pq.read_table(tmp_path / "out" / RUNS).column("unforeseen").to_pylist()
    assert sorted(column) == 4 * ["nothing"] + 4 * ["speeds within 30 %"]
    rows = compare(SweepResults.read(tmp_path / "out"), ["n_bytes"])
    assert [row.unforeseen for row in rows] == 2 * ["speeds within 30 %"] + 2 * ["nothing"]  # in the order of the file
    assert all(row.settings == {} for row in rows)
    assert [row.diff_to_baseline is None for row in rows] == 2 * [True, False]
    ranked = ranks(SweepResults.read(tmp_path / "out"), "n_bytes")
    assert sorted(rank.rank for rank in ranked if rank.unforeseen == "nothing") in ([1, 2], [1.5, 1.5])


@pytest.mark.parametrize(
    ("extra", "expected"),
    [
        (NOTHING + NOTHING, 'study.toml:20: unforeseen.2.name = "nothing": a second entry of this name'),
        (NOTHING + NOTHING.replace("nothing", "calm"), 'unforeseen.2.name = "calm": sets nothing, and neither does'),
        (NOTHING + SPREAD.replace("0.3", "0.0"), 'runs alike with it and with "nothing"'),
        (LOST.replace('"any"', '"AUV09"'), 'study.toml:20: unforeseen.one lost.fault.1.vehicle = "AUV09": allowed: '),
        (LOST + '[grid]\n"fault.1.at_s" = [1.0]\n', "grid.fault.1.at_s: [[unforeseen.fault]] sets all faults"),
    ],
)
def test_faulty_entries_are_named_with_line_and_key(tmp_path: Path, extra: str, expected: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        load_study(str(written(tmp_path, study_text(extra=extra))))
    assert expected in str(caught.value)


def test_faults_are_drawn_per_run_and_can_be_replayed(tmp_path: Path) -> None:
    """Runs of one repeat lose the same vehicle at the same time under every policy."""
    study = load_study(str(written(tmp_path, study_text(per="[0.1]", extra=NOTHING + LOST))))
    assert [one.unforeseen for one in study.configurations] == ["nothing", "one lost"] * 2
    assert [len(one.scenario.fault) for one in study.configurations] == [0, 1] * 2
    plan = SweepPlan(study)
    lost = [run(plan.task(number, 0).scenario, plan.task(number, 0).seed).recorder.faults for number in (1, 3)]
    assert lost[0] == lost[1] != []
    task = plan.task(3, 0)
    words = shlex.split(task.replay)
    overrides = [("--set", value) for option, value in itertools.pairwise(words) if option == "--set"]
    assert load(words[2], overrides) == task.scenario


def test_the_size_is_an_ordinary_setting_of_ledger_table_and_comparison(tmp_path: Path) -> None:
    """Sizes come in the order of numbers: 4 before 16, which as words would come after."""
    text = study_text(repeats=2, per="0.4").replace('policies = ["ack", "mps-ack"]', 'policies = ["ack"]')
    text = text.replace("seed = 7", "seed = 7\nvehicles = [16, 4, 8]")
    sweep(load_study(str(written(tmp_path, text))), tmp_path / "out", jobs=1)
    lines = [json.loads(line) for line in (tmp_path / "out" / LEDGER).read_text(encoding="utf-8").splitlines()]
    assert len(lines) == 3 * 2
    assert all(line["settings"]["fleet.size"] == line["summary"]["n_vehicles"] for line in lines)
    results = SweepResults.read(tmp_path / "out")
    assert sorted(results.runs()["n_vehicles"]) == sorted(results.runs()["fleet.size"]) == [4, 4, 8, 8, 16, 16]
    assert [row.settings["fleet.size"] for row in compare(results, ["n_bytes"])] == ["4", "8", "16"]
