"""Jobs that any vehicle can do, and dwells at places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.behaviours import (
    ADVANCING,
    CAPTURE_M,
    DONE,
    Approach,
    Perception,
    Reference,
    attracted,
    distance_m,
)
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.work import Point

DONE_BY = "jobDone"
"""Attribute of a job: vehicle that has done it."""
THERE_M = 2.0
"""Distance below which a vehicle is at a place."""


@dataclass(frozen=True)
class AnyonesJob:
    """Base of a ``remoras.work.Job`` that any vehicle can do and no job precedes."""

    name: str
    needs: ClassVar[tuple[str, ...]] = ()

    @property
    def done(self) -> Key:
        """Fact that a vehicle has done it."""
        return DONE_BY, self.name

    def is_able(self, data: VehicleData) -> bool:
        """Return True for every vehicle."""
        return True


class Stay:
    """Travel to a place and dwell there; an interrupted dwell restarts."""

    def __init__(self, data: VehicleData) -> None:
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._since_s: float | None = None

    def perceive(self, to_go_m: float, stay_s: float, now_s: float, performed: bool) -> Perception:
        """Pending, nearest first; progresses on the way and on site; done after ``stay_s`` on site."""
        if to_go_m > THERE_M or not performed:
            self._since_s = None
            advance = self._approach.advance(to_go_m, now_s, performed)
            return Perception(1.0, advance) if performed else attracted(to_go_m)
        self._since_s = now_s if self._since_s is None else self._since_s
        return DONE if now_s - self._since_s >= stay_s else ADVANCING

    def begin_anew(self) -> None:
        """Discard the elapsed dwell."""
        self._since_s = None

    def reference(self, place_m: Point, motion: Motion) -> Reference:
        """Head for the place in transit; hold there."""
        return Reference(place_m, 0.0 if distance_m(motion, place_m) <= CAPTURE_M else self._speed_mps)
