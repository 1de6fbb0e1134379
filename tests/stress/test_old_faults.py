"""Faults that the program once had are found from seeds alone, and shrunk; with their mends nothing breaks."""

from pathlib import Path

import pytest
from old_faults import OLD, OldFault, search

from stress.campaign import judge
from stress.schedule import read_schedule
from stress.shrinking import MOST_RUNS

FAULTS = Path(__file__).parents[1] / "faults"
MOST_EVENTS = 5
SLOW = [pytest.mark.slow, pytest.mark.thorough]
QUICK = ("fact-of-the-future", "dead-sensor-maps")


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault", [pytest.param(one, id=one.name, marks=[] if one.name in QUICK else SLOW) for one in OLD]
)
def test_an_old_fault_is_found_and_shrunk(fault: OldFault) -> None:
    found = search(fault)
    assert found is not None
    assert found.small.broken.invariant == fault.planted.invariant
    assert len(found.schedule.fault) <= MOST_EVENTS
    assert found.small.n_runs <= MOST_RUNS
    assert found.mended is None, found.mended


@pytest.mark.parametrize("fault", [pytest.param(one, id=one.name, marks=pytest.mark.slow) for one in OLD])
def test_the_kept_schedule_breaks_without_the_mend(fault: OldFault, monkeypatch: pytest.MonkeyPatch) -> None:
    schedule = read_schedule(FAULTS / f"{fault.name}.toml")
    fault.planted.plant(monkeypatch)
    outcome = judge(schedule)
    assert outcome.broken is not None
    assert outcome.broken.invariant == fault.planted.invariant
