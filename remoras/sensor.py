"""The seam of sensors: what a vehicle perceives of the world of its mission.

A vehicle has any number of sensors, one ``[[vehicle.sensor]]`` table each. A sensor is one file: its settings (a
``SensorSettings`` with the keys of the table) and the sensor itself. An activity names the sensors that it switches on;
those that are on are asked once a motion tick. The world is whatever object the mission makes of it.

::

    class ThermometerSettings(SensorSettings):
        sigma_c: float = Field(0.1, ge=0.0, description="standard deviation of a reading (degree Celsius)")

        def make(self, data: VehicleData) -> Sensor:
            return Thermometer(self.sigma_c)


    class Thermometer:
        table = Table("temperatures", (TIME, VEHICLE, Column("temperature_c", "float", "degC")))

        def __init__(self, sigma_c: float) -> None:
            self._sigma_c = sigma_c

        def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
            return [Observation(row=(world.temperature_c(pose.x_m, pose.y_m),))]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

from pydantic import BaseModel, ConfigDict, Field

from exchange.arithmetic import length, sincos
from remoras.recorder import Table

if TYPE_CHECKING:
    from remoras.database import VehicleData

Reading = str | float | bool | tuple[float, float]
"""A value by name: that of a link is the name of the instance it points to, that of a point (x, y)."""
Fact = tuple[str, str, Reading] | tuple[str, str, Reading, float]
"""(subject, attribute, value), by names; behind it the uncertainty, if the sensor knows one: the standard deviation of
numbers and points, in their unit and of each axis alike; the probability that the value is right for all others."""

MOST_SIGMA_M = 32.0
"""The greatest standard deviation of a place that can be told, by ``rm:location`` of the ontology."""
SELF = ""
"""Subject of a fact about the instance that the observation has found."""


class Pose(NamedTuple):
    """Where a sensor is and how it moves: metres, radians, metres per second; depth below the surface.

    What it perceives is where it is. What it reports is where the vehicle takes itself to be, ``error_m`` from there.
    ``speed_mps`` is through the water, and ``flow_mps`` the velocity of the water there: (x east, y north). The vehicle
    does not know its error, but that it is not greater than ``uncertainty_m``, and its standard deviation on each axis,
    ``sigma_m``.
    """

    x_m: float
    y_m: float
    depth_m: float
    heading_rad: float
    speed_mps: float
    error_m: tuple[float, float] = (0.0, 0.0)
    flow_mps: tuple[float, float] = (0.0, 0.0)
    uncertainty_m: float = 0.0
    sigma_m: float = 0.0

    @property
    def ground_mps(self) -> float:
        """Speed over ground.

        >>> Pose(0.0, 0.0, 5.0, 0.0, 4.0, flow_mps=(0.0, 3.0)).ground_mps
        5.0
        """
        if self.flow_mps == (0.0, 0.0):
            return self.speed_mps
        sine, cosine = sincos(self.heading_rad)
        return length(self.speed_mps * cosine + self.flow_mps[0], self.speed_mps * sine + self.flow_mps[1])

    @property
    def believed_m(self) -> tuple[float, float]:
        """Where the vehicle takes itself to be: (x east, y north)."""
        return self.x_m + self.error_m[0], self.y_m + self.error_m[1]

    def located(self, seen_m: tuple[float, float], sigma_m: float, n_look: int = 1) -> Fact:
        """Where something is that was seen, and how sure that is by the sensor and by the vehicle's own place.

        The errors of looks are their own, but that of the vehicle is the same for all looks of a dive. So the mean of n
        looks has the variance ``sigma_m**2 / n + self.sigma_m**2``, and the n-th states what it adds to those before:
        fused as if independent they come to just that. The first states the root of the sum of squares.

        Args:
            seen_m: where, as the vehicle takes it.
            sigma_m: standard deviation of the sensor's error on each axis.
            n_look: which look at the same thing it is in this dive, from 1.

        Returns:
            The fact, without uncertainty where the look adds next to nothing: with more than ``MOST_SIGMA_M``.

        >>> pose = Pose(0.0, 0.0, 5.0, 0.0, 1.0, sigma_m=1.5)
        >>> pose.located((3.0, 4.0), 2.0)
        ('', 'location', (3.0, 4.0), 2.5)
        >>> stated_m = [pose.located((3.0, 4.0), 2.0, n)[3] for n in (1, 2, 3)]
        >>> round(1.0 / sum(one**-2 for one in stated_m), 9)  # 4 / 3 + 2.25
        3.583333333
        """
        ratio = self.sigma_m * self.sigma_m / (sigma_m * sigma_m)
        stated_m = sigma_m * math.sqrt((1.0 + n_look * ratio) * (1.0 + (n_look - 1) * ratio))
        place = SELF, "location", seen_m
        return place if stated_m > MOST_SIGMA_M else (*place, stated_m)


@dataclass(frozen=True, slots=True)
class Observation:
    """What a sensor has found out in one tick.

    Attributes:
        facts: recorded together in the vehicle's world model, and told to whoever needs them.
        row: values for the sensor's table, behind time and vehicle; empty for none.
        found: class of an instance that is created for what was found; facts with subject ``SELF`` are about it.
        within_m: so far from where it was found the nearest instance of the class that the vehicle knows of is taken
            for what was found, and none is created; the first fact about it with a point says where. 0: always create.
    """

    facts: tuple[Fact, ...] = ()
    row: tuple[Any, ...] = ()
    found: str = ""
    within_m: float = 0.0


class Sensor(Protocol):
    """One sensor of one vehicle in one run."""

    @property
    def table(self) -> Table | None:
        """Table that its rows go to: time, vehicle, then the columns of ``Observation.row``; None if it writes none."""
        ...

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        """What it perceives now; called once a motion tick while an activity has it switched on.

        It must be a function of its own past, pose, world and time alone: a draw is keyed by these, never streamed.
        """
        ...


class SensorSettings(BaseModel):
    """The table ``[[vehicle.sensor]]`` of one sensor; a kind of sensor adds its keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
    EQUIPMENT: ClassVar[str] = "Sensor"
    """Class of the ontology that such sensors are of; a kind of sensor says its own."""

    type: str = Field("", description="sensor: a name that the mission knows, or package.module:object")
    name: str = Field("", description="name by which activities switch it on; its type if absent")
    equipment: str = Field("", description="class of the ontology that it is of; that of its type if absent")

    @property
    def tells_state(self) -> bool:
        """True if the vehicle can ask it, on or off, whether it works; most sensors just fall silent when they fail."""
        return False

    def make(self, data: VehicleData) -> Sensor:
        """The sensor of a vehicle, made anew for every run; ``data`` are what the vehicle really is in that run."""
        raise NotImplementedError(f"{type(self).__name__} does not say how its sensor is made: define make(data)")
