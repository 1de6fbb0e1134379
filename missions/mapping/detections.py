"""Detected features, and their inspection by a second vehicle.

A mapping sensor that maps the cell of a feature finds it: the fact ``foundAt`` makes its job known. The job is a
second, closer pass: the vehicle goes there and stays, slowly and near, until its sensor has seen enough. How long that
takes only shows on site; plans expect the mean. Where features lie and how long each takes is drawn by seed and number,
in a stream of its own. So no strategy, loss rate or fault changes a feature, and more of them leave the first ones as
they are.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import ClassVar

from exchange.acoustics import loss
from missions.mapping.scenario import FindsTable, MappingRole, MappingScenario
from missions.mapping.sensors import Cell, Seabed, SeabedFeature, SeaObject, Stays, mapping_speed_mps, swath_m
from missions.meeting.job_mission import with_needs
from remoras.activities import Objective
from remoras.behaviours import (
    ADVANCING,
    CAPTURE_M,
    DONE,
    DUE,
    FAILED,
    IDLE,
    Approach,
    Behaviour,
    Perception,
    Reference,
    attracted,
    distance_m,
)
from remoras.beliefs import Key, Known
from remoras.database import VehicleData
from remoras.mission import VehicleView
from remoras.motion import Motion
from remoras.organisation import Group
from remoras.picture import Picture
from remoras.work import Outlook, Point

INSPECTING = "Inspecting"
"""Objective of a role with a find."""
NEEDED = ("foundAt", "inspectedBy")
"""Attributes that vehicles need of each other where there is something to be found."""


def find_names(number: int) -> tuple[str, ...]:
    """Names of so many features.

    >>> find_names(2)
    ('find 1', 'find 2')
    """
    return tuple(f"find {n}" for n in range(1, number + 1))


def seabed_with_finds(seabed: Seabed, finds: FindsTable, seed: int, objects: tuple[SeaObject, ...] = ()) -> Seabed:
    """The seabed with the features of the run with that seed: each in a cell of its own, every cell as likely.

    Args:
        seabed: cells of all areas, at least as many as there are features.
        finds: how many there are, and what they ask for.
        seed: root of all draws.
        objects: that lie in the sea.
    """
    if not (finds.number or objects):
        return seabed
    free = list(seabed.cells)
    lying: dict[Cell, SeabedFeature] = {}
    for number, name in enumerate(find_names(finds.number)):
        where, how_long = (loss.uniform(seed, loss.FINDS, number, 0, which) for which in (0, 1))
        cell = free.pop(int(where * len(free)))
        at_m = (cell[0] + 0.5) * seabed.cell_m, (cell[1] + 0.5) * seabed.cell_m
        stay_s = finds.shortest_stay_s + how_long * (finds.longest_stay_s - finds.shortest_stay_s)
        lying[cell] = SeabedFeature(name, at_m, stay_s, finds.close_radius_m, finds.close_speed_mps)
    return replace(seabed, features=lying, objects=objects, seed=seed)


def weight_in_cells(finds: FindsTable, cell_m: float, able: Sequence[VehicleData]) -> float:
    """How many cells a find counts for in the goal: its mean stay over the mean time that a cell takes.

    Args:
        finds: what they ask for.
        cell_m: side of a cell.
        able: vehicles that map.
    """
    if not able:
        return 1.0
    cell_s = math.fsum(cell_m * cell_m / (swath_m(data) * mapping_speed_mps(data)) for data in able) / len(able)
    return finds.mean_stay_s / cell_s


@dataclass(frozen=True)
class InspectionJob:
    """The closer pass at a find: a ``remoras.work.DivisibleJob`` that comes up when somebody says where it is.

    Attributes:
        name: of the find.
        stay_s: mean of how long it takes on site.
        place_m: where it was found; the origin of the map before.
        share_left: 1 until it is done, then 0.
        needs: nothing must be done before.
        resumed: who takes it over begins anew.
    """

    name: str
    stay_s: float
    place_m: Point = (0.0, 0.0)
    share_left: float = 1.0
    needs: tuple[str, ...] = ()
    resumed: ClassVar[bool] = False

    @property
    def done(self) -> Key:
        """Somebody has inspected it."""
        return "inspectedBy", self.name

    def is_able(self, data: VehicleData) -> bool:
        """True if the vehicle has a mapping sensor."""
        return swath_m(data) > 0.0

    def left(self, facts: Known) -> InspectionJob | None:
        """The job at the place known; None while nobody has said where it is."""
        place_m = facts.get(("foundAt", self.name))
        if place_m is None:
            return None
        return replace(self, place_m=place_m, share_left=1.0 if facts.get(self.done) is None else 0.0)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """When the vehicle will be free if it inspects the find next: its way, and a stay of mean length."""
        if not self.is_able(data):
            return None
        if self.share_left == 0.0:
            return outlook
        return outlook.stayed(self.place_m, self.stay_s, data)


def inspecting(groups: Iterable[Group], inspections: Collection[str]) -> list[Objective]:
    """To inspect, for every role with a find."""
    return [
        Objective(group.name, role.name, INSPECTING, role.job)
        for group in groups
        for role in group.roles
        if role.job is not None and role.job in inspections
    ]


# What a scenario gains ---------------------------------------------------------------------------


def with_inspectors(scenario: MappingScenario) -> MappingScenario:
    """A scenario with a role for each find, and what comes with it; as it is where nothing is to be found.

    The roles join those that explore areas, in the first group that has such roles, or are those of the group that this
    one forms at sea. Every vehicle that has a sensor and is able to explore is able to play them, unless some vehicle
    lists them itself. What is listed already stays.
    """
    areas = {area.name for area in scenario.area}
    exploring = [key for key, role in scenario.roles.items() if role.job in areas]
    explorers = next((group for group in scenario.group if group.name in dict(exploring)), None)
    if not scenario.n_finds or explorers is None:
        return scenario
    chosen = next((group for group in scenario.group if group.formed_by == explorers.name), explorers)
    roles = {f"Inspector{n}": find for n, find in enumerate(find_names(scenario.n_finds), 1)}
    new = [MappingRole(name=name, maximum=1, job=find) for name, find in roles.items() if name not in chosen.role_names]
    with_roles = chosen.model_copy(update={"role": (*chosen.role, *new)})
    played = {role for vehicle in scenario.vehicle for role in vehicle.playable_roles or ()}
    unplayed = tuple(role for role in roles if role not in played)
    vehicles = [
        one.model_copy(update={"playable_roles": (*(one.playable_roles or ()), *unplayed)})
        if one.sensor and any(one.can_play(*role) for role in exploring)
        else one
        for one in scenario.vehicle
    ]
    importance = scenario.mission.importance
    if "Exploring" in importance and not any(key.split(".")[-1] == INSPECTING for key in importance):
        importance = {**importance, INSPECTING: importance["Exploring"]}
    found = scenario.model_copy(
        update={
            "group": tuple(with_roles if group is chosen else group for group in scenario.group),
            "vehicle": tuple(vehicles),
            "mission": scenario.mission.model_copy(update={"importance": importance}),
        }
    )
    needs = scenario.communication.needs
    return with_needs(found, dict.fromkeys(NEEDED, max(needs.values()))) if needs else found


BRAKING_S = 2.0
"""A vehicle begins to slow down so much earlier than it must."""
PATIENCE_S = 60.0
"""A vehicle that has been on site so much longer than any find takes has a sensor that shows nothing."""


class Inspecting(Behaviour):
    """Goes to a find in transit and stays on site until the sensor has seen enough, which nobody can tell before.

    Args:
        find: its name.
        finds: how near and how slowly it is inspected, and how long that may take.
        data: of the vehicle.
    """

    def __init__(self, find: str, finds: FindsTable, data: VehicleData) -> None:
        self._find = find
        self._finds = finds
        self._transit_mps = data.transit_speed_mps
        fast_mps, slow_mps = data.transit_speed_mps, finds.close_speed_mps
        braking_m = (fast_mps - slow_mps) * (fast_mps + slow_mps) / (2.0 * data.acceleration_mps2)
        self._slow_within_m = finds.close_radius_m + max(0.0, braking_m) + BRAKING_S * data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._on_site_s = 0.0
        self._seen_s: float | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due once the find is known, the less the farther away; on site it advances for as long as a find may take.

        It has failed where nothing is seen on site for longer.
        """
        place_m, now_s = self._place(picture), picture.body.now_s
        if place_m is None:
            return IDLE
        if picture.facts.get(("inspectedBy", self._find)) is not None:
            return DONE
        to_go_m = distance_m(motion, place_m)
        is_on_site = performed and to_go_m <= self._finds.close_radius_m
        if is_on_site and self._seen_s is not None:
            self._on_site_s += now_s - self._seen_s
        self._seen_s = now_s if is_on_site else None
        if self._on_site_s > self._finds.longest_stay_s + PATIENCE_S:
            return FAILED
        if to_go_m <= self._finds.close_radius_m:
            return ADVANCING if performed else DUE
        advance = self._approach.advance(to_go_m, now_s, performed)
        return Perception(attracted(to_go_m).stimulus, None if advance is None else max(0.0, advance))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the find in transit, slowly over the last metres; there it stays. None while it is not known."""
        place_m = self._place(picture)
        if place_m is None:
            return None
        to_go_m = distance_m(motion, place_m)
        if to_go_m <= CAPTURE_M:
            return Reference(place_m, 0.0)
        if to_go_m > self._slow_within_m:
            return Reference(place_m, self._transit_mps)
        return Reference(place_m, self._finds.close_speed_mps, is_over_ground=True)

    def _place(self, picture: Picture) -> Point | None:
        place_m: Point | None = picture.facts.get(("foundAt", self._find))
        return place_m


class FindsWatch:
    """Watches the features of one run from outside.

    Args:
        seabed: with the features that lie in it.
    """

    def __init__(self, seabed: Seabed) -> None:
        self._seabed = seabed
        self._stays: dict[str, Stays] = {}
        self._finders: dict[str, set[str]] = {}  # vehicles that have found each
        self._inspected: set[str] = set()

    def is_new(self, cell: Cell, vehicle: str) -> bool:
        """Note that a vehicle has covered a cell; True if a feature lies there that nobody had found."""
        feature = self._seabed.features.get(cell)
        if feature is None:
            return False
        finders = self._finders.setdefault(feature.name, set())
        finders.add(vehicle)
        return len(finders) == 1

    def n_inspected_by(self, vehicle: VehicleView, now_s: float) -> int:
        """How many features a vehicle has inspected with this look that nobody had."""
        stays = self._stays.setdefault(vehicle.name, Stays())
        over = stays.inspected(self._seabed, vehicle.position_m, vehicle.speed_mps, now_s)
        new = {feature.name for feature in over} - self._inspected
        self._inspected |= new
        return len(new)

    @property
    def n_inspected(self) -> int:
        """How many features have been inspected."""
        return len(self._inspected)

    def has_open(self, left: Set[str]) -> bool:
        """True while a vehicle of those that are left has found something that nobody has inspected."""
        return any(
            not finders.isdisjoint(left) for name, finders in self._finders.items() if name not in self._inspected
        )

    def n_within_reach(self, able: Mapping[str, bool]) -> int:
        """How many features are not inspected though somebody left could find or has found them, and inspect them.

        Args:
            able: by area, whether a vehicle that is able to map it is left.
        """
        if not any(able.values()):
            return 0
        cells = self._seabed.cells
        return sum(
            able[cells[cell][0]] or feature.name in self._finders
            for cell, feature in self._seabed.features.items()
            if feature.name not in self._inspected
        )
