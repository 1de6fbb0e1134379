"""Captions of the figures of a sweep: what is shown, with which intervals, from how many runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from missions.comparison.baseline import INTERVALS_OF_MEANS
from missions.comparison.pairs import SIGNIFICANT
from missions.comparison.ranking import are_too_few, of_unequal_work
from missions.comparison.rows import Comparison, Rank
from missions.metric import Better, MetricRecord
from missions.sweeps.folder import SweepResults
from visualisation import words
from visualisation.sweeps.arrangement import Arrangement, Combination
from visualisation.sweeps.measures import Measure

CUT = "Intervals are cut at the frame."
OF_RATES = "Wilson's 95 % intervals of the rate"
CENSORED = "A run that did not get there, or failed, counts with the mission's whole duration (restricted mean)."


def metric(
    arrangement: Arrangement, combinations: Sequence[Combination], rows: Sequence[Comparison], measure: Measure
) -> str:
    """Caption of one metric along the axis."""
    rate = measure.whiskers
    return words.joined(
        f"{words.capital(measure.name)} over {arrangement.axis_label}.",
        f"Lines: rates; bars: {OF_RATES}." if rate else f"Lines: means; bands: {INTERVALS_OF_MEANS}.",
        _of_certainty(rows) if rate else CUT,
        measure.metric.note,
        _without_values(arrangement, rows),
        _aside(arrangement),
        _spacing(arrangement, rows),
        CENSORED if measure.metric.censored else "",
        _cases(arrangement),
        "" if rate else unequal_work(rows, arrangement),
        _panels(arrangement, combinations),
    )


def overview(arrangement: Arrangement, rows: Sequence[Comparison], measures: Sequence[Measure]) -> str:
    """Caption of the metrics of the study."""
    rates = any(measure.whiskers for measure in measures)
    notes = [f"{words.capital(measure.name)}: {words.within(measure.metric.note)}" for measure in measures
             if measure.metric.note]  # fmt: skip
    return words.joined(
        f"Overview over {arrangement.axis_label}.",
        f"Lines: means; bands: {INTERVALS_OF_MEANS}{f', for the success rate {OF_RATES}' if rates else ''}.",
        _of_certainty(rows) if rates else "",
        CUT,
        *notes,
        _aside(arrangement),
        _cases(arrangement),
        CENSORED if any(measure.metric.censored for measure in measures) else "",
    )


def differences(
    arrangement: Arrangement, combinations: Sequence[Combination], rows: Sequence[Comparison], measure: Measure
) -> str:
    """Caption of the differences of one metric to the baseline."""
    better = {Better.HIGHER: "Above zero is better.", Better.LOWER: "Below zero is better."}
    return words.joined(
        f"{words.capital(measure.name)}: mean differences to {rows[0].baseline} over {arrangement.axis_label}, run by "
        "run of the same repeat.",
        better.get(measure.metric.better, "") if measure.metric.better else "",
        f"Bands: {INTERVALS_OF_MEANS}.",
        CUT,
        measure.metric.note,
        _aside(arrangement),
        _cases(arrangement),
        CENSORED if measure.metric.censored else "",
        unequal_work(rows, arrangement),
        _panels(arrangement, combinations),
    )


def unequal_work(rows: Sequence[Comparison], arrangement: Arrangement) -> str:
    """Said where success rates differ, so that what is compared is not the same work."""
    names = dict.fromkeys(row.strategy for row in of_unequal_work(rows, arrangement.bounds))
    if not names:
        return ""
    return f"Unequal work: success rates of {', '.join(names)} are below the highest by more than their intervals."


def _cases(arrangement: Arrangement) -> str:
    listed = [f"{number} {case}" for number, case in enumerate(arrangement.cases, 1)]
    return f"Cases: {', '.join(listed)}." if listed else ""


def trade_off(arrangement: Arrangement, combinations: Sequence[Combination], across: Measure, up: Measure) -> str:
    """Caption of one metric over another."""
    return words.joined(
        f"{words.capital(up.name)} over {across.name}: means, joined in the order of {arrangement.axis_label}, which "
        "the size of the markers tells; lines that end elsewhere than others have a number at their end. "
        f"Crosses: {INTERVALS_OF_MEANS}.",
        CUT,
        CENSORED if across.metric.censored or up.metric.censored else "",
        _cases(arrangement),
        _panels(arrangement, combinations),
    )


def ranking(arrangement: Arrangement, by: MetricRecord, rows: Sequence[Rank]) -> str:
    """Caption of the table of ranks."""
    best = "highest" if by.better is Better.HIGHER else "lowest"
    return words.joined(
        f"Ranks by the mean of {words.within(by.label)} for each {arrangement.axis_label}, 1 is the {best}; "
        "equal means share their ranks. "
        "Bold and shaded: the best of the column and those that do not differ significantly from it "
        f"(sign-flip test of the paired differences, Holm-corrected in each column, p >= {SIGNIFICANT:g}). "
        "Last column: mean rank. Those whose success rate is below the highest by more than their intervals stand "
        "behind the others and are marked: theirs are means of unequal work.",
        _unequal(arrangement, rows),
        _cases(arrangement),
        "There are too few runs for any difference to be significant." if are_too_few(rows) else "",
        by.note,
        CENSORED if by.censored else "",
    )


def _unequal(arrangement: Arrangement, rows: Sequence[Rank]) -> str:
    at: dict[str, list[str]] = {}
    for row in rows:
        if row.unequal_success:
            at.setdefault(row.strategy, []).append(f"{arrangement.x(row):g}")
    return f"Here: {'; '.join(f'{name} at {chr(44).join(places)}' for name, places in at.items())}." if at else ""


def conditions(results: SweepResults, arrangement: Arrangement, rows: Iterable[Comparison | Rank]) -> str:
    """Numbers of runs, seed, what was compared where, which of it is a bound, and the version."""
    rows = list(rows)
    present = {(row.strategy, row.policy) for row in rows}
    series = [one for one in arrangement.series if one[:2] in present]
    study, status = results.file.study, results.status()
    counts = sorted({row.n for row in rows})
    n = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    unfinished = f", {status.remaining} not made yet" if status.remaining else ""
    bounds = sorted({one.strategy for one in arrangement.series} & results.bounds)
    unranked = f"Not ranked, as a bound: {', '.join(bounds)}. " if bounds else ""
    return (
        f"n = {n} runs per point, master seed {study.seed} (the same losses in the same repeat of all points). "
        f"{words.named_all('Scenario', [row.scenario for row in rows])}, "
        f"{words.named_all('strategy', [one.strategy for one in series], 'strategies')}, "
        f"{words.named_all('policy', [one.policy for one in series], 'policies')}, "
        f"{words.named_all('channel', [row.channel for row in rows])}. {unranked}"
        f"Study {study.name}: {status.done} of {status.planned} runs done, {status.censored} of them not completed "
        f"(censored), {status.failed} failed (not completed){unfinished}; remoras {results.schedule.version}."
    )


def _aside(arrangement: Arrangement) -> str:
    """Said where points of one place on the axis are drawn side by side."""
    several = len(arrangement.series) > 1
    return f"Points of one {arrangement.axis_label} are drawn side by side." if several else ""


def _of_certainty(rows: Sequence[Comparison]) -> str:
    """Said of the intervals of rates of 1, which are not drawn."""
    lows = {f"{row.success_ci95_low:.2f}" for row in rows if row.success_rate == 1.0}
    return f"Those of a rate of 1, from {' or '.join(sorted(lows))} to 1, are not drawn." if lows else ""


def _without_values(arrangement: Arrangement, rows: Sequence[Comparison]) -> str:
    present = {(row.strategy, row.policy) for row in rows}
    lacking = [one.label for one in arrangement.series if one[:2] not in present]
    return f"Without values: {', '.join(lacking)}." if lacking else ""


def _spacing(arrangement: Arrangement, rows: Sequence[Comparison]) -> str:
    return "Places on the axis are evenly spaced, not to scale." if arrangement.is_spaced_evenly(rows) else ""


def _panels(arrangement: Arrangement, combinations: Sequence[Combination]) -> str:
    listed = [f"({letter}) {arrangement.titles[one]}" for letter, one in zip("abcdef", combinations, strict=False)]
    return f"Panels: {'; '.join(listed)}." if len(combinations) > 1 else ""
