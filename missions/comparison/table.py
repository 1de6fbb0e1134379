"""Comparison as a table of texts, with its notes, for the command line and reports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from missions.comparison.baseline import Comparison
from missions.comparison.treatments import SIGNIFICANT, SUCCESS
from missions.statistics import FEW, MANY, NoInterval, least_p
from missions.sweeps.folder import is_bound

ALWAYS = ("per", "strategy", "policy", "n", "done", "mean", "p")
NUMBERS = ("per", "n", "done")
"""Columns that are always shown, and those of numbers."""


def number(value: float) -> str:
    """Return a value with four significant digits, without exponent from 10,000 on.

    >>> number(10763.2), number(0.98765), number(-12166.0)
    ('10760', '0.9877', '-12170')
    """
    text = f"{value:.4g}"
    return f"{float(text):.0f}" if "e+" in text else text


def interval(mean: float | None, low: float | None, high: float | None) -> str:
    """Return a value with its interval, if any; ``-`` without a value."""
    bounds = "" if low is None or high is None else f" [{number(low)}, {number(high)}]"
    return "-" if mean is None else f"{number(mean)}{bounds}"


def _entries(row: Comparison) -> dict[str, str]:
    spread = f" ({number(row.least)} to {number(row.largest)})" if row.has_range else ""
    return {
        "per": f"{row.per:g}",
        "strategy": f"{row.strategy} (bound)" if is_bound(row.strategy) else row.strategy,
        "policy": row.policy,
        "n": str(row.n),
        "done": str(row.n_completed),
        "mean": interval(row.mean, row.ci95_low, row.ci95_high) + spread,
        "completed runs": interval(row.reached_mean, row.reached_ci95_low, row.reached_ci95_high),
        f"difference to {row.baseline}": interval(row.diff_to_baseline, row.diff_ci95_low, row.diff_ci95_high),
        "both completed": interval(row.diff_reached, row.diff_reached_ci95_low, row.diff_reached_ci95_high),
        "p": "-" if row.p_holm is None else f"{row.p_holm:.2g}",
        "note": row.ci95_note * (row.ci95_note != NoInterval.RARE.value),
        "unforeseen": row.unforeseen,
        "settings": " ".join(f"{key}={value}" for key, value in row.settings.items()),
    }


def table(rows: Sequence[Comparison]) -> tuple[list[str], list[list[str]]]:
    """Return heads and entries of the rows of a metric, without empty columns.

    The columns of completed runs and pairs equal the others unless a run did not complete.
    """
    entries = [_entries(row) for row in rows]
    of_completed = ("completed runs", "both completed")
    left_out = () if any(row.is_incomplete for row in rows) else of_completed
    used = [
        head
        for head in entries[0]
        if head not in left_out and (head in ALWAYS or any(own[head] not in ("", "-") for own in entries))
    ]
    estimates = ("mean", *of_completed, f"difference to {rows[0].baseline}")
    kinds = {"[": " [95 %]", "(": " (range)"}
    heads = [
        head + "".join(kind for mark, kind in kinds.items() if any(mark in own[head] for own in entries))
        if head in estimates
        else head
        for head in used
    ]
    return heads, [[own[head] for head in used] for own in entries]


def notes(rows: Sequence[Comparison]) -> Iterator[str]:
    """Yield what a reader of the rows of a metric has to know."""
    if any(row.has_range for row in rows):
        yield f"range: least to largest value; fewer than {MANY} runs allow no interval of a mean"
    if any(row.diff_note == NoInterval.TOO_FEW.value for row in rows):
        yield f"fewer than {FEW} pairs allow no interval of a difference"
    if any(row.diff_note == NoInterval.FEW_REACHED.value for row in rows):
        yield f"no interval of a difference where {NoInterval.FEW_REACHED.value}"
    if any(row.is_incomplete for row in rows):
        n, reached = sum(row.n for row in rows), sum(row.n_reached or 0 for row in rows)
        yield f"restricted means: {n - reached} of {n} runs did not complete and count with the full mission duration"
        if any(row.is_incomplete and row.ci95_low is not None for row in rows):
            yield "their intervals allow for further runs that do not complete"
    if any(row.deterministic for row in rows):
        yield "deterministic: no random draws, so repeats count as one run without interval and p"
    # Failed runs may look cheap, in distance for instance: other metrics then rank failure as merit.
    if rows[0].metric != SUCCESS and (unequal := [row for row in rows if row.unequal_success]):
        named = (f"{row.strategy} with {row.policy} at per {row.per:g} {row.unforeseen}".rstrip() for row in unequal)
        names = ", ".join(dict.fromkeys(named))
        yield f"unequal work, not to be ranked, since success rates are significantly below the highest: {names}"
    tested = [row.n_pairs for row in rows if row.p_holm is not None]
    if tested and (least := least_p(max(tested))) >= SIGNIFICANT:
        yield f"no p of {max(tested)} pairs can be below {least:.2g}: use more repeats"
