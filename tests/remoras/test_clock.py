"""The event queue: its order does not depend on the order of insertion."""

from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.events import Clock, Priority

TIMES = st.sampled_from([0.0, 0.1, 0.3, 0.1 + 0.2, 1.0, 7.1])
events = st.lists(st.tuples(TIMES, st.sampled_from(list(Priority))))


class Note(NamedTuple):
    """An event; its payload may be something that cannot be compared."""

    number: int
    payload: object


def drained(clock: Clock[Note], until_s: float) -> list[tuple[float, int]]:
    found = []
    while (event := clock.next_before(until_s)) is not None:
        found.append((clock.now_s, event.number))
    return found


@given(events)
def test_events_are_ordered_by_time_priority_and_insertion(scheduled: list[tuple[float, Priority]]) -> None:
    clock: Clock[Note] = Clock()
    for number, (time_s, priority) in enumerate(scheduled):
        clock.schedule(time_s, priority, Note(number, object()))
    expected = sorted(range(len(scheduled)), key=lambda number: (*scheduled[number], number))
    assert drained(clock, 100.0) == [(scheduled[number][0], number) for number in expected]


@given(events, TIMES)
def test_events_that_are_not_due_stay_queued(scheduled: list[tuple[float, Priority]], until_s: float) -> None:
    """Before the motion of a time come all events before it, and at it faults and what is heard."""
    clock: Clock[Note] = Clock()
    for number, (time_s, priority) in enumerate(scheduled):
        clock.schedule(time_s, priority, Note(number, None))
    first = drained(clock, until_s)
    due = {
        number
        for number, (time_s, priority) in enumerate(scheduled)
        if time_s < until_s or (time_s == until_s and priority in (Priority.FAULT, Priority.ARRIVAL))
    }
    assert {number for _, number in first} == due
    assert len(first) + len(drained(clock, 100.0)) == len(scheduled)


def test_an_event_in_the_past_is_refused() -> None:
    clock: Clock[Note] = Clock()
    clock.now_s = 5.0
    with pytest.raises(ValueError, match=r"cannot schedule at 4\.9 s, it is 5\.0 s"):
        clock.schedule(4.9, Priority.SLOT, Note(0, None))
