"""Projection: the instances in the plane, for maps of where each strategy does well (Smith-Miles and Muñoz 2023).

The plane is that of the two principal components of the standardised traits that decide. The sign of a component is
chosen so that the trait that weighs most on it grows to the right, or up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.advising.advice import Adviser
from missions.advising.experience import Experience, Numbers
from missions.advising.model import WITHIN
from missions.advising.traits import DECIDING

N_NAMED = 3


@dataclass(frozen=True)
class Plane:
    """Instances in the plane.

    Attributes:
        places: instances x 2.
        shares: of the variance of all traits, that each component has.
        named: traits that weigh most on each component, with their sign, the heaviest first.
        within: where each strategy takes at most 3 % longer than the best of the means: instances x strategies.
    """

    places: Numbers
    shares: tuple[float, float]
    named: tuple[tuple[str, ...], tuple[str, ...]]
    within: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


def projected(experience: Experience) -> Plane:
    """The instances in the plane of the two principal components."""
    standard = Adviser(experience).model.standardised(experience.traits)
    _, lengths, axes = np.linalg.svd(standard, full_matrices=False)
    heaviest = np.abs(axes).argmax(axis=1)
    axes = axes * np.sign(axes[np.arange(len(axes)), heaviest])[:, None]
    named = [
        tuple(f"{'+' if axis[at] > 0.0 else '-'}{DECIDING[at].name}" for at in np.abs(axis).argsort()[::-1][:N_NAMED])
        for axis in axes[:2]
    ]
    shares = lengths**2 / (lengths**2).sum()
    log_times = experience.log_times
    return Plane(
        standard @ axes[:2].T,
        (float(shares[0]), float(shares[1])),
        (named[0], named[1]),
        log_times - log_times.min(axis=1, keepdims=True) <= WITHIN,
    )
