"""Rows of a table of results, of which most lie in columns, which take less than a quarter of the memory of tuples.

Whoever writes appends tuples, to a list, as fast as to any list. ``pack`` brings what has come since into the columns:
of floats and of whole numbers as machine words, as narrow as they may be, of texts and floats that come again and again
as numbers of a list of them, of lists as what is in them, one behind the other. A column that holds anything else stays
a list of the very objects, so a row reads back as it was given: the same types and the same bits. Lists within the last
rows may still change.
"""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import accumulate, chain, count
from typing import Any, TypeAlias, overload

Row = tuple[Any, ...]
MOST_TEXTS = 2**16
"""Different texts of a column that has numbers for them."""
WIDTHS = "bhiq"
"""Type codes of whole numbers of 8, 16, 32 and 64 bits."""
CHANGING = 1024
"""Lists of so many rows, the last of a table, may still change, if its maker does not say how many."""
SETTLED = 64
"""Lists that are put together at once, or more."""
BLOCK = 256
"""Rows whose different floats are kept once; a byte says which of them a row has."""


class Texts:
    """A column of texts that come again: for each row the number of one of them.

    Attributes:
        numbers: of the rows, 8 or 16 bits each; names: the texts, in the order in which they first came.

    Args:
        values: of the first rows.
    """

    __slots__ = ("_number_of", "names", "numbers")

    def __init__(self, values: Iterable[str]) -> None:
        self.numbers = array("B")
        self.names: list[str] = []
        self._number_of: dict[str, int] = {}
        self.extend(values)

    def extend(self, values: Iterable[str]) -> bool:
        """Take further rows; False, and nothing is taken, if there would be too many different texts."""
        values = tuple(values)
        new = [text for text in dict.fromkeys(values) if text not in self._number_of]
        if len(self.names) + len(new) > MOST_TEXTS:
            return False
        self._number_of.update(zip(new, range(len(self.names), len(self.names) + len(new)), strict=True))
        self.names += new
        if len(self.names) > 256 and self.numbers.typecode == "B":
            self.numbers = array("H", self.numbers)
        self.numbers.extend(map(self._number_of.__getitem__, values))
        return True

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[str]:
        return map(self.names.__getitem__, self.numbers)

    def __getitem__(self, place: Any) -> Any:
        found = self.numbers[place]
        return self.names[found] if isinstance(place, int) else [self.names[number] for number in found]


class Floats:
    """A column of floats that come again among the rows near by, such as times, headings and speeds of a fleet.

    Attributes:
        values: the different floats of each block of rows, to the bit, one block behind the other.
        starts: where those of each block begin; numbers: of the rows, counted from there, a byte each.
        newest: the floats of the rows behind the last block.

    Args:
        values: of the first rows.
    """

    __slots__ = ("newest", "numbers", "starts", "values")

    def __init__(self, values: Iterable[float]) -> None:
        self.values, self.newest = array("d"), array("d")
        self.starts, self.numbers = array("Q"), bytearray()
        self.extend(values)

    def extend(self, values: Iterable[float]) -> None:
        """Take further rows."""
        self.newest.extend(values)
        n_whole = len(self.newest) // BLOCK * BLOCK
        bits = array("q", self.newest[:n_whole].tobytes())  # -0.0 equals 0.0, and a NaN nothing; their bits do not
        for first in range(0, n_whole, BLOCK):
            number_of: defaultdict[int, int] = defaultdict(count().__next__)
            self.numbers.extend(map(number_of.__getitem__, bits[first : first + BLOCK]))
            self.starts.append(len(self.values))
            self.values.frombytes(array("q", number_of).tobytes())
        del self.newest[:n_whole]

    def __len__(self) -> int:
        return len(self.numbers) + len(self.newest)

    def __iter__(self) -> Iterator[float]:
        return chain(chain.from_iterable(map(self._of, count(), self.starts)), self.newest)

    def _of(self, block: int, start: int) -> Iterator[float]:
        """The floats of the rows of a block."""
        values = self.values[start : start + BLOCK]
        return map(values.__getitem__, self.numbers[block * BLOCK : (block + 1) * BLOCK])

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[number] for number in range(*place.indices(len(self)))]
        if place >= len(self.numbers):
            return self.newest[place - len(self.numbers)]
        return self.values[self.starts[place // BLOCK] + self.numbers[place]]


class Lists:
    """A column of lists: what is in them lies one behind the other, but for the newest, which may still change.

    Args:
        values: of the first rows.
        changing: so many, the last, may still change.
    """

    __slots__ = ("_changing", "_ends", "_entries", "_newest")

    def __init__(self, values: Iterable[list[Any]], changing: int = CHANGING) -> None:
        self._changing = changing
        self._entries: Packed = []
        self._ends = array("Q")  # of each list that lies in the entries
        self._newest: list[list[Any]] = []
        self.extend(values)

    def extend(self, values: Iterable[list[Any]]) -> None:
        """Take further rows; some at the end stay the very lists."""
        self._newest += values
        n_settled = len(self._newest) - self._changing
        if n_settled < SETTLED:
            return
        settled = self._newest[:n_settled]
        del self._newest[:n_settled]
        first = len(self._entries)
        self._ends.extend(accumulate(map(len, settled[1:]), initial=first + len(settled[0])))
        entries = list(chain.from_iterable(settled))
        self._entries = _together(self._entries, entries) if first else _packed(entries)

    def __len__(self) -> int:
        return len(self._ends) + len(self._newest)

    def __iter__(self) -> Iterator[list[Any]]:
        entries, ends = list(self._entries), self._ends
        return chain((entries[begin:end] for begin, end in zip(chain((0,), ends), ends, strict=False)), self._newest)

    def __getitem__(self, place: Any) -> Any:
        if isinstance(place, slice):
            return [self[number] for number in range(*place.indices(len(self)))]
        if place >= len(self._ends):
            return self._newest[place - len(self._ends)]
        return list(self._entries[self._ends[place - 1] if place else 0 : self._ends[place]])


Packed: TypeAlias = "array[float] | array[int] | Floats | Texts | Lists | list[Any]"
"""A column."""


def _packed(values: Sequence[Any], changing: int = CHANGING) -> Packed:
    """A column of these values, as small as it gives them back as they are; for ``changing`` see ``Lists``."""
    kinds = set(map(type, values))
    if kinds == {float}:
        return Floats(values) if _come_again(values) else array("d", values)
    if kinds == {int}:
        for width in WIDTHS:
            with suppress(OverflowError):
                return array(width, values)
        return list(values)
    if kinds == {str} and _come_again(values):
        return Texts(values)
    if kinds == {list}:
        return Lists(values, changing)
    return list(values)


def _come_again(values: Sequence[Any]) -> bool:
    return 2 * len(set(values)) <= len(values)


def _together(column: Packed, values: Sequence[Any]) -> Packed:
    """A column with further values, in place where they are of its kind."""
    if isinstance(column, list):
        column.extend(values)
        return column
    if isinstance(column, Texts):
        if set(map(type, values)) == {str} and column.extend(values):
            return column
    elif isinstance(column, Floats):
        if set(map(type, values)) == {float}:
            column.extend(values)
            return column
    elif isinstance(column, Lists):
        if set(map(type, values)) == {list}:
            column.extend(values)
            return column
    elif set(map(type, values)) == {float if column.typecode == "d" else int}:
        for width in "d" if column.typecode == "d" else WIDTHS[WIDTHS.index(column.typecode) :]:
            with suppress(OverflowError):
                more = array(width, values)
                column = column if width == column.typecode else array(width, column)
                column.extend(more)
                return column
    return [*column, *values]


class Rows(Sequence[Row]):
    """Rows of a table in the order in which they were written, to be read or appended to.

    Args:
        rows: the first ones.
        changing: lists of so many rows, the last, may still change.

    Attributes:
        append: takes a row; extend: takes several.
        new: rows that have come since they were packed last; n_packed: rows before them. Who follows what is written
            asks by these two, which takes no call, whether there is more.

    >>> rows = Rows([(0.5, "AUV00"), (1.0, "AUV00")])
    >>> rows.pack()
    True
    >>> rows.append((1.5, "AUV01"))
    >>> len(rows), rows[-1], rows[:2]
    (3, (1.5, 'AUV01'), [(0.5, 'AUV00'), (1.0, 'AUV00')])
    """

    __slots__ = ("_changing", "_columns", "append", "extend", "n_packed", "new")
    append: Callable[[Row], None]
    extend: Callable[[Iterable[Row]], None]

    def __init__(self, rows: Iterable[Row] = (), changing: int = CHANGING) -> None:
        self._changing = changing
        self.new: list[Row] = list(rows)
        self._columns: list[Packed] = []
        self.n_packed = 0
        self.append = self.new.append  # the list's own: no call of ours for a row
        self.extend = self.new.extend

    def pack(self) -> bool:
        """Bring the new rows into columns; False, and they stay, if they are not all as wide as those before."""
        if not self.new:
            return True
        widths = set(map(len, self.new))
        if len(widths) > 1 or (self.n_packed and widths != {len(self._columns)}):
            return False
        values = list(zip(*self.new, strict=True))
        if self.n_packed:
            self._columns = [_together(column, more) for column, more in zip(self._columns, values, strict=True)]
        else:
            self._columns = [_packed(column, self._changing) for column in values]
        self.n_packed += len(self.new)
        self.new.clear()
        return True

    def columns(self) -> list[Packed] | None:
        """All rows as columns, which are not to be changed; None if rows are not equally wide."""
        return self._columns if self.pack() else None

    def __len__(self) -> int:
        return self.n_packed + len(self.new)

    def __iter__(self) -> Iterator[Row]:
        return chain(zip(*self._columns, strict=True), self.new)

    @overload
    def __getitem__(self, place: int) -> Row: ...

    @overload
    def __getitem__(self, place: slice) -> list[Row]: ...

    def __getitem__(self, place: int | slice) -> Row | list[Row]:
        if isinstance(place, slice):
            begin, end, step = place.indices(len(self))
            if step != 1:
                return [self[number] for number in range(begin, end, step)]
            n = self.n_packed
            packed = zip(*(column[begin : min(end, n)] for column in self._columns), strict=True) if begin < n else ()
            return [*packed, *self.new[max(begin - n, 0) : max(end - n, 0)]]
        number = place + len(self) if place < 0 else place
        if number >= self.n_packed:
            return self.new[number - self.n_packed]
        if number < 0:
            raise IndexError(f"row {place} of {len(self)}")
        return tuple(column[number] for column in self._columns)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rows | list):
            return NotImplemented
        return len(self) == len(other) and all(own == its for own, its in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]  # as lists have none

    def __iadd__(self, rows: Iterable[Row]) -> Rows:
        self.extend(rows)
        return self

    def __repr__(self) -> str:
        return f"Rows({list(self)!r})"

    def __reduce__(self) -> tuple[type[Rows], tuple[list[Row]]]:
        return Rows, (list(self),)
