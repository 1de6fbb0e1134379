"""Mission: vehicles service each buoy, some after others, and report detected drifters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from missions.meeting import StayJob
from missions.scenarios import Name, PointM, Section
from remoras import (
    SELF, TIME, VEHICLE, Better, Column, Figure, JobMission, JobScenario, JobSettings, Mark, Metric, Observation,
    SensorSettings, Table,
)  # fmt: skip

SIGHTINGS = Table("sightings", (TIME, VEHICLE, Column("x_m", "float", "m"), Column("y_m", "float", "m")))


# Additional scenario content: tables [[buoy]], a key of [mission]
class BuoyTable(Section):
    name: Name = Field(description="name of the buoy")
    position_m: PointM = Field(description="position, x east, y north")
    service_s: float = Field(60.0, gt=0.0, description="duration of servicing it")
    after: tuple[str, ...] = Field((), description="name of each buoy to service before")


class BuoySettings(JobSettings):
    drifters_m: tuple[PointM, ...] = Field((), description="positions of drifters, unknown to vehicles")


class BuoyScenario(JobScenario):
    mission: BuoySettings = BuoySettings()
    buoy: tuple[BuoyTable, ...] = Field(min_length=1)


# A job: the data that a strategy needs to assign it; a vehicle does this one by a stay
@dataclass(frozen=True, kw_only=True)
class Service(StayJob):
    needs: tuple[str, ...]


# A sensor: a detection becomes an instance with a position, and a table row
class LookoutSettings(SensorSettings):
    range_m: float = Field(60.0, gt=0.0, description="maximum range to a drifter")

    def make(self, data):
        return Lookout(self.range_m)


class Lookout:
    table = SIGHTINGS

    def __init__(self, range_m):
        self._range_m, self._seen = range_m, set()

    def sense(self, pose, world, now_s):
        near = [at_m for at_m in world if math.dist(at_m, (pose.x_m, pose.y_m)) <= self._range_m]
        new = [at_m for at_m in near if at_m not in self._seen]
        self._seen.update(new)
        return [Observation(found="Drifter", facts=((SELF, "location", at_m),), row=at_m) for at_m in new]


# Metrics and a figure of the results
def serviced_fraction(run):
    return len({buoy for _, _, buoy in run.recorder.rows("jobs")}) / len(run.scenario.buoy)


def mean_service_s(run):
    first_s = {buoy: time_s for time_s, _, buoy in reversed(run.recorder.rows("jobs"))}
    return sum(first_s.values()) / len(first_s) if first_s else None


def draw_services(axes, results, style):
    times_s = [row["time_s"] for row in results.table("jobs").to_pylist()]
    axes.step([0.0, *times_s], range(len(times_s) + 1), where="post", color=style.black, label="fleet")
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("jobs done"))
    return "A buoy that two vehicles serviced counts twice."


class BuoyMission(JobMission):
    Scenario = BuoyScenario
    group_missions = ("BuoyService",)
    objective, kind = "Servicing", "Buoy"
    needs = (*JobMission.needs, "objectiveServicing", "jobDone")
    vocabulary = (Path(__file__).with_name("buoys.ttl"),)
    sensors = {"lookout": LookoutSettings}
    metrics = (
        Metric("serviced_fraction", "", Better.HIGHER, "serviced share", serviced_fraction, headline=True),
        Metric("mean_service_s", "s", Better.LOWER, "mean time of service", mean_service_s, headline=True),
    )
    figures = (
        Figure("services", "Jobs done over mission time", draw_services, needs=("jobs",)),
        Mark("job_done", "buoy serviced"),
    )

    def jobs_of(self, scenario):
        return [Service(buoy.name, buoy.position_m, buoy.service_s, needs=buoy.after) for buoy in scenario.buoy]

    def world(self, seed):
        return self.scenario.mission.drifters_m

    @property
    def instances_found_per_vehicle(self):
        return len(self.scenario.mission.drifters_m)
