"""Schedules that broke something once: none of them does any more. The first lines of each say what it was."""

from pathlib import Path

import pytest

from remoras.testing import judge, read_schedule

KEPT = sorted((Path(__file__).parents[1] / "faults").glob("*.toml"))


@pytest.mark.slow
@pytest.mark.parametrize("file", KEPT, ids=lambda file: file.stem)
def test_what_was_broken_once_holds(file: Path) -> None:
    assert file.read_text(encoding="utf-8").startswith("# ")
    outcome = judge(read_schedule(file))
    assert outcome.broken is None, outcome.broken
    assert set(outcome.happened) == outcome.schedule.kinds
