"""Tables of runs as Parquet: the same columns, units and values in the folder of a run and in that of a sweep.

Numbers are kept to a step that is a power of two, such as 1/128 m: they are ordinary floats, no reader has to convert
them, and the digits that mean nothing are zeros. Split into streams of bytes, zstd makes little of them. Trajectories
are sorted by vehicle for the same reason. In the folder of a run a file holds one table. In that of a sweep it holds
one row group for each run of the sample, and the first column says which; parts, one folder per run, are written while
the sweep is on and merged when it ends.
"""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Collection, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from missions.errors import OutputError
from remoras.recorder import KEY, Column, Recorder, Row, Table

STEPS = {"s": 2.0**-12, "m": 2.0**-7, "rad": 2.0**-10, "m/s": 2.0**-10, "J": 1.0}
"""Step to which numbers of a unit are kept: far below anything that means something."""
DIGITS = {"1": 6}
"""Decimals to which shares and other numbers without a unit are kept, so that 0.95 stays 0.95."""
UNLIKE = frozenset({"uid", "value", "item_uids", "status_uids"})
"""Columns whose texts hardly ever come twice; of others a file has a dictionary."""
LEVEL = 6
"""Of zstd: a twentieth smaller than the usual level, for a hundredth of the time of a run."""
TYPES = {
    "float": pa.float64(), "int": pa.int64(), "str": pa.string(), "bool": pa.bool_(), "list": pa.list_(pa.string()),
    "floats": pa.list_(pa.float64()), "ints": pa.list_(pa.int64()),
}  # fmt: skip
"""Types in a file by the kind of a column."""


def _field(column: Column) -> pa.Field:
    return pa.field(column.name, TYPES[column.kind], metadata={"unit": column.unit} if column.unit else None)


def _kept(values: pa.Array, unit: str) -> pa.Array:
    """Numbers to the step of their unit; what is missing or not finite stays so."""
    numbers = values.to_numpy(zero_copy_only=False)
    if unit in STEPS:
        numbers = np.rint(numbers / STEPS[unit]) * STEPS[unit] + 0.0
    elif unit in DIGITS:
        numbers = np.round(numbers, DIGITS[unit])
    else:
        return values
    return pa.array(numbers, mask=np.asarray(values.is_null())) if values.null_count else pa.array(numbers)


def arrow_table(table: Table, rows: Sequence[Row], key: str = "") -> pa.Table:
    """Rows of a table as an Arrow table, with units in the metadata of its columns.

    Args:
        table: its columns.
        rows: in the order in which they were written.
        key: of the run, as first column; none where it is empty.

    Raises:
        OutputError: a row does not fit the columns that its writer declared.
    """
    if table.name == "trajectories":
        rows = sorted(rows, key=itemgetter(1))  # by vehicle; in order of time they are already
    fields, arrays = [], []
    if key:
        fields, arrays = [pa.field(KEY, pa.string())], [pa.array([key] * len(rows), pa.string())]
    try:
        columns = list(zip(*rows, strict=True)) or [()] * len(table.columns)
        for column, values in zip(table.columns, columns, strict=True):
            array = pa.array(values, TYPES[column.kind])
            if column.kind == "float":
                array = _kept(array, column.unit)
            elif column.kind == "floats":
                array = pa.ListArray.from_arrays(array.offsets, _kept(array.values, column.unit))
            fields.append(_field(column))
            arrays.append(array)
    except (pa.ArrowException, TypeError, ValueError) as error:
        declared = ", ".join(f"{column.name} ({column.kind})" for column in table.columns)
        raise OutputError(f"table {table.name}: a row does not fit its columns {declared}: {error}") from None
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def writer(target: Any, schema: pa.Schema) -> pq.ParquetWriter:
    """A writer of tables of this schema."""
    encodings, texts = {}, []
    for field in schema:
        of, path = field.type, field.name
        if pa.types.is_list(of):
            of, path = of.value_type, f"{path}.list.element"
        if pa.types.is_floating(of):
            encodings[path] = "BYTE_STREAM_SPLIT"
        elif pa.types.is_integer(of):
            encodings[path] = "DELTA_BINARY_PACKED"
        elif pa.types.is_string(of) and field.name not in UNLIKE:
            texts.append(path)
    return pq.ParquetWriter(
        target,
        schema,
        compression="zstd",
        compression_level=LEVEL,
        use_dictionary=texts,
        column_encoding=encodings,
        write_statistics=[KEY],
    )


def write_table(target: Any, table: pa.Table) -> None:
    """Write one Arrow table as a Parquet file."""
    with writer(target, table.schema) as out:
        out.write_table(table)


def encoded(recorder: Recorder, key: str) -> dict[str, bytes]:
    """Every table of a run as a Parquet file in memory."""
    files = {}
    for name, table in recorder.tables.items():
        buffer = io.BytesIO()
        write_table(buffer, arrow_table(table, recorder.rows(name), key))
        files[name] = buffer.getvalue()
    return files


def write_part(folder: Path, key: str, tables: Mapping[str, bytes]) -> None:
    """Keep the tables of a run as a part; it appears whole or not at all."""
    draft, part = folder / f".{key}", folder / key
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir(parents=True)
    for name, content in tables.items():
        with (draft / f"{name}.parquet").open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
    shutil.rmtree(part, ignore_errors=True)
    draft.rename(part)


def merge(parts: Path, tables: Path, keys: Collection[str]) -> None:
    """Bring the parts of these runs into one file per table, beside what is there already, in the order of the keys.

    Raises:
        OutputError: what is there has other columns; the parts are kept.
    """
    if not parts.is_dir():
        return
    tables.mkdir(exist_ok=True)
    written = {path.stem for key in keys for path in (parts / key).glob("*.parquet")}
    for name in sorted(written | {path.stem for path in tables.glob("[!.]*.parquet")}):
        _merge_table(name, parts, tables, keys)
    shutil.rmtree(parts)


def _merge_table(name: str, parts: Path, tables: Path, keys: Collection[str]) -> None:
    merged, draft = tables / f"{name}.parquet", tables / f".{name}.parquet"
    old = pq.ParquetFile(merged) if merged.is_file() else None
    places: dict[str, int] = {}
    if old is not None:
        for number in range(old.num_row_groups):
            places[old.metadata.row_group(number).column(0).statistics.min] = number
    own = [path for key in sorted(keys) if (path := parts / key / f"{name}.parquet").is_file()]
    schema = old.schema_arrow if old is not None else pq.read_schema(own[0])
    if odd := [path for path in own if not pq.read_schema(path).equals(schema)]:
        raise OutputError(
            f"{merged}: has the columns {', '.join(schema.names)}, and {odd[0]} has others: another version wrote one "
            f"of them; move {merged.name} elsewhere and run the sweep again"
        )
    with writer(draft, schema) as out:
        for key in sorted(keys):
            part = parts / key / f"{name}.parquet"
            if key in places and old is not None:
                out.write_table(old.read_row_group(places[key]))
            elif part.is_file() and (table := pq.read_table(part)).num_rows:
                out.write_table(table)
    if old is not None:
        old.close()
    draft.replace(merged)
