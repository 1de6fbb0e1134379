"""Model: how much longer each strategy takes than the one that is best in the mean, of the traits of a scenario.

One run tells little, since losses, faults and speeds are drawn: what an instance shows of a strategy is pooled with
what the others show. That is kernel ridge regression (Saunders, Gammerman, Vovk 1998): the mean of all instances, and
a smooth part by a Gaussian of the distance between standardised traits, held down by a penalty. Each strategy has the
width and the penalty by which instances that are left out are explained best, and no smooth part if the mean alone
explains them better; where no strategy has one, the single best is advised everywhere. A difference counts by its
logarithm, and by a factor of 1.5 at most: missions that never end would outweigh all others.

Strategies are treated alike: they can be renamed and reordered. What is left unexplained where an instance is left out,
all strategies together, is what a prediction may be off by. Of that near instances tell most, since where vehicles are
lost much more is chance than where nothing happens.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from missions.advising.experience import Numbers

WITHIN = math.log(1.03)
"""A strategy is as good as the best if it takes at most 3 % longer."""
MOST_BESIDE = math.log(1.5)
"""A strategy that takes longer than this beside the reference counts as if it took this."""
NEAR = 0.6
"""Width of the Gaussian by which what is left unexplained counts."""


@dataclass(frozen=True)
class Pooling:
    """How much instances tell of each other.

    Attributes:
        width: of the Gaussian, in root mean square of the standardised differences; 0 where all count alike.
        penalty: of the smooth part, in variances of it.
    """

    width: float = 0.0
    penalty: float = 1.0


ALIKE = Pooling()
CHOICES = tuple(Pooling(width, penalty) for width in (0.7, 1.0, 1.5, 2.5) for penalty in (0.1, 0.3, 1.0, 3.0))


@dataclass(frozen=True)
class Model:
    """What was learned of some instances.

    Attributes:
        traits: as they are compared: instances x traits.
        log_times: instances x strategies.
        choices: of pooling, beside counting all alike.
    """

    traits: Numbers
    log_times: Numbers
    choices: Sequence[Pooling] = CHOICES

    @cached_property
    def reference(self) -> int:
        """The strategy that is best in the mean."""
        beyond = np.minimum(self.log_times - self.log_times.min(axis=1, keepdims=True), MOST_BESIDE)
        return int(beyond.mean(axis=0).argmin())

    @cached_property
    def _beside(self) -> Numbers:
        """Logarithms of the times beside those of the reference: instances x strategies."""
        apart = self.log_times - self.log_times[:, self.reference, None]
        return np.clip(apart, -MOST_BESIDE, MOST_BESIDE)

    @cached_property
    def poolings(self) -> tuple[Pooling, ...]:
        """That of each strategy."""
        known = (ALIKE, *self.choices)
        errors = np.array([(self._left_out(pooling) ** 2).sum(axis=0) for pooling in known])
        return tuple(known[at] for at in errors.argmin(axis=0))

    @cached_property
    def unexplained(self) -> Numbers:
        """What the prediction of each instance from the others lacks: instances x strategies."""
        return self._of_each({pooling: self._left_out(pooling) for pooling in self.poolings})

    def predicted(self, traits: Numbers) -> Numbers:
        """Logarithms of the times beside those of the reference: scenarios x strategies."""
        return self._of_each({pooling: self.weights(traits, pooling) @ self._beside for pooling in self.poolings})

    def _of_each(self, found: dict[Pooling, Numbers]) -> Numbers:
        """Of what was found by each pooling the column of each strategy that has it."""
        return np.stack([found[pooling][:, at] for at, pooling in enumerate(self.poolings)], axis=1)

    def _left_out(self, pooling: Pooling) -> Numbers:
        """What the prediction of each instance from the others lacks: of what is linear it follows from one fit."""
        weights = self.weights(self.traits, pooling)
        found: Numbers = (self._beside - weights @ self._beside) / (1.0 - np.diag(weights)[:, None])
        return found

    def weights(self, traits: Numbers, pooling: Pooling) -> Numbers:
        """How much each instance counts in the times of a scenario: scenarios x instances, each row 1 together."""
        n = len(self.traits)
        if not pooling.width:
            return np.full((len(np.atleast_2d(traits)), n), 1.0 / n)
        middle = self._nearness(self.traits, pooling.width).mean(axis=0)
        if pooling not in self._inverses:
            own = _centred(self._nearness(self.traits, pooling.width), middle)
            inverse: Numbers = np.linalg.inv(own + pooling.penalty * np.eye(n)).astype(np.float64)
            self._inverses[pooling] = inverse
        found: Numbers = 1.0 / n + _centred(self._nearness(traits, pooling.width), middle) @ self._inverses[pooling]
        return found

    @cached_property
    def _inverses(self) -> dict[Pooling, Numbers]:
        """Inverses of the penalised nearness of the instances, as far as they were asked for."""
        return {}

    def _nearness(self, traits: Numbers, width: float) -> Numbers:
        """The Gaussian of the distance from each instance: scenarios x instances."""
        found: Numbers = np.exp(-((self.distances(traits) / width) ** 2) / 2.0)
        return found

    @cached_property
    def _scale(self) -> tuple[Numbers, Numbers]:
        differs = np.ptp(self.traits, axis=0) > 0.0  # the deviation of equal numbers may be rounded to more than 0
        return self.traits.mean(axis=0), np.where(differs, self.traits.std(axis=0), np.inf)

    @cached_property
    def _standard(self) -> Numbers:
        return self.standardised(self.traits)

    def standardised(self, traits: Numbers) -> Numbers:
        """Traits less the mean of the instances, over their deviation; 0 where all instances are alike."""
        middle, spread = self._scale
        found: Numbers = (np.atleast_2d(traits) - middle) / spread
        return found

    def distances(self, traits: Numbers) -> Numbers:
        """Root mean square of the standardised differences from each instance: scenarios x instances."""
        apart = self.standardised(traits)[:, None, :] - self._standard[None, :, :]
        n_told = max(1, int(np.isfinite(self._scale[1]).sum()))
        found: Numbers = np.sqrt((apart**2).sum(axis=2) / n_told)
        return found

    def off_by(self, traits: Numbers) -> Numbers:
        """How much each instance counts for what a prediction may be off by: scenarios x instances."""
        apart = self.distances(traits)
        apart = apart - apart.min(axis=1, keepdims=True)
        near: Numbers = np.exp(-((apart / NEAR) ** 2) / 2.0)
        found: Numbers = near / near.sum(axis=1, keepdims=True)
        return found


def _centred(nearness: Numbers, middle: Numbers) -> Numbers:
    """Nearness to each instance, less what the mean of all instances explains: rows sum to 0."""
    found: Numbers = nearness - nearness.mean(axis=1, keepdims=True) - middle + middle.mean()
    return found
