"""Candidates of the queue: value of sending them now, capacity, deadlines, reasons for not sending.

A rule gives each candidate a value; the most valuable that fit go into the packet. To avoid a scan of the whole queue,
a rule also assigns a *group* and a *rank* in it: the order of a group is constant while its candidates wait. The queue
then compares the first of each group. Values linear in waiting time need one group per growth rate. A rule without
constant order returns None; each candidate is then a group of its own, and a slot costs as much as there are
candidates.

Shipped are `additive` (Maurelli et al., section 6: the priority is added in every own slot), `goby` (Goby3's dynamic
buffer, P(t) = base * (t - t_last_send) / ttl, per item instead of per type), `age` (age of information times the
probability of lack) and `deadline` (least remaining time first, by priority).

On overflow the entry of lowest priority is displaced; of equals the newest, or the oldest under newest-first order.
Entries that need an acknowledgement wait outside and return once one fits: none is lost. An entry that was sent but is
still lacking swaps places with one outside; each transmission counts as a halving of its priority.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from heapq import heappop, heappush
from typing import NamedTuple, Protocol

from exchange.arithmetic import power
from exchange.packets import Fragment, ItemUid, StatusUid
from worldmodel import PLAIN, Terms

STATUS_COLUMN = -1
"""Column of statuses, which have none since they are not acknowledged."""
LACKED = 0.5
"""Probability that a sent entry is still lacking, as rules assume."""
MOST_SENT = 6
"""Transmissions from which rules count no further."""
LACKED_AFTER = tuple(power(LACKED, n_sent) for n_sent in range(MOST_SENT + 1))


class Moment(NamedTuple):
    """Time of a comparison; ``n_slots`` counts own slots up to and including this one."""

    now_s: float
    n_slots: int


@dataclass(slots=True)
class Waiting:
    """Value state of one candidate, or of a line that is valued as a whole.

    ``since_s`` is the time of queueing or last transmission, ``since_slot`` the own slots up to then; ``credit`` is the
    weight gained before and not used up, for the additive rule; ``priority`` (1 or more) and ``terms`` are of the need.
    """

    priority: int
    observed_s: float = 0.0
    since_s: float = 0.0
    since_slot: int = 0
    credit: int = 0
    n_sent: int = 0
    terms: Terms = PLAIN

    def halt(self, n_slots: int) -> None:
        """Save the weight gained before the priority changes or the candidate leaves the queue."""
        self.credit += self.priority * (n_slots - self.since_slot)
        self.since_slot = n_slots

    def note_sent(self, moment: Moment) -> None:
        """Record a transmission, which resets the weight."""
        self.credit, self.since_slot, self.since_s = 0, moment.n_slots, moment.now_s
        self.n_sent += 1


@dataclass(slots=True, kw_only=True)
class Candidate(Waiting):
    """Item or status of the queue; it remains the same when it leaves the queue and returns.

    Attributes:
        column: of the item, or ``STATUS_COLUMN``.
        tie: order of candidates of equal value.
        line: key of its queue class; None while not queued.
        rank: order in that class, higher first.
    """

    uid: ItemUid | StatusUid
    fragment: Fragment
    column: int
    tie: tuple[int, ...]
    size_bits: int
    line: Hashable | None = None
    rank: float = 0.0

    @property
    def about(self) -> tuple[int, int]:
        """Subject and attribute of its first fact."""
        return self.fragment.facts[0].subject, self.fragment.facts[0].attribute

    @property
    def limited(self) -> int | None:
        """Attribute whose need limits the number of queued items; None without a limit."""
        return None if self.terms.queue_limit is None else self.fragment.facts[0].attribute


def item_candidate(column: int, fragment: Fragment, size_bits: int, priority: int, since_s: float) -> Candidate:
    """Return the candidate of an item that is queued from ``since_s`` on."""
    uid, time_s = fragment.uid, fragment.time_s
    tie = (0, *uid)
    return Candidate(priority, time_s, since_s, uid=uid, fragment=fragment, column=column, tie=tie, size_bits=size_bits)


class QueuePlace(NamedTuple):
    """Group and rank of a candidate, higher rank first. See `ValueRule.place`."""

    group: Hashable
    rank: float


class ValueRule(Protocol):
    """Plug-in rule for the utility of sending a candidate now.

    A rule is stateless. The queue places a candidate on arrival, after transmission and on a change of priority; it
    evaluates the first of each group in own slots.

    A user's rule that sends the oldest observation first, whatever its priority:

    >>> class Oldest:
    ...     name = "oldest"
    ...     def place(self, waiting):
    ...         return QueuePlace("all", -waiting.observed_s)
    ...     def value(self, waiting, moment):
    ...         return moment.now_s - waiting.observed_s
    >>> Oldest().value(Waiting(priority=3, observed_s=40.0), Moment(100.0, 5))
    60.0
    """

    @property
    def name(self) -> str:
        """Short name for messages."""

    def place(self, waiting: Waiting) -> QueuePlace | None:
        """Return group and rank; None if candidates have no constant order.

        Of two candidates in one group, the one of higher rank never has the lower value later.
        """

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Return the finite value of sending the candidate at that moment; higher goes first."""


class Additive:
    """Sum of the priority over own slots since queueing or last transmission: the paper's rule."""

    name = "additive"

    def place(self, waiting: Waiting) -> QueuePlace:
        """Group by priority; ranks are integers, as in the policy study."""
        # The value is this rank plus priority times own slots, so that equal priorities keep their order.
        return QueuePlace(waiting.priority, waiting.credit - waiting.priority * waiting.since_slot)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Priority times own slots.

        >>> Additive().value(Waiting(priority=3, since_slot=4), Moment(0.0, 6))
        6
        """
        return waiting.credit + waiting.priority * (moment.n_slots - waiting.since_slot)


class Age:
    """Priority times age of information, times the probability of lack."""

    name = "age"

    def place(self, waiting: Waiting) -> QueuePlace:
        """Group by priority and number of transmissions."""
        return QueuePlace((waiting.priority, min(waiting.n_sent, MOST_SENT)), -waiting.observed_s)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Age (s) counts from the observation; each transmission halves the value.

        >>> Age().value(Waiting(priority=2, observed_s=10.0, n_sent=1), Moment(40.0, 1))
        30.0
        """
        lacked = LACKED_AFTER[min(waiting.n_sent, MOST_SENT)]
        return waiting.priority * (moment.now_s - waiting.observed_s) * lacked


DEFAULT_TIME_TO_LIVE_S = 1800.0
"""Time to live for rules if a need names none; Goby's default."""
LAST_SHARE = 0.1
"""Lower bound of the remaining time in ``Deadline``, as a share of the time to live.

It keeps overdue items that were sent often from preceding new ones for ever.
"""


def _rated_s(waiting: Waiting) -> float:
    """Time to live (s), with the default for rules that need a finite one."""
    time_to_live_s = waiting.terms.time_to_live_s
    return time_to_live_s if math.isfinite(time_to_live_s) else DEFAULT_TIME_TO_LIVE_S


class Goby:
    """P(t) = base * (t - t_last_send) / ttl, with the priority as base (Goby3, dynamic buffer)."""

    name = "goby"

    def place(self, waiting: Waiting) -> QueuePlace:
        """Group by rate of growth."""
        return QueuePlace(waiting.priority / _rated_s(waiting), -waiting.since_s)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Grow from 0 at queueing or the last transmission to the priority after a time to live.

        >>> Goby().value(Waiting(priority=10, since_s=100.0, terms=Terms(time_to_live_s=60.0)), Moment(130.0, 1))
        5.0
        """
        return waiting.priority * (moment.now_s - waiting.since_s) / _rated_s(waiting)


class Deadline:
    """Priority over remaining time, times the probability that the entry is still lacking."""

    name = "deadline"

    def place(self, waiting: Waiting) -> QueuePlace:
        """Group by priority, time to live and number of transmissions; earliest deadline first."""
        alike = waiting.priority, _rated_s(waiting), min(waiting.n_sent, MOST_SENT)
        return QueuePlace(alike, -self._deadline_s(waiting))

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Bound the remaining time from below by ``LAST_SHARE`` of the time to live.

        >>> Deadline().value(Waiting(priority=20, observed_s=0.0, terms=Terms(time_to_live_s=60.0)), Moment(50.0, 1))
        2.0
        """
        lacked = LACKED_AFTER[min(waiting.n_sent, MOST_SENT)]
        least_s = LAST_SHARE * _rated_s(waiting)
        return waiting.priority * lacked / max(least_s, self._deadline_s(waiting) - moment.now_s)

    def _deadline_s(self, waiting: Waiting) -> float:
        return waiting.observed_s + _rated_s(waiting)


ADDITIVE = Additive()


# Limits -------------------------------------------------------------------------------------------


class Unsaid(Enum):
    """Reason why a queued entry is not in a packet."""

    NOTHING_OPEN = "nothing open"
    BLACKOUT = "blackout"
    TOO_LARGE = "too large for the room left"
    WAITING = "waiting for acknowledgement"
    LOWER_VALUE = "lower value"
    OVERFLOW = "overflow"
    RELAYED = "left to a relay"

    __hash__ = object.__hash__  # several times faster than Enum's; all slots count reasons


class Expired(Enum):
    """Reason why an entry is discarded before all nodes that need it are known to hold it."""

    TIME_TO_LIVE = "time to live"
    OVERFLOW = "overflow"
    SUPERSEDED = "superseded"
    NOT_NEEDED = "not needed"
    SENT_ONCE = "said once"


class Expiry(NamedTuple):
    """Record of a discarded entry; ``comes_back`` if it waits outside of the queue for capacity."""

    uid: ItemUid | StatusUid
    reason: Expired
    latency_s: float
    comes_back: bool = False


class QueueLimits:
    """Capacity limits and deadlines of the items ``inside`` a queue; ``limit`` is infinite for none."""

    def __init__(self, limit: float, inside: Mapping[int, Candidate]) -> None:
        self._limit = limit
        self._inside = inside  # by column, in the order of taking
        self.outside: dict[int | None, dict[int, Candidate]] = {}
        """Items outside, by attribute with a limit and by column."""
        self._ended: dict[int, Terms] = {}  # by column of a discarded item: its terms
        self.deadlines: list[tuple[float, int, Candidate]] = []
        """Heap of deadlines (s), with those of entries that left."""
        self._n_deadlines = 0

    def rival(self, candidate: Candidate) -> Candidate | None:
        """Return the item to displace for a candidate (maybe itself); None if it fits."""
        limit, attribute = candidate.terms.queue_limit, candidate.limited
        rivals = [] if limit is None else [item for item in self._inside.values() if item.limited == attribute]
        if limit is None or len(rivals) < limit:
            if len(self._inside) < self._limit:
                return None
            lowest = min([item.priority for item in self._inside.values()])
            if lowest > candidate.priority:
                return candidate
            rivals = [item for item in self._inside.values() if item.priority == lowest]
            if lowest < candidate.priority:
                return rivals[-1]
        return rivals[0] if candidate.terms.newest_first else candidate

    # Outside -------------------------------------------------------------------------------------

    def find_outside(self, column: int) -> Candidate | None:
        """Return the item of a column if it waits outside."""
        return next((candidates[column] for candidates in self.outside.values() if column in candidates), None)

    def put_outside(self, candidate: Candidate) -> None:
        """Move an item outside."""
        self.outside.setdefault(candidate.limited, {})[candidate.column] = candidate

    def forget_outside(self, column: int) -> None:
        """Remove an item from outside, if present."""
        for outside in self.outside.values():
            outside.pop(column, None)

    def from_outside(self) -> Iterator[Candidate]:
        """Yield items that fit now, oldest first; add each before the next."""
        for outside in self.outside.values():
            while outside and len(self._inside) < self._limit:
                column, candidate = next(iter(outside.items()))
                if not self._is_within_limit(candidate):
                    break
                del outside[column]
                yield candidate

    def _is_within_limit(self, candidate: Candidate, without: int | None = None) -> bool:
        """True if its need admits one more item inside, if the item of column ``without`` leaves."""
        limit, attribute = candidate.terms.queue_limit, candidate.limited
        rivals = [column for column, item in self._inside.items() if item.limited == attribute and column != without]
        return limit is None or len(rivals) < limit

    def follower(self, sent: Candidate) -> Candidate | None:
        """Return the item outside that replaces a sent one; None if none ranks before it."""
        for outside in self.outside.values():
            candidate = next(iter(outside.values()), None)
            if candidate is None or _rank(candidate) >= _rank(sent):
                continue
            if self._is_within_limit(candidate, sent.column):
                return candidate
        return None

    # Discarded ----------------------------------------------------------------------------------

    def end(self, candidate: Candidate) -> None:
        """Record that an item is discarded."""
        self._ended[candidate.column] = candidate.terms

    def bars(self, candidate: Candidate, terms: Terms, now_s: float, is_new_need: bool) -> bool:
        """Return whether a discarded item may not be queued again: overdue, or no further need.

        ``terms`` are of the present needs; ``is_new_need``: a vehicle needs it now that did not before.
        """
        ended = self._ended.get(candidate.column)
        if ended is None:
            return False
        is_served = terms == ended or (candidate.n_sent > 0 and not terms.acknowledged)
        if (is_served and not is_new_need) or now_s > candidate.observed_s + terms.time_to_live_s:
            return True
        del self._ended[candidate.column]
        return False

    # Deadlines -----------------------------------------------------------------------------------

    def set_deadline(self, candidate: Candidate) -> None:
        """Register the deadline of an entry with a finite time to live."""
        if math.isfinite(candidate.terms.time_to_live_s):
            self._n_deadlines += 1
            # The counter breaks ties, since candidates have no order.
            heappush(self.deadlines, (_deadline_s(candidate), self._n_deadlines, candidate))

    def overdue(self, now_s: float) -> Iterator[Candidate]:
        """Yield queued entries past their deadline; remove each before the next."""
        while self.deadlines and self.deadlines[0][0] < now_s:
            at_s, _, candidate = heappop(self.deadlines)
            # A different deadline belongs to terms that have changed since.
            if candidate.line is not None and _deadline_s(candidate) == at_s:
                yield candidate


def _rank(candidate: Candidate) -> int:
    """Rank for swaps, lowest first: transmissions minus binary digits of the priority.

    >>> [n_sent - priority.bit_length() for priority, n_sent in ((20, 0), (20, 4), (1, 0))]
    [-5, -1, -1]
    """
    return candidate.n_sent - candidate.priority.bit_length()


def _deadline_s(candidate: Candidate) -> float:
    return candidate.observed_s + candidate.terms.time_to_live_s
