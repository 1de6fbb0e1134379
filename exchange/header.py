"""The acknowledgement bits of a packet on the wire: which there are is said by the policy's kind, frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

from exchange.ack import Acknowledgement


class AckHeader:
    """Layout of the header of every sender in every TDMA frame, until the layouts repeat.

    Args:
        kind: acknowledgement of the policy.
        n_nodes: size of the fleet.
    """

    def __init__(self, kind: Acknowledgement, n_nodes: int) -> None:
        self._n_nodes = n_nodes
        self._fields = [
            [self._carried(kind, frame, sender) for sender in range(n_nodes)] for frame in range(kind.period_frames)
        ]
        self._masks = [[self._mask(fields) for fields in of_frame] for of_frame in self._fields]
        self.largest_bits = max(len(fields) for of_frame in self._fields for fields in of_frame)
        """Size of the largest header, in bits."""

    def _carried(self, kind: Acknowledgement, frame: int, sender: int) -> list[tuple[int, int]]:
        """``(row, column)`` of every bit that ``sender`` sends in a frame, in order; nobody acknowledges itself."""
        pairs = product(range(self._n_nodes), repeat=2)
        return [(i, j) for i, j in pairs if i != j and kind.carries(self._n_nodes, frame, sender, i, j)]

    def _mask(self, fields: Sequence[tuple[int, int]]) -> list[int]:
        """The bits that a header carries as a word per row."""
        mask = [0] * self._n_nodes
        for i, j in fields:
            mask[i] |= 1 << j
        return mask

    @property
    def varies(self) -> bool:
        """True if headers differ in size."""
        return any(len(fields) != self.largest_bits for of_frame in self._fields for fields in of_frame)

    def size_bits(self, sender: int, frame: int) -> int:
        """Size of the header that ``sender`` sends in a TDMA frame."""
        return len(self._fields[frame % len(self._fields)][sender])

    def encode(self, sender: int, rows: Sequence[int], frame: int) -> int:
        """The bits of the rows that are carried, the first at the most significant end."""
        bits = 0
        for i, j in self._fields[frame % len(self._fields)][sender]:
            bits = bits << 1 | (rows[i] >> j & 1)
        return bits

    def decode(self, sender: int, frame: int, take: Callable[[int], int]) -> tuple[int, ...]:
        """Rows from the wire; ``take(size_bits)`` gives the next bits. What is not carried is zero."""
        rows = [0] * self._n_nodes
        fields = self._fields[frame % len(self._fields)][sender]
        bits = take(len(fields))
        for i, j in reversed(fields):
            rows[i] |= (bits & 1) << j
            bits >>= 1
        return tuple(rows)

    def n_set(self, sender: int, rows: Sequence[int], frame: int) -> int:
        """Acknowledgements that the header states with these rows."""
        masks = self._masks[frame % len(self._masks)][sender]
        return sum((row & mask).bit_count() for row, mask in zip(rows, masks, strict=True))
