"""Captions of sweep figures: content, kind of interval, number of runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from missions import words
from missions.comparison import Comparison, Rank
from missions.comparison.effects import MainEffect
from missions.comparison.ranking import are_too_few
from missions.comparison.treatments import SIGNIFICANT
from missions.metric import Better, Metric
from missions.statistics import FEW, INTERVALS_OF_DIFFERENCES, INTERVALS_OF_MEANS, NoInterval
from missions.sweeps.folder import SweepResults, is_bound
from visualisation.sweeps.arrangement import RATE, Arrangement, Measure, PanelSettings, of_differences

GOAL = "mission.goal"
OF_RATES = "95 % Wilson intervals"
RESTRICTED = "Runs that failed or did not complete count with the full mission duration (restricted mean)."
OFF_SCALE = "An open arrow at the rim: fewer than half of the runs completed, and the mean is off the scale."
COUNTED = "Beside arrows: completed/all runs, where these change along a series."
RANGES = "ranges from least to largest value"


def metric_caption(
    arrangement: Arrangement, combinations: Sequence[PanelSettings], rows: Sequence[Comparison], measure: Measure
) -> str:
    """Return the caption of one metric along the axis."""
    rate = measure.is_rate
    return words.joined(
        f"{words.capital(measure.name)} over {arrangement.axis_label}.",
        f"Lines show rates, bars {OF_RATES}." if rate else _bars(rows),
        measure.metric.note,
        _without_values(arrangement, rows),
        _spacing(arrangement, rows),
        _restricted(rows),
        _off_scale(rows, COUNTED),
        _cases(arrangement),
        "" if rate else _unequal_work(rows),
        _panels(arrangement, combinations),
    )


def overview_caption(arrangement: Arrangement, rows: Sequence[Comparison], measures: Sequence[Measure]) -> str:
    """Return the caption of the overview of metrics."""
    rates = any(measure.is_rate for measure in measures)
    notes = [f"{words.capital(measure.name)}: {words.within(measure.metric.note)}" for measure in measures
             if measure.metric.note]  # fmt: skip
    return words.joined(
        f"Overview of metrics over {arrangement.axis_label}.",
        _bars([row for row in rows if row.metric != RATE]),
        f"Success rate: {OF_RATES}." if rates else "",
        *notes,
        _cases(arrangement),
        _restricted(rows),
        _off_scale(rows, COUNTED),
    )


def differences_caption(
    arrangement: Arrangement, combinations: Sequence[PanelSettings], rows: Sequence[Comparison], measure: Measure
) -> str:
    """Return the caption of a metric's differences to the baseline."""
    better = {Better.HIGHER: "Above zero is better.", Better.LOWER: "Below zero is better."}
    differences = of_differences(measure, rows)[1]
    return words.joined(
        f"{words.capital(measure.name)}: mean difference to {rows[0].baseline} over {arrangement.axis_label}, in "
        "pairs of runs of the same repeat.",
        better.get(measure.metric.better, ""),
        f"Bars show {INTERVALS_OF_DIFFERENCES}." if any(row.ci95_low is not None for row in differences) else "",
        without_intervals(differences),
        measure.metric.note,
        _cases(arrangement),
        _restricted(differences),
        _off_scale(differences, COUNTED),
        _unequal_work(rows),
        _panels(arrangement, combinations),
    )


def _unequal_work(rows: Sequence[Comparison]) -> str:
    """Note that success rates differ significantly, so the compared work is unequal."""
    names = dict.fromkeys(row.strategy for row in rows if row.unequal_success)
    if not names:
        return ""
    return f"Unequal work: success rates significantly below the highest: {', '.join(names)}."


def _bars(rows: Sequence[Comparison], what: str = "Lines show means, bars") -> str:
    """Name the bars that the rows have, with ``what`` before them; without any, the means only."""
    kinds = {
        INTERVALS_OF_MEANS: any(row.ci95_low is not None and not row.is_incomplete for row in rows),
        "95 % confidence intervals of the restricted mean where runs are incomplete": any(
            row.ci95_low is not None and row.is_incomplete for row in rows
        ),
        RANGES: any(row.has_range for row in rows),
    }
    shown = [kind for kind, is_drawn in kinds.items() if is_drawn]
    return f"{what} {' or '.join(shown)}." if shown else f"{what.partition(',')[0]}."


def _restricted(rows: Sequence[Comparison]) -> str:
    return RESTRICTED if any(row.is_incomplete for row in rows) else ""


def _off_scale(rows: Sequence[Comparison], *more: str) -> str:
    off = [row for row in rows if Measure.is_off_scale(row)]
    return words.joined(OFF_SCALE, *more) if off and len(off) < sum(row.n_reached is not None for row in rows) else ""


def _cases(arrangement: Arrangement) -> str:
    listed = [f"{number} {case}" for number, case in enumerate(arrangement.cases, 1)]
    return f"Cases: {', '.join(listed)}." if listed else ""


def trade_off_caption(
    arrangement: Arrangement,
    combinations: Sequence[PanelSettings],
    rows: Sequence[Comparison],
    across: Measure,
    up: Measure,
) -> str:
    """Return the caption of one metric over another."""
    return words.joined(
        f"{words.capital(up.name)} over {across.name}. Lines join the means in order of "
        f"{arrangement.axis_label}, which the marker size shows.",
        _bars(rows, "Crosses show"),
        _restricted(rows),
        _off_scale(rows),
        _cases(arrangement),
        _panels(arrangement, combinations),
    )


def ranking(arrangement: Arrangement, by: Metric, rows: Sequence[Rank]) -> str:
    """Return the caption of the ranking."""
    best = "highest" if by.better is Better.HIGHER else "lowest"
    return words.joined(
        f"Ranks by the mean of {words.within(by.label)} for each {arrangement.axis_label}. Rank 1 is the {best}, and "
        "equal means share a rank. Bold and shaded: the best of the column and all without a significant difference "
        f"to it (step-down sign-flip test of all pairs, p >= {SIGNIFICANT:g}; the test separates equal entries in at "
        "most 5 % of studies). Last column: mean rank. Entries whose success rate is significantly below the highest "
        "rank behind the others and are marked, since their means are of unequal work.",
        "Deterministic points have one run of each, so nothing is tested or shaded."
        if any(row.deterministic for row in rows)
        else "",
        _goal(rows),
        _cases(arrangement),
        "There are too few runs for any difference to be significant." if are_too_few(rows) else "",
        by.note,
        RESTRICTED if by.censored and any(row.success_rate < 1.0 for row in rows) else "",
    )


def _goal(rows: Sequence[Rank]) -> str:
    set_to = sorted({row.settings[GOAL] for row in rows if GOAL in row.settings})
    setting = f", {GOAL} = {' or '.join(set_to)}" if set_to else ""
    return f"Success is the mission's whole goal (goal_fraction = 1{setting}), achieved within its duration."


def sweep_conditions(results: SweepResults, arrangement: Arrangement, rows: Iterable[Comparison | Rank]) -> str:
    """Describe number of runs, seed, configurations, bounds and version."""
    rows = list(rows)
    present = {(row.strategy, row.policy) for row in rows}
    series = [series for series in arrangement.series if series[:2] in present]
    study, status = results.file.study, results.status()
    counts = {
        "of them not completed (censored)": status.censored,
        "failed (count as not completed)": status.failed,
        "still to run": status.remaining,
    }
    progress = ", ".join(
        [f"{status.done} of {status.planned} runs done", *(f"{n} {what}" for what, n in counts.items() if n)]
    )
    bounds = sorted({series.strategy for series in arrangement.series if is_bound(series.strategy)})
    notes = assumptions(results, rows)
    assumed = f" ({'; '.join(notes)})" if notes else ""
    unranked = f"Not ranked, since a bound: {', '.join(bounds)}. " if bounds else ""
    return (
        f"{_counts(rows)}, master seed {study.seed} (repeat k has the same random draws at all points). "
        f"{words.named_all('Scenario', [row.scenario for row in rows])}, "
        f"{words.named_all('strategy', [drawn.strategy for drawn in series], 'strategies')}, "
        f"{words.named_all('policy', [drawn.policy for drawn in series], 'policies')}, "
        f"{words.named_all('channel', [row.channel for row in rows])}{assumed}. {_of_mission(results)}{unranked}"
        f"Study {study.name}: {progress}; remoras {results.schedule.version}."
    )


def assumptions(results: SweepResults, rows: Iterable[Comparison | Rank]) -> list[str]:
    """Return the assumptions of the channels of these rows, once each."""
    texts = (text for row in rows for text in results.assumed({**row.settings, "channel.name": row.channel}))
    return list(dict.fromkeys(texts))


def _of_mission(results: SweepResults) -> str:
    """State duration and faults of the mission, each if all runs share it."""
    durations = {label.duration_s for label in results.schedule.labels}
    limit = f"Missions end at {min(durations):g} s at the latest. " if len(durations) == 1 else ""
    faults = "; ".join(results.shared_faults)
    return limit + (f"Faults in each run: {faults}. " if faults else "")


def _counts(rows: Sequence[Comparison | Rank]) -> str:
    counts = {row.n for row in rows if not row.deterministic}
    n = [f"n = {words.from_to(counts)} instance{'s' * (counts != {1})} per point"] if counts else []
    n += ["n = 1 at deterministic points"] if any(row.deterministic for row in rows) else []
    return "; ".join(n)


def effects_caption(rows: Sequence[MainEffect], metric: Metric) -> str:
    """Return the caption of the main effects on one metric."""
    main = [row for row in rows if row.is_main]
    mixed = [f"{row.term} with {row.aliases}" for row in main if row.aliases]
    n_missing = max((row.n_missing for row in rows), default=0)
    numbers = sorted({row.n for row in main})
    return words.joined(
        f"Main effects on {words.within(metric.label)}: mean at the second level minus mean at the first, paired by "
        f"instance (n = {' or '.join(map(str, numbers))}).",
        f"Bars show {INTERVALS_OF_DIFFERENCES}.",
        f"Aliased with two-factor interactions: {'; '.join(dict.fromkeys(mixed))}." if mixed else "",
        f"Effects from fewer than {FEW} instances have no interval." if numbers and numbers[0] < FEW else "",
        RESTRICTED if n_missing else "",
        f"Panels: {'; '.join(dict.fromkeys(row.condition for row in rows))}.",
    )


def effects_conditions(results: SweepResults) -> str:
    """Describe design, seed and version of the effects."""
    file, version = results.file, results.schedule.version
    return f"Design: {file.two_level_design.description()}; master seed {file.study.seed}, version {version}."


def without_intervals(rows: Sequence[Comparison]) -> str:
    """Explain points without an interval; empty if none."""
    few = any(not row.deterministic and row.n < FEW for row in rows)
    one_sided = any(row.diff_note == NoInterval.FEW_REACHED.value for row in rows)
    return words.joined(
        f"Fewer than {FEW} pairs have no interval." if few else "",
        f"No interval where {NoInterval.FEW_REACHED.value}." if one_sided else "",
    )


def _without_values(arrangement: Arrangement, rows: Sequence[Comparison]) -> str:
    present = {(row.strategy, row.policy) for row in rows}
    lacking = [series.label for series in arrangement.series if series[:2] not in present]
    return f"No values: {', '.join(lacking)}." if lacking else ""


def _spacing(arrangement: Arrangement, rows: Sequence[Comparison]) -> str:
    return "Axis values are evenly spaced, not to scale." if arrangement.is_spaced_evenly(rows) else ""


def _panels(arrangement: Arrangement, combinations: Sequence[PanelSettings]) -> str:
    listed = [
        f"({letter}) {arrangement.titles[combination]}"
        for letter, combination in zip("abcdef", combinations, strict=False)
    ]
    return f"Panels: {'; '.join(listed)}." if len(combinations) > 1 else ""
