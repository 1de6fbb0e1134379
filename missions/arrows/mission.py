"""The mission: some vehicles sweep the sea for anomalies, others find out what these are, and then all meet.

Objectives of roles, which they have from the start, so that nobody has to be told anything to begin::

    Searching(area)    of vehicles with an acoustic or magnetic detector: go where most is to be learnt
    Identifying(area)  of vehicles with a camera: go to anomalies and find out what they are
    Directing(area)    of the head, under mission.search = "central" alone: say where others search

"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from missions.arrows.behaviours import Directing, Identifying, Obeying, Searching, Sweeping
from missions.arrows.chart import Chart
from missions.arrows.checks import arrows_faults
from missions.arrows.choosing import Choosing, lawnmower_track
from missions.arrows.contact import Hearers, Reach, contact_range_m
from missions.arrows.detectors import (
    AcousticSettings,
    ClassifyingCameraSettings,
    DetectorSettings,
    MagneticSettings,
)
from missions.arrows.figures import FIGURES
from missions.arrows.grid import MOST_PASSES, halved
from missions.arrows.metrics import METRICS
from missions.arrows.prior import grid_of, prior_of, rates_of
from missions.arrows.scenario import DETECTORS, ArrowsScenario
from missions.arrows.seafloor import Seafloor, draw_seafloor
from missions.arrows.truth import FLEET_MAPS, IDENTIFIED, MAPS, ArrowsTruth
from missions.errors import ConfigurationFault
from missions.figure import Declared, Place
from missions.meeting.job_mission import WORK, JobMission
from missions.meeting.meeting import OBJECTIVES, Pursuit, importance_of
from missions.meeting.truth import JOBS
from missions.metric import Metric
from missions.scenarios.parts import database_of
from missions.scenarios.tables import Raw
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import FactsLike
from remoras.mission import Finding
from remoras.recorder import Recorder, Table
from remoras.sensor import SensorSettings
from remoras.work import Job, Point

AREA = "search area"
SEARCHING, IDENTIFYING, DIRECTING = "Searching", "Identifying", "Directing"
LANE_SHARE = 1.6
"""Lanes of a lawnmower are so many ranges of the widest detector apart, so that they overlap."""
ANOMALIES_PER_CELL = 0.5
"""Anomalies that a vehicle may come to make, for each cell."""


class ArrowsMission(JobMission):
    """The mission, made from a scenario."""

    Scenario = ArrowsScenario
    group_missions = ("Search",)
    objective, kind = SEARCHING, "SearchArea"
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"),)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {
        "acoustic": AcousticSettings, "magnetic": MagneticSettings, "optical": ClassifyingCameraSettings,
    }  # fmt: skip
    tables: ClassVar[tuple[Table, ...]] = (JOBS, IDENTIFIED, MAPS, FLEET_MAPS)
    metrics: ClassVar[tuple[Metric, ...]] = METRICS
    figures: ClassVar[tuple[Declared, ...]] = FIGURES
    scenario: ArrowsScenario

    def __init__(self, scenario: ArrowsScenario) -> None:
        self.grid, self.prior, self.rates = grid_of(scenario), prior_of(scenario), rates_of(scenario)
        self._database = database_of(scenario, type(self))
        super().__init__(scenario)

    @classmethod
    def check(cls, raw: Raw) -> Iterable[ConfigurationFault]:
        """What is wrong with the area, the priors and the detectors."""
        return arrows_faults(raw)

    # What there is -------------------------------------------------------------------------------

    def meets_from_s(self, scenario: ArrowsScenario) -> float:
        """Nobody meets before the search ends."""
        return scenario.mission.search_s

    def jobs_of(self, scenario: ArrowsScenario) -> Iterable[Job]:
        """No job is given away: every vehicle has its objective from the start."""
        return ()

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        """The area."""
        return [(self.kind, AREA)]

    @property
    def places(self) -> Sequence[Place]:
        """Rally points and the area."""
        (west_m, east_m), (south_m, north_m) = self.scenario.search.x_m, self.scenario.search.y_m
        outline_m = (west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m)
        points = [Place(name, "rally point", (at_m,)) for name, at_m in self._rally_points_m.items()]
        return [*points, Place(AREA, "search area", outline_m)]

    @property
    def instances_found_per_vehicle(self) -> int:
        """One for every other cell: that many contacts would be a fault of a detector."""
        return max(64, int(ANOMALIES_PER_CELL * self.grid.n_cells))

    @property
    def most_observations(self) -> int:
        """Passes over tiles, contacts, images, choices and conclusions."""
        n_choices = int(self.scenario.scenario.duration_s)
        return MOST_PASSES * 2 * self.grid.n_tiles + 4 * self.grid.n_cells + n_choices

    def world(self, seed: int) -> Seafloor:
        """What really lies there in the run with that seed."""
        return draw_seafloor(self.grid, self.prior, self.scenario, self.rates, seed)

    def truth(self, recorder: Recorder, world: Seafloor) -> ArrowsTruth:
        """Notes what was really found and identified, and how the maps of vehicles get on."""
        return ArrowsTruth(self.meeting, self.scenario, recorder, world, self.chart, self.crew)

    def chart(self) -> Chart:
        """A map of which nothing but the prior is known."""
        return Chart(self.grid, self.prior, self.rates, self.scenario.names)

    # Who does what -------------------------------------------------------------------------------

    @cached_property
    def crew(self) -> tuple[str, ...]:
        """Vehicles whose looks count: all."""
        return tuple(self._database)

    @cached_property
    def searchers(self) -> tuple[str, ...]:
        """Vehicles with a detector that sweeps, in the order of their slots."""
        return tuple(name for name, data in self._database.items() if _numbers(data))

    @cached_property
    def identifiers(self) -> tuple[str, ...]:
        """Vehicles with a camera."""
        return tuple(name for name, data in self._database.items() if _can(data, IDENTIFYING))

    @cached_property
    def reach(self) -> Reach:
        """Where vehicles are in contact: around the rally point of the first group, where its head is.

        Who decides for itself is in contact around the cell from which the sites that are expected are nearest in the
        mean (the median of a network; Hakimi, Operations Research 12, 1964), which all know by the prior.
        """
        settings, point = self.scenario.mission, next(iter(self._groups.values())).rally_point
        at_m = self._rally_points_m[point or ""]
        if settings.search != "central":
            grid, sites = self.grid, self.chart().sites(self.prior)
            dx_m, dy_m = grid.x_m[:, None] - grid.x_m, grid.y_m[:, None] - grid.y_m
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
        """Heads supervise; whoever founds the group searches, or identifies, by what it carries."""
        names = [SEARCHING, IDENTIFYING]
        founding = [
            Objective(group.name, role.name, name, AREA)
            for group in self._groups.values()
            for role in group.roles
            if role.founding
            for name in ([DIRECTING] if role.head and self.scenario.mission.search == "central" else [])
            + ([] if role.head else names)
        ]
        return [*super().founding_objectives(), *founding]

    def is_individual(self, objective: Objective) -> bool:
        """True for searching and identifying."""
        return objective.name in (SEARCHING, IDENTIFYING)

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        """Those of the meeting; one activity for the rest, for whoever carries what it takes."""
        if objective.name in OBJECTIVES:
            return self.meeting.activity_sets(objective, data.name, facts)
        together = ("gatheredAt", objective.group)
        if facts.get(together) is not None or not _can(data, objective.name):
            return (), frozenset({together})
        sensors = tuple(sensor.name for sensor in data.sensors)
        directs = objective.name == DIRECTING
        doing = Activity(objective.name, ActivityType.PLANNING if directs else ActivityType.GUIDANCE, (AREA,), sensors)
        kind = ActivityKind.COLLECTIVE if directs else ActivityKind.INDIVIDUAL
        importance = importance_of(
            {objective.name: self.meeting.importance[WORK], **self.meeting.importance}, objective
        )
        return (ActivitySet(objective, kind, (doing,), importance),), frozenset({together})

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """The behaviour of an activity, as ``mission.search`` says."""
        if (found := self.meeting.behaviour(activity, data)) is not None:
            return found
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
                told = [name for name in self.identifiers if name != data.name and settings.contact]
                speeds_mps = {name: self._database[name].transit_speed_mps for name in told}
                hearers = Hearers(speeds_mps, self.scenario.stay_s) if told else None
                return Searching(
                    self.chart(), self._choosing(data), self.reach, others, hearers, data, settings.search_s
                )
        raise PlanningError(f"activity {activity.name!r} has no behaviour")

    def _lanes(self, data: VehicleData) -> Sequence[Point]:
        """Lanes in the part of the area that is this vehicle's: as many parts as vehicles search, side by side."""
        (west_m, east_m), (south_m, north_m) = self.scenario.search.x_m, self.scenario.search.y_m
        apart_m = LANE_SHARE * max(self._choosing(data).ranges_m.values())
        n, number = len(self.searchers), self.searchers.index(data.name)
        width_m = (east_m - west_m) / n
        return lawnmower_track(west_m + number * width_m, south_m, west_m + (number + 1) * width_m, north_m, apart_m)

    def behaviour_at(self, job: Job, data: VehicleData) -> Behaviour:
        """There are no jobs."""
        raise PlanningError(f"job {job.name!r} is unknown")

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        """The search ends by the clock, which all can read: nothing has to be said."""
        return None


def _numbers(data: VehicleData) -> tuple[int, ...]:
    """Numbers of the detectors that a vehicle carries."""
    return tuple(sorted({sensor.NUMBER for sensor in data.sensors if isinstance(sensor, DetectorSettings)}))


def _can(data: VehicleData, objective: str) -> bool:
    if objective == DIRECTING:
        return True
    return data.sensor(ClassifyingCameraSettings) is not None if objective == IDENTIFYING else bool(_numbers(data))
