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

from collections.abc import Callable
from typing import NamedTuple

from exchange.packets import MASK_BITS, ItemUid, Summary
from exchange.peering.beliefs import Beliefs, Holdings, Life
from worldmodel.facts import MOST_ITEMS

TIMES_TOLD = 2
"""How often a summary is told, if nothing changes, since packets get lost."""
FULL_MASK = (1 << MASK_BITS) - 1


def summary_of(life: Life, held: int) -> Summary:
    """What is held of an origin in an epoch.

    >>> summary_of((2, 0), 0b1011)
    Summary(origin=2, epoch=0, highest=1, mask=1)

    Args:
        life: the origin and its epoch.
        held: its blocks that are held, one bit for each sequence.
    """
    n_first = (~held & held + 1).bit_length() - 1
    return Summary(*life, n_first - 1, held >> n_first + 1 & FULL_MASK)


class _Told(NamedTuple):
    """What was told of a life the last time: the summary, how often it was told, and what was held then."""

    summary: Summary
    times: int
    held: int


_NEVER = _Told(Summary(-1, 0, -1, 0), 0, 0)
"""Stands for what was never told."""


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
        self._told: dict[Life, _Told] = {}  # the longest ago first
        self.silenced: set[Life] = set()
        """Lives that two vehicles share; no summary is told of them, but alarms."""
        self._alarms: dict[Life, None] = {}

    def silence(self, life: Life, by_alarm: bool) -> None:
        """Two vehicles share a life: tell no summary of it, but an alarm, unless another one has told ``by_alarm``."""
        self.silenced.add(life)
        if not by_alarm:
            self._alarms[life] = None

    def urge(self, *lives: Life) -> None:
        """Tell what is held of these, or of all if none is named, as soon as there is room."""
        self._due |= dict.fromkeys(lives or sorted(self._holdings.held))

    def urgent(self, room_bits: int) -> tuple[Summary, ...]:
        """The summaries that are due and fit, one at least; the others are due in the next packet."""
        told: list[Summary] = []
        for life in (*self._alarms, *self._due):
            is_alarm = life in self._alarms
            if life in self.silenced and not is_alarm:
                self._due.pop(life, None)
                continue
            summary = Summary(*life, MOST_ITEMS, 0) if is_alarm else summary_of(life, self._holdings.held.get(life, 0))
            room_bits -= self._size_bits(summary)
            if room_bits < 0 and told:
                break
            self._alarms.pop(life, None)
            self._take(life, summary)
            told.append(summary)
        return tuple(told)

    def spare(self, room_bits: int) -> tuple[Summary, ...]:
        """One summary that says more than when it was told last, or was not told often enough, if it fits.

        What says that a block was given up is told until that comes again: whoever is to say it may have missed it.
        """
        holdings, told = self._holdings, self._told
        for life in (*[life for life in sorted(holdings.held) if life not in told], *told):
            held, given_up, before = holdings.held.get(life, 0), holdings.given_up.get(life), told.get(life, _NEVER)
            is_told = before.times == TIMES_TOLD
            if life in self.silenced or (is_told and before.held == held and not given_up):
                continue
            summary = summary_of(life, held)
            is_asked_for = given_up and any(summary.holds(sequence) is False for sequence in given_up)
            is_known = is_told and before.summary == summary and not is_asked_for
            if not is_known and self._size_bits(summary) <= room_bits:
                self._take(life, summary)
                return (summary,)
        return ()

    def _take(self, life: Life, summary: Summary) -> None:
        self._due.pop(life, None)
        before = self._told.pop(life, _NEVER)
        times = min(before.times + 1, TIMES_TOLD) if before.summary == summary else 1
        self._told[life] = _Told(summary, times, self._holdings.held.get(life, 0))


class Summaries:
    """The summaries that one vehicle tells and hears; a vehicle without them does not have it.

    Args:
        beliefs: of this node.
        size_bits: of a summary on the wire.
    """

    def __init__(self, beliefs: Beliefs, size_bits: Callable[[Summary], int]) -> None:
        self._beliefs = beliefs
        self.telling = Telling(beliefs.own, size_bits)
        """Which of them it tells."""
        self._noted: dict[int, dict[Life, Summary]] = {}  # by peer
        self._lives: dict[Life, Life] = {}

    def holders(self, uid: ItemUid) -> int:
        """Peers, one bit each, that told that they hold an item, which is new here: they need not be told."""
        nodes, life = 0, (uid.origin, uid.epoch)
        for peer, noted in self._noted.items():
            summary = noted.get(life)
            if summary is not None and summary.holds(uid.sequence):
                nodes |= 1 << peer
        return nodes

    def forget(self, *peers: int) -> None:
        """What these have told, or all if none is named, counts no longer."""
        for peer in peers or tuple(self._noted):
            self._noted.pop(peer, None)

    def note(self, sender: int, summary: Summary) -> list[int]:
        """Believe what a peer says it holds, and no more; return the columns that it turns out to lack.

        Args:
            sender: of the summary.
            summary: one of its own.
        """
        noted, life, highest = self._noted.setdefault(sender, {}), summary[:2], summary.highest
        known = noted.get(life)
        if known is None:  # the same key for all peers
            life = self._lives.setdefault(life, life)
        noted[life] = summary
        first = known.highest + 1 if known is not None and known.highest <= highest else 0
        lacked: list[int] = []
        beliefs = self._beliefs
        end = min(highest + 2 + MASK_BITS, beliefs.ends.get(life, 0))  # beyond it says nothing
        held = summary.held_from(first) if first < end else 0
        for sequence, columns in beliefs.known(life, first, end) if first < end else ():
            if held >> sequence - first & 1:
                for column in columns:
                    if not beliefs.holders[column] >> sender & 1:
                        beliefs.believe(column, 1 << sender)
            elif beliefs.is_held(columns, sender) and beliefs.is_whole((*life, sequence)):
                for column in columns:
                    beliefs.deny(column, sender)
                lacked += columns
        return lacked
