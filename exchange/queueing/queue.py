"""What waits to be said: the open items of a vehicle, and the newest value of each status, in one weighted queue.

What goes into a packet is the most valuable that fits, again and again, and of equals the lower item UID, items before
statuses; the policy study chooses by the same rule, and a test compares the two. That takes no look at all that waits.
Candidates that keep their order while they wait stand in one *line*, see `exchange.values`; a slot compares the heads
of the lines, and takes from them until nothing more fits. It costs as much as there are lines, and as it sends.

A candidate too large for the room left is passed over. A line holds candidates of about one size, so if more than
``LOOK_PAST`` of it do not fit, the rest is taken not to fit either. Where candidates of a line have one size exactly,
that is so; in a packed form they differ by some bits, and one that would have fitted may be missed.

A queue is limited once it is full or a need asks for it, see `exchange.queueing.limits`. What does not go in, or has to
make room, is told by an `Expiry`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable
from heapq import heapify, heappop, heappush
from typing import Protocol

from exchange.ack import members
from exchange.packets import Fragment, StatusUid
from exchange.queueing.limits import Expired, Expiry, LinesOnTerms, QueueLimits, Unsaid
from exchange.values import ADDITIVE, STATUS_COLUMN, Candidate, Moment, ValueRule, Waiting
from worldmodel import PLAIN, Terms

SLACK = 16
"""Stale entries of a line, beside as many as there are candidates in it, before it is rebuilt."""
LOOK_PAST = 3
"""Candidates of one line that may not fit before the rest of it is left."""
RESTING = "resting"
"""Key of the line of what rests. Its priority is 0, and only what has a higher one is said."""

Head = tuple[float, tuple[int, ...], Candidate]
"""Value, highest first by its sign; what orders equals; candidate."""
Entry = tuple[float, tuple[int, ...], int, Candidate]
"""Rank, lowest first; what orders equals; version; candidate."""


class Line:
    """Candidates that keep their order while they wait, the best first.

    Attributes:
        key: of the line in its queue.
        priority: of all of them.
        shared: what a line is valued by that waits as one; None if each candidate waits for itself.
        n_waiting, n_repeated: how many wait in it, and how many of these have been said before.
        entries: a heap of those that wait, and of stale entries.
    """

    __slots__ = ("entries", "key", "n_repeated", "n_waiting", "priority", "shared")

    def __init__(self, key: Hashable, priority: int, shared: Waiting | None = None) -> None:
        self.key = key
        self.priority = priority
        self.shared = shared
        self.n_waiting = 0
        self.n_repeated = 0
        self.entries: list[Entry] = []


class Room(Protocol):
    """A packet that is being filled."""

    def add(self, fragment: Fragment) -> bool:
        """Put a fragment in; False if it does not fit: then nothing has changed."""


class Lines:
    """The lines of one vehicle.

    Args:
        rule: says what is worth most.

    Attributes:
        on_terms: says where else than usual a candidate stands, and what is in a blackout; None until asked for.
    """

    def __init__(self, rule: ValueRule) -> None:
        self._rule = rule
        self._lines: dict[Hashable, Line] = {}
        self.on_terms: LinesOnTerms | None = None

    @property
    def n_waiting(self) -> int:
        """How many candidates stand in them."""
        return sum(line.n_waiting for line in self._lines.values())

    def bar(self, line: Line, now_s: float) -> Unsaid | None:
        """Why nothing of a line may go; None if it may."""
        if line.key == RESTING:
            return Unsaid.RELAYED
        return None if self.on_terms is None else self.on_terms.bar(line.key, now_s)

    def choose(self, room: Room, moment: Moment) -> tuple[list[Candidate], Counter[Unsaid]]:
        """Fill a packet; returns what goes, the most valuable first, and how many do not go, by the reason.

        Args:
            room: the packet.
            moment: of the own slot.
        """
        unsaid: Counter[Unsaid] = Counter()
        heads, n_waiting, n_repeated = self._heads(moment, unsaid)
        passed: dict[Hashable, list[tuple[Line, Entry]]] = {}
        n_passed = n_too_large = 0
        chosen: list[Candidate] = []
        while heads:
            _, _, candidate = heappop(heads)
            line = self._lines[candidate.line]
            entry = heappop(line.entries)
            if room.add(candidate.fragment):
                chosen.append(candidate)
                n_too_large = n_passed
                if line.shared is not None:
                    line.shared.note_said(moment)
            else:
                n_passed += 1
                of_line = passed.setdefault(line.key, [])
                of_line.append((line, entry))
                if len(of_line) > LOOK_PAST:
                    continue
            if line.entries:
                self._compare(heads, line, moment)
        for of_line in passed.values():
            for line, entry in of_line:
                heappush(line.entries, entry)
        if self.on_terms is not None:
            self.on_terms.note_said(chosen, moment.now_s)
        n_unsaid = n_waiting - len(chosen) - n_too_large
        n_repeated = min(n_unsaid, n_repeated - sum([candidate.waiting.n_said > 0 for candidate in chosen]))
        counts = (
            (Unsaid.TOO_LARGE, n_too_large),
            (Unsaid.WAITING, n_repeated),
            (Unsaid.LOWER_VALUE, n_unsaid - n_repeated),
        )
        for reason, n in counts:
            if n:
                unsaid[reason] += n
        return chosen, unsaid

    def _heads(self, moment: Moment, unsaid: Counter[Unsaid]) -> tuple[list[Head], int, int]:
        """Heads of the lines that may go, how many wait in these, and how many of them have been said before."""
        heads: list[Head] = []
        n_waiting = n_repeated = 0
        for line in list(self._lines.values()):
            if line.n_waiting == 0:
                if line.shared is None:
                    del self._lines[line.key]
            elif (reason := self.bar(line, moment.now_s)) is not None:
                unsaid[reason] += line.n_waiting
            else:
                n_waiting += line.n_waiting
                n_repeated += line.n_repeated
                self._compare(heads, line, moment)
        return heads, n_waiting, n_repeated

    def _compare(self, heads: list[Head], line: Line, moment: Moment) -> None:
        """Let the best of a line that is not passed over compete with the others."""
        entries = line.entries
        while entries and entries[0][2] != entries[0][3].version:
            heappop(entries)
        if entries:
            head = entries[0][3]
            value = self._rule.value(line.shared or head.waiting, moment)
            heappush(heads, (-value, head.tie, head))

    def remove(self, candidate: Candidate) -> None:
        """Take a candidate out of the line in which it stands."""
        line = self._lines[candidate.line]
        candidate.version += 1
        candidate.line = None
        line.n_waiting -= 1
        line.n_repeated -= candidate.waiting.n_said > 0
        if len(line.entries) > 2 * line.n_waiting + SLACK:
            line.entries = [entry for entry in line.entries if entry[2] == entry[3].version]
            heapify(line.entries)

    def place(self, candidate: Candidate, n_slots: int) -> None:
        """Put a candidate where it belongs, before those of lower rank.

        Args:
            candidate: stands in no line.
            n_slots: own slots so far.
        """
        waiting = candidate.waiting
        place, shared = self._rule.place(waiting), None
        key: Hashable
        if place is None:
            key, rank = (waiting.priority, "alone", candidate.tie), 0.0
        else:
            key, rank = (waiting.priority, candidate.size_bits, place.group), place.rank
        if self.on_terms is not None:
            key, rank, shared = self.on_terms.place(candidate, key, rank, n_slots)
        if candidate.rests:
            key, shared = RESTING, None
        line = self._lines.get(key)
        if line is None:
            line = self._lines[key] = Line(key, 0 if candidate.rests else waiting.priority, shared)
        candidate.version += 1
        candidate.line = key
        line.n_waiting += 1
        line.n_repeated += waiting.n_said > 0
        heappush(line.entries, (-rank, candidate.tie, candidate.version, candidate))


class Queue:
    """The candidates of one vehicle for its next packet.

    Args:
        rule: says what is worth most.
        limit: most items that wait in it.

    Attributes:
        open: item set of those that wait, outside of the queue too.
        resting: item set of those that wait inside and are not said.
        unsaid: how many candidates were not said in the last own slot, by the reason.
        expired: what has come to be said no more since this was taken last.
    """

    def __init__(self, rule: ValueRule = ADDITIVE, limit: int | None = None) -> None:
        self._lines = Lines(rule)
        self._items: dict[int, Candidate] = {}  # by column, in the order of taking
        self._limit = math.inf if limit is None else limit
        self._limits: QueueLimits | None = None  # made once there is something to limit
        self._status: dict[tuple[int, int], Candidate] = {}  # by subject and attribute
        self._n_status = 0
        self._n_slots = 0
        self._said: list[Candidate] = []  # items of the last own slot that wait again, where something limits
        self.expired: list[Expiry] = []
        self.open = 0
        self.resting = 0
        self.unsaid: Counter[Unsaid] = Counter()

    def __len__(self) -> int:
        """How many items wait in it."""
        return len(self._items)

    @property
    def statuses(self) -> list[Candidate]:
        """The statuses that wait."""
        return [candidate for candidate in self._status.values() if candidate.line is not None]

    @property
    def items_weight(self) -> int:
        """Priority times size, of all items that wait in it."""
        return sum([candidate.waiting.priority * candidate.size_bits for candidate in self._items.values()])

    # What comes in -------------------------------------------------------------------------------

    def take(
        self,
        column: int,
        fragment: Fragment,
        waiting: Waiting,
        size_bits: int,
        terms: Terms = PLAIN,
        now_s: float = 0.0,
        is_new_need: bool = False,
    ) -> None:
        """Let an item wait; where there is no room, one of those that wait makes room, or it does.

        What is said no more waits again if somebody comes to need it, or other terms ask for more, while it is of use.

        Args:
            column: of the item.
            fragment: the item.
            waiting: what is known from when it waited before.
            size_bits: about its size.
            terms: of those who need it.
            now_s: the time (s).
            is_new_need: True if somebody needs it now who did not before.
        """
        self._heed(terms)
        limits = self._limits
        if limits is not None and limits.bars(column, waiting, terms, now_s, is_new_need):
            return
        uid = fragment.uid
        candidate = Candidate(uid, fragment, column, waiting, terms, (0, *uid), size_bits)
        waiting.resume(self._n_slots)
        self.open |= 1 << column
        self._let_in(candidate, now_s)

    def take_status(self, fragment: Fragment, priority: int, size_bits: int, terms: Terms = PLAIN) -> None:
        """Let the newest value of a status wait in place of the older one, with the weight that this has gained."""
        if terms is not PLAIN:
            self._heed(terms)
        about = fragment.facts[0].subject, fragment.facts[0].attribute
        uid = StatusUid(fragment.origin, fragment.time_s, *about)
        candidate = self._status.get(about)
        if candidate is None:
            tie, self._n_status = (1, self._n_status), self._n_status + 1
            candidate = Candidate(uid, fragment, STATUS_COLUMN, Waiting(priority), terms, tie, size_bits)
            candidate.waiting.since_s = fragment.time_s
            self._status[about] = candidate
        elif candidate.line is not None:
            self._leave(candidate)
            self._tell(candidate, Expired.SUPERSEDED, fragment.time_s)
        candidate.uid, candidate.fragment, candidate.size_bits, candidate.terms = uid, fragment, size_bits, terms
        waiting = candidate.waiting
        waiting.priority, waiting.observed_s, waiting.n_said = priority, fragment.time_s, 0
        waiting.since_slot = self._n_slots
        if (limits := self._limits) is not None:
            limits.set_deadline(candidate)
        self._lines.place(candidate, self._n_slots)

    def drop_status(self, about: tuple[int, int], now_s: float) -> None:
        """Nobody needs a status any more, by subject and attribute."""
        candidate = self._status.pop(about, None)
        if candidate is not None and candidate.line is not None:
            self._leave(candidate)
            self._tell(candidate, Expired.NOT_NEEDED, now_s)

    def drop(self, column: int) -> None:
        """Let an item wait no longer; what it has gained counts if it comes in again."""
        if self.open >> column & 1:
            self.open ^= 1 << column
            self._withdraw(column)

    def revalue(self, column: int, priority: int, terms: Terms, now_s: float = 0.0) -> None:
        """Another priority, or other terms, hold for an item that waits, inside or outside of the queue."""
        self._heed(terms)
        candidate = self._items.get(column)
        if (limits := self._limits) is not None:
            candidate = candidate or limits.outside(column)
        if candidate is None or (priority, terms) == (candidate.waiting.priority, candidate.terms):
            return
        self._withdraw(column)
        candidate.waiting.priority, candidate.terms = priority, terms
        self._let_in(candidate, now_s)

    def rest(self, items: int) -> None:
        """Let these items rest and all others wake: what rests stays open, is not said, and gains nothing."""
        for column in members((items ^ self.resting) & self.open):
            candidate = self._items.get(column)
            if candidate is not None:  # else it waits outside
                self._leave(candidate)
                if items >> column & 1:
                    candidate.rests, self.resting = True, self.resting | 1 << column
                self._lines.place(candidate, self._n_slots)

    def _heed(self, terms: Terms) -> None:
        """Have limits from now on, if the queue is full or these terms ask for more than plain ones do."""
        if self._limits is None and (len(self._items) >= self._limit or (terms is not PLAIN and terms != PLAIN)):
            self._limits = QueueLimits(self._limit, self._items.values())
            self._lines.on_terms = LinesOnTerms()

    # What goes out -------------------------------------------------------------------------------

    def choose(self, room: Room, now_s: float) -> list[Candidate]:
        """Fill a packet; returns what goes, the most valuable first.

        Args:
            room: the packet.
            now_s: when the own slot opens.
        """
        if self._limits is not None:
            self._update(now_s)
        self._n_slots += 1
        moment = Moment(now_s, self._n_slots)
        chosen, unsaid = self._lines.choose(room, moment)
        self._note_unsaid(unsaid, not chosen)
        for candidate in chosen:
            self._lines.remove(candidate)
            candidate.waiting.note_said(moment)
            if candidate.column == STATUS_COLUMN:
                continue
            if candidate.terms.acknowledged:  # it waits again, from 0
                self._lines.place(candidate, self._n_slots)
            else:
                self._forget(candidate)
                self._end(candidate)
                self._tell(candidate, Expired.SAID_ONCE, now_s)
        if self._limits is not None:
            self._said = [candidate for candidate in chosen if candidate.column in self._items]
        return chosen

    def _note_unsaid(self, reasons: Counter[Unsaid], is_empty: bool) -> None:
        """Keep why what waits was not said; ``is_empty`` if nothing was."""
        self.unsaid = reasons
        n_outside = 0 if self._limits is None else self._limits.n_outside
        if n_outside:
            reasons[Unsaid.OVERFLOW] = n_outside
        elif is_empty and not reasons:
            reasons[Unsaid.NOTHING_OPEN] = 1

    def _update(self, now_s: float) -> None:
        """Let in what waits outside, for what was said and is lacking still, too; let go of what is too old."""
        if (limits := self._limits) is not None:
            for candidate in limits.from_outside():
                self._enter(candidate)
            for said in self._said:
                if said.line is not None and (follower := limits.follower(said)) is not None:
                    self._let_go(said)
                    limits.forget_outside(follower.column)
                    self._enter(follower)
                    limits.put_outside(said)
            for candidate in limits.overdue(now_s):
                self._expire(candidate, now_s)

    def take_expired(self) -> tuple[Expiry, ...]:
        """What has come to be said no more since this was asked last."""
        expired, self.expired = tuple(self.expired), []
        return expired

    # Coming and going ----------------------------------------------------------------------------

    def _let_in(self, candidate: Candidate, now_s: float) -> None:
        """Let an item in, or one out for it."""
        if (limits := self._limits) is not None:
            victim = limits.rival(candidate)
            if victim is not candidate:
                self._enter(candidate)
            if victim is not None:
                self._put_out(victim, limits, now_s)
            return
        self._enter(candidate)

    def _put_out(self, victim: Candidate, limits: QueueLimits, now_s: float) -> None:
        """Let an item make room: it waits outside if it is to be acknowledged, else it is said no more."""
        if victim.line is not None:
            self._let_go(victim)
        if victim.terms.acknowledged:
            limits.put_outside(victim)
        else:
            self._end(victim)
        self._tell(victim, Expired.OVERFLOW, now_s, comes_back=victim.terms.acknowledged)

    def _enter(self, candidate: Candidate) -> None:
        """Put an item among those that wait."""
        self._items[candidate.column] = candidate
        if (limits := self._limits) is not None:
            limits.add(candidate)
            limits.set_deadline(candidate)
        candidate.waiting.resume(self._n_slots)
        self._lines.place(candidate, self._n_slots)

    def _withdraw(self, column: int) -> None:
        """Take an item from among those that wait, inside or outside of the queue."""
        if (candidate := self._items.get(column)) is not None:
            self._let_go(candidate)
            return
        if (limits := self._limits) is not None:
            limits.forget_outside(column)

    def _let_go(self, candidate: Candidate) -> None:
        """Take an item out of the queue."""
        self._forget(candidate)
        self._leave(candidate)

    def _forget(self, candidate: Candidate) -> None:
        """An item is none of those that wait inside."""
        del self._items[candidate.column]
        if (limits := self._limits) is not None:
            limits.remove(candidate)

    def _leave(self, candidate: Candidate) -> None:
        if candidate.rests:
            candidate.rests, self.resting = False, self.resting ^ 1 << candidate.column
            candidate.waiting.resume(self._n_slots)
        else:
            candidate.waiting.halt(self._n_slots)
        if candidate.line is not None:
            self._lines.remove(candidate)

    def _end(self, candidate: Candidate) -> None:
        """An item is said no more for good."""
        self.open &= ~(1 << candidate.column)
        if (limits := self._limits) is not None:
            limits.end(candidate)

    # Reasons -------------------------------------------------------------------------------------

    def _expire(self, candidate: Candidate, now_s: float) -> None:
        """Let go of what is older than its time to live."""
        if candidate.column == STATUS_COLUMN:
            self._leave(candidate)
            candidate.waiting.credit = 0
        else:
            self._let_go(candidate)
            self._end(candidate)
        self._tell(candidate, Expired.TIME_TO_LIVE, now_s)

    def _tell(self, candidate: Candidate, reason: Expired, now_s: float, comes_back: bool = False) -> None:
        latency_s = now_s - candidate.fragment.time_s
        self.expired.append(Expiry(candidate.uid, reason, latency_s, comes_back))
