"""Current, ``[current]`` and ``[[current.surge]]``: moving water, compensated by guidance (``docs/model/sea.md``)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import Field, field_validator

from exchange.arithmetic import TAU, length, sincos
from exchange.channel import loss
from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining
from missions.files import shown
from missions.scenarios.features import slower_by
from remoras.events import Host, Observer
from remoras.functional.guidance import Guidance
from remoras.motion import NEAREST_M, turned
from remoras.table import NotNegative, PointM, Positive, Section, Sparse

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.behaviours import Reference
    from remoras.fleet.vehicle import Vehicle
    from remoras.functional.layer import FunctionalLayer
    from remoras.mission import Mission
    from remoras.motion.avoidance import HalfPlane, Neighbour
    from remoras.work import Point

KEY = "current"
SAME_TIME_S = 1e-6
STILL = (0.0, 0.0)

Velocity = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Surge:
    """Additional velocity from ``from_s`` until before ``until_s``, at all depths."""

    from_s: float
    until_s: float
    east_mps: float
    north_mps: float


@dataclass(frozen=True, slots=True)
class Current:
    """Velocity of the water; ``east_mps`` and ``north_mps`` hold at the surface at the maximum of the tide.

    An infinite ``shear_depth_m`` or ``tide_period_s`` means none; ``tide_phase`` is a share of the period.
    """

    east_mps: float
    north_mps: float
    shear_depth_m: float = math.inf
    tide_period_s: float = math.inf
    tide_phase: float = 0.0
    surges: tuple[Surge, ...] = ()

    def at(self, depth_m: float, now_s: float) -> Velocity:
        """Return the velocity (m/s) at a depth and time.

        >>> tidal = Current(0.5, 0.0, shear_depth_m=40.0, tide_period_s=3600.0)
        >>> tidal.at(10.0, 0.0), tidal.at(0.0, 1800.0)[0]
        ((0.375, 0.0), -0.5)
        """
        share = max(0.0, 1.0 - depth_m / self.shear_depth_m)
        share *= sincos(TAU * ((now_s / self.tide_period_s + self.tide_phase) % 1.0))[1]
        east_mps, north_mps = share * self.east_mps, share * self.north_mps
        for surge in self.surges:
            if surge.from_s <= now_s < surge.until_s:
                east_mps, north_mps = east_mps + surge.east_mps, north_mps + surge.north_mps
        return east_mps, north_mps

    def greatest_mps(self, depth_m: float) -> float:
        """Return an upper bound of the speed (m/s) at a depth, over tide and surge directions."""
        steady_mps = length(self.east_mps, self.north_mps) * max(0.0, 1.0 - depth_m / self.shear_depth_m)
        added_mps = [
            math.fsum(length(s.east_mps, s.north_mps) for s in self.surges if s.from_s <= begins.from_s < s.until_s)
            for begins in self.surges
        ]
        return steady_mps + max(added_mps, default=0.0)


def through_water(course: Velocity, speed_mps: float, current: Velocity) -> Velocity:
    """Return the velocity through the water (m/s) for a course (unit vector) over ground.

    If the course cannot be made good, head into the current at up to ``speed_mps``.

    >>> through_water((1.0, 0.0), 5.0, (0.0, 3.0))  # leaves 4 m/s over ground
    (4.0, -3.0)
    """
    along = current[0] * course[0] + current[1] * course[1]
    across = current[1] * course[0] - current[0] * course[1]
    # Speed over ground: g = c . d + sqrt(s^2 - (c x d)^2) along the course d, at the speed s through the water.
    left = speed_mps * speed_mps - across * across
    ground_mps = along + math.sqrt(left) if left > 0.0 else 0.0
    if ground_mps <= 0.0:
        strength_mps = length(*current)
        share = min(1.0, speed_mps / strength_mps) if strength_mps > 0.0 else 0.0
        return -share * current[0], -share * current[1]
    return ground_mps * course[0] - current[0], ground_mps * course[1] - current[1]


class SurgeTable(Section):
    """One ``[[current.surge]]``: a temporary change of the current."""

    between_s: tuple[NotNegative, NotNegative] = Field(description="[earliest, latest] start, drawn once per run")
    lasts_s: Positive = Field(description="duration")
    east_mps: float = Field(0.0, ge=-5.0, le=5.0, description="additional speed towards the east, at all depths")
    north_mps: float = Field(0.0, ge=-5.0, le=5.0, description="additional speed towards the north, at all depths")

    @field_validator("between_s")
    @classmethod
    def _in_order(cls, value: PointM) -> PointM:
        if value[0] > value[1]:
            raise ValueError("the earliest start may not be later than the latest")
        return value

    def drawn(self, seed: int, number: int) -> Surge:
        """Return the surge of the run; seed and ``number`` key the draw of its start."""
        earliest_s, latest_s = self.between_s
        share = loss.uniform(seed, loss.SURGES, number, 0, 0) if latest_s > earliest_s else 0.0
        from_s = earliest_s + share * (latest_s - earliest_s)
        return Surge(from_s, from_s + self.lasts_s, self.east_mps, self.north_mps)


class CurrentTable(Sparse):
    """The table ``[current]``."""

    UNSAID = frozenset({"surge"})

    east_mps: float = Field(0.0, ge=-5.0, le=5.0, description="current towards the east at the surface")
    north_mps: float = Field(0.0, ge=-5.0, le=5.0, description="current towards the north at the surface")
    shear_depth_m: Positive | None = Field(
        None, description="depth at which the current has decreased linearly to zero; uniform if absent"
    )
    tide_period_h: Positive | None = Field(
        None, description="period of the current, 12.42 for the lunar tide; steady if absent"
    )
    tide_phase: float = Field(
        0.0, ge=0.0, le=1.0, description="elapsed share of the period at the start: 0 full, 0.25 slack, 0.5 reversed"
    )
    surge: tuple[SurgeTable, ...] = Field((), description="temporary changes, a table each")

    def surges(self, seed: int) -> tuple[Surge, ...]:
        """Return the surges of the run with this seed."""
        return tuple(surge.drawn(seed, number) for number, surge in enumerate(self.surge))

    def foretold(self) -> Current | None:
        """Return the current without surges, which are drawn; None for still water."""
        return self.with_surges(())

    def greatest(self) -> Current:
        """Return an upper bound on the current: each surge from earliest start to latest end."""
        depth_m = math.inf if self.shear_depth_m is None else self.shear_depth_m
        surges = (Surge(s.between_s[0], s.between_s[1] + s.lasts_s, s.east_mps, s.north_mps) for s in self.surge)
        return Current(self.east_mps, self.north_mps, depth_m, surges=tuple(surges))

    def with_surges(self, surges: tuple[Surge, ...]) -> Current | None:
        """Return the current with these surges; None for still water."""
        if self.east_mps == self.north_mps == 0.0 and not surges:
            return None
        depth_m = math.inf if self.shear_depth_m is None else self.shear_depth_m
        period_s = math.inf if self.tide_period_h is None else 3600.0 * self.tide_period_h
        return Current(self.east_mps, self.north_mps, depth_m, period_s, self.tide_phase, surges)


class GuidanceInCurrent(Guidance):
    """Guidance in moving water, in place of ``still``; a vehicle that keeps its position heads into the current."""

    def __init__(self, still: Guidance, current: Current, depth_m: Callable[[], float]) -> None:
        super().__init__(still.motion, still.data, still.bounds_m, still.constants)
        self._is_over_ground = False
        self._current = current
        self._depth_m = depth_m

    def move(
        self,
        reference: Reference | None,
        neighbours: Sequence[Neighbour],
        positions_m: Mapping[str, Point],
        since_s: float,
        dt_s: float,
    ) -> None:
        """Move through the water and drift with it, see ``Guidance.move``; never steady."""
        self.flow_mps = self._current.at(self._depth_m(), since_s)
        self._is_over_ground = reference is not None and reference.is_over_ground
        super().move(reference, neighbours, positions_m, since_s, dt_s)
        self.motion.x_m += self.flow_mps[0] * dt_s
        self.motion.y_m += self.flow_mps[1] * dt_s

    def _aim(self, target_m: Point, speed_mps: float, dt_s: float) -> tuple[Point, float]:
        motion, flow = self.motion, self.flow_mps
        if speed_mps <= 0.0:
            # To keep its position, the vehicle makes up for the drift of the tick.
            return (motion.x_m - flow[0] * dt_s, motion.y_m - flow[1] * dt_s), min(length(*flow), self.most_mps)
        dx_m, dy_m = target_m[0] - motion.x_m, target_m[1] - motion.y_m
        range_m = length(dx_m, dy_m)
        course = (dx_m / range_m, dy_m / range_m) if range_m > 0.0 else STILL
        most_mps, (water, speed_mps) = speed_mps, self._through_water(course, speed_mps)
        ground_mps = length(water[0] + flow[0], water[1] + flow[1])
        if ground_mps * dt_s >= range_m:  # reached within the tick
            return (target_m[0] - flow[0] * dt_s, target_m[1] - flow[1] * dt_s), speed_mps
        time_s = range_m / ground_mps if ground_mps > 0.0 else dt_s
        if self._is_over_ground:
            speed_mps = min(speed_mps, self._while_it_turns(water, most_mps, dt_s))
        return (motion.x_m + water[0] * time_s, motion.y_m + water[1] * time_s), speed_mps

    def _while_it_turns(self, water: Velocity, most_mps: float, dt_s: float) -> float:
        """Greatest speed through the water (m/s) that keeps the limit over ground in a turn."""
        speed_mps, flow = length(*water), self.flow_mps
        if speed_mps <= NEAREST_M:
            return speed_mps
        wanted = water[0] / speed_mps, water[1] / speed_mps
        ahead = turned(self.motion.ahead, wanted, self.data.turn_rate_radps * dt_s)
        along = ahead[0] * flow[0] + ahead[1] * flow[1]
        # |s a + c| = limit, solved for the speed s along the heading a that the turn reaches within the tick.
        left = most_mps * most_mps - flow[0] * flow[0] - flow[1] * flow[1] + along * along
        return max(0.0, math.sqrt(left) - along) if left > 0.0 else 0.0

    @property
    def ground_mps(self) -> float:
        """Speed over ground (m/s) with the water velocity of the last motion tick."""
        motion = self.motion
        return length(
            motion.speed_mps * motion.ahead[0] + self.flow_mps[0], motion.speed_mps * motion.ahead[1] + self.flow_mps[1]
        )

    def _through_water(self, course: Velocity, speed_mps: float) -> tuple[Velocity, float]:
        flow = self.flow_mps
        if self._is_over_ground:
            wanted = speed_mps * course[0] - flow[0], speed_mps * course[1] - flow[1]
            speed_mps = length(*wanted)
            if speed_mps <= self.most_mps:
                return wanted, speed_mps
            speed_mps = self.most_mps
        return through_water(course, speed_mps, flow), speed_mps

    def walls(self, position_m: Point) -> Sequence[HalfPlane]:
        """Velocity constraints as in still water, shifted by the water velocity."""
        east_mps, north_mps = self.flow_mps
        # Avoidance works in the frame of the water, in which vehicles of one depth layer drift alike.
        return [wall._replace(x=wall.x - east_mps, y=wall.y - north_mps) for wall in super().walls(position_m)]


def in_current(layer: FunctionalLayer, current: Current) -> None:
    """Replace the guidance of a new vehicle by guidance in moving water."""
    layer.guidance = GuidanceInCurrent(layer.guidance, current, lambda: layer.depth_m)


class MovingWater(Observer):
    """Run hooks that move all vehicles with the current, and disabled ones from their next tick on."""

    def __init__(self, current: Current, tick_s: float) -> None:
        self._current, self._tick_s = current, tick_s
        self._since_s: dict[str, float] = {}

    def on_start(self, host: Host) -> None:
        self._host = host

    def on_vehicle(self, vehicle: Vehicle) -> None:
        in_current(vehicle.functional, self._current)

    def on_tick(self, vehicle: Vehicle) -> None:
        """Move an inoperative vehicle by the surface current, once per tick."""
        now_s = self._host.now_s
        if vehicle.is_alive or not vehicle.condition.is_there:
            self._since_s.pop(vehicle.name, None)
        elif now_s - self._since_s.setdefault(vehicle.name, now_s) > self._tick_s - SAME_TIME_S:
            self._since_s[vehicle.name] = now_s
            east_mps, north_mps = self._current.at(0.0, now_s - self._tick_s)
            vehicle.functional.motion.x_m += east_mps * self._tick_s
            vehicle.functional.motion.y_m += north_mps * self._tick_s


def observer_of(joining: Joining) -> MovingWater | None:
    """Return the run hooks; None for still water."""
    table: CurrentTable = joining.scenario.of_feature(KEY)
    current = table.with_surges(table.surges(joining.seed))
    return None if current is None else MovingWater(current, joining.scenario.scenario.tick_s)


def current_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: a current at least as fast as the slowest vehicle, and surges after the end."""
    table: CurrentTable = scenario.of_feature(KEY)
    for number, surge in enumerate(table.surge, 1):
        yield from scenario.after_end(f"{KEY}.surge.{number}.between_s", surge.between_s[0])
    current, (spread, why) = table.greatest(), slower_by(scenario)
    worst: tuple[float, str] | None = None
    for vehicle in scenario.vehicle:
        runs_mps, slowest_mps = current.greatest_mps(vehicle.depth_m), vehicle.survey_speed_mps * (1.0 - spread)
        if runs_mps >= slowest_mps and (worst is None or runs_mps - slowest_mps > worst[0]):
            allowed = (
                f"the current runs at {runs_mps:.3g} m/s at the {vehicle.depth_m:g} m of {vehicle.name}, which could "
                f"not stay where it is; allowed: less than {slowest_mps:.3g} m/s, its survey_speed_mps"
                + (f" less the {why} of {spread:g}" if spread else "")
            )
            worst = runs_mps - slowest_mps, allowed
    if worst is not None:
        key = max(("east_mps", "north_mps"), key=lambda key: abs(getattr(table, key)))
        yield ConfigurationFault(f"{KEY}.{key}", shown(getattr(table, key)), worst[1])


FEATURE = Feature(
    {"": {KEY: (CurrentTable, CurrentTable.usual())}},
    observer_of,
    current_faults,
    water=lambda scenario: scenario.of_feature(KEY),
)
