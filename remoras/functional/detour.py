"""Detours: how a vehicle goes round those who stand in its way.

Keeping clear (``remoras.avoidance``) looks a few seconds ahead, so a vehicle that heads between two others which stand
too close together stops before them, and nobody of them has a reason to move. Once it has stood so for ``STUCK_S`` it
goes to the right of its course for a few separations, the next time to the left, then back: the first such way that
leads out of the pocket.
"""

from __future__ import annotations

from exchange.arithmetic import length
from remoras.avoidance import Velocity

STUCK_S = 20.0
"""For so long a vehicle stands before others until it goes round them."""
STANDS_MPS, WANTS_MPS = 0.1, 0.3
"""It stands if others leave it less than the former of a speed of more than the latter."""
SEPARATIONS = 4.0
"""So many separations it goes aside; where the target is nearer than that, it waits: somebody stands there."""
TURNS: tuple[Velocity, ...] = ((0.0, -0.5), (0.0, 0.5), (-0.5, 0.0))
"""Where it goes, one after the other, as (ahead, to the left): right, left, back; at half its speed, to turn short."""


class Detour:
    """The way of one vehicle round others.

    Args:
        separation_m: distance that vehicles keep.
    """

    def __init__(self, separation_m: float) -> None:
        self._aside_m = SEPARATIONS * separation_m
        self._left_m = 0.0
        self._blocked_s = 0.0
        self._n_begun = 0

    def turned(self, goal: Velocity) -> Velocity:
        """The velocity (m/s) of a goal, turned aside during a detour; else the same object."""
        if self._left_m <= 0.0:
            return goal
        ahead, left = TURNS[(self._n_begun - 1) % len(TURNS)]
        return goal[0] * ahead - goal[1] * left, goal[1] * ahead + goal[0] * left

    def note(self, goal: Velocity, velocity: Velocity, to_go_m: float, dt_s: float) -> None:
        """Note what others leave of a goal's velocity (m/s) for ``dt_s``, with so far to go to the target."""
        speed_mps = length(*velocity)
        self._left_m -= speed_mps * dt_s
        is_blocked = speed_mps < STANDS_MPS and length(*goal) > WANTS_MPS and to_go_m > self._aside_m
        self._blocked_s = self._blocked_s + dt_s if is_blocked else 0.0
        if self._blocked_s >= STUCK_S:
            self._blocked_s, self._left_m = 0.0, self._aside_m
            self._n_begun += 1
