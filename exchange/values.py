"""What waits, and what it is worth to say it now: rules by which the queue of a vehicle compares candidates.

A rule gives each waiting candidate a value; the most valuable that fit go into the packet. So that a slot does not cost
a look at all that waits, a rule also says which candidates keep their order among themselves while they wait: those
have one *group*, and a *rank* in it. The queue then compares the first of each group. Rules whose values are linear in
the time waited have one group for each rate of growth, so few. A rule that knows no such order answers None; then every
candidate is a group of its own, and a slot costs as much as there are candidates.

Shipped are `additive` (Maurelli et al., section 6: the priority is added in every own slot), `goby` (Goby3's dynamic
buffer, P(t) = base * (t - t_last_send) / ttl, for each item instead of each type), `age` (the age of the information,
and the chance that it is still lacking) and `deadline` (least time left first, by priority).
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from exchange.arithmetic import power
from exchange.packets import Fragment, ItemUid, StatusUid
from worldmodel import PLAIN, Terms

STATUS_COLUMN = -1
"""A status has no column: nobody acknowledges it."""
LACKED = 0.5
"""Chance that something said is still lacking afterwards, as rules take it that go by it."""
MOST_SAID = 6
"""Rules that go by how often something was said count no further."""
_new = tuple.__new__  # makes a named tuple of a tuple, in half the time
LACKED_AFTER = tuple(power(LACKED, n_said) for n_said in range(MOST_SAID + 1))


class Moment(NamedTuple):
    """A time at which values are compared: ``now_s``, and ``n_slots``, the own slots so far, this one included."""

    now_s: float
    n_slots: int


@dataclass(slots=True)
class Waiting:
    """What is known of one candidate, an item or a status.

    Attributes:
        priority: of the need, 1 or more.
        observed_s: when its facts were observed (s).
        since_s: when it was taken or last said (s).
        since_slot: own slots of the vehicle until then.
        credit: weight gained before that and not used up; of the additive rule.
        n_said: how often it has been said.
        terms: of the need, for rules that go by them.
    """

    priority: int
    observed_s: float = 0.0
    since_s: float = 0.0
    since_slot: int = 0
    credit: int = 0
    n_said: int = 0
    terms: Terms = PLAIN

    def halt(self, n_slots: int) -> None:
        """Keep what has been gained so far: the priority changes now, or it does not wait any more."""
        self.credit += self.priority * (n_slots - self.since_slot)
        self.since_slot = n_slots

    def resume(self, n_slots: int) -> None:
        """Wait again, with what was gained before."""
        self.since_slot = n_slots

    def note_said(self, moment: Moment) -> None:
        """It has been said: what it gained is used up."""
        self.credit, self.since_slot, self.since_s = 0, moment.n_slots, moment.now_s
        self.n_said += 1


@dataclass(slots=True, eq=False)
class Candidate:
    """One thing that waits: an item, by its column, or a status.

    Attributes:
        uid: its name in tables.
        fragment: what is to be said.
        column: of the item, or ``STATUS_COLUMN``.
        waiting: what it is valued by.
        terms: of those who need it.
        tie: orders candidates of equal value.
        size_bits: about its size.
        version: another one whenever it is placed or leaves; entries of a line with an older one are stale.
        line: key of the line in which it stands; None while it does not wait.
        rests: it waits and is not said, see ``Queue.rest``.
    """

    uid: ItemUid | StatusUid
    fragment: Fragment
    column: int
    waiting: Waiting
    terms: Terms
    tie: tuple[int, ...]
    size_bits: int
    version: int = 0
    line: Hashable | None = None
    rests: bool = False

    def __lt__(self, other: Candidate) -> bool:
        """False: of two entries alike but for this one is stale, since an item that left and came again is one."""
        return False

    @property
    def about(self) -> tuple[int, int]:
        """Subject and attribute of its first fact."""
        return self.fragment.facts[0].subject, self.fragment.facts[0].attribute


class QueuePlace(NamedTuple):
    """Where a candidate stands: in a group, the higher rank first. See `ValueRule.place`."""

    group: Hashable
    rank: float


class ValueRule(Protocol):
    """A plug-in: what it is worth to say something now.

    A rule has no state of its own, and answers by its arguments alone. A candidate is placed when it is taken, when it
    has been said and when its priority changes; it is valued in own slots, if it is the first of its group.

    A rule of one's own, by which the oldest observation goes first whatever its priority:

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
        """Short; messages use it."""

    def place(self, waiting: Waiting) -> QueuePlace | None:
        """Group and rank: of two of one group, that of the higher rank has at no later time the lower value.

        Called by the queue outside of the comparison. None if candidates keep no order.
        """

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """What it is worth to say it at that moment, finite; the higher goes first.

        Called by the queue in own slots of its vehicle.
        """


class Additive:
    """The priority is added in every own slot since it was taken or last said: the rule of the paper."""

    name = "additive"

    def place(self, waiting: Waiting) -> QueuePlace:
        """One group for each priority; whole numbers, which the policy study has, too."""
        return _new(QueuePlace, (waiting.priority, waiting.credit - waiting.priority * waiting.since_slot))

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Priority times own slots.

        >>> Additive().value(Waiting(priority=3, since_slot=4), Moment(0.0, 6))
        6
        """
        return waiting.credit + waiting.priority * (moment.n_slots - waiting.since_slot)


class Age:
    """Priority times age of the information, times the chance that it is still lacking."""

    name = "age"

    def place(self, waiting: Waiting) -> QueuePlace:
        """One group for each priority and number of times that it was said."""
        return QueuePlace((waiting.priority, min(waiting.n_said, MOST_SAID)), -waiting.observed_s)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        """Age in seconds counts from the observation; each time that it was said halves it.

        >>> Age().value(Waiting(priority=2, observed_s=10.0, n_said=1), Moment(40.0, 1))
        30.0
        """
        lacked = LACKED_AFTER[min(waiting.n_said, MOST_SAID)]
        return waiting.priority * (moment.now_s - waiting.observed_s) * lacked


ADDITIVE = Additive()
