"""Spans of time, read out of events: above all when vehicles were out of the mission, lost or without energy."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

from missions.fault import Absence, absence
from missions.figure import RunResults

OVER = "over"
"""Detail in the table of faults when one is over."""


class Span(NamedTuple):
    """From when to when; to infinity for good."""

    start_s: float
    end_s: float


def spans(events: Iterable[tuple[float, bool]], last_s: float = math.inf) -> list[Span]:
    """From each time at which something begins to the next at which it is over; what is not over lasts to the end.

    >>> spans([(1.0, True), (2.0, True), (5.0, False), (7.0, True)], 9.0)
    [Span(start_s=1.0, end_s=5.0), Span(start_s=7.0, end_s=9.0)]
    """
    found: list[Span] = []
    since_s: float | None = None
    for time_s, begins in events:
        if begins and since_s is None:
            since_s = time_s
        elif not begins and since_s is not None:
            found.append(Span(since_s, time_s))
            since_s = None
    return found if since_s is None else [*found, Span(since_s, last_s)]


def outages(results: RunResults) -> dict[str, list[Span]]:
    """Outages of the vehicles that had any, in the order in which they began."""
    found: defaultdict[str, list[Span]] = defaultdict(list)
    open_at: dict[tuple[str, str], int] = {}
    for row in results.table("faults").to_pylist() if results.has("faults") else ():
        own, key, time_s = found[row["vehicle"]], (row["vehicle"], row["kind"]), float(row["time_s"])
        if absence(row["kind"]) not in (Absence.BEFORE, Absence.LOSS):
            continue
        if row["detail"] != OVER:
            open_at[key] = len(own)
            own.append(Span(time_s, math.inf))
        elif key in open_at:
            own[open_at[key]] = Span(own[open_at[key]].start_s, time_s)
    return {vehicle: own for vehicle, own in found.items() if own}


def outside(start_s: float, end_s: float, out: Iterable[Span]) -> list[Span]:
    """The parts of a span that lie outside of outages.

    >>> outside(0.0, 10.0, [Span(2.0, 4.0), Span(9.0, math.inf)])
    [Span(start_s=0.0, end_s=2.0), Span(start_s=4.0, end_s=9.0)]
    """
    parts = [Span(start_s, end_s)]
    for gap in out:
        cut = [[(start, min(end, gap.start_s)), (max(start, gap.end_s), end)] for start, end in parts]
        parts = [Span(start, end) for pair in cut for start, end in pair if start < end]
    return parts


def outages_until(out: Iterable[Span], end_s: float) -> list[tuple[float, float]]:
    """Outages as far as a run that ended at ``end_s`` shows them.

    >>> outages_until([Span(2.0, 4.0), Span(9.0, math.inf)], 10.0)
    [(2.0, 4.0), (9.0, 10.0)]
    """
    return [(gap.start_s, min(gap.end_s, end_s)) for gap in out if gap.start_s < end_s]
