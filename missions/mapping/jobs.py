"""The jobs of the mapping mission: each is the survey of one area."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from missions.mapping.sensors import mapping_speed_mps, swath_m
from missions.mapping.survey import length_m, zigzag
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.work import Outlook, Point


@dataclass(frozen=True)
class SurveyJob:
    """The survey of one area in zigzag rows, by a vehicle with a mapping sensor.

    Attributes:
        name: of the area.
        corners_m: of the area, in order.
        needs: areas that are to be mapped before.
    """

    name: str
    corners_m: tuple[Point, ...]
    needs: tuple[str, ...] = ()

    @property
    def place_m(self) -> Point:
        """Mean of the corners."""
        n = len(self.corners_m)
        return sum(x for x, _ in self.corners_m) / n, sum(y for _, y in self.corners_m) / n

    @property
    def done(self) -> Key:
        """Somebody has finished the area."""
        return "areaDone", self.name

    def is_able(self, data: VehicleData) -> bool:
        """True if the vehicle has a mapping sensor."""
        return swath_m(data) > 0.0

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """When and where the vehicle will be free if it surveys the area next; None without a sensor.

        It begins at the nearest of the ends that the survey may begin at.
        """
        swath, survey_mps = swath_m(data), mapping_speed_mps(data)
        if swath <= 0.0 or survey_mps <= 0.0:
            return None
        x_m, y_m = outlook.position_m
        way_m, last, survey_m = min(
            (math.hypot(first[0] - x_m, first[1] - y_m), last, length)
            for first, last, length in _surveys(self.corners_m, swath)
        )
        return Outlook(outlook.free_s + way_m / data.transit_speed_mps + survey_m / survey_mps, last)


@lru_cache(maxsize=4096)
def _surveys(corners_m: tuple[Point, ...], swath_m: float) -> tuple[tuple[Point, Point, float], ...]:
    """First waypoint, last waypoint and length (m) of the survey from each end that it may begin at."""
    ends = dict.fromkeys(zigzag(corners_m, swath_m, corner)[0] for corner in _box(corners_m))
    found = [(zigzag(corners_m, swath_m, end), end) for end in ends]
    return tuple((end, waypoints[-1], length_m(waypoints)) for waypoints, end in found)


def _box(corners_m: Sequence[Point]) -> list[Point]:
    """Corners of the rectangle around the area."""
    xs, ys = [x for x, _ in corners_m], [y for _, y in corners_m]
    return [(x, y) for x in (min(xs), max(xs)) for y in (min(ys), max(ys))]
