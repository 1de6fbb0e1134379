"""Cached answers, legs, deadlines and quiet sensors change nothing: computed each time, the tables are the same."""

import math
from collections.abc import Mapping
from typing import Any

import pytest
from hypothesis import given, note, settings
from hypothesis import strategies as st
from stress.schedules import CAMPAIGN, Schedule, schedules
from stress.trial import judge

from remoras.executive.decision import Choice
from remoras.executive.layer import Decision, ExecutiveLayer
from remoras.functional.guidance import Guidance
from remoras.functional.layer import FunctionalLayer
from remoras.recorder import Row
from remoras.sensor import QuietFrom
from remoras.social.layer import SocialLayer
from remoras.social.negotiation import Negotiation
from remoras.work import Work

CLOSE = 1e-6
"""Difference of numbers by rounding alone, relative or absolute."""


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
                return f"{name}: {row}, computed each time {other}"
        if len(rows) != len(others[name]):
            return f"{name}: {len(rows)} rows, computed each time {len(others[name])}"
    return None


def compute_each_time(patch: pytest.MonkeyPatch) -> None:
    """Take away whatever spares a computation: of a leg, a perception, a decision, a plan of work, a conclusion."""
    move, decide, negotiate = Guidance.move, ExecutiveLayer.decide, Negotiation.negotiate

    def decide_anew(layer: ExecutiveLayer, *arguments: Any) -> Decision:
        layer._is_weighed = False
        return decide(layer, *arguments)

    def seen_anew(work: Work, positions_m: Mapping[str, Any], now_s: float) -> Work:
        fields = {name: getattr(work, name) for name in work.__dataclass_fields__}
        return Work(**fields | {"positions_m": positions_m, "now_s": now_s})

    patch.setattr(Guidance, "move", lambda *arguments: move(*arguments) and None)
    patch.setattr(ExecutiveLayer, "stands", lambda *arguments: False)
    patch.setattr(ExecutiveLayer, "decide", decide_anew)
    patch.setattr(Choice, "holds", lambda *arguments: False)
    patch.setattr(QuietFrom, "holds", lambda *arguments: False)  # of sensors, conclusions and the referee
    patch.setattr(FunctionalLayer, "_due", lambda layer, *arguments: range(len(layer._behaviours)))
    patch.setattr(SocialLayer, "_is_concerned", lambda *arguments: True)
    patch.setattr(Negotiation, "negotiate", lambda *arguments: negotiate(*arguments[:-1], True))
    patch.setattr(Work, "seen", seen_anew)


def check(schedule: Schedule) -> None:
    note(schedule.as_toml())
    usual = judge(schedule, ()).tables
    with pytest.MonkeyPatch.context() as patch:
        compute_each_time(patch)
        asked = judge(schedule, ()).tables
    assert difference(usual, asked) is None


@settings(max_examples=1, derandomize=True, **CAMPAIGN)
@given(schedules(needs=("loss", "restarts")))
def test_what_is_spared_changes_no_table(schedule: Schedule) -> None:
    check(schedule)


@settings(max_examples=1, derandomize=True, **CAMPAIGN)
@given(schedules(needs=("loss", "mute"), given=st.just(("navigation.drift=0.03",))))
def test_what_is_spared_changes_no_table_where_positions_err(schedule: Schedule) -> None:
    """A fix moves the place where a vehicle believes to be."""
    check(schedule)


@pytest.mark.slow
@settings(max_examples=8, derandomize=True, **CAMPAIGN)
@given(schedules())
def test_what_is_spared_changes_no_table_under_any_schedule(schedule: Schedule) -> None:
    check(schedule)
