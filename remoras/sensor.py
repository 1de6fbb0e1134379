"""Protocol of sensors: perception of the world of a mission.

A vehicle has any number of sensors, one ``[[vehicle.sensor]]`` table each. A sensor is one file: its settings (a
``SensorSettings`` with the keys of the table) and the sensor itself. An activity names the sensors that it switches on;
these are called once per motion tick. The world is any object of the mission.

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

from exchange.arithmetic import length, normal_quantile, sincos
from remoras.recorder import Table

if TYPE_CHECKING:
    from remoras.database import VehicleData

Reading = str | float | bool | tuple[float, float]
"""Value by name: instance name for a link, (x, y) for a point."""
Fact = tuple[str, str, Reading] | tuple[str, str, Reading, float]
"""(subject, attribute, value), by names, optionally with uncertainty.

For numbers and points it is the standard deviation, in their unit, per axis; for other values the probability of being
correct.
"""

MOST_SIGMA_M = 32.0
"""Greatest standard deviation of a position in ``rm:location`` of the ontology."""
SELF = ""
"""Subject of facts about the detected instance."""
MOST_SHARE = 0.999
"""Quantile at which normal errors are cut off on both sides (3.1 standard deviations)."""


def normal_error(share: float) -> float:
    """Return the standard normal error of a uniform number in [0, 1)."""
    return normal_quantile(min(max(share, 1.0 - MOST_SHARE), MOST_SHARE))


class Pose(NamedTuple):
    """Position and motion of a sensor: m, rad, m/s; depth below the surface.

    Perception uses the true position, reports the believed one, ``error_m`` from it. ``speed_mps`` is through the
    water, ``flow_mps`` the velocity of the water (x east, y north). The vehicle does not know its error, only the bound
    ``uncertainty_m`` and the standard deviation per axis ``sigma_m``.

    >>> Pose(10.0, 20.0, 5.0, 0.0, 1.5, error_m=(1.0, 0.0)).believed_m
    (11.0, 20.0)
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
        """Believed position (x east, y north)."""
        return self.x_m + self.error_m[0], self.y_m + self.error_m[1]

    def located(self, seen_m: tuple[float, float], sigma_m: float, n_look: int = 1) -> Fact:
        """Return the position fact of a detection, with the uncertainty of sensor and vehicle.

        Sensor errors of observations are independent, the vehicle's error is common to a dive. So the mean of n has
        variance ``sigma_m**2 / n + self.sigma_m**2``. The n-th observation of an object in the dive (``n_look``, from
        1) states its own contribution: fused as independent, they yield that variance. Above ``MOST_SIGMA_M`` the fact
        has no uncertainty. ``seen_m`` is in the vehicle's frame of belief; ``sigma_m`` is that of the sensor per axis.

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
    """Result of a sensor in one tick.

    ``facts`` are recorded together and sent to interested peers; ``row`` follows time and vehicle in the sensor's
    table, empty for none. ``found`` is the class of the instance created for a detection, described by facts with
    subject ``SELF``; one known ``within_m`` of the first point fact is reused, with 0 never.

    >>> Observation(((SELF, "location", (3.0, 4.0)),), found="Wreck", within_m=5.0).row
    ()
    """

    facts: tuple[Fact, ...] = ()
    row: tuple[Any, ...] = ()
    found: str = ""
    within_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Quiet(Sequence[Any]):
    """No observation or conclusion, until the vehicle has moved ``until_m`` (m) or the time is ``until_s`` (s).

    The next call is then, or earlier. NaN raises ValueError.

    >>> list(Quiet(until_m=12.5))
    []
    """

    until_m: float = math.inf
    until_s: float = math.inf

    def __post_init__(self) -> None:
        if math.isnan(self.until_m) or math.isnan(self.until_s):
            raise ValueError(f"{self} has a NaN; allowed: metres, seconds, or infinity")

    def __len__(self) -> int:
        return 0

    def __getitem__(self, place: Any) -> Any:
        raise IndexError(f"observation {place} of none")


class QuietFrom(NamedTuple):
    """``Quiet`` (distance, time) with the place (m) where it was stated."""

    until_m: float
    until_s: float
    x_m: float
    y_m: float

    def holds(self, x_m: float, y_m: float, now_s: float) -> bool:
        """Return whether it is still valid at a place and time."""
        until_m, until_s, from_x_m, from_y_m = self
        dx_m, dy_m = x_m - from_x_m, y_m - from_y_m
        return now_s < until_s and dx_m * dx_m + dy_m * dy_m < until_m * until_m


NEVER_QUIET = QuietFrom(0.0, 0.0, 0.0, 0.0)


class Sensor(Protocol):
    """One sensor of one vehicle in one run.

    >>> class Sounder(Sensor):
    ...     table = None
    ...     def sense(self, pose, world, now_s):
    ...         return [Observation(row=(world.bottom_m - pose.depth_m,))]
    >>> from types import SimpleNamespace
    >>> Sounder().sense(Pose(0.0, 0.0, 5.0, 0.0, 0.0), SimpleNamespace(bottom_m=12.0), 0.0)[0].row
    (7.0,)
    """

    @property
    def table(self) -> Table | None:
        """Table of its rows: time, vehicle, then columns of ``Observation.row``; None without rows."""

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        """Return the observations of a motion tick, or a ``Quiet``; called while switched on.

        It must depend only on its past, pose, world and time: random draws are keyed by these, never streamed.
        """


class SensorSettings(BaseModel):
    """Table ``[[vehicle.sensor]]``; kinds of sensors add keys.

    >>> class SounderSettings(SensorSettings):
    ...     range_m: float = Field(50.0, gt=0.0, description="greatest depth below the vehicle")
    >>> SounderSettings(name="sounder").range_m
    50.0
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True, validate_default=True)
    EQUIPMENT: ClassVar[str] = "Sensor"
    """Ontology class of such sensors, overridden per kind."""

    type: str = Field("", description="sensor: a name known to the mission, or package.module:object")
    name: str = Field("", description="name by which activities activate it; its type if absent")
    equipment: str = Field("", description="class in the ontology; that of its type if absent")

    @property
    def tells_state(self) -> bool:
        """True if the sensor reports its health, on or off; most just stop observing on failure."""
        return False

    def make(self, data: VehicleData) -> Sensor:
        """Return a new sensor for a run; ``data`` are the true properties of the vehicle."""
        raise NotImplementedError(f"{type(self).__name__} lacks make(data), which makes its sensor")
