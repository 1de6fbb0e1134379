"""Tables of a mission's own as columns: what happened or was measured when, by whom and where."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from visualisation.replay.columns import Columns, Floats
from visualisation.replay.tables import PLACE_STEP_M, TIME_STEP_S, Names

PLACE = ("x_m", "y_m")
DIGITS = 4
"""To so many decimal digits of its span a column of numbers is kept, so that 0.95 stays 0.95."""
MOST_DIGITS = 13
"""Of no number more digits are kept."""


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
    is_number = str(field.type) in ("double", "int64")
    if is_number:
        numbers = np.array([np.nan if value is None else value for value in values], dtype=float)
        is_there = np.isfinite(numbers)
        columns.add(f"{called}.told.{field.name}", np.where(is_there, numbers, 0.0), 1, _step(numbers[is_there]))
        columns.add(f"{called}.lacks.{field.name}", (~is_there).astype(np.int64))
    else:
        columns.add(f"{called}.told.{field.name}", [names.text(_said(value)) for value in values])
    return {"name": field.name, "unit": unit, "isNumber": is_number}


def _step(numbers: Floats) -> float:
    if not numbers.size or np.all(numbers == np.rint(numbers)):
        return 1.0
    span, largest = float(np.ptp(numbers)), float(np.max(np.abs(numbers)))
    return 10.0 ** max(math.floor(math.log10(span or largest)) - DIGITS, math.ceil(math.log10(largest)) - MOST_DIGITS)


def _said(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(_said(one) for one in value)
    return f"{value:.4g}" if isinstance(value, float) and np.isfinite(value) else "" if value is None else str(value)
