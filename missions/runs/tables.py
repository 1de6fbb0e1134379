"""Tables of a run as Arrow and Parquet, one file per table.

Numbers are quantised to a power of two, such as 1/128 m: they stay ordinary floats, with meaningless digits zero, and
compress well as byte streams under zstd. Joules are integers, stored as differences. Trajectories are sorted by vehicle
for the same reason.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from itertools import chain
from numbers import Integral, Real
from operator import itemgetter
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from missions.errors import OutputError
from remoras.recorder import TRAJECTORIES, Row, Table

_VALUES: dict[str, tuple[type, ...]] = {
    "float": (Real,), "int": (Integral,), "str": (str,), "bool": (bool, np.bool_),
    "list": (list, tuple), "floats": (list, tuple), "ints": (list, tuple),
}  # fmt: skip
_ENTRIES = {"list": "str", "floats": "float", "ints": "int"}
_ARROW = {"str": pa.string(), "bool": pa.bool_(), "int": pa.int64()}


def column_array(values: Sequence[Any], kind: str, unit: str = "") -> pa.Array:
    """Convert values to an Arrow array, quantised; a wrong type raises TypeError or ValueError."""
    for cls in set(map(type, values)) - {type(None)}:
        # Python counts bool as an integer, Arrow does not.
        if not issubclass(cls, _VALUES[kind]) or (cls is bool and kind != "bool"):
            raise TypeError(f"{cls.__name__} in a column of kind {kind}")
    if kind in _ARROW:
        return pa.array(values, _ARROW[kind])
    if kind in _ENTRIES:
        lists = [value or () for value in values]
        entries = column_array(list(chain.from_iterable(lists)), _ENTRIES[kind], unit)
        missing = pa.array([value is None for value in values]) if None in values else None
        return pa.ListArray.from_arrays(pa.array(np.cumsum([0, *map(len, lists)]), pa.int32()), entries, mask=missing)
    return _quantised(pa.array(values, pa.float64()), unit)


STEPS = {"s": 2.0**-12, "m": 2.0**-7, "rad": 2.0**-10, "m/s": 2.0**-10}
"""Quantisation step by unit, far below any meaningful difference."""
WHOLE = frozenset({"J"})  # units stored as integers; non-finite values become null
DIGITS = {"1": 6}  # decimals of numbers without unit, so that 0.95 stays 0.95
UNLIKE = frozenset({"uid", "value", "item_uids", "status_uids"})
"""Columns whose texts rarely repeat; others use a dictionary."""
LEVEL = 6  # zstd level: a twentieth smaller than the default, for a hundredth of a run's time


def _quantised(array: pa.Array, unit: str) -> pa.Array:
    numbers = array.to_numpy(zero_copy_only=False)  # NaN where missing
    if unit in WHOLE:
        return pa.array(np.rint(numbers), mask=~np.isfinite(numbers)).cast(pa.int64())
    if unit in STEPS:
        # Adding 0.0 turns -0.0 into 0.0, which would otherwise be another value in digests.
        numbers = np.rint(numbers / STEPS[unit]) * STEPS[unit] + 0.0
    elif unit in DIGITS:
        numbers = np.round(numbers, DIGITS[unit])
    return pa.array(numbers, mask=array.is_null().to_numpy(zero_copy_only=False))


def arrow_table(table: Table, rows: Sequence[Row]) -> pa.Table:
    """Convert rows to an Arrow table, with units in metadata; OutputError for a row that does not fit the columns."""
    fields, arrays = [], []
    try:
        if table.name == TRAJECTORIES.name:
            rows = sorted(rows, key=itemgetter(1))  # by vehicle, and by time within it
        columns = list(zip(*rows, strict=True)) if rows else [()] * len(table.columns)
        for column, values in zip(table.columns, columns, strict=True):
            array = column_array(values, column.kind, column.unit)
            fields.append(pa.field(column.name, array.type, metadata={"unit": column.unit} if column.unit else None))
            arrays.append(array)
    except (TypeError, ValueError, OverflowError) as error:
        declared = ", ".join(f"{column.name} ({column.kind})" for column in table.columns)
        raise OutputError(f"table {table.name}: a row does not fit its columns {declared}: {error}") from None
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def parquet(table: pa.Table) -> bytes:
    """Return a table as a Parquet file, with encodings for its columns."""
    encodings, texts = {}, []
    for field in table.schema:
        kind, path = field.type, field.name
        if pa.types.is_list(kind):
            kind, path = kind.value_type, f"{path}.list.element"
        if pa.types.is_floating(kind):
            encodings[path] = "BYTE_STREAM_SPLIT"
        elif pa.types.is_integer(kind):
            encodings[path] = "DELTA_BINARY_PACKED"
        elif pa.types.is_string(kind) and field.name not in UNLIKE:
            texts.append(path)
    file = io.BytesIO()
    pq.write_table(
        table,
        file,
        compression="zstd",
        compression_level=LEVEL,
        use_dictionary=texts,
        column_encoding=encodings,
        write_statistics=False,
    )
    return file.getvalue()
