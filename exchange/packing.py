"""The room of one packet for fragments, while it is filled.

What a fragment takes depends on the packet: its age on the slot, its sequence on the fragments of the same origin that
go with it. So nobody adds up sizes: fragments are offered to a packing, which takes those that fit.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from typing import TYPE_CHECKING

from exchange.packets import Fragment

if TYPE_CHECKING:
    from exchange.codec import Codec


class Packing:
    """The fragments of one packet, which is being filled.

    Args:
        codec: of the fleet.
        sender: node that speaks, in its ``epoch``.
        frame: in which it speaks.
        slot_start_s: start of its slot.
        room_bits: of the packet for fragments.

    Attributes:
        fragments: that have been taken, in that order.
        left_bits: what is left of the room.
    """

    def __init__(self, codec: Codec, sender: int, epoch: int, frame: int, slot_start_s: float, room_bits: int) -> None:
        self._codec = codec.fragments
        self._sender = sender
        self._epoch = epoch
        self.frame = frame
        self._base = codec.fragments.base_of(slot_start_s)
        self.left_bits = room_bits
        self.fragments: list[Fragment] = []
        self._sequences: dict[tuple[int, int], list[int]] = {}

    def size_bits(self, fragment: Fragment) -> int:
        """Bits by which the packet grows if it takes the fragment."""
        size_bits = self._codec.encode(fragment, self._sender, self._epoch, self._base)[1]
        if fragment.is_status:
            return size_bits
        taken, sequence = self._sequences.get((fragment.origin, fragment.epoch), ()), fragment.sequence
        at = bisect_left(taken, sequence)
        before = taken[at - 1] if at else None
        sequence_bits = self._codec.encode_sequence(sequence, before)[1]
        if at < len(taken):  # the one behind it follows another now
            behind = self._codec.encode_sequence
            sequence_bits += behind(taken[at], sequence)[1] - behind(taken[at], before)[1]
        return size_bits + sequence_bits

    def add(self, fragment: Fragment) -> bool:
        """Take a fragment; False if it does not fit, and nothing has changed."""
        size_bits = self.size_bits(fragment)
        if size_bits > self.left_bits:
            return False
        self.left_bits -= size_bits
        self.fragments.append(fragment)
        if not fragment.is_status:
            insort(self._sequences.setdefault((fragment.origin, fragment.epoch), []), fragment.sequence)
        return True

    def sizes(self) -> tuple[tuple[int, int], ...]:
        """(attribute of the first fact, size_bits) of each fragment taken; together they are what the room lost."""
        wired = self._codec.encode_all(self.fragments, self._sender, self._epoch, self._base)
        return tuple((fragment.facts[0].attribute, size_bits) for fragment, _, size_bits in wired)
