"""Lower bound on the time to map all areas, for benchmarks.

Along survey rows, n cells of an area take at least n - 1 cell sides. Between two areas the path is at least the
distance of their nearest cells, each seen from half a swath away. Cells outside the goal, turning time, and features
still to be detected count as zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from exchange.arithmetic import distance
from missions.lower_bound import Rounder, Rounds
from missions.mapping.jobs import grounds_of
from missions.mapping.scenario import MappingScenario
from missions.mapping.sensors import mapping_speed_mps, swath_m
from missions.scenarios import Scenario
from remoras.behaviours import CAPTURE_M
from remoras.database import VehicleData
from remoras.work import Point


def rounds(scenario: Scenario, vehicles: Sequence[VehicleData], meets: bool = True) -> Rounds:
    """Return the least paths and work; ``meets`` is False if lost vehicles need not meet."""
    assert isinstance(scenario, MappingScenario)
    able = [vehicle for vehicle in vehicles if swath_m(vehicle) > 0.0]
    reach_m = max(swath_m(vehicle) for vehicle in able) / 2.0
    cell_m, corners = scenario.world.cell_m, tuple((area.name, area.corners_m) for area in scenario.area)
    grounds = grounds_of(cell_m, corners).values()
    centres = [[ground.centre_m(index) for index in range(len(ground.cells))] for ground in grounds]
    swath = 2.0 * reach_m
    work_m = 0.0
    for ground in grounds:
        track_m = len(ground.cells) * cell_m * cell_m / swath - max(cell_m, swath)
        # A waypoint counts as reached within the capture radius, so each row may be cut at both ends.
        work_m += max(0.0, track_m - 2.0 * CAPTURE_M * len(ground.survey(swath).rows))
    left_out_m = (1.0 - scenario.mission.goal) * sum(map(len, centres)) * cell_m * cell_m / swath
    legs_m = tuple(tuple(_apart_m(cells_m, other, 2.0 * reach_m) for other in centres) for cells_m in centres)
    near_m = scenario.mission.arrival_radius_m + reach_m
    rallies = [[point.position_m] for point in scenario.rally_point]
    home_m = tuple(min(_apart_m(cells_m, rally, near_m) for rally in rallies) for cells_m in centres)
    return Rounds(
        legs_m,
        max(0.0, work_m - left_out_m),
        tuple(
            Rounder(
                tuple(_apart_m([vehicle.start_m], cells_m, reach_m) for cells_m in centres),
                home_m if meets else (0.0,) * len(home_m),
                vehicle.transit_speed_mps,
                mapping_speed_mps(vehicle),
            )
            for vehicle in able
        ),
    )


def _apart_m(cells_m: Sequence[Point], other: Sequence[Point], reach_m: float) -> float:
    return max(0.0, min((distance(a, b) for a in cells_m for b in other), default=math.inf) - reach_m)
