"""TOML file with the line of every key, for error messages. Entries of lists have their ``name`` or number from 1."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, get_args

import tomli_w
from pydantic import BaseModel, ValidationError

from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import LARGEST_BYTES, SCENARIO, STUDY, file_of, of_other_kind, shown, tables_of, text_of
from remoras.table import BETWEEN_KEYS
from worldmodel import suggestion

Model = TypeVar("Model", bound=BaseModel)
Location = tuple[str | int, ...]  # keys and list indices (from 0) from the top of a document to a value

HEADER = re.compile(r"^\s*(\[\[?)\s*([^\]\s](?:[^\]]*[^\]\s])?)\s*\]\]?\s*(#.*)?$")
PART = r"""(?:"[^"]*"|'[^']*'|[A-Za-z0-9_-]+)"""
KEY = re.compile(rf"^\s*({PART}(?:\s*\.\s*{PART})*)\s*=")


@dataclass(frozen=True)
class Document:
    """A TOML file named ``path`` in messages; ``raw`` is unchecked, ``parts`` are its includes."""

    path: str
    text: str
    raw: dict[str, Any]
    parts: tuple[Document, ...] = ()

    @classmethod
    def read(cls, name_or_path: str, known: Mapping[str, Path], what: str) -> Document:
        """Read a shipped file by name, or any file by path; ConfigurationError if missing or of the other kind."""
        path = file_of(what, name_or_path, known)
        document = cls.at(path)
        other = STUDY if what == SCENARIO else SCENARIO
        if other in document.raw and what not in document.raw:
            raise of_other_kind(name_or_path, other, document.lines.get((other,)))
        return document

    @classmethod
    def of_text(cls, text: str, path: str) -> Document:
        """Parse a TOML text; raise ConfigurationError, which names ``path``, as ``tables_of``."""
        return cls(path, text, tables_of(text, path))

    @classmethod
    def at(cls, path: Path) -> Document:
        """Read a file of up to ``LARGEST_BYTES``; raise ConfigurationError as ``text_of`` and ``of_text``."""
        return cls.of_text(text_of(path, LARGEST_BYTES), str(path))

    @classmethod
    def of_tables(cls, tables: Mapping[str, Any], path: str) -> Document:
        """Return tables as a document, named ``path`` in messages."""
        return cls.of_text(tomli_w.dumps(tables), path)

    @cached_property  # the whole text, read for each fault
    def lines(self) -> dict[Location, int]:
        """Line number of every table and key."""
        return lines_of(self.text)

    def line_of(self, key: str) -> int | None:
        """Line of a dotted key, or of the nearest enclosing table; None without either."""
        return line_of(location_of(key, self.raw), self.lines)

    def holds(self, key: str) -> bool:
        """Return True if the file has the table of a dotted key."""
        first, *others = key_parts(key)
        table = self.raw.get(first)
        return others[0] in table if isinstance(table, dict) and others else table is not None

    def located(
        self, faults: Iterable[ConfigurationFault], options: Mapping[str, str] | None = None
    ) -> list[ConfigurationFault]:
        """Return faults sorted by line, each with its line or the option that set its key (``options``, by key)."""
        located = [self._located(fault, options or {}) for fault in faults]
        return sorted(located, key=lambda fault: (fault.file or "", fault.line or 0))

    def _located(self, fault: ConfigurationFault, options: Mapping[str, str]) -> ConfigurationFault:
        if fault.key.startswith("--"):
            return fault
        # A check between tables reports its key alone; the file has the value.
        if not fault.given and fault.allowed != "missing":
            fault = replace(fault, given=self._given(fault.key))
        for key, option in options.items():
            # An option may set the whole table of a faulty key, or one key of a faulty table.
            if f"{fault.key}.".startswith(f"{key}.") or f"{key}.".startswith(f"{fault.key}."):
                return replace(fault, key=f"{option} ({fault.key})")
        if fault.line:
            return fault
        part = next((part for part in self.parts if part.holds(fault.key)), None)
        if part is None:
            return replace(fault, line=self.line_of(fault.key))
        return replace(fault, line=part.line_of(fault.key), file=part.path)

    def _given(self, key: str) -> str:
        location = location_of(key, self.raw)
        value = _value_at(location, self.raw)
        is_value = len(location) == len(key_parts(key)) and value is not None and not isinstance(value, dict)
        is_tables = isinstance(value, list) and any(isinstance(entry, dict) for entry in value)
        return shown(value) if is_value and not is_tables and value != [] else ""

    def error(
        self, faults: Iterable[ConfigurationFault], options: Mapping[str, str] | None = None
    ) -> ConfigurationError:
        """Create the error with all faults; arguments as for ``located``."""
        return ConfigurationError(self.path, self.located(faults, options))

    def values(self, model: type[Model], tables: Mapping[str, Any] | None = None) -> Model:
        """Return the tables (``raw`` if None) as values; raise ConfigurationError with all faults."""
        values, faults = validated(model, self.raw if tables is None else tables)
        if values is None:
            raise self.error(faults)
        return values


def validated(
    model: type[Model], raw: Mapping[str, Any], passes_over_unknown: bool = False
) -> tuple[Model | None, list[ConfigurationFault]]:
    """Return the tables as values, or None with all faults; ``passes_over_unknown`` ignores unknown keys."""
    try:
        # By way of JSON: in strict mode pydantic refuses a list of TOML for a tuple, but not an array of JSON.
        return model.model_validate_json(json.dumps(raw, default=str), strict=True), []
    except ValidationError as error:
        details = error.errors()
    unknown = [detail["loc"] for detail in details if detail["type"] == "extra_forbidden"]
    if passes_over_unknown and unknown:
        tables = deepcopy(dict(raw))
        for *above, key in unknown:
            _value_at(above, tables).pop(key, None)  # default None: groups may share a table
        return validated(model, tables, passes_over_unknown)
    return None, [fault_of(detail, model, raw) for detail in details if not _is_consequence(detail)]


def _value_at(location: Iterable[Any], raw: Any) -> Any:
    for part in location:
        raw = _inside(raw, part)
    return raw


def _inside(raw: Any, part: Any) -> Any:
    """Value of a key of a table, or of an index of a list; None if missing."""
    if isinstance(raw, dict):
        return raw.get(part)
    return raw[part] if isinstance(raw, list) and isinstance(part, int) and part < len(raw) else None


def fault_of(detail: Mapping[str, Any], root: type[BaseModel], raw: Mapping[str, Any]) -> ConfigurationFault:
    """Convert an entry of ``ValidationError.errors()``; unknown keys list the allowed ones."""
    location, kind = detail["loc"], detail["type"]
    key = _key_of(location, raw)
    if kind == "missing":
        return ConfigurationFault(key, "", "missing")
    value = _value_at(location, raw)
    text = shown(detail.get("input") if value is None else value)
    if kind == BETWEEN_KEYS:
        return ConfigurationFault(key, "" if value is None else text, str(detail["msg"]))
    if kind == "extra_forbidden":
        table = _table_at(location[:-1], root, raw)
        if allowed := getattr(table, "unknown", lambda _: "")(location[-1]):
            return ConfigurationFault(key, text, allowed)
        known = [] if table is None else list(table.model_fields)
        hint = suggestion(str(location[-1]), known)
        return ConfigurationFault(key, text, f"unknown key, allowed here: {', '.join(known)}{hint}")
    if kind == "string_pattern_mismatch":  # the only pattern is that of names
        allowed = "allowed: 1 to 40 characters, none of them . / \\ or a control character, and none of = + - @ first"
        return ConfigurationFault(key, text, allowed)
    # TOML has lists, no tuples.
    message = str(detail["msg"]).replace("tuple", "list").replace("Tuple", "list").removeprefix("Value error, ")
    message = message.replace(" after validation", "")
    if kind in {"model_type", "dict_type"}:
        message = "input should be a table"
    if kind in {"float_type", "int_type"} and isinstance(value, str):
        message += ", without quotes, unit or %"
    bounds = detail.get("ctx", {})
    is_share = 1.0 in (bounds.get("lt"), bounds.get("le")) and not key.endswith("_s")
    if is_share and isinstance(value, int | float) and 2.0 <= value <= 100.0:
        message += f"; {value:g} % is {value / 100.0:g}"
    return ConfigurationFault(key, text, message[0].lower() + message[1:])


def _is_consequence(detail: Mapping[str, Any]) -> bool:
    # With an invalid entry left out, pydantic also counts the list as too short.
    context = detail.get("ctx", {})
    value = detail.get("input")
    return detail["type"] == "too_short" and isinstance(value, list) and len(value) >= context.get("min_length", 0)


def _key_of(location: Iterable[Any], raw: Any) -> str:
    parts: list[str] = []
    for part in location:
        entry = _inside(raw, part)
        if isinstance(part, int):
            name = entry.get("name") if isinstance(entry, dict) else None
            parts.append(name if isinstance(name, str) else str(part + 1))
        else:
            parts.append(str(part))
        raw = entry
    return ".".join(parts)


def _table_at(location: Iterable[Any], root: type[BaseModel], raw: Any) -> type[BaseModel] | None:
    """Model of the table at ``location``, by its own kind if it names one; None if missing."""
    table: type[BaseModel] = root
    for part in location:
        raw = _inside(raw, part)
        if isinstance(part, int):
            table = getattr(table, "fitting", lambda _, known=table: known)(raw or {})
            continue
        if part not in table.model_fields:  # name of a subtable: modem.own
            continue
        if (inner := table_within(table.model_fields[part].annotation)) is None:
            return None
        table = inner
    return table


def table_within(annotation: Any) -> type[BaseModel] | None:
    """Model of the table that an annotation names, alone or among others; None without one."""
    alternatives = annotation, *get_args(annotation)
    return next((kind for kind in alternatives if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def lines_of(text: str) -> dict[Location, int]:
    """Line number of every table and key, list entries by index, as in ``("vehicle", 0, "sensor", "width_m")``."""
    lines: dict[Location, int] = {}
    counts: dict[Location, int] = {}
    table: Location = ()
    # A line in a multi-line text may look like a key: that can only make the line of a message wrong.
    for number, line in enumerate(text.split("\n"), start=1):
        if header := HEADER.match(line):
            table = _table_location(header[2], header[1] == "[[", counts)
            lines.setdefault(table, number)
        elif key := KEY.match(line):
            lines.setdefault((*table, *key_parts(key[1])), number)
    return lines


def _table_location(dotted: str, is_entry: bool, counts: dict[Location, int]) -> Location:
    location: Location = ()
    parts = key_parts(dotted)
    for depth, part in enumerate(parts):
        location = (*location, part)
        if is_entry and depth == len(parts) - 1:
            counts[location] = counts.get(location, 0) + 1
        if location in counts:
            location = (*location, counts[location] - 1)
    return location


def key_parts(key: str) -> list[str]:
    """Parts of a dotted key; quoted parts may contain dots.

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


def location_of(key: str, raw: Mapping[str, Any]) -> Location:
    """Location of a dotted key in the tables, as far as it exists.

    >>> location_of("vehicle.AUV01.slot", {"vehicle": [{"name": "AUV00"}, {"name": "AUV01", "slot": 2}]})
    ('vehicle', 1, 'slot')
    """
    location: Location = ()
    value: Any = raw
    parts = key_parts(key)
    while parts:
        part = parts.pop(0)
        if isinstance(value, list):
            index = index_of(part, value)
            if index is None:
                # A key of the list itself, without an entry, means the first entry that has it.
                having = [n for n, entry in enumerate(value) if isinstance(entry, dict) and part in entry]
                if not having:
                    return location
                index = having[0]
                parts.insert(0, part)
            location, value = (*location, index), value[index]
        elif isinstance(value, dict):
            # Keys of faults are unquoted: a name with dots spans several parts.
            while part not in value and parts and any(name.startswith(f"{part}.") for name in value):
                part = f"{part}.{parts.pop(0)}"
            location, value = (*location, part), value.get(part)
        else:
            return location
    return location


def index_of(part: str, entries: Sequence[Any]) -> int | None:
    """Index of the entry with that name or number."""
    for index, entry in enumerate(entries):
        if isinstance(entry, dict) and entry.get("name") == part:
            return index
    return int(part) - 1 if part.isdigit() and 0 < int(part) <= len(entries) else None


def line_of(location: Location, lines: Mapping[Location, int]) -> int | None:
    """Line of a key, an entry's name or a list's first entry; else of the enclosing table."""
    while location:
        for nearer in ((*location, "name"), location, (*location, 0)):
            if nearer in lines:
                return lines[nearer]
        location = location[:-1]
    return None
