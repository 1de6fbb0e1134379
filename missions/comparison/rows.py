"""Rows of a comparison and of a ranking, and the CSV files that hold them."""

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
    """A row of ``compare``; the names are those of the contract. None where too few runs can say.

    Args:
        n: runs that the mean is over; where failed runs count (success, censored metrics), they are among them.
        n_completed: runs whose mission completed.
        n_failed: runs that raised or killed their process.
        n_reached: runs that reached the event of a censored metric, whose mean is restricted; None for other metrics.
        least, largest: of the values.
        p_holm: that a treatment is like its baseline, corrected for all pairs of the metric by step-down sign flips,
            see ``missions/comparison/ranking.py``.
        ci95_low: of a censored metric it holds whatever runs that were not made would have done, see
            ``missions/statistics.py``.
        deterministic: nothing was drawn, so repeats are one run: no interval, no probability.
        ci95_note: why there is no interval; empty where there is one. ``diff_note`` is of the difference.
        reached_mean: mean of the runs that got there (censored metrics), with an interval that says nothing of others.
        n_pairs: runs of a repeat that were compared; ``n_pairs_reached`` those in which both got there.
        diff_reached: mean difference of these, with an interval that says nothing of others.
        unequal_success: told from the highest success rate under the same conditions, see ``Rank``.
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
    """How a strategy with its policy stands among those run under the same conditions.

    Args:
        rank: by the mean among those of like success, 1 is best; equal ones share the mean of their ranks (Friedman
            1937).
        p_to_best: that it is like the best, the same value as ``Comparison.p_holm`` of the two; None for the best
            itself, and where nothing was drawn in either.
        among_best: the best, or told from it neither in the metric nor in success. Where nothing was drawn, those with
            the best value.
        unequal_success: its success rate is told from the highest; it stands behind those of like success, since a mean
            of other work says nothing about theirs.
        deterministic: nothing was drawn, so there is one run and nothing was tested.
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
    """Write rows of one kind as a table, settings as JSON; no rows make a table of comparisons without rows."""
    columns = [field.name for field in fields(rows[0] if rows else Comparison)]
    with drafted(path) as draft, draft.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            values = asdict(row)
            writer.writerow(
                {**values, **({"settings": json.dumps(values["settings"])} if "settings" in values else {})}
            )
