"""Equipment: what vehicles carry, as instances of the ontology, and what they are capable of by it.

Every sensor and every modem is a part of its vehicle (``rm:hasPart``). A kind of sensor and a modem profile say of
which class they are; ``equipment`` in a sensor's table says it of one. Which classes a vehicle is of by its parts, a
``SurveyPlatform`` say, the world model concludes from the definitions in the ontology.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import NamedTuple

from exchange.acoustics.modems import Modem
from missions.errors import ConfigurationFault
from missions.scenarios.copies import Gear, sensor_tables
from missions.scenarios.knowledge import words_of
from missions.scenarios.modem import TABLE as MODEMS
from missions.scenarios.modem import modem_in
from missions.scenarios.parts import sensor_kind
from missions.scenarios.scenario import Scenario
from missions.scenarios.tables import Raw, entries, one_of, table_of
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.sensor import SensorSettings
from worldmodel import Instance, Keeping, OntologyError, PropertyValue, TBox, WorldModel

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


def gear_of(raw: Raw, mission: type[Mission] | None) -> Gear:
    """What abilities follow from in a scenario of a mission; nothing if the mission is unknown."""
    if mission is None:
        return Gear()
    modem = modem_in(raw)
    kinds = mission.sensors
    tbox_of = cache(lambda: _tbox_of(raw, mission))

    def capabilities(vehicle: Raw) -> Collection[str]:
        of_parts = tuple(part.of_class for part in equipment_of(vehicle, modem, kinds))
        tbox = tbox_of()
        return () if tbox is None else capabilities_of(tbox, str(vehicle.get("vehicle_type")), of_parts)

    def is_class(name: str) -> bool:
        tbox = tbox_of()
        return tbox is not None and any(ontology_class.name == name for ontology_class in tbox.classes)

    return Gear(next(iter(kinds), ""), capabilities, is_class, _listening_w(table_of(raw, "communication"), modem))


def _listening_w(communication: Raw, modem: Modem | None) -> float:
    """Receive power that counts, of a table that is not checked yet."""
    given = communication.get("receive_power_w")
    if isinstance(given, int | float):
        return float(given)
    return modem.receive_w or 0.0 if modem is not None and communication.get("count_listening") is True else 0.0


def equipment_of(vehicle: Raw, modem: Modem | None, kinds: Mapping[str, type[SensorSettings]]) -> list[EquipmentItem]:
    """The equipment of a vehicle; what is malformed is passed over.

    Args:
        vehicle: its table.
        modem: its modem; None if that is not known.
        kinds: of sensors that the mission knows.
    """
    found = []
    for table in sensor_tables(vehicle):
        kind = str(table.get("type") or "")
        name = str(table.get("name") or kind or next(iter(kinds), ""))
        try:
            of_class = str(table.get("equipment") or sensor_kind(kind, kinds).EQUIPMENT)
        except PluginError:
            continue
        found.append(EquipmentItem(name, of_class))
    if modem is not None:
        found.append(EquipmentItem("modem", modem.equipment))
    return found


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


def equipment_faults(raw: Raw, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Capabilities and equipment that are no classes of the ontology."""
    tbox = _tbox_of(raw, mission)
    if tbox is None:
        return  # reported where needs are checked
    named = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    for group in entries(raw, "group"):
        for role in entries(group, "role"):
            asked = table_of(role, "requires").get("capability")
            if isinstance(asked, str) and asked not in named:
                key = f"group.{group.get('name')}.role.{role.get('name')}.requires.capability"
                yield from one_of(key, asked, _below(tbox, CAPABILITIES))
    carried, modems = _below(tbox, EQUIPMENT), [MODEM, *_below(tbox, MODEM)]
    for name, profile in table_of(raw, MODEMS).items():
        if isinstance(profile, dict):
            yield from one_of(f"{MODEMS}.{name}.equipment", profile.get("equipment"), modems)
    for vehicle in entries(raw, "vehicle"):
        for table in sensor_tables(vehicle):
            given = table.get("equipment")
            if isinstance(given, str) and given and given not in carried:
                yield from one_of(f"vehicle.{vehicle.get('name')}.sensor.equipment", given, carried)


def _below(tbox: TBox, name: str) -> list[str]:
    """Names of the classes below one, if there is such a class."""
    found = [ontology_class.uid for ontology_class in tbox.classes if ontology_class.name == name]
    return [tbox.classes[uid].name for above in found for uid in tbox.subclasses(above) if uid != above]


def _tbox_of(raw: Raw, mission: type[Mission]) -> TBox | None:
    try:
        return words_of(raw, mission)
    except (OntologyError, OSError):
        return None


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
    tables = scenario.model_dump(include={"vehicle"}, mode="json")["vehicle"]
    for vehicle in sorted(tables, key=lambda table: table["slot"]):
        for part in equipment_of(vehicle, modem, kinds):
            uid = len(instances) + len(found)
            found.append(Instance(uid, tbox.class_named(part.of_class).uid, f"{vehicle['name']}.{part.name}"))
            facts.append(PropertyValue(vehicle["slot"], has_part, uid))
    return tuple(found), tuple(facts)
