"""What a scenario names, as values: its mission, its strategy, the data of its vehicles, its groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from missions.files import is_named
from missions.metric import Metric
from missions.scenarios.equipment import listening_w, makes_sensors, sensors_of
from missions.scenarios.modem import modem_named
from missions.scenarios.named import importable
from missions.scenarios.organisation import ancestry, excluded, role_key
from missions.scenarios.scenario import GroupTable, Scenario, VehicleTable
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.organisation import Group, RoleKey, RoleSpecification, Subgroups
from remoras.plugins import faults_of, named_object
from remoras.recorder import Table
from remoras.sensor import SensorSettings
from remoras.strategies import configured, shipped, strategies
from remoras.strategy import Strategy, faults_of_strategy
from worldmodel import suggestion

COMPULSORY_OF_MISSION = (
    "Scenario", "group_missions", "social_domain", "from_scenario", "jobs", "activity_sets", "behaviour_for", "truth",
    "founding_objectives", "is_individual", "completion", "findings", "world", "check", "completed",
    "delegating_mission", "groups_of", "needs", "vocabulary", "sensors", "tables", "metrics", "figures",
)  # fmt: skip
"""Members that the class of a mission must have; a subclass of ``Mission`` inherits those with a default."""
HELD = {
    "group_missions": (str,), "needs": (str,), "vocabulary": (Path, str), "tables": (Table,), "metrics": (Metric,),
}  # fmt: skip
"""What the sequences of a mission hold."""


def mission_class(reference: str) -> type[Mission]:
    """The class of a mission, by ``package.module:Class``.

    Raises:
        PluginError: it cannot be loaded, is no class, or lacks a part of the seam.
    """
    found = named_object(reference)
    if not isinstance(found, type):
        raise PluginError(f"a class, a subclass of remoras.Mission; {reference} is {type(found).__name__}")
    tables = getattr(found, "Scenario", Scenario)
    if not (isinstance(tables, type) and issubclass(tables, Scenario)):
        raise PluginError("its Scenario must be missions.scenarios.Scenario or a subclass of it")
    if faults := list(faults_of(found, Mission, COMPULSORY_OF_MISSION)):
        raise PluginError(f"a mission: {'; '.join(faults)}")
    mission: type[Mission] = found
    if faults := [*_wrongly_held(mission), *_wrong_sensors(mission.sensors)]:
        raise PluginError(f"a mission: {'; '.join(faults)}")
    return mission


def _wrongly_held(mission: type[Mission]) -> Iterator[str]:
    """Sequences of a mission that are none, or hold something else than they should."""
    for name, kinds in HELD.items():
        given, wanted = getattr(mission, name), f"expected a tuple of {kinds[0].__name__}"
        if isinstance(given, str) or not isinstance(given, Sequence):
            yield f"{name} is {type(given).__name__}; {wanted}"
        else:
            yield from (f"{name} holds {part!r}; {wanted}" for part in given if not isinstance(part, kinds))


def _wrong_sensors(sensors: Any) -> Iterator[str]:
    wanted = "expected a mapping of names to subclasses of remoras.SensorSettings that define make(data)"
    if not isinstance(sensors, Mapping):
        yield f"sensors is {type(sensors).__name__}; {wanted}"
        return
    for name, kind in sensors.items():
        if not makes_sensors(kind):
            yield f"sensors has {kind!r} as {name}; {wanted}"


def mission_of(scenario: Scenario) -> Mission:
    """The mission of a scenario."""
    return mission_class(scenario.scenario.mission).from_scenario(scenario)


def strategy_of(scenario: Scenario) -> Strategy:
    """The strategy that the scenario names, with the parameters that it sets."""
    return configured(strategy_named(scenario.strategy.name), scenario.strategy.parameters)


def strategy_named(name: str) -> Strategy:
    """A shipped strategy by name, or one from outside by ``package.module:object`` or ``file.py:object``.

    A class stands for an object of it with its defaults.

    Raises:
        PluginError: there is none of that name, it cannot be loaded, or it lacks a part of the seam.
    """
    if not is_named(name):
        if (of_name := shipped(name)) is None:
            known = strategies()
            raise PluginError(f"{', '.join(known)}{suggestion(name, known)}")
        return of_name
    found: Any = named_object(importable(name))
    if isinstance(found, type):
        try:
            found = found()
        except Exception as error:  # it is somebody else's class
            why = f"{type(error).__name__}: {error}"
            raise PluginError(f"a class that needs no arguments, or an object; {name} raised {why}") from error
    if faults := list(faults_of_strategy(found)):
        raise PluginError(f"a strategy: {'; '.join(faults)}")
    strategy: Strategy = found
    return strategy


class ModemEnergy(NamedTuple):
    """What a modem takes.

    Attributes:
        transmit_j_per_bit: for each bit that it sends: its power while it sends over its bit rate.
        transmit_j_per_packet: for what it sends before the bits.
        listening_w: all the time, on top of that; 0 where the ``hotel_w`` of the vehicles has it.
    """

    transmit_j_per_bit: float = 0.0
    transmit_j_per_packet: float = 0.0
    listening_w: float = 0.0


def vehicle_data(table: VehicleTable, kinds: Mapping[str, type[SensorSettings]], modem: ModemEnergy) -> VehicleData:
    """Static data of a vehicle from its table; what its modem takes while it listens is part of its ``hotel_w``."""
    sensors = sensors_of(table, kinds)
    fields = {
        **table.model_dump(include=set(VehicleData.__dataclass_fields__)),
        "playable_roles": table.playable_roles or (),
    }
    fields["hotel_w"] = table.hotel_w + modem.listening_w
    return VehicleData(
        **fields,
        node=table.slot,
        transmit_j_per_bit=modem.transmit_j_per_bit,
        transmit_j_per_packet=modem.transmit_j_per_packet,
        sensors=sensors,
    )


def modem_energy(scenario: Scenario) -> ModemEnergy:
    """What the modem of a scenario takes: as the scenario says, or its profile."""
    communication = scenario.communication
    modem, power_w = modem_named(communication.modem, scenario.modem), communication.transmit_power_w
    return ModemEnergy(power_w / modem.rate_bps, power_w * modem.head_s, listening_w(communication, modem))


def database_of(scenario: Scenario, mission: type[Mission]) -> AUVDatabase:
    """Static data of all vehicles, in the order of the nodes."""
    modem = modem_energy(scenario)
    return AUVDatabase(tuple(vehicle_data(table, mission.sensors, modem) for table in scenario.vehicle))


def groups_of(scenario: Scenario) -> tuple[Group, ...]:
    """Groups with the demands of their roles."""
    apart = excluded(scenario.roles)
    return tuple(_group(table, apart, ancestry(scenario.group_template, table.template)) for table in scenario.group)


def _group(table: GroupTable, excluded: Mapping[RoleKey, set[RoleKey]], templates: tuple[str, ...]) -> Group:
    roles = tuple(
        RoleSpecification(
            name=role.name,
            minimum=role.minimum,
            maximum=role.maximum,
            head=role.head,
            founding=role.founding,
            job=role.job,
            played_by=role_key(role.played_by) if role.played_by else None,
            influences=role.influences,
            incompatible=frozenset(excluded[table.name, role.name]),
            authority=role.authority,
        )
        for role in table.role
    )
    subgroups = tuple(Subgroups(subgroup.template, subgroup.minimum, subgroup.maximum) for subgroup in table.subgroup)
    place = table.within, templates, subgroups, table.formed_by
    return Group(table.name, roles, table.rally_point, table.mission, table.succession, *place)
