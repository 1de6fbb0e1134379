"""Limits of the queue: room, deadlines, blackouts, and reasons for what is not sent.

is said no more, goes newest first, or waits for the end of a blackout.

A queue is made without these. They are made when it is full, or when the first need comes that is served on other terms
than plain ones.

Of those that wait the least urgent makes room for a more urgent one; of equals, the one that was taken last. Where the
newest is to go first, the one that was taken first makes room. What is to be acknowledged waits outside of the queue,
and comes in once there is room: nothing that is to be acknowledged is lost. Nor does it wait for one who never
acknowledges: what has been said, and is lacking still, changes places with what waits outside. Each time that it has
been said counts as half of its priority, so that what is urgent is said more often.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from enum import Enum
from heapq import heappop, heappush
from typing import NamedTuple

from exchange.packets import ItemUid, StatusUid
from exchange.values import LACKED_AFTER, MOST_SAID, Candidate, Moment, QueuePlace, Waiting
from worldmodel import Terms


class Unsaid(Enum):
    """Why something that waits is not in a packet."""

    NOTHING_OPEN = "nothing open"
    BLACKOUT = "blackout"
    TOO_LARGE = "too large for the room left"
    WAITING = "waiting for acknowledgement"
    LOWER_VALUE = "lower value"
    OVERFLOW = "overflow"
    RELAYED = "left to a relay"

    __hash__ = object.__hash__  # that of enumerations takes several times as long, and all slots count reasons


class Expired(Enum):
    """Why something is said no more, though not all who need it are known to hold it."""

    TIME_TO_LIVE = "time to live"
    OVERFLOW = "overflow"
    SUPERSEDED = "superseded"
    NOT_NEEDED = "not needed"
    SAID_ONCE = "said once"


class Expiry(NamedTuple):
    """Something is said no more.

    Attributes:
        uid: of the item or status.
        reason: why.
        latency_s: since its observation.
        comes_back: True if it waits outside of the queue until there is room.
    """

    uid: ItemUid | StatusUid
    reason: Expired
    latency_s: float
    comes_back: bool = False


DEFAULT_TIME_TO_LIVE_S = 1800.0
"""Time to live that rules take where a need names none; Goby's default."""
LAST_SHARE = 0.1
"""``Deadline`` counts the time left as this share of the time to live at least, overdue or not: more than what an item
that was said often may still be lacking is worth, so that it is not said for ever before what is new."""


class QueueLimits:
    """Items that wait: so many at most, and of those whose need has a limit, no more than that; and until when.

    Args:
        limit: most items in all, infinite for no limit.
        waiting: items that wait already, in the order of taking.
    """

    def __init__(self, limit: float, waiting: Iterable[Candidate]) -> None:
        self._limit = limit
        self._n_items = 0
        self._levels: dict[int, dict[int, Candidate]] = {}  # by priority and column, in the order of taking
        self._limited: dict[int, dict[int, Candidate]] = {}  # by attribute and column, where the terms have a limit
        self._outside: dict[int | None, dict[int, Candidate]] = {}  # by attribute with a limit, and column
        self._ended: dict[int, Terms] = {}  # by column, of what is said no more: the terms by which that is so
        self._deadlines: list[tuple[float, int, Candidate]] = []
        self._n_deadlines = 0
        for candidate in waiting:
            self.add(candidate)

    # Inside --------------------------------------------------------------------------------------

    def add(self, candidate: Candidate) -> None:
        """Let an item wait inside."""
        self._n_items += 1
        self._levels.setdefault(candidate.waiting.priority, {})[candidate.column] = candidate
        if candidate.terms.queue_limit is not None:
            self._limited.setdefault(candidate.about[1], {})[candidate.column] = candidate

    def remove(self, candidate: Candidate) -> None:
        """Let an item go that waits inside."""
        self._n_items -= 1
        del self._levels[candidate.waiting.priority][candidate.column]
        if candidate.terms.queue_limit is not None:
            del self._limited[candidate.about[1]][candidate.column]

    def rival(self, candidate: Candidate) -> Candidate | None:
        """What has to make room for an item, or the item itself; None if there is room."""
        terms, priority = candidate.terms, candidate.waiting.priority
        rivals = self._limited.get(candidate.about[1], {})
        if terms.queue_limit is None or len(rivals) < terms.queue_limit:
            if self._n_items < self._limit:
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

    def outside(self, column: int) -> Candidate | None:
        """The item of a column, if it waits outside."""
        return next((candidates[column] for candidates in self._outside.values() if column in candidates), None)

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
            while outside and self._n_items < self._limit:
                column, candidate = next(iter(outside.items()))
                limit = candidate.terms.queue_limit
                if attribute is not None and limit is not None and len(self._limited.get(attribute, ())) >= limit:
                    break
                del outside[column]
                yield candidate

    def follower(self, said: Candidate) -> Candidate | None:
        """What comes in from outside for an item that has been said; None if nothing outside comes before it."""
        for attribute, outside in self._outside.items():
            candidate = next(iter(outside.values()), None)
            if candidate is None or _rank(candidate) >= _rank(said):
                continue
            limit, limited = candidate.terms.queue_limit, self._limited.get(attribute or 0, {})
            if attribute is None or limit is None or len(limited) - (said.column in limited) < limit:
                return candidate
        return None

    # Said no more --------------------------------------------------------------------------------

    def end(self, candidate: Candidate) -> None:
        """An item is said no more."""
        self._ended[candidate.column] = candidate.terms

    def bars(self, column: int, waiting: Waiting, terms: Terms, now_s: float, is_new_need: bool) -> bool:
        """True if an item may not wait again: it is too old, or those who need it ask for no more than they had.

        Args:
            column: of the item.
            waiting: what is known from when it waited before.
            terms: of those who need it now.
            now_s: the time (s).
            is_new_need: True if somebody needs it now who did not before.
        """
        ended = self._ended.get(column)
        if ended is None:
            return False
        is_served = terms == ended or (waiting.n_said > 0 and not terms.acknowledged)
        if (is_served and not is_new_need) or now_s > waiting.observed_s + terms.time_to_live_s:
            return True
        del self._ended[column]
        return False

    # Deadlines -----------------------------------------------------------------------------------

    def set_deadline(self, candidate: Candidate) -> None:
        """A candidate comes in that may wait only for some time."""
        candidate.waiting.terms = candidate.terms
        if math.isfinite(candidate.terms.time_to_live_s):
            self._n_deadlines += 1
            heappush(self._deadlines, (_deadline_s(candidate), self._n_deadlines, candidate))

    def overdue(self, now_s: float) -> Iterator[Candidate]:
        """Those that still wait and may not any more; each is to be let go of before the next."""
        while self._deadlines and self._deadlines[0][0] < now_s:
            at_s, _, candidate = heappop(self._deadlines)
            if candidate.line is not None and _deadline_s(candidate) == at_s:
                yield candidate


def _rank(candidate: Candidate) -> int:
    """Orders items that change places, the lowest first: by how often each was said, less the digits of its priority.

    >>> [n_said - priority.bit_length() for priority, n_said in ((20, 0), (20, 4), (1, 0))]
    [-5, -1, -1]
    """
    return candidate.waiting.n_said - candidate.waiting.priority.bit_length()


def _deadline_s(candidate: Candidate) -> float:
    """Until when it is of use (s)."""
    return candidate.waiting.observed_s + candidate.terms.time_to_live_s


class LinesOnTerms:
    """Where what goes newest first, and what has blackouts, stands among the lines of a queue."""

    def __init__(self) -> None:
        self._blackouts: dict[Hashable, tuple[tuple[int, int], float]] = {}  # by line: about what, and how long
        self._said_s: dict[tuple[int, int], float] = {}  # by subject and attribute

    def place(
        self, candidate: Candidate, key: Hashable, rank: float, n_slots: int
    ) -> tuple[Hashable, float, Waiting | None]:
        """The line of a candidate, its rank there, and what the line is valued by if it waits as one.

        Args:
            candidate: stands in no line.
            key: of the line in which it stands on plain terms; rank: that it has there.
            n_slots: own slots so far.
        """
        waiting, terms, about, shared = candidate.waiting, candidate.terms, candidate.about, None
        if terms.newest_first:
            key, rank = (waiting.priority, "newest", about[1]), waiting.observed_s
            shared = Waiting(waiting.priority, waiting.observed_s, waiting.since_s, n_slots)
            shared.terms = terms
        if terms.blackout_s:
            blackout = about, terms.blackout_s
            key = blackout, key
            self._blackouts[key] = blackout
        return key, rank, shared

    def bar(self, line: Hashable, now_s: float) -> Unsaid | None:
        """Why nothing of a line may go now: it is in a blackout. None if it may."""
        about, blackout_s = self._blackouts.get(line, ((0, 0), 0.0))
        return Unsaid.BLACKOUT if blackout_s and now_s - self._said_s.get(about, -math.inf) < blackout_s else None

    def note_said(self, chosen: Sequence[Candidate], now_s: float) -> None:
        """These go now: a blackout begins for what has one."""
        for candidate in chosen:
            if candidate.terms.blackout_s:
                self._said_s[candidate.about] = now_s


# Rules by the time to live -------------------------------------------------------------------------


def _rated_s(waiting: Waiting) -> float:
    """The time to live, or the default of rules that need one (s)."""
    time_to_live_s = waiting.terms.time_to_live_s
    return time_to_live_s if math.isfinite(time_to_live_s) else DEFAULT_TIME_TO_LIVE_S


class Goby:
    """P(t) = base * (t - t_last_send) / ttl, with the priority as base (Goby3, dynamic buffer)."""

    name = "goby"

    def place(self, waiting: Waiting) -> QueuePlace:
        """One group for each rate of growth."""
        return QueuePlace(waiting.priority / _rated_s(waiting), -waiting.since_s)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Grows from 0, when it was taken or last said, to the priority after a time to live, and beyond.

        >>> Goby().value(Waiting(priority=10, since_s=100.0, terms=Terms(time_to_live_s=60.0)), Moment(130.0, 1))
        5.0
        """
        return waiting.priority * (moment.now_s - waiting.since_s) / _rated_s(waiting)


class Deadline:
    """Priority over the time left until the value is of no use, times the chance that it is still lacking."""

    name = "deadline"

    def place(self, waiting: Waiting) -> QueuePlace:
        """One group for each priority, time to live and number of times said; the earliest deadline first."""
        alike = waiting.priority, _rated_s(waiting), min(waiting.n_said, MOST_SAID)
        return QueuePlace(alike, -self._deadline_s(waiting))

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """The time left counts as ``LAST_SHARE`` of the time to live at least.

        >>> Deadline().value(Waiting(priority=20, observed_s=0.0, terms=Terms(time_to_live_s=60.0)), Moment(50.0, 1))
        2.0
        """
        lacked = LACKED_AFTER[min(waiting.n_said, MOST_SAID)]
        least_s = LAST_SHARE * _rated_s(waiting)
        return waiting.priority * lacked / max(least_s, self._deadline_s(waiting) - moment.now_s)

    def _deadline_s(self, waiting: Waiting) -> float:
        return waiting.observed_s + _rated_s(waiting)
