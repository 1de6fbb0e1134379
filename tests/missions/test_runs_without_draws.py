"""Repeats of a run without random draws are one run: made once, and compared without a test."""

from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from recorded import flown
from sweeping import Serial, finished, study_text, written
from typer.testing import CliRunner

from missions.comparison.baseline import compare
from missions.comparison.ranking import ranks
from missions.comparison.treatments import Measured, RunOutcome, is_one_run, paired_with
from missions.statistics import NoInterval
from missions.sweeps.driver import estimate, sweep
from missions.sweeps.folder import SweepFolder, SweepResults
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import RunTask, SweepPlan
from missions.sweeps.study import load_study
from missions.sweeps.worker import run_task
from remoras.cli import app


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ((), False),
        (("channel.name=bernoulli", "channel.per=0.0"), False),
        (("channel.name=bernoulli", "channel.per=0.000001"), True),
        (("channel.per=0.0", "uncertainty.speed_spread=0.1"), True),
        (("channel.per=0.0", "uncertainty.p_miss=0.001"), True),
        (("channel.per=0.0", "navigation.drift=0.01"), True),
        (("strategy.name=fixed-partition", "channel.name=bernoulli", "channel.per=0.3"), False),  # says nothing
    ],
)
def test_run_states_if_random_numbers_were_used(settings: tuple[str, ...], expected: bool) -> None:
    assert flown("mapping-rendezvous", "scenario.duration_s=60", *settings).drawn is expected


def swept(tmp_path: Path, repeats: int = 9) -> SweepResults:
    """Lossless and lossy, two policies."""
    study = load_study(str(written(tmp_path, study_text(repeats=repeats, per="[0.0, 0.4]"))))
    sweep(study, tmp_path / "out", executor=Serial())
    return SweepResults.read(tmp_path / "out")


@pytest.mark.slow
def test_a_run_without_draws_is_made_once_and_compared_without_chance(tmp_path: Path) -> None:
    found = swept(tmp_path)
    status = found.status()
    assert (status.planned, status.done, status.remaining) == (2 * (1 + 9), 20, 0)
    rows = compare(found, ["n_bytes"])
    lossless = [row for row in rows if row.per == 0.0]
    assert [(row.n, row.deterministic, row.ci95_low, row.p_holm) for row in lossless] == [(1, True, None, None)] * 2
    assert {row.ci95_note for row in lossless} == {"deterministic, n = 1"}
    assert [row.diff_note for row in lossless if row.policy == "mps-ack"] == ["deterministic, n = 1"]
    lossy = [row for row in rows if row.per == 0.4]
    assert [(row.n, row.deterministic) for row in lossy] == [(9, False)] * 2
    of_column = [rank for rank in ranks(found, "n_bytes") if rank.per == 0.0]
    assert [rank.p_to_best for rank in of_column] == [None, None]
    assert all(rank.deterministic for rank in of_column)
    text = CliRunner().invoke(app, ["compare", str(tmp_path / "out"), "--metric", "n_bytes"]).stdout
    assert "deterministic, n = 1" in text


def outcome(seed: int, drawn: Any, **more: Any) -> RunOutcome:
    said = {} if drawn == "unsaid" else {"drawn": drawn}
    return RunOutcome({"seed": seed, "per": 0.0, "completed": True, "n_bytes": 7, **said, **more}, False, 20.0)


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        ([outcome(1, False)], True),
        ([outcome(1, True)], False),
        ([outcome(1, False), outcome(2, False)], True),
        ([outcome(1, True), outcome(2, True)], False),  # alike by chance: rare losses that did not come
        ([outcome(1, None)], False),  # a part of the user's own may draw: one run says nothing
        ([outcome(1, None), outcome(2, None)], True),
        ([outcome(1, None), outcome(2, None, n_bytes=8)], False),
        ([outcome(1, False), RunOutcome({"seed": 2, "per": 0.0}, True, 20.0)], False),
    ],
)
def test_repeats_without_random_draws_count_as_one_run(runs: list[RunOutcome], expected: bool) -> None:
    assert is_one_run(dict(enumerate(runs))) is expected


def test_values_are_paired_by_repeat() -> None:
    baseline = Measured({0: 5.0, 1: 1.0, 2: 3.0, 7: 100.0})
    paired = paired_with(Measured({2: 4.0, 0: 6.0, 1: 2.0, 9: 50.0}), baseline)
    assert paired is not None
    assert (paired.difference, paired.n) == (1.0, 3)
    assert paired.interval is NoInterval.TOO_FEW


def test_a_run_in_which_nothing_was_drawn_is_the_same_in_all_repeats() -> None:
    once = Measured({0: 10.0}, constant=True)
    paired = paired_with(Measured({3: 11.0, 4: 12.0}), once)
    assert paired is not None
    assert (paired.difference, paired.n) == (1.5, 2)


def test_runs_without_draws_differ_with_certainty() -> None:
    paired = paired_with(Measured({0: 11.0}, constant=True), Measured({0: 10.0}, constant=True))
    assert paired is not None
    assert (paired.difference, paired.n, paired.effect) == (1.0, 1, None)
    assert paired.interval is NoInterval.DETERMINISTIC


def test_interval_against_a_constant_covers_only_the_random_side() -> None:
    """One of 10 failed: 36 s and 900 s in 10. With a share of 31 % (0 of 10) of the other side, low would be -180 s."""
    times = {repeat: 100.0 + repeat for repeat in range(9)}
    ours = Measured({**times, 9: 1000.0}, frozenset(times), 1000.0)
    paired = paired_with(ours, Measured({0: 100.0}, frozenset({0}), 1000.0, constant=True))
    assert paired is not None
    assert isinstance(paired.interval, tuple)
    low, high = paired.interval
    assert 0.0 < low < 93.6
    assert high > 300.0
    assert paired.n_reached == 9
    assert isinstance(paired.reached_interval, tuple)
    assert paired.reached_interval[1] < 7.0


def test_dry_run_counts_the_runs_to_make_as_validation_and_a_sweep_do(tmp_path: Path) -> None:
    """Of 2 x 2 x 9 runs, those without loss draw nothing: known only once one is made, which leaves 2 x 9."""

    def made(task: RunTask) -> FinishedRun:
        return finished(task, completed=True, mission_time_s=9.0, n_bytes=1, drawn=task.scenario.channel.per > 0.0)

    study = load_study(str(written(tmp_path, study_text(repeats=9, per="[0.0, 0.4]"))))
    guess = estimate(study, 1, tmp_path / "out")
    assert (guess.planned, guess.done, guess.remaining) == (study.n_runs, 0, 36)
    log = SweepFolder(tmp_path / "out", plan := SweepPlan(study))
    log.append([made(plan.task(number, 0)) for number in range(4)])
    log.close()
    status = SweepResults.read(tmp_path / "out").status()
    guess = estimate(study, 1, tmp_path / "out")
    assert (
        (guess.planned, guess.done, guess.remaining) == (status.planned, status.done, status.remaining) == (20, 4, 16)
    )
    assert status.progress == "done 4, at most 16 to do; equal runs are made once"


def test_a_run_without_packets_is_made_once_for_all_losses(tmp_path: Path) -> None:
    """Each run of the study, repeated alone, has the same summary and tables."""

    class Counting(Serial):
        n_submitted = 0

        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            self.n_submitted += 1
            return super().submit(fn, *args, **kwargs)

    text = study_text(repeats=2, per="[0.1, 0.4]", duration_s=60, extra="uncertainty.speed_spread = 0.3")
    text = text.replace('["remoras"]', '["remoras", "fixed-partition", "oracle"]')
    study, executor = load_study(str(written(tmp_path, text))), Counting()
    status = sweep(study, tmp_path / "out", executor=executor)
    assert (status.done, executor.n_submitted) == (3 * 8, 8 + 4 + 4)
    runs = SweepResults.read(tmp_path / "out").runs()
    assert runs.groupby(["strategy", "per"]).size().to_list() == [4] * 6
    repeated = {task.key: run_task(task).line for task in SweepPlan(study).missing({})}
    lines = SweepResults.read(tmp_path / "out").lines
    assert repeated.keys() == lines.keys()
    for key, line in repeated.items():
        assert (line["summary"], line["tables"]) == (lines[key]["summary"], lines[key]["tables"])
