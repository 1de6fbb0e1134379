"""Judging: how good advice is on instances that it has not seen, beside what noise allows and what simpler rules reach.

Instances are held out in turn, in folds; the way of pooling is chosen anew on the others. What is best on an instance
is known only as far as its repeats tell: who takes the best of their means takes chance for merit. So there is a
ceiling: the strategy that is best in half of the repeats, judged by the other half as all others are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from missions.advising.advice import Adviser
from missions.advising.experience import Experience, Numbers
from missions.advising.model import MOST_BESIDE, WITHIN
from missions.advising.traits import CHOSEN_ON, GROUPS, TRAITS
from missions.errors import OutputError
from missions.statistics import generator, wilson_interval

Integers = npt.NDArray[np.int64]
FOLDS = 10
RESAMPLES = 4000


@dataclass(frozen=True)
class RuleScore:
    """A rule of choosing, judged on held-out instances.

    Attributes:
        name: of the rule; n: instances.
        within: share in which it takes at most 3 % longer than the best of the means over all repeats; within_95: its
            interval. None where the rule has seen these repeats.
        within_half: the same with the means over half of the repeats; mean of both halves.
        longer: how much longer than the best of these it takes, mean share; longer_95: its interval.
        saved: share of time that it saves beside the single best strategy; saved_95: its interval.
    """

    name: str
    n: int
    within: float | None
    within_95: tuple[float, float] | None
    within_half: float
    longer: float
    longer_95: tuple[float, float]
    saved: float
    saved_95: tuple[float, float]


@dataclass(frozen=True)
class AdviceScore:
    """How good advice is.

    Attributes:
        rules: the advice, what it stands beside, and what takes something away from it.
        n_learned: instances that there are, all but those held out to learn from.
        stated: probability to lie within 3 % that the advice states of itself, mean.
        covered: share of the intervals of all strategies but the advised one that hold what the runs showed.
        fresh: the same rules on instances that had no part in the choice of what decides, learned from the others.
        smooth: strategies that have a smooth part, in the mean of the folds.
    """

    rules: tuple[RuleScore, ...]
    n_learned: int
    stated: float
    covered: float
    fresh: tuple[RuleScore, ...]
    smooth: float


def advice_score(experience: Experience) -> AdviceScore:
    """Judge advice on the instances that have several repeats, held out in turn.

    Raises:
        OutputError: there are none.
    """
    names, several = experience.strategies, _several(experience)
    if not several:
        raise OutputError("no instance has two runs of each strategy, so that it cannot be said what is best there")
    advised, single, stated = [0] * len(several), [0] * len(several), [0.0] * len(several)
    inside: list[bool] = []
    smooth = []
    for held_out, rest in folds(experience):
        adviser, alike = Adviser(experience.of(rest)), Adviser(experience.of(rest), ())
        smooth.append(sum(pooling.width > 0.0 for pooling in adviser.model.poolings))
        for at in held_out:
            rows, times = adviser.rows(experience.instances[several[at]].traits), experience.log_times[several[at]]
            single[at] = alike.model.reference
            advised[at], stated[at] = names.index(rows[0].strategy), rows[0].p_within
            for row in rows[1:]:
                apart = float(times[names.index(row.strategy)] - times[advised[at]])
                inside.append(row.low <= math.expm1(max(-MOST_BESIDE, min(MOST_BESIDE, apart))) <= row.high)
    judge = _Judge(experience.of(several), np.array(single))
    every = np.tile(np.arange(len(names)), (len(several), 1))
    less = [(f"advice without {group}", blind(experience, group)) for group in GROUPS]
    less.append(("advice, instances shuffled", shuffled(experience)))
    return AdviceScore(
        (
            judge.rule("advice", np.array(advised)[:, None]),
            judge.rule(f"always {names[np.bincount(single).argmax()]}", np.array(single)[:, None]),
            judge.rule("at random", every),
            judge.repeated_best(),
            judge.weighed_best(),
            *(judge.rule(name, _advised(taught)[:, None]) for name, taught in less),
        ),
        len(experience.instances),
        float(np.mean(stated)),
        float(np.mean(inside)),
        _fresh(experience),
        float(np.mean(smooth)),
    )


def _fresh(experience: Experience) -> tuple[RuleScore, ...]:
    """Rules on instances that had no part in the choice of what decides; learned from the others alone."""
    early = [at for at, instance in enumerate(experience.instances) if instance.number < CHOSEN_ON]
    fresh = [at for at in _several(experience) if at not in early]
    if not (early and fresh):
        return ()
    model, of = Adviser(experience.of(early)).model, experience.of(fresh)
    single = np.full(len(fresh), model.reference)
    judge = _Judge(of, single)
    return (
        judge.rule("advice", model.predicted(of.traits).argmin(axis=1)[:, None]),
        judge.rule(f"always {experience.strategies[model.reference]}", single[:, None]),
        judge.rule("at random", np.tile(np.arange(len(experience.strategies)), (len(fresh), 1))),
        judge.repeated_best(),
        judge.weighed_best(),
    )


def folds(experience: Experience) -> Iterator[tuple[list[int], list[int]]]:
    """Of the instances with several repeats those that are held out, by place among them, and all that are left."""
    several = _several(experience)
    for fold in range(min(FOLDS, len(several))):
        out = set(several[fold::FOLDS])
        yield (
            list(range(fold, len(several), FOLDS)),
            [at for at in range(len(experience.instances)) if at not in out],
        )


def _several(experience: Experience) -> list[int]:
    """Instances with several repeats."""
    return [at for at, instance in enumerate(experience.instances) if len(instance.times_s[0]) > 1]


def blind(experience: Experience, group: str) -> Experience:
    """The same, but for a group of traits that are alike everywhere."""
    first = experience.instances[0].traits
    return replace(
        experience,
        instances=tuple(
            replace(
                instance,
                traits=tuple(
                    alike if trait.group == group else value
                    for trait, value, alike in zip(TRAITS, instance.traits, first, strict=True)
                ),
            )
            for instance in experience.instances
        ),
    )


def shuffled(experience: Experience) -> Experience:
    """The same, but each instance has the traits of another one, drawn."""
    order = generator().permutation(len(experience.instances))
    return replace(
        experience,
        instances=tuple(
            replace(instance, traits=experience.instances[other].traits)
            for instance, other in zip(experience.instances, order, strict=True)
        ),
    )


def _advised(taught: Experience) -> Integers:
    """What is advised for each instance by what was taught of those that are not held out with it."""
    several = _several(taught)
    found = np.zeros(len(several), dtype=np.int64)
    for held_out, rest in folds(taught):
        adviser = Adviser(taught.of(rest))
        for at in held_out:
            rows = adviser.rows(taught.instances[several[at]].traits)
            found[at] = taught.strategies.index(rows[0].strategy)
    return found


class _Judge:
    """Judges rules by the times of some instances.

    Args:
        experience: with the times.
        single: the strategy that is best in the mean of the instances that are not held out, for each instance.
    """

    def __init__(self, experience: Experience, single: Integers) -> None:
        self._log_times, self._halves = experience.log_times, _halves(experience)
        self._single = single[:, None]

    def rule(self, name: str, chosen: Integers) -> RuleScore:
        """A rule that chooses among some strategies on each instance, each as likely."""
        within = (_beyond(self._log_times, chosen) <= WITHIN).mean(axis=1)
        interval = wilson_interval(round(float(within.sum())), len(within))
        return self._score(name, float(within.mean()), interval, (chosen, chosen))

    def repeated_best(self) -> RuleScore:
        """What is best in half of the repeats, judged by the other half: no more can be seen of what is best."""
        best = [half.argmin(axis=1)[:, None] for half in self._halves]
        return self._score("best in the other repeats", None, None, (best[1], best[0]))

    def weighed_best(self) -> RuleScore:
        """The same, but what half of the repeats shows of a strategy is drawn to its mean as far as halves disagree.

        Differences to the single best count by the correlation of both halves over the instances. Nobody can know more
        of an instance without more runs of it.
        """
        beside = [np.clip(half - _of(half, self._single), -MOST_BESIDE, MOST_BESIDE) for half in self._halves]
        apart = [one - one.mean(axis=0) for one in beside]
        common, spread = (
            (apart[0] * apart[1]).sum(axis=0),
            np.sqrt((apart[0] ** 2).sum(axis=0) * (apart[1] ** 2).sum(axis=0)),
        )
        reliable = np.maximum(np.divide(common, spread, out=np.zeros_like(common), where=spread > 0.0), 0.0)
        middle = (beside[0].mean(axis=0) + beside[1].mean(axis=0)) / 2.0
        best = [(middle + reliable * (one - middle)).argmin(axis=1)[:, None] for one in beside]
        return self._score("the same, drawn to the mean", None, None, (best[1], best[0]))

    def _score(
        self,
        name: str,
        within: float | None,
        within_95: tuple[float, float] | None,
        chosen: tuple[Integers, Integers],
    ) -> RuleScore:
        """By both halves of the repeats.

        Args:
            chosen: on each instance, for the one half and the other.
        """
        judged = list(zip(self._halves, chosen, strict=True))
        beyond = [_beyond(half, one) for half, one in judged]
        near = np.mean([(one <= WITHIN).mean(axis=1) for one in beyond], axis=0)
        longer = np.mean([one.mean(axis=1) for one in beyond], axis=0)
        saved = np.mean([(_of(half, self._single) - _of(half, one)).mean(axis=1) for half, one in judged], axis=0)
        return RuleScore(
            name,
            len(longer),
            within,
            within_95,
            float(near.mean()),
            math.expm1(float(longer.mean())),
            _share_interval(longer, math.expm1),
            -math.expm1(-float(saved.mean())),
            _share_interval(saved, lambda mean: -math.expm1(-mean)),
        )


def _halves(experience: Experience) -> tuple[Numbers, Numbers]:
    """Mean logarithms of the times in the first half of the repeats, and in the second: instances x strategies."""
    found: tuple[list[Numbers], list[Numbers]] = [], []
    for instance in experience.instances:
        logs = np.log(np.array(instance.times_s))
        middle = logs.shape[1] // 2
        found[0].append(logs[:, :middle].mean(axis=1))
        found[1].append(logs[:, middle:].mean(axis=1))
    return np.array(found[0]), np.array(found[1])


def _of(log_times: Numbers, chosen: Integers) -> Numbers:
    """Those of some strategies on each instance: instances x choices."""
    found: Numbers = np.take_along_axis(log_times, chosen, axis=1)
    return found


def _beyond(log_times: Numbers, chosen: Integers) -> Numbers:
    """How far strategies are from the best of an instance: instances x choices."""
    found: Numbers = _of(log_times, chosen) - log_times.min(axis=1, keepdims=True)
    return found


def _share_interval(values: Numbers, share: Callable[[float], float]) -> tuple[float, float]:
    """95 % interval of what a mean over instances comes to, by a bootstrap of these."""
    draws = generator().integers(0, len(values), (RESAMPLES, len(values)))
    low, high = np.percentile(values[draws].mean(axis=1), [2.5, 97.5])
    return share(float(low)), share(float(high))
