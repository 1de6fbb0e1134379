"""Which of the candidates of a vehicle go into a packet.

What goes is what `exchange.selection.select` chooses: the most valuable that fits, again and again, and of equals the
lower item UID, items before statuses. That takes no look at all that waits. Candidates that keep their order while they
wait stand in one *line*, see `exchange.values`; a slot compares the heads of the lines, and takes from them until
nothing more fits. It costs as much as there are lines, and as it sends.

A candidate too large for the room left is passed over. A line holds candidates of about one size, so if more than
``LOOK_PAST`` of it do not fit, the rest is taken not to fit either. Where candidates of a line have one size exactly,
that is so; in a packed form they differ by some bits, and one that would have fitted may be missed.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable
from heapq import heappop, heappush
from typing import Protocol

from exchange.lines import Candidate, Entry, Line
from exchange.packets import Fragment
from exchange.reasons import Unsaid
from exchange.values import Moment, ValueRule, Waiting

LOOK_PAST = 3
"""Candidates of one line that may not fit before the rest of it is left."""

Head = tuple[float, tuple[int, ...], Candidate]
"""Value, highest first by its sign; what orders equals; candidate."""


class Room(Protocol):
    """A packet that is being filled."""

    def add(self, fragment: Fragment) -> bool:
        """Put a fragment in; False if it does not fit: then nothing has changed."""


class Lines:
    """The lines of one vehicle.

    Args:
        rule: says what is worth most.
    """

    def __init__(self, rule: ValueRule) -> None:
        self._rule = rule
        self._lines: dict[Hashable, Line] = {}
        self._said_s: dict[tuple[int, int], float] = {}  # by subject and attribute, where the terms have a blackout

    @property
    def n_waiting(self) -> int:
        """How many candidates stand in them."""
        return sum(line.n_waiting for line in self._lines.values())

    def barred(self, moment: Moment, above: float) -> Counter[Unsaid]:
        """How many of those that wait may not go at that moment, by the reason.

        Args:
            moment: of the own slot.
            above: only what has a higher priority goes.
        """
        reasons = Counter[Unsaid]()
        for line in self._lines.values():
            if line.n_waiting and (reason := self.bar(line, moment.now_s, above)) is not None:
                reasons[reason] += line.n_waiting
        return reasons

    def bar(self, line: Line, now_s: float, above: float) -> Unsaid | None:
        """Why nothing of a line may go; None if it may."""
        if line.priority <= above:
            return Unsaid.COVERT
        is_blacked_out = line.blackout_s > 0.0 and now_s - self._said_s.get(line.about, -math.inf) < line.blackout_s
        return Unsaid.BLACKOUT if is_blacked_out else None

    def choose(self, room: Room, moment: Moment, above: float) -> tuple[list[Candidate], Counter[Unsaid]]:
        """Fill a packet; returns what goes, the most valuable first, and how many do not go, by the reason.

        Args:
            room: the packet.
            moment: of the own slot.
            above: only what has a higher priority goes.
        """
        unsaid = Counter[Unsaid]()
        heads, n_waiting, n_repeated = self._heads(moment, above, unsaid)
        passed: dict[Hashable, list[tuple[Line, Entry]]] = {}
        n_passed = n_too_large = 0
        chosen: list[Candidate] = []
        while heads:
            _, _, candidate = heappop(heads)
            line = candidate.line
            assert line is not None
            entry = line.pass_over()
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
            self._compare(heads, line, moment)
        for line, entry in (one for of_line in passed.values() for one in of_line):
            line.put_back(entry)
        for candidate in chosen:
            if candidate.terms.blackout_s:
                self._said_s[candidate.about] = moment.now_s
        n_unsaid = n_waiting - len(chosen) - n_too_large
        n_repeated = min(n_unsaid, n_repeated - sum(one.is_repeated for one in chosen))
        counts = (
            (Unsaid.TOO_LARGE, n_too_large),
            (Unsaid.WAITING, n_repeated),
            (Unsaid.LOWER_VALUE, n_unsaid - n_repeated),
        )
        unsaid.update({reason: n for reason, n in counts if n})
        return chosen, unsaid

    def _heads(self, moment: Moment, above: float, unsaid: Counter[Unsaid]) -> tuple[list[Head], int, int]:
        """Heads of the lines that may go, how many wait in these, and how many of them have been said before."""
        heads: list[Head] = []
        n_waiting = n_repeated = 0
        for line in list(self._lines.values()):
            if line.n_waiting == 0:
                if line.shared is None:
                    del self._lines[line.key]
            elif (reason := self.bar(line, moment.now_s, above)) is not None:
                unsaid[reason] += line.n_waiting
            else:
                n_waiting += line.n_waiting
                n_repeated += line.n_repeated
                self._compare(heads, line, moment)
        return heads, n_waiting, n_repeated

    def _compare(self, heads: list[Head], line: Line, moment: Moment) -> None:
        """Let the head of a line compete with the others."""
        head = line.head()
        if head is not None:
            value = self._rule.value(line.shared or head.waiting, moment)
            heappush(heads, (-value, head.tie, head))

    def place(self, candidate: Candidate, n_slots: int) -> None:
        """Put a candidate where it belongs.

        Args:
            candidate: stands in no line.
            n_slots: own slots so far.
        """
        waiting, terms, about = candidate.waiting, candidate.terms, candidate.about
        place = None if terms.newest_first else self._rule.place(waiting)
        which = about if terms.blackout_s else None
        key: Hashable
        if terms.newest_first:
            key, rank = (waiting.priority, which, terms.blackout_s, "newest", about[1]), waiting.observed_s
        elif place is None:
            key, rank = (waiting.priority, which, terms.blackout_s, "alone", candidate.tie), 0.0
        else:
            key, rank = (waiting.priority, which, terms.blackout_s, candidate.size_bits, place.group), place.rank
        line = self._lines.get(key)
        if line is None:
            line = self._lines[key] = Line(key, waiting.priority, about, terms.blackout_s)
            if terms.newest_first:
                line.shared = Waiting(waiting.priority, waiting.observed_s, waiting.since_s, n_slots)
                line.shared.time_to_live_s = terms.time_to_live_s
        line.add(candidate, rank)
