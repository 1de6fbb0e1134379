"""Fusion: one estimate of an attribute of what several origins observed. It is a view; nothing fused is stored or sent.

Of each origin the newest value counts alone: observations of one origin share its sensor and its errors, so that ten of
them are no better than one. The errors of two origins are taken as independent, unless the caller says otherwise. Only
values that carry an uncertainty are fused, since nobody can weigh the others; where none does, the newest stands as it
is.

Numbers and points, each axis alike, by inverse variance (Cochran 1937; the greatest likelihood of normal errors)::

    estimate = sum(x / sigma^2) / sum(1 / sigma^2)        sigma of the estimate = sum(1 / sigma^2)^-1/2

Truth values, symbols, types and links by Bayes' theorem. A value with probability p says: my value is right with
probability p, and each of the other n - 1 hypotheses is as likely as any other to have looked like it::

    P(said v | true h) = p if h = v, else (1 - p) / (n - 1)        posterior(h) ~ prior(h) * product over origins

The hypotheses are both truth values, or all symbols. Of types and links they are those that anybody named, and one more
that stands for all others. The prior is even, unless the caller gives another.

Where origins may have heard of each other (``independent=False``), the most certain origin counts alone. This is what
covariance intersection comes to where errors have one variance: it weighs two estimates so that the variance is least
whatever their correlation, and the least is that of the better one (Julier and Uhlmann 1997).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, cast

from worldmodel.errors import FactError
from worldmodel.facts import Observation
from worldmodel.fields import Value
from worldmodel.tbox import MEASURED, Attribute, ValueKind


class Estimate(NamedTuple):
    """What several origins say of one attribute of one instance, together.

    Attributes:
        value: mean of numbers and points, off their grid; else the most probable value.
        uncertainty: sigma of numbers and points, in the unit of the attribute; else the probability of the value. None
            where no value carries one.
        time_s: when the newest of the observations was made.
        origins: whose observations count.
        probabilities: of every hypothesis that is not ruled out, the most probable first; empty for numbers and points.
    """

    value: Value
    uncertainty: float | None
    time_s: float
    origins: tuple[int, ...]
    probabilities: tuple[tuple[Value, float], ...] = ()


def fused(
    attribute: Attribute,
    observations: Iterable[Observation],
    prior: Mapping[Value, float] | None = None,
    independent: bool = True,
) -> Estimate | None:
    """Return the estimate that observations of one slot come to, in whatever order they are given.

    Args:
        attribute: of the slot.
        observations: of the slot, such as ``WorldModel.history`` gives them, without banned ones.
        prior: weight of each hypothesis of a truth value or symbol before anything was observed, 0 or more; what is not
            listed has weight 0. Even if None.
        independent: False where origins may have taken over what others said; the most certain then counts alone.

    Raises:
        FactError: a prior for another kind of attribute, or one without a positive finite sum.
    """
    newest: dict[int, Observation] = {}
    for observation in observations:
        before = newest.get(observation.origin)
        if before is None or _key(before) < _key(observation):
            newest[observation.origin] = observation
    if prior is not None:
        _refuse_bad_prior(attribute, prior)
    if not newest:
        return None
    weighed = [newest[origin] for origin in sorted(newest) if newest[origin].fact.uncertainty is not None]
    if not weighed:
        last = max(newest.values(), key=_key)
        return Estimate(last.value, None, last.time_s, (last.origin,))
    if attribute.kind in MEASURED:
        if not independent:
            weighed = [min(weighed, key=lambda observation: (observation.fact.uncertainty, observation.origin))]
        return _by_inverse_variance(weighed)
    if not independent:
        weighed = [
            min(weighed, key=lambda observation: (-cast(float, observation.fact.uncertainty), observation.origin))
        ]
    return _by_bayes(attribute, weighed, prior)


def _key(observation: Observation) -> tuple[object, ...]:
    return (*observation.block.key, observation.position)


def _by_inverse_variance(weighed: Sequence[Observation]) -> Estimate:
    sigmas = [cast(float, observation.fact.uncertainty) for observation in weighed]
    weights = [1.0 / (sigma * sigma) for sigma in sigmas]
    total = math.fsum(weights)

    def mean(numbers: Iterable[float]) -> float:
        return math.fsum(weight * number for weight, number in zip(weights, numbers, strict=True)) / total

    values = [observation.value for observation in weighed]
    if isinstance(values[0], tuple):
        points = cast(list[tuple[float, float]], values)
        value: Value = (mean(east for east, _ in points), mean(north for _, north in points))
    else:
        value = mean(cast(list[float], values))
    return Estimate(
        value, math.sqrt(1.0 / total), _time_s(weighed), tuple(observation.origin for observation in weighed)
    )


def _by_bayes(attribute: Attribute, weighed: Sequence[Observation], prior: Mapping[Value, float] | None) -> Estimate:
    hypotheses, n_others = _hypotheses(attribute, weighed)
    weights = [1.0 if prior is None else prior.get(hypothesis, 0.0) for hypothesis in hypotheses]
    n = sum(weight > 0.0 for weight in weights) + n_others
    others = float(n_others)
    for observation in weighed:
        p = cast(float, observation.fact.uncertainty)
        else_p = (1.0 - p) / max(1, n - 1)
        weights = [w * (p if h == observation.value else else_p) for w, h in zip(weights, hypotheses, strict=True)]
        others *= else_p
    total = math.fsum((*weights, others))
    origins = tuple(observation.origin for observation in weighed)
    if total == 0.0:  # all that was said is ruled out by the prior
        last = max(weighed, key=_key)
        return Estimate(last.value, 0.0, last.time_s, origins)
    ranked = sorted(
        ((h, w / total) for h, w in zip(hypotheses, weights, strict=True) if w > 0.0),
        key=lambda pair: (-pair[1], pair[0]),
    )
    value, probability = ranked[0]
    return Estimate(value, probability, _time_s(weighed), origins, tuple(ranked))


def _hypotheses(attribute: Attribute, weighed: Sequence[Observation]) -> tuple[list[Value], int]:
    """What may be the case, in order, and 1 if anything else may be too."""
    if attribute.kind is ValueKind.BOOLEAN:
        return [False, True], 0
    if attribute.kind is ValueKind.SYMBOL:
        return list(range(len(attribute.symbols))), 0
    return sorted({cast(int, observation.value) for observation in weighed}), 1


def _refuse_bad_prior(attribute: Attribute, prior: Mapping[Value, float]) -> None:
    if attribute.kind not in (ValueKind.BOOLEAN, ValueKind.SYMBOL):
        raise FactError(f"{attribute.name}: a prior of a {attribute.kind.value}; allowed: of truth values and symbols")
    values = list(prior.values())
    if not all(math.isfinite(weight) and weight >= 0.0 for weight in values) or not math.fsum(values) > 0.0:
        raise FactError(f"{attribute.name}: prior {dict(prior)}; allowed: weights of 0 or more, one of them above 0")


def _time_s(weighed: Sequence[Observation]) -> float:
    return max(observation.time_s for observation in weighed)
