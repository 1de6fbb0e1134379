"""Structure: planned parts, their true state in a run, their service jobs, and the sensors that perceive them."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import ClassVar

from pydantic import Field

from exchange.arithmetic import TAU, distance, sincos
from exchange.channel import loss
from missions.pandora.scenario import ANY_VALVE, KINDS, PandoraScenario, UpsetTable, ValveTable, job_of
from remoras.beliefs import Key, Known
from remoras.database import VehicleData
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import Fact, Observation, Pose, Quiet, Sensor, SensorSettings, normal_error
from remoras.work import Outlook, Point


@dataclass(frozen=True)
class TruePart:
    """True state of a part; ``upset`` is its deviation from plan, or empty."""

    name: str
    kind: str
    points_m: tuple[Point, ...]
    work_s: float
    upset: str = ""

    @property
    def state(self) -> str:
        """State of a valve at the start."""
        return "closed" if self.upset == "turned" else "open"


@dataclass(frozen=True)
class Structure:
    """True parts of a run; ``seed`` is the root of observations."""

    things: tuple[TruePart, ...]
    seed: int = 0
    _points: list[tuple[float, int, int]] = field(init=False, repr=False, compare=False)  # x (m), part, point

    def __post_init__(self) -> None:
        points = [(x_m, n, nth) for n, part in enumerate(self.things) for nth, (x_m, _) in enumerate(part.points_m)]
        object.__setattr__(self, "_points", sorted(points))

    def near(self, at_m: Point, within_m: float) -> list[tuple[int, TruePart, int]]:
        """Return points within a distance: (part number, part, point number), sorted."""
        things, west, east = self.things, (at_m[0] - within_m,), (at_m[0] + within_m, math.inf)
        beside = self._points[bisect_left(self._points, west) : bisect_right(self._points, east)]
        near = [(number, nth) for _, number, nth in beside if distance(at_m, things[number].points_m[nth]) <= within_m]
        return [(number, things[number], nth) for number, nth in sorted(near)]


LOOKS = Table("looks", (TIME, VEHICLE, Column("part", "str"), Column("point", "int")))
"""Points truly inspected by a camera for long enough."""
TURNS = Table("turns", (TIME, VEHICLE, Column("part", "str"), Column("state", "str")))
"""Work truly done by a tool: final state of a valve, or clean for an anode."""
NEEDED_SHARE = 0.5  # share of a point's images that must show it; some are blank
TOUCH_GAP_S = 5.0
FELT_SHARE = 0.25  # progress between two reports of a tool
FAR_REACHES = 10.0  # distance up to which a tool looks for the next part, in multiples of its reach
SERVICED = "Valve", "Anode"
FELT_S = 30.0  # working time without progress after which a tool reports this
LOG_STREAM = 60_000  # offset of the draws of logs from camera draws


def error(seed: int, reading: int, node: int, which: int) -> float:
    """Standard normal error of a reading, keyed by seed, reading, node and quantity."""
    return normal_error(loss.uniform(seed, loss.LOOKS, reading, node, which))


class CameraSettings(SensorSettings):
    """Table ``[vehicle.sensor]`` of a camera."""

    EQUIPMENT: ClassVar[str] = "Camera"

    range_m: float = Field(6.0, gt=0.0, description="maximum range to a point of a part")
    sigma_m: float = Field(0.2, gt=0.0, description="standard deviation of an observed position, on each axis")
    every_s: float = Field(10.0, gt=0.0, description="time between two images")
    p_blank: float = Field(0.1, ge=0.0, lt=1.0, description="probability of an empty image, for turbid water")

    def make(self, data: VehicleData) -> Sensor:
        return Camera(self, data)


class Camera:
    """Camera: places of parts, states of valves, inspected points."""

    table = LOOKS

    def __init__(self, settings: CameraSettings, data: VehicleData) -> None:
        self._settings, self._vehicle, self._node = settings, data.name, data.node
        self._next_s, self._n_images, self._n_good = 0.0, 0, 0
        self._n_looks: Counter[tuple[int, int]] = Counter()

    def sense(self, pose: Pose, world: Structure, now_s: float) -> Sequence[Observation]:
        """Return the content of an image, if scheduled."""
        if now_s < self._next_s:
            return Quiet(until_s=self._next_s)
        settings, number = self._settings, self._n_images
        self._next_s, self._n_images = now_s + settings.every_s, number + 1
        if loss.uniform(world.seed, loss.MISSES, number, self._node, 0) < settings.p_blank:
            return []
        self._n_good += 1
        # The count may wrap, since only its changes matter.
        observations = [Observation(((self._vehicle, "looks", self._n_good % 65_536),))]
        for which, thing, nth in world.near((pose.x_m, pose.y_m), settings.range_m):
            if nth == 0:
                observations.append(Observation(self._shown(which, thing, pose, world.seed, number)))
            self._n_looks[which, nth] += 1
            if self._n_looks[which, nth] == max(1, int(NEEDED_SHARE * thing.work_s / settings.every_s)):
                observations.append(Observation(((thing.name, "inspectedPoint", nth),), (thing.name, nth)))
        return observations

    def _shown(self, which: int, thing: TruePart, pose: Pose, seed: int, number: int) -> tuple[Fact, ...]:
        off_m = [error(seed, number, self._node, 2 * which + axis) for axis in (0, 1)]
        seen_m = tuple(
            at_m + believed_m + self._settings.sigma_m * noise
            for at_m, believed_m, noise in zip(thing.points_m[0], pose.error_m, off_m, strict=True)
        )
        place: Fact = thing.name, "seenAt", (seen_m[0], seen_m[1])
        return (place, (thing.name, "isOpen", thing.state == "open")) if thing.kind == "Valve" else (place,)


class LogSettings(SensorSettings):
    """Table ``[vehicle.sensor]`` of a Doppler log."""

    EQUIPMENT: ClassVar[str] = "DopplerVelocityLog"

    sigma_mps: float = Field(0.03, gt=0.0, description="standard deviation of a reading, on each axis")
    every_s: float = Field(20.0, gt=0.0, description="time between two readings")

    def make(self, data: VehicleData) -> Sensor:
        return SpeedLog(self, data)


class SpeedLog:
    """Doppler log: speed through the water, and current over ground."""

    table = None

    def __init__(self, settings: LogSettings, data: VehicleData) -> None:
        self._settings, self._vehicle, self._node = settings, data.name, data.node
        self._next_s, self._number = 0.0, 0

    def sense(self, pose: Pose, world: Structure, now_s: float) -> Sequence[Observation]:
        """Return a reading, if scheduled."""
        if now_s < self._next_s:
            return Quiet(until_s=self._next_s)
        self._next_s, self._number = now_s + self._settings.every_s, self._number + 1
        speed, east, north = (
            self._settings.sigma_mps * error(world.seed, self._number, self._node, LOG_STREAM + which)
            for which in range(3)
        )
        me, flow_mps = self._vehicle, (pose.flow_mps[0] + east, pose.flow_mps[1] + north)
        facts: tuple[Fact, ...] = (
            (me, "speedMeasured", pose.speed_mps + speed), (me, "flowMeasured", flow_mps),
            (me, "logged", self._number % 65_536),
        )  # fmt: skip
        return (Observation(facts),)


class ToolSettings(SensorSettings):
    """Common settings of tools."""

    EQUIPMENT: ClassVar[str] = "Manipulator"
    STRONG: ClassVar[bool]
    """True if it turns stuck valves."""

    reach_m: float = Field(1.0, gt=0.0, description="maximum range of touch")
    pace: float = Field(1.0, gt=0.0, description="work rate, as a multiple of the planned one")

    def make(self, data: VehicleData) -> Sensor:
        return Tool(self.reach_m, self.pace, self.STRONG)


class ArmSettings(ToolSettings):
    """Table ``[vehicle.sensor]`` of an arm."""

    STRONG: ClassVar[bool] = False


class WrenchSettings(ToolSettings):
    """Table ``[vehicle.sensor]`` of a wrench: slow and strong."""

    STRONG: ClassVar[bool] = True
    pace: float = Field(0.25, gt=0.0, description="work rate, as a multiple of the planned one")


class Tool:
    """Tool for the nearest valve or anode in reach; a released valve turned again opens."""

    table = TURNS

    def __init__(self, reach_m: float, pace: float, is_strong: bool) -> None:
        self._reach_m, self._pace, self._is_strong = reach_m, pace, is_strong
        self._part, self._touched_s, self._last_s, self._felt = "", 0.0, -math.inf, 0.0
        self._felt_s = -math.inf
        self._is_over = False
        # Each part is serviced once and not inspected afterwards, so no other sensor has to know its new state.
        self._states: dict[str, str] = {}

    def sense(self, pose: Pose, world: Structure, now_s: float) -> Sequence[Observation]:
        """Report progress occasionally, and the end of the work."""
        at_m, most_m = (pose.x_m, pose.y_m), FAR_REACHES * self._reach_m
        around = [(distance(at_m, p.points_m[nth]), p) for _, p, nth in world.near(at_m, most_m) if p.kind in SERVICED]
        near = [part for off_m, part in around if off_m <= self._reach_m]
        if not near:
            return Quiet(min([off_m for off_m, _ in around], default=most_m) - self._reach_m)
        thing = min(near, key=lambda part: distance(at_m, part.points_m[0]))
        since_s, self._last_s = now_s - self._last_s, now_s
        if thing.name != self._part or since_s > TOUCH_GAP_S:
            self._part, self._touched_s, self._felt, self._is_over, self._felt_s = thing.name, 0.0, 0.0, False, now_s
            return []
        if self._is_over:
            return []
        moves = self._is_strong or thing.upset != "stuck"
        self._touched_s += since_s * self._pace if moves else 0.0
        share = min(1.0, self._touched_s / thing.work_s)
        if share == 1.0:
            return self._ended(thing)
        is_stuck = share == self._felt and now_s - self._felt_s >= FELT_S
        if share - self._felt < FELT_SHARE and not is_stuck:
            return []
        self._felt, self._felt_s = share, now_s
        return [Observation(((thing.name, "workedShare", share),))]

    def _ended(self, thing: TruePart) -> list[Observation]:
        self._is_over, state = True, "clean"
        if thing.kind == "Valve":
            state = "open" if self._states.get(thing.name, thing.state) == "closed" else "closed"
            self._states[thing.name] = state
        return [Observation(((thing.name, "workedShare", 1.0),), (thing.name, state))]


TOOLS = "arm", "wrench"


@dataclass(frozen=True)
class PlannedPart:
    """Planned part with its service task: a ``remoras.work.Job``; ``work_s`` is the time per point, or of a tool.

    ``resists`` marks a valve known to need a wrench; ``dead`` has each (vehicle, tool) reported as dead.
    """

    of: str
    kind: str
    points_m: tuple[Point, ...]
    work_s: float
    panel_m: Point | None = None
    panel: str = ""
    needs: tuple[str, ...] = ()
    resists: bool = False
    dead: tuple[tuple[str, str], ...] = ()
    vehicles: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the service task."""
        return job_of(self.of)

    @property
    def way_m(self) -> float:
        """Path length along its points (m)."""
        return math.fsum(distance(*pair) for pair in pairwise(self.points_m))

    @property
    def place_m(self) -> Point:
        """First point."""
        return self.points_m[0]

    @property
    def takes_arm(self) -> bool:
        """True for parts that need a tool."""
        return self.kind in SERVICED

    @property
    def done(self) -> Key:
        """Fact that the task is done."""
        return "jobDone", self.name

    def is_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle with a camera and, if needed, a working tool."""
        if data.sensor(CameraSettings) is None:
            return False
        if not self.takes_arm:
            return True
        kind, tool = (WrenchSettings, "wrench") if self.resists else (ArmSettings, "arm")
        return data.sensor(kind) is not None and (data.name, tool) not in self.dead

    def is_ever_able(self, data: VehicleData) -> bool:
        """Return True if able with either tool."""
        return replace(self, resists=False, dead=()).is_able(data) or replace(self, resists=True, dead=()).is_able(data)

    @property
    def rests_on(self) -> tuple[Key, ...]:
        """Facts about the part's anomaly and dead tools."""
        if not (self.vehicles and self.takes_arm):
            return ()
        return ("anomaly", self.of), *(("toolDead", name) for name in self.vehicles)

    @property
    def hindrances(self) -> tuple[str, ...]:
        """Resistance of the part, and dead tools."""
        resists = (f"{self.of} resists, it takes a wrench",) if self.resists else ()
        return *resists, *(f"the {tool} of {name} is dead" for name, tool in self.dead)

    def left(self, facts: Known) -> PlannedPart:
        """Return the task with known anomalies and dead tools."""
        if not self.rests_on:
            return self
        resists = self.kind == "Valve" and facts.get(("anomaly", self.of)) == "resists"
        reported = {name: facts.get(("toolDead", name)) for name in self.vehicles}
        dead = tuple((name, tool) for name, which in reported.items() for tool in TOOLS if which in (tool, "both"))
        if (resists, dead) == (self.resists, self.dead):
            return self
        return replace(self, resists=resists, dead=dead)

    def work_there_s(self, data: VehicleData) -> float:
        """Time (s) on site: all points, and travel between them at survey speed."""
        return len(self.points_m) * self.work_s + self.way_m / data.survey_speed_mps

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after the service; None if unable."""
        if not self.is_able(data):
            return None
        way_s = distance(outlook.position_m, self.place_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + self.work_there_s(data), self.points_m[-1])


def planned_parts(scenario: PandoraScenario) -> dict[str, PlannedPart]:
    """Service tasks by name."""
    panels = {panel.name: panel.position_m for panel in scenario.panel}
    hands_on = tuple(vehicle.name for vehicle in scenario.vehicle) if scenario.mission.repairs else ()
    parts = {}
    for kind, table in scenario.parts:
        panel = table.panel if isinstance(table, ValveTable) else table.name if kind == "panel" else ""
        parts[job_of(table.name)] = PlannedPart(
            table.name, KINDS[kind], table.points_m, table.work_s, panels.get(panel), panel, vehicles=hands_on
        )
    return parts


def structure_of(parts: Mapping[str, PlannedPart], upsets: Iterable[UpsetTable], seed: int) -> Structure:
    """Return the true structure of a run."""
    things = {part.of: TruePart(part.of, part.kind, part.points_m, part.work_s) for part in parts.values()}
    free = [part.of for part in parts.values() if part.kind == "Valve"]
    # Named valves go first, so that no random upset hits one of them.
    for upset in upsets:
        if upset.part in free:
            free.remove(upset.part)
    for number, upset in enumerate(upsets):
        which, direction = (loss.uniform(seed, loss.FINDS, number, 0, draw) for draw in (0, 1))
        name = free.pop(int(which * len(free))) if upset.part == ANY_VALVE else upset.part
        things[name] = replace(things[name], upset=upset.kind)
        if upset.distance_m is not None:
            (x_m, y_m), (north, east) = things[name].points_m[0], sincos(TAU * direction)
            moved_m = x_m + upset.distance_m * east, y_m + upset.distance_m * north
            things[name] = replace(things[name], points_m=(moved_m,))
    return Structure(tuple(things.values()), seed)
