"""Scenario and study files by shipped name or path, and their values as text; light imports, to fail quickly."""

from __future__ import annotations

import json
import math
import re
import shlex
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard

from missions.errors import LONGEST_VALUE, ConfigurationError, ConfigurationFault, cut
from worldmodel import suggestion

LARGEST_BYTES = 1_000_000  # greatest size of a TOML file; shipped ones have up to 20 kB
MOST_LEVELS = 40
MOST_BITS = 1023  # greatest length of an integer; longer ones do not fit a float
BARE = re.compile(r"[A-Za-z0-9_-]+")
LINE_OF_SYNTAX = re.compile(r"at line (\d+)")
BYTE_ORDER_MARKS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}
SCENARIO, STUDY = "scenario", "study"
COMMANDS = {SCENARIO: "remoras run {file}", STUDY: "remoras sweep {file} --out DIR"}
MISSIONS = Path(__file__).parent


def shipped() -> dict[str, Path]:
    """Shipped scenario files by name: ``mapping/rendezvous.toml`` is ``mapping-rendezvous``."""
    return {f"{path.parent.name}-{path.stem}": path for path in sorted(MISSIONS.glob("*/*.toml"))}


def shipped_abouts() -> dict[str, dict[str, Any]]:
    """Table ``[scenario]`` of each shipped scenario, by name."""
    return {name: tables_of(text_of(path), str(path))[SCENARIO] for name, path in shipped().items()}


def shipped_studies() -> dict[str, Path]:
    """Shipped study files by name."""
    return {path.stem: path for path in sorted(MISSIONS.glob("*/studies/*.toml"))}


def is_study(name_or_path: str) -> bool:
    """Return True for a shipped study, or a TOML file with a table ``[study]``."""
    return name_or_path in shipped_studies() or has_table(name_or_path, STUDY)


def has_table(path: str, name: str) -> bool:
    """Return True for a TOML file with such a table."""
    try:
        return is_file(Path(path)) and name in tables_of(text_of(Path(path), LARGEST_BYTES), path)
    except ConfigurationError:  # reported when it is read as a scenario
        return False


def parsed(text: str) -> dict[str, Any]:
    """Parse a TOML text; ValueError if it is not TOML, nested too deeply, or has too long an integer."""
    too_deep = f"tables or lists within each other more than {MOST_LEVELS} levels deep; no key needs that"
    too_long = "an integer of more than 307 digits; no key needs that"
    try:
        tables = tomllib.loads(text)
    # It is a ValueError too, but its text has the line.
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise ValueError(too_deep) from None
    except ValueError:  # Python's limit on integers of thousands of digits
        raise ValueError(too_long) from None
    level: list[Any] = [tables]
    for _ in range(MOST_LEVELS + 1):
        if any(isinstance(value, int) and value.bit_length() > MOST_BITS for value in level):
            raise ValueError(too_long)
        containers = [
            value.values() if isinstance(value, dict) else value for value in level if isinstance(value, dict | list)
        ]
        level = [inner for container in containers for inner in container]
    if level:
        raise ValueError(too_deep)
    return tables


def tables_of(text: str, path: str) -> dict[str, Any]:
    """Parse a TOML text; raise ConfigurationError, which names ``path``, where ``parsed`` raises ValueError."""
    try:
        return parsed(text)
    except ValueError as error:
        match = LINE_OF_SYNTAX.search(str(error))
        line = int(match[1]) if match else None
        raise ConfigurationError.of(path, "TOML", "", str(error), line) from None


def file_of(kind: str, name_or_path: str, known: Mapping[str, Path]) -> Path:
    """Return the file of a shipped name or a path; ConfigurationError if missing or of the other kind than ``kind``."""
    other = STUDY if kind == SCENARIO else SCENARIO
    path = Path(name_or_path) if name_or_path.endswith(".toml") else known.get(name_or_path, Path(name_or_path))
    if is_file(path):
        return path
    if name_or_path in (shipped() if other == SCENARIO else shipped_studies()):
        raise of_other_kind(name_or_path, other)
    raise ConfigurationError.of(name_or_path, kind, name_or_path, file_or_name(name_or_path, known))


def check_named(name_or_path: str) -> None:
    """Raise ConfigurationError unless the file or shipped name exists."""
    known = [*shipped(), *shipped_studies()]
    if name_or_path not in known and not is_file(Path(name_or_path)):
        allowed = file_or_name(name_or_path, known)
        raise ConfigurationError.of(name_or_path, "scenario or study", name_or_path, allowed)


def of_other_kind(file: str, kind: str, line: int | None = None) -> ConfigurationError:
    """Create the error for a file of the other kind; ``line`` is that of its table."""
    allowed = f"this is a {kind}; start it with: {COMMANDS[kind].format(file=shlex.quote(file))}"
    return ConfigurationError(file, [ConfigurationFault(f"[{kind}]", "", allowed, line)])


def file_or_name(name: str, known: Iterable[str]) -> str:
    """Describe the allowed input: a file or a shipped name, with the name nearest to ``name``."""
    names = list(known)
    if name.endswith(".toml"):
        try:
            asked = Path(name)
            beside = [str(path) for path in asked.parent.glob("*.toml") if suggestion(asked.stem, [path.stem])]
        except (OSError, ValueError):  # an impossible name
            beside = []
        return f"no such file{suggestion(name, sorted(beside))}"
    return "a TOML file" + (f" or one of {', '.join(names)}" if names else "") + suggestion(name, names)


def is_file(path: Path) -> bool:
    """Return True for an existing file; False for impossible names."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_named(text: str) -> bool:
    """Return True for a reference to an object of a module or file, such as ``closeness.py:CLOSEST``."""
    return ":" in text or text.endswith(".py")


OURS = frozenset({"worldmodel", "exchange", "remoras", "missions", "visualisation"})
REFERENCE = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):[A-Za-z_][\w.]*")  # ``package.module:object``


def texts(value: Any) -> Iterator[str]:
    """Yield every string in nested tables and lists."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for entry in value.values() if isinstance(value, dict) else value:
            yield from texts(entry)


def is_reference(text: str) -> bool:
    """Return True for a possible reference to an object of an external module."""
    match = REFERENCE.fullmatch(text)
    return match is not None and match[1].partition(".")[0] not in OURS


def text_of(path: Path, most_bytes: int | None = None) -> str:
    """Read a UTF-8 file; raise ConfigurationError if unreadable, larger than ``most_bytes`` or encoded otherwise."""
    try:
        if most_bytes is not None and (n_bytes := path.stat().st_size) > most_bytes:
            allowed = f"has {n_bytes / 1e6:.1f} MB; allowed: up to {most_bytes / 1e6:g} MB"
            raise ConfigurationError.of(str(path), "file", "", allowed)
        content = path.read_bytes()
        # Before decoding: UTF-16 would be a bad byte without a hint, or a text with null characters.
        if other := _other_encoding(content):
            raise ConfigurationError.of(str(path), "file", "", f"cannot be read: it is {other}; save it as UTF-8")
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except OSError as error:
        why, line = f"cannot be read: {error.strerror or error}", None
    except UnicodeDecodeError as error:
        why = f"cannot be read: byte {error.object[error.start]:#04x} is not UTF-8; save the file as UTF-8"
        line = content.count(b"\n", 0, error.start) + 1
    raise ConfigurationError.of(str(path), "file", "", why, line)


def _other_encoding(content: bytes) -> str:
    if mark := BYTE_ORDER_MARKS.get(content[:2]):
        return mark
    return "UTF-16 or no text" if b"\0" in content[:1000] else ""


def toml_value(value: Any) -> str:
    """Format a value as one line of TOML.

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
        # Strings of TOML use the escapes of JSON.
        return json.dumps(value, ensure_ascii=False)
    return str(value)  # dates and times


def shown(value: Any) -> str:
    """Format a value for a message, shortened."""
    return cut(toml_value(value), LONGEST_VALUE)


def keys_of_options(
    strategy: str | None, policy: str | None, channel: str | None, network: str | None, per: str | float | None
) -> list[tuple[str, str, Any]]:
    """Return (option, scenario key, value) of the given options; a network implies its channel."""
    options = (
        ("strategy", "strategy.name", strategy),
        ("policy", "communication.policy", policy),
        ("channel", "channel.name", channel),
        ("network", "channel.name", None if network is None else "network"),
        ("network", "channel.network", network),
        ("per", "channel.per", per),
    )
    return [option for option in options if option[2] is not None]


def is_number(value: object) -> TypeGuard[float]:
    """True for a finite number; False for a truth value."""
    return type(value) in (int, float) and math.isfinite(value)  # type: ignore[arg-type]


def dotted(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values of nested tables; an empty table is a value. Keys at the top may have dots.

    >>> dict(dotted({"channel": {"per": [0.1]}, "mission.patience_s": [5], "vehicle": {"a b": {"slot": 1}}}))
    {'channel.per': [0.1], 'mission.patience_s': [5], 'vehicle."a b".slot': 1}
    """
    for key, value in table.items():
        part = key if not above or BARE.fullmatch(key) else toml_value(key)
        path = f"{above}.{part}" if above else part
        if isinstance(value, Mapping) and value:
            yield from dotted(value, path)
        else:
            yield path, value


def leaves(value: Any, path: str = "", first: int = 1) -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values of nested tables; lists of tables use entry names, else numbers from ``first``.

    >>> list(leaves({"a": [{"name": "x", "b": [1, 2]}]}))
    [('a.x.name', 'x'), ('a.x.b', [1, 2])]
    """
    if isinstance(value, dict):
        entries: Iterable[tuple[Any, Any]] = value.items()
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        numbered = enumerate(value, first)
        entries = [(entry.get("name", n) if isinstance(entry, dict) else n, entry) for n, entry in numbered]
    else:
        yield path, value
        return
    for name, entry in entries:
        yield from leaves(entry, f"{path}.{name}".removeprefix("."), first)
