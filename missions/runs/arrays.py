"""Columns of a table as Arrow arrays, the same to the bit as ``pyarrow.array`` makes them of lists.

``pyarrow.array`` loads pandas to ask whether it was given something of it, which takes a fifth of a second and tens of
megabytes. So columns whose values are all of their kind, or None, are put together here of buffers; whatever else there
is, is left to it, and so is what it says of values that do not fit.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from remoras.recorder import BLOCK, Floats, Packed, Texts

TYPES = {
    "float": pa.float64(), "int": pa.int64(), "str": pa.string(), "bool": pa.bool_(), "list": pa.list_(pa.string()),
    "floats": pa.list_(pa.float64()), "ints": pa.list_(pa.int64()),
}  # fmt: skip
"""Types in a file by the kind of a column."""
_VALUES: dict[str, tuple[type, ...]] = {
    "float": (float, type(None)), "int": (int, type(None)), "str": (str, type(None)), "bool": (bool, type(None)),
    "list": (list,), "floats": (list,), "ints": (list,),
}  # fmt: skip
"""Types of the values of a column that is put together here."""
_ENTRIES = {"list": "str", "floats": "float", "ints": "int"}
"""Kind of the entries of lists."""
_MOST_BYTES = 2**31 - 1
"""Of all texts of a column: more have wider offsets."""

Array = npt.NDArray[Any]


Keep = Callable[[Array, Array | None], pa.Array]
"""Makes an Arrow array of floats and of which are missing, None if none is; 0 stands where one is."""


def column_array(values: Packed | Sequence[Any], kind: str, keep: Keep, order: Array | None = None) -> pa.Array:
    """A column as an Arrow array.

    Args:
        values: of all rows.
        kind: one of those of columns.
        keep: takes the floats of the column.
        order: numbers of the rows as they are to be; as they are if None.

    Raises:
        pa.ArrowException, TypeError, ValueError, OverflowError: a value is not of that kind.
    """
    if isinstance(values, Texts) and kind == "str":
        numbers = np.array(values.numbers)
        return _texts(values.names, numbers if order is None else numbers[order])
    if isinstance(values, array) and kind == ("float" if values.typecode == "d" else "int"):
        numbers = np.array(values, np.float64 if kind == "float" else np.int64)
        numbers = numbers if order is None else numbers[order]
        return keep(numbers, None) if kind == "float" else numbers_array(numbers, TYPES[kind])
    if isinstance(values, Floats) and kind == "float":
        numbers = _together(values)
        return keep(numbers if order is None else numbers[order], None)
    values = list(values) if order is None else [values[number] for number in order]
    if not set(map(type, values)) <= {*_VALUES[kind]}:
        return _otherwise(values, kind, keep)
    if kind in _ENTRIES:
        offsets = np.zeros(len(values) + 1, np.int32)
        np.cumsum(np.fromiter(map(len, values), np.int64, len(values)), out=offsets[1:])
        entries = column_array(list(chain.from_iterable(values)), _ENTRIES[kind], keep)
        buffers = [None, pa.py_buffer(offsets)]
        return pa.Array.from_buffers(pa.list_(entries.type), len(values), buffers, children=[entries])
    return _plain(values, kind, keep)


def _together(column: Floats) -> Array:
    """The floats of all rows."""
    numbers, values = np.empty(len(column)), np.array(column.values)
    number_of = np.frombuffer(bytes(column.numbers), np.uint8)
    for block, start in enumerate(column.starts):
        rows = slice(block * BLOCK, (block + 1) * BLOCK)
        numbers[rows] = values[start : start + BLOCK][number_of[rows]]
    numbers[len(column.numbers) :] = column.newest
    return numbers


def _otherwise(values: list[Any], kind: str, keep: Keep) -> pa.Array:
    """What pyarrow makes of values that it has to look at one by one."""
    made = pa.array(values, TYPES[kind])
    if kind == "float":
        return keep(*_floats(made))
    return pa.ListArray.from_arrays(made.offsets, keep(*_floats(made.values))) if kind == "floats" else made


def _floats(made: pa.Array) -> tuple[Array, Array | None]:
    numbers, missing = made.to_numpy(zero_copy_only=False), None
    if made.null_count:
        missing = made.is_null().to_numpy(zero_copy_only=False)
        numbers = np.where(missing, 0.0, numbers)
    return numbers, missing


def _plain(values: list[Any], kind: str, keep: Keep) -> pa.Array:
    """Values of one kind, or None."""
    absent = np.fromiter((value is None for value in values), bool, len(values))
    missing = absent if absent.any() else None
    if kind == "str":
        return _texts([value or "" for value in values], None, missing)
    if kind == "bool":
        bits = np.packbits(np.fromiter(map(bool, values), bool, len(values)), bitorder="little")
        return pa.Array.from_buffers(pa.bool_(), len(values), [_bitmap(missing), pa.py_buffer(bits)])
    present = (0 if value is None else value for value in values)
    if kind == "float":
        return keep(np.fromiter(present, np.float64, len(values)), missing)
    try:
        return numbers_array(np.fromiter(present, np.int64, len(values)), TYPES[kind], missing)
    except OverflowError:
        return pa.array(values, TYPES[kind])


def numbers_array(numbers: Array, kind: pa.DataType, missing: Array | None = None) -> pa.Array:
    """Numbers as an array of 64 bits each; null where they are missing.

    Args:
        numbers: its values, which it keeps; missing: where there is none, None if there are all.
        kind: float64 or int64.
    """
    return pa.Array.from_buffers(kind, len(numbers), [_bitmap(missing), pa.py_buffer(np.ascontiguousarray(numbers))])


def _bitmap(missing: Array | None) -> pa.Buffer | None:
    return None if missing is None else pa.py_buffer(np.packbits(~missing, bitorder="little"))


def _texts(names: Sequence[str], numbers: Array | None = None, missing: Array | None = None) -> pa.Array:
    """Texts, or those of these numbers."""
    encoded = [name.encode() for name in names]
    lengths = np.fromiter(map(len, encoded), np.int64, len(encoded))
    if numbers is not None:
        lengths = lengths[numbers] if encoded else np.zeros(0, np.int64)
        encoded = list(map(encoded.__getitem__, numbers.tolist()))
    offsets = np.zeros(len(lengths) + 1, np.int64)
    np.cumsum(lengths, out=offsets[1:])
    if offsets[-1] > _MOST_BYTES:
        raise ValueError(f"its texts have {offsets[-1]} bytes; allowed: up to {_MOST_BYTES}")
    buffers = [_bitmap(missing), pa.py_buffer(offsets.astype(np.int32)), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(pa.string(), len(lengths), buffers)


def constant_array(text: str, n: int) -> pa.Array:
    """The same text so many times."""
    return _texts([text], np.zeros(n, np.uint16))
