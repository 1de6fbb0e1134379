"""Objects that lie in the sea, of which no vehicle knows, and the sensor that finds and classifies them.

Whoever comes near sees where an object is and what it seems to be, both with an error, and says how sure it is. The
first that tells of it creates an instance of the ontology; whoever sees something near to what it knows of takes it for
the same. Each draw is keyed by seed, object, vehicle and look: no strategy, loss or fault changes what a look shows.
"""

from __future__ import annotations

from collections import Counter
from typing import Literal

from pydantic import Field

from exchange.acoustics import loss
from exchange.arithmetic import distance, normal_quantile
from missions.mapping.sensors import Seabed, SeaObject
from missions.scenarios.tables import Name, PointM, Section
from remoras.database import VehicleData
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import SELF, Observation, Pose, SensorSettings

CLASSES = ("wreck", "pipeline", "anomaly")
"""What an object may be, and seem to be: the values of ``rm:classification`` but ``unknown``."""
SIGHTINGS = Table("sightings", (
    TIME, VEHICLE, Column("object", "str"), Column("classification", "str"), Column("x_m", "float", "m"),
    Column("y_m", "float", "m"),
))  # fmt: skip
"""What classifying sensors showed before any fault of theirs, and by which object; vehicles do not know the latter."""
MOST_SHARE = 0.999
"""A normal error is cut off here, and at the other end: at 3.1 standard deviations."""
FOUND_PER_OBJECT = 4
"""Instances of one object that one vehicle creates at most; more than one if its readings jump."""

MOST_LOOKS = 256
"""Looks of one vehicle at one object; it then takes no more, since numbers on the wire are as wide as this."""


class ObjectTable(Section):
    """One ``[[object]]``: something in the sea that no vehicle knows of."""

    name: Name = Field(description="name of the object in tables; vehicles do not know it")
    position_m: PointM = Field(description="where it lies, x east, y north")
    classification: Literal["wreck", "pipeline", "anomaly"] = Field(description="what it is")

    def lying(self) -> SeaObject:
        """The object as a value."""
        return SeaObject(self.name, self.position_m, self.classification)


class ClassifierSettings(SensorSettings):
    """The table ``[vehicle.sensor]`` of a classifying sensor."""

    range_m: float = Field(80.0, gt=0.0, description="farthest object that it sees")
    p_right: float = Field(
        0.8, gt=0.25, lt=1.0, description="probability that it takes an object for what it is, which it states"
    )
    sigma_m: float = Field(
        2.0, gt=0.0, le=32.0, description="standard deviation of the place that it sees, on each axis, which it states"
    )
    every_s: float = Field(60.0, gt=0.0, description="time between two looks at an object")
    within_m: float = Field(
        20.0, ge=0.0, description="a known object so near to what it sees is taken for the same; 0: none is"
    )

    def make(self, data: VehicleData) -> Classifier:
        """The sensor of a vehicle."""
        return Classifier(self, data.node)


class Classifier:
    """Sees objects within its range: where each is and what it seems to be.

    Args:
        settings: its table.
        node: of the vehicle that carries it; its draws are its own.
    """

    table = SIGHTINGS

    def __init__(self, settings: ClassifierSettings, node: int) -> None:
        self._settings = settings
        self._node = node
        self._next_s: dict[int, float] = {}
        self._n_looks: Counter[int] = Counter()

    def sense(self, pose: Pose, world: Seabed, now_s: float) -> list[Observation]:
        """An observation of each object in range that it has not looked at lately."""
        found = []
        for number, one in enumerate(world.objects):
            if distance(one.position_m, (pose.x_m, pose.y_m)) > self._settings.range_m:
                continue
            if now_s >= self._next_s.get(number, 0.0) and self._n_looks[number] < MOST_LOOKS:
                self._next_s[number] = now_s + self._settings.every_s
                found.append(self._look(number, one, pose, world.seed))
        return found

    def _look(self, number: int, one: SeaObject, pose: Pose, seed: int) -> Observation:
        settings, look = self._settings, self._n_looks[number]
        self._n_looks[number] += 1
        right, which, east, north = (
            loss.uniform(seed, loss.LOOKS, look, self._node, 4 * number + draw) for draw in range(4)
        )
        others = [name for name in CLASSES if name != one.classification]
        seems = one.classification if right < settings.p_right else others[int(which * len(others))]
        x_m, y_m = (
            at_m + off_m + settings.sigma_m * normal_quantile(min(max(share, 1.0 - MOST_SHARE), MOST_SHARE))
            for at_m, off_m, share in zip(one.position_m, pose.error_m, (east, north), strict=True)
        )
        return Observation(
            ((SELF, "location", (x_m, y_m), settings.sigma_m), (SELF, "classification", seems, settings.p_right)),
            (one.name, seems, x_m, y_m),
            "ObjectOfInterest",
            settings.within_m,
        )
