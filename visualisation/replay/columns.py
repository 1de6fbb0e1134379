"""Columns of whole numbers as bytes that compress well; ``assets/data.js`` reads them back.

A column is kept as its differences of some order, each difference as a whole number without sign (0, -1, 1, -2, ...),
seven bits to a byte, the lowest first; the eighth bit says that more follow.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Numbers = NDArray[Any] | Sequence[float]


def in_steps(values: Numbers, step: float) -> Ints:
    """Numbers as whole multiples of a step; what is missing or not finite counts as 0."""
    numbers = np.nan_to_num(np.asarray(values, dtype=float), nan=0.0, posinf=0.0, neginf=0.0)
    whole: Ints = np.rint(numbers / step).astype(np.int64)
    return whole


def packed(numbers: Ints, order: int) -> bytes:
    """A column as bytes.

    Args:
        numbers: of the column.
        order: of the differences: 0 keeps the numbers, 1 what each is more than the one before, 2 how that changes.

    >>> packed(np.array([5, 6, 7, 8]), 1)
    b'\\n\\x02\\x02\\x02'
    """
    for _ in range(order):
        numbers = np.diff(numbers, prepend=0)
    unsigned = ((numbers << 1) ^ (numbers >> 63)).astype(np.uint64)
    longest = max(1, -(-int(unsigned.max(initial=0)).bit_length() // 7))
    bytes_of = np.empty((unsigned.size, longest), dtype=np.uint8)
    used = np.empty((unsigned.size, longest), dtype=bool)
    for place in range(longest):
        rest = unsigned >> np.uint64(7 * place)
        used[:, place] = rest > 0 if place else True
        bytes_of[:, place] = (rest & np.uint64(127)).astype(np.uint8)
    bytes_of[:, :-1] |= used[:, 1:].astype(np.uint8) << 7
    return bytes_of[used].tobytes()


class Columns:
    """Columns by name, which become one block of bytes."""

    def __init__(self) -> None:
        self._entries: list[list[Any]] = []
        self._parts: list[bytes] = []

    def add(self, name: str, numbers: Numbers, order: int = 0, step: float = 1.0) -> None:
        """Take a column.

        Args:
            name: by which it is found again.
            numbers: of it, floats where there is a step.
            order: of the differences that are kept, see ``packed``.
            step: to which it is kept.
        """
        whole = in_steps(numbers, step) if step != 1.0 else np.asarray(numbers, dtype=np.int64)
        self._entries.append([name, int(whole.size), order, step])
        self._parts.append(packed(whole, order))

    def block(self, about: dict[str, Any]) -> bytes:
        """All columns and a JSON value beside them, compressed (raw deflate): the same bytes for the same content."""
        head = json.dumps({**about, "columns": self._entries}, separators=(",", ":"), allow_nan=False).encode()
        squeezed = zlib.compressobj(9, zlib.DEFLATED, -15)
        return squeezed.compress(struct.pack("<I", len(head)) + head + b"".join(self._parts)) + squeezed.flush()
