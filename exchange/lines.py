"""Candidates for packets, and the lines in which they wait; see `exchange.queue`."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

from exchange.packets import Fragment, ItemUid, StatusUid
from exchange.values import Waiting
from worldmodel import Terms

SLACK = 16
"""Stale entries of a line, beside as many as there are candidates in it, before it is rebuilt."""
STATUS_COLUMN = -1
"""A status has no column: nobody acknowledges it."""


@dataclass(slots=True, eq=False)
class Candidate:
    """One thing that waits: an item, by its column, or a status.

    Attributes:
        fragment: what is to be said.
        column: of the item, or ``STATUS_COLUMN``.
        waiting: what it is valued by.
        terms: of those who need it.
        tie: orders candidates of equal value.
        size_bits: about its size.
        version: another one whenever it is placed or leaves; entries of a line with an older one are stale.
        line: where it stands; None while it does not wait.
    """

    fragment: Fragment
    column: int
    waiting: Waiting
    terms: Terms
    tie: tuple[int, ...]
    size_bits: int
    version: int = 0
    line: Line | None = None

    def __lt__(self, other: Candidate) -> bool:
        """False: of two entries alike but for this one is stale, since an item that left and came again is one."""
        return False

    @property
    def uid(self) -> ItemUid | StatusUid:
        """Its name in tables."""
        return self.fragment.status_uid if self.column == STATUS_COLUMN else self.fragment.uid

    @property
    def about(self) -> tuple[int, int]:
        """Subject and attribute of its first fact."""
        return self.fragment.facts[0].subject, self.fragment.facts[0].attribute

    @property
    def deadline_s(self) -> float:
        """Until when it is of use (s)."""
        return self.waiting.observed_s + self.terms.time_to_live_s

    @property
    def is_repeated(self) -> bool:
        """True if it has been said before."""
        return self.waiting.n_said > 0


Entry = tuple[float, tuple[int, ...], int, Candidate]
"""Rank, lowest first; what orders equals; version; candidate."""


class Line:
    """Candidates that keep their order while they wait, the best first.

    Attributes:
        key: of the line in its queue.
        priority: of all of them.
        about: subject and attribute, of a line with a blackout.
        blackout_s: least time between two packets with values about it.
        shared: what a line is valued by that waits as one; None if each candidate waits for itself.
    """

    __slots__ = ("_entries", "about", "blackout_s", "key", "n_repeated", "n_waiting", "priority", "shared")

    def __init__(self, key: Hashable, priority: int, about: tuple[int, int], blackout_s: float) -> None:
        self.key = key
        self.priority = priority
        self.about = about
        self.blackout_s = blackout_s
        self.shared: Waiting | None = None
        self.n_waiting = 0
        self.n_repeated = 0
        self._entries: list[Entry] = []

    def add(self, candidate: Candidate, rank: float) -> None:
        """Let a candidate wait here, before those of lower rank."""
        candidate.version += 1
        candidate.line = self
        self.n_waiting += 1
        self.n_repeated += candidate.is_repeated
        heappush(self._entries, (-rank, candidate.tie, candidate.version, candidate))

    def remove(self, candidate: Candidate) -> None:
        """Take a candidate out, wherever it stands."""
        candidate.version += 1
        candidate.line = None
        self.n_waiting -= 1
        self.n_repeated -= candidate.is_repeated
        if len(self._entries) > 2 * self.n_waiting + SLACK:
            self._entries = [entry for entry in self._entries if entry[2] == entry[3].version]
            heapify(self._entries)

    def head(self) -> Candidate | None:
        """The best of those that are not passed over; None if there is none."""
        entries = self._entries
        while entries and entries[0][2] != entries[0][3].version:
            heappop(entries)
        return entries[0][3] if entries else None

    def pass_over(self) -> Entry:
        """Look at the next one instead of the head; what is returned is to be put back."""
        return heappop(self._entries)

    def put_back(self, entry: Entry) -> None:
        """Look at one again that was passed over."""
        heappush(self._entries, entry)
