"""Crossing: level of an axis, such as the loss rate, at which one treatment overtakes another.

**Estimate.** Each repeat has a paired difference at each level. Their mean is linear between the levels of the study;
it is fitted by least squares to all pairs, those of refined levels included. A crossing is a change of its sign.

**Interval.** The set of levels at which a sign-flip test at 5 % does not reject a mean difference of zero. Test
inversion (Fieller 1954) needs no distribution of the crossing, whose resampled values have none where the difference is
flat. The flips apply to the sums of each repeat, with residuals from the fit under the null hypothesis (Hemerik,
Goeman, Finos 2020). If all repeats have all levels, this is the paired sign-flip test of the interpolated differences.

**Probability of a crossing**: share of Bayesian bootstrap resamples of the repeats (Rubin 1981) with a change of sign.

**Refinement.** Batches of pairs with new seeds, each at the level where 1.96 standard errors exceed the distance of the
mean difference from zero most: near the crossing and least known (Bryan et al. 2005).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from missions.comparison.baseline import Side, side_of
from missions.comparison.ranking import differences_of, rankable
from missions.comparison.treatments import (
    MISSION_TIME,
    SIGNIFICANT,
    Measured,
    Outcomes,
    Treatment,
    measured,
    settings_alike,
    treatment_of,
    treatments_of,
)
from missions.disk import STUDY
from missions.document import Document
from missions.errors import OutputError, StudyChangedError, check_name
from missions.files import dotted
from missions.metric import Metric
from missions.statistics import FEW, RESAMPLES, Array, Interval, NoInterval, generator, sign_flips, step_down_p
from missions.sweeps.driver import ReportProgress, sweep
from missions.sweeps.folder import CODE_CHANGED, STUDY_TEXT, SweepResults, code_of
from missions.sweeps.plan import ConfigurationLabel, seed_of
from missions.sweeps.study import load_study, study_of
from missions.sweeps.study_file import FAULT, KEY_OF_PER, PER

STEPS, COARSE = 50, 5  # grid points between two levels of the study; every fifth can be refined
STRADDLE = 1.96
REFINED = "refined"  # folder of the batches, in that of the study
SEEDS = 1_000_000  # first number of batches as repeats, behind those of studies, so that their seeds are new


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """Crossings of two treatments under one condition, with lowest and highest level of the axis.

    Args:
        at: estimated crossings in ascending order; more than one is not unique.
        leaders: treatments ahead below, between and above the crossings; empty if all differences are zero.
        unsure: those nowhere significantly ahead.
        ci95: 95 % confidence set as intervals; it may exist without an estimate. Empty if ``note`` gives the reason.
        open_low, open_high: the set may extend beyond the axis.
        probability: of at least one crossing; near 1 also for differences about zero, then see ``unsure``. None
            without confidence set.
        n_least, n_most: fewest and most pairs at a level.
    """

    condition: dict[str, str]
    metric: str
    axis: str
    low: float
    high: float
    at: tuple[float, ...] = ()
    leaders: tuple[str, ...] = ()
    unsure: tuple[str, ...] = ()
    ci95: tuple[Interval, ...] = ()
    open_low: bool = False
    open_high: bool = False
    probability: float | None = None
    n_least: int
    n_most: int
    note: str = ""


@dataclass(frozen=True)
class Pairs:
    """Paired differences, one entry per pair: level, difference, repeat. ``knots`` are the levels of the study."""

    knots: Array
    levels: Array
    differences: Array
    repeats: Array

    @property
    def counts(self) -> list[int]:
        """Numbers of pairs at the knots."""
        return [int(np.sum(self.levels == knot)) for knot in self.knots]

    @cached_property
    def grid(self) -> Array:
        """Levels at which the difference is tested, shape (1 + STEPS * (knots - 1),)."""
        parts = [np.linspace(low, high, STEPS, endpoint=False) for low, high in itertools.pairwise(self.knots)]
        return np.concatenate([*parts, self.knots[-1:]])

    def _hats(self, levels: Array) -> Array:
        return np.array([np.interp(levels, self.knots, row) for row in np.eye(len(self.knots))]).T

    @cached_property
    def mean(self) -> Array:
        """Mean difference at each level of the grid."""
        fitted = np.linalg.lstsq(self._hats(self.levels), self.differences, rcond=None)[0]
        return np.asarray(np.interp(self.grid, self.knots, fitted))

    @cached_property
    def _sums(self) -> Array:
        """Contributions of each repeat (row) to the mean at each level of the grid, centred under the null."""
        hats, at = self._hats(self.levels), self._hats(self.grid)
        inverse = np.linalg.inv(hats.T @ hats)
        directions = at @ inverse
        fitted = inverse @ (hats.T @ self.differences)
        null = fitted[:, None] - directions.T * (self.mean / (directions * at).sum(axis=1))
        parts = hats @ directions.T * (self.differences[:, None] - hats @ null)
        return np.asarray((np.unique(self.repeats)[:, None] == self.repeats).astype(float) @ parts)

    @cached_property
    def p(self) -> Array:
        """p value of a zero mean difference at each level of the grid."""
        flipped = np.abs(sign_flips(len(self._sums)) @ self._sums)
        return np.asarray((flipped >= np.abs(self._sums.sum(axis=0)) * (1.0 - 1e-9)).mean(axis=0))

    @cached_property
    def crossings(self) -> list[tuple[int, float]]:
        """Step of the grid and level of each change of sign, in ascending order."""
        signs = np.sign(self.mean)
        known = np.flatnonzero(signs)
        found = []
        for first, other in itertools.pairwise(known):
            if signs[first] != signs[other]:
                (low, high), (x0, x1) = self.mean[[other - 1, other]], self.grid[[other - 1, other]]
                found.append((int(other) - 1, float(x0 + (x1 - x0) * low / (low - high))))
        return found

    @property
    def confidence_set(self) -> list[Interval]:
        """Intervals of the levels at which a zero difference is not rejected, to one step of the grid."""
        kept = self.p >= SIGNIFICANT
        steps = kept[:-1] | kept[1:]
        steps[[step for step, _ in self.crossings]] = True
        edges = np.flatnonzero(np.diff([False, *steps, False])).reshape(-1, 2)
        return [(float(self.grid[first]), float(self.grid[last])) for first, last in edges]

    @property
    def probability(self) -> float:
        """Probability that the mean difference changes its sign."""
        hats, repeats = self._hats(self.levels), np.unique(self.repeats)
        weights = generator().exponential(size=(RESAMPLES, len(repeats)))
        own = [self.repeats == repeat for repeat in repeats]
        grams = np.array([hats[rows].T @ hats[rows] for rows in own])
        sums = np.array([hats[rows].T @ self.differences[rows] for rows in own])
        fitted = np.linalg.solve(np.einsum("bn,nij->bij", weights, grams), (weights @ sums)[..., None])[..., 0]
        return float(np.mean((fitted.min(axis=1) < 0.0) & (fitted.max(axis=1) > 0.0)))

    @property
    def significant(self) -> tuple[bool, bool]:
        """Whether the first and the second treatment are significantly ahead at a level of the study (step-down)."""
        own = np.unique(self.repeats[self.repeats < SEEDS])
        table = np.zeros((len(own), len(self.knots)))
        for number, knot in enumerate(self.knots):
            rows = (self.levels == knot) & (self.repeats < SEEDS)
            table[np.searchsorted(own, self.repeats[rows]), number] = self.differences[rows]
        leads = table.sum(axis=0)[np.array(step_down_p(table)) < SIGNIFICANT]
        return bool(np.any(leads < 0.0)), bool(np.any(leads > 0.0))

    def next_level(self, whole: bool = False) -> float:
        """Return the most informative level, rounded if ``whole``; OutputError if no level may be the crossing."""
        if min(self.counts) >= FEW and not self.confidence_set:
            raise OutputError(f"--refine: no crossing in {self.knots[0]:g} to {self.knots[-1]:g}, nothing to refine")
        gain = STRADDLE * np.sqrt((self._sums**2).sum(axis=0)) - np.abs(self.mean)
        level = self.grid[::COARSE][np.argmax(gain[::COARSE])]
        return float(np.round(level)) if whole else float(f"{level:.6g}")


Sides = tuple[Measured, Measured]


@dataclass(frozen=True)
class Contest:
    """Two treatments along an axis under one condition: results by level; levels and results of ``refined`` batches."""

    condition: dict[str, str]
    by_level: Mapping[float, Sides]
    refined: Sequence[tuple[float, Sides]]
    treatments: Mapping[float, tuple[Treatment, Treatment]]

    def pairs(self, sign: float) -> Pairs:
        """Return the paired differences; positive ones favour the second treatment for ``sign`` 1 (lower is better)."""
        rows: list[tuple[float, float, int]] = []
        # Batches have other seeds than the study, hence other repeats.
        for number, results in enumerate([[*self.by_level.items()], *([batch] for batch in self.refined)]):
            # A metric may have no value at some levels.
            source = [(level, sides) for level, sides in results if all(own.values for own in sides)]
            drawn = {repeat for _, sides in source for own in sides if not own.constant for repeat in own.values}
            for level, sides in source:
                first, other = (own.over(drawn or {0}).values for own in sides)
                shared = sorted(first.keys() & other.keys())
                sides_of = (np.array([own[repeat] for repeat in shared]) for own in (first, other))
                for value, repeat in zip(differences_of(*sides_of), shared, strict=True):
                    rows.append((level, sign * value, number * SEEDS + repeat))
        levels, values, repeats = np.array(rows, dtype=float).reshape(-1, 3).T
        return Pairs(np.array(sorted(self.by_level.keys() & {*levels})), levels, values, repeats)


def crossings(
    results: SweepResults,
    names: str,
    metric: str = MISSION_TIME,
    axis: str = PER,
    where: Sequence[str] = (),
) -> list[Crossing]:
    """Estimate where two treatments of a sweep cross, one row per condition; refined levels count too.

    Args:
        names: ``A,B``, two strategies, policies or levels ``KEY=VALUE,KEY=VALUE`` (the second key may be omitted).
        metric: summary field or custom metric with a preferred direction.
        axis: ``per``, the mean loss rate, or a varied key with numbers.
        where: ``KEY=VALUE`` of the conditions to keep.

    Raises OutputError for unknown names, no pairs, or an axis with a single level.
    """
    (a, b), declared, found = _contests(results, names, metric, axis, where)
    return [_row(contest, contest.pairs(declared.sign), (a.level, b.level), declared, axis) for contest in found]


def _row(contest: Contest, pairs: Pairs, names: tuple[str, str], metric: Metric, axis: str) -> Crossing:
    counts = pairs.counts
    row = Crossing(
        condition=contest.condition,
        metric=metric.name,
        axis=axis,
        low=float(pairs.knots[0]),
        high=float(pairs.knots[-1]),
        n_least=min(counts),
        n_most=int(max(np.sum(pairs.levels == level) for level in np.unique(pairs.levels))),
    )
    if len(counts) < 2:
        return replace(row, note="one level")
    if not np.any(pairs.mean):
        return replace(row, note=NoInterval.ALIKE.value)
    signs = [*pairs.mean[np.flatnonzero(pairs.mean)][:1], *(pairs.mean[step + 1] for step, _ in pairs.crossings)]
    row = replace(
        row,
        at=tuple(level for _, level in pairs.crossings),
        leaders=tuple(names[int(sign > 0.0)] for sign in signs),
    )
    if all(own.constant for sides in contest.by_level.values() for own in sides):
        return replace(row, note=NoInterval.DETERMINISTIC.value)
    if min(counts) < FEW:
        return replace(row, unsure=row.leaders, note=NoInterval.TOO_FEW.value)
    return replace(
        row,
        unsure=tuple(name for name, sure in zip(names, pairs.significant, strict=True) if not sure),
        ci95=tuple(pairs.confidence_set),
        open_low=bool(pairs.p[0] >= SIGNIFICANT),
        open_high=bool(pairs.p[-1] >= SIGNIFICANT),
        probability=pairs.probability,
    )


def _contests(
    results: SweepResults, names: str, metric: str, axis: str, where: Sequence[str]
) -> tuple[tuple[Side, Side], Metric, list[Contest]]:
    results, (metric,) = results.naming([metric])
    declared = rankable(metric, results.metrics)
    axis = PER if axis == KEY_OF_PER else axis
    treatments = treatments_of(results)
    first, _, other = names.partition(",")
    if not (first and other) or "," in other or first == other:
        raise OutputError(f"--crossing {names}: allowed: A,B, two treatments of the study that differ")
    if "=" in first and "=" not in other:
        other = f"{first.partition('=')[0]}={other}"
    a, b = (side_of(results, treatments, name, "--crossing") for name in (first, other))
    if (a.kind, a.key) != (b.kind, b.key):
        raise OutputError(f"--crossing {names}: allowed: two strategies, two policies, or two levels of one key")
    axes = dict.fromkeys(key for treatment in treatments for key, _ in treatment.settings if key != a.key)
    check_name("--axis", axis, [*([PER] if a.key != PER else []), *axes])
    forms = {treatment: [f"{key}={value}" for key, value in _columns(treatment).items()] for treatment in treatments}
    for text in where:
        check_name("--where", text, list(dict.fromkeys(itertools.chain(*forms.values()))))
    found: dict[Treatment, dict[float, tuple[Treatment, Treatment]]] = {}
    for treatment in treatments:
        partner = b.of(treatment)
        if a.of(treatment) == treatment and partner in treatments and {*where} <= {*forms[treatment]}:
            condition, level = _split(treatment, axis)
            found.setdefault(condition, {})[level] = treatment, partner
    extra: dict[Treatment, list[tuple[float, Sides]]] = {}
    for refined in _refined(results):
        runs = treatments_of(refined) if refined.lines else {}
        for treatment in runs:
            if a.of(treatment) == treatment and b.of(treatment) in runs:
                condition, level = _split(treatment, axis)
                extra.setdefault(condition, []).append((level, _measured(runs, (treatment, b.of(treatment)), declared)))
    contests = [
        Contest(_columns(condition), sides, extra.get(condition, []), by_level)
        for condition, by_level in found.items()
        if (sides := {level: _measured(treatments, pair, declared) for level, pair in by_level.items()})
    ]
    contests = [contest for contest in contests if len(contest.pairs(1.0).knots)]
    status = results.status()
    if not contests:
        counted = f"{len(results.lines)} of {status.planned} runs have finished"
        raise OutputError(f"--crossing {names}: no pairs of finished runs; {counted}")
    if all(len(contest.by_level) == 1 for contest in contests):
        level = next(iter(contests[0].by_level))
        raise OutputError(f"--axis {axis}: one level, {level:g}; a crossing needs at least two")
    # Conditions are shown by the columns in which they differ.
    alike = set.intersection(*(set(contest.condition.items()) for contest in contests))
    hidden = {key for key, _ in alike} | {axis, a.key or a.kind}
    shown = [
        replace(one, condition={key: value for key, value in one.condition.items() if key not in hidden})
        for one in contests
    ]
    return (a, b), declared, shown


def _measured(runs: Mapping[Treatment, Outcomes], pair: tuple[Treatment, Treatment], metric: Metric) -> Sides:
    return measured(runs[pair[0]], metric), measured(runs[pair[1]], metric)


def _columns(treatment: Treatment) -> dict[str, str]:
    own = {"scenario": treatment.scenario, "strategy": treatment.strategy, "policy": treatment.policy}
    own |= {"channel": treatment.channel, **dict(treatment.settings)}
    own |= {} if treatment.rate is None else {PER: f"{treatment.per:g}"}
    return own | ({"unforeseen": treatment.unforeseen} if treatment.unforeseen else {})


def _split(treatment: Treatment, axis: str) -> tuple[Treatment, float]:
    """Return the condition of a treatment, without the axis, and its level there."""
    if axis == PER:
        return replace(treatment, rate=None), treatment.per
    settings = dict(treatment.settings)
    text = settings.pop(axis, "")
    try:
        level = float(text)
    except ValueError:
        raise OutputError(f"--axis {axis}: its level {text!r} is no number") from None
    return replace(treatment, settings=tuple(settings.items())), level


def _refined(results: SweepResults) -> Iterator[SweepResults]:
    for path in sorted((results.folder / REFINED).glob(f"*/{STUDY}")):
        yield replace(SweepResults.read(path.parent), measured=results.measured)


def refine(
    results: SweepResults,
    n: int,
    names: str,
    metric: str = MISSION_TIME,
    axis: str = PER,
    where: Sequence[str] = (),
    jobs: int = 1,
    progress: ReportProgress | None = None,
) -> None:
    """Make ``n`` further pairs at the most informative levels, in batches below ``refined`` in the sweep's folder.

    An unfinished batch of an earlier call is finished first and counts. Raises OutputError for several conditions or
    nothing to refine, StudyChangedError for other code; else as ``crossings`` and ``sweep``.
    """
    for refined in list(_refined(results)):
        if refined.status().remaining:
            sweep(load_study(str(refined.folder / STUDY_TEXT)), refined.folder, jobs, progress=progress)
            n -= refined.file.study.repeats
    while n > 0:
        _, declared, found = _contests(results, names, metric, axis, where)
        if len(found) > 1:
            example = " ".join(f"--where {key}={value}" for key, value in found[0].condition.items())
            raise OutputError(f"--refine {n}: the study has {len(found)} conditions; choose one, as by {example}")
        (contest,) = found
        key = KEY_OF_PER if axis == PER else axis
        labels = _labels(results, next(iter(contest.treatments.values())))
        if key not in dict(labels[0].settings):
            raise OutputError(f"--refine: the study does not set {key} by itself; name the varied key with --axis")
        varied = [value for label in results.schedule.labels for own, value in label.settings if own == key]
        whole = all(isinstance(value, int) for value in varied)
        level = contest.pairs(declared.sign).next_level(whole)
        _make(results, labels, (key, int(level) if whole else level), min(n, FEW), jobs, progress)
        n -= FEW


def _labels(results: SweepResults, pair: Sequence[Treatment]) -> list[ConfigurationLabel]:
    by_treatment, left_out = {}, settings_alike(results.file)
    for number, label in enumerate(results.schedule.labels):
        if (line := results.lines.get(results.schedule.key(number, 0))) is not None:
            by_treatment[treatment_of(line, left_out)] = label
    return [by_treatment[treatment] for treatment in pair]


def _make(
    results: SweepResults,
    labels: Sequence[ConfigurationLabel],
    level: tuple[str, float],
    repeats: int,
    jobs: int,
    progress: ReportProgress | None,
) -> None:
    file, number = results.file, sum(1 for _ in _refined(results))
    cases = [case for case in file.unforeseen if case.name == labels[0].unforeseen]
    apart = {key for key, _ in dotted(file.set)}
    apart |= {key for case in cases for key, _ in (*dotted(case.set), (FAULT, None))}
    points = [{key: it for key, it in label.settings if key not in apart} | dict([level]) for label in labels]
    design: dict[str, Any] = {"name": f"{file.study.name} refined", "scenario": labels[0].source, "sampling": "list"}
    design |= {"repeats": repeats, "seed": seed_of(file.study.seed, SEEDS + number)}
    kept = {} if file.study.keep_tables is None else {"keep_tables": file.study.keep_tables}
    tables = {"set": file.set, "point": points, "unforeseen": [case.model_dump() for case in cases]}
    raw: dict[str, Any] = {"study": {**design, **kept}, **{name: table for name, table in tables.items() if table}}
    study = study_of(Document.of_tables(raw, f"{results.folder}: refined study"))
    if any(results.code.get(name, value) != value for name, value in code_of(study).items()):
        changed = CODE_CHANGED.partition(":")[0]
        raise StudyChangedError(f"{results.folder}: {changed}; make the study again to refine it")
    sweep(study, results.folder / REFINED / f"{number:04}", jobs, progress=progress)
