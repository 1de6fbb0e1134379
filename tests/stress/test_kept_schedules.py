"""Schedules that broke something once: none of them does any more.

The first lines of each file say what it was.
"""

from pathlib import Path

import pytest

from stress.campaign import judge
from stress.schedule import read_schedule
from stress.trial import Outcome

FAULTS = Path(__file__).parents[1] / "faults"
KEPT = sorted(FAULTS.glob("*.toml"))


def repeated(file: Path) -> Outcome:
    assert file.read_text(encoding="utf-8").startswith("# ")
    outcome = judge(read_schedule(file))
    assert set(outcome.happened) == outcome.schedule.kinds
    return outcome


@pytest.mark.slow
@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_what_was_broken_once_holds(file: Path) -> None:
    outcome = repeated(file)
    assert outcome.broken is None, outcome.broken
