"""Document: a TOML file, read once, that knows the line of every key, so that messages can name it.

``tomllib`` does not tell lines. TOML is regular enough to find table headers and keys line by line: what stands inside
a multi-line value is passed over unless it looks like a key, and then only the line of a message would be wrong.

Keys of messages are dotted. Entries of lists go by their ``name`` or by their number from 1: ``vehicle.AUV01.slot``,
``channel.2.per``. A key of a list's entries without either means the first entry that has it.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from missions.errors import ConfigurationError, ConfigurationFault
from worldmodel import suggestion

Location = tuple[str | int, ...]
"""Keys, and places in lists from 0, from the top of a document down to a value."""

HEADER = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
PART = r"""(?:"[^"]*"|'[^']*'|[A-Za-z0-9_-]+)"""
KEY = re.compile(rf"^\s*({PART}(?:\s*\.\s*{PART})*)\s*=")
LINE_OF_SYNTAX = re.compile(r"at line (\d+)")
OTHER_ENCODINGS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}
"""First bytes of files that some editors write."""
LONGEST = 60
"""Characters of a value that a message shows."""


@dataclass(frozen=True)
class Document:
    """A TOML file.

    Args:
        path: what messages call it.
        text: its content.
        raw: its tables, not checked yet.
    """

    path: str
    text: str
    raw: dict[str, Any]

    @classmethod
    def read(cls, name_or_path: str, known: Mapping[str, Path], what: str) -> Document:
        """Read a shipped file by its name, or any file by its path.

        Args:
            name_or_path: a name of ``known``, or a path.
            known: shipped files by name.
            what: what the file is, for messages: "scenario", "study".

        Raises:
            ConfigurationError: there is no such file, it is not UTF-8, or it is not TOML.

        >>> Document.read("quik", {"quick": Path("quick.toml")}, "study")
        Traceback (most recent call last):
        missions.errors.ConfigurationError: quik: study = quik: a TOML file or one of quick; did you mean 'quick'?
        """
        path = Path(name_or_path) if name_or_path.endswith(".toml") else known.get(name_or_path, Path(name_or_path))
        if not is_file(path):
            fault = ConfigurationFault(what, name_or_path, file_or_name(name_or_path, known))
            raise ConfigurationError(name_or_path, [fault])
        return cls.of_text(_text_of(path), str(path))

    @classmethod
    def of_text(cls, text: str, path: str) -> Document:
        """The document that a TOML text is; ``path`` is what messages call it.

        Raises:
            ConfigurationError: it is not TOML.
        """
        try:
            return cls(path, text, tomllib.loads(text))
        except tomllib.TOMLDecodeError as error:
            found = LINE_OF_SYNTAX.search(str(error))
            fault = ConfigurationFault("TOML", "", str(error), int(found[1]) if found else None)
            raise ConfigurationError(path, [fault]) from None

    @cached_property
    def lines(self) -> dict[Location, int]:
        """Line number of every table and key."""
        return lines_of(self.text)

    def line_of(self, key: str) -> int | None:
        """Line of a dotted key, or of the nearest table around it; None if the file has neither."""
        return line_of(location_of(key, self.raw), self.lines)

    def located(
        self, faults: Iterable[ConfigurationFault], options: Mapping[str, str] | None = None
    ) -> list[ConfigurationFault]:
        """Faults in the order of their lines, each with its line or with the option that it was given by.

        Args:
            faults: keys are dotted; one that begins with ``--`` is an option already.
            options: the option that set a dotted key of the document, by key.
        """
        found = [self._located(fault, options or {}) for fault in faults]
        return sorted(found, key=lambda fault: fault.line or 0)

    def _located(self, fault: ConfigurationFault, options: Mapping[str, str]) -> ConfigurationFault:
        if fault.key.startswith("--"):
            return fault
        for key, option in options.items():
            if f"{fault.key}.".startswith(f"{key}.") or f"{key}.".startswith(f"{fault.key}."):
                return replace(fault, key=f"{option} ({fault.key})")
        return fault if fault.line else replace(fault, line=self.line_of(fault.key))

    def error(
        self, faults: Iterable[ConfigurationFault], options: Mapping[str, str] | None = None
    ) -> ConfigurationError:
        """The error to raise, with all faults of the document at once; arguments as for ``located``."""
        return ConfigurationError(self.path, self.located(faults, options))

    def faults_of(
        self,
        error: ValidationError,
        root: type[BaseModel],
        raw: Mapping[str, Any] | None = None,
        passed_over: Collection[str] = (),
    ) -> list[ConfigurationFault]:
        """What pydantic has found wrong, in the words of a TOML file.

        Args:
            error: raised by ``root``.
            root: model of the whole document.
            raw: the tables that were validated, if they are not those of the file.
            passed_over: types of pydantic's errors that are no fault here, such as "extra_forbidden".
        """
        tables = self.raw if raw is None else raw
        details = [detail for detail in error.errors() if detail["type"] not in passed_over]
        return [fault_of(detail, root, tables) for detail in details if not _is_consequence(detail)]


def file_or_name(given: str, known: Iterable[str]) -> str:
    """What is allowed where a file or a shipped name has to be given.

    >>> file_or_name("a", [])
    'a TOML file'
    """
    names = list(known)
    return "a TOML file" + (f" or one of {', '.join(names)}" if names else "") + suggestion(given, names)


def is_file(path: Path) -> bool:
    """True if there is such a file; False too for a name that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _text_of(path: Path) -> str:
    """Text of a UTF-8 file, with or without a byte order mark.

    Raises:
        ConfigurationError: it cannot be read, or has another encoding.
    """
    try:
        content = path.read_bytes()
        if other := OTHER_ENCODINGS.get(content[:2]):
            raise ConfigurationError(
                str(path), [ConfigurationFault("file", "", f"cannot be read: it is {other}; save it as UTF-8")]
            )
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except OSError as error:
        why, line = f"cannot be read: {error}", None
    except UnicodeDecodeError as error:
        why = f"cannot be read: byte {error.object[error.start]:#04x} is not UTF-8; save the file as UTF-8"
        line = content.count(b"\n", 0, error.start) + 1
    raise ConfigurationError(str(path), [ConfigurationFault("file", "", why, line)])


def toml_value(value: Any) -> str:
    """A value on one line of TOML.

    >>> toml_value([0.5, True, {"name": "a b"}, float("inf")])
    '[0.5, true, {"name" = "a b"}, inf]'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml_value(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return json.dumps(value, ensure_ascii=False)
    return str(value)  # dates and times


def shown(value: Any) -> str:
    """A value as a message shows it, cut if it is long."""
    text = toml_value(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def fault_of(detail: Mapping[str, Any], root: type[BaseModel], raw: Mapping[str, Any]) -> ConfigurationFault:
    """One detail of a ValidationError as a fault; where a key is unknown it lists those allowed.

    Args:
        detail: one of ``ValidationError.errors()``.
        root: the model that raised it.
        raw: the tables that were validated.
    """
    location, kind = detail["loc"], detail["type"]
    key = _key_of(location, raw)
    if kind == "missing":
        return ConfigurationFault(key, "", "missing")
    given = shown(detail.get("input"))
    if kind == "extra_forbidden":
        known = _known_keys(location[:-1], root)
        hint = suggestion(str(location[-1]), known)
        return ConfigurationFault(key, given, f"unknown key, allowed here: {', '.join(known)}{hint}")
    message = str(detail["msg"]).replace("tuple", "list").replace("Tuple", "list")
    return ConfigurationFault(key, given, message[0].lower() + message[1:])


def _is_consequence(detail: Mapping[str, Any]) -> bool:
    """True for a list that is only too short because an entry of it is wrong."""
    context = detail.get("ctx", {})
    given = detail.get("input")
    return detail["type"] == "too_short" and isinstance(given, list) and len(given) >= context.get("min_length", 0)


def _key_of(location: Iterable[Any], raw: Any) -> str:
    """``vehicle.AUV01.slot`` for ("vehicle", 2, "slot")."""
    parts: list[str] = []
    for part in location:
        entry = raw[part] if isinstance(raw, dict | list) and _has(raw, part) else None
        if isinstance(part, int):
            parts.append(str(entry["name"]) if isinstance(entry, dict) and "name" in entry else str(part + 1))
        else:
            parts.append(str(part))
        raw = entry
    return ".".join(parts)


def _has(raw: dict[str, Any] | list[Any], part: Any) -> bool:
    return part in raw if isinstance(raw, dict) else isinstance(part, int) and part < len(raw)


def _known_keys(location: Iterable[Any], root: type[BaseModel]) -> list[str]:
    """Keys of the table at ``location``."""
    table: type[BaseModel] = root
    for part in location:
        if isinstance(part, int):
            continue
        annotation: Any = table.model_fields[part].annotation
        candidates = [annotation, *getattr(annotation, "__args__", ())]
        inner = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
        if inner is None:
            return []
        table = inner
    return list(table.model_fields)


def lines_of(text: str) -> dict[Location, int]:
    """Line number of every table and key, entries of lists by index.

    >>> lines_of('[[vehicle]]\\nslot = 1\\n[vehicle.sensor]\\nwidth_m = 2')[("vehicle", 0, "sensor", "width_m")]
    4
    """
    found: dict[Location, int] = {}
    counts: dict[Location, int] = {}
    table: Location = ()
    for number, line in enumerate(text.split("\n"), start=1):
        if header := HEADER.match(line):
            table = _table_location(header[2], header[1] == "[[", counts)
            found.setdefault(table, number)
        elif key := KEY.match(line):
            found.setdefault((*table, *key_parts(key[1])), number)
    return found


def _table_location(dotted: str, is_entry: bool, counts: dict[Location, int]) -> Location:
    """Location of a header: below a list it is the list's last entry that is meant."""
    found: Location = ()
    parts = key_parts(dotted)
    for depth, part in enumerate(parts):
        found = (*found, part)
        if is_entry and depth == len(parts) - 1:
            counts[found] = counts.get(found, 0) + 1
        if found in counts:
            found = (*found, counts[found] - 1)
    return found


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


def location_of(key: str, raw: Mapping[str, Any]) -> Location:
    """Where a dotted key of a message stands in the tables, as far as they have it.

    >>> location_of("vehicle.AUV01.slot", {"vehicle": [{"name": "AUV00"}, {"name": "AUV01", "slot": 2}]})
    ('vehicle', 1, 'slot')
    >>> location_of("channel.per", {"channel": [{"name": "perfect"}, {"name": "bernoulli", "per": 0.1}]})
    ('channel', 1, 'per')
    """
    found: Location = ()
    value: Any = raw
    parts = key_parts(key)
    while parts:
        part = parts.pop(0)
        if isinstance(value, list):
            index = index_of(part, value)
            if index is None:
                if (index := _first_with(part, value)) is None:
                    return found
                parts.insert(0, part)
            found, value = (*found, index), value[index]
        elif isinstance(value, dict):
            while part not in value and parts and any(name.startswith(f"{part}.") for name in value):
                part = f"{part}.{parts.pop(0)}"
            found, value = (*found, part), value.get(part)
        else:
            return found
    return found


def index_of(part: str, entries: Sequence[Any]) -> int | None:
    """Index of the entry with that name or number."""
    for index, entry in enumerate(entries):
        if isinstance(entry, dict) and entry.get("name") == part:
            return index
    return int(part) - 1 if part.isdigit() and 0 < int(part) <= len(entries) else None


def _first_with(key: str, entries: Sequence[Any]) -> int | None:
    """Index of the first entry that has a key."""
    return next((index for index, entry in enumerate(entries) if isinstance(entry, dict) and key in entry), None)


def line_of(location: Location, lines: Mapping[Location, int]) -> int | None:
    """Line of a location: of a key, the name of an entry, the first entry of a list; else of the table around it."""
    while location:
        for nearer in ((*location, "name"), location, (*location, 0)):
            if nearer in lines:
                return lines[nearer]
        location = location[:-1]
    return None
