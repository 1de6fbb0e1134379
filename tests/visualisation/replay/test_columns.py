"""Columns of numbers come back as they were put in, whatever they are."""

import json
import struct
import zlib
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from visualisation.replay.tables import Columns, packed

MOST = 2**52
"""JavaScript has whole numbers exactly to 2^53, and differences may be twice as large."""


def unpacked(data: bytes, start: int, count: int, order: int) -> tuple[list[int], int]:
    """The numbers of a column, and where the next one begins; read byte by byte, as the page does."""
    numbers, at = [], start
    for _ in range(count):
        word, shift = 0, 0
        while True:
            byte = data[at]
            at += 1
            word |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        numbers.append(-(word + 1) // 2 if word % 2 else word // 2)
    for _ in range(order):
        numbers = [int(total) for total in np.cumsum(np.array(numbers, dtype=np.int64))]
    return numbers, at


def opened(block: bytes) -> tuple[dict[str, Any], dict[str, list[float]]]:
    """The JSON head of a block and its columns."""
    data = zlib.decompress(block, -15)
    (length,) = struct.unpack("<I", data[:4])
    about = json.loads(data[4 : 4 + length])
    columns, at = {}, 4 + length
    for name, count, order, step in about["columns"]:
        numbers, at = unpacked(data, at, count, order)
        columns[name] = [number * step for number in numbers]
    assert at == len(data)
    return about, columns


@given(st.lists(st.integers(-MOST, MOST)), st.integers(0, 2))
def test_numbers_come_back(numbers: list[int], order: int) -> None:
    data = packed(np.array(numbers, dtype=np.int64), order)
    assert unpacked(data, 0, len(numbers), order) == (numbers, len(data))


@given(st.lists(st.floats(-1e6, 1e6)))
def test_lengths_come_back_within_half_a_step(values: list[float]) -> None:
    columns = Columns()
    columns.add("a", [3, 1, 2])
    columns.add("b", np.array(values), 2, 0.125)
    about, found = opened(columns.block({"said": "ö"}))
    assert about["said"] == "ö"
    assert found["a"] == [3, 1, 2]
    assert len(found["b"]) == len(values)
    assert all(abs(got - value) <= 0.0625 for got, value in zip(found["b"], values, strict=True))


def test_what_is_missing_or_not_finite_counts_as_nothing() -> None:
    columns = Columns()
    columns.add("a", np.array([1.0, np.nan, np.inf, 2.0]), 1, 0.5)
    assert opened(columns.block({}))[1]["a"] == [1.0, 0.0, 0.0, 2.0]
