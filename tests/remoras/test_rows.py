"""Rows in columns read back as they were given, whatever they hold and whenever they are packed."""

import copy
import math
import tracemalloc
from array import array
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.runs.tables import TYPES, column_array, numbers_array
from remoras.recorder import BLOCK, CHANGING, MANY, MOST_TEXTS, Floats, Recorder, Rows, Texts

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


def test_floats_keep_their_bits():
    values = [0.0, -0.0, math.inf, math.nan, 5e-324, 0.1]
    rows = Rows((value,) for value in values)
    rows.pack()
    assert [value.hex() for (value,) in rows] == [value.hex() for value in values]


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


def test_texts_come_in_bytes_until_they_are_too_many():
    texts = Texts(map(str, range(256)))
    assert texts.numbers.typecode == "B"
    texts.extend(["256", "3"])
    assert texts.numbers.typecode == "H"
    assert list(texts) == [*map(str, range(257)), "3"]


def test_whole_numbers_are_as_wide_as_they_have_to_be():
    rows, plain = Rows(), list[tuple[int]]()
    for number, code in ((1, "b"), (-129, "h"), (2, "h"), (2**20, "i"), (-(2**40), "q")):
        rows.append((number,))
        plain.append((number,))
        (column,) = rows.columns() or []
        assert isinstance(column, array)
        assert column.typecode == code
        assert as_shown(rows) == as_shown(plain)


def test_lists_in_rows_may_still_change():
    rows = Rows([(1, ["AUV00"])])
    rows.pack()
    rows[0][1].append("AUV01")
    assert list(rows) == [(1, ["AUV00", "AUV01"])]


def test_as_many_lists_may_change_as_is_said():
    rows = Rows([([str(number)],) for number in range(200)], changing=8)
    rows.pack()
    for place in (-1, -8):
        rows[place][0].append("more")
        assert rows[place][0][-1] == "more"
    rows[0][0].append("more")  # a list that is made anew each time
    assert rows[0] == (["0"],)


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


def test_too_many_texts_for_numbers_are_kept_as_they_are():
    texts = Texts(map(str, range(MOST_TEXTS)))
    assert not texts.extend(["one more"])
    assert texts.extend(["7"])
    assert (len(texts), texts[-1], texts[:2]) == (MOST_TEXTS + 1, "7", ["0", "1"])
    rows = Rows(("a",) for _ in range(10))
    rows.pack()
    rows.extend([(str(n),) for n in range(MOST_TEXTS)])
    rows.pack()
    assert list(rows) == [("a",)] * 10 + [(str(n),) for n in range(MOST_TEXTS)]


def test_whole_numbers_beyond_a_machine_word_are_kept_as_they_are():
    rows = Rows([(1,), (2,)])
    rows.pack()
    rows.append((2**70,))
    rows.pack()
    assert list(rows) == [(1,), (2,), (2**70,)]


def test_rows_that_are_not_equally_wide_are_kept_and_not_packed():
    rows = Rows([(1, 2), (3,)])
    assert not rows.pack()
    assert rows.columns() is None
    assert list(rows) == [(1, 2), (3,)]


def test_rows_equal_those_of_a_list_and_a_copy():
    rows = Rows([(1, "a")])
    rows += [(2, "a")]
    rows.pack()
    rows.append((3, "b"))
    assert rows == [(1, "a"), (2, "a"), (3, "b")] == rows
    assert rows == copy.deepcopy(rows) == Rows(list(rows))
    assert rows != [(1, "a"), (2, "a"), (3, "c")]
    assert rows != [(1, "a")]
    assert repr(rows) == "Rows([(1, 'a'), (2, 'a'), (3, 'b')])"


def test_a_recorder_packs_long_tables_and_hands_out_the_same_rows():
    recorder = Recorder()
    append = recorder.trajectories.append
    for number in range(MANY):
        recorder.pack()
        append((float(number), "AUV00", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert len(recorder.rows("trajectories").new) == MANY
    recorder.pack()
    assert not recorder.trajectories.new
    append((0.5, "AUV01", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert (len(recorder.trajectories), recorder.trajectories[-1][1]) == (MANY + 1, "AUV01")


def test_columns_take_a_quarter_of_the_memory_of_tuples_at_most():
    def taken(packs: bool) -> int:
        tracemalloc.start()
        rows = Rows()
        for number in range(8 * MANY):
            rows.append((number * 0.5, f"AUV0{number % 3}", number * 0.1, number * 0.2, number * 0.3, 1.5 + number))
            if packs and len(rows.new) >= MANY:
                rows.pack()
        size, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return size

    assert taken(True) < 0.25 * taken(False)


def test_lists_of_packets_take_a_quarter_of_the_memory_at_most():
    """Eight lists of a few texts or numbers each, as ``PACKETS`` has them; those of four vehicles may still change."""

    def taken(packs: bool) -> int:
        tracemalloc.start()
        rows = Rows(changing=8)
        for number in range(16 * MANY):
            names = [f"AUV0{n}" for n in range(number % 3)]
            at_s = [number + 0.1 * n for n in range(len(names))]
            rows.append((names, list(names[1:]), at_s, [], [], [], list(map(int, at_s)), []))
            if packs and len(rows.new) >= MANY:
                rows.pack()
        size, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return size

    assert taken(True) < 0.25 * taken(False)
