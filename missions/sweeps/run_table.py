"""Table of runs: one row for every finished run of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pyarrow as pa

from missions.files import toml_value
from missions.sweeps.ledger import MACHINE_COLUMNS, Line


def run_table(lines: Mapping[str, Line]) -> pa.Table:
    """One row per run, sorted by key: key, configuration, summary, what went wrong, which code made it, machine."""
    rows = [lines[key] for key in sorted(lines)]
    columns: dict[str, list[Any]] = {"key": [row["key"] for row in rows], "repeat": [row["repeat"] for row in rows]}
    for name in sorted({name for row in rows for name in row["settings"]}):
        columns[name] = [row["settings"].get(name) for row in rows]
    for name in _merged([list(row["summary"]) for row in rows]):
        columns[name] = [row["summary"].get(name) for row in rows]
    for name in ("status", "error", "replay"):
        columns[name] = [row[name] for row in rows]
    columns["code"] = [row.get("code", "") for row in rows]
    for name in MACHINE_COLUMNS:
        columns[name] = [row["machine"][name] for row in rows]
    return pa.table({name: _array(values) for name, values in columns.items()})


def _merged(fields: Sequence[Sequence[str]]) -> list[str]:
    """Fields of all summaries, those of the longest first: missions differ in them, and failed runs have few."""
    longest = sorted(set(map(tuple, fields)), key=lambda names: (-len(names), names))
    return list(dict.fromkeys(name for names in longest for name in names))


def _array(values: list[Any]) -> pa.Array:
    """A column; text where its values are of several kinds."""
    try:
        array = pa.array(values)
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        return pa.array([None if value is None else toml_value(value) for value in values])
    return array.cast(pa.float64()) if pa.types.is_null(array.type) else array
