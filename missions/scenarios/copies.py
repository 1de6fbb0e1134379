"""Fleet of a scenario: copies of vehicles up to a size, and starts that keep vehicles apart.

A copy is its original but for name (the next free number), slot (the next free), depth and start. Copies get a depth
layer each, as AUVs that work together do in practice: vehicles in layers pass freely. Where there are more copies than
layers, or none, as for surface vehicles, those that share a layer start ``spacing_m`` apart. With ``layers = false``
all copies stay in that of the original, where they keep clear of each other.

Many scenarios have vehicles start where their ship is, at one point. A vehicle that would start too near to one that is
listed before it starts at the nearest free place of a lattice around that point instead.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.files import shown
from missions.scenarios.scenario import MAX_VEHICLES, SPACING_M, Scenario, VehicleTable
from missions.scenarios.tables import one_of
from remoras.separation import SAME_DEPTH_M, TOLERANCE_M
from remoras.table import PointM

LAYER_M = 4.0
"""Between layers: more than ``remoras.separation.SAME_DEPTH_M``, up to which vehicles keep clear of each other."""


def of_copies(
    faults: Sequence[ConfigurationFault], scenario: Scenario, names: Sequence[str]
) -> list[ConfigurationFault]:
    """Faults of copies as faults of ``fleet.size``, once each; those that the original has too are its own.

    Args:
        faults: of the whole scenario.
        scenario: with the copies in it; names: of these.
    """
    fleet, own = getattr(scenario, "fleet", None), {(fault.key, fault.allowed) for fault in faults}
    found: list[ConfigurationFault] = []
    said: set[tuple[str, str]] = set()
    for fault in faults:
        kind, _, rest = fault.key.partition(".")
        name, _, key = rest.partition(".")
        if kind != "vehicle" or name not in names or fleet is None:
            found.append(fault)
        elif (f"vehicle.{fleet.copies_of}.{key}", fault.allowed) not in own and (key, fault.allowed) not in said:
            said.add((key, fault.allowed))
            copy = next(vehicle for vehicle in scenario.vehicle if vehicle.name == name)
            given = fault.given or shown(getattr(copy, key, ""))
            allowed = f"its copy {name} has {key} = {given}: {fault.allowed}"
            found.append(ConfigurationFault("fleet.size", "", allowed))
    return found


def with_copies(scenario: Scenario) -> tuple[Scenario, list[str], list[ConfigurationFault]]:
    """A scenario with its fleet at its size, names of the copies, and what is wrong with ``[fleet]``."""
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
    source, box = next(vehicle for vehicle in vehicles if vehicle.name == fleet.copies_of), scenario.world.box_m
    if not _in(box, source.start_m):
        return scenario, [], []  # which is told of the original
    layers_m = _layers_m(source, vehicles) if fleet.layers else [source.depth_m]
    taken_m = [one.start_m for one in vehicles if any(_shares(one, layer_m) for layer_m in layers_m)]
    starts_m = free_places(source.start_m, fleet.spacing_m, box, taken_m, math.ceil(n_copies / len(layers_m)))
    places = [(start_m, layer_m) for start_m in starts_m for layer_m in layers_m]
    if len(places) < n_copies:
        allowed = f"the world has room for {len(places)} of {n_copies} copies that start this far apart"
        return scenario, [], [ConfigurationFault("fleet.spacing_m", shown(fleet.spacing_m), allowed)]
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


def _shares(vehicle: VehicleTable, layer_m: float) -> bool:
    return abs(vehicle.depth_m - layer_m) < LAYER_M


def _layers_m(original: VehicleTable, vehicles: Sequence[VehicleTable]) -> list[float]:
    """Layers above and below the original that no vehicle is in, the nearest first; its own depth if there is none."""
    own_m, limit_m = original.depth_m, original.depth_limit_m
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


def with_starts_apart(scenario: Scenario) -> Scenario:
    """A scenario with other starts where vehicles would start too near, as far as there is room for it."""
    separation_m, box, placed = scenario.guidance.separation_m, scenario.world.box_m, list[VehicleTable]()
    for vehicle in scenario.vehicle:
        near = [other.start_m for other in placed if _meet(vehicle, other)]
        if any(distance(vehicle.start_m, at_m) < separation_m - TOLERANCE_M for at_m in near):
            free_m = free_places(vehicle.start_m, max(SPACING_M, separation_m), box, near, 1) or [vehicle.start_m]
            placed.append(vehicle.model_copy(update={"start_m": free_m[0]}))
        else:
            placed.append(vehicle)
    return scenario.model_copy(update={"vehicle": tuple(placed)})


def start_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Starts outside the world, or nearer to an earlier one in the same layer than vehicles are to come, once each."""
    yield from scenario.world.outside((f"vehicle.{one.name}.start_m", one.start_m) for one in scenario.vehicle)
    separation_m, said = scenario.guidance.separation_m, set()
    for other, vehicle in itertools.combinations(scenario.vehicle, 2):
        distance_m = distance(vehicle.start_m, other.start_m)
        if distance_m < separation_m - TOLERANCE_M and _meet(vehicle, other) and vehicle.name not in said:
            said.add(vehicle.name)
            allowed = (
                f"{distance_m:.3g} m from the start of {other.name}, in the same depth layer, and no place is free; "
                f"allowed: guidance.separation_m = {separation_m:g} m or more, or a depth_m that differs by more "
                f"than {SAME_DEPTH_M:g} m"
            )
            x_m, y_m = vehicle.start_m
            yield ConfigurationFault(f"vehicle.{vehicle.name}.start_m", f"[{x_m}, {y_m}]", allowed)


def _meet(one: VehicleTable, other: VehicleTable) -> bool:
    """True if the two do not pass freely."""
    return abs(one.depth_m - other.depth_m) <= SAME_DEPTH_M
