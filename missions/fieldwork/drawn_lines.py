"""Survey lines drawn by the seed of a run, and the lower bound on the time to survey lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

from pydantic import Field

from exchange.arithmetic import distance, sincos
from exchange.channel.loss import GROUNDS, uniform
from missions.fieldwork.jobs import ON_LINE_M, SurveyLine
from missions.lower_bound import MOST_JOBS, Rounder, Rounds
from missions.scenarios.scenario import World
from remoras.database import VehicleData
from remoras.table import Section
from remoras.work import Point

PLOTS_PER_LINE = 1.5
MARGIN_M = 25.0
"""Least distance of a line from the border of its plot: one vehicle cannot escort two."""
SHORTEST = 0.5
"""Least length of a line, as a share of the longest in its plot and direction."""


class DrawnLines(Section):
    """Table ``[drawn_lines]``: survey lines that differ from run to run, by the seed."""

    number: int = Field(10, ge=1, le=MOST_JOBS, description="number of lines, each in a plot of its own in the world")
    escorted_share: float = Field(0.2, ge=0.0, le=1.0, description="share of the lines that need an escort")

    def of_seed(self, world: World, seed: int) -> tuple[SurveyLine, ...]:
        """Return the lines of a seed; the first ones need an escort, the same names in every run."""
        (west_m, east_m), (south_m, north_m) = world.x_m, world.y_m
        n_plots = PLOTS_PER_LINE * self.number
        n_across = math.ceil(math.sqrt(n_plots * (east_m - west_m) / (north_m - south_m)))
        n_up = math.ceil(n_plots / n_across)
        wide_m, high_m = (east_m - west_m) / n_across, (north_m - south_m) / n_up
        plots = sorted(
            product(range(n_across), range(n_up)), key=lambda plot: uniform(seed, GROUNDS, plot[0], plot[1], 0)
        )
        n_escorted = int(self.escorted_share * self.number + 0.5)
        lines = []
        for number, (column, row) in enumerate(plots[: self.number], 1):
            course, long, across, up = (uniform(seed, GROUNDS, column, row, draw) for draw in (1, 2, 3, 4))
            sine, cosine = sincos(2.0 * math.pi * course)
            room_m = wide_m - 2.0 * MARGIN_M, high_m - 2.0 * MARGIN_M
            longest_m = min(room_m[0] / max(1e-9, abs(cosine)), room_m[1] / max(1e-9, abs(sine)))
            half_m = 0.5 * (SHORTEST + (1.0 - SHORTEST) * long) * longest_m
            east, north = half_m * cosine, half_m * sine
            x_m = west_m + column * wide_m + MARGIN_M + abs(east) + across * (room_m[0] - 2.0 * abs(east))
            y_m = south_m + row * high_m + MARGIN_M + abs(north) + up * (room_m[1] - 2.0 * abs(north))
            ends_m = ((round(x_m + sign * east, 3), round(y_m + sign * north, 3)) for sign in (-1.0, 1.0))
            from_m, to_m = ends_m
            lines.append(SurveyLine(name=f"line {number}", from_m=from_m, to_m=to_m, escorted=number <= n_escorted))
        return tuple(lines)


def rounds(scenario: Any, vehicles: Sequence[VehicleData], meets: bool = True) -> Rounds:
    """Return the least paths and work of survey lines; ``meets`` is False if lost vehicles need not meet.

    An escort takes as long as the surveying vehicle, which may be faster: it counts with the slowest speed over the
    greatest. No two lines may be nearer than two ``within_m``.
    """
    lines, mission = scenario.line, scenario.mission
    reaches_m = [mission.within_m if line.escorted else ON_LINE_M for line in lines]
    near = list(zip(lines, reaches_m, strict=True))
    speeds_mps = [vehicle.survey_speed_mps for vehicle in vehicles]
    escort_share = min(speeds_mps) / max(speeds_mps)
    work_m = math.fsum(
        max(0.0, line.length_m - 2.0 * ON_LINE_M) * (1.0 + escort_share * line.n_helpers) for line in lines
    )
    rallies_m = [rally.position_m for rally in scenario.rally_point]
    home_m = tuple(
        max(0.0, min(_from_m(line, rally_m) for rally_m in rallies_m) - mission.arrival_radius_m - reach_m)
        for line, reach_m in near
    )
    return Rounds(
        tuple(tuple(max(0.0, _apart_m(a, b) - a_m - b_m) for b, b_m in near) for a, a_m in near),
        work_m,
        tuple(
            Rounder(
                tuple(max(0.0, _from_m(line, vehicle.start_m) - reach_m) for line, reach_m in near),
                home_m if meets else (0.0,) * len(lines),
                max(vehicle.transit_speed_mps, vehicle.survey_speed_mps),
                vehicle.survey_speed_mps,
            )
            for vehicle in vehicles
        ),
    )


def _from_m(line: SurveyLine, point_m: Point) -> float:
    return distance(point_m, line.at(line.along_m(point_m)))


def _apart_m(line: SurveyLine, other: SurveyLine) -> float:
    """Least distance (m) of two lines: 0 if they cross, else from an end of one of them."""
    if _is_between(line, other) and _is_between(other, line):
        return 0.0
    return min(
        *(_from_m(line, end_m) for end_m in (other.from_m, other.to_m)),
        *(_from_m(other, end_m) for end_m in (line.from_m, line.to_m)),
    )


def _is_between(line: SurveyLine, other: SurveyLine) -> bool:
    return line.is_left(other.from_m) != line.is_left(other.to_m)
