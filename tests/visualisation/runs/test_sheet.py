"""Flags and labels keep their distance."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from visualisation.runs import trajectories
from visualisation.runs.reading import MilestoneRow
from visualisation.runs.sheet import grouped, spread


@given(st.lists(st.floats(0.0, 3.0), max_size=20))
def test_flags_that_have_room_are_apart_in_order_and_inside(wanted_in: list[float]) -> None:
    wanted_in = sorted(wanted_in)
    placed_in = spread(wanted_in, 0.15, 0.0, 3.0)  # 20 flags need 19 * 0.15 = 2.85 inches
    assert all(after - before >= 0.15 - 1e-9 for before, after in pairwise(placed_in))
    assert all(-1e-9 <= at <= 3.0 for at in placed_in)


def test_milestones_of_one_time_share_a_number() -> None:
    done = [("gathered", "", "Red", 200.0), ("done", "", "", 200.0), ("begun", "A", "", 2.0)]
    found = grouped([MilestoneRow(*one) for one in done])
    assert [(mark.number, mark.label) for mark in found] == [
        (1, "begun: A (2.0 s)"),
        (2, "gathered: Red; done (200 s)"),
    ]


def test_an_eventful_start_is_a_stretch_too() -> None:
    assert trajectories.eventful([1.0, 2.0, 3.0, 4.0, 10.0], 100.0) == (0.0, 10.4)
