"""Detours: how a vehicle goes round those who stand in its way.

Keeping clear (``remoras.avoidance``) looks a few seconds ahead, so a vehicle that heads between two others which stand
too close together stops before them, and nobody of them has a reason to move. Once it has stood so for ``STUCK_S`` it
goes to the right of its course for a few separations; if nothing comes of that, the next time to the left; then back
and to the right from there. Where somebody near signals how content it is, a vehicle makes no detour: the more content
gives way, see ``remoras.attraction``.
"""

from __future__ import annotations

from exchange.arithmetic import length
from remoras.avoidance import Velocity

STUCK_S, FUTILE_S = 20.0, 3.0
"""For so long a vehicle stands before others until it goes round them, or on its way round until it leaves that."""
STANDS_MPS, WANTS_MPS = 0.1, 0.3
"""It stands if others leave it less than the former of a speed of more than the latter."""
SEPARATIONS = 4.0
"""So many separations it goes aside; where the target is nearer than that, it waits: somebody stands there."""
BACK = (-0.5, 0.0)
TURNS: tuple[Velocity, ...] = ((0.0, -0.5), (0.0, 0.5), BACK)
"""Where it goes, as (ahead, to the left) of its course: right, left, back; at half its speed, to turn short."""


class Detour:
    """The way of one vehicle round others.

    Args:
        separation_m: distance that vehicles keep.
    """

    def __init__(self, separation_m: float) -> None:
        self._aside_m = SEPARATIONS * separation_m
        self._left_m = 0.0
        self._stood_s = 0.0
        self._n_ended = 0

    @property
    def is_on(self) -> bool:
        """True while the vehicle goes round others."""
        return self._left_m > 0.0

    def turned(self, goal: Velocity) -> Velocity:
        """The velocity (m/s) of a goal, turned aside during a detour; else the same object."""
        if not self.is_on:
            return goal
        ahead, left = TURNS[self._n_ended % len(TURNS)]
        return goal[0] * ahead - goal[1] * left, goal[1] * ahead + goal[0] * left

    def note(self, goal: Velocity, velocity: Velocity, to_go_m: float, dt_s: float) -> None:
        """Note what others leave of a goal's velocity (m/s) for ``dt_s``, with so far to go to the target."""
        speed_mps = length(*velocity)
        stands = speed_mps < STANDS_MPS and length(*goal) > WANTS_MPS and to_go_m > self._aside_m
        self._stood_s = self._stood_s + dt_s if stands else 0.0
        if self.is_on:
            is_futile = self._stood_s >= FUTILE_S
            self._left_m = 0.0 if is_futile else self._left_m - speed_mps * dt_s
            if not self.is_on:
                is_back = TURNS[self._n_ended % len(TURNS)] == BACK and not is_futile
                self._stood_s, self._left_m = 0.0, self._aside_m if is_back else 0.0
                self._n_ended += 1
        elif self._stood_s >= STUCK_S:
            self._stood_s, self._left_m = 0.0, self._aside_m
