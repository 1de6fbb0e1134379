"""Coded repairs: sums of items over a field of 256 numbers, and what a node makes of those that it hears.

A symbol is the sum of items, each times a coefficient from 1 to 255, in GF(256) (random linear network coding, Ho et
al., IEEE Transactions on Information Theory 52 (2006), 4413-4430). It brings something new to each peer that lacks any
of the items, whichever that is; a peer that lacks as many as it has heard symbols knows them all, but for about one
case in 255. No coefficient travels: each is drawn from slot, place in the packet and name of the item, which sender and
receivers know alike.

The field is that of Reed-Solomon codes: bytes as polynomials modulo x^8 + x^4 + x^3 + x^2 + 1, of which x generates all
but 0.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from functools import cache
from typing import Generic, TypeVar

FIELD = 0x11D
"""x^8 + x^4 + x^3 + x^2 + 1."""
NONZERO = 255
"""Numbers of the field beside 0."""
MOST_ROWS = 48
"""Symbols that a node keeps until they can be decoded; others that come are of no use to it."""


def _powers() -> list[int]:
    """The powers of x from 0 to 254."""
    powers, number = [], 1
    for _ in range(NONZERO):
        powers.append(number)
        number <<= 1
        if number > NONZERO:
            number ^= FIELD
    return powers


POWERS = (*_powers(), *_powers())
"""x to the power of 0 to 509, so that exponents need not be reduced."""
LOGS = (0, *[POWERS.index(number) for number in range(1, 256)])
"""The exponent of each number from 1; that of 0 means nothing."""


def times(a: int, b: int) -> int:
    """Product in the field.

    >>> times(2, 0x80) == FIELD ^ 0x100, times(7, 0), times(1, 99)
    (True, 0, 99)
    """
    return POWERS[LOGS[a] + LOGS[b]] if a and b else 0


def inverse(a: int) -> int:
    """What a number other than 0 gives 1 with."""
    return POWERS[NONZERO - LOGS[a]]


def scrambled(word: int) -> int:
    """Scramble 32 bits: each input bit turns about half of the output bits (C. Wellons, "hash prospector", 2018).

    The constants are below 2^31, so the same lines give the same on Python integers and on compiled 64-bit words.
    """
    word = ((word ^ word >> 16) * 0x21F0AAAD) & 0xFFFFFFFF
    word = ((word ^ word >> 15) * 0x735A2D97) & 0xFFFFFFFF
    return word ^ word >> 15


def symbol_key(slot: int, place: int) -> int:
    """What the coefficients of a symbol are drawn from: its slot, and its place in the packet."""
    return scrambled(scrambled(slot & 0xFFFFFFFF) + place & 0xFFFFFFFF)


def coefficient(key: int, origin: int, sequence: int) -> int:
    """What an item is multiplied by in the symbol with that key: from 1 to 255.

    Args:
        key: of the symbol.
        origin: of the item, ``sequence`` is its number.
    """
    return scrambled(key + (origin << 24) + sequence & 0xFFFFFFFF) % NONZERO + 1


@cache
def _products(factor: int) -> bytes:
    """The products of a number with each byte."""
    return bytes([times(factor, byte) for byte in range(256)])


def scaled(data: bytes, factor: int) -> bytes:
    """Each byte times the factor."""
    return data.translate(_products(factor))


def added(one: bytes, other: bytes) -> bytes:
    """Sum of two strings of bytes, of which the shorter counts as followed by zeros."""
    size = max(len(one), len(other))
    total = int.from_bytes(one.ljust(size, b"\0"), "big") ^ int.from_bytes(other.ljust(size, b"\0"), "big")
    return total.to_bytes(size, "big")


def symbol(items: Mapping[tuple[int, int], bytes], key: int, size: int) -> bytes:
    """The sum of items, each times its coefficient, as ``size`` bytes.

    Args:
        items: by origin and number, at most so long.
        key: of the symbol.
        size: in bytes.
    """
    total = bytes(size)
    for (origin, sequence), data in items.items():
        total = added(total, scaled(data, coefficient(key, origin, sequence)))
    return total


Name = TypeVar("Name", bound=Hashable)


class Decoder(Generic[Name]):
    """Symbols that one node has heard and cannot decode yet, each as an equation of what it lacks.

    The equations are kept solved for their first unknown each (Gauss and Jordan), so that an item is known as soon as
    what was heard determines it.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[dict[Name, int], bytes]] = []

    def __len__(self) -> int:
        """How many symbols it keeps."""
        return len(self._rows)

    @property
    def unknown(self) -> list[Name]:
        """The items that they are over and that this node lacks, in the order of their names."""
        return sorted({name for row, _ in self._rows for name in row})  # type: ignore[type-var]

    def add(self, unknown: Mapping[Name, int], data: bytes) -> dict[Name, bytes]:
        """Take in a symbol; returns the items that are known now, each filled up with zeros.

        Args:
            unknown: coefficients of the items in it that this node lacks, none 0.
            data: the symbol, less the items that this node holds.
        """
        terms = dict(unknown)
        for row, of_row in self._rows:
            factor = terms.get(next(iter(row)), 0)
            if factor:
                terms, data = self._less(terms, data, row, of_row, factor)
        if not terms or len(self._rows) == MOST_ROWS:
            return {}
        pivot = min(terms)  # type: ignore[type-var]
        by = inverse(terms[pivot])
        terms = {pivot: 1} | {name: times(by, factor) for name, factor in terms.items() if name != pivot}
        data = scaled(data, by)
        for at, (row, of_row) in enumerate(self._rows):
            if pivot in row:
                self._rows[at] = self._less(row, of_row, terms, data, row[pivot])
        self._rows.append((terms, data))
        return self._solved()

    def learn(self, name: Name, data: bytes) -> dict[Name, bytes]:
        """An item has come to be known otherwise; returns those that are known by it."""
        known, (rows, self._rows) = {name: data}, (self._rows, [])
        for row, of_row in rows:
            rest = of_row
            for other in row.keys() & known.keys():
                rest = added(rest, scaled(known[other], row[other]))
            known |= self.add({other: factor for other, factor in row.items() if other not in known}, rest)
        del known[name]
        return known

    def _solved(self) -> dict[Name, bytes]:
        """Take out the equations of a single unknown."""
        found = {name: data for row, data in self._rows if len(row) == 1 for name in row}
        self._rows = [(row, data) for row, data in self._rows if len(row) > 1]
        return found

    @staticmethod
    def _less(
        terms: dict[Name, int], data: bytes, row: Mapping[Name, int], of_row: bytes, factor: int
    ) -> tuple[dict[Name, int], bytes]:
        """An equation less the factor times a row; the first unknown of the equation stays the first."""
        less = {name: terms.get(name, 0) ^ times(factor, of_name) for name, of_name in row.items()}
        return {name: number for name, number in (terms | less).items() if number}, added(data, scaled(of_row, factor))
