"""Rows of a comparison and of a ranking, and the CSV files that hold them."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from missions.files import drafted


@dataclass(frozen=True)
class Comparison:
    """A row of ``compare``; the names are those of the contract. None where too few runs can say.

    Args:
        n: runs that the mean is over; where failed runs count (success, censored metrics), they are among them.
        n_completed: runs whose mission completed.
        n_failed: runs that raised or killed their process.
        n_reached: runs that reached the event of a censored metric, whose mean is restricted; None for other metrics.
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
    diff_to_baseline: float | None
    diff_ci95_low: float | None
    diff_ci95_high: float | None
    p_holm: float | None
    effect_size: float | None
    pairing_gain: float | None
    success_rate: float
    success_ci95_low: float
    success_ci95_high: float
    restricted_mean_time_s: float


@dataclass(frozen=True)
class Rank:
    """How a strategy with its policy stands among those run under the same conditions.

    Args:
        rank: by the mean among those of like success, 1 is best; equal ones share the mean of their ranks (Friedman
            1937).
        p_holm_to_best: of the paired differences to the best, corrected over those conditions; None for the best
            itself, and where there are fewer than two pairs.
        among_best: the best, or neither in the metric nor in success significantly different from it.
        unequal_success: its success rate is below the highest by more than their intervals; it stands behind those of
            like success, since a mean of other work says nothing about theirs.
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
    p_holm_to_best: float | None
    among_best: bool
    unequal_success: bool


def write_csv(rows: Sequence[Comparison | Rank], path: Path) -> None:
    """Write rows of one kind as a table, settings as JSON; no rows make a table of comparisons without rows."""
    columns = [field.name for field in fields(rows[0] if rows else Comparison)]
    with drafted(path) as draft, draft.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows({**asdict(row), "settings": json.dumps(row.settings)} for row in rows)
