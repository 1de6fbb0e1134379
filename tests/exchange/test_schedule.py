"""TDMA arithmetic: a time belongs to one slot, and rounding never moves a slot boundary."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from exchange.errors import ConfigurationError
from exchange.packets import Head
from exchange.schedule import FRAMES_TOLD, TdmaSchedule

schedules = st.builds(
    TdmaSchedule, n_nodes=st.integers(2, 64), packet_s=st.floats(0.01, 20.0), guard_s=st.floats(0.0, 7.0)
)


def test_the_frame_of_the_paper_follows_from_modem_and_range():
    """512 bits at 463 bit/s and 1000 m at 1500 m/s: 1.1058 + 0.6667 = 1.7725 s, four of them 7.09 s."""
    schedule = TdmaSchedule(4, 512 / 463, 1000.0 / 1500.0)
    assert schedule.slot_s == pytest.approx(1.7725, abs=5e-5)
    assert schedule.frame_s == pytest.approx(7.09, abs=5e-5)


@given(schedules, st.integers(0, 10**7))
@example(TdmaSchedule(3, 0.1, 0.0), 3)  # 0.3 / 0.1 is 2.999... and 3 * 0.1 is above 0.3
def test_a_slot_is_open_from_its_start_until_the_next_start(schedule: TdmaSchedule, slot: int):
    start_s = schedule.start_s(slot)
    assert schedule.slot_at(start_s) == slot
    assert schedule.slot_at(math.nextafter(schedule.start_s(slot + 1), 0.0)) == slot
    assert schedule.slot_at(start_s + schedule.slot_s / 2.0) == slot


@given(schedules, st.integers(0, 10**5), st.floats(0.001, 0.999))
def test_every_node_has_one_slot_per_frame_named_in_its_packet(schedule: TdmaSchedule, frame: int, part: float):
    start_s = schedule.frame_start_s(frame)
    assert start_s == pytest.approx(frame * schedule.frame_s)
    for node in {0, schedule.n_nodes // 2, schedule.n_nodes - 1}:
        slot = schedule.slot_at(start_s + (node + 0.5) * schedule.slot_s)
        assert (schedule.frame_of(slot), schedule.owner(slot)) == (frame, node)
        head = Head(node, 0, schedule.frame_of(slot) % FRAMES_TOLD)
        assert schedule.slot_named(head, schedule.start_s(slot) + part * schedule.slot_s) == slot


@pytest.mark.parametrize(("n_nodes", "packet_s", "guard_s"), [(0, 1.0, 0.0), (2, 0.0, 1.0), (2, 1.0, -0.1)])
def test_an_impossible_schedule_is_refused_with_its_values(n_nodes: int, packet_s: float, guard_s: float):
    with pytest.raises(ConfigurationError, match=f"n_nodes >= 1.*n_nodes={n_nodes}"):
        TdmaSchedule(n_nodes, packet_s, guard_s)


def test_arrival_is_accepted_within_the_slot_plus_the_clock_difference():
    """Slot 5 of slots of 2 s lasts from 10 to 12 s; one of a frame before or after is of another in any case."""
    schedule = TdmaSchedule(n_nodes=4, packet_s=1.5, guard_s=0.5)
    assert [schedule.may_arrive(5, now_s, 0.5) for now_s in (9.4, 9.6, 12.4, 12.6)] == [False, True, True, False]
    assert [schedule.may_arrive(5, 11.5 + more_s, 100.0) for more_s in (-8.0, 0.0, 8.0)] == [False, True, False]
