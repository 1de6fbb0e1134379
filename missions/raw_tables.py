"""Reading the raw tables of a scenario, which may be malformed: what is not as it should be is passed over."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from missions.errors import ConfigurationFault

Raw = Mapping[str, Any]
Point = tuple[float, float]
Box = tuple[float, float, float, float]


def entries_of(raw: Raw, key: str) -> list[Raw]:
    """Tables of a list of tables."""
    entries = raw.get(key, [])
    return [e for e in entries if isinstance(e, dict)] if isinstance(entries, list) else []


def names_of(raw: Raw, key: str) -> list[str]:
    return [e["name"] for e in entries_of(raw, key) if isinstance(e.get("name"), str)]


def table_of(raw: Raw, key: str) -> Raw:
    table = raw.get(key, {})
    return table if isinstance(table, dict) else {}


def one_of(key: str, given: Any, allowed: Sequence[str]) -> Iterator[ConfigurationFault]:
    """The fault of a name that is not among those allowed, with the nearest."""
    if isinstance(given, str) and given not in allowed:
        nearest = get_close_matches(given, allowed, n=1)
        hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
        yield ConfigurationFault(key, f'"{given}"', f"allowed: {', '.join(allowed) or 'none'}{hint}")


def bounds_m(raw: Raw) -> Box | None:
    """(x_min, y_min, x_max, y_max) of the world."""
    world = table_of(raw, "world")
    try:
        (x_min, x_max), (y_min, y_max) = world["x_m"], world["y_m"]
        return float(x_min), float(y_min), float(x_max), float(y_max)
    except (KeyError, TypeError, ValueError):
        return None


def point_of(entry: Raw, key: str) -> list[Point]:
    """The point as the one entry of a list; an empty list if there is none."""
    try:
        x, y = entry[key]
        return [(float(x), float(y))]
    except (KeyError, TypeError, ValueError):
        return []
