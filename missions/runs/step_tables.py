"""Tables of a sample of runs: whole numbers in small units, packed.

A table of ``remoras.recorder`` becomes whole numbers of centimetres, milliradians, milliseconds: differences between
neighbouring rows are then small, so delta coding and zstd take little room. Trajectories are sorted by vehicle for
the same reason. A file holds one row group per run, and the first column says which. Parts, one folder per run, are
written while the sweep is on and merged when it ends.
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
from remoras.recorder import Column, Recorder, Row, Table

UNITS = {
    "s": ("_s", "_ms", "ms", 1000), "m": ("_m", "_cm", "cm", 100), "rad": ("_rad", "_mrad", "mrad", 1000),
    "m/s": ("_mps", "_mmps", "mm/s", 1000), "J": ("_j", "_j", "J", 1), "1": ("", "_milli", "0.001", 1000),
}  # fmt: skip
"""Unit of the recorder -> (ending of the column, its ending here, unit here, how many of these make one)."""

LARGEST = np.iinfo(np.int32).max
"""Greatest whole number that such a table holds."""


def _field(column: Column) -> pa.Field:
    if column.kind == "float" and column.unit in UNITS:
        ending, small_ending, unit, _ = UNITS[column.unit]
        return pa.field(column.name.removesuffix(ending) + small_ending, pa.int32(), metadata={"unit": unit})
    kinds = {"float": pa.float64(), "int": pa.int32(), "str": pa.string(), "list": pa.list_(pa.string())}
    return pa.field(column.name, kinds[column.kind], metadata={"unit": column.unit} if column.unit else None)


def schema_of(table: Table) -> pa.Schema:
    """Columns of a table of the sample, the key of the run first."""
    return pa.schema([pa.field("key", pa.string()), *map(_field, table.columns)])


def packed(table: Table, rows: Sequence[Row], key: str) -> pa.Table:
    """Rows of a run in small whole units; a value that is not finite becomes null.

    Raises:
        OutputError: a value is too large for its column.
    """
    if table.name == "trajectories":
        rows = sorted(rows, key=itemgetter(1))  # by vehicle; in order of time they are already
    wanted = schema_of(table)
    arrays = [pa.array([key] * len(rows), pa.string())]
    for number, column in enumerate(table.columns):
        values: Any = [row[number] for row in rows]
        mask = None
        if column.kind == "float" and column.unit in UNITS:
            scaled = np.rint(np.array(values, dtype=float) * UNITS[column.unit][3])
            mask = ~np.isfinite(scaled)
            if np.any(np.abs(scaled[~mask]) > LARGEST):
                raise OutputError(
                    f"table {table.name}: {column.name} is up to {max(map(abs, np.array(values, float)[~mask])):g} "
                    f"{column.unit}, and tables of sweeps hold {LARGEST / UNITS[column.unit][3]:g} at most; "
                    "declare the column with a larger unit, such as km"
                )
            values = np.where(mask, 0.0, scaled).astype(np.int32)
        arrays.append(pa.array(values, wanted.field(number + 1).type, mask=mask))
    return pa.Table.from_arrays(arrays, schema=wanted)


def writer(target: Any, schema: pa.Schema) -> pq.ParquetWriter:
    """A writer of a table of the sample."""
    numbers = {field.name: "DELTA_BINARY_PACKED" for field in schema if pa.types.is_integer(field.type)}
    texts = [f.name for f in schema if pa.types.is_string(f.type)]
    texts += [f"{f.name}.list.element" for f in schema if pa.types.is_list(f.type)]
    return pq.ParquetWriter(
        target, schema, compression="zstd", use_dictionary=texts, column_encoding=numbers, write_statistics=["key"]
    )


def encoded(recorder: Recorder, key: str) -> dict[str, bytes]:
    """Every table of a run as a Parquet file in memory."""
    files = {}
    for name, table in recorder.tables.items():
        buffer = io.BytesIO()
        with writer(buffer, schema_of(table)) as out:
            out.write_table(packed(table, recorder.rows(name), key))
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
    """Bring the parts of these runs into one file per table, beside what is there already, in the order of the keys."""
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
    with writer(draft, old.schema_arrow if old is not None else pq.read_schema(own[0])) as out:
        for key in sorted(keys):
            part = parts / key / f"{name}.parquet"
            if key in places and old is not None:
                out.write_table(old.read_row_group(places[key]))
            elif part.is_file() and (table := pq.read_table(part)).num_rows:
                out.write_table(table)
    if old is not None:
        old.close()
    draft.replace(merged)
