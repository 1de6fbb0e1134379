"""Detected features, and their inspection by a second, closer pass (``docs/model/mapping.md``)."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from dataclasses import replace

from exchange.channel import loss
from missions.mapping.behaviours import braking_m
from missions.mapping.scenario import FindsTable, MappingRole, MappingScenario
from missions.mapping.sensors import Cell, ObjectTable, Seabed, SeabedFeature, Stays, mapping_speed_mps, swath_m
from missions.meeting.job_mission import ReportedJob, numbered, playing, with_needs
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
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.mission import VehicleView
from remoras.motion import Motion
from remoras.organisation import Group
from remoras.picture import Picture

INSPECTING = "Inspecting"
NEEDED = ("foundAt", "inspectedBy")


def seabed_with_finds(seabed: Seabed, finds: FindsTable, seed: int, objects: tuple[ObjectTable, ...] = ()) -> Seabed:
    """Return the seabed with a run's sampled features: at most one per cell, equally likely."""
    if not (finds.number or objects):
        return seabed
    free = list(seabed.cells)
    lying: dict[Cell, SeabedFeature] = {}
    # Draws are keyed by number, so a larger number leaves the first features unchanged.
    for number, name in enumerate(numbered("find", finds.number)):
        where, how_long = (loss.uniform(seed, loss.FINDS, number, 0, which) for which in (0, 1))
        cell = free.pop(int(where * len(free)))
        at_m = (cell[0] + 0.5) * seabed.cell_m, (cell[1] + 0.5) * seabed.cell_m
        stay_s = finds.shortest_stay_s + how_long * (finds.longest_stay_s - finds.shortest_stay_s)
        lying[cell] = SeabedFeature(name, at_m, stay_s, finds.close_radius_m, finds.close_speed_mps)
    return replace(seabed, features=lying, objects=objects, seed=seed)


def weight_in_cells(finds: FindsTable, cell_m: float, able: Sequence[VehicleData]) -> float:
    """Weight of a find in the goal: its mean dwell over the mean time per cell of ``able``."""
    if not able:
        return 1.0
    cell_s = math.fsum(cell_m * cell_m / (swath_m(data) * mapping_speed_mps(data)) for data in able) / len(able)
    return finds.mean_stay_s / cell_s


class InspectionJob(ReportedJob):
    """Closer pass at a reported find with a mapping sensor."""

    placed_by = "foundAt"

    @property
    def done(self) -> Key:
        return "inspectedBy", self.name

    def is_able(self, data: VehicleData) -> bool:
        return swath_m(data) > 0.0


def inspecting(groups: Iterable[Group], inspections: Collection[str]) -> list[Objective]:
    """Return an inspection objective for every role with a find."""
    return [
        Objective(group.name, role.name, INSPECTING, role.job)
        for group in groups
        for role in group.roles
        if role.job is not None and role.job in inspections
    ]


# Additions to a scenario ------------------------------------------------------------------------


def with_inspectors(scenario: MappingScenario) -> MappingScenario:
    """Return the scenario with an inspector role per find, in the first exploring group or the one that it forms."""
    areas = {area.name for area in scenario.area}
    exploring = [key for key, role in scenario.roles.items() if role.job in areas]
    explorers = next((group for group in scenario.group if group.name in dict(exploring)), None)
    if not scenario.n_finds or explorers is None:
        return scenario
    chosen = next((group for group in scenario.group if group.formed_by == explorers.name), explorers)
    roles = {f"Inspector{n}": find for n, find in enumerate(numbered("find", scenario.n_finds), 1)}
    new = [MappingRole(name=name, maximum=1, job=find) for name, find in roles.items() if name not in chosen.role_names]
    with_roles = chosen.model_copy(update={"role": (*chosen.role, *new)})
    # A scenario that lists an inspector role for some vehicle has chosen its inspectors itself.
    played = {role for vehicle in scenario.vehicle for role in vehicle.playable_roles or ()}
    unplayed = tuple(role for role in roles if role not in played)
    vehicles = [
        playing(v, unplayed) if v.sensor and any(v.can_play(*role) for role in exploring) else v
        for v in scenario.vehicle
    ]
    importance = scenario.mission.importance
    if "Exploring" in importance and not any(key.split(".")[-1] == INSPECTING for key in importance):
        importance = {**importance, INSPECTING: importance["Exploring"]}
    completed = scenario.model_copy(
        update={
            "group": tuple(with_roles if group is chosen else group for group in scenario.group),
            "vehicle": tuple(vehicles),
            "mission": scenario.mission.model_copy(update={"importance": importance}),
        }
    )
    needs = scenario.communication.needs
    return with_needs(completed, dict.fromkeys(NEEDED, max(needs.values()))) if needs else completed


PATIENCE_S = 60.0  # time on site beyond the longest dwell after which a sensor is presumed dead


class Inspecting(Behaviour):
    """Inspection of a find: transit, then dwell until the sensor has seen enough."""

    def __init__(self, find: str, finds: FindsTable, data: VehicleData) -> None:
        self._find = find
        self._finds = finds
        self._transit_mps = data.transit_speed_mps
        self._slow_within_m = finds.close_radius_m + braking_m(data, finds.close_speed_mps)
        self._approach = Approach(data.transit_speed_mps)
        self._on_site_s = 0.0
        self._seen_s: float | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending once the find is known; fails ``PATIENCE_S`` after the longest dwell on site."""
        place_m, now_s = picture.facts.get(("foundAt", self._find)), picture.body.now_s
        if place_m is None:
            return IDLE
        if picture.facts.get(("inspectedBy", self._find)) is not None:
            return DONE
        to_go_m = distance_m(motion, place_m)
        is_on_site = performed and to_go_m <= self._finds.close_radius_m
        # Only time between two observations on site counts, so that several visits add up.
        if is_on_site and self._seen_s is not None:
            self._on_site_s += now_s - self._seen_s
        self._seen_s = now_s if is_on_site else None
        if self._on_site_s > self._finds.longest_stay_s + PATIENCE_S:
            return FAILED
        # The sensor shows no partial result, so the wait on site counts as progress.
        if to_go_m <= self._finds.close_radius_m:
            return ADVANCING if performed else DUE
        advance = self._approach.advance(to_go_m, now_s, performed)
        return Perception(attracted(to_go_m).stimulus, None if advance is None else max(0.0, advance))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Head for the find in transit, brake near it, then hold; None while its place is unknown."""
        place_m = picture.facts.get(("foundAt", self._find))
        if place_m is None:
            return None
        to_go_m = distance_m(motion, place_m)
        if to_go_m <= CAPTURE_M:
            return Reference(place_m, 0.0)
        if to_go_m > self._slow_within_m:
            return Reference(place_m, self._transit_mps)
        return Reference(place_m, self._finds.close_speed_mps, is_over_ground=True)


class FindsWatch:
    """Ground truth of the features of one run."""

    def __init__(self, seabed: Seabed) -> None:
        self._seabed = seabed
        self._stays: dict[str, Stays] = {}
        self._finders: dict[str, set[str]] = {}  # vehicles that have found each
        self._inspected: set[str] = set()

    def is_new(self, cell: Cell, vehicle: str) -> bool:
        """Record a cell covered by a vehicle; return True if it holds a feature not detected before."""
        feature = self._seabed.features.get(cell)
        if feature is None:
            return False
        finders = self._finders.setdefault(feature.name, set())
        finders.add(vehicle)
        return len(finders) == 1

    def n_inspected_by(self, vehicle: VehicleView, now_s: float) -> int:
        """Return the number of features that this observation of a vehicle inspects first."""
        stays = self._stays.setdefault(vehicle.name, Stays())
        over = stays.inspected(self._seabed, vehicle.position_m, vehicle.speed_mps, now_s)
        new = {feature.name for feature in over} - self._inspected
        self._inspected |= new
        return len(new)

    @property
    def n_inspected(self) -> int:
        """Number of inspected features."""
        return len(self._inspected)

    def has_open(self, left: Set[str]) -> bool:
        """Return True if vehicles ``left`` have detected a feature that is still uninspected."""
        return any(
            not finders.isdisjoint(left) for name, finders in self._finders.items() if name not in self._inspected
        )

    def n_within_reach(self, able: Mapping[str, bool]) -> int:
        """Number of uninspected features that remaining vehicles can inspect; ``able`` is by area."""
        if not any(able.values()):
            return 0
        cells = self._seabed.cells
        return sum(
            # An undetected feature needs a vehicle able to map its area, a detected one any mapping sensor.
            able[cells[cell][0]] or feature.name in self._finders
            for cell, feature in self._seabed.features.items()
            if feature.name not in self._inspected
        )
