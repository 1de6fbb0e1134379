"""The world of this mission: the parts of the structure as they really are, which nothing changes in a run.

What a tool does to a part is kept by the tool: a part is serviced once, and nobody looks at it afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from remoras.work import Point


@dataclass(frozen=True)
class Thing:
    """A part as it really is.

    Attributes:
        name: of the part; kind: class of its instance.
        points_m: where it really is.
        work_s: how long a camera looks at each point, or a tool works on it.
        state: of a valve.
        is_stuck: only a wrench turns it.
        upset: what is not as planned with it, empty if nothing is.
    """

    name: str
    kind: str
    points_m: tuple[Point, ...]
    work_s: float
    state: str = "open"
    is_stuck: bool = False
    upset: str = ""


@dataclass(frozen=True)
class Structure:
    """All parts of one run; ``seed`` is the root of what sensors show of them."""

    things: tuple[Thing, ...]
    seed: int = 0

    def near(self, at_m: Point, within_m: float) -> list[tuple[int, Thing, int]]:
        """Points of parts within a distance: number of the part, the part, number of the point."""
        return [
            (number, thing, nth)
            for number, thing in enumerate(self.things)
            for nth, point_m in enumerate(thing.points_m)
            if math.dist(at_m, point_m) <= within_m
        ]
