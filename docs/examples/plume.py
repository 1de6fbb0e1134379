"""Mission: vehicles trace the edges of an oil plume, strip by strip down the current, and share the places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from missions.scenarios import Name, PointM, Section
from remoras import (
    ADVANCING, DONE, DUE, SELF, TIME, VEHICLE, Behaviour, Better, Column, JobMission, JobScenario, JobSettings,
    Layer, Metric, Observation, Outlook, Reference, SensorSettings, Table, distance_m,
)  # fmt: skip

EDGES = Table("edges", (TIME, VEHICLE, Column("x_m", "float", "m"), Column("y_m", "float", "m")))
TURN_M = 15.0
"""Distance beyond the edge at which a vehicle turns, since the plume may be ragged."""


class Plume(Section):
    """Ground truth: oil that the current carries east from a leak in a widening plume."""

    leak_m: PointM = Field((0.0, 0.0), description="place of the leak")
    width_m: float = Field(20.0, gt=0.0, description="half width at the leak")
    spread: float = Field(0.1, ge=0.0, description="gain of half width per metre down the current")

    def half_width_m(self, x_m):
        return self.width_m + self.spread * (x_m - self.leak_m[0])

    def holds(self, x_m, y_m):
        return x_m >= self.leak_m[0] and abs(y_m - self.leak_m[1]) <= self.half_width_m(x_m)


class StripTable(Section):
    name: Name = Field(description="name of the strip")
    start_m: PointM = Field(description="start of a vehicle, at the western border of the strip")
    length_m: float = Field(gt=0.0, description="length of the strip to the east")
    reach_m: float = Field(150.0, gt=0.0, description="distance north and south within which a vehicle looks for oil")


class PlumeSettings(JobSettings):
    plume: Plume = Plume()


class PlumeScenario(JobScenario):
    mission: PlumeSettings = PlumeSettings()
    strip: tuple[StripTable, ...] = Field(min_length=1)


# Job of a vehicle with a fluorometer
@dataclass(frozen=True)
class Strip:
    name: str
    place_m: tuple[float, float]
    length_m: float
    reach_m: float
    needs: tuple[str, ...] = ()

    @property
    def done(self):
        return "jobDone", self.name

    def is_able(self, data):
        return any(sensor.name == "fluorometer" for sensor in data.sensors)

    def after(self, outlook, data):
        way_s = math.dist(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + 3.0 * self.length_m / data.survey_speed_mps, self.place_m)


# Sensor: reports each change of the water, with its place
class FluorometerSettings(SensorSettings):
    EQUIPMENT = "WaterSensor"

    def make(self, data):
        return Fluorometer(data.name)


class Fluorometer:
    table = EDGES

    def __init__(self, vehicle):
        self._vehicle, self._in_oil = vehicle, False

    def sense(self, pose, world, now_s):
        in_oil = world.holds(pose.x_m, pose.y_m)
        if in_oil == self._in_oil:
            return []
        self._in_oil = in_oil
        edge = (SELF, "location", pose.believed_m)
        return [Observation(found="PlumeEdge", facts=(edge, (self._vehicle, "inOil", in_oil)), row=pose.believed_m)]


# Behaviour: to and fro across the plume, turning where the known facts place the vehicle outside the oil
class Tracing(Behaviour):
    def __init__(self, strip, data):
        self._strip, self._data = strip, data
        self._side, self._left_m, self._begun = 1.0, None, False

    def perceive(self, motion, picture, performed):
        self._begun = self._begun or (performed and distance_m(motion, self._strip.place_m) <= 2.0)
        if self._begun and motion.x_m >= self._strip.place_m[0] + self._strip.length_m:
            return DONE
        return ADVANCING if performed else DUE

    def reference(self, motion, picture):
        if not self._begun:
            return Reference(self._strip.place_m, self._data.transit_speed_mps)
        if picture.facts.get(("inOil", self._data.name)):
            self._left_m = None
        elif self._left_m is None:
            self._left_m = motion.y_m  # left the oil here, or began outside
        beyond_m = 0.0 if self._left_m is None else (motion.y_m - self._left_m) * self._side
        off_m = (motion.y_m - self._strip.place_m[1]) * self._side
        has_crossed = beyond_m > TURN_M and off_m > 0.0
        if has_crossed or off_m > self._strip.reach_m:
            self._side, self._left_m = -self._side, motion.y_m
        return Reference((motion.x_m + 15.0, motion.y_m + 40.0 * self._side), self._data.survey_speed_mps)


# Results
def n_edges(run):
    return len(run.recorder.rows("edges"))


def edge_error_m(run):
    plume, edges = run.scenario.mission.plume, run.recorder.rows("edges")
    errors_m = [abs(abs(y_m - plume.leak_m[1]) - plume.half_width_m(x_m)) for _, _, x_m, y_m in edges]
    return sum(errors_m) / len(errors_m) if errors_m else None


def draw_edges(axes, results, style):
    edges = results.table("edges").to_pylist()
    at_m = [row["x_m"] for row in edges], [row["y_m"] for row in edges]
    axes.scatter(*at_m, s=16, marker="D", facecolors="none", edgecolors=style.black, label="edge found")
    return f"n = {len(edges)} points of the edge."


class PlumeMission(JobMission):
    Scenario = PlumeScenario
    group_missions = ("PlumeTracing",)
    objective, kind = "Tracing", "Strip"
    needs = (*JobMission.needs, "objectiveTracing", "jobDone")
    vocabulary = (Path(__file__).with_name("plume.ttl"),)
    sensors = {"fluorometer": FluorometerSettings}
    instances_found_per_vehicle = 200
    metrics = (
        Metric("n_edges", "", Better.HIGHER, "points of the edge", n_edges, headline=True),
        Metric("edge_error_m", "m", Better.LOWER, "error of the edge", edge_error_m, headline=True),
    )
    figures = (Layer("edges", draw_edges, needs=("edges",)),)

    def jobs_of(self, scenario):
        return [Strip(strip.name, strip.start_m, strip.length_m, strip.reach_m) for strip in scenario.strip]

    def behaviour_at(self, job, data):
        return Tracing(job, data)

    def world(self, seed):
        return self.scenario.mission.plume
