"""What waits to be said: the open items of a vehicle, and the newest value of each status, in one weighted queue.

`exchange.choice` fills a packet from it; how much waits makes no difference to what a slot costs.

A queue is bounded. What does not go in, or has to make room, is told by an `Expiry`. If it is to be acknowledged, it
waits outside of the queue, and comes in once there is room: nothing that is to be acknowledged is lost.
"""

from __future__ import annotations

from collections import Counter

from exchange.bounds import Bounds, Deadlines, Ended
from exchange.choice import Lines, Room
from exchange.lines import STATUS_COLUMN, Candidate
from exchange.packets import Fragment, ItemUid
from exchange.reasons import Expired, Expiry, Unsaid
from exchange.values import ADDITIVE, Moment, ValueRule, Waiting
from worldmodel import PLAIN, Terms


class Queue:
    """The candidates of one vehicle for its next packet.

    Args:
        rule: says what is worth most.
        limit: most items that wait in it.

    Attributes:
        open: item set of those that wait, outside of the queue too.
        unsaid: how many candidates were not said in the last own slot, by the reason.
    """

    def __init__(self, rule: ValueRule = ADDITIVE, limit: int | None = None) -> None:
        self._lines = Lines(rule)
        self._items = Bounds(limit)
        self._status: dict[tuple[int, int], Candidate] = {}  # by subject and attribute
        self._n_status = 0
        self._deadlines = Deadlines()
        self._n_slots = 0
        self._expired: list[Expiry] = []
        self._ended = Ended()
        self.open = 0
        self.unsaid: Counter[Unsaid] = Counter()

    def __len__(self) -> int:
        """How many items wait in it."""
        return len(self._items)

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
        if self._ended.bars(column, waiting, terms, now_s, is_new_need):
            return
        candidate = Candidate(fragment, column, waiting, terms, (0, *fragment.uid), size_bits)
        waiting.time_to_live_s = terms.time_to_live_s
        waiting.resume(self._n_slots)
        self.open |= 1 << column
        self._let_in(candidate, now_s)

    def take_status(self, fragment: Fragment, priority: int, size_bits: int, terms: Terms = PLAIN) -> None:
        """Let the newest value of a status wait in place of the older one, with the weight that this has gained."""
        about = fragment.facts[0].subject, fragment.facts[0].attribute
        candidate = self._status.get(about)
        if candidate is None:
            tie, self._n_status = (1, self._n_status), self._n_status + 1
            candidate = Candidate(fragment, STATUS_COLUMN, Waiting(priority), terms, tie, size_bits)
            candidate.waiting.resume(self._n_slots)
            candidate.waiting.since_s = fragment.time_s
            self._status[about] = candidate
        elif candidate.line is not None:
            self._leave(candidate)
            self._tell(candidate, Expired.SUPERSEDED, fragment.time_s)
        candidate.fragment, candidate.size_bits, candidate.terms = fragment, size_bits, terms
        (waiting := candidate.waiting).resume(self._n_slots)
        waiting.priority, waiting.observed_s, waiting.n_said = priority, fragment.time_s, 0
        waiting.time_to_live_s = terms.time_to_live_s
        self._place(candidate)

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
        candidate = self._items.get(column) or self._items.outside(column)
        if candidate is None or (priority, terms) == (candidate.waiting.priority, candidate.terms):
            return
        self._withdraw(column)
        candidate.waiting.priority, candidate.terms = priority, terms
        candidate.waiting.time_to_live_s = terms.time_to_live_s
        self._let_in(candidate, now_s)

    # What goes out -------------------------------------------------------------------------------

    def choose(self, room: Room, now_s: float, above: float = 0) -> list[Candidate]:
        """Fill a packet; returns what goes, the most valuable first.

        Args:
            room: the packet.
            now_s: when the own slot opens.
            above: only what has a higher priority goes.
        """
        self._update(now_s)
        self._n_slots += 1
        moment = Moment(now_s, self._n_slots)
        chosen, unsaid = self._lines.choose(room, moment, above)
        self._note_unsaid(unsaid, not chosen)
        for candidate in chosen:
            self._note_said(candidate, moment)
        return chosen

    def stays_silent(self, now_s: float, above: float) -> bool:
        """True if nothing waits that may go now: of a higher priority than ``above``, and not in a blackout."""
        self._update(now_s)
        barred = self._lines.barred(Moment(now_s, self._n_slots), above)
        is_silent = barred.total() == self._lines.n_waiting
        self._note_unsaid(barred, True)
        return is_silent

    def _note_unsaid(self, reasons: Counter[Unsaid], is_empty: bool) -> None:
        """Keep why what waits was not said; ``is_empty`` if nothing was."""
        self.unsaid = reasons
        if n_outside := self._items.n_outside:
            reasons[Unsaid.OVERFLOW] = n_outside
        elif is_empty and not reasons:
            reasons[Unsaid.NOTHING_OPEN] = 1

    def _update(self, now_s: float) -> None:
        """Let in what waits outside and has room now, and let go of what is too old."""
        for candidate in self._items.from_outside():
            self._enter(candidate)
        self._expire_old(now_s)

    def take_expired(self) -> tuple[Expiry, ...]:
        """What has come to be said no more since this was asked last."""
        expired, self._expired = tuple(self._expired), []
        return expired

    def why_unsaid(self, uid: ItemUid, now_s: float, above: float = 0) -> Unsaid | None:
        """Why an item that waits was not said in the last own slot; None if it was said, or does not wait.

        It looks through all that waits: for questions, not for every slot.

        Args:
            uid: of the item.
            now_s: when that slot opened.
            above: what ``choose`` was given.
        """
        if self._items.is_outside(uid):
            return Unsaid.OVERFLOW
        candidate = self._items.named(uid)
        if candidate is None or candidate.line is None or candidate.waiting.since_slot == self._n_slots > 0:
            return None
        plain = Unsaid.WAITING if candidate.is_repeated else Unsaid.LOWER_VALUE
        return self._lines.bar(candidate.line, now_s, above) or plain

    # Coming and going ----------------------------------------------------------------------------

    def _let_in(self, candidate: Candidate, now_s: float) -> None:
        """Let an item in, or one out for it."""
        victim = self._items.rival(candidate)
        if victim is not candidate:
            self._enter(candidate)
        if victim is None:
            return
        if victim.line is not None:
            self._let_go(victim)
        if victim.terms.acknowledged:
            self._items.put_outside(victim)
        else:
            self._end(victim)
        self._tell(victim, Expired.OVERFLOW, now_s, comes_back=victim.terms.acknowledged)

    def _enter(self, candidate: Candidate) -> None:
        """Put an item among those that wait."""
        self._items.add(candidate)
        candidate.waiting.resume(self._n_slots)
        self._place(candidate)

    def _place(self, candidate: Candidate) -> None:
        """Put a candidate that comes in into its line, and note until when it may wait."""
        self._lines.place(candidate, self._n_slots)
        self._deadlines.add(candidate)

    def _withdraw(self, column: int) -> None:
        """Take an item from among those that wait, inside or outside of the queue."""
        if (candidate := self._items.get(column)) is not None:
            self._let_go(candidate)
        else:
            self._items.forget_outside(column)

    def _let_go(self, candidate: Candidate) -> None:
        """Take an item out of the queue."""
        self._items.remove(candidate)
        self._leave(candidate)

    def _leave(self, candidate: Candidate) -> None:
        candidate.waiting.halt(self._n_slots)
        if candidate.line is not None:
            candidate.line.remove(candidate)

    def _end(self, candidate: Candidate) -> None:
        """An item is said no more for good."""
        self.open &= ~(1 << candidate.column)
        self._ended.add(candidate)

    def _note_said(self, candidate: Candidate, moment: Moment) -> None:
        """It has been said: it waits again from 0, if it is to be acknowledged."""
        line, is_status = candidate.line, candidate.column == STATUS_COLUMN
        assert line is not None
        if is_status:
            line.remove(candidate)
            candidate.waiting.note_said(moment)
        elif candidate.terms.acknowledged:
            line.remove(candidate)
            candidate.waiting.note_said(moment)
            self._lines.place(candidate, self._n_slots)
        else:
            self._let_go(candidate)
            candidate.waiting.note_said(moment)
            self._end(candidate)
            self._tell(candidate, Expired.SAID_ONCE, moment.now_s)

    # Reasons -------------------------------------------------------------------------------------

    def _expire_old(self, now_s: float) -> None:
        """Let go of what is older than its time to live."""
        for candidate in self._deadlines.before(now_s):
            if candidate.column == STATUS_COLUMN:
                self._leave(candidate)
                candidate.waiting.credit = 0
            else:
                self._let_go(candidate)
                self._end(candidate)
            self._tell(candidate, Expired.TIME_TO_LIVE, now_s)

    def _tell(self, candidate: Candidate, reason: Expired, now_s: float, comes_back: bool = False) -> None:
        latency_s = now_s - candidate.fragment.time_s
        self._expired.append(Expiry(candidate.uid, reason, latency_s, comes_back))
