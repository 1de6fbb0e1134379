"""Time intervals between events that begin and end something, such as outages, roles and work."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable
from itertools import accumulate, pairwise
from typing import NamedTuple, TypeVar

K = TypeVar("K")


class Span(NamedTuple):
    """Time interval; infinite end if permanent."""

    start_s: float
    end_s: float

    def holds(self, time_s: float) -> bool:
        """Return True for a time within, the end excluded."""
        return self.start_s <= time_s < self.end_s


def spans(events: Iterable[tuple[float, bool]], last_s: float = math.inf) -> list[Span]:
    """Return the intervals between begin and end events; an unfinished one lasts to ``last_s``."""
    closed: list[Span] = []
    since_s: float | None = None
    for time_s, begins in events:
        if begins and since_s is None:
            since_s = time_s
        elif not begins and since_s is not None:
            closed.append(Span(since_s, time_s))
            since_s = None
    return closed if since_s is None else [*closed, Span(since_s, last_s)]


def spans_by(events: Iterable[tuple[K, float, bool]], last_s: float = math.inf) -> dict[K, list[Span]]:
    """Return the spans of each key from its begin and end events, in time order; see ``spans``."""
    of_key: defaultdict[K, list[tuple[float, bool]]] = defaultdict(list)
    for key, time_s, begins in events:
        of_key[key].append((time_s, begins))
    return {key: spans(own, last_s) for key, own in of_key.items()}


def n_at_once(overlapping: Iterable[Span]) -> list[tuple[Span, int]]:
    """Return the number of overlapping spans between successive ends of spans.

    >>> [(*span, n) for span, n in n_at_once([Span(0, 4), Span(2, 6), Span(8, 9)])]
    [(0, 2, 1), (2, 4, 2), (4, 6, 1), (6, 8, 0), (8, 9, 1)]
    """
    steps: Counter[float] = Counter()
    for span in overlapping:
        steps[span.start_s] += 1
        steps[span.end_s] -= 1
    times_s = sorted(steps)
    counts = accumulate(steps[time_s] for time_s in times_s)
    return [(Span(*ends), count) for ends, count in zip(pairwise(times_s), counts, strict=False)]


def outside(start_s: float, end_s: float, out: Iterable[Span]) -> list[Span]:
    """Return the parts of an interval outside all outages."""
    parts = [Span(start_s, end_s)]
    for gap in out:
        cut = [[(start, min(end, gap.start_s)), (max(start, gap.end_s), end)] for start, end in parts]
        parts = [Span(start, end) for pair in cut for start, end in pair if start < end]
    return parts
