"""The baselines that the learning face ships: a greedy policy and a learned one."""

import numpy as np
import pytest

from missions.benchmark.learning.baselines import (
    FEATURES,
    GREEDY,
    LEARNED,
    WEIGHTS,
    Scorer,
    greedy,
    learned,
    planned_first,
)
from missions.benchmark.learning.observing import JOB, MOST_JOBS, N_ACTIONS, OWN, PEER, TAKE, Sight, unasked
from missions.benchmark.learning.policies import strategy
from missions.benchmark.suite import suite_named
from missions.runs.run import Run, run_of
from missions.runs.setup import resolved
from remoras.strategy import Strategy


def sight(done_after_s: list[float], n_others: list[int], n_held: int = 0, turn: int = 0) -> Sight:
    """What the first of three members sees of open jobs."""
    seen = unasked()
    seen["own"][[OWN.index("n_members"), OWN.index("n_held"), OWN.index("round")]] = 3, n_held, turn
    for row, (after_s, others) in enumerate(zip(done_after_s, n_others, strict=True)):
        seen["jobs"][row, [JOB.index("done_after_s"), JOB.index("n_others")]] = after_s, others
        seen["action_mask"][TAKE + row] = 1
    return seen


def test_the_greedy_policy_takes_the_vacant_job_that_is_done_soonest_at_its_turn() -> None:
    assert greedy(sight([300.0, 100.0, 200.0], [0, 1, 0])) == TAKE + 2
    assert greedy(sight([300.0], [0], turn=1)) == 0
    assert greedy(sight([300.0], [0], n_held=1)) == 0
    assert greedy(sight([300.0], [1])) == 0


def test_a_scorer_takes_what_scores_highest_if_that_is_above_nothing() -> None:
    by_time = [1.0 if name == "bias" else -1.0 if name == "done_after" else 0.0 for name in FEATURES]
    seen = sight([900.0, 500.0], [0, 0])
    assert Scorer(by_time)(seen) == TAKE + 1
    assert Scorer(by_time)(sight([1500.0, 1100.0], [0, 0])) == 0
    assert Scorer(np.zeros(len(FEATURES)))(seen) == 0
    seen["action_mask"][TAKE + 1] = 0
    assert Scorer(by_time)(seen) == TAKE


def test_the_plan_has_a_vehicle_do_what_no_peer_would_have_done_sooner() -> None:
    """Jobs of 400 and 300 s at 1 m/s, 100 m to the east and to the west; a peer stands at the eastern one."""
    seen = sight([500.0, 400.0], [0, 0])
    seen["own"][[OWN.index("transit_mps"), OWN.index("place")]] = 1.0, 0
    seen["jobs"][[0, 1], JOB.index("x_m")] = 100.0, -100.0
    assert planned_first(seen) == 0  # alone it does both, of equals the first
    peer = seen["peers"][0]
    peer[[PEER.index("member"), PEER.index("x_m"), PEER.index("job")]] = 1.0, 100.0, -1.0
    assert planned_first(seen) == 1
    peer[PEER.index("x_m")] = 5000.0
    assert planned_first(seen) == 0  # both are its own again
    seen["action_mask"][:] = 0
    assert planned_first(seen) is None


def test_the_learned_weights_are_small_and_of_the_suite() -> None:
    found = learned()
    assert WEIGHTS.stat().st_size < 10_000
    assert tuple(found["weights"]) == FEATURES
    assert found["suite"] == suite_named("fathom-1").about.name
    assert MOST_JOBS < N_ACTIONS


def run_with(one: Strategy) -> Run:
    scenario = suite_named("fathom-1").study(("remoras",)).configurations[20].scenario
    return run_of(resolved(scenario, one), 1)


@pytest.mark.parametrize("baseline", [GREEDY, LEARNED], ids=["greedy", "learned"])
def test_a_baseline_completes_a_mission_that_nobody_completes_who_takes_no_jobs(baseline: Strategy) -> None:
    assert run_with(baseline).completed


@pytest.mark.slow
def test_nobody_completes_the_mission_who_takes_no_jobs() -> None:
    assert not run_with(strategy(lambda seen: 0, "idle")).completed
