"""Doubt: which origin says of numbers and points what does not agree with what all others say.

What each origin says of a slot comes to one estimate, with a variance. Where all are right, the squared deviations from
their mean by inverse variance, in units of these variances, add up to a chi-square variable (Cochran 1937)::

    Q = sum over slots, axes and origins of (estimate - mean)^2 / variance        n = sum of axes * (origins - 1)

If Q is beyond what happens in one of a hundred cases, somebody errs otherwise than he says: the one without whom Q is
least. Of two nobody can tell, so both are named. The limit is that of Wilson and Hilferty (1931),
n (1 - 2 / (9 n) + 2.3263 (2 / (9 n))^1/2)^3, for 10 degrees 23.24 (tables: 23.21).

The errors of one origin in two slots are taken for independent. Where they have a part in common, such as that of its
navigation in one dive, more than one of a hundred is doubted in vain.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple, cast

from worldmodel.facts import Observation
from worldmodel.fusion import Estimate, fused
from worldmodel.ontology.tbox import MEASURED, Attribute

BEYOND_99 = 2.3263478740408408
"""The quantile of the normal distribution at 0.99."""


class _Said(NamedTuple):
    """What an origin says of a slot, all in all."""

    axes: tuple[float, ...]
    variance: float


def doubted(slots: Iterable[tuple[Attribute, Sequence[Observation]]]) -> tuple[int, ...]:
    """The origin that contradicts the others; none if all agree, two if it is one of two.

    Args:
        slots: attribute and observations of each; only numbers and points with an uncertainty count.
    """
    said = [_said(observations, attribute) for attribute, observations in slots if attribute.kind in MEASURED]
    if not _is_beyond(*_deviation(said)):
        return ()
    origins = sorted({origin for one in said for origin in one})
    rest = {
        origin: _deviation([{by: it for by, it in one.items() if by != origin} for one in said])[0]
        for origin in origins
    }
    return tuple(origin for origin in origins if rest[origin] == min(rest.values()))


def _said(observations: Sequence[Observation], attribute: Attribute) -> dict[int, _Said]:
    """By origin, at the time of the newest observation."""
    at_s = max((one.time_s for one in observations), default=0.0)
    found = {}
    for origin in sorted({one.origin for one in observations if one.fact.uncertainty is not None}):
        own = [one for one in observations if one.origin == origin]
        estimate = cast(Estimate, fused(attribute, own, at_s=at_s))
        value = estimate.value if isinstance(estimate.value, tuple) else (cast(float, estimate.value),)
        sigma = cast(float, estimate.uncertainty)
        found[origin] = _Said(value, sigma * sigma)
    return found


def _deviation(slots: Iterable[dict[int, _Said]]) -> tuple[float, int]:
    """Q, and its degrees of freedom."""
    terms, degrees = [], 0
    for said in slots:
        for axis in zip(*(one.axes for one in said.values()), strict=True):
            weights = [1.0 / one.variance for one in said.values()]
            mean = math.fsum(w * x for w, x in zip(weights, axis, strict=True)) / math.fsum(weights)
            terms += [w * (x - mean) * (x - mean) for w, x in zip(weights, axis, strict=True)]
            degrees += len(axis) - 1
    return math.fsum(terms), degrees


def _is_beyond(deviation: float, degrees: int) -> bool:
    if not degrees:
        return False
    part = 2.0 / (9.0 * degrees)
    root = 1.0 - part + BEYOND_99 * math.sqrt(part)
    return deviation > degrees * root * root * root
