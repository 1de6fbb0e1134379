"""The queue of a vehicle: greedy selection, bounds, and a reason for each unsent item."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.packets import Fragment
from exchange.policy.candidates import Candidate, Expired, Unsaid, item_candidate
from exchange.policy.queue import Queue
from missions.scenarios.communication import VALUE_RULES
from worldmodel import STATUS, PropertyValue, Terms

SIZE_BITS = 60
BATTERY = 9


class FixedRoom:
    """A packet in which a fragment takes as many bits as the test says."""

    def __init__(self, left_bits: int, size_bits: dict[int, int] | None = None) -> None:
        self.left_bits = left_bits
        self.sizes = size_bits or {}
        self.n_asked = 0

    def add(self, fragment: Fragment) -> bool:
        self.n_asked += 1
        size_bits = SIZE_BITS if fragment.sequence == STATUS else self.sizes.get(fragment.sequence, SIZE_BITS)
        if size_bits > self.left_bits:
            return False
        self.left_bits -= size_bits
        return True


def item(column: int, time_s: float = 0.0) -> Fragment:
    """An item whose subject is its column."""
    return Fragment(0, column, time_s, (PropertyValue(column, 3, True),))


def status(number: int) -> Fragment:
    """A status whose subject is its number."""
    return Fragment(0, STATUS, 0.0, (PropertyValue(number, BATTERY, 0.5),))


def take(queue: Queue, column: int, priority: int = 1, terms: Terms | None = None, time_s: float = 0.0) -> Candidate:
    candidate = item_candidate(column, item(column, time_s), SIZE_BITS, priority, time_s)
    queue.take(candidate, terms or Terms(), time_s)
    return candidate


def said(queue: Queue, n_items: int, now_s: float = 0.0) -> list[int]:
    """Columns of the items in a packet with capacity for so many."""
    return [one.column for one in queue.choose(FixedRoom(n_items * SIZE_BITS), now_s)]


# As the study chooses -----------------------------------------------------------------------------

EVENTS = st.lists(
    st.one_of(
        st.tuples(st.just("take"), st.integers(1, 9), st.sampled_from([30, 60, 60, 90])),
        st.tuples(st.just("status"), st.integers(0, 3), st.integers(1, 9)),
        st.tuples(st.just("drop"), st.integers(0, 30), st.just(0)),
        st.tuples(st.just("return"), st.integers(0, 30), st.just(0)),
        st.tuples(st.just("revalue"), st.integers(0, 30), st.integers(1, 9)),
        st.tuples(st.just("slot"), st.integers(0, 400), st.just(0)),
    ),
    max_size=60,
)


class Selected:
    """The queue as it would be if it looked at all candidates in every own slot: items by UID, then statuses."""

    def __init__(self) -> None:
        self.items: dict[int, list[int]] = {}  # by column: weight, priority, size
        self.open: set[int] = set()
        self.status: dict[int, list[int]] = {}  # by number: weight, priority, waits

    def slot(self, capacity_bits: int) -> list[tuple[int, int]]:
        rows = [(column, self.items[column]) for column in sorted(self.open)]
        names = [(0, column) for column, _ in rows] + [(1, number) for number in self.status]
        weights = [row[0] for _, row in rows] + [row[0] for row in self.status.values()]
        priorities = [row[1] for _, row in rows] + [row[1] for row in self.status.values()]
        sizes = [row[2] for _, row in rows] + [SIZE_BITS] * len(self.status)
        eligible = [1] * len(rows) + [row[2] for row in self.status.values()]
        weights = [w + p * e for w, p, e in zip(weights, priorities, eligible, strict=True)]
        found, left_bits = list[tuple[int, int]](), capacity_bits
        for position in sorted(range(len(weights)), key=lambda at: (-weights[at], at)):
            if eligible[position] and sizes[position] <= left_bits:
                found.append(names[position])
                left_bits -= sizes[position]
                weights[position] = 0
        for (kind, which), weight in zip(names, weights, strict=True):
            (self.status if kind else self.items)[which][0] = weight
        for kind, which in found:
            if kind:
                self.status[which][2] = 0
        return found


@given(EVENTS)
def test_the_queue_selects_the_heaviest_items_that_fit(events: list[tuple[str, int, int]]) -> None:
    """Items and statuses come, go, come back and change their priority between own slots of any room."""
    queue, expected, candidates = Queue(), Selected(), dict[int, Candidate]()
    for event, what, more in events:
        if event == "take":
            column = len(expected.items)
            candidates[column] = item_candidate(column, item(column), more, what, 0.0)
            queue.take(candidates[column])
            expected.items[column] = [0, what, more]
            expected.open.add(column)
        elif event == "status":
            queue.take_status(status(what), more, SIZE_BITS)
            row = expected.status.setdefault(what, [0, more, 1])
            row[1:] = [more, 1]
        elif event == "drop" and what in expected.open:
            queue.drop(what)
            expected.open.discard(what)
        elif event == "return" and what in expected.items and what not in expected.open:
            queue.take(candidates[what])
            expected.open.add(what)
        elif event == "revalue" and what in expected.open:
            queue.revalue(what, more, Terms(), 0.0)
            expected.items[what][1] = more
        elif event == "slot":
            sizes = {column: row[2] for column, row in expected.items.items()}
            room = FixedRoom(what, sizes)
            chosen = queue.choose(room, 0.0)
            found = [(1, one.fragment.facts[0].subject) if one.column < 0 else (0, one.column) for one in chosen]
            assert found == expected.slot(what)


@pytest.mark.parametrize("name", sorted(VALUE_RULES))
def test_new_items_do_not_wait_for_unacknowledged_ones(name: str) -> None:
    """Six items that were said for more than an hour, room for two: each that comes then goes within ten minutes."""
    queue = Queue(VALUE_RULES[name])
    for column in range(6):
        take(queue, column)
    for slot in range(500):
        said(queue, 2, 10.0 * slot)
    take(queue, 6, time_s=5000.0)
    assert any(6 in said(queue, 2, 5000.0 + 10.0 * slot) for slot in range(60))


# Terms --------------------------------------------------------------------------------------------


def test_items_beyond_their_time_to_live_are_not_sent() -> None:
    queue = Queue()
    take(queue, 0, terms=Terms(time_to_live_s=60.0))
    take(queue, 1)
    assert said(queue, 2, 60.0) == [0, 1]
    assert said(queue, 2, 60.5) == [1]
    (expiry,) = queue.take_expired()
    assert (expiry.uid, expiry.reason, expiry.latency_s) == (item(0).uid, Expired.TIME_TO_LIVE, 60.5)
    take(queue, 0, terms=Terms(time_to_live_s=60.0))
    assert said(queue, 2, 61.0) == [1]


@pytest.mark.parametrize(
    ("before", "now", "is_new_need", "now_s", "again"),
    [
        (Terms(acknowledged=False), Terms(acknowledged=False), False, 1.0, []),
        (Terms(acknowledged=False), Terms(acknowledged=False), True, 1.0, [0]),
        (Terms(acknowledged=False), Terms(60.0, acknowledged=False), False, 1.0, []),
        (Terms(acknowledged=False), Terms(), False, 1.0, [0]),
        (Terms(acknowledged=False), Terms(60.0), True, 61.0, []),
    ],
)
def test_a_sent_item_is_sent_again_for_new_needs_only(before, now, is_new_need, now_s, again):
    """Who comes to need it, or needs it acknowledged, has it while it is of use; whom it was for, not twice."""
    queue = Queue()
    candidate = take(queue, 0, terms=before)
    assert said(queue, 1) == [0]
    queue.take(candidate, now, now_s, is_new_need)
    assert said(queue, 1, now_s) == again


def test_a_subject_is_not_sent_again_within_its_blackout_time() -> None:
    queue = Queue()
    terms = Terms(blackout_s=30.0)
    fragments = [Fragment(0, n, 0.0, (PropertyValue(5, 3, float(n)),)) for n in range(2)]
    queue.take(item_candidate(0, fragments[0], SIZE_BITS, 1, 0.0), terms)
    assert said(queue, 9, 100.0) == [0]
    queue.take(item_candidate(1, fragments[1], SIZE_BITS, 1, 0.0), terms)
    assert said(queue, 9, 129.0) == []
    assert queue.unsaid == {Unsaid.BLACKOUT: 2}
    assert said(queue, 9, 130.0) == [0, 1]


# Bounds -------------------------------------------------------------------------------------------


def test_a_full_queue_defers_the_last_item_and_loses_none() -> None:
    queue = Queue(limit=3)
    for column in range(5):
        take(queue, column)
    assert len(queue) == 3
    assert [(one.uid.sequence, one.reason, one.comes_back) for one in queue.take_expired()] == [
        (3, Expired.OVERFLOW, True),
        (4, Expired.OVERFLOW, True),
    ]
    assert queue.open == 0b11111
    assert sorted(said(queue, 9)) == [0, 1, 2]
    assert queue.unsaid == {Unsaid.OVERFLOW: 2}
    for column in (0, 1, 3):
        queue.drop(column)
    assert sorted(said(queue, 9)) == [2, 4]
    assert len(queue) == 2


def test_an_item_displaced_by_another_priority_has_its_age_then() -> None:
    queue = Queue(limit=1)
    for column in range(2):
        take(queue, column, time_s=float(column))
    queue.take_expired()
    queue.revalue(1, 5, Terms(), 9.0)
    assert [(one.uid.sequence, one.latency_s) for one in queue.take_expired()] == [(0, 9.0)]


def test_each_need_has_its_own_queue_limit() -> None:
    queue, terms = Queue(), Terms(queue_limit=2, newest_first=True, acknowledged=False)
    for column in range(4):
        take(queue, column, terms=terms, time_s=float(column))
    assert [(one.uid.sequence, one.reason) for one in queue.take_expired()] == [
        (0, Expired.OVERFLOW),
        (1, Expired.OVERFLOW),
    ]
    assert said(queue, 9, 9.0) == [3, 2]


@given(
    priorities=st.lists(st.integers(1, 20), min_size=2, max_size=12),
    limit=st.integers(1, 4),
    lost=st.sets(st.integers(0, 11)),
)
def test_unacknowledged_items_do_not_block_a_full_queue(priorities: list[int], limit: int, lost: set[int]) -> None:
    """Items of which some are never acknowledged, others the slot after: all are said, however small the queue."""
    queue, heard = Queue(limit=limit), set[int]()
    for column, priority in enumerate(priorities):
        take(queue, column, priority)
    for slot in range(400):  # the least urgent of the queue waits for up to 220
        for column in said(queue, 1, float(slot)):
            heard.add(column)
            if column not in lost:
                queue.drop(column)
    assert heard == set(range(len(priorities)))


# Reasons ------------------------------------------------------------------------------------------


def test_each_unsent_candidate_has_a_reason() -> None:
    """Of seven: one too large while a lighter one goes, one said before, four of lower value."""
    queue = Queue()
    assert said(queue, 1) == []
    assert queue.unsaid == {Unsaid.NOTHING_OPEN: 1}
    take(queue, 0, 9)
    assert said(queue, 1) == [0]
    for column, priority in enumerate([50, 30, 8, 8, 8, 8], 1):
        queue.take(item_candidate(column, item(column), 200 if column == 1 else SIZE_BITS, priority, 0.0))
    chosen = queue.choose(FixedRoom(SIZE_BITS, {1: 200}), 0.0)
    assert [one.column for one in chosen] == [2]
    assert queue.unsaid == {Unsaid.LOWER_VALUE: 4, Unsaid.TOO_LARGE: 1, Unsaid.WAITING: 1}


# What is left to others -----------------------------------------------------------------------------


@pytest.mark.parametrize("rule", VALUE_RULES.values(), ids=VALUE_RULES)
def test_a_suspended_item_is_outstanding_and_unsent_until_resumed(rule):
    queue = Queue(rule)
    for column in range(3):
        take(queue, column)
    queue.rest(0b101)
    assert (said(queue, 3), queue.open, queue.resting) == ([1], 0b111, 0b101)
    assert queue.unsaid == {Unsaid.RELAYED: 2}
    queue.rest(0b100)
    assert sorted(said(queue, 3)) == [0, 1]
    queue.drop(2)
    assert (queue.open, queue.resting) == (0b011, 0)


@pytest.mark.parametrize("rule", VALUE_RULES.values(), ids=VALUE_RULES)
def test_items_outside_of_the_plan_of_a_packet_wait_for_the_next(rule):
    """They are not left to a relay: the reason is their lower value, or that they were sent before."""
    queue = Queue(rule)
    for column in range(3):
        take(queue, column)
    assert [one.column for one in queue.choose(FixedRoom(SIZE_BITS), 0.0, left_out=0b110)] == [0]
    assert queue.unsaid == {Unsaid.LOWER_VALUE: 2}
    assert [one.column for one in queue.choose(FixedRoom(SIZE_BITS), 1.0, left_out=0b101)] == [1]
    assert (queue.unsaid, queue.open, queue.resting) == ({Unsaid.WAITING: 1, Unsaid.LOWER_VALUE: 1}, 0b111, 0)
    assert sorted(said(queue, 3, 2.0)) == [0, 1, 2]
