"""Tables for people: drawn by rich on a terminal, plain lines where the output goes into a file or another program."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence


def on_terminal() -> bool:
    """True while somebody reads the standard output on a terminal."""
    return sys.stdout.isatty()


def show_table(
    columns: Sequence[str], rows: Iterable[Sequence[str]], title: str = "", numbers: Sequence[str] = ()
) -> None:
    """Draw a table on the terminal, as wide as it is.

    Args:
        columns: headings; all empty for a table without.
        rows: as many texts each as there are columns.
        title: above the table.
        numbers: headings of the columns that are aligned to the right.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    look = box.SIMPLE_HEAD if any(columns) else None
    table = Table(title=title or None, title_justify="left", box=look, show_header=any(columns), pad_edge=False)
    for column in columns:
        table.add_column(column, justify="right" if column in numbers else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    Console().print(table)
