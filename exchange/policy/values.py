"""Value rules: utility of sending a queued candidate now.

A rule gives each candidate a value; the most valuable that fit go into the packet. To avoid a scan of the whole queue,
a rule also assigns a *group* and a *rank* in it: the order of a group is constant while its candidates wait. The queue
then compares the first of each group. Values linear in waiting time need one group per growth rate. A rule without
constant order returns None; each candidate is then a group of its own, and a slot costs as much as there are
candidates.

Shipped are `additive` (Maurelli et al., section 6: the priority is added in every own slot), `goby` (Goby3's dynamic
buffer, P(t) = base * (t - t_last_send) / ttl, per item instead of per type), `age` (age of information times the
probability of lack) and `deadline` (least remaining time first, by priority).
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
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

    Attributes:
        priority: of the need, 1 or more.
        observed_s: time of its observation.
        since_s: time of queueing or last transmission.
        since_slot: own slots up to then.
        credit: weight gained before and not used up; for the additive rule.
        n_sent: number of transmissions.
        terms: of the need.
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
        size_bits: approximate.
        version: changes with each placement or removal; line entries with an older one are stale.
        line: key of its queue class; None while not queued.
        rests: suspended, see ``Queue.rest``.
    """

    uid: ItemUid | StatusUid
    fragment: Fragment
    column: int
    tie: tuple[int, ...]
    size_bits: int
    version: int = 0
    line: Hashable | None = None
    rests: bool = False

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


ADDITIVE = Additive()
