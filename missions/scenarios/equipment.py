"""Equipment: what vehicles carry, as instances of the ontology, and what they are capable of by it.

Every sensor and every modem is a part of its vehicle (``rm:hasPart``). A kind of sensor and a modem profile say of
which class they are; ``equipment`` in a sensor's table says it of one. Which classes a vehicle is of by its parts, a
``SurveyPlatform`` say, the world model concludes from the definitions in the ontology.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from pydantic import ValidationError

from exchange.acoustics.modems import Modem
from missions.errors import ConfigurationFault
from missions.scenarios.communication import Communication
from missions.scenarios.knowledge import words_in
from missions.scenarios.modem import TABLE as MODEMS
from missions.scenarios.modem import modem_in
from missions.scenarios.scenario import Role, Scenario, VehicleTable
from missions.scenarios.tables import one_of
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.plugins import named_object
from remoras.sensor import SensorSettings
from worldmodel import Instance, Keeping, PropertyValue, TBox, WorldModel, suggestion

HAS_PART = "hasPart"
EQUIPMENT = "Equipment"
"""The class above all that may be listed as equipment."""
MODEM = "AcousticModem"
"""The class of all modems that vehicles exchange with."""
CAPABILITIES = "CapablePlatform"
"""The class above the capabilities that the core ontology defines."""


class EquipmentItem(NamedTuple):
    """One piece of equipment: its name on board, and its class."""

    name: str
    of_class: str


# Sensors -------------------------------------------------------------------------------------------


def makes_sensors(kind: Any) -> bool:
    """True for settings that say how their sensor is made."""
    return isinstance(kind, type) and issubclass(kind, SensorSettings) and kind.make is not SensorSettings.make


def sensor_kind(reference: str, kinds: Mapping[str, type[SensorSettings]]) -> type[SensorSettings]:
    """The kind of sensor that ``type`` of a sensor's table names.

    Args:
        reference: a name among ``kinds``, ``package.module:Class``, or empty for the first of the kinds.
        kinds: those that the mission knows.

    Raises:
        PluginError: there is none, or it is no subclass of SensorSettings that says how its sensor is made.
    """
    if not reference and kinds:
        return next(iter(kinds.values()))
    if ":" not in reference:
        if reference not in kinds:
            known = ", ".join([*kinds, "package.module:Class"])
            raise PluginError(f"allowed: {known}{suggestion(reference, kinds)}")
        return kinds[reference]
    found: Any = named_object(reference)
    if not makes_sensors(found):
        raise PluginError("a subclass of remoras.SensorSettings that defines make(data)")
    kind: type[SensorSettings] = found
    return kind


def sensor_settings(
    table: Mapping[str, Any], kinds: Mapping[str, type[SensorSettings]]
) -> SensorSettings | ValidationError:
    """Settings from one ``[[vehicle.sensor]]`` table, or what is wrong with its values.

    Raises:
        PluginError: the kind of sensor cannot be had.
    """
    try:
        reference = str(table.get("type", ""))
        made = sensor_kind(reference, kinds).model_validate(table, strict=True)
        return made if made.name else made.model_copy(update={"name": reference or next(iter(kinds), "")})
    except ValidationError as error:
        return error


def sensors_of(vehicle: VehicleTable, kinds: Mapping[str, type[SensorSettings]]) -> tuple[SensorSettings, ...]:
    """Settings of the sensors of a vehicle, whose tables are well-formed; ``kinds``: those that its mission knows."""
    found = (sensor_settings(table, kinds) for table in vehicle.sensor)
    return tuple(settings for settings in found if isinstance(settings, SensorSettings))


# What a vehicle is able to do ----------------------------------------------------------------------


def listening_w(communication: Communication, modem: Modem | None) -> float:
    """Power that a modem takes all the time on top of ``hotel_w``."""
    profile_w = modem.receive_w if modem is not None and communication.count_listening else None
    return communication.receive_power_w or profile_w or 0.0


def equipment_of(
    vehicle: VehicleTable, modem: Modem | None, kinds: Mapping[str, type[SensorSettings]]
) -> list[EquipmentItem]:
    """The equipment of a vehicle.

    Args:
        vehicle: its table.
        modem: its modem; None if that is not known.
        kinds: of sensors that the mission knows.
    """
    found = [EquipmentItem(one.name, one.equipment or one.EQUIPMENT) for one in sensors_of(vehicle, kinds)]
    return found if modem is None else [*found, EquipmentItem("modem", modem.equipment)]


@lru_cache(maxsize=256)
def capabilities_of(tbox: TBox, vehicle_type: str, parts: tuple[str, ...]) -> frozenset[str]:
    """Names of all classes that a vehicle is of by its type and the classes of its parts, as far as these are known."""
    named = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    links = [attribute.uid for attribute in tbox.attributes if attribute.name == HAS_PART]
    if vehicle_type not in named or not links:
        return frozenset()
    classes = [named[vehicle_type], *(named[part] for part in parts if part in named)]
    instances = [Instance(uid, of_class, str(uid)) for uid, of_class in enumerate(classes)]
    facts = [PropertyValue(0, links[0], uid) for uid in range(1, len(instances))]
    model = WorldModel(
        tbox, 0, instances, n_origins=1, run_time_instances_per_origin=0, keeping=Keeping(common_facts=facts)
    )
    seen = model.inference.classes(0)
    return frozenset(ontology_class.name for ontology_class in tbox.classes if seen >> ontology_class.uid & 1)


def with_abilities(scenario: Scenario, mission: type[Mission]) -> Scenario:
    """A scenario in which every vehicle lists the roles that it is able to play, as ``Group.Role``.

    A vehicle that lists no ``playable_roles`` is able to play all whose requirements it meets; of those that it lists,
    it is not able to play a role whose requirements it does not meet.
    """
    demanding = any(role.requires is not None for role in scenario.roles.values())
    if not demanding and all(vehicle.playable_roles is not None for vehicle in scenario.vehicle):
        return scenario
    vehicles = []
    for vehicle in scenario.vehicle:
        lacks = {key: any(lacking(vehicle, role, scenario, mission)) for key, role in scenario.roles.items()}
        able = [f"{group}.{role}" for (group, role), is_lacking in lacks.items() if not is_lacking]
        if (listed := vehicle.playable_roles) is not None:
            able = []
            for name in listed:
                meant = [key for key in lacks if name in (key[1], ".".join(key))]
                asked = any(scenario.roles[key].requires is not None for key in meant)
                able += [".".join(key) for key in meant if not lacks[key]] if asked else [name]
        vehicles.append(vehicle.model_copy(update={"playable_roles": tuple(able)}))
    return scenario.model_copy(update={"vehicle": tuple(vehicles)})


def lacking(vehicle: VehicleTable, role: Role, scenario: Scenario, mission: type[Mission]) -> Iterator[str]:
    """What a vehicle lacks of what a role requires, in words; nothing if it meets it."""
    requires, default = role.requires, next(iter(mission.sensors), "")
    if requires is None:
        return
    named = [name for t in vehicle.sensor for name in (t.get("type") or default, t.get("name")) if name]
    if requires.sensor is not None and requires.sensor not in named:
        yield f"sensor {', '.join(named)}" if named else "no sensor"
    modem, tbox = modem_in(scenario), words_in(scenario, mission) if requires.capability is not None else None
    if tbox is not None and any(ontology_class.name == requires.capability for ontology_class in tbox.classes):
        parts = tuple(part.of_class for part in equipment_of(vehicle, modem, mission.sensors))
        if requires.capability not in capabilities_of(tbox, vehicle.vehicle_type, parts):
            yield f"nothing that makes it a {requires.capability}"
    speed_mps = vehicle.survey_speed_mps
    drag_w = vehicle.drag_w_per_mps3 * (speed_mps * speed_mps * speed_mps)
    power_w = vehicle.hotel_w + listening_w(scenario.communication, modem) + drag_w
    for key, offered in (
        ("speed_mps", vehicle.transit_speed_mps),
        ("depth_m", vehicle.depth_limit_m),
        ("endurance_s", vehicle.energy_j / power_w if power_w > 0.0 else math.inf),
    ):
        if (asked := getattr(requires, key)) is not None and asked > offered:
            yield f"{key} {offered:g}, not {asked:g}"
    if requires.social_layer and not vehicle.social_layer:
        yield "no social layer"


def equipment_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Capabilities and equipment that are no classes of the ontology."""
    tbox = words_in(scenario, mission)
    if tbox is None:
        return
    named = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    for (group, name), role in scenario.roles.items():
        asked = role.requires.capability if role.requires is not None else None
        if asked is not None and asked not in named:
            yield from one_of(f"group.{group}.role.{name}.requires.capability", asked, _below(tbox, CAPABILITIES))
    carried, modems = _below(tbox, EQUIPMENT), [MODEM, *_below(tbox, MODEM)]
    for name, profile in scenario.modem.items():
        yield from one_of(f"{MODEMS}.{name}.equipment", profile.equipment, modems)
    for vehicle in scenario.vehicle:
        for sensor in sensors_of(vehicle, mission.sensors):
            yield from one_of(f"vehicle.{vehicle.name}.sensor.equipment", sensor.equipment or None, carried)


def _below(tbox: TBox, name: str) -> list[str]:
    """Names of the classes below one, if there is such a class."""
    found = [ontology_class.uid for ontology_class in tbox.classes if ontology_class.name == name]
    return [tbox.classes[uid].name for above in found for uid in tbox.subclasses(above) if uid != above]


def common_equipment(
    scenario: Scenario,
    modem: Modem,
    kinds: Mapping[str, type[SensorSettings]],
    tbox: TBox,
    instances: Sequence[Instance],
) -> tuple[tuple[Instance, ...], tuple[PropertyValue, ...]]:
    """The equipment of all vehicles as common instances, and whose part each is; none if no role asks for capabilities.

    Args:
        scenario: the scenario.
        modem: of all vehicles.
        kinds: of sensors that the mission knows.
        tbox: of the scenario.
        instances: the common instances before; a vehicle's uid is its slot.
    """
    if not any(role.requires and role.requires.capability for group in scenario.group for role in group.role):
        return (), ()
    found: list[Instance] = []
    facts: list[PropertyValue] = []
    has_part = tbox.attribute_named(HAS_PART).uid
    for vehicle in sorted(scenario.vehicle, key=lambda table: table.slot):
        for part in equipment_of(vehicle, modem, kinds):
            uid = len(instances) + len(found)
            found.append(Instance(uid, tbox.class_named(part.of_class).uid, f"{vehicle.name}.{part.name}"))
            facts.append(PropertyValue(vehicle.slot, has_part, uid))
    return tuple(found), tuple(facts)
