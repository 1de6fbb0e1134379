"""Reading a scenario: from a shipped name or a TOML file, with overrides, checked whole.

``load`` reports every fault of a file at once, each with file, line, key, what was given and what is allowed.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios.channel import leave_aside
from missions.scenarios.checks import cross_faults, job_faults
from missions.scenarios.copies import with_copies
from missions.scenarios.lines import Path as Path_
from missions.scenarios.lines import key_parts, line_of, lines_of, path_of
from missions.scenarios.parts import mission_class, sensor_kind, sensor_settings
from missions.scenarios.scenario import Scenario
from missions.scenarios.tables import Raw, Table, entries, table_of
from remoras.errors import PluginError
from remoras.mission import Mission
from worldmodel import suggestion


def shipped() -> dict[str, Path]:
    """Scenario files that come with the package, by name: ``mapping/rendezvous.toml`` is ``mapping-rendezvous``."""
    folder = Path(str(resources.files("missions")))
    return {f"{path.parent.name}-{path.stem}": path for path in sorted(folder.glob("*/*.toml"))}


def load(name_or_path: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """The scenario of a shipped name or a TOML file, with overrides applied.

    Args:
        name_or_path: a name of ``shipped()`` or a path.
        overrides: (where it comes from, ``KEY=VALUE``), for example ("--set", "decision.weight_external=0").

    Returns:
        A ``Scenario``, of the subclass that its mission names.

    Raises:
        ConfigurationError: with every fault of the file and the overrides.
    """
    path, text = _read(name_or_path)
    return load_text(text, path, overrides)


def load_text(text: str, path: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """The scenario of a TOML text that came from ``path``; see ``load``."""
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(path, [ConfigurationFault("TOML", "", str(error))]) from None
    own_channel = dict(table_of(raw, "channel"))
    faults = [fault for option, text_ in overrides if (fault := _override(raw, option, text_)) is not None]
    options = {".".join(key_parts(text_.partition("=")[0].strip())): option for option, text_ in overrides}
    faults += leave_aside(own_channel, raw, options)
    copies = with_copies(raw)
    faults += copies.faults
    mission, more = _mission_of(copies.raw)
    faults += more
    scenario, more = _validated(copies.raw, mission)
    faults += more
    known = {(fault.key, fault.given) for fault in faults}
    faults += [fault for fault in cross_faults(copies.raw, mission) if (fault.key, fault.given) not in known]
    if not faults and scenario is not None and mission is not None:
        faults += job_faults(scenario, mission)
    if faults or scenario is None:
        lines = lines_of(text)
        located = [_located(fault, raw, lines, options) for fault in copies.attributed(faults)]
        raise ConfigurationError(path, sorted(located, key=lambda fault: fault.line or 0))
    return scenario.model_copy(update={"fleet": None})


def _mission_of(raw: Raw) -> tuple[type[Mission] | None, list[ConfigurationFault]]:
    """The class of the mission, or what is wrong with its name."""
    reference = table_of(raw, "scenario").get("mission")
    if not isinstance(reference, str):
        return None, []  # reported as a missing or malformed key
    try:
        return mission_class(reference), []
    except PluginError as error:
        return None, [ConfigurationFault("scenario.mission", f'"{reference}"', str(error))]


def _validated(raw: Raw, mission: type[Mission] | None) -> tuple[Scenario | None, list[ConfigurationFault]]:
    """The tables as values, or the faults of single values; keys that an unknown mission may have are passed over."""
    model: type[Scenario] = Scenario if mission is None else mission.Scenario
    faults: list[ConfigurationFault] = []
    for vehicle in entries(raw, "vehicle"):
        tables = vehicle.get("sensor", [])
        for number, table in enumerate([tables] if isinstance(tables, dict) else tables, 1):
            if isinstance(table, dict) and mission is not None:
                key = f"vehicle.{vehicle.get('name')}.sensor" + ("" if isinstance(tables, dict) else f".{number}")
                faults += _sensor_faults(key, table, mission)
    try:
        return model.model_validate_json(json.dumps(raw, default=str), strict=True), faults
    except ValidationError as error:
        details = [d for d in error.errors() if not _is_consequence(d)]
        if mission is None:
            details = [d for d in details if d["type"] != "extra_forbidden"]
        return None, faults + [_fault_of(detail, raw, model) for detail in details]


def _sensor_faults(key: str, table: Raw, mission: type[Mission]) -> list[ConfigurationFault]:
    try:
        found = sensor_settings(table, mission.sensors)
    except PluginError as error:
        return [ConfigurationFault(f"{key}.type", json.dumps(table.get("type", "")), str(error))]
    if not isinstance(found, ValidationError):
        return []
    kind = sensor_kind(str(table.get("type", "")), mission.sensors)
    faults = [_fault_of(detail, table, kind) for detail in found.errors()]
    return [ConfigurationFault(f"{key}.{fault.key}", fault.given, fault.allowed) for fault in faults]


def _read(name_or_path: str) -> tuple[str, str]:
    path = Path(name_or_path)
    known = shipped()
    if path.suffix != ".toml" and name_or_path in known:
        path = known[name_or_path]
    if not _is_file(path):
        allowed = f"a TOML file or one of {', '.join(known)}{suggestion(name_or_path, known)}"
        raise ConfigurationError(name_or_path, [ConfigurationFault("scenario", name_or_path, allowed)])
    try:
        return str(path), path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(str(path), [ConfigurationFault("file", "", f"cannot be read: {error}")]) from None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False


def _override(raw: dict[str, Any], option: str, override: str) -> ConfigurationFault | None:
    """Apply ``decision.weight_external=0`` or ``vehicle.AUV01.survey_speed_mps=1.7``; entries of lists by name."""
    key, equals, value = override.partition("=")
    if not equals or not key:
        return ConfigurationFault(option, override, "KEY=VALUE, for example decision.weight_external=0")
    target: Any = raw
    parts = key_parts(key.strip())
    for depth, part in enumerate(parts[:-1]):
        if isinstance(target, list):
            found = [entry for entry in target if isinstance(entry, dict) and entry.get("name") == part]
            if not found:
                names = [str(entry.get("name")) for entry in target if isinstance(entry, dict)]
                return ConfigurationFault(f"{option} {key}", "", f"{part!r} is none of {', '.join(names)}")
            target = found[0]
        else:
            target = target.setdefault(part, {})
        if not isinstance(target, dict | list):
            return ConfigurationFault(f"{option} {key}", "", f"{'.'.join(parts[: depth + 1])} is no table")
    if not isinstance(target, dict):
        return ConfigurationFault(f"{option} {key}", "", "names a list: add the name of an entry and a key")
    target[parts[-1]] = _value(value.strip())
    return None


def _value(text: str) -> Any:
    """A value as TOML has it; a bare word is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _fault_of(detail: Mapping[str, Any], raw: Raw, model: type[BaseModel]) -> ConfigurationFault:
    location = detail["loc"]
    key = _key_of(location, raw)
    kind, given = detail["type"], detail.get("input")
    if kind == "extra_forbidden":
        known = _known_keys(location[:-1], model)
        hint = suggestion(str(location[-1]), known)
        return ConfigurationFault(key, _shown(given), f"unknown key, allowed here: {', '.join(known)}{hint}")
    if kind == "missing":
        return ConfigurationFault(key, "", "missing")
    message = str(detail["msg"])
    return ConfigurationFault(key, _shown(given), message[0].lower() + message[1:])


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


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


def _known_keys(location: Iterable[Any], model: type[BaseModel]) -> list[str]:
    """Keys of the table at ``location``."""
    table: Any = model
    for part in location:
        if isinstance(part, int):
            continue
        annotation = table.model_fields[part].annotation
        candidates = [annotation, *getattr(annotation, "__args__", ())]
        table = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
        if table is None:
            return []
    return list(table.model_fields)


def _is_consequence(detail: Mapping[str, Any]) -> bool:
    """A list that is only too short because an entry of it is wrong."""
    context = detail.get("ctx", {})
    given = detail.get("input")
    return detail["type"] == "too_short" and isinstance(given, list) and len(given) >= context.get("min_length", 0)


def _located(
    fault: ConfigurationFault, raw: Mapping[str, Any], lines: Mapping[Path_, int], options: Mapping[str, str]
) -> ConfigurationFault:
    """The fault with the option it was given by, or with the line of its key."""
    if fault.key.startswith("--"):
        return fault
    for key, option in options.items():
        if f"{fault.key}.".startswith(f"{key}.") or f"{key}.".startswith(f"{fault.key}."):
            return ConfigurationFault(f"{option} ({fault.key})", fault.given, fault.allowed)
    return ConfigurationFault(fault.key, fault.given, fault.allowed, line_of(path_of(fault.key, raw), lines))
