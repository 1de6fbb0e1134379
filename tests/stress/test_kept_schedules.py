"""Regression: schedules that once violated an invariant; the first line of each file states the violation."""

from pathlib import Path

import pytest
from stress.schedules import read_schedule
from stress.trial import judge

FAULTS = Path(__file__).parents[1] / "faults"


@pytest.mark.slow
@pytest.mark.parametrize("file", sorted(FAULTS.glob("*.toml")), ids=lambda file: file.stem)
def test_a_kept_schedule_violates_no_invariant(file: Path) -> None:
    assert file.read_text(encoding="utf-8").startswith("# ")
    schedule = read_schedule(file)
    outcome = judge(schedule)
    assert outcome.happened == schedule.kinds
    assert outcome.broken is None, outcome.broken
