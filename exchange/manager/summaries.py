"""Summary vectors: the received set per origin as a number and a short mask.

Items of an origin and epoch are numbered without gaps. A summary has the highest number below the first gap, and a mask
of the few items behind it. Only whole blocks count. A receiver believes exactly the content: the sender holds the named
items and lacks the others within the mask; beliefs about later items stay.

A summary above the largest possible number is an alarm: two vehicles share that node id, and their items cannot be
summarised.

All summaries are sent, packet by packet, after this vehicle restarts, or receives a peer that restarted or was absent.
Otherwise spare capacity carries one summary with changes since its last transmission.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from exchange.manager.beliefs import Beliefs, Life
from exchange.packets import FULL_MASK, MASK_BITS, ItemUid, Summary
from worldmodel.facts import MOST_ITEMS

TIMES_TOLD = 2
"""Transmissions of an unchanged summary, against packet loss."""


def summary_of(life: Life, held: int) -> Summary:
    """Return the summary of an origin and epoch; ``held`` has a bit per sequence.

    >>> summary_of((2, 0), 0b1011)
    Summary(origin=2, epoch=0, highest=1, mask=1)
    """
    n_first = (~held & held + 1).bit_length() - 1
    return Summary(*life, n_first - 1, held >> n_first + 1 & FULL_MASK)


class _Told(NamedTuple):
    """Last transmission of a summary, with the received set at that time."""

    summary: Summary
    times: int
    held: int


_NEVER = _Told(Summary(-1, 0, -1, 0), 0, 0)


class Summaries:
    """Summaries of one vehicle: its own as they are due, and those of its peers."""

    def __init__(self, beliefs: Beliefs, size_bits: Callable[[Summary], int]) -> None:
        self._beliefs = beliefs
        self._size_bits = size_bits
        self._due: dict[Life, None] = {}
        self._told: dict[Life, _Told] = {}  # oldest first
        self._alarms: dict[Life, None] = {}
        self._noted: dict[int, dict[Life, Summary]] = {}  # by peer

    # Transmission --------------------------------------------------------------------------------

    def raise_alarm(self, life: Life) -> None:
        """Send an alarm of a duplicate node id, whose summaries are no longer sent."""
        self._alarms[life] = None

    def urge(self, *lives: Life) -> None:
        """Make the summaries of these incarnations (default: all) due."""
        self._due |= dict.fromkeys(lives or sorted(self._beliefs.blocks))

    def urgent(self, room_bits: int) -> tuple[Summary, ...]:
        """Return the due summaries that fit, at least one; the others stay due."""
        chosen: list[Summary] = []
        for life in (*self._alarms, *self._due):
            is_alarm = life in self._alarms
            if life in self._beliefs.shared and not is_alarm:
                self._due.pop(life, None)
                continue
            summary = Summary(*life, MOST_ITEMS, 0) if is_alarm else summary_of(life, self._beliefs.blocks.get(life, 0))
            room_bits -= self._size_bits(summary)
            if room_bits < 0 and chosen:
                break
            self._alarms.pop(life, None)
            self._take(life, summary)
            chosen.append(summary)
        return tuple(chosen)

    def spare(self, room_bits: int) -> tuple[Summary, ...]:
        """Return one summary that fits and was changed, or sent less than ``TIMES_TOLD`` times.

        A summary that reports a discarded block is repeated until the block arrives, in case its sender missed it.
        """
        beliefs, sent = self._beliefs, self._told
        for life in (*[life for life in sorted(beliefs.blocks) if life not in sent], *sent):
            held, given_up, before = beliefs.blocks.get(life, 0), beliefs.discarded.get(life), sent.get(life, _NEVER)
            is_told = before.times == TIMES_TOLD
            if life in beliefs.shared or (is_told and before.held == held and not given_up):
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
        self._told[life] = _Told(summary, times, self._beliefs.blocks.get(life, 0))

    # Reception -----------------------------------------------------------------------------------

    def holders(self, uid: ItemUid) -> int:
        """Return peers (bit mask) whose summaries cover an item that is new here."""
        life, noted = (uid.origin, uid.epoch), self._noted
        return sum([1 << peer for peer in noted if life in noted[peer] and noted[peer][life].holds(uid.sequence)])

    def forget(self, *peers: int) -> None:
        """Discard the summaries of these peers (default: all)."""
        for peer in peers or tuple(self._noted):
            self._noted.pop(peer, None)

    def note(self, sender: int, summary: Summary) -> int:
        """Apply a peer's summary to the beliefs; return the items (set) that it turns out to lack."""
        beliefs, noted, life = self._beliefs, self._noted.setdefault(sender, {}), (summary.origin, summary.epoch)
        known, noted[life] = noted.get(life), summary
        first = known.highest + 1 if known is not None and known.highest <= summary.highest else 0
        holds = lacks = 0
        end = min(summary.highest + 2 + MASK_BITS, beliefs.ends.get(life, 0))  # a summary covers nothing beyond
        for sequence in range(first, end):
            items = 0
            for column in beliefs.parts((*life, sequence)):
                items |= 1 << column
            if sequence <= summary.highest or (summary.mask and summary.holds(sequence)):
                holds |= items
            elif items and not items & ~beliefs.held[sender] and beliefs.is_whole((*life, sequence)):
                lacks |= items
        beliefs.held[sender] |= holds
        if lacks:
            beliefs.deny(lacks, sender)
        return lacks
