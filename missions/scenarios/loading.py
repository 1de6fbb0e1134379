"""Loading of a scenario: shipped name or TOML file, overrides, validation."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from missions.document import Document, fault_of, index_of, key_parts, validated
from missions.errors import LONGEST_VALUE, ConfigurationFault, cut, repeated
from missions.files import MOST_LEVELS, SCENARIO, parsed, shipped
from missions.scenarios.channel import FILE_KEYS, leave_aside, with_link_file_found
from missions.scenarios.checks import cross_faults, job_faults
from missions.scenarios.communication import with_modem_read
from missions.scenarios.fleet import (
    VehicleTable,
    of_copies,
    sensor_kind,
    sensor_settings,
    with_abilities,
    with_copies,
    with_starts_apart,
)
from missions.scenarios.knowledge import KEY as ONTOLOGIES
from missions.scenarios.knowledge import with_ontologies
from missions.scenarios.organisation import ORGANISATION, specified, with_organisation
from missions.scenarios.parts import mission_class, strategy_named, with_files_found
from missions.scenarios.scenario import About, Scenario
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.plugins import RAISED, named_error
from remoras.strategies import parameters


def load(name_or_path: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """Load a scenario by name or path, with overrides (origin, ``KEY=VALUE``); ConfigurationError with all faults."""
    return scenario_from(Document.read(name_or_path, shipped(), SCENARIO), overrides)


def scenario_from(document: Document, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """Return the scenario of a document; see ``load``."""
    document = replace(document, raw=deepcopy(document.raw))
    faults = list(_contradictions(overrides))
    options = {".".join(key_parts(text.partition("=")[0].strip())): option for option, text in overrides}

    def folder(key: str) -> Path:
        is_given = not options.keys().isdisjoint({key, key.partition(".")[0]})
        return Path() if is_given else Path(document.path).parent

    # The organisation file comes first: the other overrides may change its groups.
    chosen = [(option, text) for option, text in overrides if text.partition("=")[0].strip() == ORGANISATION]
    faults += [fault for option, text in chosen if (fault := _override(document.raw, option, text)) is not None]
    document, more = with_organisation(document, folder(ORGANISATION))
    faults += more
    if any(fault.key == ORGANISATION for fault in more):  # most checks depend on the groups
        raise document.error(faults, options)
    # Before the overrides: the settings of the scenario's own channel may stay beside another name.
    own_channel = document.raw.get("channel")
    own_name = own_channel.get("name") if isinstance(own_channel, dict) else None
    own_strategy = deepcopy(document.raw.get("strategy"))
    others = (override for override in overrides if override not in chosen)
    faults += [fault for option, text in others if (fault := _override(document.raw, option, text)) is not None]
    faults += leave_aside(own_name, document.raw.get("channel"), options)
    document, more = with_modem_read(document, folder("communication.modem"))
    faults += more
    raw = with_files_found(document.raw, Path(document.path).parent, options)
    leave_parameters_aside(own_strategy, raw.get("strategy"), options)
    written = specified(raw)
    faults += written.faults
    if faults:
        raise document.error(written.attributed(faults), options)
    tables, mission, faults = _validated({**raw, **written.raw})
    if faults or tables is None or mission is None:
        raise document.error(written.attributed(faults), options)
    scenario, faults = _with_files_read(tables, folder, options)
    # Starts first, since copies keep clear of them.
    scenario, copies, more = with_copies(with_starts_apart(scenario))
    faults += more
    try:
        completed: Scenario = mission.completed(with_abilities(scenario, mission))
    except RAISED as error:
        raise document.error([*faults, _raised(error)], options) from None
    if not isinstance(completed, Scenario):
        allowed = f"its completed returned {completed!r}; expected: a Scenario"
        raise document.error([*faults, ConfigurationFault("scenario.mission", "", allowed)], options)
    # In three stages: each assumes that the stage before has found no faults.
    faults += cross_faults(completed, mission) if not faults else ()
    faults += job_faults(completed, mission) if not faults else ()
    if faults:
        raise document.error(written.attributed(of_copies(faults, completed, copies)), options)
    return completed.model_copy(update={"fleet": None, "organisation": None})


def leave_parameters_aside(own: Any, strategy: Any, overridden: Collection[str]) -> None:
    """Remove parameters of the scenario's ``own`` strategy that another one, named by an override, does not have."""
    if not (isinstance(own, dict) and isinstance(strategy, dict) and own.get("name") != strategy.get("name")):
        return
    settings, name = strategy.get("parameters"), strategy.get("name")
    if isinstance(settings, dict) and isinstance(own.get("parameters"), dict) and isinstance(name, str):
        with suppress(PluginError):  # an unknown strategy is reported with its key
            known = {parameter.name for parameter in parameters(strategy_named(name))}
            for key in own["parameters"].keys() - known:
                if not {"strategy", "strategy.parameters", f"strategy.parameters.{key}"} & {*overridden}:
                    settings.pop(key, None)


def _with_files_read(
    scenario: Scenario, folder: Callable[[str], Path], options: Collection[str]
) -> tuple[Scenario, list[ConfigurationFault]]:
    key, communication = f"channel.{FILE_KEYS.get(scenario.channel.name, '')}", scenario.communication
    # Another file by option has another hash than the one in the scenario.
    is_other = key in options and "channel.sha256" not in options
    if file := communication.key_file:
        path = str((folder("communication.key_file") / file).resolve())
        communication = communication.model_copy(update={"key_file": path})
    table, faults = with_ontologies(scenario.worldmodel, folder(ONTOLOGIES))
    channel = with_link_file_found(scenario.channel, folder(key), is_other)
    changes = {"channel": channel, "communication": communication, "worldmodel": table}
    return scenario.model_copy(update=changes), faults


def _raised(error: BaseException) -> ConfigurationFault:
    if isinstance(error, ValidationError):
        fault = fault_of(error.errors()[0], Scenario, {})
        allowed = f"{fault.key} = {fault.given} of what its completed adds: {fault.allowed}"
    else:
        why = f"raised {named_error(error)}"
        allowed = f"its completed must take every scenario whose tables are well-formed, but {why}"
    return ConfigurationFault("scenario.mission", "", allowed)


class _Header(BaseModel):
    scenario: About


def _validated(raw: Mapping[str, Any]) -> tuple[Scenario | None, type[Mission] | None, list[ConfigurationFault]]:
    header = raw.get("scenario")
    name = header.get("mission") if isinstance(header, dict) else None
    if not isinstance(name, str):
        return None, None, validated(_Header, raw)[1]
    try:
        mission = mission_class(name)
    except PluginError as error:
        return None, None, [ConfigurationFault("scenario.mission", "", str(error))]
    scenario, faults = validated(mission.Scenario, raw)
    if scenario is not None:
        faults += [fault for vehicle in scenario.vehicle for fault in _sensors(vehicle, mission)]
    return scenario, mission, faults


def _sensors(vehicle: VehicleTable, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    key = f"vehicle.{vehicle.name}.sensor"
    for number, table in enumerate(vehicle.sensor, 1):
        place = f"{key}.{table.get('name', number)}" if len(vehicle.sensor) > 1 else key
        try:
            sensor_settings(table, mission.sensors)
        except ValidationError as error:
            kind = sensor_kind(str(table.get("type", "")), mission.sensors)
            for fault in (fault_of(detail, kind, table) for detail in error.errors()):
                yield ConfigurationFault(f"{place}.{fault.key}", fault.given, fault.allowed)
        except PluginError as error:
            yield ConfigurationFault(f"{place}.type", json.dumps(table.get("type", "")), str(error))
    for name, count in repeated(vehicle.sensor_names(next(iter(mission.sensors), ""))):
        allowed = f"{count} sensors of this name, by which activities switch them on; give each its own name"
        yield ConfigurationFault(key, f'"{name}"', allowed)


def _contradictions(overrides: Sequence[tuple[str, str]]) -> Iterator[ConfigurationFault]:
    first: dict[str, tuple[str, str]] = {}
    for option, text in overrides:
        name, _, value = text.partition("=")
        key, value = ".".join(key_parts(name.strip())), value.strip()
        other, earlier = first.setdefault(key, (option, value))
        # Values, not texts: 0.30 repeats 0.3.
        if value != earlier and _value(value) != _value(earlier):
            where = other if other == option else f"{other}, which sets {key} too,"
            allowed = f"contradicts {where} = {cut(earlier, LONGEST_VALUE)}; give one of them"
            yield ConfigurationFault(option, text, allowed)


def _override(raw: dict[str, Any], option: str, override: str) -> ConfigurationFault | None:
    key, equals, value = override.partition("=")
    if not equals or not key:
        return ConfigurationFault(option, override, "KEY=VALUE, for example channel.per=0.3")
    if any("\ud800" <= character <= "\udfff" for character in override):  # bytes that are not valid text
        readable = override.encode("ascii", "backslashreplace").decode()
        return ConfigurationFault(option, readable, "is no text in UTF-8; set LC_ALL=C.UTF-8 and try again")
    target: Any = raw
    parts = key_parts(key.strip())
    if len(parts) > MOST_LEVELS:
        return ConfigurationFault(option, override, f"a key of up to {MOST_LEVELS} parts")
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
    target[parts[-1]] = _value(value.strip())
    return None


def _value(text: str) -> Any:
    try:
        return parsed(f"value = {text}")["value"]
    except ValueError:
        return text
