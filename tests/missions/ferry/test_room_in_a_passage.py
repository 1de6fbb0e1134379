"""Giving way, and passing it on, bear the mission of the ferry. Without their cause they do nothing."""

import pytest
from ferrying import ferried

from missions.runs.run import Run

KEPT, OFF = "guidance.keeps_calls=true", "decision.weight_external=0.0"
LONG, SHORT = "scenario.duration_s=2000.0", "scenario.duration_s=500.0"
WIDE = "passage.width_m=18.0"


def tracks(of: Run) -> list[tuple[object, ...]]:
    return list(of.recorder.trajectories)


@pytest.mark.slow
def test_rows_that_meet_go_back_only_where_calls_are_passed_on() -> None:
    ended_s = [ferried(seed, LONG).end_s for seed in (2, 4, 5)]
    kept_s = [ferried(seed, LONG, KEPT).end_s for seed in (2, 4, 5)]
    assert sum(kept_s) >= 1.2 * sum(ended_s)
    assert all(ferried(seed, LONG).completed for seed in (2, 4, 5))


@pytest.mark.slow
@pytest.mark.parametrize("other", [KEPT, OFF])
def test_where_two_can_pass_it_matters_little_who_makes_room(other: str) -> None:
    """In a passage 18 m wide two pass each other; what is left are encounters where loads are fetched."""
    wide_s = [ferried(2, LONG, WIDE, *keys).end_s for keys in ((), (other,))]
    assert abs(wide_s[1] - wide_s[0]) <= 0.05 * wide_s[0]
    assert wide_s[0] < 0.9 * ferried(2, LONG).end_s


@pytest.mark.slow
def test_who_is_not_dissatisfied_asks_for_no_room() -> None:
    """Then signals without weight are worth as much as any."""
    content = "decision.tedium_per_s=0.0", "decision.dismay_per_s=0.0"
    assert tracks(ferried(1, SHORT, *content)) == tracks(ferried(1, SHORT, *content, OFF))


@pytest.mark.slow
def test_vehicles_keep_clear_while_rows_go_back() -> None:
    for seed in (1, 2, 4, 5):
        assert not [row for row in ferried(seed, LONG).recorder.rows("faults") if row[2] == "conflict"]
