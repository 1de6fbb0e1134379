"""Behaviours that break one rule each."""

import itertools
import math
from typing import Any

from remoras.behaviours import DONE, DUE, Perception, Reference, Standing
from remoras.motion import Motion
from remoras.picture import Picture


class Overexcited(Standing):
    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return Perception(1.5)


class Undecided(Standing):
    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return Perception(math.nan)


class Mute(Standing):
    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Any:
        return None


class Wordy(Standing):
    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Any:
        return Perception(1.0, "forward")  # type: ignore[arg-type]


class Restless(Standing):
    """Has done all, and begins again."""

    def __init__(self) -> None:
        self._n_asked = 0

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        self._n_asked += 1
        return DONE if self._n_asked == 3 else DUE


class Jumping(Standing):
    """Moves the vehicle itself."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        motion.x_m += 1.0
        return Perception(1.0, 1.0)


class Forgetful(Standing):
    """Writes where only the radio may."""

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        picture.peers.positions_m.clear()
        return None


class Lost(Standing):
    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference((math.nan, 0.0), 1.0)


class Backwards(Standing):
    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference((0.0, 0.0), -1.0)


class Sketchy(Standing):
    def reference(self, motion: Motion, picture: Picture) -> Any:
        return (0.0, 0.0)


class Wavering(Standing):
    """Answers differently when it is asked again."""

    def __init__(self) -> None:
        self._n_asked = 0

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        self._n_asked += 1
        return Reference((float(self._n_asked), 0.0), 1.0)


class Hasty(Standing):
    """Says that it holds to the target, and goes slower on the way."""

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference((1000.0, 0.0), 2.0 if motion.x_m < 300.0 else 1.0, 1.0)


class Individual(Standing):
    """Answers by how many of its kind were made before."""

    _made = itertools.count()

    def __init__(self) -> None:
        self._number = next(self._made)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return Perception(1.0 / (1.0 + self._number))
