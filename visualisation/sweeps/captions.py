"""Captions of sweep figures: content, kind of interval, number of runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from missions.comparison import Comparison, Rank
from missions.comparison.effects import MainEffect
from missions.comparison.ranking import are_too_few
from missions.comparison.treatments import SIGNIFICANT
from missions.metric import Better, Metric
from missions.statistics import FEW, INTERVALS_OF_DIFFERENCES, INTERVALS_OF_MEANS
from missions.sweeps.folder import SweepResults
from visualisation import words
from visualisation.sweeps.arrangement import Arrangement, Measure, PanelSettings

GOAL = "mission.goal"
OF_RATES = "Wilson's 95 % intervals of the rate"
RESTRICTED = "A run that did not get there, or failed, counts with the mission's whole duration (restricted mean)."
CENSORED = (
    f"{RESTRICTED} Where all runs of a point got there, the interval is that of the mean of runs that do, and says "
    "nothing of others; where some did not, it holds for both together."
)


def metric_caption(
    arrangement: Arrangement, combinations: Sequence[PanelSettings], rows: Sequence[Comparison], measure: Measure
) -> str:
    """Return the caption of one metric along the axis."""
    rate = measure.is_rate
    return words.joined(
        f"{words.capital(measure.name)} over {arrangement.axis_label}.",
        f"Lines: rates; bars: {OF_RATES}." if rate else f"Lines: means; bars: {INTERVALS_OF_MEANS}.",
        measure.metric.note,
        _without_values(arrangement, rows),
        _aside(arrangement),
        _spacing(arrangement, rows),
        CENSORED if measure.metric.censored else "",
        _cases(arrangement),
        "" if rate else unequal_work(rows, arrangement),
        _panels(arrangement, combinations),
    )


def overview_caption(arrangement: Arrangement, rows: Sequence[Comparison], measures: Sequence[Measure]) -> str:
    """Return the caption of the overview of metrics."""
    rates = any(measure.is_rate for measure in measures)
    notes = [f"{words.capital(measure.name)}: {words.within(measure.metric.note)}" for measure in measures
             if measure.metric.note]  # fmt: skip
    return words.joined(
        f"Overview over {arrangement.axis_label}.",
        f"Lines: means; bars: {INTERVALS_OF_MEANS}{f', for the success rate {OF_RATES}' if rates else ''}.",
        *notes,
        _aside(arrangement),
        _cases(arrangement),
        CENSORED if any(measure.metric.censored for measure in measures) else "",
    )


def differences_caption(
    arrangement: Arrangement, combinations: Sequence[PanelSettings], rows: Sequence[Comparison], measure: Measure
) -> str:
    """Return the caption of a metric's differences to the baseline."""
    better = {Better.HIGHER: "Above zero is better.", Better.LOWER: "Below zero is better."}
    return words.joined(
        f"{words.capital(measure.name)}: mean differences to {rows[0].baseline} over {arrangement.axis_label}, run by "
        "run of the same repeat.",
        better.get(measure.metric.better, ""),
        f"Bars: {INTERVALS_OF_DIFFERENCES}.",
        without_intervals(rows),
        measure.metric.note,
        _aside(arrangement),
        _cases(arrangement),
        CENSORED if measure.metric.censored else "",
        unequal_work(rows, arrangement),
        _panels(arrangement, combinations),
    )


def unequal_work(rows: Sequence[Comparison], arrangement: Arrangement) -> str:
    """Note that success rates differ significantly, so the compared work is unequal."""
    names = dict.fromkeys(row.strategy for row in rows if row.unequal_success)
    if not names:
        return ""
    return f"Unequal work: success rates of {', '.join(names)} are told from the highest."


def _cases(arrangement: Arrangement) -> str:
    listed = [f"{number} {case}" for number, case in enumerate(arrangement.cases, 1)]
    return f"Cases: {', '.join(listed)}." if listed else ""


def trade_off_caption(
    arrangement: Arrangement, combinations: Sequence[PanelSettings], across: Measure, up: Measure
) -> str:
    """Return the caption of one metric over another."""
    return words.joined(
        f"{words.capital(up.name)} over {across.name}: means, joined in the order of {arrangement.axis_label}, which "
        "the size of the markers tells. "
        f"Crosses: {INTERVALS_OF_MEANS}.",
        CENSORED if across.metric.censored or up.metric.censored else "",
        _cases(arrangement),
        _panels(arrangement, combinations),
    )


def ranking(arrangement: Arrangement, by: Metric, rows: Sequence[Rank]) -> str:
    """Return the caption of the ranking."""
    best = "highest" if by.better is Better.HIGHER else "lowest"
    return words.joined(
        f"Ranks by the mean of {words.within(by.label)} for each {arrangement.axis_label}, 1 is the {best}; "
        "equal means share their ranks. "
        "Bold and shaded: the best of the column and those that are not told from it (step-down sign flips of all "
        f"pairs at once, p >= {SIGNIFICANT:g}: of equal ones, one is told from the best in at most 5 % of studies). "
        "Last column: mean rank. Those whose success rate is told from the highest stand behind the others and are "
        "marked: theirs are means of unequal work.",
        "Where nothing was drawn there is one run of each: nothing was tested, and nothing is shaded."
        if any(row.deterministic for row in rows)
        else "",
        _goal(rows),
        _unequal(arrangement, rows),
        _cases(arrangement),
        "There are too few runs for any difference to be significant." if are_too_few(rows) else "",
        by.note,
        RESTRICTED if by.censored else "",
    )


def _goal(rows: Sequence[Rank]) -> str:
    """Describe the success criterion of ranks, with its setting if the study has one."""
    set_to = sorted({row.settings[GOAL] for row in rows if GOAL in row.settings})
    setting = f", {GOAL} = {' or '.join(set_to)}" if set_to else ""
    return f"Success is the mission's whole goal (goal_fraction = 1{setting}), reached before its end."


def _unequal(arrangement: Arrangement, rows: Sequence[Rank]) -> str:
    xs: dict[str, list[str]] = {}
    for row in rows:
        if row.unequal_success:
            xs.setdefault(row.strategy, []).append(f"{arrangement.x(row):g}")
    return f"Here: {'; '.join(f'{name} at {chr(44).join(places)}' for name, places in xs.items())}." if xs else ""


def sweep_conditions(results: SweepResults, arrangement: Arrangement, rows: Iterable[Comparison | Rank]) -> str:
    """Describe number of runs, seed, configurations, bounds and version."""
    rows = list(rows)
    present = {(row.strategy, row.policy) for row in rows}
    series = [series for series in arrangement.series if series[:2] in present]
    study, status = results.file.study, results.status()
    n = _counts(arrangement, rows)
    unfinished = f", {status.remaining} not made yet" if status.remaining else ""
    bounds = sorted({series.strategy for series in arrangement.series} & results.bounds)
    notes = [text for row in rows for text in results.assumed({**row.settings, "channel.name": row.channel})]
    assumed = f" ({'; '.join(dict.fromkeys(notes))})" if notes else ""
    unranked = f"Not ranked, as a bound: {', '.join(bounds)}. " if bounds else ""
    return (
        f"{n}, master seed {study.seed} (the same losses in the same repeat of all points). "
        f"{words.named_all('Scenario', [row.scenario for row in rows])}, "
        f"{words.named_all('strategy', [drawn.strategy for drawn in series], 'strategies')}, "
        f"{words.named_all('policy', [drawn.policy for drawn in series], 'policies')}, "
        f"{words.named_all('channel', [row.channel for row in rows])}{assumed}. {unranked}"
        f"Study {study.name}: {status.done} of {status.planned} runs done, {status.censored} of them not completed "
        f"(censored), {status.failed} failed (not completed){unfinished}; remoras {results.schedule.version}."
    )


def _counts(arrangement: Arrangement, rows: Sequence[Comparison | Rank]) -> str:
    """Describe the number of sampled runs per point, and the deterministic points."""
    counts = sorted({row.n for row in rows if not row.deterministic})
    ends = dict.fromkeys(f"{count}" for count in (*counts[:1], *counts[-1:]))
    n = [f"n = {' to '.join(ends)} runs per point"] if counts else []
    once: dict[float, set[str]] = {}
    for row in rows:
        if row.deterministic:
            once.setdefault(arrangement.x(row), set()).add(row.strategy)
    drawn = {arrangement.x(row) for row in rows if not row.deterministic}
    if once:
        points = [f"{place:g}{f' ({chr(44).join(sorted(once[place]))})' * (place in drawn)}" for place in sorted(once)]
        n.append(f"deterministic, n = 1, at {arrangement.axis_label} {', '.join(points)}: nothing was drawn")
    return "; ".join(n)


def effects_caption(rows: Sequence[MainEffect], metric: Metric) -> str:
    """Return the caption of the main effects on one metric."""
    main = [row for row in rows if row.is_main]
    mixed = [f"{row.term} with {row.aliases}" for row in main if row.aliases]
    n_missing = max((row.n_missing for row in rows), default=0)
    numbers = sorted({row.n for row in main})
    return words.joined(
        f"Main effects on {words.within(metric.label)}: mean at the second level less mean at the first, by runs of "
        f"the same repeat (n = {' or '.join(map(str, numbers))} repeats).",
        f"Whiskers: {INTERVALS_OF_DIFFERENCES}.",
        f"Mixed with interactions of two factors: {'; '.join(dict.fromkeys(mixed))}." if mixed else "",
        f"Effects of fewer than {FEW} repeats have no interval: n is too small."
        if numbers and numbers[0] < FEW
        else "",
        RESTRICTED if n_missing else "",
        f"Panels: {'; '.join(dict.fromkeys(row.condition for row in rows))}.",
    )


def effects_conditions(results: SweepResults) -> str:
    """Describe design, seed and version of the effects."""
    design = results.file.study
    return f"Design: {results.factorial.said()}; master seed {design.seed}, version {results.schedule.version}."


def without_intervals(rows: Sequence[Comparison]) -> str:
    """Explain points without an interval; empty if none."""
    few = any(not row.deterministic and row.n < FEW for row in rows)
    return f"Points of fewer than {FEW} runs have no interval: n is too small." if few else ""


def _aside(arrangement: Arrangement) -> str:
    """Note that points of one axis value are drawn side by side."""
    several = len(arrangement.series) > 1
    return f"Points of one {arrangement.axis_label} are drawn side by side." if several else ""


def _without_values(arrangement: Arrangement, rows: Sequence[Comparison]) -> str:
    present = {(row.strategy, row.policy) for row in rows}
    lacking = [series.label for series in arrangement.series if series[:2] not in present]
    return f"Without values: {', '.join(lacking)}." if lacking else ""


def _spacing(arrangement: Arrangement, rows: Sequence[Comparison]) -> str:
    return "Places on the axis are evenly spaced, not to scale." if arrangement.is_spaced_evenly(rows) else ""


def _panels(arrangement: Arrangement, combinations: Sequence[PanelSettings]) -> str:
    listed = [
        f"({letter}) {arrangement.titles[combination]}"
        for letter, combination in zip("abcdef", combinations, strict=False)
    ]
    return f"Panels: {'; '.join(listed)}." if len(combinations) > 1 else ""
