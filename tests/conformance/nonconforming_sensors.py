"""Sensors that break one rule each."""

import itertools
from collections.abc import Sequence
from typing import Any, ClassVar

from remoras.database import VehicleData
from remoras.recorder import TIME, TRAJECTORIES, VEHICLE, Column, Table
from remoras.sensor import Observation, Pose, Sensor, SensorSettings

DEPTHS = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))


class Sounding(SensorSettings):
    """A sensor that keeps to the rules; those below change one thing."""

    def make(self, data: VehicleData) -> Sensor:
        return type(self).Made()

    class Made:
        table: Any = DEPTHS

        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(row=(pose.depth_m,))]


class Blind(Sounding):
    def make(self, data: VehicleData) -> Any:
        return object()


class Bare(Sounding):
    class Made(Sounding.Made):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Any:
            return [(pose.depth_m,)]


class Timeless(Sounding):
    class Made(Sounding.Made):
        table = Table("depths", (Column("depth_m", "float", "m"),))


class Impostor(Sounding):
    class Made(Sounding.Made):
        table = TRAJECTORIES


class Wide(Sounding):
    class Made(Sounding.Made):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(row=(pose.depth_m, pose.x_m))]


class Spelled(Sounding):
    class Made(Sounding.Made):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(row=(f"{pose.depth_m} m",))]


class Homeless(Sounding):
    class Made(Sounding.Made):
        table = None


class Inventive(Sounding):
    class Made(Sounding.Made):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(facts=(("AUV00", "salinity", 35.0),))]


class Dreaming(Sounding):
    class Made(Sounding.Made):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(found="Mermaid")]


class Streaming(Sounding):
    """Draws from a stream that all of its kind share."""

    class Made(Sounding.Made):
        _stream: ClassVar[Any] = itertools.count()

        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(row=(pose.depth_m + next(self._stream),))]


class Collecting(Sounding):
    """Takes what it finds out of the world."""

    class Made(Sounding.Made):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            world["readings"] = world.get("readings", 0) + 1
            return [Observation(row=(pose.depth_m,))]
