"""What missions share whose vehicles go to places and stay there: jobs that anybody may do, and how a stay gets on."""

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
"""Attribute of a job: who has done it."""
THERE_M = 2.0
"""A vehicle this near to a place is there."""


@dataclass(frozen=True)
class AnyonesJob:
    """Most of a ``remoras.work.Job``: every vehicle is able to do it, and nothing must be done before.

    Attributes:
        name: of the job.
        needs: nothing.
    """

    name: str
    needs: ClassVar[tuple[str, ...]] = ()

    @property
    def done(self) -> Key:
        """Somebody has done it."""
        return DONE_BY, self.name

    def is_able(self, data: VehicleData) -> bool:
        """Every vehicle is."""
        return True


class Stay:
    """How a vehicle gets to a place and stays there; whoever is called away begins anew.

    Args:
        data: of the vehicle.
    """

    def __init__(self, data: VehicleData) -> None:
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._since_s: float | None = None

    def perceive(self, to_go_m: float, stay_s: float, now_s: float, performed: bool) -> Perception:
        """Due, the nearest first; it advances on the way and there, and is done after ``stay_s`` there."""
        if to_go_m > THERE_M or not performed:
            self._since_s = None
            advance = self._approach.advance(to_go_m, now_s, performed)
            return Perception(1.0, advance) if performed else attracted(to_go_m)
        self._since_s = now_s if self._since_s is None else self._since_s
        return DONE if now_s - self._since_s >= stay_s else ADVANCING

    def begin_anew(self) -> None:
        """The time there so far does not count."""
        self._since_s = None

    def reference(self, place_m: Point, motion: Motion) -> Reference:
        """To the place in transit; stay there."""
        return Reference(place_m, 0.0 if distance_m(motion, place_m) <= CAPTURE_M else self._speed_mps)
