"""Metrics of mapping: how much was mapped, how soon, how often twice, and by whom."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from missions.metric import Better, Metric
from missions.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from missions.runs.run import Run

MAPPED_SHARE = 0.95
"""Share of the cells at which the areas count as mapped."""


def _n_cells(run: Run) -> int:
    return len(run.mission.world().cells)


def _mapped(run: Run) -> set[tuple[int, int]]:
    return {(row[2], row[3]) for row in run.recorder.rows("coverage")}


def coverage_fraction(run: Run) -> float:
    """Share of the cells of all areas that somebody mapped; 0 without areas."""
    n_cells = _n_cells(run)
    return len(_mapped(run)) / n_cells if n_cells else 0.0


def mapping_time_s(run: Run) -> float | None:
    """When 95 % of all cells had been mapped by anybody; None if they never were, or if there are none."""
    n_cells = _n_cells(run)
    first_s: dict[tuple[int, int], float] = {}
    for time_s, _, x, y in run.recorder.rows("coverage"):
        first_s.setdefault((x, y), time_s)
    needed = math.ceil(MAPPED_SHARE * n_cells)
    return round(sorted(first_s.values())[needed - 1], 4) if 0 < needed <= len(first_s) else None


def duplicate_fraction(run: Run) -> float:
    """Share of the mapping that was done again by another vehicle."""
    rows = run.recorder.rows("coverage")
    return 1.0 - len(_mapped(run)) / len(rows) if rows else 0.0


def area_roles(scenario: Scenario) -> set[tuple[str, str]]:
    """(group, role) of the roles whose holder explores an area."""
    return {(group.name, role.name) for group in scenario.group for role in group.role if role.job is not None}


def least_mapped_fraction(run: Run) -> float | None:
    """Utility of the worst vehicle: the smallest share of the mapped cells that was first mapped by one vehicle.

    Over the vehicles that held a role with an area at any time. With n of them it is 1/n if they shared the work
    equally and 0 if one did nothing; None if nobody held such a role or nothing was mapped. (Egalitarian welfare:
    Brandt et al., Handbook of Computational Social Choice, 2016, chapter 12.)
    """
    recorder, roles = run.recorder, area_roles(run.scenario)
    first: dict[tuple[int, int], str] = {}
    for _, vehicle, x, y in recorder.rows("coverage"):
        first.setdefault((x, y), vehicle)
    holders = {vehicle for _, vehicle, group, role, event in recorder.roles if (group, role) in roles}
    counts = Counter(first.values())
    return min(counts[vehicle] for vehicle in holders) / len(first) if holders and first else None


METRICS = (
    Metric("coverage_fraction", "", Better.HIGHER, "coverage", coverage_fraction, headline=True),
    Metric(
        "mapping_time_s", "s", Better.LOWER, "mapping time", mapping_time_s, censored=True,
    ),
    Metric("duplicate_fraction", "", Better.LOWER, "duplicated work", duplicate_fraction, headline=True),
    Metric("least_mapped_fraction", "", Better.HIGHER, "least mapped fraction", least_mapped_fraction),
)  # fmt: skip
"""Metrics of the mapping mission."""
