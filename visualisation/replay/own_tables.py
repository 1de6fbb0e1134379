"""Tables of a mission's own as columns: what happened or was measured when, by whom and where."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from visualisation.replay.columns import Columns, Floats, Ints
from visualisation.replay.tables import PLACE_STEP_M, TIME_STEP_S, Names

PLACE = ("x_m", "y_m")
SPARED_BITS = 8
"""Of a number as 32-bit float so many of its last bits are not kept: four digits are left, whatever its size."""
LARGEST = 3e38
"""Numbers beyond are kept as this."""
EXACT = 2**52
"""From here on the page may add differences inexactly, so that the numbers behind a large one would be wrong."""
KINDS = {"double": "float", "int64": "int"}
"""Kinds of columns of numbers by their types in Arrow; all others are texts."""


def add_own(columns: Columns, names: Names, table: Any, called: str, most_rows: int) -> dict[str, Any]:
    """Columns of a table with a time, ``layer.called.column``; returns what is needed to read them.

    Args:
        columns: take them.
        names: of the vehicles.
        table: Arrow table with a column ``time_s``.
        called: name of the table.
        most_rows: of more rows the first are taken.
    """
    rows = table.slice(0, most_rows).to_pylist()
    kept = PLACE if set(PLACE) <= {*table.column_names} else ()
    columns.add(f"layer.{called}.time", [row["time_s"] for row in rows], 1, TIME_STEP_S)
    columns.add(f"layer.{called}.vehicle", [names.vehicle(row.get("vehicle")) for row in rows])
    for column in kept:
        columns.add(f"layer.{called}.{column}", [row[column] for row in rows], 1, PLACE_STEP_M)
    told = [
        _add_told(columns, names, f"layer.{called}", field, [row[field.name] for row in rows])
        for field in table.schema
        if field.name not in ("time_s", "vehicle", *kept)
    ]
    return {"name": called, "n": len(rows), "total": table.num_rows, "has_places": bool(kept), "columns": told}


def _add_told(columns: Columns, names: Names, called: str, field: Any, values: Sequence[Any]) -> dict[str, Any]:
    """A column of a mission's own: numbers, and where they are missing; else texts."""
    unit = (field.metadata or {}).get(b"unit", b"").decode()
    kind = KINDS.get(str(field.type), "text")
    if kind == "text":
        columns.add(f"{called}.told.{field.name}", [names.text(_said(value)) for value in values])
    else:
        numbers = np.array([np.nan if value is None else value for value in values], dtype=float)
        is_there = np.isfinite(numbers)
        numbers = np.where(is_there, numbers, 0.0)
        whole = _bits(numbers) if kind == "float" else numbers
        order = 1 if np.max(np.abs(whole), initial=0) < EXACT else 0
        columns.add(f"{called}.told.{field.name}", whole, order)
        columns.add(f"{called}.lacks.{field.name}", (~is_there).astype(np.int64))
    return {"name": field.name, "unit": unit, "kind": kind}


def _bits(numbers: Floats) -> Ints:
    """Numbers as 32-bit floats without their last bits: neighbours are alike, and none depends on the others."""
    bits = numbers.clip(-LARGEST, LARGEST).astype(np.float32).view(np.int32).astype(np.int64)
    return (bits + (1 << SPARED_BITS - 1)) >> SPARED_BITS


def _said(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(_said(part) for part in value)
    return f"{value:.4g}" if isinstance(value, float) and np.isfinite(value) else "" if value is None else str(value)
