"""Metrics of navigation that errs: how often vehicles learned where they were, and what time that took.

They apply where vehicles err about their place, and nowhere else.
"""

from __future__ import annotations

import math

from missions.metric import NOT_APPLICABLE, Absent, MeasuredRun
from remoras.functional.fixing import FIXING


def n_fixes(run: MeasuredRun) -> int | Absent:
    """How often a vehicle interrupted what it did to learn where it is."""
    return len(_spells_s(run)) if run.scenario.navigation.errs else NOT_APPLICABLE


def fixing_s(run: MeasuredRun) -> float | Absent:
    """Time that this took, of all vehicles together, from each decision to the next one without it."""
    return round(math.fsum(_spells_s(run)), 4) if run.scenario.navigation.errs else NOT_APPLICABLE


def _spells_s(run: MeasuredRun) -> list[float]:
    """Length of each such interruption; one that lasted at the end counts until then."""
    decided: dict[tuple[float, str], set[str]] = {}
    for time_s, vehicle, _, name, *_ in run.recorder.rows("activities"):
        decided.setdefault((time_s, vehicle), set()).add(name)
    since_s: dict[str, float] = {}
    spells = []
    for (time_s, vehicle), names in decided.items():
        if FIXING.name in names:
            since_s.setdefault(vehicle, time_s)
        elif vehicle in since_s:
            spells.append(time_s - since_s.pop(vehicle))
    return spells + [run.end_s - began_s for began_s in since_s.values()]
