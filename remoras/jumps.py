"""Positions that cannot be: a peer is farther from where it was than it can have gone.

A report is suspected if its distance from the last one exceeds ``SLACK_M`` and ``MARGIN`` times what the peer's top
speed allows for the time between them; the margin is for faster vehicles than their data say and for currents, the
slack for what a fix corrects and for rounding. It is set aside. If the next one fits it, not the one before, both were
right and the one before was wrong. So a flipped bit costs one report, and a true jump is believed one report later. A
report that others relay comes more than once, and late: a copy confirms nothing, and of what is older nothing is asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from exchange.arithmetic import distance, length
from worldmodel import Block

SLACK_M = 50.0
"""What a report may be off in any case."""
MARGIN = 2.0
"""How many times farther than by its top speed a vehicle may seem to have gone."""
_new = tuple.__new__  # makes a named tuple of a tuple, in half the time


class PositionReport(NamedTuple):
    """Where a vehicle said it was at a time."""

    time_s: float
    x_m: float
    y_m: float


class Jump(NamedTuple):
    """A suspected report: how far it is from the last one (m), and how much later (s)."""

    distance_m: float
    after_s: float


class Jumps:
    """Watches what peers say of their own positions.

    Args:
        position: uid of the attribute.
        top_speeds_mps: of each vehicle, by its uid; of others nothing is suspected.

    >>> from worldmodel import PropertyValue
    >>> jumps = Jumps(3, {1: 2.0})
    >>> def said(time_s, x_m): return Block(1, -1, time_s, (PropertyValue(1, 3, (x_m, 0.0)),))
    >>> [jumps.suspected(said(7.0 * n, x_m)) for n, x_m in enumerate((0.0, 500.0, 14.0, 21.0))]
    [None, Jump(distance_m=500.0, after_s=7.0), None, None]
    >>> [jumps.suspected(said(7.0 * n, x_m)) is None for n, x_m in enumerate((0.0, 900.0, 910.0), 4)]
    [True, False, True]
    >>> [jumps.suspected(said(7.0 * n, x_m)) is None for n, x_m in ((7, 100.0), (7, 100.0), (5, 900.0))]
    [False, False, True]
    """

    def __init__(self, position: int, top_speeds_mps: Mapping[int, float]) -> None:
        self._position = position
        self._top_speeds_mps = top_speeds_mps
        self._last: dict[int, PositionReport] = {}
        self._aside: dict[int, PositionReport] = {}

    def suspected(self, block: Block) -> Jump | None:
        """The jump that a status makes of a vehicle, if it is one that no vehicle makes; it is to be set aside."""
        origin, _, time_s, facts, _ = block
        for fact in facts:
            if fact.attribute == self._position:
                break
        else:
            return None
        subject, _, value, _ = fact
        if subject != origin or subject not in self._top_speeds_mps:
            return None
        now = _new(PositionReport, (time_s, *value))  # type: ignore[misc]
        last, aside = self._last.get(subject), self._aside.get(subject)
        if last is not None and now.time_s < last.time_s:
            return None
        is_next = aside is None or aside.time_s < now.time_s
        if (
            last is None
            or abs(now.x_m - last.x_m) + abs(now.y_m - last.y_m) <= SLACK_M  # mostly it is near
            or self._fits(subject, last, now)
            or (is_next and aside and self._fits(subject, aside, now))
        ):
            self._last[subject] = now
            if is_next and aside:
                del self._aside[subject]
            return None
        if is_next:
            self._aside[subject] = now
        return Jump(distance(last[1:], now[1:]), now.time_s - last.time_s)

    def _fits(self, vehicle: int, one: PositionReport, other: PositionReport) -> bool:
        """True if the vehicle can have made both reports."""
        reach_m = SLACK_M + MARGIN * self._top_speeds_mps[vehicle] * abs(other.time_s - one.time_s)
        east_m, north_m = other.x_m - one.x_m, other.y_m - one.y_m
        return abs(east_m) + abs(north_m) <= reach_m or length(east_m, north_m) <= reach_m
