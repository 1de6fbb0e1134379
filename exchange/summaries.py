"""Summary vectors: what a vehicle holds of one origin, in a number and a short mask.

The items of an origin and epoch are numbered without gaps. So what is held of them is the highest number up to which
nothing lacks, and a mask of the few behind the first gap. Only whole blocks count: of one in parts, half is nothing. A
vehicle that hears a summary believes of its sender just what it says: it holds what is named, and lacks the rest as far
as the mask reaches. What lies farther on is left as it was believed.

A summary that names more items than any origin can have is an alarm: two speak under that name, and what both numbered
alike cannot be summed up.

A summary goes where it pays: all of them, one after the other, once this vehicle has begun anew or has heard a peer
that was away or has begun anew; and of one origin at a time what has changed since it was told, where a packet has room
left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from worldmodel.facts import MOST_ITEMS

MASK_BITS = 8
"""Sequences that the mask tells of."""
TIMES_TOLD = 2
"""How often a summary is told, if nothing changes, since packets get lost."""
FULL_MASK = (1 << MASK_BITS) - 1

Life = tuple[int, int]
"""An origin and its epoch."""


class Summary(NamedTuple):
    """What is held of one origin in one epoch.

    Attributes:
        origin: whose items; epoch: of which of its lives.
        highest: every item up to this number is held; -1 if not even the first.
        mask: bit k is set if the item ``highest + 2 + k`` is held; the one behind ``highest`` is not.

    >>> one = Summary(0, 0, highest=4, mask=0b101)
    >>> [one.holds(sequence) for sequence in (4, 5, 6, 7, 8, 13, 14)]
    [True, False, True, False, True, False, None]
    """

    origin: int
    epoch: int
    highest: int
    mask: int

    @property
    def life(self) -> Life:
        """The origin and its epoch."""
        return self.origin, self.epoch

    @property
    def end(self) -> int:
        """The first sequence that it says nothing about."""
        return self.highest + 2 + MASK_BITS

    @property
    def is_alarm(self) -> bool:
        """True if it says that two vehicles speak under the name of the origin."""
        return self.highest >= MOST_ITEMS

    def beyond(self, sequence: int) -> bool:
        """True if it names an item of this number or a higher one."""
        return self.highest >= sequence or bool(self.mask >> max(0, sequence - self.highest - 2))

    def holds(self, sequence: int) -> bool | None:
        """True if the item is held, False if it is not; None if the summary does not say."""
        if sequence <= self.highest:
            return True
        if sequence >= self.end:
            return None
        return sequence > self.highest + 1 and bool(self.mask >> (sequence - self.highest - 2) & 1)


class Holdings:
    """Whole blocks that one vehicle holds, by origin and epoch: one bit for each sequence."""

    def __init__(self) -> None:
        self._held: dict[Life, int] = {}
        self.given_up: dict[Life, set[int]] = {}
        """Blocks that were held and are no longer, until they come again."""

    def add(self, life: Life, sequence: int) -> None:
        """Hold a block from now on."""
        self._held[life] = self._held.get(life, 0) | 1 << sequence
        self.given_up.get(life, set()).discard(sequence)

    def give_up(self, life: Life, sequence: int) -> None:
        """Hold a block no longer, so that it may come again."""
        self._held[life] = self._held.get(life, 0) & ~(1 << sequence)
        self.given_up.setdefault(life, set()).add(sequence)

    def has(self, life: Life, sequence: int) -> bool:
        """True if the block is held."""
        return bool(self._held.get(life, 0) >> sequence & 1)

    @property
    def lives(self) -> tuple[Life, ...]:
        """Origins and epochs of which anything is held, in order."""
        return tuple(sorted(self._held))

    def summary(self, life: Life) -> Summary:
        """What is held of an origin in an epoch.

        >>> held = Holdings()
        >>> for sequence in (0, 1, 3): held.add((2, 0), sequence)
        >>> held.summary((2, 0))
        Summary(origin=2, epoch=0, highest=1, mask=1)
        """
        held = self._held.get(life, 0)
        n_first = (~held & held + 1).bit_length() - 1
        return Summary(*life, n_first - 1, held >> n_first + 1 & FULL_MASK)


class Telling:
    """Which summaries one vehicle tells, and when.

    Args:
        holdings: of the vehicle.
        size_bits: of a summary on the wire.
    """

    def __init__(self, holdings: Holdings, size_bits: Callable[[Summary], int]) -> None:
        self._holdings = holdings
        self._size_bits = size_bits
        self._due: dict[Life, None] = {}
        self._told: dict[Life, tuple[Summary, int]] = {}  # and how often
        self.silenced: set[Life] = set()
        """Lives that two vehicles share; no summary is told of them, but alarms."""
        self._alarms: dict[Life, None] = {}

    def alarm(self, life: Life) -> None:
        """Say that two vehicles share a life."""
        self.silenced.add(life)
        self._alarms[life] = None

    def urge(self, *lives: Life) -> None:
        """Tell what is held of these, or of all if none is named, as soon as there is room."""
        self._due |= dict.fromkeys(lives or self._holdings.lives)

    def urgent(self, room_bits: int) -> tuple[Summary, ...]:
        """The summaries that are due and fit, one at least; the others are due in the next packet."""
        said: list[Summary] = []
        for life in (*self._alarms, *self._due):
            is_alarm = life in self._alarms
            if life in self.silenced and not is_alarm:
                self._due.pop(life, None)
                continue
            summary = Summary(*life, MOST_ITEMS, 0) if is_alarm else self._holdings.summary(life)
            room_bits -= self._size_bits(summary)
            if room_bits < 0 and said:
                break
            self._alarms.pop(life, None)
            self._take(summary, said)
        return tuple(said)

    def spare(self, room_bits: int) -> tuple[Summary, ...]:
        """One summary that says more than when it was told last, or was not told often enough, if it fits.

        What says that a block was given up is told until that comes again: whoever is to say it may have missed it.
        """
        said: list[Summary] = []
        for life in self._longest_ago():
            summary = self._holdings.summary(life)
            given_up = self._holdings.given_up.get(life, ())
            is_asked_for = any(summary.holds(sequence) is False for sequence in given_up)
            is_known = self._told.get(life) == (summary, TIMES_TOLD) and not is_asked_for
            if life not in self.silenced and not is_known and self._size_bits(summary) <= room_bits:
                self._take(summary, said)
                break
        return tuple(said)

    def _longest_ago(self) -> Iterator[Life]:
        """What is held of, in the order in which it was told: first what never was."""
        yield from (life for life in self._holdings.lives if life not in self._told)
        yield from tuple(self._told)

    def _take(self, summary: Summary, said: list[Summary]) -> None:
        self._due.pop(summary.life, None)
        before, times = self._told.pop(summary.life, (summary, 0))
        self._told[summary.life] = summary, min(times + 1, TIMES_TOLD) if before == summary else 1
        said.append(summary)
