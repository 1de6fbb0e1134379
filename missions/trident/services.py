"""Modules of vehicles and their services, which sense at the true and report relative to the believed position."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from pydantic import Field

from exchange.arithmetic import distance, exp
from exchange.channel import loss
from missions.meeting.survey import rectangle
from missions.trident.scenario import ActivityTable, Response, TransponderTable, TridentScenario
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.organisation import Group
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import SELF, Fact, Observation, Pose, Sensor, SensorSettings, normal_error
from remoras.work import Point

Tile = tuple[int, int]  # (column, row) of a tile of the world grid
APART_M = 35.0  # least distance between objects where there is room
RIM_M = 10.0  # least distance of an object from the border of its block
TARGET = "target"
DRAWS = 64  # trials for a place before objects may lie closer


@dataclass(frozen=True)
class SeabedBlock:
    """Rectangle of the seabed with tiles of side ``tile_m``."""

    name: str
    x_m: Point
    y_m: Point
    tile_m: float

    @property
    def centre_m(self) -> Point:
        """Centre of the block."""
        return (self.x_m[0] + self.x_m[1]) / 2.0, (self.y_m[0] + self.y_m[1]) / 2.0

    @property
    def sides_m(self) -> Point:
        """Extent in x and y."""
        return self.x_m[1] - self.x_m[0], self.y_m[1] - self.y_m[0]

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """Corners, anticlockwise from the south-west."""
        return rectangle(self.x_m, self.y_m)

    @cached_property  # 5 % of a mission
    def tiles(self) -> tuple[Tile, ...]:
        """Tiles with centre in the block, row by row from the south-west; facts use these indices."""
        columns, rows = (range(*(math.ceil(m / self.tile_m - 0.5) for m in span_m)) for span_m in (self.x_m, self.y_m))
        return tuple((column, row) for row in rows for column in columns)

    def centre_of(self, number: int) -> Point:
        """Centre of a tile."""
        column, row = self.tiles[number]
        return (column + 0.5) * self.tile_m, (row + 0.5) * self.tile_m


@dataclass(frozen=True, slots=True)
class Lying:
    """True object on the seabed; ``name`` appears in tables only."""

    name: str
    position_m: Point


@dataclass(frozen=True)
class Site:
    """Blocks and objects of a run."""

    blocks: tuple[SeabedBlock, ...]
    objects: tuple[Lying, ...] = ()
    transponder: TransponderTable | None = None
    seed: int = 0

    @cached_property  # 20 % of a mission
    def numbers(self) -> Mapping[Tile, tuple[str, int]]:
        """Block of every tile, and the tile's index in it."""
        return {tile: (block.name, n) for block in self.blocks for n, tile in enumerate(block.tiles)}

    def below(self, at_m: Point, reach_m: float) -> list[Tile]:
        """Return tiles of blocks with centre within ``reach_m`` of a place."""
        if not self.blocks:
            return []
        size_m, (x_m, y_m) = self.blocks[0].tile_m, at_m
        tiles = []
        for column in range(math.floor((x_m - reach_m) / size_m), math.floor((x_m + reach_m) / size_m) + 1):
            for row in range(math.floor((y_m - reach_m) / size_m), math.floor((y_m + reach_m) / size_m) + 1):
                dx_m, dy_m = (column + 0.5) * size_m - x_m, (row + 0.5) * size_m - y_m
                if dx_m * dx_m + dy_m * dy_m <= reach_m * reach_m and (column, row) in self.numbers:
                    tiles.append((column, row))
        return tiles

    def nearest(self, at_m: Point) -> tuple[float, int] | None:
        """Return distance and number of the nearest object; None without objects."""
        return min(((distance(thing.position_m, at_m), n) for n, thing in enumerate(self.objects)), default=None)


def lying(blocks: Sequence[SeabedBlock], target_m: Point | None, n_decoys: int, seed: int) -> tuple[Lying, ...]:
    """Return the target and the decoys of a run; ``target_m`` None means a random place."""
    placed: list[Lying] = []
    for number in range(1 + n_decoys):
        name = f"decoy {number}" if number else TARGET
        # Draws are keyed by number, so more decoys leave the other objects unchanged.
        at_m = target_m if target_m is not None and not number else _drawn_m(blocks, number, seed, placed)
        placed.append(Lying(name, at_m))
    return tuple(placed)


def _drawn_m(blocks: Sequence[SeabedBlock], number: int, seed: int, others: Sequence[Lying]) -> Point:
    at_m = (0.0, 0.0)
    for trial in range(DRAWS):
        which, east, north = (loss.uniform(seed, loss.FINDS, number, trial, draw) for draw in range(3))
        block = blocks[int(which * len(blocks))]
        width_m, height_m = (max(0.0, side_m - 2.0 * RIM_M) for side_m in block.sides_m)
        x_m, y_m = block.centre_m
        at_m = x_m + (east - 0.5) * width_m, y_m + (north - 0.5) * height_m
        if all(distance(at_m, other.position_m) >= APART_M for other in others):
            break
    return at_m


CANDIDATE = "Candidate"
SAME_M = 25.0  # distance within which an observation is associated with a known candidate
FOUND_PER_OBJECT = 4
MOST_LOOKS = 128
LOOK_S, REST_MPS = 10.0, 0.15  # time between observations of an object; speed below which a vehicle is at rest
REACH_M = 6.0
KINDS = ("survey", "find", "hold", "handle")  # kinds of modules, each with its own stream of draws
LIKE_TARGET, LIKE_DECOY = 0.7, 0.45

CHARTED = Table("charted", (TIME, VEHICLE, Column("column", "int", "tile"), Column("row", "int", "tile")))
"""Tiles truly charted for the first time; claims of modules exist only in world models."""
ATTEMPTS = Table("attempts", (
    TIME, VEHICLE, Column("module", "str"), Column("does", "str"), Column("object", "str"),
    Column("pose_error_m", "float", "m"), Column("succeeded", "bool"),
))  # fmt: skip
"""Attempts to hold or handle objects, with the true distance from the object."""


class ModuleSettings(SensorSettings):
    """Module without sensing: a console, a classifier, a positioning system."""

    capability: str = Field(description="class in the ontology advertised for its service")
    cost_s: float = Field(0.0, ge=0.0, le=4000.0, description="cost of its use, as an equivalent delay (s)")
    precondition: Literal["none", "surveyed", "chosen", "identified", "held"] = Field(
        "none", description="precondition of its use, for the advertisement"
    )
    delay_s: float = Field(0.0, ge=0.0, description="duration of a choice by it")
    self_test: bool = Field(True, description="it reports its state to its vehicle; else it fails silently")

    @property
    def tells_state(self) -> bool:
        return self.self_test

    def make(self, data: VehicleData) -> Sensor:
        return Passive()


class Passive:
    """Module without sensing."""

    table = None

    def sense(self, pose: Pose, world: Site, now_s: float) -> list[Observation]:
        """Return no observation."""
        return []


class SurveyorSettings(ModuleSettings):
    """Module that charts the seabed below and detects objects."""

    reach_m: float = Field(gt=0.0, le=200.0, description="charted width on each side of the track")
    speed_limit_mps: float = Field(gt=0.0, description="maximum speed over ground for charting")
    sigma_m: float = Field(
        gt=0.0, le=32.0, description="standard deviation of the position of detections, on each axis"
    )
    sigma_likeness: float = Field(0.125, gt=0.0, le=1.0, description="standard deviation of the likeness to the target")
    p_seen: float = Field(0.95, gt=0.0, le=1.0, description="probability that a pass detects an object in range")

    def make(self, data: VehicleData) -> Sensor:
        return Surveyor(self, data)


class Surveyor:
    """Surveying module: charts each tile once and observes objects within reach."""

    table = CHARTED

    def __init__(self, settings: SurveyorSettings, data: VehicleData) -> None:
        self._settings, self._looks = settings, Looks("survey", data.node)
        self._limit_mps = settings.speed_limit_mps * data.speed_factor * 1.000001
        self._claimed: set[Tile] = set()
        self._charted: set[Tile] = set()

    def sense(self, pose: Pose, world: Site, now_s: float) -> list[Observation]:
        """Return new tiles, and objects that are due for observation."""
        if pose.ground_mps > self._limit_mps:
            return []
        settings, at_m = self._settings, (pose.x_m, pose.y_m)
        observations = []
        # Claims lie around the believed position, ground truth around the true one.
        for tile in world.below(pose.believed_m, settings.reach_m):
            if tile not in self._claimed:
                self._claimed.add(tile)
                block, number = world.numbers[tile]
                observations.append(Observation(((block, "chartedTile", number),)))
        for tile in world.below(at_m, settings.reach_m):
            if tile not in self._charted:
                self._charted.add(tile)
                observations.append(Observation(row=tile))
        for number, thing in enumerate(world.objects):
            if distance(thing.position_m, at_m) > settings.reach_m or not self._looks.is_due(number, now_s, 6.0):
                continue
            seen, like, *off = self._looks.draws(world.seed, number, 4)
            if seen < settings.p_seen:
                mean = LIKE_TARGET if thing.name == TARGET else LIKE_DECOY
                likeness = min(1.0, max(0.0, mean + settings.sigma_likeness * normal_error(like)))
                place = _placed(thing, pose, off, settings.sigma_m)
                observations.append(_seen(place, (SELF, "likeness", likeness, max(0.0625, settings.sigma_likeness))))
        return observations


class FinderSettings(ModuleSettings):
    """Module that classifies and locates candidates at close range."""

    range_m: float = Field(gt=0.0, description="maximum range to an object")
    speed_limit_mps: float = Field(0.8, gt=0.0, description="maximum speed over ground for detection")
    sigma_m: float = Field(gt=0.0, le=32.0, description="standard deviation of the observed position, on each axis")
    p_right: float = Field(gt=0.5, le=1.0, description="probability of the right class per observation")

    def make(self, data: VehicleData) -> Sensor:
        return Finder(self, data)


class Finder:
    """Close-range classifier with independent observations of stated reliability."""

    table = None

    def __init__(self, settings: FinderSettings, data: VehicleData) -> None:
        self._settings, self._looks = settings, Looks("find", data.node)
        self._limit_mps = data.speed_factor * settings.speed_limit_mps * 1.000001

    def sense(self, pose: Pose, world: Site, now_s: float) -> list[Observation]:
        """Return place and class of each object in range."""
        settings, at_m, observations = self._settings, (pose.x_m, pose.y_m), []
        if pose.ground_mps > self._limit_mps:
            return []
        for number, thing in enumerate(world.objects):
            if distance(thing.position_m, at_m) > settings.range_m or not self._looks.is_due(number, now_s):
                continue
            right, *off = self._looks.draws(world.seed, number, 3)
            place = _placed(thing, pose, off, settings.sigma_m)
            takes_for = "target" if (thing.name == TARGET) == (right < settings.p_right) else "decoy"
            observations.append(_seen(place, (SELF, "looksLike", takes_for, settings.p_right)))
        return observations


class EffectorSettings(ModuleSettings):
    """Module that holds on to an object or handles it; success falls with distance."""

    does: Literal["hold", "handle"] = Field(description="whether it holds the vehicle in place or handles the object")
    attempt_s: float = Field(gt=0.0, description="time at rest for an attempt")
    tolerance_m: float = Field(
        gt=0.0, description="an attempt at a distance d from the object succeeds with probability exp(-(d/tolerance)^2)"
    )

    def make(self, data: VehicleData) -> Sensor:
        return Effector(self, data)


class Effector:
    """Effector that repeats attempts at the nearest object while the vehicle is at rest."""

    table = ATTEMPTS

    def __init__(self, settings: EffectorSettings, data: VehicleData) -> None:
        self._settings, self._looks, self._data = settings, Looks(settings.does, data.node), data
        self._since_s: float | None = None
        self._last_s = -math.inf

    def sense(self, pose: Pose, world: Site, now_s: float) -> list[Observation]:
        """Return the outcome of an attempt that ends now."""
        at_m, nearest = (pose.x_m, pose.y_m), world.nearest((pose.x_m, pose.y_m))
        # A gap in the calls means that the module was switched off.
        if now_s - self._last_s > 1.5:
            self._since_s = None
        self._last_s = now_s
        if pose.ground_mps > REST_MPS or nearest is None or nearest[0] > REACH_M:
            self._since_s = None
            return []
        self._since_s = now_s if self._since_s is None else self._since_s
        if now_s - self._since_s < self._settings.attempt_s:
            return []
        self._since_s = now_s
        off_m, number = nearest
        thing = world.objects[number]
        (drawn,) = self._looks.draws(world.seed, number, 1)
        off = off_m / self._settings.tolerance_m
        succeeds = drawn < exp(-off * off)
        row = self._settings.name, self._settings.does, thing.name, distance(at_m, thing.position_m), succeeds
        if not succeeds:
            return [Observation(row=row)]
        done = "heldBy" if self._settings.does == "hold" else "handledBy"
        place = thing.position_m[0] + pose.error_m[0], thing.position_m[1] + pose.error_m[1]
        facts: tuple[Fact, ...] = (pose.located(place, 0.5), (SELF, done, self._data.name))
        return [Observation(facts, row, CANDIDATE, SAME_M)]


class FixerSettings(ModuleSettings):
    """Module that ranges a transponder near it for a fix."""

    stay_s: float = Field(40.0, gt=0.0, description="reception time of the transponder")

    def make(self, data: VehicleData) -> Sensor:
        return Fixer(self.stay_s, data.name)


class Fixer:
    """Module that reports a fix after ``stay_s`` within range of the transponder."""

    table = None

    def __init__(self, stay_s: float, vehicle: str) -> None:
        self._stay_s, self._vehicle = stay_s, vehicle
        self._since_s: float | None = None

    def sense(self, pose: Pose, world: Site, now_s: float) -> list[Observation]:
        """Return the fix, once."""
        at_m, stands = (pose.x_m, pose.y_m), world.transponder
        if stands is None or distance(at_m, stands.position_m) > stands.range_m:
            self._since_s = None
            return []
        self._since_s = now_s if self._since_s is None else self._since_s
        if now_s - self._since_s < self._stay_s:
            return []
        # An infinite start reports no second fix before the vehicle has left the range.
        self._since_s = math.inf
        return [Observation(((self._vehicle, "fixedOn", True),))]


class Looks:
    """Schedule and draws of observations per object; ``kind`` is one of ``KINDS``."""

    def __init__(self, kind: str, node: int) -> None:
        self._stream, self._node = KINDS.index(kind), node
        self._next_s: dict[int, float] = {}
        self._n: Counter[int] = Counter()

    def is_due(self, number: int, now_s: float, times: float = 1.0) -> bool:
        """Return True, and reschedule, after ``times`` the interval since the last observation."""
        if now_s < self._next_s.get(number, -math.inf) or self._n[number] >= MOST_LOOKS:
            return False
        self._next_s[number] = now_s + times * LOOK_S
        return True

    def draws(self, seed: int, number: int, n: int) -> list[float]:
        """Return ``n`` uniform numbers in [0, 1) for the next observation of an object."""
        look, self._n[number] = self._n[number], self._n[number] + 1
        stream = 8 * (len(KINDS) * number + self._stream)
        return [loss.uniform(seed, loss.LOOKS, look, self._node, stream + draw) for draw in range(n)]


def _placed(thing: Lying, pose: Pose, off: list[float], sigma_m: float) -> Fact:
    (x_m, y_m), (east_m, north_m) = thing.position_m, pose.error_m
    seen_m = x_m + east_m + sigma_m * normal_error(off[0]), y_m + north_m + sigma_m * normal_error(off[1])
    return pose.located(seen_m, max(0.5, sigma_m))


def _seen(*facts: Fact) -> Observation:
    return Observation(facts, (), CANDIDATE, SAME_M)


SURVEY, CHOOSE, FIX, FIND, HOLD, HANDLE = "survey", "choose", "fix", "find", "hold", "handle"
ON_BOARD = (FIND, HOLD, HANDLE)  # activities of the recovering vehicle that no other vehicle can do
AVAILABLE, FAILED = "available", "failed"
AVAILABLE_SERVICE = "AvailableService"
HANDING_OVER_S = 300.0


@dataclass(frozen=True, slots=True)
class Service:
    """Service of a vehicle's module; ``name`` combines both."""

    name: str
    vehicle: str
    settings: ModuleSettings


def parties(group: Group, facts: FactsLike) -> frozenset[str]:
    """Present vehicles of a group."""
    founding = (group.path(role.name) for role in group.roles if role.founding)
    return frozenset(name for path in founding for name in facts.get(("members", path)) or ())


@dataclass(frozen=True)
class Matching:
    """Matching of ``activities`` and ``blocks`` (surveys) with services, by requested class or planned service."""

    services: Mapping[str, Service]
    activities: Mapping[str, ActivityTable]
    blocks: Mapping[str, ActivityTable]
    response: Response
    inference: bool

    @classmethod
    def of(cls, scenario: TridentScenario, vehicles: Iterable[VehicleData]) -> Matching:
        """Create the matching of a scenario."""
        activities = {name: getattr(scenario.activity, name) for name in type(scenario.activity).model_fields}
        blocks = {
            block.name: ActivityTable(requires=activities[SURVEY].requires, service=block.service, spare=block.spare)
            for block in scenario.block
        }
        modules = [
            (data.name, sensor) for data in vehicles for sensor in data.sensors if isinstance(sensor, ModuleSettings)
        ]
        services = {(name := f"{vehicle} {module.name}"): Service(name, vehicle, module) for vehicle, module in modules}
        return cls(services, activities, blocks, scenario.mission.response, scenario.mission.inference)

    def for_block(self, me: str, block: str, facts: FactsLike, there: Collection[str]) -> tuple[str, ...]:
        """Return the services by which ``me`` may have a block surveyed, best first."""
        return self._ways(self.blocks[block], me, facts, there)

    def ways(self, activity: str, me: str, facts: FactsLike, there: Collection[str]) -> tuple[str, ...]:
        """Services of present vehicles (``there``) by which ``me`` may do an activity, in order."""
        names = self._ways(self.activities[activity], me, facts, there)
        if activity not in ON_BOARD:
            return names
        return tuple(name for name in names if self.services[name].vehicle == me)

    def planned(self, of: ActivityTable) -> tuple[str, ...]:
        """Services that the plan names, with spares under ``repair``."""
        listed = (of.service, *(of.spare if self.response == "repair" else ()))
        return tuple(name for name in listed if name in self.services)

    def rests_on(self) -> frozenset[Key]:
        """Facts on which a match depends."""
        return frozenset(("serviceStatus", name) for name in self.services)

    def _ways(self, activity: ActivityTable, me: str, facts: FactsLike, present: Collection[str]) -> tuple[str, ...]:
        if self.response != "matching":
            return self.planned(activity)
        fitting = self._fitting(activity.requires, me, facts)
        able = [service for name, service in self.services.items() if name in fitting and service.vehicle in present]
        # Ties go by name, so that all vehicles match alike.
        able.sort(
            key=lambda service: (service.settings.cost_s + HANDING_OVER_S * (service.vehicle != me), service.name)
        )
        return tuple(service.name for service in able)

    def _fitting(self, requires: str, me: str, facts: FactsLike) -> Collection[str]:
        # Every status is looked up, since plans depend on the facts read.
        statuses = {name: facts.get(("serviceStatus", name)) for name in self.services}
        unsaid = {name for name, service in self.services.items() if service.vehicle == me and statuses[name] is None}
        if not self.inference:
            capable = {name for name, service in self.services.items() if service.settings.capability == requires}
            return capable & (unsaid | {name for name, status in statuses.items() if status == AVAILABLE})
        working = {*(facts.get(("instances", AVAILABLE_SERVICE)) or ()), *unsaid}
        return working.intersection(facts.get(("instances", requires)) or ())
