"""Rows of comparisons and rankings, and their CSV files."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from missions.disk import drafted

if TYPE_CHECKING:
    from missions.comparison.effects import MainEffect


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A row of ``compare``; None for too few runs.

    Args:
        n: runs of the mean; failed runs included for success and censored metrics.
        n_completed: runs with a completed mission; ``n_failed`` raised or killed their process.
        n_reached: runs with the event of a censored metric; None for other metrics.
        p_holm: p value of equality with the baseline, step-down corrected, see ``missions/comparison/ranking.py``.
        ci95_low: for a censored metric valid whatever unseen runs do, see ``missions/statistics.py``.
        deterministic: repeats are one run: no interval, no p value.
        ci95_note: reason for a missing interval, or empty; ``diff_note`` is for the difference.
        reached_mean: mean of the uncensored runs; its interval does not cover the others.
        n_pairs: compared pairs; ``n_pairs_reached`` are uncensored on both sides.
        diff_reached: mean difference of the latter; its interval does not cover the others.
        unequal_success: significantly below the highest success rate, see ``Rank``.
    """

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: dict[str, str]
    unforeseen: str
    metric: str
    baseline: str
    n: int
    n_completed: int
    n_failed: int
    n_reached: int | None
    mean: float
    ci95_low: float | None
    ci95_high: float | None
    median: float
    least: float
    largest: float
    diff_to_baseline: float | None = None
    diff_ci95_low: float | None = None
    diff_ci95_high: float | None = None
    p_holm: float | None = None
    effect_size: float | None = None
    pairing_gain: float | None = None
    success_rate: float
    success_ci95_low: float | None
    success_ci95_high: float | None
    deterministic: bool = False
    ci95_note: str = ""
    diff_note: str = ""
    reached_mean: float | None = None
    reached_ci95_low: float | None = None
    reached_ci95_high: float | None = None
    n_pairs: int = 0
    n_pairs_reached: int | None = None
    diff_reached: float | None = None
    diff_reached_ci95_low: float | None = None
    diff_reached_ci95_high: float | None = None
    unequal_success: bool = False


@dataclass(frozen=True)
class Rank:
    """Rank of a strategy with its policy among those with equal conditions.

    Args:
        rank: by the mean among treatments of similar success, 1 is best; ties share the mean rank (Friedman 1937).
        p_to_best: p value of equality with the best, as in ``Comparison.p_holm``; None for the best and if both are
            deterministic.
        among_best: not significantly different from the best in metric and success; if deterministic, equal to it.
        unequal_success: significantly below the highest success rate, hence ranked last: its mean is of other work.
        deterministic: a single run, not tested.
    """

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: dict[str, str]
    unforeseen: str
    metric: str
    n: int
    success_rate: float
    mean: float
    rank: float
    p_to_best: float | None
    among_best: bool
    unequal_success: bool
    deterministic: bool = False


def write_csv(rows: Sequence[Comparison] | Sequence[Rank] | Sequence[MainEffect], path: Path) -> None:
    """Write rows of one kind as CSV, settings as JSON; without rows the header of a comparison."""
    columns = [field.name for field in fields(rows[0] if rows else Comparison)]
    with drafted(path) as draft, draft.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            values = asdict(row)
            writer.writerow(
                {**values, **({"settings": json.dumps(values["settings"])} if "settings" in values else {})}
            )
