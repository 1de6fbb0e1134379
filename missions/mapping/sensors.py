"""Sensors of the mapping mission, and the objects that they observe.

The place uncertainty of a classifier combines the sensor error with the vehicle's own position error, which all
observations of a dive share. The first report creates an ontology instance; an observation near a known instance is
associated with it. Draws are keyed by seed, object, vehicle and observation number.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Literal

from pydantic import Field

from exchange.arithmetic import distance
from exchange.channel import loss
from missions.meeting.survey import contains
from remoras.database import VehicleData
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import MOST_SIGMA_M, SELF, Observation, Pose, Quiet, SensorSettings, normal_error
from remoras.table import Name, PointM, Section
from remoras.work import Point

CLASSES = ("wreck", "pipeline", "anomaly")  # classes of objects: the values of ``rm:classification`` except ``unknown``
SIGHTINGS = Table("sightings", (
    TIME, VEHICLE, Column("object", "str"), Column("classification", "str"), Column("x_m", "float", "m"),
    Column("y_m", "float", "m"),
))  # fmt: skip
"""Classifier outputs before sensor faults, with the true object, which vehicles do not know."""
FOUND_PER_OBJECT = 4  # most instances that one vehicle creates per object; more than one if its readings jump

MOST_LOOKS = 256  # most observations of one object per vehicle: the range of the number on the wire


class ObjectTable(Section):
    """One ``[[object]]``: an object in the sea unknown to all vehicles."""

    name: Name = Field(description="name of the object in tables; vehicles do not know it")
    position_m: PointM = Field(description="position, x east, y north")
    classification: Literal["wreck", "pipeline", "anomaly"] = Field(description="kind of object")


class ClassifierSettings(SensorSettings):
    """Table ``[vehicle.sensor]`` of a classifier."""

    range_m: float = Field(80.0, gt=0.0, description="maximum range to an object")
    p_right: float = Field(0.8, gt=0.25, lt=1.0, description="probability of the right class, stated with it")
    sigma_m: float = Field(
        2.0,
        gt=0.0,
        le=MOST_SIGMA_M,
        description="standard deviation of the observed position per axis, stated with its own error",
    )
    every_s: float = Field(60.0, gt=0.0, description="time between observations of an object")
    within_m: float = Field(
        20.0, ge=0.0, description="distance within which an observation is matched to a known object; 0: never"
    )

    def make(self, data: VehicleData) -> Classifier:
        return Classifier(self, data.node)


class Classifier:
    """Sensor of place and class of objects within its range; ``node`` keys its draws."""

    table = SIGHTINGS

    def __init__(self, settings: ClassifierSettings, node: int) -> None:
        self._settings = settings
        self._node = node
        self._next_s: dict[int, float] = {}
        self._n_looks: Counter[int] = Counter()
        self._n_of_dive: Counter[int] = Counter()  # by object
        self._most_m = 0.0  # largest own position error of this dive

    def sense(self, pose: Pose, world: Seabed, now_s: float) -> list[Observation]:
        """Observe scheduled objects in range."""
        observations = []
        # A halved position error means a fix, after which the errors of the dive are independent of earlier ones.
        if pose.sigma_m < self._most_m / 2.0:
            self._n_of_dive.clear()
            self._most_m = 0.0
        self._most_m = max(self._most_m, pose.sigma_m)
        for number, thing in enumerate(world.objects):
            if distance(thing.position_m, (pose.x_m, pose.y_m)) > self._settings.range_m:
                continue
            if now_s >= self._next_s.get(number, 0.0) and self._n_looks[number] < MOST_LOOKS:
                self._next_s[number] = now_s + self._settings.every_s
                observations.append(self._look(number, thing, pose, world.seed))
        return observations

    def _look(self, number: int, thing: ObjectTable, pose: Pose, seed: int) -> Observation:
        settings, look = self._settings, self._n_looks[number]
        self._n_looks[number] += 1
        self._n_of_dive[number] += 1
        right, which, east, north = (
            loss.uniform(seed, loss.LOOKS, look, self._node, 4 * number + draw) for draw in range(4)
        )
        others = [name for name in CLASSES if name != thing.classification]
        seems = thing.classification if right < settings.p_right else others[int(which * len(others))]
        x_m, y_m = (
            at_m + off_m + settings.sigma_m * normal_error(share)
            for at_m, off_m, share in zip(thing.position_m, pose.error_m, (east, north), strict=True)
        )
        place = pose.located((x_m, y_m), settings.sigma_m, self._n_of_dive[number])
        return Observation(
            (place, (SELF, "classification", seems, settings.p_right)),
            (thing.name, seems, x_m, y_m),
            "ObjectOfInterest",
            settings.within_m,
        )


Cell = tuple[int, int]
COVERAGE = Table("coverage", (TIME, VEHICLE, Column("cell_x", "int", "cell"), Column("cell_y", "int", "cell")))
"""Cells truly covered, first time per vehicle; sensor claims exist only in world models."""

LIMIT_TOLERANCE = 1.000001  # factor on speed limits, so that a vehicle at the limit still maps


@dataclass(frozen=True, slots=True)
class SeabedFeature:
    """Feature of the seabed: detected when its cell is mapped, inspected by a slow dwell nearby."""

    name: str
    position_m: Point
    stay_s: float
    close_radius_m: float
    close_speed_mps: float


@dataclass(frozen=True)
class Seabed:
    """Cells of the areas to map, with features and objects.

    ``cells`` maps (column, row) of the world grid to (area name, index in the area); ``under(x_m, y_m, reach_m)``
    returns the cells with centres within ``reach_m``, cached.
    """

    cell_m: float
    cells: Mapping[Cell, tuple[str, int]]
    features: Mapping[Cell, SeabedFeature] = field(default_factory=dict)
    objects: tuple[ObjectTable, ...] = ()
    seed: int = 0
    under: Callable[[float, float, float], tuple[Cell, ...]] = field(init=False, repr=False, compare=False)
    _about: Callable[[int, int, float], list[tuple[Cell, float, float]]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "under", lru_cache(maxsize=64)(self._under))
        object.__setattr__(self, "_about", lru_cache(maxsize=4096)(self._centres_about))

    @classmethod
    def of_areas(cls, cell_m: float, corners_m: Mapping[str, Sequence[Point]]) -> Seabed:
        """Create the seabed from cells centred in an area; indices by row from the south-west."""
        cells: dict[Cell, tuple[str, int]] = {}
        for name, corners in corners_m.items():
            xs, ys = [x for x, _ in corners], [y for _, y in corners]
            index = 0
            for row in range(math.floor(min(ys) / cell_m), math.ceil(max(ys) / cell_m)):
                for column in range(math.floor(min(xs) / cell_m), math.ceil(max(xs) / cell_m)):
                    centre = (column + 0.5) * cell_m, (row + 0.5) * cell_m
                    if (column, row) not in cells and contains(corners, centre):
                        cells[column, row] = name, index
                        index += 1
        return cls(cell_m, cells)

    def _under(self, x_m: float, y_m: float, reach_m: float) -> tuple[Cell, ...]:
        half_m, cells = self.cell_m / 2.0, []
        # Positions hardly ever repeat, so candidates are cached per quarter of a cell instead.
        for cell, east_m, north_m in self._about(int(x_m // half_m), int(y_m // half_m), reach_m):
            dx_m, dy_m = east_m - x_m, north_m - y_m
            if dx_m * dx_m + dy_m * dy_m <= reach_m * reach_m:
                cells.append(cell)
        return tuple(cells)

    def nearest_m(self, x_m: float, y_m: float, within_m: float, known: Set[Cell]) -> float:
        """Distance to the nearest cell centre beside ``known`` ones, at most ``within_m``."""
        half_m = self.cell_m / 2.0
        about = self._about(int(x_m // half_m), int(y_m // half_m), within_m)
        off_m = [(east_m - x_m, north_m - y_m) for cell, east_m, north_m in about if cell not in known]
        return min(within_m, math.sqrt(min([dx_m * dx_m + dy_m * dy_m for dx_m, dy_m in off_m], default=math.inf)))

    def _centres_about(self, column: int, row: int, reach_m: float) -> list[tuple[Cell, float, float]]:
        size, reach = self.cell_m, 2.0 * reach_m / self.cell_m + 1e-6  # in half cells, with rounding margin
        columns, rows = (  # least distance of their centres
            [(n, max(2 * n - i, i - 2 * n - 1, 0)) for n in range(int(i - reach) // 2, int(i + reach) // 2 + 1)]
            for i in (column, row)
        )
        return [
            ((x, y), (x + 0.5) * size, (y + 0.5) * size)
            for x, east in columns
            for y, north in rows
            if east * east + north * north <= reach * reach and (x, y) in self.cells
        ]


@lru_cache(maxsize=8)  # 1 to 6 ms, asked by each run of a study
def seabed_of(cell_m: float, corners_m: tuple[tuple[str, tuple[Point, ...]], ...]) -> Seabed:
    """Seabed of areas by name, cached for the runs of a study."""
    return Seabed.of_areas(cell_m, dict(corners_m))


class SwathSettings(SensorSettings):
    """Table ``[vehicle.sensor]`` of a mapping sensor."""

    EQUIPMENT: ClassVar[str] = "MappingSonar"

    swath_m: float = Field(ge=0.1, description="swath width of the mapping sensor")
    speed_limit_mps: float = Field(gt=0.0, description="maximum speed over ground for mapping")

    def make(self, data: VehicleData) -> SwathSensor:
        """Create the sensor; its speed limit scales with the vehicle's true speed."""
        return SwathSensor(self.swath_m, data.speed_factor * self.speed_limit_mps, data.name)


VISIT_GAP_S = 1.5  # longest gap between observations of one visit; a motion tick is at most one second


KNOWN = STILL = (0.0, 0.0)  # error of an exactly known position; velocity of still water


class Stays:
    """Dwell of one vehicle at features, near and slow; several visits add up."""

    def __init__(self) -> None:
        self._stayed_s: dict[str, float] = {}
        self._seen_s: dict[str, float] = {}
        self._over: set[str] = set()

    def inspected(self, seabed: Seabed, at_m: Point, speed_mps: float, now_s: float) -> list[SeabedFeature]:
        """Return the features whose inspection this observation completes."""
        over: list[SeabedFeature] = []
        for feature in seabed.features.values():
            name = feature.name
            if name in self._over or speed_mps > feature.close_speed_mps * LIMIT_TOLERANCE:
                continue
            if distance(at_m, feature.position_m) > feature.close_radius_m:
                continue
            since_s = now_s - self._seen_s.get(name, -math.inf)
            self._seen_s[name] = now_s
            # A longer gap began a new visit: the time away is no dwell.
            if since_s <= VISIT_GAP_S:
                self._stayed_s[name] = self._stayed_s.get(name, 0.0) + since_s
                if self._stayed_s[name] >= feature.stay_s:
                    self._over.add(name)
                    over.append(feature)
        return over


class SwathSensor:
    """Mapping sensor; a cell counts only if covered from every position within the uncertainty."""

    table = None

    def __init__(self, swath_m: float, speed_limit_mps: float, vehicle: str) -> None:
        self._vehicle = vehicle
        self._stays = Stays()
        self._reach_m = swath_m / 2.0
        self._speed_limit_mps = speed_limit_mps * LIMIT_TOLERANCE
        self.mapped: set[Cell] = set()
        self._found: set[str] = set()

    def sense(self, pose: Pose, world: Seabed, now_s: float) -> Sequence[Observation]:
        """Return newly mapped cells and detected or inspected features."""
        speed_mps = pose.speed_mps if pose.flow_mps == STILL else pose.ground_mps
        if speed_mps > self._speed_limit_mps:
            return []
        reach_m = self._reach_m - pose.uncertainty_m
        # Cells are claimed around the believed position; the reach less the uncertainty keeps the claims true.
        x_m, y_m = (pose.x_m, pose.y_m) if pose.error_m == KNOWN else pose.believed_m
        under = world.under(x_m, y_m, reach_m) if reach_m >= 0.0 else ()
        if self.mapped.issuperset(under) and not world.features:
            if pose.error_m != KNOWN or pose.uncertainty_m > 0.0:  # a fix moves the believed position
                return []
            return Quiet(world.nearest_m(x_m, y_m, reach_m + world.cell_m, self.mapped) - reach_m)
        new = [cell for cell in under if cell not in self.mapped]
        self.mapped.update(new)
        observations = [] if pose.error_m == KNOWN else self._found_off(pose, world)
        for cell in new:
            area, index = world.cells[cell]
            observations.append(Observation(((area, "mappedCell", index),)))
            if pose.error_m == KNOWN and (feature := world.features.get(cell)) is not None:
                observations.append(Observation(((feature.name, "foundAt", feature.position_m),)))
        for feature in self._stays.inspected(world, (pose.x_m, pose.y_m), speed_mps, now_s):
            observations.append(Observation(((feature.name, "inspectedBy", self._vehicle),)))
        return observations

    def _found_off(self, pose: Pose, world: Seabed) -> list[Observation]:
        observations = []
        # The sensor sees the seabed below the true position; the report carries the error of the believed one.
        for cell in world.under(pose.x_m, pose.y_m, self._reach_m) if world.features else ():
            feature = world.features.get(cell)
            if feature is not None and feature.name not in self._found:
                self._found.add(feature.name)
                (x_m, y_m), (off_x_m, off_y_m) = feature.position_m, pose.error_m
                observations.append(Observation(((feature.name, "foundAt", (x_m + off_x_m, y_m + off_y_m)),)))
        return observations


def mapping_sensor(data: VehicleData) -> str:
    """Name of the vehicle's mapping sensor; empty without one."""
    sensor = data.sensor(SwathSettings)
    return "" if sensor is None else sensor.name


def swath_m(data: VehicleData) -> float:
    """Swath of the vehicle's mapping sensor; 0 without one."""
    sensor = data.sensor(SwathSettings)
    return 0.0 if sensor is None else sensor.swath_m


def mapping_speed_mps(data: VehicleData) -> float:
    """Survey speed, limited by the mapping sensor."""
    sensor = data.sensor(SwathSettings)
    if sensor is None:
        return data.survey_speed_mps
    return min(data.survey_speed_mps, data.speed_factor * sensor.speed_limit_mps)
