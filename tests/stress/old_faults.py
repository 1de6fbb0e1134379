"""Faults that the program once had, and that are mended: each mend taken out again."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from planted import (
    CHECKED,
    Planted,
    begin_anew_as_known,
    check_no_checksum,
    drop_other_content,
    map_with_dead_sensors,
    take_the_future,
    wait_for_who_is_elsewhere,
)

from stress.campaign import judge
from stress.schedule import Schedule
from stress.shrinking import Shrunk, shrunk
from stress.trial import Broken, Outcome

MOST_RUNS = 60


class OldFault(NamedTuple):
    """A fault that was in the program once.

    Attributes:
        name: of the file of its schedule in ``tests/faults``; text: what happened.
        planted: its mend taken out, and the invariant that names it.
    """

    name: str
    text: str
    planted: Planted


class Found(NamedTuple):
    """What came of the search: the first breach, the short schedule, and what that breaks with the mend (nothing)."""

    first: Outcome
    small: Shrunk
    mended: Broken | None

    @property
    def schedule(self) -> Schedule:
        """The short schedule."""
        return self.small.schedule


OLD = (
    OldFault("fact-of-the-future", "a time that was changed on the way hid the truth until its hour came",
             Planted("past", take_the_future, frozenset({"forged"}))),
    OldFault("damaged-packets-pass", "damaged packets were taken for sound ones",
             Planted("sound-packets", check_no_checksum, frozenset({"bits"}), CHECKED)),
    OldFault("mangled-first-copy", "a mangled first copy of a block kept the true one out",
             Planted("one-content", drop_other_content, frozenset({"bits", "forged"}))),
    OldFault("dead-sensor-maps", "what a dead sensor passed counted as mapped",
             Planted("ground", map_with_dead_sensors, frozenset({"sensor"}))),
    OldFault("meeting-waits-for-a-lie", "one that reported to be 5 km off kept the others waiting",
             Planted("finishes", wait_for_who_is_elsewhere, frozenset({"misplaced"}))),
    OldFault("restart-taken-for-known", "one that began anew and counted from 0 was taken for known",
             Planted("beliefs", begin_anew_as_known, frozenset({"restarts"}))),
)  # fmt: skip


def search(fault: OldFault) -> Found | None:
    """Look for an old fault from seeds alone, and shrink what breaks; None if nothing does."""
    with pytest.MonkeyPatch.context() as patch:
        first = fault.planted.found(patch, MOST_RUNS)
        if first is None:
            return None
        small = shrunk(first, judge)
    return Found(first, small, judge(small.schedule).broken)
