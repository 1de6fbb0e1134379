"""Reading a scenario: from a shipped name or a TOML file, with overrides, checked whole.

``load`` reports every fault of a file at once, each with file, line, key, what was given and what is allowed.
"""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from missions.document import Document, fault_of, index_of, is_deep, key_parts
from missions.errors import LONGEST_VALUE, ConfigurationFault, cut
from missions.files import MOST_LEVELS, SCENARIO, TOO_DEEP, LimitError, parsed, shipped
from missions.scenarios.channel import leave_aside, with_link_file_found
from missions.scenarios.checks import cross_faults, job_faults
from missions.scenarios.communication import with_key_found
from missions.scenarios.copies import with_abilities, with_copies, with_starts_apart
from missions.scenarios.deployment import guard_faults
from missions.scenarios.equipment import gear_of
from missions.scenarios.knowledge import KEY as ONTOLOGIES
from missions.scenarios.knowledge import with_ontologies
from missions.scenarios.modem import with_modem_read
from missions.scenarios.named import with_files_found
from missions.scenarios.organisation import ORGANISATION, specified, with_organisation
from missions.scenarios.parts import mission_class, sensor_kind, sensor_settings
from missions.scenarios.scenario import Scenario
from missions.scenarios.tables import Raw, entries, table_of
from remoras.errors import PluginError
from remoras.mission import Mission

MOST_VEHICLES = 64
"""Most vehicles of a scenario that is one fleet: as many as there are TDMA slots."""


def load(name_or_path: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """The scenario of a shipped name or a TOML file, with overrides applied.

    Args:
        name_or_path: a name of ``missions.files.shipped()`` or a path.
        overrides: (where it comes from, ``KEY=VALUE``), for example ("--set", "decision.weight_external=0").

    Returns:
        A ``Scenario``, of the subclass that its mission names.

    Raises:
        ConfigurationError: with every fault of the file and the overrides.
    """
    return scenario_from(Document.read(name_or_path, shipped(), SCENARIO), overrides)


def scenario_from(document: Document, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """The scenario that a document is; see ``load``."""
    faults = list(_contradictions(overrides))
    chosen = [(option, text) for option, text in overrides if text.partition("=")[0].strip() == ORGANISATION]
    faults += [fault for option, text in chosen if (fault := _override(document.raw, option, text)) is not None]
    options = {".".join(key_parts(text.partition("=")[0].strip())): option for option, text in overrides}
    document, more = with_organisation(document)
    faults += more
    if any(fault.key == ORGANISATION for fault in more):  # most of a scenario rests on its groups
        raise document.error(faults, options)
    raw = document.raw
    own_channel = dict(table_of(raw, "channel"))
    others = (override for override in overrides if override not in chosen)
    faults += [fault for option, text in others if (fault := _override(raw, option, text)) is not None]
    faults += leave_aside(own_channel, raw, options)
    raw = with_link_file_found(raw, Path(document.path).parent, options)
    raw = with_key_found(raw, Path() if "communication.key_file" in options else Path(document.path).parent)
    document, raw, more = with_modem_read(document, raw, options)
    faults += more
    raw = with_files_found(raw, Path(document.path).parent, options)
    worded, more = with_ontologies(raw, Path() if ONTOLOGIES in options else Path(document.path).parent)
    faults += more
    copies = with_copies(with_starts_apart(worded))
    if (n := len(entries(copies.raw, "vehicle"))) > MOST_VEHICLES:  # more would take the checks of pairs for ever
        faults.append(ConfigurationFault("vehicle", "", f"{n} vehicles; allowed: up to {MOST_VEHICLES}"))
        raise document.error(faults, options)
    specification = specified(copies.raw)
    faults += [*copies.faults, *specification.faults]
    mission, more = _mission_of(specification.raw)
    faults += more
    able = with_abilities(specification.raw, gear_of(specification.raw, mission))
    tables, more = _completed(able, mission)
    faults += more
    scenario, more = _validated(document, tables, mission)
    faults += more
    known = {(fault.key, fault.given) for fault in faults}
    faults += [fault for fault in cross_faults(tables, mission) if (fault.key, fault.given) not in known]
    if not faults and scenario is not None and mission is not None:
        faults += [*job_faults(scenario, mission), *guard_faults(scenario)]
    if faults or scenario is None:
        raise document.error(copies.attributed(specification.attributed(faults)), options)
    return scenario.model_copy(update={"fleet": None, "organisation": None})


def _mission_of(raw: Raw) -> tuple[type[Mission] | None, list[ConfigurationFault]]:
    """The class of the mission, or what is wrong with its name."""
    reference = table_of(raw, "scenario").get("mission")
    if not isinstance(reference, str):
        return None, []  # reported as a missing or malformed key
    try:
        return mission_class(reference), []
    except PluginError as error:
        return None, [ConfigurationFault("scenario.mission", f'"{reference}"', str(error))]


def _completed(raw: Raw, mission: type[Mission] | None) -> tuple[Raw, list[ConfigurationFault]]:
    """The tables with what the mission adds to them, or what is wrong with how it does."""
    if mission is None:
        return raw, []
    try:
        return mission.completed(raw), []
    except Exception as error:  # it may be somebody else's class
        reference = table_of(raw, "scenario").get("mission")
        allowed = f"its completed must pass malformed values over, but raised {type(error).__name__}: {error}"
        return raw, [ConfigurationFault("scenario.mission", f'"{reference}"', allowed)]


def _validated(
    document: Document, raw: Raw, mission: type[Mission] | None
) -> tuple[Scenario | None, list[ConfigurationFault]]:
    """The tables as values, or the faults of single values; keys that an unknown mission may have are passed over."""
    model: type[Scenario] = Scenario if mission is None else mission.Scenario
    faults = [] if mission is None else _all_sensor_faults(raw, mission)
    try:
        return model.model_validate_json(json.dumps(raw, default=str), strict=True), faults
    except ValidationError as error:
        passed_over = ("extra_forbidden",) if mission is None else ()
        return None, faults + document.faults_of(error, model, raw, passed_over)


def _all_sensor_faults(raw: Raw, mission: type[Mission]) -> list[ConfigurationFault]:
    """What is wrong with the tables of sensors, each by the kind that it names."""
    faults: list[ConfigurationFault] = []
    for vehicle in entries(raw, "vehicle"):
        given, key = vehicle.get("sensor"), f"vehicle.{vehicle.get('name')}.sensor"
        if isinstance(given, dict):
            faults += _sensor_faults(key, given, mission)
        tables = entries(vehicle, "sensor")
        for number, table in enumerate(tables, 1):
            faults += _sensor_faults(f"{key}.{table.get('name', number)}", table, mission)
        first = next(iter(mission.sensors), "")
        names = Counter(str(table.get("name") or table.get("type") or first) for table in tables)
        for name, count in names.items():
            if count > 1:
                allowed = f"{count} sensors of this name, by which activities switch them on; give each its own name"
                faults.append(ConfigurationFault(key, f'"{name}"', allowed))
    return faults


def _sensor_faults(key: str, table: Raw, mission: type[Mission]) -> list[ConfigurationFault]:
    try:
        found = sensor_settings(table, mission.sensors)
        if not isinstance(found, ValidationError):
            return []
        kind = sensor_kind(str(table.get("type", "")), mission.sensors)
    except PluginError as error:
        return [ConfigurationFault(f"{key}.type", json.dumps(table.get("type", "")), str(error))]
    faults = [fault_of(detail, kind, table) for detail in found.errors()]
    return [ConfigurationFault(f"{key}.{fault.key}", fault.given, fault.allowed) for fault in faults]


def _contradictions(overrides: Sequence[tuple[str, str]]) -> Iterator[ConfigurationFault]:
    """Overrides that give a key another value than one before them."""
    first: dict[str, tuple[str, str]] = {}
    for option, text in overrides:
        name, _, value = text.partition("=")
        key, value = ".".join(key_parts(name.strip())), value.strip()
        other, given = first.setdefault(key, (option, value))
        if value != given and not _are_alike(value, given):
            where = other if other == option else f"{other}, which sets {key} too,"
            allowed = f"contradicts {where} = {cut(given, LONGEST_VALUE)}; give one of them"
            yield ConfigurationFault(option, text, allowed)


def _override(raw: dict[str, Any], option: str, override: str) -> ConfigurationFault | None:
    """Apply ``decision.weight_external=0`` or ``vehicle.AUV01.energy_j=1e6``; entries of lists by name or number."""
    key, equals, value = override.partition("=")
    if not equals or not key:
        return ConfigurationFault(option, override, "KEY=VALUE, for example decision.weight_external=0")
    if any("\ud800" <= character <= "\udfff" for character in override):  # bytes that are no text for the shell
        readable = override.encode("ascii", "backslashreplace").decode()
        return ConfigurationFault(option, readable, "is no text in UTF-8; set LC_ALL=C.UTF-8 and try again")
    target: Any = raw
    try:
        parts, found = key_parts(key.strip()), _value(value.strip())
    except LimitError as error:
        return ConfigurationFault(option, override, str(error))
    if len(parts) > MOST_LEVELS or is_deep(found):
        return ConfigurationFault(option, override, TOO_DEEP)
    for depth, part in enumerate(parts[:-1]):
        if isinstance(target, list):
            index = index_of(part, target)
            if index is None:
                names = [str(entry.get("name", n)) for n, entry in enumerate(target, 1) if isinstance(entry, dict)]
                return ConfigurationFault(f"{option} {key}", "", f"{part!r} is none of {', '.join(names)}")
            target = target[index]
        else:
            target = target.setdefault(part, {})
        if not isinstance(target, dict | list):
            return ConfigurationFault(f"{option} {key}", "", f"{'.'.join(parts[: depth + 1])} is no table")
    if not isinstance(target, dict):
        return ConfigurationFault(f"{option} {key}", "", "names a list: add the name of an entry and a key")
    target[parts[-1]] = found
    return None


def _are_alike(one: str, other: str) -> bool:
    """True for texts of one value; none that is out of all limits is like another."""
    try:
        return bool(_value(one) == _value(other))
    except LimitError:
        return False


def _value(text: str) -> Any:
    """A value as TOML has it; a bare word is a string.

    Raises:
        LimitError: see ``missions.files.parsed``.
    """
    try:
        return parsed(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
