"""Headway: whether a vehicle comes nearer to where it is guided, whatever else moves it.

A current may be faster than what a fault has left of a vehicle's speed. The vehicle notices: for ``NO_WAY_S`` it was
not nearer to its target than before. Then it gives up its job, and if it makes none on the way to a meeting or home,
it withdraws from the mission. Whoever holds a place, or is near another one, waits for no headway.
"""

from __future__ import annotations

import math

from exchange.arithmetic import distance
from remoras.behaviours import Reference
from remoras.motion import Motion
from remoras.work import Point

NO_WAY_S = 300.0
"""A vehicle that came no nearer for so long makes no headway."""
NEARER_M, AT_M = 1.0, 5.0
"""It has come nearer by this, or is at its target within that."""


class Headway:
    """How one vehicle gets on.

    Attributes:
        is_lost: it makes none, since what guided it some time ago.
    """

    def __init__(self) -> None:
        self.is_lost = False
        self._target_m: Point | None = None
        self._nearest_m, self._since_s = math.inf, 0.0

    def is_missing(self, reference: Reference | None, motion: Motion, now_s: float) -> bool:
        """True if the vehicle makes no headway to where it was guided last.

        Args:
            reference: by which it was guided; None while another one is near, or nothing guides it.
            motion: where it takes itself to be; now_s: the time.
        """
        if reference is None or reference.speed_mps == 0.0:
            self._target_m = None
            return False
        to_go_m = distance(motion.position_m, reference.target_m)
        if reference.target_m != self._target_m:
            self._target_m, self._nearest_m, self._since_s = reference.target_m, to_go_m, now_s
        elif to_go_m < self._nearest_m - NEARER_M or to_go_m <= AT_M:
            self._nearest_m, self._since_s, self.is_lost = to_go_m, now_s, False
        elif now_s - self._since_s > NO_WAY_S:
            self._since_s, self.is_lost = now_s, True
            return True
        return False
