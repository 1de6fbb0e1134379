"""Schedules that broke something once: none of them does any more, but for those that are open.

The first lines of each file say what it was.
"""

from pathlib import Path

import pytest

from stress.campaign import judge
from stress.schedule import read_schedule
from stress.trial import Outcome

FAULTS = Path(__file__).parents[1] / "faults"
KEPT, OPEN = (sorted(folder.glob("*.toml")) for folder in (FAULTS, FAULTS / "open"))


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


@pytest.mark.slow
@pytest.mark.parametrize("file", OPEN, ids=lambda file: file.stem)
def test_what_is_open_is_still_found(file: Path) -> None:
    """Whoever cures one moves its file to those that hold."""
    assert repeated(file).broken is not None
