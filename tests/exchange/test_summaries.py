"""Summaries of received sets: content, number of transmissions, effect on beliefs."""

import tracemalloc

import pytest

from benchmarks.manager_fleet import SLOT_S, ManagerFleet, cells
from exchange.manager.beliefs import TIMES_TOLD, Beliefs, Summaries
from exchange.packets import Fragment, ItemUid, Summary
from exchange.policy.policies import ACK
from worldmodel.facts import MOST_ITEMS

LIFE = (2, 0)


def told(queue: Summaries, packets: int) -> int:
    """Number of packets with a summary, of so many with capacity."""
    return sum(bool(queue.spare(100)[0]) for _ in range(packets))


def holding(*sequences: int) -> Beliefs:
    beliefs = Beliefs(0, 3, ACK, lambda one: (0, 30))
    for sequence in sequences:
        beliefs.complete((*LIFE, sequence))
    return beliefs


def test_an_unchanged_summary_is_sent_a_few_times() -> None:
    assert told(holding(0, 1, 2).summaries, 20) == TIMES_TOLD


def test_a_discarded_block_is_reported_until_received_again() -> None:
    beliefs = holding(0, 1, 2, 3)
    queue = beliefs.summaries
    assert told(queue, 20) == TIMES_TOLD
    beliefs.give_up([(*LIFE, 2)])
    assert queue.spare(100) == ((Summary(*LIFE, highest=1, mask=1),), 30)
    assert told(queue, 20) == 20
    beliefs.complete((*LIFE, 2))
    assert told(queue, 20) == TIMES_TOLD


def test_a_discard_beyond_the_summary_mask_is_not_reported() -> None:
    """The mask behind the first gap does not reach the block that was given up."""
    beliefs = holding(0, *range(2, 20))
    queue = beliefs.summaries
    told(queue, 20)
    beliefs.give_up([(*LIFE, 15)])
    assert told(queue, 20) == 0


@pytest.mark.parametrize(("highest", "holds"), [(0, True), (-1, False), (MOST_ITEMS, False)])
def test_a_summary_counts_for_items_received_later_but_an_alarm_does_not(highest: int, holds: bool) -> None:
    """Node 0 reports on the second incarnation of node 2, of which node 1 hears afterwards."""
    fleet, uid = ManagerFleet(3), ItemUid(2, 0, 0, 1)
    fleet.deliver(1, fleet.codec.encode(0, 0, summary=[Summary(2, 1, highest, 0)]), 1.0)
    start_s = 2.0 * SLOT_S
    item = Fragment(2, 0, 0.0, cells(3, 1), epoch=1)
    data = fleet.codec.encode(2, 0, [item], epoch=1, slot_start_s=start_s)
    assert fleet.deliver(1, data, start_s + 1.0).items == (uid,)
    assert fleet.managers[1].believes(0, uid) is holds


def test_an_item_of_a_newer_incarnation_ends_beliefs_about_the_earlier_one() -> None:
    """Node 1 has an item from node 2 itself; node 0 passes on one that node 2 recorded after a restart."""
    fleet, uids = ManagerFleet(3), [ItemUid(2, 0, 0), ItemUid(2, 0, 0, 1)]
    for epoch, (sender, frame) in enumerate(((2, 0), (0, 1))):
        start_s = (3 * frame + sender) * SLOT_S
        item = Fragment(2, 0, 0.0, cells(3, 1), epoch=epoch)
        data = fleet.codec.encode(sender, 0, [item], frame=frame, slot_start_s=start_s)
        assert fleet.deliver(1, data, start_s + 1.0).items == (uids[epoch],)
        assert [fleet.managers[1].believes(2, uid) for uid in uids] == [epoch == 0, epoch == 1]


def test_reports_of_all_numbers_take_little_memory() -> None:
    """Of a hundred incarnations: a bit for each number would take 13 MB."""
    beliefs = Beliefs(0, 3, ACK, lambda one: (0, 30))
    tracemalloc.start()
    for epoch in range(100):
        beliefs.report((1,), (2, epoch), (1 << MOST_ITEMS) - 1)
    taken_bytes, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert taken_bytes < 1_000_000
