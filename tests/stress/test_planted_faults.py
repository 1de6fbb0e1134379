"""Each invariant names the fault that is planted against it, from seeds alone, within 200 of them."""

import pytest
from planted import PLANTS, Planted

from missions.scenarios import load
from stress.shipped import invariants_of

MOST_RUNS = 15
SLOW = frozenset(
    {"finishes", "agreement", "separation", "authority", "remembered", "cardinality", "sound-packets", "rest"}
)
"""Those that take several runs, or long ones."""
MARKS = [pytest.mark.slow, pytest.mark.thorough]


def test_there_is_a_plant_for_each_invariant() -> None:
    names = [one.name for one in invariants_of(load("mapping-rendezvous"))]
    assert set(names) == {planted.invariant for planted in PLANTS}


@pytest.mark.slow
@pytest.mark.parametrize(
    "planted",
    [
        pytest.param(one, id=f"{one.invariant}-{one.plant.__name__}", marks=MARKS if one.invariant in SLOW else [])
        for one in PLANTS
    ],
)
def test_a_planted_fault_is_named(planted: Planted, monkeypatch: pytest.MonkeyPatch) -> None:
    assert planted.found(monkeypatch, MOST_RUNS) is not None
