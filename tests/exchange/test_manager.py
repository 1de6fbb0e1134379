"""The exchange manager without I/O: bits and times in, bits and values out, over a scripted link."""

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import (
    DURATION_S,
    MAPPED_CELL,
    N_BLOCKS,
    POSITION,
    TBOX,
    ManagerFleet,
    bay,
    cells,
    instances,
    needs,
    role,
)
from exchange.errors import ConfigurationError
from exchange.manager.manager import ExchangeManager
from exchange.packets import Fragment, InfluenceSignal, ItemUid
from exchange.policy.policies import POLICIES, STATING
from exchange.wire.codec import Codec, Widths
from worldmodel import Keeping, PropertyValue, WorldModel, merge


def items_said(fleet: ManagerFleet, sender: int) -> list[ItemUid]:
    """Items sent so far, in order, with repetitions."""
    return [uid for sent in fleet.said if fleet.schedule.owner(sent.slot) == sender for uid in sent.items]


# Who needs it -------------------------------------------------------------------------------------


def test_an_item_is_dropped_when_all_nodes_that_need_it_hold_it():
    """Node 1 needs cells; node 2 does not, and hears nothing at all."""
    fleet = ManagerFleet(3, who_needs=needs([1]), lost=lambda slot, sender, receiver: receiver == 2)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(4)
    assert items_said(fleet, 0) == [uid]
    assert fleet.holders(uid) == [0, 1]
    assert fleet.n_open == 0


def test_each_belief_about_a_peer_is_gained_once() -> None:
    """Nodes repeat the cells of others and relay acknowledgements; every third packet is lost."""
    fleet = ManagerFleet(4, "mps-ack-repeat", lost=lambda slot, sender, receiver: (slot + 2 * receiver) % 3 == 0)
    cells_of = [fleet.maps(number % 4, cell=number) for number in range(8)]
    fleet.pass_frames(12)
    for node, heard in enumerate(fleet.heard):
        gained = [belief for reception in heard for belief in reception.beliefs]
        assert set(gained) == {(peer, uid) for peer in range(4) if peer != node for uid in cells_of}
        assert len(gained) == len(set(gained))


# Status -------------------------------------------------------------------------------------------


def test_only_the_newest_status_is_sent_once_and_unacknowledged():
    fleet = ManagerFleet(2)
    for x_m in (1.0, 2.0, 3.0):
        assert fleet.observe(0, (0, POSITION, (x_m, 0.0))) == ()  # it is no item
    sent = fleet.pass_slot()
    (block,) = fleet.heard[1][-1].blocks
    assert block.facts == (PropertyValue(0, POSITION, (3.0, 0.0)),)
    assert (sent.items, fleet.heard[1][-1].items) == ((), ())
    empty_bytes = -(-fleet.codec.overhead_bits // 8)
    assert [sent.size_bits for sent in fleet.pass_frames(2)] == [8 * empty_bytes] * 4
    assert all(reception.beliefs == () for reception in fleet.heard[0])


# Signals ------------------------------------------------------------------------------------------


def test_signals_are_sent_once_and_the_last_one_wins():
    fleet = ManagerFleet(3)
    fleet.managers[0].offer_signals([InfluenceSignal(role(3), 5)])
    fleet.managers[0].offer_signals([InfluenceSignal(role(3), -40), InfluenceSignal(bay(3), 127)])
    fleet.pass_frames(2)
    expected = [(InfluenceSignal(role(3), -40), InfluenceSignal(bay(3), 127)), ()]
    for peer in (1, 2):
        assert [reception.signals for reception in fleet.heard[peer] if reception.sender == 0] == expected


@settings(max_examples=40, deadline=None)
@given(
    st.integers(2, 6), st.sampled_from(sorted(POLICIES)), st.integers(20, 64), st.integers(0, 20),
    st.lists(st.integers(1, 14), max_size=4),
)  # fmt: skip
def test_no_packet_exceeds_its_capacity_and_all_items_are_delivered(
    n_nodes: int, policy: str, payload_bytes: int, n_signals: int, n_cells: list[int]
):
    """Whatever is offered: blocks of any length, statuses, and signals of any number in every slot, as vehicles do."""
    try:
        fleet = ManagerFleet(n_nodes, policy, payload_bytes)
    except ConfigurationError:
        return  # the header alone is too large; see below
    uids: list[ItemUid] = []
    for n in n_cells:
        with suppress(ConfigurationError):  # a fact that fits no packet is refused when it is offered
            uids += fleet.observe(0, *((bay(n_nodes), MAPPED_CELL, float(cell)) for cell in range(n)))
    for _ in range(2 * len(uids) + 3):
        fleet.observe(0, (0, POSITION, (1.0, 1.0)))
        fleet.managers[0].offer_signals([InfluenceSignal(0, 1)] * n_signals)
        fleet.pass_frames(1)
    assert all(len(sent.data) <= payload_bytes and sent.size_bits == 8 * len(sent.data) for sent in fleet.said)
    assert policy in STATING or all(fleet.holders(uid) == list(range(n_nodes)) for uid in uids)


# Slots --------------------------------------------------------------------------------------------


def test_sending_in_a_foreign_slot_raises_a_programming_error():
    fleet = ManagerFleet(3)
    with pytest.raises(ConfigurationError, match=r"slot 1 at 2\.0 s belongs to node 1, not to node 0"):
        fleet.managers[0].packet_to_send(2.0)


def test_a_policy_whose_header_fills_the_packet_is_refused_with_the_numbers():
    """20 nodes: the matrix alone has 380 bits, a 32 B packet 256."""
    with pytest.raises(ConfigurationError, match=r"256 bits.*m-ack needs for 20 nodes"):
        ManagerFleet(20, "m-ack", payload_bytes=32)


# Times --------------------------------------------------------------------------------------------


def test_clock_rounding_puts_no_valid_fact_in_the_future():
    """Times are rounded to 10 s: what is observed at 8.2 s is of 10 s. It arrives at 9 s, without tolerance, and is
    sound; of 20 s nothing is. Slot 4 begins at 8 s."""
    fleet = ManagerFleet(2)
    codec = Codec(TBOX, len(instances(2)), 2, POLICIES["ack"], N_BLOCKS, DURATION_S, Widths(10.0))
    for time_s, is_refused in ((10.0, False), (20.0, True)):
        model = WorldModel(TBOX, 1, instances(2), 10.0, n_origins=2, keeping=Keeping(clock_tolerance_s=0.0))
        manager = ExchangeManager(1, model, codec, fleet.schedule, POLICIES["ack"], 512, needs(range(2)))
        fragment = Fragment(0, 0, time_s, cells(2, 1))
        data = codec.encode(0, 0, [fragment], frame=2, slot_start_s=fleet.schedule.start_s(4))
        reception = manager.receive(data, 9.0)
        assert (reception.fault is not None) == is_refused
        assert (merge(model, reception.blocks, 9.0).faults, model.digest()) == (
            (),
            {} if is_refused else {(0, 0): (0, 0)},
        )


# Incarnations -------------------------------------------------------------------------------------


def test_an_item_sent_by_another_node_starts_the_new_incarnation_of_its_origin():
    """What the earlier incarnation acknowledged, its successor may lack."""
    fleet = ManagerFleet(3, "ack-repeat")
    uid, later = fleet.maps(1, cell=7), ItemUid(2, 0, 0, 1)
    fleet.pass_frames(2)
    assert fleet.managers[1].believes(2, uid)
    data = fleet.codec.encode(0, 0, [Fragment(2, 0, 0.0, cells(3, 1), epoch=1)], frame=2, slot_start_s=fleet.now_s)
    fleet.deliver(1, data, fleet.now_s + 1.0)
    assert fleet.managers[1].believes(2, later)
    assert not fleet.managers[1].believes(2, uid)


def test_an_item_of_the_sender_starts_no_other_incarnation_than_its_head():
    """After two restarts it sends an item of the middle incarnation, which it may have lost again."""
    fleet = ManagerFleet(3, carrier_evidence=False)
    start_s = fleet.schedule.start_s(2)
    data = fleet.codec.encode(2, 0, [Fragment(2, 0, 0.0, cells(3, 1), epoch=1)], epoch=2, slot_start_s=start_s)
    assert fleet.deliver(1, data, start_s + 1.0).items == (ItemUid(2, 0, 0, 1),)
    assert not fleet.managers[1].believes(2, ItemUid(2, 0, 0, 1))


def test_an_item_of_a_later_own_incarnation_starts_none():
    """Another vehicle may use the node id: this one keeps what it holds."""
    fleet = ManagerFleet(3, "ack-repeat")
    uid = fleet.maps(1, cell=7)
    data = fleet.codec.encode(0, 0, [Fragment(1, 0, 0.0, cells(3, 1), epoch=1)])
    fleet.deliver(1, data, 1.0)
    assert fleet.managers[1].believes(1, uid)


def test_a_block_of_several_items_is_given_out_once_whole():
    """In whatever order they come, with the last of its items."""
    fleet = ManagerFleet(2, payload_bytes=20, lost=lambda slot, sender, receiver: slot == 0)
    uids = fleet.observe(0, *((bay(2), MAPPED_CELL, float(cell)) for cell in range(6)))
    fleet.pass_frames(2 * len(uids))
    given = [reception for reception in fleet.heard[1] if reception.blocks]
    assert len(uids) > 1
    assert [len(block.facts) for reception in given for block in reception.blocks] == [6]
    assert sum(len(reception.items) for reception in fleet.heard[1]) == len(uids)
    assert fleet.heard[1].index(given[0]) >= len(uids) - 1
