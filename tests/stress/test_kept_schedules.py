"""Schedules that broke something once hold. The first line of each file tells what it was."""

from pathlib import Path

import pytest
from stress.schedules import read_schedule
from stress.trial import judge

FAULTS = Path(__file__).parents[1] / "faults"


@pytest.mark.slow
@pytest.mark.parametrize("file", sorted(FAULTS.glob("*.toml")), ids=lambda file: file.stem)
def test_what_was_broken_once_holds(file: Path) -> None:
    assert file.read_text(encoding="utf-8").startswith("# ")
    schedule = read_schedule(file)
    outcome = judge(schedule)
    assert outcome.happened == schedule.kinds
    assert outcome.broken is None, outcome.broken
