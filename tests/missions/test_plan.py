"""Plans of sweeps: common seeds, keys, stopping rule."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from sweeping import study_text, written

from missions.sweeps.plan import SweepPlan, repeats_needed, seed_of
from missions.sweeps.study import load_study
from missions.sweeps.study_file import StoppingRule

RULE = StoppingRule(metric="n_bytes", half_width=1.0, minimum=4, maximum=10)


def plan_of(tmp_path: Path, text: str) -> SweepPlan:
    return SweepPlan(load_study(str(written(tmp_path, text))))


def test_configurations_of_a_repeat_share_their_seed(tmp_path: Path) -> None:
    tasks = list(plan_of(tmp_path, study_text()).missing({}))
    assert len(tasks) == len({task.key for task in tasks}) == 16
    assert {(task.repeat, task.seed) for task in tasks} == {(repeat, seed_of(7, repeat)) for repeat in range(4)}
    assert len({task.seed for task in tasks}) == 4


def test_replay_command_contains_all_settings(tmp_path: Path) -> None:
    task = next(plan_of(tmp_path, study_text()).missing({}))
    assert task.replay == (
        f"remoras run mapping-rendezvous --seed {task.seed} --set scenario.duration_s=20 --set strategy.name=remoras "
        "--set communication.policy=ack --set channel.name=bernoulli --set channel.per=0.1"
    )


def test_stopping_rule_is_tested_at_the_minimum_and_at_intervals() -> None:
    assert repeats_needed(RULE, []) == 4
    assert repeats_needed(RULE, [5.0, 5.1, 4.9, 5.0]) == 4
    spread = [0.0, 9.0, 0.0, 9.0]
    assert repeats_needed(RULE, spread) == 6
    assert repeats_needed(RULE, [*spread, 0.0]) == 6
    assert repeats_needed(RULE, [*spread, 0.0, 9.0]) == 8
    assert repeats_needed(RULE, [*spread, *spread, 0.0, 9.0]) == 10


def test_stopping_rule_may_be_relative_and_the_first_limit_met_counts() -> None:
    """Student's half-width of 99, 101, 99, 101 is 3.18 * 1.155 / 2 = 1.84: above 1, below 2 % of the mean."""
    values = [99.0, 101.0, 99.0, 101.0]
    limits = {"metric": "n_bytes", "minimum": 4, "maximum": 10}
    assert repeats_needed(StoppingRule(half_width_share=0.02, **limits), values) == 4
    assert repeats_needed(StoppingRule(half_width_share=0.018, **limits), values) == 6
    assert repeats_needed(StoppingRule(half_width=1.0, half_width_share=0.02, **limits), values) == 4
    assert repeats_needed(StoppingRule(half_width=1.0, half_width_share=0.018, **limits), values) == 6


def test_stopping_rule_counts_censored_runs_with_their_duration(tmp_path: Path) -> None:
    """Nobody maps 95 % in 20 s, so all values are 20 s and the mean is known after the fewest repeats."""
    rule = '[stopping]\nmetric = "time_to_95_s"\nhalf_width = 1\nminimum = 3\nmaximum = 9\n'
    schedule = plan_of(tmp_path, study_text(per="[0.1]", extra=rule)).schedule
    summaries = {schedule.key(0, repeat): {"time_to_95_s": None} for repeat in range(3)}
    assert schedule.repeats(0, summaries) == 3


@given(st.lists(st.floats(0.0, 20.0), min_size=10, max_size=10))
def test_more_known_runs_never_remove_a_needed_repeat(values: list[float]) -> None:
    """So the order in which runs finish decides nothing."""
    needed = [repeats_needed(RULE, values[:known]) for known in range(11)]
    assert needed == sorted(needed)
    final = needed[-1]
    assert repeats_needed(RULE, values[:final]) == final
