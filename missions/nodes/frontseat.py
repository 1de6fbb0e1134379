"""The frontseat: a real vehicle's own body, clock and modem, in place of those that are simulated.

The *body* says where it is and goes where it is told; the *clock* says what time it is, and how surely; the *modem* is
a driver. Whoever has a vehicle writes these in one file, see the how-to on nodes. What the body says is an event with a
time, and is logged, so the log of a real dive repeats as that of a simulated one does.

    body    fix  -> where the vehicle is, from the next motion tick on
            goal <- where to go and how fast, after each tick; to stop if no fix came for ``PATIENCE_S``, or the mission
                    is over
    clock   time -> of the mission; its uncertainty grows with the age of the last reading, as the machine's clock
                    drifts. A vehicle that is not sure to within ``communication.clock_tolerance_s`` says nothing: it
                    might speak in the slot of another
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from exchange.arithmetic import distance
from exchange.drivers import Driver, Paced
from missions.errors import ConfigurationError, ConfigurationFault
from remoras.database import VehicleData
from remoras.events import Observer
from remoras.functional.guidance import Guidance
from remoras.functional.layer import FunctionalLayer
from remoras.motion import Motion
from remoras.vehicle import Vehicle
from remoras.work import Point

PATIENCE_S = 10.0
"""A body that has not said for so long where it is (s) is told to stop."""
CRYSTAL = 50e-6
"""Drift of a machine's own clock (s a second), a common bound for quartz without compensation."""
_FIX = struct.Struct(">7d")


class Fix(NamedTuple):
    """Where a body is.

    Attributes:
        x_m, y_m: east and north of the scenario's origin.
        heading_rad: 0 along x, counter-clockwise; speed_mps: over ground.
        depth_m: below the surface.
        battery: share that is left, 0..1; NaN if it does not say, then what the scenario's vehicle would use counts.
        sigma_m: standard deviation of the place on each axis, as the body knows it; sensors state it of what they see.
    """

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    depth_m: float
    battery: float = math.nan
    sigma_m: float = 0.0

    @property
    def data(self) -> bytes:
        """As logs have it."""
        return _FIX.pack(*self)

    @classmethod
    def of(cls, data: bytes) -> Fix:
        """What ``data`` is of; raises struct.error if it is of none."""
        return cls(*_FIX.unpack(data))

    @property
    def is_sound(self) -> bool:
        """True if it may be believed: numbers, and a share that is one."""
        *place, battery, sigma_m = self
        is_whole = all(map(math.isfinite, (*place, sigma_m))) and sigma_m >= 0.0
        return is_whole and (math.isnan(battery) or 0.0 <= battery <= 1.0)


class Goal(NamedTuple):
    """Where a body is to go; speed 0 is to stop."""

    target_m: Point
    speed_mps: float


class OwnBody(Protocol):
    """Where it is comes in, where it is to go goes out; all are called from the thread of the node."""

    def fix(self) -> Fix | None:
        """Where it is, if it has said so since the last call; returns without waiting."""
        ...

    def guide(self, target_m: Point, speed_mps: float) -> None:
        """Go to a place (x east, y north) at a speed; 0: stop. Called at least once a motion tick."""
        ...

    def close(self) -> None:
        """Let go of it; calling it again does nothing."""
        ...


class Reading(NamedTuple):
    """What time it was: UTC as Unix time (s), at a time of ``time.monotonic``; by how much that may be wrong (s)."""

    utc_s: float
    at_s: float
    uncertainty_s: float


class UtcClock(Protocol):
    """A clock of one's own, such as GPS with a pulse per second."""

    def reading(self) -> Reading | None:
        """The newest that it has said; None before the first. Returns without waiting."""
        ...


@dataclass(frozen=True, slots=True)
class Frontseat:
    """A vehicle's own parts; None where those of the program are to do.

    Attributes:
        body: where it is, and what moves it.
        clock: of the vehicle.
        modem: makes its driver, of the pace by which that waits.
    """

    body: OwnBody | None = None
    clock: UtcClock | None = None
    modem: Callable[[Paced], Driver] | None = None


class Disciplined(Paced):
    """Time of the mission by a clock of one's own; between its readings that of the machine goes on.

    A reading counts if it is surer than what is known by the ones before.

    Args:
        clock: is read whenever the time is asked for.
        start_utc_s: when the mission begins, Unix time.
        until_read: what goes until the first reading, and how fast.
    """

    def __init__(self, clock: UtcClock, start_utc_s: float, until_read: Paced) -> None:
        super().__init__(until_read.start_s, until_read.speed)
        self._clock, self._start_utc_s = clock, start_utc_s
        self._last = Reading(0.0, 0.0, math.inf)

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        read = self._clock.reading()
        if read is not None and read.uncertainty_s <= self._unsure_s:
            self._last = read
            self.start_s = read.at_s - (read.utc_s - self._start_utc_s)
        return super().now_s

    @property
    def uncertainty_s(self) -> float:
        """By how much that may be wrong (s); infinite before the first reading."""
        return self._unsure_s * self.speed

    @property
    def _unsure_s(self) -> float:
        """The same in seconds of the machine."""
        return self._last.uncertainty_s + CRYSTAL * (time.monotonic() - self._last.at_s)


class Steered(Observer):
    """The body of a vehicle, as its functional layer has it: where it is by the last fix, and where it is to go.

    Attributes:
        goal: where it is to go since the last tick; None before the first one.
    """

    def __init__(self) -> None:
        self.goal: Goal | None = None
        self._fix: Fix | None = None
        self._is_placed = False
        self._silent_s = math.inf
        self._layer: FunctionalLayer | None = None

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Put the body in the place of the simulated one."""
        layer = vehicle.functional
        if type(layer.guidance) is not Guidance or layer.believed is not layer.motion:
            given = ConfigurationFault(
                "--frontseat",
                "body",
                "a scenario whose vehicles drift in no current and know where they are; leave "
                "out what is about these: the sea has them",
            )
            raise ConfigurationError(layer.data.name, [given])
        layer.guidance.go = self._go
        layer.sigma_m = 0.0 if self._fix is None else self._fix.sigma_m
        self._layer = layer

    def take(self, fix: Fix) -> None:
        """Be where the body says from the next tick on."""
        self._fix, self._silent_s = fix, 0.0
        if self._layer is not None:
            self._layer.sigma_m = fix.sigma_m

    def _go(self, motion: Motion, data: VehicleData, target_m: Point, speed_mps: float, dt_s: float) -> None:
        """Be where the body is, and note where it is to go; see ``remoras.motion.advance``."""
        self._silent_s += dt_s
        before_m, fix = motion.position_m, self._fix
        if fix is not None:
            motion.x_m, motion.y_m, motion.heading_rad, motion.speed_mps = fix[:4]
            motion.distance_m += distance(before_m, motion.position_m) if self._is_placed else 0.0
            self._is_placed = True
            assert self._layer is not None
            self._layer.depth_m = fix.depth_m
        if fix is None or math.isnan(fix.battery):
            motion.energy_j += data.power_w(motion.speed_mps) * dt_s
        else:
            motion.energy_j = (1.0 - fix.battery) * data.energy_j
        is_lost = self._silent_s > PATIENCE_S
        self.goal = Goal(motion.position_m, 0.0) if is_lost else Goal(target_m, speed_mps)


@dataclass(frozen=True, slots=True)
class Placed:
    """A fix that came."""

    steered: Steered
    fix: Fix

    def act(self, host: object) -> None:
        """Let the vehicle be there."""
        self.steered.take(self.fix)
