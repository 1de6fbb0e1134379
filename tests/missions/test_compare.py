"""Comparison with the baseline, paired by run; censored runs are included."""

import json
import random
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sweeping import finished, study_text, swept, written
from typer.testing import CliRunner

from missions.comparison import Comparison, Rank
from missions.comparison.baseline import compare
from missions.comparison.ranking import Contender, column_ranks, family_of, mean_ranks, ranks
from missions.comparison.sentences import statements
from missions.comparison.table import number
from missions.comparison.treatments import Measured, Treatment
from missions.errors import OutputError
from missions.runs.metrics import CORE_METRICS
from missions.sweeps.folder import SweepFolder, SweepResults
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import RunTask, SweepPlan
from missions.sweeps.study import load_study
from remoras.cli import app


def made_up(task: RunTask, completed: bool = True) -> FinishedRun:
    """A run whose time is 100 s, 10 s more per repeat and 5 s (6 s in every other) less with mps-ack."""
    gain_s = (5.0 + task.repeat % 2) * (task.scenario.communication.policy == "mps-ack")
    time_s = 100.0 + 10.0 * task.repeat - gain_s if completed else 500.0
    return finished(task, completed=completed, mission_time_s=time_s, n_bytes=7, mean_latency_s=None)


def raised(task: RunTask) -> FinishedRun:
    """A run in which a plug-in raised."""
    return FinishedRun({**finished(task).line, "status": "failed", "error": "ValueError: oops"})


def results(
    tmp_path: Path, made: Callable[[RunTask], FinishedRun] = made_up, repeats: int = 8, **options: Any
) -> SweepResults:
    """A sweep over ack and mps-ack whose runs are made up."""
    return swept(tmp_path, study_text(repeats=repeats, per="[0.1]", **options), made)


def ranked(values: dict[str, list[float]], done: dict[str, list[float]] | None = None) -> dict[str, Rank]:
    """Ranks of one column: values, and whether the mission was done, by strategy, in the order of repeats."""
    column = {
        Treatment("s", name, "ack", "bernoulli", 0.1, ()): Contender(
            Measured(dict(enumerate(own))), Measured(dict(enumerate(done[name] if done else [1.0] * len(own))))
        )
        for name, own in values.items()
    }
    return {rank.strategy: rank for rank in column_ranks(column, family_of([column]), CORE_METRICS[0])}


def row_of(rows: list[Comparison], policy: str, metric: str = "mission_time_s") -> Comparison:
    return next(row for row in rows if row.policy == policy and row.metric == metric)


def test_pairs_are_compared_run_by_run(tmp_path: Path) -> None:
    """Differences are -5 and -6 in turn: mean -5.5, variance 2/7; each policy alone has variance 600 or so."""
    rows = compare(results(tmp_path))
    json.dumps([asdict(row) for row in rows], allow_nan=False)
    assert len(rows) == 4
    other = row_of(rows, "mps-ack")
    assert other.baseline == "ack"
    assert other.diff_to_baseline == pytest.approx(-5.5)
    assert other.diff_reached == other.diff_to_baseline
    assert other.diff_reached_ci95_low is not None
    assert other.diff_reached_ci95_high is not None
    assert -6.2 < other.diff_reached_ci95_low < -5.5 < other.diff_reached_ci95_high < -4.8
    assert other.p_holm == pytest.approx(2 / 2**8)
    assert other.pairing_gain is not None
    assert other.pairing_gain > 1000
    assert other.effect_size == pytest.approx(-5.5 / 24.5, rel=0.02)
    own = row_of(rows, "ack")
    assert (own.diff_to_baseline, own.p_holm, own.mean, own.median) == (None, None, 135.0, 135.0)


def test_level_of_a_varied_key_is_a_baseline_for_each_policy(tmp_path: Path) -> None:
    """Runs take 20 s more at weight 2."""

    def slower_by_loss(task: RunTask) -> FinishedRun:
        summary = made_up(task).line["summary"]
        weight = task.scenario.decision.weight_external
        return finished(
            task, **{**summary, "mission_time_s": summary["mission_time_s"] + weight * 10 + task.repeat % 2}
        )

    text = study_text(repeats=8, per="[0.1]") + "\n[grid]\n'decision.weight_external' = [0.0, 2.0]\n"
    rows = compare(swept(tmp_path, text, slower_by_loss), ["mission_time_s"], "decision.weight_external=0.0")
    differences = {(row.policy, *row.settings.values()): row.diff_to_baseline for row in rows}
    assert differences == {(p, w): d for p in ("ack", "mps-ack") for w, d in (("0.0", None), ("2.0", 20.0))}
    assert {row.p_holm for row in rows} == {None, 2 / 2**8}


def test_level_of_the_channel_is_a_baseline_although_it_changes_the_loss_rate(tmp_path: Path) -> None:
    """Bursts that begin more often lose more packets: the mean loss rate follows, and runs take 20 s more."""

    def slower_by_bursts(task: RunTask) -> FinishedRun:
        summary = made_up(task).line["summary"]
        added_s = 20.0 * (task.scenario.channel.p_good_to_bad == 0.4)
        return finished(task, **{**summary, "mission_time_s": summary["mission_time_s"] + added_s})

    bursts = 'name = "gilbert-elliott"\np_bad_to_good = 0.5\np_good_to_bad = [0.1, 0.4]'
    text = study_text(repeats=8).replace('name = "bernoulli"\nper = [0.1, 0.4]', bursts)
    rows = compare(swept(tmp_path, text, slower_by_bursts), ["mission_time_s"], "channel.p_good_to_bad=0.1")
    differences = {(row.policy, row.settings["channel.p_good_to_bad"]): row.diff_to_baseline for row in rows}
    assert differences == {(p, at): d for p in ("ack", "mps-ack") for at, d in (("0.1", None), ("0.4", 20.0))}
    assert {row.p_holm for row in rows} == {None, 2 / 2**8}
    assert len({row.per for row in rows}) == 2


@pytest.mark.parametrize("baseline", ["per=0", "channel.per=0.0", "per=.0"])
def test_loss_rate_is_a_baseline_for_each_policy(tmp_path: Path, baseline: str) -> None:
    """Runs take 20 s more at the loss of 1/3: each policy is compared with itself at no loss, repeat by repeat."""

    def slower_by_loss(task: RunTask) -> FinishedRun:
        summary = made_up(task).line["summary"]
        return finished(task, **{**summary, "mission_time_s": summary["mission_time_s"] + 60 * summary["per"]})

    text = study_text(repeats=8, per=f"[0.0, {1 / 3}]").replace("seed = 7", f'seed = 7\nbaseline = "{baseline}"')
    found = swept(tmp_path, text, slower_by_loss)
    rows = compare(found, ["mission_time_s"])
    assert {row.baseline for row in rows} == {"per=0"}
    differences = {(row.policy, row.per > 0.0): row.diff_to_baseline for row in rows}
    expected = {(policy, lossy): 20.0 if lossy else None for policy in ("ack", "mps-ack") for lossy in (False, True)}
    assert differences == pytest.approx(expected)
    assert {row.p_holm for row in rows} == {None, 2 / 2**8}
    opposite = compare(found, ["mission_time_s"], f"per={1 / 3}")
    assert sorted(row.diff_to_baseline for row in opposite if row.diff_to_baseline) == pytest.approx([-20.0, -20.0])
    stated = [one.text for one in statements(CORE_METRICS[0], rows)]
    assert len(stated) == 2
    assert all(text.startswith(f"per={1 / 3} was slower than per=0 (") for text in stated)


def test_censored_runs_are_included(tmp_path: Path) -> None:
    """Two of eight were watched for 500 s: (2 * 500 + 120 + ... + 170) / 8 = 233.75 s."""
    found = results(tmp_path, lambda task: made_up(task, task.repeat >= 2))
    row = row_of(compare(found, ["mission_time_s", "completed"]), "ack")
    assert (row.n, row.n_completed, row.success_rate) == (8, 6, 0.75)
    assert row.mean == pytest.approx(233.75)
    success = row_of(compare(found, ["completed"]), "ack", "completed")
    assert (success.mean, success.ci95_low, success.ci95_high) == (0.75, row.success_ci95_low, row.success_ci95_high)
    assert found.status().censored == 4


def test_failed_runs_count_as_unsuccessful_with_the_full_duration(tmp_path: Path) -> None:
    """Two of eight raised: (2 * 1000 + 120 + ... + 170) / 8 = 358.75 s; bytes are those of the six others."""
    found = results(tmp_path, lambda task: raised(task) if task.repeat < 2 else made_up(task), duration_s=1000)
    rows = compare(found, ["mission_time_s", "completed", "n_bytes"])
    row = row_of(rows, "ack")
    assert (row.n, row.n_completed, row.n_failed, row.n_reached, row.success_rate) == (8, 6, 2, 6, 0.75)
    assert row.mean == pytest.approx(358.75)
    success = row_of(rows, "ack", "completed")
    assert (success.n, success.mean) == (8, 0.75)
    assert row_of(rows, "ack", "n_bytes").n == 6
    assert row_of(rows, "ack", "n_bytes").n_reached is None


def test_no_run_is_omitted_from_a_censored_metric(tmp_path: Path) -> None:
    """Mapped in 9 s, or not within the duration of 20 s with every other repeat: restricted mean (4 * 9 + 4 * 20) / 8.

    Differences are taken of restricted values: with mps-ack all need 9 s, so the mean is -(4 * 0 + 4 * 11) / 8 s.
    """

    def made(task: RunTask) -> FinishedRun:
        run, late = made_up(task), task.repeat % 2 == 0 and task.scenario.communication.policy == "ack"
        run.line["summary"]["time_to_95_s"] = None if late else 9.0
        return run

    rows = compare(results(tmp_path, made), ["time_to_95_s"])
    slow, quick = row_of(rows, "ack", "time_to_95_s"), row_of(rows, "mps-ack", "time_to_95_s")
    assert (slow.n, slow.n_reached, slow.mean) == (8, 4, 14.5)
    assert (quick.n, quick.n_reached, quick.mean, quick.diff_to_baseline) == (8, 8, 9.0, -5.5)
    assert slow.ci95_low is not None
    assert slow.ci95_low < 14.5
    assert slow.reached_mean == 9.0
    text = CliRunner().invoke(app, ["compare", str(tmp_path / "out"), "--metric", "time_to_95_s"]).stdout
    assert "restricted means: 4 of 16 runs did not complete and count with the full mission duration" in text


@pytest.mark.parametrize("n_incomplete", [0, 1])
def test_intervals_allow_for_incomplete_runs_only_if_some_are(tmp_path: Path, n_incomplete: int) -> None:
    """Of eight complete runs: range, and the plain paired interval, which excludes 0 as p = 0.0078 does."""
    found = results(tmp_path, lambda task: made_up(task, task.repeat >= n_incomplete))
    row = row_of(compare(found, ["mission_time_s"]), "mps-ack")
    plain = (row.diff_reached_ci95_low, row.diff_reached_ci95_high)
    assert ((row.diff_ci95_low, row.diff_ci95_high) == plain) is (n_incomplete == 0)
    assert (row.ci95_low is None) is (n_incomplete == 0)
    text = CliRunner().invoke(app, ["compare", str(tmp_path / "out"), "--metric", "mission_time_s"]).stdout
    head = text.splitlines()[1]
    if n_incomplete:
        assert "mean [95 %]  " in head
        assert "completed runs  difference to ack [95 %]  " in head
        assert "restricted means: 2 of 16 runs did not complete" in text
    else:
        assert head.split() == [
            "per",
            "strategy",
            "policy",
            "n",
            "done",
            "mean",
            "(range)",
            "difference",
            "to",
            "ack",
            "[95",
            "%]",
            "p",
        ]
        assert "135 (100 to 170)" in text
        assert "range: least to largest value; fewer than 30 runs" in text
        assert "completed" not in text
        assert "restricted" not in text


@pytest.mark.parametrize(
    ("repeats", "says", "is_bounded"),
    [(8, "no interval of a difference where fewer than 2 pairs completed on both sides", True),
     (7, "fewer than 8 pairs allow no interval of a difference", False)],
)  # fmt: skip
def test_the_reason_of_a_missing_interval_is_the_one_that_holds(
    tmp_path: Path, repeats: int, says: str, is_bounded: bool
) -> None:
    """With ack no run completes: the difference has no interval however many pairs there are."""

    def made(task: RunTask) -> FinishedRun:
        run = made_up(task, task.scenario.communication.policy != "ack")
        run.line["summary"]["n_bytes"] = task.repeat  # else the runs of ack are equal, hence one
        return run

    results(tmp_path, made, repeats)
    text = CliRunner().invoke(app, ["compare", str(tmp_path / "out"), "--metric", "mission_time_s"]).stdout
    assert [line.strip() for line in text.splitlines() if "interval of a difference" in line] == [says]
    assert ("their intervals allow" in text) is is_bounded
    figure = CliRunner().invoke(app, ["plot", str(tmp_path / "out"), "differences"])
    assert figure.exit_code == 0, figure.output
    caption = (tmp_path / "out" / "differences.txt").read_text(encoding="utf-8")
    assert ("No interval where fewer than 2 pairs completed on both sides." in caption) is is_bounded
    assert ("Fewer than 8 pairs have no interval." in caption) is not is_bounded


@given(st.floats(-1e12, 1e12))
def test_numbers_of_tables_have_four_digits_and_no_exponent_if_large(value: float) -> None:
    text = number(value)
    assert "e+" not in text
    assert float(text) == float(f"{value:.4g}")


def test_runs_without_value_of_a_metric_are_omitted(tmp_path: Path) -> None:
    """Nothing was lost in half of the runs, so there is nothing to recover from; one of the others never recovered."""

    def made(task: RunTask) -> FinishedRun:
        run = made_up(task)
        if task.repeat < 2:
            run.line["summary"]["recovery_time_s"] = None if run.line["repeat"] else 4.0
        return run

    row = row_of(compare(results(tmp_path, made, repeats=4), ["recovery_time_s"]), "ack", "recovery_time_s")
    assert (row.n, row.n_reached, row.mean) == (2, 1, (4.0 + 20.0) / 2)


def test_success_ranks_before_the_metric_and_unequal_work_is_marked() -> None:
    """a is quicker but completes 3 of 16, b all, c 15: time decides between b and c, not distinct; a is last."""
    times = {"a": [1.0] * 16, "b": [5.0] * 16, "c": [4.0] * 16}
    done = {"a": [1.0] * 3 + [0.0] * 13, "b": [1.0] * 16, "c": [1.0] * 15 + [0.0]}
    found = ranked(times, done)
    assert [found[name].rank for name in "cba"] == [1, 2, 3]
    assert [found[name].unequal_success for name in "cba"] == [False, False, True]
    assert not found["a"].among_best


def test_a_ranking_and_a_comparison_give_the_same_p(tmp_path: Path) -> None:
    """All eight differences have one sign: 2 of 2**8 flips."""
    found = results(tmp_path)
    best, other = sorted(ranks(found, "mission_time_s"), key=lambda rank: rank.rank)
    assert (best.policy, best.rank, best.p_to_best, best.among_best) == ("mps-ack", 1.0, None, True)
    assert (other.policy, other.rank, other.among_best) == ("ack", 2.0, False)
    compared = row_of(compare(found, ["mission_time_s"], baseline="mps-ack"), "ack")
    assert other.p_to_best == compared.p_holm == pytest.approx(2 / 2**8)
    assert mean_ranks([best, other]) == {("remoras", "mps-ack"): 1.0, ("remoras", "ack"): 2.0}


def test_strategies_not_distinguishable_from_the_best_are_marked() -> None:
    """b - a: -1 and 2 in turn; c - a: 9 and 10 in turn, in all eight."""
    a = [float(repeat) for repeat in range(8)]
    found = ranked({"a": a, "b": [x + (2 if x % 2 else -1) for x in a], "c": [x + 9 + x % 2 for x in a]})
    assert [found[name].rank for name in "abc"] == [1, 2, 3]
    assert [found[name].among_best for name in "abc"] == [True, True, False]


def test_pairs_of_a_column_share_one_error_rate() -> None:
    """One difference is significant between two strategies, but not as one pair among ten."""
    draws = random.Random(3)
    noise = {name: [draws.gauss(0.0, 1.0) for _ in range(10)] for name in "cdefghij"}
    noise |= {"a": [0.0] * 10, "b": [2.0, 3.0, -1.0, 2.5, 1.0, 3.0, -0.5, 2.0, 1.5, 1.0]}
    alone, amid = ranked({name: noise[name] for name in "ab"})["b"], ranked(noise)["b"]
    assert alone.p_to_best is not None
    assert amid.p_to_best is not None
    assert alone.p_to_best < 0.05 < amid.p_to_best


@given(st.lists(st.lists(st.integers(0, 5), min_size=3, max_size=3), min_size=1, max_size=6))
def test_ranks_have_a_fixed_sum_and_the_best_is_marked(columns: list[list[int]]) -> None:
    """Ranks of k strategies add up to k (k + 1) / 2 whatever the ties."""
    found = ranked({str(number): [float(x) for x in own] for number, own in enumerate(columns)}).values()
    assert sum(rank.rank for rank in found) == len(columns) * (len(columns) + 1) / 2
    assert min(found, key=lambda rank: rank.rank).among_best


@pytest.mark.parametrize(("metrics", "baseline"), [(["mission_time"], None), ([], "remora")])
def test_unknown_names_are_refused_with_the_nearest(tmp_path: Path, metrics: list[str], baseline: str | None) -> None:
    with pytest.raises(OutputError, match="did you mean"):
        compare(results(tmp_path), metrics, baseline)


def test_sweep_without_finished_runs_is_refused(tmp_path: Path) -> None:
    SweepFolder(tmp_path / "out", SweepPlan(load_study(str(written(tmp_path, study_text()))))).close()
    with pytest.raises(OutputError, match="no run has finished"):
        compare(SweepResults.read(tmp_path / "out"))
    with pytest.raises(OutputError, match="no results of a sweep"):
        SweepResults.read(tmp_path)
