"""Arrows mission: archaeological survey from detection to identification of sites.

Objectives are assigned initially, so that vehicles start without messages::

    Searching(area)    of vehicles with an acoustic or magnetic detector: go where most information is expected
    Identifying(area)  of vehicles with a camera: identify anomalies
    Directing(area)    of the leader, only with mission.search = "central": order the others' targets
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from missions.arrows.behaviours import Directing, Identifying, Obeying, Searching, Sweeping
from missions.arrows.belief_map import (
    MOST_CELLS,
    MOST_PASSES,
    MOST_TILES,
    CellGrid,
    Chart,
    Seafloor,
    draw_seafloor,
    expected_of,
    grid_of,
    halved,
    total_of,
)
from missions.arrows.detectors import AcousticSettings, ClassifyingCameraSettings, DetectorSettings, MagneticSettings
from missions.arrows.scenario import DETECTORS, ArrowsScenario, KindTable
from missions.arrows.target_selection import Choosing, Hearers, Reach, contact_range_m
from missions.arrows.truth import FIGURES, FLEET_MAPS, IDENTIFIED, MAPS, METRICS, ArrowsTruth
from missions.errors import ConfigurationFault, one_of, repeated
from missions.figure import Place
from missions.meeting.job_mission import JobMission
from missions.meeting.meeting import OBJECTIVES, Pursuit
from missions.meeting.survey import rectangle, rows, to_and_fro
from missions.meeting.truth import JOBS
from missions.scenarios.fleet import database_of
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import FactsLike
from remoras.mission import Finding
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.work import Job, Point

SUM_TOLERANCE = 1e-6


def _area(scenario: ArrowsScenario) -> Iterator[ConfigurationFault]:
    search, grid = scenario.search, grid_of(scenario)
    for key in ("x_m", "y_m"):
        (low, high), (least, most) = getattr(search, key), getattr(scenario.world, key)
        if not least <= low < high <= most:
            allowed = f"within world.{key} = [{least:g}, {most:g}]"
            yield ConfigurationFault(f"search.{key}", f"[{low:g}, {high:g}]", allowed)
    if grid.n_cells > MOST_CELLS or grid.n_tiles > MOST_TILES:
        size = f"{grid.n_columns} x {grid.n_rows} cells"
        allowed = f"{size}; at most {MOST_CELLS} in {MOST_TILES} tiles of 4 x 4: take a larger side"
        yield ConfigurationFault("search.cell_m", f"{grid.cell_m:g}", allowed)


def _kinds(scenario: ArrowsScenario) -> Iterator[ConfigurationFault]:
    for name, times in repeated(kind.name for kind in scenario.kind):
        yield ConfigurationFault(f"kind.{name}.name", "", f"given {times} times; each kind has one table")
    grid = grid_of(scenario)
    # The fault of the grid is reported already; its arrays could exhaust the memory.
    if grid.n_cells > MOST_CELLS:
        return
    faults = [fault for kind in scenario.kind if kind.map for fault in _map(kind, grid)]
    yield from faults
    expected = {} if faults else {kind.name: expected_of(grid, kind, scenario) for kind in scenario.kind}
    if expected:
        fullest = float(total_of(list(expected.values())).max())
        name = max(expected, key=lambda name: float(expected[name].max()))
        if fullest > 1.0:
            allowed = "at most 1 of all kinds together: expect fewer, spread them farther, or take smaller cells"
            yield ConfigurationFault(f"kind.{name}.expected", f"{fullest:.3g} things in one cell", allowed)


def _map(kind: KindTable, grid: CellGrid) -> Iterator[ConfigurationFault]:
    key, rows = f"kind.{kind.name}.map", kind.map
    if len(rows) != grid.n_rows or any(len(row) != grid.n_columns for row in rows):
        sizes = " or ".join(str(size) for size in sorted({len(row) for row in rows}))
        allowed = f"{grid.n_rows} rows of {grid.n_columns} numbers: one for each cell, from the south-west"
        yield ConfigurationFault(key, f"{len(rows)} rows of {sizes}", allowed)
        return
    total = math.fsum(number for row in rows for number in row)
    if abs(total - 1.0) > SUM_TOLERANCE:
        yield ConfigurationFault(key, f"sums to {total:.6g}", "shares of all cells sum to 1")


AREA = "search area"
SEARCHING, IDENTIFYING, DIRECTING = "Searching", "Identifying", "Directing"
LANE_SHARE = 1.6  # lane spacing in ranges of the widest detector, with overlap
ANOMALIES_PER_CELL = 0.5  # upper limit of anomalies that a vehicle creates, per cell


class ArrowsMission(JobMission):
    """Arrows mission, built from a scenario."""

    Scenario = ArrowsScenario
    group_missions = ("Search",)
    objective, kind = SEARCHING, "SearchArea"
    other_objectives = (IDENTIFYING, DIRECTING)
    collective = (DIRECTING,)
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"),)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {
        "acoustic": AcousticSettings, "magnetic": MagneticSettings, "optical": ClassifyingCameraSettings,
    }  # fmt: skip
    tables = (JOBS, IDENTIFIED, MAPS, FLEET_MAPS)
    metrics = METRICS
    figures = FIGURES
    scenario: ArrowsScenario

    def __init__(self, scenario: ArrowsScenario) -> None:
        self.grid = grid_of(scenario)
        self._database = database_of(scenario, type(self))
        super().__init__(scenario)

    @classmethod
    def check(cls, scenario: ArrowsScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        yield from _area(scenario)
        yield from _kinds(scenario)
        kinds = [kind.name for kind in scenario.kind]
        for number, find in enumerate(scenario.historic_find, 1):
            key = f"historic_find.{number}"
            yield from one_of(f"{key}.kind", find.kind, kinds)
            yield from scenario.world.outside([(f"{key}.position_m", find.position_m)])
        for name in (*DETECTORS, "optical"):
            for kind in getattr(scenario.detector, name).p_detect:
                yield from one_of(f"detector.{name}.p_detect.{kind}", kind, kinds)
        carried = {sensor.get("type", DETECTORS[0]) for vehicle in scenario.vehicle for sensor in vehicle.sensor}
        if carried.isdisjoint(DETECTORS):
            allowed = f"no vehicle searches: one needs a [[vehicle.sensor]] of type {' or '.join(DETECTORS)}"
            yield ConfigurationFault("vehicle.sensor", "", allowed)

    # Content -------------------------------------------------------------------------------------

    def meets_from_s(self, scenario: ArrowsScenario) -> float:
        return scenario.mission.search_s

    def jobs_of(self, scenario: ArrowsScenario) -> Iterable[Job]:
        return ()

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [(self.kind, AREA)]

    @property
    def places(self) -> Sequence[Place]:
        outline_m = rectangle(self.scenario.search.x_m, self.scenario.search.y_m)
        return [*self.rally_places, Place(AREA, "search area", outline_m)]

    @property
    def instances_found_per_vehicle(self) -> int:
        """Upper limit: an anomaly in every other cell."""
        return max(64, int(ANOMALIES_PER_CELL * self.grid.n_cells))

    @property
    def most_observations(self) -> int:
        n_choices = int(self.scenario.scenario.duration_s)
        return MOST_PASSES * 2 * self.grid.n_tiles + 4 * self.grid.n_cells + n_choices

    def world(self, seed: int) -> Seafloor:
        return draw_seafloor(self.scenario, seed)

    def truth(self, recorder: Recorder, world: Seafloor) -> ArrowsTruth:
        return ArrowsTruth(self.meeting, self.scenario, recorder, world, self.chart, self.crew)

    def chart(self) -> Chart:
        """Return a map that equals the prior."""
        return Chart(self.scenario)

    # Activities ----------------------------------------------------------------------------------

    @property
    def crew(self) -> tuple[str, ...]:
        """Vehicles whose observations count: all."""
        return tuple(self._database)

    @property
    def searchers(self) -> tuple[str, ...]:
        """Vehicles with a sweeping detector, in slot order."""
        return tuple(name for name, data in self._database.items() if _numbers(data))

    @property
    def identifiers(self) -> tuple[str, ...]:
        """Vehicles with a camera."""
        return tuple(name for name, data in self._database.items() if _can(data, IDENTIFYING))

    @cached_property  # 70 ms, asked for each vehicle
    def reach(self) -> Reach:
        """Area of contact: the leader's rally point in a central search, else amid the expected sites."""
        settings, point = self.scenario.mission, next(iter(self.groups.values())).rally_point
        at_m = self.meeting.rally_points_m[point or ""]
        if settings.search != "central":
            grid, chart = self.grid, self.chart()
            sites = chart.sites(chart.prior)
            dx_m, dy_m = grid.x_m[:, None] - grid.x_m, grid.y_m[:, None] - grid.y_m
            # All vehicles know the prior, hence the cell with the least mean distance to the expected sites (median of
            # a network; Hakimi, Operations Research 12, 1964).
            at_m = grid.centre_m(int(np.argmin(halved(sites * np.sqrt(dx_m * dx_m + dy_m * dy_m)))))
        alone_s, greeting_s = (settings.alone_s, settings.greeting_s) if settings.contact else (math.inf, 0.0)
        return Reach(at_m, contact_range_m(self.scenario), alone_s, greeting_s, settings.contact_loss)

    def _choosing(self, data: VehicleData) -> Choosing:
        detectors, settings = self.scenario.detector, self.scenario.mission
        ranges_m = {number: getattr(detectors, DETECTORS[number]).range_m for number in _numbers(data)}
        again_s = {number: getattr(detectors, DETECTORS[number]).look_s for number in ranges_m}
        leaves_finds = bool(self.identifiers)
        return Choosing(
            ranges_m, again_s, data.survey_speed_mps, settings.repulsion, settings.repulsion_m, leaves_finds
        )

    def founding_objectives(self) -> Sequence[Objective]:
        """Supervision by leaders; search and identification by other initial roles, by equipment."""
        directing = (DIRECTING,) if self.scenario.mission.search == "central" else ()
        founding = [
            Objective(group.name, role.name, name, AREA)
            for group in self.groups.values()
            for role in group.roles
            if role.founding
            for name in (directing if role.head else (SEARCHING, IDENTIFYING))
        ]
        return [*super().founding_objectives(), *founding]

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        if objective.name in OBJECTIVES:
            return self.meeting.activity_sets(objective, data.name, facts)
        together = ("gatheredAt", objective.group)
        if facts.get(together) is not None or not _can(data, objective.name):
            return (), frozenset({together})
        sensors = tuple(sensor.name for sensor in data.sensors)
        directs = objective.name == DIRECTING
        doing = Activity(objective.name, ActivityType.PLANNING if directs else ActivityType.GUIDANCE, (AREA,), sensors)
        kind = ActivityKind.COLLECTIVE if directs else ActivityKind.INDIVIDUAL
        return (ActivitySet(objective, kind, (doing,), self.importance_of(objective)),), frozenset({together})

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        if (behaviour := self.meeting.behaviour(activity, data)) is not None:
            return behaviour
        settings = self.scenario.mission
        match activity.name, settings.search:
            case ("Identifying", _):
                reach = self.reach if settings.contact else None
                return Identifying(self.chart(), self.scenario, self.crew, self.searchers, data, reach)
            case ("Directing", _):
                choosing = {name: self._choosing(self._database[name]) for name in self.searchers}
                starts_m = {name: self._database[name].start_m for name in self.searchers}
                return Directing(self.chart(), choosing, self.reach, starts_m, settings.search_s)
            case ("Searching", "central"):
                return Obeying(self.reach, data, settings.search_s)
            case ("Searching", "lawnmower"):
                return Sweeping(self._lanes(data), data, settings.search_s)
            case ("Searching", _):
                others = tuple(name for name in self.searchers if name != data.name)
                listeners = [name for name in self.identifiers if name != data.name and settings.contact]
                speeds_mps = {name: self._database[name].transit_speed_mps for name in listeners}
                hearers = Hearers(speeds_mps, self.scenario.stay_s) if listeners else None
                return Searching(
                    self.chart(), self._choosing(data), self.reach, others, hearers, data, settings.search_s
                )
        raise PlanningError(f"activity {activity.name!r} has no behaviour")

    def _lanes(self, data: VehicleData) -> Sequence[Point]:
        west_m, east_m = self.scenario.search.x_m
        apart_m = LANE_SHARE * max(self._choosing(data).ranges_m.values())
        n, number = len(self.searchers), self.searchers.index(data.name)
        width_m = (east_m - west_m) / n
        own_m = west_m + number * width_m, west_m + (number + 1) * width_m
        corners_m = rectangle(own_m, self.scenario.search.y_m)
        return to_and_fro(rows(corners_m, apart_m, 0.0), corners_m[0])

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        """Return None: the search ends by time, without a report."""
        return None


def _numbers(data: VehicleData) -> tuple[int, ...]:
    return tuple(sorted({sensor.NUMBER for sensor in data.sensors if isinstance(sensor, DetectorSettings)}))


def _can(data: VehicleData, objective: str) -> bool:
    if objective == DIRECTING:
        return True
    return data.sensor(ClassifyingCameraSettings) is not None if objective == IDENTIFYING else bool(_numbers(data))
