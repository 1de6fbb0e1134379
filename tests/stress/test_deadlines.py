"""Legs, perceptions, decisions, quiet sensors and conclusions change no table, computed each time."""

import math
from collections.abc import Mapping
from typing import Any

import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st
from stress.schedules import Schedule, schedules
from stress.trial import judge

from remoras.executive.layer import ExecutiveLayer
from remoras.functional.guidance import Guidance
from remoras.functional.layer import FunctionalLayer
from remoras.recorder import Row
from remoras.sensor import QuietFrom

CLOSE = 1e-6
"""Difference of numbers by rounding alone, relative or absolute."""
LAW = {"deadline": None, "derandomize": True, "suppress_health_check": list(HealthCheck)}


def is_same(value: Any, other: Any) -> bool:
    if isinstance(value, float) and isinstance(other, float):
        return value == other or math.isclose(value, other, rel_tol=CLOSE, abs_tol=CLOSE)
    if isinstance(value, tuple | list):
        return len(value) == len(other) and all(map(is_same, value, other))
    return bool(value == other)


def difference(tables: Mapping[str, list[Row]], others: Mapping[str, list[Row]]) -> str | None:
    for name, rows in tables.items():
        for row, other in zip(rows, others[name], strict=False):
            if not is_same(row, other):
                return f"{name}: {row}, without deadlines {other}"
        if len(rows) != len(others[name]):
            return f"{name}: {len(rows)} rows, without deadlines {len(others[name])}"
    return None


def check(schedule: Schedule) -> None:
    note(schedule.as_toml())
    usual = judge(schedule, ()).tables
    move = Guidance.move
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Guidance, "move", lambda *arguments: move(*arguments) and None)
        patch.setattr(ExecutiveLayer, "stands", lambda *arguments: False)
        patch.setattr(QuietFrom, "holds", lambda *arguments: False)
        patch.setattr(FunctionalLayer, "_due", lambda layer, *arguments: range(len(layer._behaviours)))
        asked = judge(schedule, ()).tables
    assert difference(usual, asked) is None


@settings(max_examples=1, **LAW)
@given(schedules(needs=("loss", "restarts")))
def test_deadlines_change_no_table(schedule: Schedule) -> None:
    check(schedule)


@settings(max_examples=1, **LAW)
@given(schedules(needs=("loss", "mute"), given=st.just(("navigation.drift=0.03",))))
def test_deadlines_change_no_table_where_positions_err(schedule: Schedule) -> None:
    """A fix moves the place where a vehicle believes to be."""
    check(schedule)


@pytest.mark.slow
@settings(max_examples=8, **LAW)
@given(schedules())
def test_deadlines_change_no_table_under_any_schedule(schedule: Schedule) -> None:
    check(schedule)
