"""Each invariant names the fault that is planted against it, from seeds alone, within 200 of them."""

import pytest
from planted import PLANTS, Planted

from missions.scenarios import load
from remoras.testing import judge, schedule_of
from stress.shipped import invariants_of

MOST_SEEDS, MOST_RUNS = 200, 15
SLOW = frozenset(
    {"finishes", "agreement", "separation", "authority", "remembered", "cardinality", "sound-packets", "rest"}
)
"""Those that take several runs, or long ones."""
MARKS = [pytest.mark.slow, pytest.mark.thorough]


def named_by(planted: Planted, patch: pytest.MonkeyPatch) -> int | None:
    """The first seed whose schedule breaks the invariant that is meant; None if none of the first ones does."""
    plan = planted.plan()
    planted.plant(patch)
    n_runs = 0
    for seed in range(1, MOST_SEEDS + 1):
        schedule = schedule_of(plan, seed)
        if planted.needs and planted.needs.isdisjoint(schedule.kinds):
            continue
        outcome = judge(schedule, twice=planted.invariant == "repeats")
        if outcome.broken is not None and outcome.broken.invariant == planted.invariant:
            return seed
        n_runs += 1
        if n_runs >= MOST_RUNS:
            return None
    return None


def test_there_is_a_plant_for_each_invariant() -> None:
    names = [one.name for one in invariants_of(load("mapping-rendezvous"))]
    assert sorted(names) == sorted(planted.invariant for planted in PLANTS)


@pytest.mark.parametrize(
    "planted",
    [pytest.param(one, id=one.invariant, marks=MARKS if one.invariant in SLOW else []) for one in PLANTS],
)
def test_a_planted_fault_is_named(planted: Planted, monkeypatch: pytest.MonkeyPatch) -> None:
    assert named_by(planted, monkeypatch) is not None
