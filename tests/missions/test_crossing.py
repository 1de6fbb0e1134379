"""Crossings: estimates and confidence sets on differences with known truth, the command, and refinement."""

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sweeping import finished, study_text, swept, written
from typer.testing import CliRunner

from benchmarks.crossing import LEVELS, SHAPES, covers, drawn, pairs_of
from missions.comparison.crossing import STEPS, Pairs, crossings, refine
from missions.errors import OutputError
from missions.statistics import step_down_p
from missions.sweeps.driver import sweep
from missions.sweeps.folder import SweepFolder, SweepResults
from missions.sweeps.ledger import LEDGER, FinishedRun
from missions.sweeps.plan import RunTask, SweepPlan
from missions.sweeps.study import load_study
from remoras.cli import app

SWAY = (-3.0, 3.0, -2.0, 2.0, -1.0, 1.0, -2.5, 2.5)
"""Deviations of eight repeats, symmetric about zero."""
values = st.lists(st.floats(-1e3, 1e3), min_size=8, max_size=8)


def balanced(*columns: list[float]) -> Pairs:
    """Eight repeats, which all have levels 0, 1 and so on."""
    knots = np.arange(float(len(columns)))
    return pairs_of(knots, {float(level): np.array(column) for level, column in enumerate(columns)})


@given(values, values)
def test_with_all_repeats_at_all_levels_the_test_is_that_of_the_interpolated_differences(
    a: list[float], b: list[float]
):
    pairs = balanced(a, b)
    for cell in (0, 10, STEPS):
        share = cell / STEPS
        own = [(1.0 - share) * x + share * y for x, y in zip(a, b, strict=True)]
        if abs(sum(own)) > 1e-6:
            assert pairs.p[cell] == pytest.approx(step_down_p([[value] for value in own])[0], abs=2 / 256)


@given(values, values, values, st.sampled_from([-1.0, 2.0, -4.0]))
def test_scale_and_direction_of_the_differences_move_no_crossing(
    a: list[float], b: list[float], c: list[float], scale: float
):
    pairs, scaled = balanced(a, b, c), balanced(*([scale * value for value in own] for own in (a, b, c)))
    assert [level for _, level in scaled.crossings] == pytest.approx([level for _, level in pairs.crossings])
    assert scaled.confidence_set == pairs.confidence_set


def test_a_line_crosses_where_it_is_zero_and_the_interval_is_about_it():
    pairs = balanced([-30.0 + sway for sway in SWAY], [10.0 + sway for sway in SWAY])
    assert [level for _, level in pairs.crossings] == pytest.approx([0.75])
    ((low, high),) = pairs.confidence_set
    assert low < 0.75 < high
    assert high - low < 0.2
    assert pairs.probability == 1.0
    wide = balanced([-30.0 + 4.0 * sway for sway in SWAY], [10.0 + 4.0 * sway for sway in SWAY])
    assert wide.confidence_set[0][0] < low


def test_no_and_several_crossings_are_told_apart():
    above = [20.0 + sway for sway in SWAY]
    below = [-20.0 + sway for sway in SWAY]
    apart = balanced(above, above, above)
    assert (apart.crossings, apart.confidence_set, apart.probability) == ([], [], 0.0)
    with pytest.raises(OutputError, match="no crossing in 0 to 2"):
        apart.next_level()
    twice = balanced(above, below, above)
    assert [level for _, level in twice.crossings] == pytest.approx([0.5, 1.5])
    assert len(twice.confidence_set) == 2


@pytest.mark.parametrize("shape", SHAPES)
def test_nineteen_of_twenty_confidence_sets_hold_the_crossing_of_a_drawn_curve(shape: str):
    draws = np.random.default_rng(5)
    held = 0
    for _ in range(300):
        study = drawn(draws, shape, 0.2, "normal")
        held += covers(pairs_of(LEVELS, {level: study.cell(draws, level, 8) for level in LEVELS}), study.at)
    # 3 standard errors about 95 % are 3.8 %.
    assert 0.91 <= held / 300 <= 0.99


def test_the_next_level_is_near_the_crossing_and_not_where_much_is_known():
    pairs = balanced([-30.0 + 4.0 * sway for sway in SWAY], [30.0 + 4.0 * sway for sway in SWAY])
    level = pairs.next_level()
    assert 0.2 <= level <= 0.8
    more = np.array([4.0 * sway for sway in SWAY * 4])
    known = Pairs(
        pairs.knots,
        np.append(pairs.levels, np.full(32, 0.5)),
        np.append(pairs.differences, more),
        np.append(pairs.repeats, 100.0 + np.arange(32.0)),
    )
    width, before = (sum(high - low for low, high in it.confidence_set) for it in (known, pairs))
    assert width < before


def test_noise_about_zero_is_no_crossing_with_significant_leaders():
    assert balanced(list(SWAY), [-value for value in SWAY]).significant == (False, False)
    above, below = [9.0 + sway for sway in SWAY], [-9.0 + sway for sway in SWAY]
    assert balanced(above, list(SWAY)).significant == (False, True)
    assert balanced(above, below).significant == (True, True)


def made_up(task: RunTask) -> FinishedRun:
    """A run in which mps-ack is slower by 10 s at a loss of 0.1, and faster by 30 s at 0.5."""
    loss = task.scenario.channel.per
    slower = (10.0 - 100.0 * (loss - 0.1)) * (task.scenario.communication.policy == "mps-ack")
    return finished(
        task, completed=True, mission_time_s=100.0 + slower + SWAY[task.repeat % 8] * (0.5 + loss), n_bytes=7
    )


def command(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["compare", *map(str, arguments)])
    assert result.exit_code == 0, result.output
    return result.output


def said(*arguments: object) -> str:
    result = CliRunner().invoke(app, ["compare", *map(str, arguments)])
    assert result.exit_code == 2, result.output
    assert result.stderr.count("\n") == 1
    return result.stderr


def test_the_command_says_who_leads_where(tmp_path: Path):
    folder = swept(tmp_path, study_text(repeats=8, per="[0.1, 0.5]"), made_up).folder
    (row,) = json.loads(command(folder, "--crossing", "ack,mps-ack", "--json"))
    assert row["at"] == pytest.approx([0.2])
    assert row["leaders"] == ["ack", "mps-ack"]
    assert (row["n_least"], row["n_most"], row["probability"]) == (8, 8, 1.0)
    for order in ("ack,mps-ack", "mps-ack,ack"):
        assert re.search(r"  ack below 0\.\d+, mps-ack above  ", command(folder, "--crossing", order))
    assert "all values are equal" in command(folder, "--crossing", "ack,mps-ack", "--metric", "n_bytes")
    for wrong, why in (
        (("--crossing", "ack"), "allowed: A,B"),
        (("--crossing", "ack,ack"), "that differ"),
        (("--crossing", "ack,mps"), "did you mean 'mps-ack'"),
        (("--crossing", "ack,remoras"), "two strategies, two policies"),
        (("--crossing", "ack,mps-ack", "--axis", "fleet.size"), "--axis 'fleet.size': allowed are per"),
        (("--crossing", "ack,mps-ack", "--where", "per=0.1"), "one level, 0.1"),
        (("--crossing", "ack,mps-ack", "--where", "strategy=cbba"), "--where 'strategy=cbba'"),
        (("--crossing", "ack,mps-ack", "--metric", "n_byte"), "n_bytes"),
        (("--crossing", "ack,mps-ack", "--effects"), "no --baseline, --effects"),
        (("--refine", "4"), "apply to --crossing A,B"),
    ):
        assert why in said(folder, *wrong)


@pytest.mark.parametrize("n", [3, 8])
def test_a_lead_by_chance_is_not_called_significant(tmp_path: Path, n: int):
    """The differences are those of ``SWAY`` about nearly zero; fewer than 6 pairs give no test at all."""

    def alike(task: RunTask) -> FinishedRun:
        sway = (0.1 + SWAY[task.repeat % 8]) * (task.scenario.communication.policy == "mps-ack")
        return finished(task, completed=True, mission_time_s=100.0 + sway)

    folder = swept(tmp_path, study_text(repeats=n, per="[0.1, 0.5]"), alike).folder
    (row,) = json.loads(command(folder, "--crossing", "ack,mps-ack", "--json"))
    assert row["leaders"]
    assert set(row["leaders"]) <= set(row["unsure"])
    assert f"{row['leaders'][0]} (not significant) throughout" in command(folder, "--crossing", "ack,mps-ack")


def test_two_levels_of_a_key_cross_along_another_one(tmp_path: Path):
    grid = '[grid]\n"communication.lease_frames" = [30, 40, 60]\n"communication.parking" = [true, false]\n'

    def run(task: RunTask) -> FinishedRun:
        own = task.scenario.communication
        gain = (own.lease_frames - 45.0) * (not own.parking)
        return finished(task, completed=True, mission_time_s=100.0 + gain + SWAY[task.repeat] * own.lease_frames / 40)

    folder = swept(tmp_path, study_text(repeats=8, per="[0.1]", extra=grid), run).folder
    rows = crossings(
        SweepResults.read(folder), "communication.parking=True,False", axis="communication.lease_frames", where=()
    )
    assert [row.condition for row in rows] == [{"policy": "ack"}, {"policy": "mps-ack"}]
    assert rows[0].at == pytest.approx((45.0,))
    assert rows[0].leaders == ("False", "True")
    text = "communication.parking=True,False"
    (only,) = crossings(SweepResults.read(folder), text, axis="communication.lease_frames", where=["policy=mps-ack"])
    assert only.at == rows[1].at


def test_a_metric_without_values_has_no_pairs(tmp_path: Path):
    def run(task: RunTask) -> FinishedRun:
        return finished(task, completed=True, mission_time_s=100.0, mean_latency_s=None, drawn=False)

    results = swept(tmp_path, study_text(repeats=2, per="[0.1, 0.5]"), run)
    with pytest.raises(OutputError, match="no pairs of finished runs; 8 of 8"):
        crossings(results, "ack,mps-ack", "mean_latency_s")


def test_an_unfinished_study_states_how_many_runs_have_finished(tmp_path: Path):
    plan = SweepPlan(load_study(str(written(tmp_path, study_text(repeats=2, per="[0.1, 0.5]")))))
    folder = SweepFolder(tmp_path / "out", plan)
    folder.append([made_up(task) for task in itertools.islice(plan.missing({}), 1)])
    folder.close()
    result = CliRunner().invoke(app, ["compare", str(tmp_path / "out"), "--crossing", "ack,mps-ack"])
    assert result.exit_code == 2
    assert "1 of 8 runs have finished" in result.stderr
    assert "no pairs of finished runs" in result.stderr


def test_refinement_adds_pairs_and_resumes_after_a_kill_without_losing_a_run(tmp_path: Path):
    study = load_study(str(written(tmp_path, study_text(repeats=3, per="[0.1, 0.5]", duration_s=5))))
    sweep(study, tmp_path / "out", jobs=1)
    results = SweepResults.read(tmp_path / "out")
    refine(results, 2, "ack,mps-ack", "n_bytes", jobs=1)
    (folder,) = (tmp_path / "out" / "refined").iterdir()
    lines = (folder / LEDGER).read_text().splitlines(keepends=True)
    assert len(lines) == 4
    assert {json.loads(line)["summary"]["policy"] for line in lines} == {"ack", "mps-ack"}
    seeds = {line["summary"]["seed"] for line in results.lines.values()}
    assert seeds.isdisjoint(json.loads(line)["summary"]["seed"] for line in lines)
    (folder / LEDGER).write_text("".join(lines[:3]))
    refine(results, 2, "ack,mps-ack", "n_bytes", jobs=1)
    (only,) = (tmp_path / "out" / "refined").iterdir()
    again = (only / LEDGER).read_text().splitlines(keepends=True)
    assert again[:3] == lines[:3]
    assert len(again) == 4
    (row,) = crossings(results, "ack,mps-ack", "n_bytes")
    assert row.n_most >= 2
