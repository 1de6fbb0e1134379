"""Fleet of a scenario: abilities of vehicles, copies up to a size, starts.

Works on the raw tables before any check between them, so that those see the whole fleet. A copy is its original but
for name (the next free number), slot (the next free), depth and start. Copies get a depth layer each, as AUVs that work
together do in practice: vehicles in layers pass freely. Where there are more copies than layers, or none, as for
surface vehicles, those that share a layer start ``spacing_m`` apart. With ``layers = false`` all copies stay in that of
the original, where they keep clear of each other.

Many scenarios have vehicles start where their ship is, at one point. Who would start too near to one that is listed
before it starts at the nearest free place of a lattice around that point instead.

Abilities: which roles a vehicle is able to play, by what it lists itself and by what the roles require.

Works on the raw tables: where a vehicle lists no ``playable_roles``, or a role that it lists has requirements, the
roles that it is able to play are written out as ``Group.Role``. So everything behind this reads one list.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.scenarios.tables import (
    PointM,
    Raw,
    bounds_of,
    entries,
    is_number,
    list_of,
    names_of,
    one_of,
    point_of,
    table_of,
)
from remoras.avoidance import SEPARATION_M
from remoras.separation import SAME_DEPTH_M, TOLERANCE_M

MAX_VEHICLES = 64
SPACING_M = 10.0
"""Between copies in one layer: twice the distance that vehicles keep when they pass each other."""
LAYER_M = 4.0
"""Between layers: more than ``remoras.separation.SAME_DEPTH_M``, up to which vehicles keep clear of each other."""


@dataclass(frozen=True)
class Copies:
    """Tables of a scenario with the copies in them.

    Args:
        raw: the tables; ``names``: the copies, ``original``: what they are copies of, ``size``: of the fleet.
        faults: what is wrong with ``[fleet]``; there are no copies then.
    """

    raw: Raw
    names: tuple[str, ...] = ()
    original: str = ""
    size: int = 0
    faults: tuple[ConfigurationFault, ...] = ()

    def attributed(self, faults: Sequence[ConfigurationFault]) -> list[ConfigurationFault]:
        """Faults of copies as faults of ``fleet.size``, once each; those that the original has too are its own."""
        own = {(fault.key, fault.allowed) for fault in faults}
        found: list[ConfigurationFault] = []
        said: set[tuple[str, str]] = set()
        for fault in faults:
            kind, _, rest = fault.key.partition(".")
            name, _, key = rest.partition(".")
            if kind != "vehicle" or name not in self.names:
                found.append(fault)
            elif (f"vehicle.{self.original}.{key}", fault.allowed) not in own and (key, fault.allowed) not in said:
                said.add((key, fault.allowed))
                allowed = f"its copy {name} has {key} = {fault.given}: {fault.allowed}"
                found.append(ConfigurationFault("fleet.size", str(self.size), allowed))
        return found


def with_copies(raw: Raw) -> Copies:
    """The tables with the fleet at its size; as they are where ``[fleet]`` asks for nothing or is malformed."""
    fleet, vehicles = raw.get("fleet"), entries(raw, "vehicle")
    if not isinstance(fleet, dict):
        return Copies(raw)
    size, original, names = fleet.get("size"), fleet.get("copies_of"), names_of(raw, "vehicle")
    if type(size) is not int or not 2 <= size <= MAX_VEHICLES:
        return Copies(raw)
    if faults := tuple(one_of("fleet.copies_of", original, names)):
        return Copies(raw, faults=faults)
    if size == len(vehicles):
        return Copies(raw)
    if size < len(vehicles):
        allowed = f"allowed: {len(vehicles)}, the vehicles that are listed, to {MAX_VEHICLES}"
        return Copies(raw, faults=(ConfigurationFault("fleet.size", str(size), allowed),))
    if original is None:
        allowed = f"missing: which vehicle the {size - len(vehicles)} to add are copies of; allowed: {', '.join(names)}"
        return Copies(raw, faults=(ConfigurationFault("fleet.copies_of", "", allowed),))
    source = next((vehicle for vehicle in vehicles if vehicle.get("name") == original), {})
    spacing_m, box, around = fleet.get("spacing_m", SPACING_M), bounds_of(raw), point_of(source, "start_m")
    if type(spacing_m) not in (int, float) or not spacing_m > 0.0:
        return Copies(raw)  # reported as what it is, and so are world and start
    if box is None or not all(map(math.isfinite, box)) or not around or not _in(box, around[0]):
        return Copies(raw)
    n_copies = size - len(vehicles)
    layers_m = [_depth_m(source)] if fleet.get("layers") is False else _layers_m(source, vehicles)
    in_layers = [vehicle for vehicle in vehicles if any(_shares(vehicle, layer_m) for layer_m in layers_m)]
    taken_m = [start_m for vehicle in in_layers for start_m in point_of(vehicle, "start_m")]
    starts_m = free_places(around[0], float(spacing_m), box, taken_m, math.ceil(n_copies / len(layers_m)))
    places = [(start_m, layer_m) for start_m in starts_m for layer_m in layers_m]
    if len(places) < n_copies:
        allowed = f"the world has room for {len(places)} of {n_copies} copies that start this far apart"
        return Copies(raw, faults=(ConfigurationFault("fleet.spacing_m", str(spacing_m), allowed),))
    used = {str(entry["name"]) for kind in raw for entry in entries(raw, kind) if "name" in entry}
    new_names = _next_names(original, used, n_copies)
    slots = [vehicle.get("slot") for vehicle in vehicles]
    free_slots = [slot for slot in range(size) if slot not in slots]
    copies = [
        {**source, "name": name, "slot": slot, "start_m": [*start_m], "depth_m": depth_m}
        for name, slot, (start_m, depth_m) in zip(new_names, free_slots, places, strict=False)
    ]
    return Copies({**raw, "vehicle": [*raw["vehicle"], *copies]}, tuple(new_names), original, size)


def _next_names(original: str, used: set[str], n_names: int) -> list[str]:
    """Names with the next free numbers.

    >>> _next_names("AUV02", {"AUV02", "AUV04"}, 2)
    ['AUV03', 'AUV05']
    """
    stem, digits = re.fullmatch(r"(.*?)(\d*)", original, re.DOTALL).groups()  # type: ignore[union-attr]  # always matches
    number, found = int(digits or 1), list[str]()
    while len(found) < n_names:
        number += 1
        name = f"{stem}{number:0{len(digits)}d}"
        if name not in used:
            found.append(name)
    return found


def _depth_m(vehicle: Raw, key: str = "depth_m") -> float:
    depth_m = vehicle.get(key, 0.0)
    return float(depth_m) if is_number(depth_m) else 0.0


def _shares(vehicle: Raw, layer_m: float) -> bool:
    return abs(_depth_m(vehicle) - layer_m) < LAYER_M


def _layers_m(original: Raw, vehicles: Sequence[Raw]) -> list[float]:
    """Layers above and below the original that no vehicle is in, the nearest first; its own depth if there is none."""
    own_m, limit_m = _depth_m(original), _depth_m(original, "depth_limit_m")
    steps = sorted(range(-MAX_VEHICLES, MAX_VEHICLES + 1), key=lambda step: (abs(step), -step))
    layers_m = [round(own_m + step * LAYER_M, 3) for step in steps]
    free_m = [m for m in layers_m if 0.0 < m <= limit_m and not any(_shares(vehicle, m) for vehicle in vehicles)]
    return free_m or [own_m]


def free_places(
    around_m: PointM, spacing_m: float, box: tuple[float, float, float, float], taken_m: Sequence[PointM], n_places: int
) -> list[PointM]:
    """The first ``n_places`` points of the lattice in the world that are ``spacing_m`` from all that are taken."""
    found: list[PointM] = []
    for ring in _rings(around_m, spacing_m, box):
        for place in ring:
            if _in(box, place) and all(distance(place, other) > 0.999 * spacing_m for other in taken_m):
                found.append(place)
        if len(found) >= n_places:
            break
    return found[:n_places]


def _rings(around_m: PointM, spacing_m: float, box: tuple[float, float, float, float]) -> Iterator[list[PointM]]:
    """Square rings of the lattice around a point of the world, itself first, as long as one reaches into the world."""
    (x_m, y_m), (x_min, y_min, x_max, y_max) = around_m, box
    reach_m = max(x_m - x_min, x_max - x_m, y_m - y_min, y_max - y_m)
    for ring in range(int(reach_m / spacing_m) + 1):
        steps = range(-ring, ring + 1)
        yield [
            (round(x_m + column * spacing_m, 3), round(y_m + row * spacing_m, 3))
            for row in steps
            for column in steps
            if max(abs(row), abs(column)) == ring
        ]


def _in(box: tuple[float, float, float, float], place: PointM) -> bool:
    return box[0] <= place[0] <= box[2] and box[1] <= place[1] <= box[3]


class _Start(NamedTuple):
    """Where a vehicle starts: its place in the list, its name, depth and position."""

    number: int
    name: object
    depth_m: float
    at_m: PointM

    def shares_layer(self, other: _Start) -> bool:
        """True if the two do not pass freely."""
        return abs(self.depth_m - other.depth_m) <= SAME_DEPTH_M


def with_starts_apart(raw: Raw) -> Raw:
    """The tables, with other starts where vehicles would start too near; as they are where there is no room for it."""
    separation_m, box = _separation_m(raw), bounds_of(raw)
    if separation_m is None or box is None or not all(map(math.isfinite, box)):
        return raw
    placed, moved = list[_Start](), dict[int, PointM]()
    for start in _starts(raw):
        near = [other.at_m for other in placed if start.shares_layer(other)]
        if any(distance(start.at_m, at_m) < separation_m - TOLERANCE_M for at_m in near):
            spacing_m = max(SPACING_M, separation_m)
            for at_m in free_places(start.at_m, spacing_m, box, near, 1):
                moved[start.number] = at_m
        placed.append(start._replace(at_m=moved.get(start.number, start.at_m)))
    if not moved:
        return raw
    vehicles = enumerate(raw["vehicle"])
    apart = [{**one, "start_m": [*moved[number]]} if number in moved else one for number, one in vehicles]
    return {**raw, "vehicle": apart}


def start_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Starts that are nearer to an earlier one in the same layer than vehicles are to come; each is said once."""
    separation_m = _separation_m(raw)
    if separation_m is None:
        return
    said = set()
    for other, start in itertools.combinations(_starts(raw), 2):
        distance_m = distance(start.at_m, other.at_m)
        if distance_m < separation_m - TOLERANCE_M and start.shares_layer(other) and start.name not in said:
            said.add(start.name)
            allowed = (
                f"{distance_m:.3g} m from the start of {other.name}, in the same depth layer, and no place is free; "
                f"allowed: guidance.separation_m = {separation_m:g} m or more, or a depth_m that differs by more "
                f"than {SAME_DEPTH_M:g} m"
            )
            yield ConfigurationFault(f"vehicle.{start.name}.start_m", f"[{start.at_m[0]}, {start.at_m[1]}]", allowed)


def _separation_m(raw: Raw) -> float | None:
    """How near vehicles may come; None if the key is malformed."""
    separation_m = table_of(raw, "guidance").get("separation_m", SEPARATION_M)
    return separation_m if type(separation_m) in (int, float) and math.isfinite(separation_m) else None


def _starts(raw: Raw) -> Iterator[_Start]:
    """Starts of the vehicles that have one."""
    listed = raw.get("vehicle")
    for number, vehicle in enumerate(listed if isinstance(listed, list) else []):
        depth_m = vehicle.get("depth_m", 0.0) if isinstance(vehicle, dict) else None
        if isinstance(depth_m, int | float) and math.isfinite(depth_m):
            for at_m in point_of(vehicle, "start_m"):
                yield _Start(number, vehicle.get("name"), depth_m, at_m)


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
