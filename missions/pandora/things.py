"""The world of this mission: the parts of the structure as they really are, which nothing changes in a run.

What a tool does to a part is kept by the tool: a part is serviced once, and nobody looks at it afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from exchange.arithmetic import distance
from remoras.work import Point


@dataclass(frozen=True)
class TruePart:
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


BUCKET_M = 20.0
"""Points are looked up by squares of this side."""


@dataclass(frozen=True)
class Structure:
    """All parts of one run; ``seed`` is the root of what sensors show of them."""

    things: tuple[TruePart, ...]
    seed: int = 0
    _buckets: dict[tuple[int, int], list[tuple[int, TruePart, int]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        for number, thing in enumerate(self.things):
            for nth, (x_m, y_m) in enumerate(thing.points_m):
                bucket = math.floor(x_m / BUCKET_M), math.floor(y_m / BUCKET_M)
                self._buckets.setdefault(bucket, []).append((number, thing, nth))

    def near(self, at_m: Point, within_m: float) -> list[tuple[int, TruePart, int]]:
        """Points of parts within a distance: number of the part, the part, number of the point; in that order."""
        columns, rows = (
            range(math.floor((one - within_m) / BUCKET_M), math.floor((one + within_m) / BUCKET_M) + 1) for one in at_m
        )
        found = [
            one
            for column in columns
            for row in rows
            for one in self._buckets.get((column, row), ())
            if distance(at_m, one[1].points_m[one[2]]) <= within_m
        ]
        return sorted(found, key=lambda placed: (placed[0], placed[2]))
