"""Notebook display of values: HTML tables, and names for Tab completion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

LONGEST_TEXT = 160
"""Maximum characters of a value."""
MOST_ROWS = 60
"""Maximum rows; a line gives the number of others."""
LIBRARIES = ("builtins", "pydantic", "typing", "abc")
"""Packages with names hidden from completion."""


def card(title: str, rows: Iterable[tuple[str, ...]], note: str = "") -> str:
    """Return HTML with a title, a table of texts and a note.

    >>> card("A & B", [("depth", "12 m")])
    '<div><strong>A &amp; B</strong><table><tr><th style="text-align:left">depth</th><td>12 m</td></tr></table></div>'
    """
    from html import escape  # needed by notebooks only

    listed = [tuple(_cut(text) for text in row) for row in rows]
    more = [f"and {len(listed) - MOST_ROWS} more"] if len(listed) > MOST_ROWS else []
    lines = "".join(_row(*map(escape, row)) for row in listed[:MOST_ROWS])
    notes = "".join(f"<p>{escape(text)}</p>" for text in [*more, *([note] if note else [])])
    return f"<div><strong>{escape(title)}</strong><table>{lines}</table>{notes}</div>"


def _row(first: str, *others: str) -> str:
    style = ' style="text-align:left"'
    return f"<tr><th{style}>{first}</th>{''.join(f'<td>{text}</td>' for text in others)}</tr>"


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 3]}..."


def number_text(value: Any) -> str:
    """Return a value as text; numbers to six digits.

    >>> number_text(1234.56789), number_text(True), number_text(None)
    ('1234.57', 'yes', 'none')
    """
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def own_names(value: object) -> list[str]:
    """Return the public names of a value without inherited library names; dunders stay."""
    kinds = [kind for kind in type(value).__mro__ if kind.__module__.partition(".")[0] not in LIBRARIES]
    fields = set(getattr(type(value), "model_fields", ()))
    names = {name for kind in kinds for name in vars(kind)} | fields
    return sorted(name for name in names if name in fields or _is_offered(name))


def _is_offered(name: str) -> bool:
    if name.startswith("_"):
        return name.endswith("__") and not name.startswith("__pydantic")
    return not name.startswith("model_") and not name.isupper()


class Figures(dict[str, Any]):
    """Figures of a run by name, displayed as a table with units, read only for display."""

    def __init__(self, values: Mapping[str, Any], units: Callable[[], Mapping[str, str]] = dict) -> None:
        super().__init__(values)
        self._units = units

    def _repr_html_(self) -> str:
        units = self._units()
        shown = {name: value for name, value in self.items() if not isinstance(value, list | dict)}
        return card("Figures", ((name, number_text(value), units.get(name, "")) for name, value in shown.items()))


class Records(list[dict[str, Any]]):
    """Records of one kind in order, displayed as a table."""

    def _repr_html_(self) -> str:
        keys = list(self[0]) if self else []
        return card(" · ".join(keys), (tuple(number_text(record[key]) for key in keys) for record in self))
