"""The benchmark of the organisation asks what is meant, and counts what grows with the number of members."""

import sys
from types import FrameType
from typing import Any

from benchmarks.organisation import ALL, fleet, questions
from remoras.organisation import Outcome


def n_events(call: Any, name: str) -> int:
    """Python calls, lines and returns of one call: the same on every machine."""
    count = 0

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        nonlocal count
        count += 1
        return trace

    call(name)
    sys.settrace(trace)
    try:
        call(name)
    finally:
        sys.settrace(None)
    return count


def test_no_question_takes_more_steps_in_a_group_of_a_thousand_than_in_one_of_ten() -> None:
    (small, small_rules), (large, large_rules) = fleet(10), fleet(1000)
    assert len(small.members(ALL)) == 10
    assert len(large.members(ALL)) == 1000
    few, many = questions(small, small_rules), questions(large, large_rules)
    assert few["may_assign"]("AUV0003") is Outcome.SUCCESS
    for name in few:
        assert n_events(many[name], "AUV0003") <= n_events(few[name], "AUV0003"), name
