"""Random alterations of a results folder: of cells, rows, columns and tables."""

import random
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

SHARES = {"cell": 0.7, "row removed": 0.08, "row repeated": 0.06, "rows exchanged": 0.06, "column": 0.05, "table": 0.05}
"""How often each kind of alteration is drawn."""


@dataclass(frozen=True)
class Alteration:
    """What was altered.

    Attributes:
        table, column: where; the column is empty for rows and tables.
        kind: one of ``SHARES``; what: in words.
    """

    table: str
    column: str
    kind: str
    what: str

    @property
    def names(self) -> set[str]:
        """Names by which ``not_checked`` may have it."""
        return {f"{self.table}.{self.column}"} if self.column else {f"rows of {self.table}"}


def alter(folder: Path, table: str, draw: random.Random) -> Alteration:
    """Alter one thing of a table of a folder, which has rows."""
    path = folder / f"{table}.parquet"
    read = pq.read_table(path)
    kind = draw.choices(list(SHARES), list(SHARES.values()))[0]
    if kind == "table":
        path.unlink()
        return Alteration(table, "", kind, "removed")
    column, at = draw.choice(read.column_names), draw.randrange(len(read))
    if kind == "column":
        pq.write_table(read.drop_columns([column]), path)
        return Alteration(table, column, kind, "removed")
    rows = read.to_pylist()
    what = f"row {at}: {rows[at]}"
    if kind == "cell":
        before, after = rows[at][column], _other([row[column] for row in rows], at, draw)
        what, rows[at][column] = f"row {at}: {before!r} becomes {after!r}", after
    elif kind == "row removed":
        del rows[at]
    elif kind == "rows exchanged" and (
        others := [n for n, row in enumerate(rows) if row["time_s"] != rows[at]["time_s"]]
    ):
        other = draw.choice(others)
        rows[at], rows[other] = rows[other], rows[at]
    else:
        rows.insert(at, rows[at])
    pq.write_table(pa.Table.from_pylist(rows, schema=read.schema), path)
    return Alteration(table, column if kind == "cell" else "", kind, what)


def _other(values: list[Any], at: int, draw: random.Random) -> Any:
    """Another value of a cell: one of the column, or one near by."""
    before = values[at]
    others = [value for value in values if _differs(value, before)]
    if others and draw.random() < 0.6:
        return draw.choice(others)
    match before:
        case bool():
            return not before
        case int():
            return before + draw.choice([-3, -2, -1, 1, 2, 3])
        case float():
            return (
                before * (1.0 + draw.choice([-1.0, 1.0]) * draw.uniform(0.02, 0.5)) if before else draw.uniform(0.1, 2)
            )
        case str():
            return f"{before}x" if len(before) < 2 else before[:-2] + before[-1] + before[-2] + "s"
        case list():
            return before[:-1] if before else draw.choice(others or [["x"]])
    return draw.choice(others) if others else 1


def _differs(value: Any, before: Any) -> bool:
    if isinstance(before, float) and isinstance(value, float):
        return abs(value - before) > 0.01 * max(abs(before), 0.1)
    return bool(value != before)
