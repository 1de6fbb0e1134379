"""When vehicles were out of the mission: lost, not there yet, or without energy."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

from missions.fault import Absence, absence
from missions.figure import RunResults

OVER = "over"
"""Detail in the table of faults when one is over."""


class Outage(NamedTuple):
    """From when to when; to infinity for good."""

    start_s: float
    end_s: float


def outages(results: RunResults) -> dict[str, list[Outage]]:
    """Outages of the vehicles that had any, in the order in which they began."""
    found: defaultdict[str, list[Outage]] = defaultdict(list)
    open_at: dict[tuple[str, str], int] = {}
    for row in results.table("faults").to_pylist() if results.has("faults") else ():
        own, key, time_s = found[row["vehicle"]], (row["vehicle"], row["kind"]), float(row["time_s"])
        if absence(row["kind"]) not in (Absence.BEFORE, Absence.LOSS):
            continue
        if row["detail"] != OVER:
            open_at[key] = len(own)
            own.append(Outage(time_s, math.inf))
        elif key in open_at:
            own[open_at[key]] = Outage(own[open_at[key]].start_s, time_s)
    return {vehicle: own for vehicle, own in found.items() if own}


def outside(start_s: float, end_s: float, out: Iterable[Outage]) -> list[tuple[float, float]]:
    """The parts of a span that lie outside of outages.

    >>> outside(0.0, 10.0, [Outage(2.0, 4.0), Outage(9.0, math.inf)])
    [(0.0, 2.0), (4.0, 9.0)]
    """
    parts = [(start_s, end_s)]
    for gap in out:
        cut = [[(start, min(end, gap.start_s)), (max(start, gap.end_s), end)] for start, end in parts]
        parts = [(start, end) for pair in cut for start, end in pair if start < end]
    return parts


def outages_until(out: Iterable[Outage], end_s: float) -> list[tuple[float, float]]:
    """Outages as far as a run that ended at ``end_s`` shows them.

    >>> outages_until([Outage(2.0, 4.0), Outage(9.0, math.inf)], 10.0)
    [(2.0, 4.0), (9.0, 10.0)]
    """
    return [(gap.start_s, min(gap.end_s, end_s)) for gap in out if gap.start_s < end_s]
