"""TDMA arithmetic: a time belongs to one slot, and rounding never moves a boundary."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.errors import ConfigurationError
from exchange.schedule import TdmaSchedule

schedules = st.builds(
    TdmaSchedule, n_nodes=st.integers(2, 64), packet_s=st.floats(0.01, 20.0), guard_s=st.floats(0.0, 7.0)
)


def test_the_frame_of_the_paper_follows_from_modem_and_range():
    """512 bits at 463 bit/s and 1000 m at 1500 m/s: 1.1058 + 0.6667 = 1.7725 s, four of them 7.09 s."""
    schedule = TdmaSchedule(4, 512 / 463, 1000.0 / 1500.0)
    assert schedule.slot_s == pytest.approx(1.7725, abs=5e-5)
    assert schedule.frame_s == pytest.approx(7.09, abs=5e-5)


@given(schedules, st.integers(0, 10**7))
def test_a_slot_is_open_from_its_start_until_the_next_start(schedule: TdmaSchedule, slot: int):
    start_s = schedule.start_s(slot)
    assert schedule.slot_at(start_s) == slot
    assert schedule.slot_at(math.nextafter(schedule.start_s(slot + 1), 0.0)) == slot
    assert schedule.slot_at(start_s + schedule.slot_s / 2.0) == slot


@pytest.mark.parametrize("slot_s", [0.1, 0.3, 0.7, 1.1, 1.7725, 1 / 3])
def test_boundaries_that_binary_fractions_miss(slot_s: float):
    """0.3 / 0.1 is 2.999... and 3 * 0.1 is above 0.3: division alone would put starts into the slot before."""
    schedule = TdmaSchedule(3, slot_s, 0.0)
    assert [schedule.slot_at(schedule.start_s(slot)) for slot in range(5000)] == list(range(5000))


@pytest.mark.parametrize(("n_nodes", "packet_s", "guard_s"), [(0, 1.0, 0.0), (2, 0.0, 1.0), (2, 1.0, -0.1)])
def test_a_schedule_that_cannot_be_is_refused_with_what_was_given(n_nodes: int, packet_s: float, guard_s: float):
    with pytest.raises(ConfigurationError, match=f"n_nodes >= 1.*n_nodes={n_nodes}"):
        TdmaSchedule(n_nodes, packet_s, guard_s)


@pytest.mark.parametrize("tolerance_s", [0.0, 1.0, 100.0])
def test_a_packet_of_a_frame_before_or_after_is_of_another_slot_however_wrong_clocks_are(tolerance_s: float):
    schedule = TdmaSchedule(n_nodes=4, packet_s=1.5, guard_s=0.5)
    assert schedule.may_arrive(5, 11.5, tolerance_s)
    assert not schedule.may_arrive(5, 11.5 + schedule.frame_s, tolerance_s)
    assert not schedule.may_arrive(5, 11.5 - schedule.frame_s, tolerance_s)


def test_a_packet_may_arrive_from_the_start_of_its_slot_to_its_end_and_as_much_beyond_as_clocks_are_apart():
    """Slot 5 of slots of 2 s lasts from 10 to 12 s."""
    schedule = TdmaSchedule(n_nodes=4, packet_s=1.5, guard_s=0.5)
    assert schedule.may_arrive(5, 9.6, 0.5)
    assert not schedule.may_arrive(5, 9.4, 0.5)
    assert schedule.may_arrive(5, 12.4, 0.5)
    assert not schedule.may_arrive(5, 12.6, 0.5)
