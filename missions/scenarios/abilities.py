"""Abilities: which roles a vehicle is able to play, by what it lists itself and by what the roles require.

Works on the raw tables: where a vehicle lists no ``playable_roles``, or a role that it lists has requirements, the
roles that it is able to play are written out as ``Group.Role``. So everything behind this reads one list.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from missions.scenarios.tables import Raw, entries, list_of, table_of

PLAYABLE = "playable_roles"


def _none(vehicle: Raw) -> Collection[str]:
    return ()


@dataclass(frozen=True)
class Gear:
    """What abilities follow from beside the tables of vehicles; a mission and the ontology have it.

    Attributes:
        default_sensor: kind of a sensor whose table does not say.
        capabilities: classes of the ontology that a vehicle is of by what it carries, from its table.
        is_class: whether the ontology has a class of that name.
        listening_w: what its modem takes all the time on top of ``hotel_w``.
    """

    default_sensor: str = ""
    capabilities: Callable[[Raw], Collection[str]] = _none
    is_class: Callable[[str], bool] = bool
    listening_w: float = 0.0


def can_play(vehicle: Raw, group: Any, role: Any) -> bool:
    """True if a vehicle's table lists the role of the group."""
    listed = list_of(vehicle, PLAYABLE)
    return role in listed or f"{group}.{role}" in listed


def able_to_play(raw: Raw, group: Any, role: Any) -> list[Raw]:
    """Tables of the vehicles that list the role of the group."""
    return [vehicle for vehicle in entries(raw, "vehicle") if can_play(vehicle, group, role)]


def with_abilities(raw: Raw, gear: Gear) -> Raw:
    """The tables in which every vehicle lists the roles that it is able to play.

    Args:
        raw: tables of a scenario, its groups written out.
        gear: of the mission.
    """
    vehicles = raw.get("vehicle")
    roles = [(str(group.get("name")), role) for group in entries(raw, "group") for role in entries(group, "role")]
    if not isinstance(vehicles, list) or not roles:
        return raw
    demanding = any("requires" in role for _, role in roles)
    if not demanding and all(isinstance(vehicle, dict) and PLAYABLE in vehicle for vehicle in vehicles):
        return raw
    return {**raw, "vehicle": [_with_abilities(vehicle, roles, gear) for vehicle in vehicles]}


def _with_abilities(vehicle: Any, roles: list[tuple[str, Raw]], gear: Gear) -> Any:
    if not isinstance(vehicle, dict):
        return vehicle
    met = [(g, str(role.get("name"))) for g, role in roles if not list(lacking(vehicle, role, gear))]
    given = vehicle.get(PLAYABLE)
    if PLAYABLE not in vehicle:
        return {**vehicle, PLAYABLE: [f"{group}.{role}" for group, role in met]}
    if not isinstance(given, list):
        return vehicle
    asking = [(g, str(role.get("name"))) for g, role in roles if "requires" in role]
    demanding = {name for group, role in asking for name in (role, f"{group}.{role}")}
    able: list[Any] = []
    for name in given:
        if isinstance(name, str) and name in demanding:
            able += [f"{group}.{role}" for group, role in met if name in (role, f"{group}.{role}")]
        else:
            able.append(name)
    return {**vehicle, PLAYABLE: able}


def lacking(vehicle: Raw, role: Raw, gear: Gear) -> Iterator[str]:
    """What a vehicle lacks of what a role requires, in words; nothing if it meets it, or if a value is malformed.

    Args:
        vehicle: its table.
        role: its table.
        gear: of the mission.
    """
    requires = table_of(role, "requires")
    if "sensor" in requires and requires["sensor"] not in (has := list(_sensors(vehicle, gear))):
        yield f"sensor {', '.join(has)}" if has else "no sensor"
    of_class = requires.get("capability")
    if isinstance(of_class, str) and gear.is_class(of_class) and of_class not in gear.capabilities(vehicle):
        yield f"nothing that makes it a {of_class}"
    for key, offered in (
        ("speed_mps", _number(vehicle, "transit_speed_mps")),
        ("depth_m", _number(vehicle, "depth_limit_m")),
        ("endurance_s", endurance_s(vehicle, gear.listening_w)),
    ):
        if (asked := _number(requires, key, math.nan)) > offered:
            yield f"{key} {offered:g}, not {asked:g}"
    if requires.get("social_layer") is True and vehicle.get("social_layer", True) is False:
        yield "no social layer"


def endurance_s(vehicle: Raw, listening_w: float = 0.0) -> float:
    """How long its battery lasts at survey speed; infinite where nothing draws from it."""
    speed_mps = _number(vehicle, "survey_speed_mps")
    drag_w = _number(vehicle, "drag_w_per_mps3") * (speed_mps * speed_mps * speed_mps)
    power_w = _number(vehicle, "hotel_w") + listening_w + drag_w
    return _number(vehicle, "energy_j") / power_w if power_w > 0.0 else math.inf


def sensor_tables(vehicle: Raw) -> list[Raw]:
    """The tables of a vehicle's sensors, of which one may stand without a list."""
    given = vehicle.get("sensor")
    return [given] if isinstance(given, dict) else entries(vehicle, "sensor")


def _sensors(vehicle: Raw, gear: Gear) -> Iterator[str]:
    """Kinds and names of a vehicle's sensors."""
    for table in sensor_tables(vehicle):
        yield str(table.get("type") or gear.default_sensor)
        if "name" in table:
            yield str(table["name"])


def _number(table: Mapping[str, Any], key: str, default: float = 0.0) -> float:
    value = table.get(key, default)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else default
