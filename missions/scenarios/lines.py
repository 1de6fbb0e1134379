"""Where in a TOML text a key stands: messages can name the line.

``tomllib`` does not tell. TOML is regular enough to find table headers and keys line by line: what stands inside a
multi-line value is passed over unless it looks like a key, and then only the line of a message would be wrong.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

Path = tuple[str | int, ...]

HEADER = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
KEY = re.compile(r"""^\s*("[^"]*"|'[^']*'|[A-Za-z0-9_.-]+)\s*=""")


def lines_of(text: str) -> dict[Path, int]:
    """Line number of every table and key, entries of lists by index.

    >>> lines_of('[[vehicle]]\\nslot = 1\\n[vehicle.sensor]\\nswath_m = 2')[("vehicle", 0, "sensor", "swath_m")]
    4
    """
    found: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := HEADER.match(line):
            table = _table_path(header[2], header[1] == "[[", counts)
            found.setdefault(table, number)
        elif key := KEY.match(line):
            found.setdefault((*table, *key_parts(key[1])), number)
    return found


def _table_path(dotted: str, is_entry: bool, counts: dict[Path, int]) -> Path:
    """Path of a header: below a list it is the list's last entry that is meant."""
    path: Path = ()
    parts = key_parts(dotted)
    for depth, part in enumerate(parts):
        path = (*path, part)
        if is_entry and depth == len(parts) - 1:
            counts[path] = counts.get(path, 0) + 1
        if path in counts:
            path = (*path, counts[path] - 1)
    return path


def key_parts(key: str) -> list[str]:
    """Parts of a dotted key; a part in double or single quotes may hold dots.

    >>> key_parts('mission.importance."Performer.RendezVous"')
    ['mission', 'importance', 'Performer.RendezVous']
    """
    parts, quote = [""], ""
    for character in key:
        if character in "\"'" and quote in ("", character):
            quote = "" if quote else character
        elif character == "." and not quote:
            parts.append("")
        else:
            parts[-1] += character
    return [part.strip() for part in parts]


def path_of(key: str, raw: Mapping[str, Any]) -> Path:
    """Path of a dotted key of a message, in which entries of lists go by their names.

    >>> path_of("vehicle.AUV01.slot", {"vehicle": [{"name": "AUV00"}, {"name": "AUV01", "slot": 2}]})
    ('vehicle', 1, 'slot')
    """
    path: Path = ()
    value: Any = raw
    parts = key.split(".")
    while parts:
        part = parts.pop(0)
        if isinstance(value, list):
            index = _index_of(part, value)
            if index is None:
                return path
            path, value = (*path, index), value[index]
        elif isinstance(value, dict):
            while part not in value and parts and any(name.startswith(f"{part}.") for name in value):
                part = f"{part}.{parts.pop(0)}"
            path, value = (*path, part), value.get(part)
        else:
            return path
    return path


def _index_of(part: str, entries: Sequence[Any]) -> int | None:
    for index, entry in enumerate(entries):
        if isinstance(entry, dict) and entry.get("name") == part:
            return index
    return int(part) - 1 if part.isdigit() and 0 < int(part) <= len(entries) else None


def line_of(path: Path, lines: Mapping[Path, int]) -> int | None:
    """Line of the path: of a key, the name of an entry, the first entry of a list; else of the table around it."""
    while path:
        for nearer in ((*path, "name"), path, (*path, 0)):
            if nearer in lines:
                return lines[nearer]
        path = path[:-1]
    return None
