"""Coded repairs: symbols as linear combinations of items over GF(256), and their decoder.

A symbol is the sum of items, each times a coefficient from 1 to 255 (random linear network coding, Ho et al., IEEE
Transactions on Information Theory 52 (2006), 4413-4430). It is innovative for each peer that lacks any of the items; a
peer decodes all once it has received as many symbols as it lacks items, except in about one case of 255. Coefficients
are not sent: they follow from slot, place in the packet and item name, known to sender and receivers.

The field is that of Reed-Solomon codes: bytes as polynomials modulo x^8 + x^4 + x^3 + x^2 + 1, where x generates all
non-zero elements.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from worldmodel.facts import Guid

FIELD = 0x11D
NONZERO = 255
MOST_ROWS = 48
"""Undecoded symbols that a node stores; further ones are dropped."""


def _powers() -> list[int]:
    powers, number = [], 1
    for _ in range(NONZERO):
        powers.append(number)
        number <<= 1
        if number > NONZERO:
            number ^= FIELD
    return powers


POWERS = (*_powers(), *_powers())
"""Powers of x from 0 to 509, so that exponents need no reduction."""
LOGS = (0, *[POWERS.index(number) for number in range(1, 256)])
"""Discrete logarithm of each element; that of 0 is undefined."""


def times(a: int, b: int) -> int:
    """Product in the field.

    >>> times(2, 0x80) == FIELD ^ 0x100, times(7, 0), times(1, 99)
    (True, 0, 99)
    """
    return POWERS[LOGS[a] + LOGS[b]] if a and b else 0


def inverse(a: int) -> int:
    """Multiplicative inverse of a non-zero element."""
    return POWERS[NONZERO - LOGS[a]]


def scrambled(word: int) -> int:
    """Hash 32 bits with full avalanche (C. Wellons, "hash prospector", 2018).

    The constants are below 2^31, so Python integers and compiled 64-bit words give the same result.
    """
    word = ((word ^ word >> 16) * 0x21F0AAAD) & 0xFFFFFFFF
    word = ((word ^ word >> 15) * 0x735A2D97) & 0xFFFFFFFF
    return word ^ word >> 15


def symbol_key(slot: int, place: int) -> int:
    """Return the seed of a symbol's coefficients, from its slot and place in the packet."""
    return scrambled(scrambled(slot & 0xFFFFFFFF) + place & 0xFFFFFFFF)


def coefficient(key: int, origin: int, sequence: int) -> int:
    """Return the coefficient (1 to 255) of an item in the symbol with that key."""
    return scrambled(key + (origin << 24) + sequence & 0xFFFFFFFF) % NONZERO + 1


@cache  # 256 products for each item of a symbol
def _products(factor: int) -> bytes:
    return bytes([times(factor, byte) for byte in range(256)])


def scaled(data: bytes, factor: int) -> bytes:
    """Multiply each byte by the factor."""
    return data.translate(_products(factor))


def added(first: bytes, other: bytes) -> bytes:
    """Add two byte strings; the shorter is padded by zeros."""
    size = max(len(first), len(other))
    total = int.from_bytes(first.ljust(size, b"\0"), "big") ^ int.from_bytes(other.ljust(size, b"\0"), "big")
    return total.to_bytes(size, "big")


def symbol(items: Mapping[tuple[int, int], bytes], key: int, size: int) -> bytes:
    """Return the linear combination of items (by origin and number) as ``size`` bytes."""
    total = bytes(size)
    for (origin, sequence), data in items.items():
        total = added(total, scaled(data, coefficient(key, origin, sequence)))
    return total


class Decoder:
    """Undecoded symbols of one node, as linear equations of the items it lacks.

    The equations stay in reduced form (Gauss-Jordan), so that an item is known as soon as they determine it.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[dict[Guid, int], bytes]] = []

    def __len__(self) -> int:
        """Number of undecoded symbols."""
        return len(self._rows)

    @property
    def unknown(self) -> list[Guid]:
        """Sorted items that these cover and this node lacks."""
        return sorted({name for row, _ in self._rows for name in row})

    def add(self, unknown: Mapping[Guid, int], data: bytes) -> dict[Guid, bytes]:
        """Add a symbol; return the items decoded by it, each padded by zeros.

        ``unknown`` has the non-zero coefficients of items that this node lacks; ``data`` is the symbol minus those that
        it holds.
        """
        terms = dict(unknown)
        for row, of_row in self._rows:
            # The first item of a row is its pivot, which occurs in no other row.
            factor = terms.get(next(iter(row)), 0)
            if factor:
                terms, data = self._less(terms, data, row, of_row, factor)
        if not terms or len(self._rows) == MOST_ROWS:
            return {}
        pivot = min(terms)
        by = inverse(terms[pivot])
        terms = {pivot: 1} | {name: times(by, factor) for name, factor in terms.items() if name != pivot}
        data = scaled(data, by)
        # Reduced form: eliminate the new pivot from all earlier rows.
        for at, (row, of_row) in enumerate(self._rows):
            if pivot in row:
                self._rows[at] = self._less(row, of_row, terms, data, row[pivot])
        self._rows.append((terms, data))
        return self._solved()

    def learn(self, name: Guid, data: bytes) -> dict[Guid, bytes]:
        """Eliminate an item known from elsewhere; return the items decoded by it."""
        known, (rows, self._rows) = {name: data}, (self._rows, [])
        for row, of_row in rows:
            rest = of_row
            for other in row.keys() & known.keys():
                rest = added(rest, scaled(known[other], row[other]))
            known |= self.add({other: factor for other, factor in row.items() if other not in known}, rest)
        del known[name]
        return known

    def _solved(self) -> dict[Guid, bytes]:
        solved = {name: data for row, data in self._rows if len(row) == 1 for name in row}
        self._rows = [(row, data) for row, data in self._rows if len(row) > 1]
        return solved

    @staticmethod
    def _less(
        terms: dict[Guid, int], data: bytes, row: Mapping[Guid, int], of_row: bytes, factor: int
    ) -> tuple[dict[Guid, int], bytes]:
        """Subtract a multiple of a row from an equation, whose first unknown stays first."""
        less = {name: terms.get(name, 0) ^ times(factor, of_name) for name, of_name in row.items()}
        return {name: number for name, number in (terms | less).items() if number}, added(data, scaled(of_row, factor))
