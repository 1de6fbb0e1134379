"""Rows in columns read back as they were given, whatever they hold and whenever they are packed."""

import math
from array import array
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.runs.tables import TYPES, column_array, numbers_array
from remoras.recorder import BLOCK, CHANGING, Floats, Rows

VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.sampled_from(["AUV00", "AUV01", ""]), st.text(max_size=3),
    st.lists(st.integers(0, 3), max_size=2),
)  # fmt: skip


def as_shown(rows: Any) -> list[str]:
    """Values with their types: 1, 1.0 and True are equal, and so is no NaN."""
    return [repr([(type(value).__name__, value) for value in row]) for row in rows]


@given(
    st.integers(1, 4).flatmap(lambda width: st.lists(st.lists(st.tuples(*[VALUES] * width), max_size=6), max_size=5)),
    st.data(),
)
def test_rows_are_what_was_appended(parts: list[list[tuple[Any, ...]]], data: st.DataObject):
    rows, plain = Rows(), list[tuple[Any, ...]]()
    for part in parts:
        for row in part:
            rows.append(row)
        plain += part
        if data.draw(st.booleans()):
            assert rows.pack()
    assert as_shown(rows) == as_shown(plain)
    assert len(rows) == len(plain)
    assert as_shown(reversed(rows)) == as_shown(reversed(plain))
    assert [as_shown([rows[n]]) for n in range(-len(plain), len(plain))] == [
        as_shown([plain[n]]) for n in range(-len(plain), len(plain))
    ]
    begin, end, step = (
        data.draw(st.integers(-9, 9)),
        data.draw(st.integers(-9, 9)),
        data.draw(st.sampled_from([1, 2, -1])),
    )
    assert as_shown(rows[begin:end:step]) == as_shown(plain[begin:end:step])
    assert as_shown(rows[begin:]) == as_shown(plain[begin:])
    for out in (len(plain), -len(plain) - 1):
        with pytest.raises(IndexError):
            _ = rows[out]


def test_floats_that_come_again_keep_their_bits():
    """Of three blocks and a half: the third is of other values, and what equals another, or nothing, is told apart."""
    other_nan = array("d")
    other_nan.frombytes(array("q", [-1]).tobytes())
    few = [0.0, -0.0, math.inf, math.nan, *other_nan, 5e-324, 0.1]
    values = [few[n % 7] if n // BLOCK != 2 else n * 0.1 for n in range(7 * BLOCK // 2)]
    rows = Rows((value,) for value in values[:300])
    rows.pack()
    rows.extend((value,) for value in values[300:])
    rows.pack()
    (column,) = rows.columns() or []
    assert isinstance(column, Floats)
    assert len(column.values) == 2 * 7 + BLOCK
    read = ([value for (value,) in rows], [rows[n][0] for n in range(len(rows))], [v for (v,) in rows[:]])
    given = array("d", values).tobytes()
    assert [array("d", each).tobytes() for each in read] == [given] * 3
    made = column_array(column, "float", lambda numbers, _: numbers_array(numbers, TYPES["float"]))
    assert made.buffers()[1].to_pybytes() == given
    rows.append((None,))  # and a column that is none of floats any more
    rows.pack()
    assert array("d", [value for (value,) in rows[:-1]]).tobytes() == given
    assert rows[-1] == (None,)


def test_lists_are_what_they_were_when_later_rows_came():
    """Of texts that come again, of texts that do not, of floats, of whole numbers, and of all together."""
    rows, plain = Rows(), list[tuple[Any, ...]]()
    for number in range(4 * CHANGING):
        names = [f"AUV0{n}" for n in range(number % 4)]
        row = (names, [str(number)] * (number % 2), [number * 0.1], [number, -1], [[], 1.0, "a"][: number % 3])
        rows.append(tuple(map(list, row)))
        plain.append(row)
        if number % 700 == 0:
            assert rows.pack()
    changed = rows[-CHANGING]
    changed[0].append("AUV09")
    plain[-CHANGING][0].append("AUV09")
    rows.pack()
    assert as_shown(rows) == as_shown(plain)
    assert as_shown(rows[700:720]) == as_shown(plain[700:720])
    assert as_shown([rows[n] for n in (0, 1, 699, -1)]) == as_shown([plain[n] for n in (0, 1, 699, -1)])
    more = [(["AUV00"], None, [], [], [])] * 3 * CHANGING  # and a column that is none of lists any more
    rows += more
    rows.pack()
    assert as_shown(rows) == as_shown([*plain, *more])
