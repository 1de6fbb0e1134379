"""Fleet of a scenario: copies of vehicles, separated starts, equipment and abilities.

A copy differs from its original only in name, slot, depth and start. Each gets a depth layer, as is usual for AUVs in a
group: vehicles of different layers pass freely. Copies that share a layer start ``spacing_m`` apart. A vehicle too near
to an earlier one starts at the nearest free point of a lattice around its start.

Sensors and modems are parts of their vehicle (``rm:hasPart``), from which the world model infers its classes.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from pydantic import Field

from exchange.arithmetic import distance
from exchange.channel.modems import Modem
from missions.errors import ConfigurationFault, one_of
from missions.files import shown
from missions.scenarios.communication import MODEMS, Communication, modem_in, modem_named
from missions.scenarios.features import with_features
from missions.scenarios.knowledge import words_in
from remoras.database import AUVDatabase, VehicleData, power_w
from remoras.errors import PluginError
from remoras.mission import Mission
from remoras.motion.separation import SAME_DEPTH_M, TOLERANCE_M
from remoras.plugins import known_or_named
from remoras.sensor import SensorSettings
from remoras.table import Name, NotNegative, OneOrMore, PointM, Positive, Section, Sparse
from worldmodel import Instance, Keeping, PropertyValue, TBox, WorldModel

if TYPE_CHECKING:
    from missions.scenarios.organisation import Role
    from missions.scenarios.scenario import Scenario, World

MAX_VEHICLES: Final = 256  # most vehicles of one fleet, by the number of TDMA slots
SPACING_M: Final = 10.0  # distance between copies in one layer: twice the separation of passing vehicles
LAYER_M = 4.0  # distance between layers, more than ``remoras.motion.separation.SAME_DEPTH_M``


@with_features("vehicle")
class VehicleTable(Sparse):
    """One ``[[vehicle]]``."""

    name: Name = Field(description="name of the vehicle")
    vehicle_type: Literal["AUV", "ASV"] = Field(description="AUV or ASV")
    slot: int = Field(ge=0, lt=MAX_VEHICLES, description="TDMA slot that the vehicle owns, 0 to number of vehicles - 1")
    social_layer: bool = Field(True, description="able to lead a group, and to divide jobs with others")
    start_m: PointM = Field(
        description="position at time 0, x east, y north; the nearest free place if too close to another in its layer"
    )
    depth_m: NotNegative = Field(0.0, description="working depth")
    depth_limit_m: NotNegative = Field(0.0, description="maximum depth")
    transit_speed_mps: float = Field(gt=0.0, le=20.0, description="transit speed")
    survey_speed_mps: float = Field(gt=0.0, le=20.0, description="speed while working")
    turn_rate_radps: Positive = Field(0.5, description="maximum turn rate")
    acceleration_mps2: Positive = Field(0.5, description="maximum acceleration")
    energy_j: Positive = Field(description="battery capacity")
    hotel_w: NotNegative = Field(description="power at rest")
    drag_w_per_mps3: NotNegative = Field(description="power of propulsion per cubed speed")
    playable_roles: tuple[str, ...] | None = Field(
        None,
        description="roles the vehicle can play, preferred first: Role of any group, or Group.Role; if absent, "
        "all whose requirements it meets",
    )
    sensor: OneOrMore[dict[str, Any]] = Field(  # each kind of sensor validates its keys
        (), description="sensors of the vehicle, a table each; `type` names the kind, or package.module:object"
    )

    def can_play(self, group: str, role: str) -> bool:
        """True if it lists the role of the group."""
        return not {role, f"{group}.{role}"}.isdisjoint(self.playable_roles or ())

    def sensor_names(self, default: str) -> list[str]:
        """Return the names of its sensors; ``default`` is the kind of an unnamed one."""
        return [str(table.get("name") or table.get("type") or default) for table in self.sensor]

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.depth_m > self.depth_limit_m:
            yield "depth_m", f"allowed: 0 to depth_limit_m = {self.depth_limit_m}"
        if self.survey_speed_mps > self.transit_speed_mps:
            yield "survey_speed_mps", f"allowed: up to transit_speed_mps = {self.transit_speed_mps}"


class FleetTable(Section):
    """Size of the fleet; absent from the resolved scenario, which lists every vehicle."""

    size: int | None = Field(
        None,
        ge=2,
        le=MAX_VEHICLES,
        description="fleet size, listed vehicles and copies; those listed if absent",
    )
    copies_of: str | None = Field(None, description="vehicle to copy to reach the size of the fleet")
    spacing_m: float = Field(SPACING_M, ge=1.0, description="distance between starting copies at one depth")
    layers: bool = Field(True, description="copies get own depth layers; false: all stay in that of the original")


def of_copies(
    faults: Sequence[ConfigurationFault], scenario: Scenario, names: Sequence[str]
) -> list[ConfigurationFault]:
    """Report faults of copies under ``fleet.size``, once each, unless the original has them."""
    fleet, own = scenario.fleet, {(fault.key, fault.allowed) for fault in faults}
    reported: list[ConfigurationFault] = []
    seen: set[tuple[str, str]] = set()
    for fault in faults:
        kind, _, rest = fault.key.partition(".")
        name, _, key = rest.partition(".")
        if kind != "vehicle" or name not in names or fleet is None:
            reported.append(fault)
        elif (f"vehicle.{fleet.copies_of}.{key}", fault.allowed) not in own and (key, fault.allowed) not in seen:
            seen.add((key, fault.allowed))
            copy = next(vehicle for vehicle in scenario.vehicle if vehicle.name == name)
            value = fault.given or shown(getattr(copy, key, ""))
            allowed = f"its copy {name} has {key} = {value}: {fault.allowed}"
            reported.append(ConfigurationFault("fleet.size", "", allowed))
    return reported


def with_copies(scenario: Scenario) -> tuple[Scenario, list[str], list[ConfigurationFault]]:
    """Return a scenario with its copies, their names, and the faults of ``[fleet]``."""
    fleet, vehicles = scenario.fleet, scenario.vehicle
    if fleet is None or fleet.size is None:
        return scenario, [], []
    size, names, n_copies = fleet.size, scenario.vehicle_names, fleet.size - len(vehicles)
    if faults := list(one_of("fleet.copies_of", fleet.copies_of, names)):
        return scenario, [], faults
    if n_copies < 0:
        allowed = f"allowed: {len(vehicles)}, the vehicles that are listed, to {MAX_VEHICLES}"
        return scenario, [], [ConfigurationFault("fleet.size", "", allowed)]
    if n_copies == 0:
        return scenario, [], []
    if fleet.copies_of is None:
        allowed = f"missing: which vehicle the {n_copies} to add are copies of; allowed: {', '.join(names)}"
        return scenario, [], [ConfigurationFault("fleet.copies_of", "", allowed)]
    source, world = next(vehicle for vehicle in vehicles if vehicle.name == fleet.copies_of), scenario.world
    if not world.holds(source.start_m):
        return scenario, [], []  # reported for the original
    layers_m = _layers_m(source, vehicles) if fleet.layers else [source.depth_m]
    # Copies of all layers share the same starts, so each must be free in every layer.
    taken_m = [v.start_m for v in vehicles if any(_shares(v, layer_m) for layer_m in layers_m)]
    starts_m = free_places(source.start_m, fleet.spacing_m, world, taken_m, math.ceil(n_copies / len(layers_m)))
    places = [(start_m, layer_m) for start_m in starts_m for layer_m in layers_m]
    if len(places) < n_copies:
        allowed = f"the world has room for {len(places)} of {n_copies} copies that start this far apart"
        return scenario, [], [ConfigurationFault("fleet.spacing_m", shown(fleet.spacing_m), allowed)]
    # Names of all tables, so that no copy gets that of a group or rally point.
    listed = (entry for value in dict(scenario).values() if isinstance(value, tuple) for entry in value)
    used = {str(entry.get("name") if isinstance(entry, dict) else getattr(entry, "name", "")) for entry in listed}
    new_names = _next_names(source.name, used, n_copies)
    free_slots = [slot for slot in range(size) if slot not in [vehicle.slot for vehicle in vehicles]]
    copies = [
        source.model_copy(update={"name": name, "slot": slot, "start_m": start_m, "depth_m": depth_m})
        for name, slot, (start_m, depth_m) in zip(new_names, free_slots, places, strict=False)
    ]
    return scenario.model_copy(update={"vehicle": (*vehicles, *copies)}), new_names, []


def _next_names(original: str, used: set[str], n_names: int) -> list[str]:
    stem, digits = re.fullmatch(r"(.*?)(\d*)", original, re.DOTALL).groups()  # type: ignore[union-attr]  # always matches
    number, names = int(digits or 1), list[str]()
    while len(names) < n_names:
        number += 1
        name = f"{stem}{number:0{len(digits)}d}"
        if name not in used:
            names.append(name)
    return names


def _shares(vehicle: VehicleTable, layer_m: float) -> bool:
    return abs(vehicle.depth_m - layer_m) < LAYER_M


def _layers_m(original: VehicleTable, vehicles: Sequence[VehicleTable]) -> list[float]:
    own_m, limit_m = original.depth_m, original.depth_limit_m
    # Nearest layers first; of two at one distance, the deeper.
    steps = sorted(range(-MAX_VEHICLES, MAX_VEHICLES + 1), key=lambda step: (abs(step), -step))
    layers_m = [round(own_m + step * LAYER_M, 3) for step in steps]
    free_m = [m for m in layers_m if 0.0 < m <= limit_m and not any(_shares(vehicle, m) for vehicle in vehicles)]
    return free_m or [own_m]


def free_places(
    around_m: PointM, spacing_m: float, world: World, taken_m: Sequence[PointM], n_places: int
) -> list[PointM]:
    """Return the first lattice points in the world, nearest rings first, ``spacing_m`` from all taken ones."""
    (x_m, y_m), (x_min, y_min, x_max, y_max) = around_m, world.box_m
    reach_m = max(x_m - x_min, x_max - x_m, y_m - y_min, y_max - y_m)
    places: list[PointM] = []
    for ring in range(int(reach_m / spacing_m) + 1):
        for row, column in itertools.product(range(-ring, ring + 1), repeat=2):
            if max(abs(row), abs(column)) == ring:
                place = round(x_m + column * spacing_m, 3), round(y_m + row * spacing_m, 3)
                # Rounded coordinates of neighbouring points may be slightly less than the spacing apart.
                if world.holds(place) and all(distance(place, other) > 0.999 * spacing_m for other in taken_m):
                    places.append(place)
        if len(places) >= n_places:
            break
    return places[:n_places]


def with_starts_apart(scenario: Scenario) -> Scenario:
    """Return a scenario with separated starts, where free places exist."""
    separation_m, world, placed = scenario.guidance.separation_m, scenario.world, list[VehicleTable]()
    for vehicle in scenario.vehicle:
        near = [other.start_m for other in placed if _meet(vehicle, other)]
        if any(distance(vehicle.start_m, at_m) < separation_m - TOLERANCE_M for at_m in near):
            free_m = free_places(vehicle.start_m, max(SPACING_M, separation_m), world, near, 1) or [vehicle.start_m]
            placed.append(vehicle.model_copy(update={"start_m": free_m[0]}))
        else:
            placed.append(vehicle)
    return scenario.model_copy(update={"vehicle": tuple(placed)})


def start_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield faults of starts outside the world, or too near to an earlier one at that depth."""
    yield from scenario.world.outside((f"vehicle.{v.name}.start_m", v.start_m) for v in scenario.vehicle)
    separation_m, faulty = scenario.guidance.separation_m, set()
    for other, vehicle in itertools.combinations(scenario.vehicle, 2):
        distance_m = distance(vehicle.start_m, other.start_m)
        if distance_m < separation_m - TOLERANCE_M and _meet(vehicle, other) and vehicle.name not in faulty:
            faulty.add(vehicle.name)
            allowed = (
                f"{distance_m:.3g} m from the start of {other.name}, in the same depth layer, and no place is free; "
                f"allowed: guidance.separation_m = {separation_m:g} m or more, or a depth_m that differs by more "
                f"than {SAME_DEPTH_M:g} m"
            )
            x_m, y_m = vehicle.start_m
            yield ConfigurationFault(f"vehicle.{vehicle.name}.start_m", f"[{x_m}, {y_m}]", allowed)


def _meet(vehicle: VehicleTable, other: VehicleTable) -> bool:
    return abs(vehicle.depth_m - other.depth_m) <= SAME_DEPTH_M


HAS_PART = "hasPart"
EQUIPMENT = "Equipment"
MODEM = "AcousticModem"
CAPABILITIES = "CapablePlatform"


class EquipmentItem(NamedTuple):
    """Piece of equipment: its name on board, and its class."""

    name: str
    of_class: str


# Sensors ----------------------------------------------------------------------------------------


def makes_sensors(kind: Any) -> bool:
    """True for a subclass of SensorSettings that defines ``make``."""
    return isinstance(kind, type) and issubclass(kind, SensorSettings) and kind.make is not SensorSettings.make


def sensor_kind(reference: str, kinds: Mapping[str, type[SensorSettings]]) -> type[SensorSettings]:
    """Return the settings class named by a sensor's ``type``, the first of ``kinds`` if empty; PluginError if none."""
    if not reference and kinds:
        return next(iter(kinds.values()))
    kind: type[SensorSettings] = known_or_named("sensor", reference, kinds, "package.module:Class")
    if not makes_sensors(kind):
        raise PluginError("a subclass of remoras.SensorSettings that defines make(data)")
    return kind


def sensor_settings(table: Mapping[str, Any], kinds: Mapping[str, type[SensorSettings]]) -> SensorSettings:
    """Parse a ``[[vehicle.sensor]]`` table; raise PluginError for an unknown kind, ValidationError for its keys."""
    reference = str(table.get("type", ""))
    made = sensor_kind(reference, kinds).model_validate(table, strict=True)
    return made if made.name else made.model_copy(update={"name": reference or next(iter(kinds), "")})


def sensors_of(vehicle: VehicleTable, kinds: Mapping[str, type[SensorSettings]]) -> tuple[SensorSettings, ...]:
    """Return the settings of a vehicle's sensors."""
    return tuple(sensor_settings(table, kinds) for table in vehicle.sensor)


# Abilities --------------------------------------------------------------------------------------


def listening_w(communication: Communication, modem: Modem | None) -> float:
    """Power (W) of the listening modem in addition to ``hotel_w``."""
    return (modem.receive_w or 0.0) if modem is not None and communication.count_listening else 0.0


def equipment_of(
    vehicle: VehicleTable, modem: Modem | None, kinds: Mapping[str, type[SensorSettings]]
) -> list[EquipmentItem]:
    """Return the equipment of a vehicle; ``modem`` is None if unknown."""
    items = [EquipmentItem(s.name, s.equipment or s.EQUIPMENT) for s in sensors_of(vehicle, kinds)]
    return items if modem is None else [*items, EquipmentItem("modem", modem.equipment)]


def inferred_classes(tbox: TBox, of_class: str, attribute: str, others: tuple[str, ...]) -> frozenset[str]:
    """Return the classes of an instance inferred from its class and those of ``others``, linked by ``attribute``."""
    named = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    links = [known.uid for known in tbox.attributes if known.name == attribute]
    if of_class not in named or not links:
        return frozenset()
    classes = [named[of_class], *(named[other] for other in others if other in named)]
    instances = [Instance(uid, class_uid, str(uid)) for uid, class_uid in enumerate(classes)]
    facts = [PropertyValue(0, links[0], uid) for uid in range(1, len(instances))]
    # The inference of the missions itself, on a model of one vehicle: both cannot disagree.
    model = WorldModel(
        tbox, 0, instances, n_origins=1, run_time_instances_per_origin=0, keeping=Keeping(common_facts=facts)
    )
    seen = model.inference.classes(0)
    return frozenset(ontology_class.name for ontology_class in tbox.classes if seen >> ontology_class.uid & 1)


def with_abilities(scenario: Scenario, mission: type[Mission]) -> Scenario:
    """Return a scenario whose vehicles list, as ``Group.Role``, the (listed) roles whose requirements they meet."""
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
                # A listed role without requirements stays as it is; ``playable_faults`` reports unknown ones.
                asked = any(scenario.roles[key].requires is not None for key in meant)
                able += [".".join(key) for key in meant if not lacks[key]] if asked else [name]
        vehicles.append(vehicle.model_copy(update={"playable_roles": tuple(able)}))
    return scenario.model_copy(update={"vehicle": tuple(vehicles)})


def lacking(vehicle: VehicleTable, role: Role, scenario: Scenario, mission: type[Mission]) -> Iterator[str]:
    """Yield unmet requirements of a role, as text."""
    requires, default = role.requires, next(iter(mission.sensors), "")
    if requires is None:
        return
    named = [name for t in vehicle.sensor for name in (t.get("type") or default, t.get("name")) if name]
    if requires.sensor is not None and requires.sensor not in named:
        yield f"sensor {', '.join(named)}" if named else "no sensor"
    modem, tbox = modem_in(scenario), words_in(scenario, mission) if requires.capability is not None else None
    # An unknown class is a fault of the scenario, not a lack of the vehicle.
    if tbox is not None and any(ontology_class.name == requires.capability for ontology_class in tbox.classes):
        parts = tuple(part.of_class for part in equipment_of(vehicle, modem, mission.sensors))
        if requires.capability not in inferred_classes(tbox, vehicle.vehicle_type, HAS_PART, parts):
            yield f"no equipment that makes it a {requires.capability}"
    hotel_w = vehicle.hotel_w + listening_w(scenario.communication, modem)
    survey_w = power_w(hotel_w, vehicle.drag_w_per_mps3, vehicle.survey_speed_mps)
    for key, offered in (
        ("speed_mps", vehicle.transit_speed_mps),
        ("depth_m", vehicle.depth_limit_m),
        ("endurance_s", vehicle.energy_j / survey_w if survey_w > 0.0 else math.inf),
    ):
        if (asked := getattr(requires, key)) is not None and asked > offered:
            yield f"{key} {offered:g}, not {asked:g}"
    if requires.social_layer and not vehicle.social_layer:
        yield "no social layer"


def equipment_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: capabilities and equipment that are not classes of the ontology."""
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
    uids = [ontology_class.uid for ontology_class in tbox.classes if ontology_class.name == name]
    return [tbox.classes[uid].name for above in uids for uid in tbox.subclasses(above) if uid != above]


def common_equipment(
    scenario: Scenario,
    modem: Modem,
    kinds: Mapping[str, type[SensorSettings]],
    tbox: TBox,
    instances: Sequence[Instance],
) -> tuple[tuple[Instance, ...], tuple[PropertyValue, ...]]:
    """Return all equipment as common instances, behind ``instances``, and its part-of facts."""
    # Further instances may widen all uids in packets.
    if not any(role.requires and role.requires.capability for group in scenario.group for role in group.role):
        return (), ()
    parts: list[Instance] = []
    facts: list[PropertyValue] = []
    has_part = tbox.attribute_named(HAS_PART).uid
    for vehicle in sorted(scenario.vehicle, key=lambda table: table.slot):
        for part in equipment_of(vehicle, modem, kinds):
            uid = len(instances) + len(parts)
            parts.append(Instance(uid, tbox.class_named(part.of_class).uid, f"{vehicle.name}.{part.name}"))
            facts.append(PropertyValue(vehicle.slot, has_part, uid))
    return tuple(parts), tuple(facts)


# Vehicles as the fleet knows them -------------------------------------------------------------------


class ModemEnergy(NamedTuple):
    """Energy of a modem; ``transmit_j_per_packet`` is for the time before the payload."""

    transmit_j_per_bit: float = 0.0
    transmit_j_per_packet: float = 0.0
    listening_w: float = 0.0


def modem_energy(scenario: Scenario) -> ModemEnergy:
    """Return the energy of a scenario's modem, by its keys or its profile."""
    communication = scenario.communication
    modem, power_w = modem_named(communication.modem, scenario.modem), communication.transmit_power_w
    return ModemEnergy(power_w / modem.rate_bps, power_w * modem.head_s, listening_w(communication, modem))


def database_of(scenario: Scenario, mission: type[Mission]) -> AUVDatabase:
    """Return the static data of all vehicles, in node order; ``hotel_w`` includes the listening modem."""
    modem, known = modem_energy(scenario), VehicleData.__dataclass_fields__.keys() & VehicleTable.model_fields.keys()
    vehicles = []
    for table in scenario.vehicle:
        own = {key: getattr(table, key) for key in known} | {
            "playable_roles": table.playable_roles or (),
            "hotel_w": table.hotel_w + modem.listening_w,
            "node": table.slot,
            "transmit_j_per_bit": modem.transmit_j_per_bit,
            "transmit_j_per_packet": modem.transmit_j_per_packet,
            "sensors": sensors_of(table, mission.sensors),
        }
        vehicles.append(VehicleData(**own))
    return AUVDatabase(vehicles)
