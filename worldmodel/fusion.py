"""Fusion: one estimate of a property from the observations of several origins.

Only values with an uncertainty are fused; without any, the newest value stands. Observation errors are independent.

Numbers and points, per axis: Kalman filter (Kalman 1960) over the observations in order of time. The observed value is
at rest or a random walk of ``drift`` per square root of a second (``rm:drift``). The prior is flat; after the last
observation the variance grows by drift^2 per second. At rest the result is the inverse-variance mean (Cochran 1937)::

    estimate = sum(x / sigma^2) / sum(1 / sigma^2)        sigma of the estimate = sum(1 / sigma^2)^-1/2

The filter also estimates one error per origin of standard deviation ``shared``, such as that of its navigation.

Truth values, symbols, types and links: Bayes' theorem. A value with probability p is right with probability p; each of
the other n - 1 hypotheses is equally likely to have caused it::

    P(said v | true h) = p if h = v, else (1 - p) / (n - 1)     posterior(h) ~ prior(h) * product over observations

The hypotheses are both truth values or all symbols; of types and links, all observed ones plus one for the rest. The
prior is uniform unless given.

If origins may depend on each other (``independent=False``), only the most certain origin counts. For errors of one
variance this equals covariance intersection (Julier and Uhlmann 1997).

Doubt: origins whose numbers and points contradict those of the others. Each origin has one estimate with a variance per
property. If all are correct, the weighted squared deviations from the mean are chi-square (Cochran 1937)::

    Q = sum over slots, axes and origins of (estimate - mean)^2 / variance        n = sum of axes * (origins - 1)

If Q exceeds its 99 % quantile (Wilson and Hilferty 1931), the origin whose removal minimises Q is doubted; of only two
origins, both. Errors of one origin in two properties count as independent; a common part, such as a navigation error,
raises the false-alarm rate above 1 %.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, cast

from worldmodel.errors import FactError
from worldmodel.facts import Observation, sort_key
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import MEASURED, Attribute, ValueKind


class Estimate(NamedTuple):
    """Estimate of one attribute of one instance from several origins.

    Attributes:
        value: mean of numbers and points, off their grid; else the most probable value.
        uncertainty: sigma of numbers and points, in the attribute's unit; else the probability. None without any.
        time_s: of the newest observation that counts.
        probabilities: of each possible hypothesis, most probable first; empty for numbers and points.
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
    drift: float | None = None,
    shared: float = 0.0,
    at_s: float | None = None,
) -> Estimate | None:
    """Return the estimate from observations of one property, given in any order; FactError for an invalid argument.

    Args:
        prior: weight (0 or more) of each truth value or symbol, 0 if not listed; uniform if None.
        independent: False if origins may have adopted values of each other; only the most certain then counts.
        drift: random walk of numbers and points per square root of a second; None for that of the ontology.
        shared: standard deviation of the error of numbers and points common to one origin, in their unit.
        at_s: time of the estimate (s); the last observation if None or earlier.
    """
    drift = attribute.drift if drift is None else drift
    for name, amount in (("drift", drift), ("shared", shared)):
        if not (math.isfinite(amount) and amount >= 0.0):
            raise FactError(f"{attribute.name}: {name} is {amount}; allowed: 0 or more")
    if prior is not None:
        _refuse_bad_prior(attribute, prior)
    ordered = sorted(observations, key=sort_key)
    if not ordered:
        return None
    weighed = [observation for observation in ordered if observation.fact.uncertainty is not None]
    if not weighed:
        last = ordered[-1]
        return Estimate(last.value, None, last.time_s, (last.origin,))
    if attribute.kind in MEASURED:
        if independent:
            return _filtered(weighed, drift, shared, at_s)
        # At one time for all origins, since their variances grow by drift.
        at_s = max(weighed[-1].time_s, -math.inf if at_s is None else at_s)
        alone = [
            _filtered([o for o in weighed if o.origin == origin], drift, shared, at_s)
            for origin in sorted({o.origin for o in weighed})
        ]
        return min(alone, key=lambda estimate: cast(float, estimate.uncertainty))
    if not independent:
        newest = {observation.origin: observation for observation in weighed}
        # Of equal probabilities the lowest origin counts, so that all vehicles agree.
        weighed = [min(newest.values(), key=lambda o: (-cast(float, o.fact.uncertainty), o.origin))]
    return _by_bayes(attribute, weighed, prior)


def _filtered(weighed: Sequence[Observation], drift: float, shared: float, until_s: float | None) -> Estimate:
    origins = sorted({observation.origin for observation in weighed})
    # State of the Kalman filter: the value, then the shared error of each origin.
    n = 1 + len(origins) if shared > 0.0 else 1
    at_s = weighed[0].time_s
    means: list[list[float]] = []
    covariance: list[list[float]] = []
    for number, observation in enumerate(weighed):
        own = 1 + origins.index(observation.origin) if n > 1 else 0
        sigma = cast(float, observation.fact.uncertainty)
        axes = observation.value if isinstance(observation.value, tuple) else (cast(float, observation.value),)
        # Flat prior: the first observation is the state, off by its own error and by the shared one of its origin.
        if not number:
            means = [[axis, *[0.0] * (n - 1)] for axis in axes]
            covariance = [[shared * shared * (row == column) for column in range(n)] for row in range(n)]
            covariance[0][0] = sigma * sigma + shared * shared
            if own:
                covariance[0][own] = covariance[own][0] = -shared * shared
            continue
        covariance[0][0] += drift * drift * (observation.time_s - at_s)
        at_s = observation.time_s
        along = [row[0] + (row[own] if own else 0.0) for row in covariance]  # covariance with the observation
        gains = [part / (along[0] + (along[own] if own else 0.0) + sigma * sigma) for part in along]
        # Both axes have equal uncertainties, hence one covariance and equal gains.
        for mean, axis in zip(means, axes, strict=True):
            surprise = axis - mean[0] - (mean[own] if own else 0.0)
            mean[:] = [part + gain * surprise for part, gain in zip(mean, gains, strict=True)]
        covariance = [
            [part - gain * other for part, other in zip(row, along, strict=True)]
            for row, gain in zip(covariance, gains, strict=True)
        ]
    covariance[0][0] += drift * drift * max(0.0, (at_s if until_s is None else until_s) - at_s)
    value: Value = (means[0][0], means[1][0]) if len(means) == 2 else means[0][0]
    return Estimate(value, math.sqrt(max(0.0, covariance[0][0])), at_s, tuple(origins))


def _by_bayes(attribute: Attribute, weighed: Sequence[Observation], prior: Mapping[Value, float] | None) -> Estimate:
    hypotheses, n_others = _hypotheses(attribute, weighed)
    weights = [1.0 if prior is None else prior.get(hypothesis, 0.0) for hypothesis in hypotheses]
    n = sum(weight > 0.0 for weight in weights) + n_others
    # One further hypothesis, which no observation supports, stands for all values not observed.
    others = float(n_others)
    for observation in weighed:
        p = cast(float, observation.fact.uncertainty)
        else_p = (1.0 - p) / max(1, n - 1)
        weights = [w * (p if h == observation.value else else_p) for w, h in zip(weights, hypotheses, strict=True)]
        others *= else_p
    total = math.fsum((*weights, others))
    origins = tuple(sorted({observation.origin for observation in weighed}))
    if total == 0.0:  # the prior excludes all observed values
        return Estimate(weighed[-1].value, 0.0, weighed[-1].time_s, origins)
    # Of equal posteriors the smaller value comes first, in whatever order the facts arrived.
    ranked = sorted(
        ((h, w / total) for h, w in zip(hypotheses, weights, strict=True) if w > 0.0),
        key=lambda pair: (-pair[1], pair[0]),
    )
    value, probability = ranked[0]
    return Estimate(value, probability, weighed[-1].time_s, origins, tuple(ranked))


def _hypotheses(attribute: Attribute, weighed: Sequence[Observation]) -> tuple[list[Value], int]:
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


BEYOND_99 = 2.3263478740408408  # quantile of the normal distribution at 0.99


class _OriginEstimate(NamedTuple):
    axes: tuple[float, ...]
    variance: float


def doubted(slots: Iterable[tuple[Attribute, Sequence[Observation]]]) -> tuple[int, ...]:
    """Return the origin that contradicts the others; none if all agree, both if there are two."""
    estimates = [_estimates(observations, attribute) for attribute, observations in slots if attribute.kind in MEASURED]
    if not _is_beyond(*_deviation(estimates)):
        return ()
    origins = sorted({origin for slot in estimates for origin in slot})
    rest = {
        origin: _deviation([{by: it for by, it in slot.items() if by != origin} for slot in estimates])[0]
        for origin in origins
    }
    return tuple(origin for origin in origins if rest[origin] == min(rest.values()))


def _estimates(observations: Sequence[Observation], attribute: Attribute) -> dict[int, _OriginEstimate]:
    at_s = max((o.time_s for o in observations), default=0.0)
    estimates = {}
    for origin in sorted({o.origin for o in observations if o.fact.uncertainty is not None}):
        own = [o for o in observations if o.origin == origin]
        estimate = cast(Estimate, fused(attribute, own, at_s=at_s))
        value = estimate.value if isinstance(estimate.value, tuple) else (cast(float, estimate.value),)
        sigma = cast(float, estimate.uncertainty)
        estimates[origin] = _OriginEstimate(value, sigma * sigma)
    return estimates


def _deviation(slots: Iterable[dict[int, _OriginEstimate]]) -> tuple[float, int]:
    terms, degrees = [], 0
    for estimates in slots:
        if len(estimates) < 2:
            continue  # one estimate deviates by rounding alone, which would decide between equal origins
        for axis in zip(*(estimate.axes for estimate in estimates.values()), strict=True):
            weights = [1.0 / estimate.variance for estimate in estimates.values()]
            mean = math.fsum(w * x for w, x in zip(weights, axis, strict=True)) / math.fsum(weights)
            terms += [w * (x - mean) * (x - mean) for w, x in zip(weights, axis, strict=True)]
            degrees += len(axis) - 1
    return math.fsum(terms), degrees


def _is_beyond(deviation: float, degrees: int) -> bool:
    if not degrees:
        return False
    part = 2.0 / (9.0 * degrees)
    # Wilson and Hilferty: the cube root of chi-square over its degrees is almost normal; 23.24 for 10, exactly 23.21.
    root = 1.0 - part + BEYOND_99 * math.sqrt(part)
    return deviation > degrees * root * root * root
