"""Weighted transmission queue of one vehicle: open items and newest statuses.

Repeatedly the most valuable entry that fits goes into the packet; ties go to the lower item UID, items before statuses.
The policy study uses the same rule; a test compares both. Entries whose order is constant while they wait share one
queue class (*line*, see `exchange.policy.candidates`). A slot compares only the heads of the classes: its cost grows
with the number of classes and of entries sent.

Entries larger than the remaining capacity are skipped. After ``LOOK_PAST`` skipped entries of a class, the rest of it
is skipped too: exact for equal sizes, approximate for packed ones, which differ by some bits.

Limits apply if the queue is full or a need asks for them (`exchange.policy.candidates`). An `Expiry` reports each entry
that is refused or displaced. Under newest-first order a class is valued as a whole; a blackout blocks classes for a
time after each transmission about their property.
"""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Protocol

from exchange.packets import Fragment, StatusUid
from exchange.policy.acknowledgement import members
from exchange.policy.candidates import (
    ADDITIVE,
    STATUS_COLUMN,
    Candidate,
    Expired,
    Expiry,
    Moment,
    QueueLimits,
    Unsaid,
    ValueRule,
    Waiting,
)
from worldmodel import PLAIN, Terms

LOOK_PAST = 3
"""Entries of one line that may be skipped before the rest of it is skipped."""
RESTING = "resting"
"""Key of the line of suspended entries, which are not sent; its priority is 0."""

Entry = tuple[float, tuple[int, ...], Candidate]
"""Negated rank, tie-breaker, candidate."""


@dataclass(slots=True)
class Line:
    """Queue class: candidates whose order is constant while they wait.

    Attributes:
        shared: value state if the line is valued as a whole; None if each candidate has its own.
        blackout: subject and attribute that are not sent again for a duration (s); None without.
        n_repeated: waiting candidates that were sent before.
        entries: candidates, best first.
    """

    key: Hashable
    shared: Waiting | None
    blackout: tuple[tuple[int, int], float] | None
    n_repeated: int = 0
    entries: list[Entry] = field(default_factory=list)


class Room(Protocol):
    """Packet under construction."""

    def add(self, fragment: Fragment) -> bool:
        """Add a fragment; return False without a change if it does not fit."""


Head = tuple[float, tuple[int, ...], int, Line]
"""Negated value, tie-breaker, number of skipped entries before it in its line."""


class Queue:
    """Entries of one vehicle for its next packets.

    Items beyond ``limit`` (None for no limit) wait *outside*: packets carry only items *inside*.

    Attributes:
        open: item set of outstanding items, inside and outside.
        resting: item set of suspended items inside.
        unsaid: number of entries not sent in the last own slot, by reason.
        expired: entries discarded since ``take_expired``.
    """

    def __init__(self, rule: ValueRule = ADDITIVE, limit: int | None = None) -> None:
        self._rule = rule
        self._lines: dict[Hashable, Line] = {}
        self._blackout_s: dict[tuple[int, int], float] = {}  # start of the last blackout by subject and attribute
        self._items: dict[int, Candidate] = {}  # by column, in the order of taking
        self._limits = QueueLimits(math.inf if limit is None else limit, self._items)
        self._status: dict[tuple[int, int], Candidate] = {}  # by subject and attribute
        self._n_status = 0
        self._n_slots = 0
        self._sent: dict[int, Candidate] = {}  # by column: items of the last own slot that wait again, under limits
        self.expired: list[Expiry] = []
        self.open = 0
        self.resting = 0
        self.unsaid: dict[Unsaid, int] = {}

    def __len__(self) -> int:
        """Return the number of items inside."""
        return len(self._items)

    @property
    def statuses(self) -> list[Candidate]:
        """Queued statuses."""
        return [candidate for candidate in self._status.values() if candidate.line is not None]

    @property
    def items_weight(self) -> int:
        """Sum of priority times size (bits) over all items inside."""
        return sum([candidate.priority * candidate.size_bits for candidate in self._items.values()])

    # What comes in -------------------------------------------------------------------------------

    def take(self, candidate: Candidate, terms: Terms = PLAIN, now_s: float = 0.0, is_new_need: bool = False) -> None:
        """Queue an item, new or as it left the queue; on overflow displace another or leave it outside.

        A discarded item is queued again on a new need or stricter terms before its time to live ends.
        """
        if not self._limits.bars(candidate, terms, now_s, is_new_need):
            candidate.terms = terms
            self.open |= 1 << candidate.column
            self._let_in(candidate, now_s)

    def take_status(self, fragment: Fragment, priority: int, size_bits: int, terms: Terms = PLAIN) -> None:
        """Replace the queued value of a status by the newest; its accumulated weight remains."""
        about = fragment.facts[0].subject, fragment.facts[0].attribute
        uid = StatusUid(fragment.origin, fragment.time_s, *about)
        candidate = self._status.get(about)
        if candidate is None:
            tie, self._n_status = (1, self._n_status), self._n_status + 1
            candidate = self._status[about] = Candidate(
                priority, 0.0, fragment.time_s,
                uid=uid, fragment=fragment, column=STATUS_COLUMN, tie=tie, size_bits=size_bits,
            )  # fmt: skip
        elif candidate.line is not None:
            self._leave(candidate)
            self._tell(candidate, Expired.SUPERSEDED, fragment.time_s)
        candidate.uid, candidate.fragment, candidate.size_bits, candidate.terms = uid, fragment, size_bits, terms
        candidate.priority, candidate.observed_s, candidate.n_sent = priority, fragment.time_s, 0
        candidate.since_slot = self._n_slots
        self._limits.set_deadline(candidate)
        self._place(candidate)

    def drop_status(self, about: tuple[int, int], now_s: float) -> None:
        """Remove a status (subject and attribute) that no vehicle needs any more."""
        candidate = self._status.pop(about, None)
        if candidate is not None and candidate.line is not None:
            self._leave(candidate)
            self._tell(candidate, Expired.NOT_NEEDED, now_s)

    def drop(self, column: int) -> None:
        """Remove an item; a caller that queues it again passes the same candidate to ``take``."""
        if self.open >> column & 1:
            self.open ^= 1 << column
            self._withdraw(column)
            self._sent.pop(column, None)

    def revalue(self, column: int, priority: int, terms: Terms, now_s: float) -> None:
        """Change priority or terms of an item inside or outside."""
        candidate = self._items.get(column) or self._limits.find_outside(column)
        if candidate is None or (priority, terms) == (candidate.priority, candidate.terms):
            return
        self._withdraw(column)
        candidate.priority, candidate.terms = priority, terms
        self._let_in(candidate, now_s)

    def rest(self, items: int) -> None:
        """Suspend these items and resume all others; suspended items stay open and gain no value."""
        for column in members((items ^ self.resting) & self.open):
            candidate = self._items.get(column)
            if candidate is not None:  # else it waits outside
                self._leave(candidate)
                self.resting |= items & 1 << column
                self._place(candidate)

    # What goes out -------------------------------------------------------------------------------

    def choose(self, room: Room, now_s: float, left_out: int = 0) -> list[Candidate]:
        """Fill the packet of an own slot at ``now_s``; return its entries, most valuable first.

        Items ``left_out`` (set) by the plan of the packet are not sent, and gain no value in this slot.
        """
        if self._limits.outside or self._limits.deadlines:
            self._update(now_s)
        unplanned = self._set_aside(left_out) if left_out else []
        # Weights grow before the choice, as in the cooperation paper (section IV, steps 5 to 7).
        self._n_slots += 1
        moment, unsaid = Moment(now_s, self._n_slots), dict[Unsaid, int]()
        heads, chosen = list[Head](), list[Candidate]()
        n_passed = n_too_large = n_repeated = 0
        n_waiting = len(unplanned)
        for candidate in unplanned:
            n_repeated += candidate.n_sent > 0
        for line in self._sendable(now_s, unsaid):
            n_waiting, n_repeated = n_waiting + len(line.entries), n_repeated + line.n_repeated
            heappush(heads, self._head(line, 0, moment))
        while heads:
            _, _, n_before, line = heappop(heads)
            candidate = line.entries[n_before][2]
            if room.add(candidate.fragment):
                chosen.append(candidate)
                n_repeated -= candidate.n_sent > 0
                # Only entries skipped before a chosen one were too large; the others may be of lower value.
                n_too_large = n_passed
                self._remove(candidate)
                if line.shared is not None:
                    line.shared.note_sent(moment)
            else:
                n_passed, n_before = n_passed + 1, n_before + 1
            if n_before <= LOOK_PAST and n_before < len(line.entries):
                heappush(heads, self._head(line, n_before, moment))
        n_unsaid = n_waiting - len(chosen) - n_too_large
        n_repeated = min(n_unsaid, n_repeated)
        for reason, n in (
            (Unsaid.TOO_LARGE, n_too_large),
            (Unsaid.WAITING, n_repeated),
            (Unsaid.LOWER_VALUE, n_unsaid - n_repeated),
            (Unsaid.OVERFLOW, self.open.bit_count() - len(self._items)),
        ):
            if n:
                unsaid[reason] = n
        if not chosen and not unsaid:
            unsaid[Unsaid.NOTHING_OPEN] = 1
        self.unsaid = unsaid
        self._note_sent(chosen, moment)
        for candidate in unplanned:
            candidate.since_slot = self._n_slots
            self._place(candidate)
        return chosen

    def _set_aside(self, items: int) -> list[Candidate]:
        """Take items (set) inside out of their lines; return them."""
        candidates = [self._items[column] for column in members(items) if column in self._items]
        for candidate in candidates:
            self._leave(candidate)
        return candidates

    def _note_sent(self, chosen: Iterable[Candidate], moment: Moment) -> None:
        """Record the entries of a packet; queue those again that need an acknowledgement, with value 0."""
        self._sent.clear()
        for candidate in chosen:
            candidate.note_sent(moment)
            if candidate.terms.blackout_s:
                self._blackout_s[candidate.about] = moment.now_s
            if candidate.column == STATUS_COLUMN:
                continue
            if candidate.terms.acknowledged:
                self._place(candidate)
                self._sent[candidate.column] = candidate
            else:
                self._let_go(candidate)
                self._end(candidate)
                self._tell(candidate, Expired.SENT_ONCE, moment.now_s)

    def _sendable(self, now_s: float, unsaid: dict[Unsaid, int]) -> list[Line]:
        """Return the lines of which candidates may be sent; count the others in ``unsaid``."""
        lines: list[Line] = []
        for line in list(self._lines.values()):
            if not line.entries:
                if line.shared is None:
                    del self._lines[line.key]
            elif line.key == RESTING:
                unsaid[Unsaid.RELAYED] = len(line.entries)
            elif line.blackout and now_s - self._blackout_s.get(line.blackout[0], -math.inf) < line.blackout[1]:
                unsaid[Unsaid.BLACKOUT] = unsaid.get(Unsaid.BLACKOUT, 0) + len(line.entries)
            else:
                lines.append(line)
        return lines

    def _head(self, line: Line, n_before: int, moment: Moment) -> Head:
        """Return the best candidate of a line behind ``n_before`` skipped ones."""
        _, tie, candidate = line.entries[n_before]
        return -self._rule.value(line.shared or candidate, moment), tie, n_before, line

    def _update(self, now_s: float) -> None:
        """Move items inside, into free capacity or in place of sent ones; discard overdue entries."""
        limits = self._limits
        for candidate in limits.from_outside():
            self._enter(candidate)
        for sent in self._sent.values():
            if sent.line is not None and (follower := limits.follower(sent)) is not None:
                self._let_go(sent)
                limits.forget_outside(follower.column)
                self._enter(follower)
                limits.put_outside(sent)
        for candidate in limits.overdue(now_s):
            self._expire(candidate, now_s)

    def take_expired(self) -> tuple[Expiry, ...]:
        """Return and clear the entries discarded since the last call."""
        expired, self.expired = tuple(self.expired), []
        return expired

    # Coming and going ----------------------------------------------------------------------------

    def _let_in(self, candidate: Candidate, now_s: float) -> None:
        victim = self._limits.rival(candidate)
        if victim is not candidate:
            self._enter(candidate)
        if victim is not None:
            self._put_out(victim, now_s)

    def _put_out(self, victim: Candidate, now_s: float) -> None:
        """Displace an item: outside if it needs an acknowledgement, else discarded."""
        if victim.line is not None:
            self._let_go(victim)
        if victim.terms.acknowledged:
            self._limits.put_outside(victim)
        else:
            self._end(victim)
        self._tell(victim, Expired.OVERFLOW, now_s, comes_back=victim.terms.acknowledged)

    def _enter(self, candidate: Candidate) -> None:
        self._items[candidate.column] = candidate
        self._limits.set_deadline(candidate)
        candidate.since_slot = self._n_slots
        self._place(candidate)

    def _withdraw(self, column: int) -> None:
        if (candidate := self._items.get(column)) is not None:
            self._let_go(candidate)
        else:
            self._limits.forget_outside(column)

    def _let_go(self, candidate: Candidate) -> None:
        del self._items[candidate.column]
        self._leave(candidate)

    def _leave(self, candidate: Candidate) -> None:
        if candidate.line == RESTING:
            self.resting ^= 1 << candidate.column
            candidate.since_slot = self._n_slots
        else:
            candidate.halt(self._n_slots)
        if candidate.line is not None:
            self._remove(candidate)

    def _end(self, candidate: Candidate) -> None:
        self.open &= ~(1 << candidate.column)
        self._limits.end(candidate)

    def _place(self, candidate: Candidate) -> None:
        """Put a candidate into its line."""
        priority, terms = candidate.priority, candidate.terms
        place, shared, blackout = self._rule.place(candidate), None, None
        key: Hashable
        if place is None:
            key, rank = (priority, "alone", candidate.tie), 0.0
        else:
            # With equal sizes in a line, skipping its rest behind entries that do not fit loses nothing.
            key, rank = (priority, candidate.size_bits, place.group), place.rank
        if terms.newest_first:
            key, rank = (priority, "newest", candidate.about[1]), candidate.observed_s
            shared = Waiting(priority, candidate.observed_s, candidate.since_s, self._n_slots, terms=terms)
        if terms.blackout_s:
            blackout = candidate.about, terms.blackout_s
            key = blackout, key
        if candidate.column != STATUS_COLUMN and self.resting >> candidate.column & 1:
            key, shared, blackout = RESTING, None, None
        line = self._lines.get(key)
        if line is None:
            line = self._lines[key] = Line(key, shared, blackout)
        candidate.line, candidate.rank = key, rank
        line.n_repeated += candidate.n_sent > 0
        insort(line.entries, (-rank, candidate.tie, candidate))

    def _remove(self, candidate: Candidate) -> None:
        """Remove a candidate from its line."""
        line = self._lines[candidate.line]
        candidate.line = None
        line.n_repeated -= candidate.n_sent > 0
        del line.entries[bisect_left(line.entries, (-candidate.rank, candidate.tie))]

    # Reasons -------------------------------------------------------------------------------------

    def _expire(self, candidate: Candidate, now_s: float) -> None:
        if candidate.column == STATUS_COLUMN:
            self._leave(candidate)
            candidate.credit = 0
        else:
            self._let_go(candidate)
            self._end(candidate)
        self._tell(candidate, Expired.TIME_TO_LIVE, now_s)

    def _tell(self, candidate: Candidate, reason: Expired, now_s: float, comes_back: bool = False) -> None:
        latency_s = now_s - candidate.fragment.time_s
        self.expired.append(Expiry(candidate.uid, reason, latency_s, comes_back))
