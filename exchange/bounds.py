"""What bounds a queue: room, with the items outside of it; deadlines; and what is said no more."""

from __future__ import annotations

import math
from collections.abc import Iterator
from heapq import heappop, heappush

from exchange.lines import Candidate
from exchange.packets import ItemUid
from exchange.values import Waiting
from worldmodel import Terms


class Bounds:
    """Items that wait: so many at most, and of those whose need has a limit, no more than that.

    Of those that wait the least urgent makes room for a more urgent one; of equals, the one that was taken last. Where
    the newest is to go first, the one that was taken first makes room.

    Args:
        limit: most items in all; None for no limit.
    """

    def __init__(self, limit: int | None) -> None:
        self._limit = math.inf if limit is None else limit
        self._items: dict[int, Candidate] = {}  # by column
        self._levels: dict[int, dict[int, Candidate]] = {}  # by priority and column, in the order of taking
        self._limited: dict[int, dict[int, Candidate]] = {}  # by attribute and column, where the terms have a limit
        self._outside: dict[int | None, dict[int, Candidate]] = {}  # by attribute with a limit, and column

    def __len__(self) -> int:
        return len(self._items)

    def get(self, column: int) -> Candidate | None:
        """The item of a column, if it is inside."""
        return self._items.get(column)

    def named(self, uid: ItemUid) -> Candidate | None:
        """The item with that name, if it is inside; looks through all."""
        return next((one for one in self._items.values() if one.uid == uid), None)

    def add(self, candidate: Candidate) -> None:
        """Let an item wait inside."""
        self._items[candidate.column] = candidate
        self._levels.setdefault(candidate.waiting.priority, {})[candidate.column] = candidate
        if candidate.terms.queue_limit is not None:
            self._limited.setdefault(candidate.about[1], {})[candidate.column] = candidate

    def remove(self, candidate: Candidate) -> None:
        """Let an item go that waits inside."""
        del self._items[candidate.column]
        del self._levels[candidate.waiting.priority][candidate.column]
        if candidate.terms.queue_limit is not None:
            del self._limited[candidate.about[1]][candidate.column]

    def rival(self, candidate: Candidate) -> Candidate | None:
        """What has to make room for an item, or the item itself; None if there is room."""
        terms, priority = candidate.terms, candidate.waiting.priority
        rivals = self._limited.get(candidate.about[1], {})
        if terms.queue_limit is None or len(rivals) < terms.queue_limit:
            if len(self._items) < self._limit:
                return None
            lowest = min(level for level, of_level in self._levels.items() if of_level)
            if lowest > priority:
                return candidate
            rivals = self._levels[lowest]
            if lowest < priority:
                return rivals[next(reversed(rivals))]
        return rivals[next(iter(rivals))] if terms.newest_first else candidate

    # Outside -------------------------------------------------------------------------------------

    @property
    def n_outside(self) -> int:
        """How many items wait outside."""
        return sum(len(outside) for outside in self._outside.values())

    def is_outside(self, uid: ItemUid) -> bool:
        """True if the item with that name waits outside; looks through all."""
        return any(one.uid == uid for outside in self._outside.values() for one in outside.values())

    def outside(self, column: int) -> Candidate | None:
        """The item of a column, if it waits outside."""
        return next((found[column] for found in self._outside.values() if column in found), None)

    def put_outside(self, candidate: Candidate) -> None:
        """Let an item wait outside."""
        limited = None if candidate.terms.queue_limit is None else candidate.about[1]
        self._outside.setdefault(limited, {})[candidate.column] = candidate

    def forget_outside(self, column: int) -> None:
        """Let an item wait outside no longer, if it does."""
        for outside in self._outside.values():
            outside.pop(column, None)

    def from_outside(self) -> Iterator[Candidate]:
        """Items for which there is room now, the longest outside first; each is to be added before the next."""
        for attribute, outside in self._outside.items():
            while outside and len(self._items) < self._limit:
                column, candidate = next(iter(outside.items()))
                limit = candidate.terms.queue_limit
                if attribute is not None and limit is not None and len(self._limited.get(attribute, ())) >= limit:
                    break
                del outside[column]
                yield candidate


class Ended:
    """Items that are said no more, though not all who need them are known to hold them."""

    def __init__(self) -> None:
        self._terms: dict[int, Terms] = {}  # by column: by which that is so

    def add(self, candidate: Candidate) -> None:
        """An item is said no more."""
        self._terms[candidate.column] = candidate.terms

    def bars(self, column: int, waiting: Waiting, terms: Terms, now_s: float, is_new_need: bool) -> bool:
        """True if an item may not wait again: it is too old, or those who need it ask for no more than they had.

        Args:
            column: of the item.
            waiting: what is known from when it waited before.
            terms: of those who need it now.
            now_s: the time (s).
            is_new_need: True if somebody needs it now who did not before.
        """
        ended = self._terms.get(column)
        if ended is None:
            return False
        is_served = terms == ended or (waiting.n_said > 0 and not terms.acknowledged)
        if (is_served and not is_new_need) or now_s > waiting.observed_s + terms.time_to_live_s:
            return True
        del self._terms[column]
        return False


class Deadlines:
    """Until when candidates may wait, the earliest first."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, Candidate]] = []
        self._n_added = 0

    def add(self, candidate: Candidate) -> None:
        """A candidate comes in that may have one."""
        if math.isfinite(candidate.terms.time_to_live_s):
            self._n_added += 1
            heappush(self._heap, (candidate.deadline_s, self._n_added, candidate))

    def before(self, now_s: float) -> Iterator[Candidate]:
        """Those that still wait and may not any more; each is to be let go of before the next."""
        while self._heap and self._heap[0][0] < now_s:
            at_s, _, candidate = heappop(self._heap)
            if candidate.line is not None and candidate.deadline_s == at_s:
                yield candidate
