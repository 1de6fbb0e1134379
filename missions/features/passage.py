"""Passage, ``[passage]``: a reef across the world, crossed through one narrow gap that all vehicles know.

The reef is a band from south to north, the gap runs west to east. A vehicle whose target lies beyond heads for the near
mouth, then for the far one. Reef and gap constrain velocities as the world's borders do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from pydantic import Field

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining
from remoras.events import Observer
from remoras.motion.avoidance import RECOVERY_S, HalfPlane
from remoras.table import Positive, Section, SpanM

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.fleet.vehicle import Vehicle
    from remoras.mission import Mission
    from remoras.work import Point

KEY = "passage"
MOUTH_M = 6.0  # distance of the waypoint, and of the walls' ends, from the mouth: no corner is cut
SLACK_M = 0.3  # tolerance beyond the walls within which a vehicle still counts as in the passage


class PassageTable(Section):
    """The table ``[passage]``."""

    x_m: SpanM = Field(description="western and eastern border of the reef")
    y_m: float = Field(description="centre of the passage")
    width_m: Positive = Field(description="width of the passage")

    def passage(self, separation_m: float) -> ReefPassage:
        """Return the passage for a separation; vehicles keep half of it from the reef."""
        west_m, east_m = self.x_m
        half_m = separation_m / 2.0
        return ReefPassage(west_m - half_m, east_m + half_m, self.y_m, max(0.0, self.width_m / 2.0 - half_m))


@dataclass(frozen=True)
class ReefPassage:
    """Reef and gap, reduced to the places open to vehicles; ``half_m``: greatest distance from ``y_m`` in the gap."""

    west_m: float
    east_m: float
    y_m: float
    half_m: float

    def side(self, at_m: Point) -> int:
        """Return -1 west of the reef, 1 east, 0 in the passage; inside the reef, the nearer side."""
        x_m, y_m = at_m
        if self.west_m <= x_m <= self.east_m and abs(y_m - self.y_m) <= self.half_m + SLACK_M:
            return 0
        return -1 if x_m < 0.5 * (self.west_m + self.east_m) else 1

    def mouth_m(self, side: int) -> Point:
        """Return the waypoint before the western (-1) or eastern (1) mouth."""
        return (self.west_m - MOUTH_M if side < 0 else self.east_m + MOUTH_M), self.y_m

    def way_m(self, from_m: Point, to_m: Point) -> tuple[Point, ...]:
        """Return the waypoints of a path, ``to_m`` included.

        >>> ReefPassage(0.0, 80.0, 0.0, 2.0).way_m((-50.0, 90.0), (120.0, -40.0))
        ((-6.0, 0.0), (86.0, 0.0), (120.0, -40.0))
        """
        here, there = self.side(from_m), self.side(to_m)
        if here == there:
            return (to_m,)
        first = () if not here or self._is_before(from_m, here) else (self.mouth_m(here),)
        return (*first, self.mouth_m(there), to_m) if there else (*first, to_m)

    def length_m(self, from_m: Point, to_m: Point) -> float:
        """Length (m) of the path of ``way_m``."""
        places_m = (from_m, *self.way_m(from_m, to_m))
        return math.fsum(distance(a_m, b_m) for a_m, b_m in pairwise(places_m))

    def _is_before(self, at_m: Point, side: int) -> bool:
        """True within reach of the mouth on a straight line through the passage."""
        x_m, y_m = self.mouth_m(side)
        return abs(at_m[0] - x_m) <= MOUTH_M and abs(at_m[1] - y_m) <= self.half_m

    def walls(self, at_m: Point) -> list[HalfPlane]:
        """Return constraints on velocity (m/s) that keep a vehicle off the reef for ``RECOVERY_S``."""
        x_m, y_m = at_m
        side, is_along = self.side(at_m), abs(y_m - self.y_m) <= self.half_m + SLACK_M
        # The walls extend beyond the mouths, so that no vehicle cuts a corner of the reef.
        if is_along and self.west_m - MOUTH_M <= x_m <= self.east_m + MOUTH_M:
            north_m, south_m = self.y_m + self.half_m - y_m, self.y_m - self.half_m - y_m
            return [
                HalfPlane(0.0, max(0.0, north_m) / RECOVERY_S, -1.0, 0.0),
                HalfPlane(0.0, min(0.0, south_m) / RECOVERY_S, 1.0, 0.0),
            ]
        if is_along:
            return []
        border_m = self.west_m if side < 0 else self.east_m
        return [HalfPlane((border_m - x_m) / RECOVERY_S, 0.0, 0.0, float(-side))]


class Reef(Observer):
    """Run hooks that make guidance avoid the reef and use the passage."""

    def __init__(self, joining: Joining) -> None:
        table: PassageTable = joining.scenario.of_feature(KEY)
        self._passage = table.passage(joining.scenario.guidance.separation_m)

    def on_vehicle(self, vehicle: Vehicle) -> None:
        vehicle.functional.guidance.passage = self._passage


def passage_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: a passage too narrow or outside the world, and positions inside the reef."""
    table, separation_m = scenario.of_feature(KEY), scenario.guidance.separation_m
    (west_m, east_m), width_m = table.x_m, table.width_m
    x_min, y_min, x_max, y_max = scenario.world.box_m
    if width_m < separation_m:
        allowed = f"narrower than the separation; allowed: guidance.separation_m = {separation_m:g} or more"
        yield ConfigurationFault(f"{KEY}.width_m", "", allowed)
    elif not (x_min < west_m and east_m < x_max):
        allowed = f"allowed: borders within the world, x {x_min:g} to {x_max:g}"
        yield ConfigurationFault(f"{KEY}.x_m", "", allowed)
    elif not y_min + width_m / 2.0 <= table.y_m <= y_max - width_m / 2.0:
        allowed = f"allowed: {y_min + width_m / 2.0:g} to {y_max - width_m / 2.0:g}, so that it lies within the world"
        yield ConfigurationFault(f"{KEY}.y_m", "", allowed)
    else:
        half_m = separation_m / 2.0
        places = [(f"rally_point.{t.name}.position_m", t.position_m) for t in scenario.rally_point]
        for key, (x_m, _) in [*((f"vehicle.{t.name}.start_m", t.start_m) for t in scenario.vehicle), *places]:
            if west_m - half_m <= x_m <= east_m + half_m:
                reef = f"x {west_m - half_m:g} to {east_m + half_m:g}"
                yield ConfigurationFault(key, "", f"in the reef, {reef}, or its passage; place it outside")


FEATURE = Feature({"": {KEY: (PassageTable | None, None)}}, Reef, passage_faults)
