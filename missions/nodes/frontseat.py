"""Frontseat: body, clock and modem of a real vehicle, in place of simulated ones.

Users with a vehicle implement these in one file (see the how-to on nodes). Fixes of the body are logged events, so the
log of a real dive can be replayed like a simulated one.

    body    fix  -> place of the vehicle from the next motion tick on
            goal <- place and speed, after each tick; a stop after ``PATIENCE_S`` without a fix, or at mission end
    clock   time -> of the mission; its uncertainty grows with the age of the last reading, by the drift of the machine
                    clock. Above ``communication.clock_tolerance_s`` a vehicle does not transmit, since it might use
                    the slot of another
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
from missions.errors import ConfigurationError
from remoras.database import VehicleData
from remoras.events import Event, Observer
from remoras.fleet.vehicle import Vehicle
from remoras.functional.guidance import Guidance
from remoras.functional.layer import FunctionalLayer
from remoras.motion import Motion
from remoras.work import Point

PATIENCE_S = 10.0  # time without a fix (s) after which the body is stopped
CRYSTAL = 50e-6  # drift of a machine clock (s/s), a common bound for uncompensated quartz
_FIX = struct.Struct(">7d")


class Fix(NamedTuple):
    """Position fix of a body.

    Attributes:
        x_m, y_m: east and north of the scenario's origin.
        heading_rad, speed_mps: heading (0 along x, counter-clockwise) and speed over ground.
        battery: remaining share, 0 to 1; NaN if unknown, then the scenario's consumption counts.
        sigma_m: standard deviation of the place per axis; sensors report it with their observations.
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
        """Binary form in logs."""
        return _FIX.pack(*self)

    @classmethod
    def of(cls, data: bytes) -> Fix:
        """Parse ``data``; raises struct.error if invalid."""
        return cls(*_FIX.unpack(data))

    @property
    def is_sound(self) -> bool:
        """True for finite numbers, sigma of 0 or more, and battery in [0, 1] or NaN."""
        *place, battery, sigma_m = self
        is_whole = all(map(math.isfinite, (*place, sigma_m))) and sigma_m >= 0.0
        return is_whole and (math.isnan(battery) or 0.0 <= battery <= 1.0)


class Goal(NamedTuple):
    """Target of a body; speed 0 stops it."""

    target_m: Point
    speed_mps: float


class OwnBody(Protocol):
    """Interface of a real body; all calls come from the thread of the node."""

    def fix(self) -> Fix | None:
        """Return a fix received since the last call, or None, without blocking."""

    def guide(self, target_m: Point, speed_mps: float) -> None:
        """Go to a place (x east, y north) at a speed; 0 stops. Called at least once per tick."""

    def close(self) -> None:
        """Release the body; a repeated call has no effect."""


class Reading(NamedTuple):
    """Clock reading: Unix time (s) at a time of ``time.monotonic``, and its uncertainty (s)."""

    utc_s: float
    at_s: float
    uncertainty_s: float


class UtcClock(Protocol):
    """Interface of a real clock, such as GPS with a pulse per second."""

    def reading(self) -> Reading | None:
        """Return the newest reading, without blocking; None before the first."""


@dataclass(frozen=True, slots=True)
class Frontseat:
    """Real parts of a vehicle, None for default parts; ``modem`` creates the driver for a pace."""

    body: OwnBody | None = None
    clock: UtcClock | None = None
    modem: Callable[[Paced], Driver] | None = None


class Disciplined(Paced):
    """Mission time by a real clock, continued by the machine clock between readings, which count if more certain.

    ``start_utc_s`` is the mission start, Unix time; ``until_read`` the pace before the first reading.
    """

    def __init__(self, clock: UtcClock, start_utc_s: float, until_read: Paced) -> None:
        super().__init__(until_read.start_s, until_read.speed)
        self._clock, self._start_utc_s = clock, start_utc_s
        self._last = Reading(0.0, 0.0, math.inf)

    @property
    def now_s(self) -> float:
        read = self._clock.reading()
        if read is not None and read.uncertainty_s <= self._unsure_s:
            self._last = read
            self.start_s = read.at_s - (read.utc_s - self._start_utc_s)
        return super().now_s

    @property
    def uncertainty_s(self) -> float:
        """Uncertainty of the mission time (s); infinite before the first reading."""
        # In seconds of the mission, which passes ``speed`` times as fast.
        return self._unsure_s * self.speed

    @property
    def _unsure_s(self) -> float:
        return self._last.uncertainty_s + CRYSTAL * (time.monotonic() - self._last.at_s)


class Steered(Observer):
    """Real body in the functional layer; ``goal`` is None before the first tick."""

    def __init__(self) -> None:
        self.goal: Goal | None = None
        self._fix: Fix | None = None
        self._is_placed = False
        self._silent_s = math.inf
        self._layer: FunctionalLayer | None = None

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Replace the simulated body; raises ConfigurationError with current or position drift."""
        layer = vehicle.functional
        if type(layer.guidance) is not Guidance or layer.believed is not layer.motion:
            allowed = "a scenario without current and navigation errors, which the real sea has; leave out their tables"
            raise ConfigurationError.of(layer.data.name, "--frontseat", "body", allowed)
        layer.guidance.go = self._go
        # A restarted vehicle has a new layer, while the last fix is still valid.
        layer.sigma_m = 0.0 if self._fix is None else self._fix.sigma_m
        self._layer = layer

    def take(self, fix: Fix) -> None:
        """Use this fix from the next tick on."""
        self._fix, self._silent_s = fix, 0.0
        if self._layer is not None:
            self._layer.sigma_m = fix.sigma_m

    def _go(self, motion: Motion, data: VehicleData, target_m: Point, speed_mps: float, dt_s: float) -> None:
        """Replace the motion step (``remoras.motion.advance``): apply the fix and set the goal."""
        self._silent_s += dt_s
        before_m, fix = motion.position_m, self._fix
        if fix is not None:
            motion.x_m, motion.y_m, motion.heading_rad, motion.speed_mps = fix[:4]
            # The first fix corrects the planned start: this jump is no travelled distance.
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


def placed(steered: Steered, fix: Fix) -> Event:
    """Return the event of a received fix."""
    return lambda host: steered.take(fix)
