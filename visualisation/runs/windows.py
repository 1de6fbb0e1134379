"""Which stretch of a mission the map of its tracks shows once more.

Most of a survey is quiet: vehicles map for half an hour, then everything happens in five minutes. A quiet
stretch is a quarter of the mission or more without an event. Between quiet stretches lie eventful ones; the
busiest gets a window of its own if it has at least five events and is shorter than half the mission.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from visualisation.runs.reading import Span

QUIET = 0.25
LEAST_EVENTS = 5
LONGEST = 0.5
MARGIN = 0.04


def eventful(times_s: Sequence[float], end_s: float) -> Span | None:
    """The stretch that deserves a window of its own, with a margin; None if there is none.

    >>> eventful([0, 7, 80, 81, 82, 84, 90], 100.0)
    Span(start_s=79.2, end_s=100.0)
    >>> eventful([0, 20, 40, 60, 80], 100.0) is None
    True
    """
    inside = sorted({time_s for time_s in times_s if 0.0 <= time_s <= end_s})
    if not inside:
        return None
    stretches = [[inside[0]]]
    for before_s, after_s in pairwise(inside):
        if after_s - before_s >= QUIET * end_s:
            stretches.append([])
        stretches[-1].append(after_s)
    busiest = max(stretches, key=len)
    first_s, last_s = busiest[0], busiest[-1]
    if end_s - last_s < QUIET * end_s:
        last_s = end_s
    if first_s < QUIET * end_s:
        first_s = 0.0
    if len(busiest) < LEAST_EVENTS or last_s - first_s > LONGEST * end_s:
        return None
    margin_s = MARGIN * (last_s - first_s)
    return Span(max(0.0, first_s - margin_s), min(end_s, last_s + margin_s))
