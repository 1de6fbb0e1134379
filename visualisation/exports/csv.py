"""CSV export: one file per table, with units in column names; lists are joined by ``;``."""

from __future__ import annotations

import csv
from pathlib import Path

from visualisation.exports import Counts
from visualisation.exports.voyage import Voyage

BETWEEN = ";"


def write(voyage: Voyage, target: Path) -> Counts:
    """Create a folder with ``<table>.csv`` for every table; see ``Writer``."""
    target.mkdir()
    counts = {}
    for name in voyage.results.tables:
        table = voyage.results.table(name)
        with (target / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
            lines = csv.writer(file)
            lines.writerow(table.column_names)
            for row in zip(*(column.to_pylist() for column in table.columns), strict=True):
                lines.writerow(BETWEEN.join(map(str, value)) if isinstance(value, list) else value for value in row)
        counts[name] = table.num_rows
    return counts
