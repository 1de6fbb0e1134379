"""Tables of a run as Arrow and Parquet.

Numbers are quantised to a power of two, such as 1/128 m: they stay ordinary floats, with meaningless digits zero, and
compress well as byte streams under zstd. Joules are integers, stored as differences. Trajectories are sorted by vehicle
for the same reason.

A run's folder has one file per table. A sweep's file holds the sampled runs in order of their keys, in the first
column. Runs share row groups, so that common content, such as slot times, and metadata are stored once. During a sweep
each run is an archive of its own, a part; at the end the parts are merged.
"""

from __future__ import annotations

import heapq
import io
import shutil
import zipfile
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from numbers import Integral, Real
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from missions.disk import DIGESTS, drafted, note_digests, synced
from missions.errors import OutputError
from remoras.recorder import KEY, TRAJECTORIES, Recorder, Row, Table

_VALUES: dict[str, tuple[type, ...]] = {
    "float": (Real,), "int": (Integral,), "str": (str,), "bool": (bool, np.bool_),
    "list": (list, tuple), "floats": (list, tuple), "ints": (list, tuple),
}  # fmt: skip
"""Types of the values of a column by its kind, besides None."""
_ENTRIES = {"list": "str", "floats": "float", "ints": "int"}
"""Kind of the entries of lists."""
_ARROW = {"str": pa.string(), "bool": pa.bool_(), "int": pa.int64()}
"""Arrow type of a column by its kind, where no number is quantised."""


def column_array(values: Sequence[Any], kind: str, unit: str = "") -> pa.Array:
    """Convert values to an Arrow array, quantised; a wrong type raises TypeError or ValueError."""
    for cls in set(map(type, values)) - {type(None)}:
        if not issubclass(cls, _VALUES[kind]) or (cls is bool and kind != "bool"):
            raise TypeError(f"{cls.__name__} in a column of kind {kind}")
    if kind in _ARROW:
        return pa.array(values, _ARROW[kind])
    missing = np.fromiter((value is None for value in values), bool, len(values))
    if kind in _ENTRIES:
        lists = [value or () for value in values]
        entries = column_array(list(chain.from_iterable(lists)), _ENTRIES[kind], unit)
        ends = pa.array(np.cumsum([0, *map(len, lists)]), pa.int32())
        return pa.ListArray.from_arrays(ends, entries, mask=pa.array(missing) if missing.any() else None)
    numbers = np.fromiter((np.nan if value is None else value for value in values), np.float64, len(values))
    return _quantised(numbers, unit, missing)


STEPS = {"s": 2.0**-12, "m": 2.0**-7, "rad": 2.0**-10, "m/s": 2.0**-10}
"""Quantisation step by unit, far below any meaningful difference."""
WHOLE = frozenset({"J"})
"""Units stored as integers; non-finite values become null."""
DIGITS = {"1": 6}
"""Decimals of numbers without unit, so that 0.95 stays 0.95."""
UNLIKE = frozenset({"uid", "value", "item_uids", "status_uids"})
"""Columns whose texts rarely repeat; others use a dictionary."""
LEVEL = 6
"""zstd level: a twentieth smaller than the default, for a hundredth of a run's time."""
GROUP_ROWS = 2**17
"""Row-group size from which the next run starts a new group: one page per column."""


def _quantised(numbers: npt.NDArray[np.float64], unit: str, missing: npt.NDArray[np.bool_]) -> pa.Array:
    """Quantise numbers; missing and non-finite ones stay, or become null among integers."""
    if unit in WHOLE:
        return pa.array(np.rint(numbers), mask=~np.isfinite(numbers)).cast(pa.int64())
    if unit in STEPS:
        numbers = np.rint(numbers / STEPS[unit]) * STEPS[unit] + 0.0
    elif unit in DIGITS:
        numbers = np.round(numbers, DIGITS[unit])
    return pa.array(numbers, mask=missing)


def arrow_table(table: Table, rows: Sequence[Row], key: str = "") -> pa.Table:
    """Convert rows to an Arrow table, with units in metadata and a run ``key`` as first column.

    Raises OutputError for a row that does not fit the declared columns.
    """
    fields, arrays = [], []
    if key:
        fields, arrays = [pa.field(KEY, pa.string())], [column_array([key] * len(rows), "str")]
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


def recorded_table(recorder: Recorder, name: str) -> pa.Table:
    """Return a table of a run as results store it."""
    return arrow_table(recorder.tables[name], recorder.rows(name))


def table_writer(target: Any, schema: pa.Schema) -> pq.ParquetWriter:
    """Return a Parquet writer with encodings for this schema."""
    encodings, texts = {}, []
    for field in schema:
        kind, path = field.type, field.name
        if pa.types.is_list(kind):
            kind, path = kind.value_type, f"{path}.list.element"
        if pa.types.is_floating(kind):
            encodings[path] = "BYTE_STREAM_SPLIT"
        elif pa.types.is_integer(kind):
            encodings[path] = "DELTA_BINARY_PACKED"
        elif pa.types.is_string(kind) and field.name not in UNLIKE:
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
    with table_writer(target, table.schema) as out:
        out.write_table(table)


def write_runs(target: Any, schema: pa.Schema, runs: Iterable[pa.Table]) -> None:
    """Write a Parquet file of runs in key order; its row groups hold whole runs."""
    with table_writer(target, schema) as out:
        group: list[pa.Table] = []
        n_rows = 0
        for table in runs:
            group.append(table)
            n_rows += table.num_rows
            if n_rows >= GROUP_ROWS:
                _write_group(out, group)
                group, n_rows = [], 0
        _write_group(out, group)


def _write_group(out: pq.ParquetWriter, runs: Sequence[pa.Table]) -> None:
    if runs:
        together = pa.concat_tables(runs)
        out.write_table(together, row_group_size=max(1, together.num_rows))


def encoded(recorder: Recorder, key: str) -> bytes:
    """Return all tables of a run as Parquet files in a ZIP archive; its checksums show damage."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as files:
        for name, table in recorder.tables.items():
            content = io.BytesIO()
            write_table(content, arrow_table(table, recorder.rows(name), key))
            files.writestr(zipfile.ZipInfo(name), content.getvalue())  # without a date: equal runs have equal bytes
    return archive.getvalue()


def decoded(archive: Path | io.BytesIO, names: Collection[str] | None = None) -> dict[str, pa.Table]:
    """Return tables of an archive by name, all or some; none if it is damaged."""
    try:
        with zipfile.ZipFile(archive) as files:
            wanted = [name for name in files.namelist() if names is None or name in names]
            return {name: pq.read_table(io.BytesIO(files.read(name))) for name in wanted}
    except (pa.ArrowException, OSError, zipfile.BadZipFile):
        return {}


def _names_in(archive: Path) -> list[str]:
    with suppress(zipfile.BadZipFile), zipfile.ZipFile(archive) as files:
        return files.namelist()
    return []


def keys_in(parts: Path, tables: Path) -> set[str]:
    """Return the keys of runs with tables, in readable parts or merged."""
    keys = {part.stem for part in parts.glob("[!.]*.zip") if decoded(part)}
    for path in sorted(tables.glob("[!.]*.parquet")):
        keys.update(pc.unique(pq.read_table(path, columns=[KEY]).column(KEY)).to_pylist())
    return keys


def merge_tables(parts: Path, tables: Path, keys: Collection[str]) -> None:
    """Merge the parts of these runs into one file per table, in key order, with existing runs.

    ``parts`` has an archive per run, named by its key. Raises OutputError, and keeps the parts, if columns differ.
    """
    if not parts.is_dir():
        return
    tables.mkdir(exist_ok=True)
    (tables / DIGESTS).unlink(missing_ok=True)
    own = {key: path for key in sorted(keys) if (path := parts / f"{key}.zip").is_file()}
    written = {name for path in own.values() for name in _names_in(path)}
    for name in sorted(written | {path.stem for path in tables.glob("[!.]*.parquet")}):
        _merge_table(tables / f"{name}.parquet", own, keys)
    note_digests(tables, "[!.]*.parquet")
    synced(tables, parts.parent)
    shutil.rmtree(parts)


def _merge_table(merged: Path, parts: Mapping[str, Path], keys: Collection[str]) -> None:
    old = pq.ParquetFile(merged) if merged.is_file() else None
    own = ((key, table) for key, path in parts.items() for table in decoded(path, [merged.stem]).values())
    first = next(own, None)
    schema: Any = old.schema_arrow if old is not None else first[1].schema if first else None

    def new() -> Iterator[tuple[str, pa.Table]]:
        for key, table in chain([first] if first else [], own):
            if not table.schema.equals(schema):
                raise OutputError(
                    f"{merged}: has the columns {', '.join(schema.names)}, and run {key} has others: another version "
                    f"wrote one of them; move {merged.name} elsewhere and run the sweep again"
                )
            yield key, table

    before = _runs_of(old) if old is not None else iter(())
    with drafted(merged, lasts=True) as draft:
        write_runs(draft, schema, _each_once(heapq.merge(before, new(), key=itemgetter(0)), keys))
        if old is not None:
            old.close()


def _runs_of(file: pq.ParquetFile) -> Iterator[tuple[str, pa.Table]]:
    for number in range(file.num_row_groups):
        group, begin = file.read_row_group(number), 0
        for counted in pc.value_counts(group.column(KEY)).to_pylist():  # in order of appearance
            yield counted["values"], group.slice(begin, counted["counts"])
            begin += counted["counts"]


def _each_once(runs: Iterable[tuple[str, pa.Table]], keys: Collection[str]) -> Iterator[pa.Table]:
    """Yield the non-empty tables of these runs; of several with one key the first."""
    last = ""
    for key, table in runs:
        if key != last and key in keys and table.num_rows:
            yield table
        last = key
