"""The exchange manager, sans-io: bits and times in, bits and values out, over a link that the test scripts."""

import random

import pytest
from exchange_lives import Sea
from hypothesis import given, settings
from hypothesis import strategies as st

from exchange.errors import ConfigurationError
from exchange.manager import ExchangeManager
from exchange.packets import Fragment, InfluenceSignal, ItemUid
from exchange.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec
from stress.conformance.radio import (
    AREA_DONE,
    BATTERY,
    DURATION_S,
    MAPPED_CELL,
    N_BLOCKS,
    PLAYS_ROLE,
    POSITION,
    TBOX,
    ManagerFleet,
    bay,
    cells,
    needs,
    one_size_codec,
    role,
)
from worldmodel import Attribute, Instance, NeedsIndex, PropertyValue, TBox, ValueKind, WorldModel


def items_said(fleet: ManagerFleet, sender: int) -> list[ItemUid]:
    """Every item the sender has said so far, in order, with repetitions."""
    return [uid for sent in fleet.said if fleet.schedule.owner(sent.slot) == sender for uid in sent.items]


# One item ------------------------------------------------------------------------------------------


def test_an_item_is_delivered_acknowledged_and_then_left_alone():
    """Two vehicles: said in slot 0, acknowledged in slot 1, so it is not said again in slot 2."""
    fleet = ManagerFleet(2)
    uid = fleet.maps(0, cell=7)
    assert fleet.pass_slot().items == (uid,)
    assert fleet.heard[1][-1].items == (uid,)
    assert fleet.models[1].value(bay(2), MAPPED_CELL) == 7.0
    assert not fleet.managers[0].believes(1, uid)
    fleet.pass_slot()
    assert fleet.heard[0][-1].beliefs == ((1, uid),)
    assert fleet.heard[0][-1].settled == (uid,)
    assert fleet.managers[0].n_open == 0
    assert fleet.pass_slot().items == ()


def test_a_lost_item_is_said_again_in_every_own_slot_until_it_gets_through():
    """Slots 0, 2 and 4 are lost at the only peer; slot 6 is not."""
    fleet = ManagerFleet(2, lost=lambda slot, sender, receiver: sender == 0 and slot < 6)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(5)
    assert [sent.slot for sent in fleet.said if uid in sent.items] == [0, 2, 4, 6]


def test_a_lost_acknowledgement_costs_a_repetition_and_the_repetition_is_no_news():
    fleet = ManagerFleet(2, lost=lambda slot, sender, receiver: slot == 1)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(3)
    assert items_said(fleet, 0) == [uid, uid]
    assert [reception.items for reception in fleet.heard[1]] == [(uid,), (), ()]
    assert [len(reception.blocks) for reception in fleet.heard[1]] == [1, 0, 0]
    assert fleet.n_open == 0


def test_it_is_said_until_the_last_of_three_peers_has_confirmed():
    """Node 3 hears nothing of node 0 before slot 8: two repetitions more than the others needed."""
    fleet = ManagerFleet(4, lost=lambda slot, sender, receiver: (sender, receiver) == (0, 3) and slot < 8)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(2)
    assert [fleet.managers[0].believes(peer, uid) for peer in (1, 2, 3)] == [True, True, False]
    fleet.pass_frames(2)
    assert items_said(fleet, 0) == [uid] * 3
    assert fleet.holders(uid) == [0, 1, 2, 3]
    assert fleet.n_open == 0


def test_what_those_hold_to_whom_it_is_addressed_gives_way_to_what_they_lack():
    """Node 2 hears nothing. Once node 1 has confirmed its item, that of node 2 is the more urgent, ten to one."""
    urgent = needs(range(3), {MAPPED_CELL: 50})
    fleet = ManagerFleet(3, who_needs=urgent, lost=lambda slot, sender, receiver: receiver == 2)
    for cell, peer in ((7, 1), (8, 2)):
        model = fleet.models[0]
        fleet.managers[0].offer([model.record([cells(3, 9)[cell][:3]], 0.0)], [peer])
    fleet.pass_frames(2)
    assert [entry.priority for entry in fleet.managers[0]._ledger.entries.values()] == [5, 50]


def test_what_nobody_waited_for_but_its_addressee_is_as_urgent_once_it_has_lost_it():
    """Node 2 confirms its role behind node 1, by which it is settled; then node 2 begins anew without it."""
    sea = Sea(3, "ack")
    sea.managers[0].offer([sea.models[0].record([(2, PLAYS_ROLE, role(3))], 0.0)], [2])
    sea.pass_frames(2)
    assert sea.n_open == 0
    sea.restart(2, keeps=False)
    sea.pass_frames(1)
    assert sea.n_open == 1
    assert [entry.priority for entry in sea.managers[0]._ledger.entries.values()] == [50]


def test_with_repeat_a_peer_passes_on_what_its_origin_cannot_deliver():
    """Node 2 never hears node 0; node 1 hears both. With neither repeats nor relaying node 2 never learns it."""
    for policy, relay, holders in [("ack", False, [0, 1]), ("ack", True, [0, 1, 2]), ("ack-repeat", False, [0, 1, 2])]:
        fleet = ManagerFleet(3, policy, lost=lambda slot, sender, receiver: (sender, receiver) == (0, 2))
        for manager in fleet.managers if not relay else ():
            manager.relaying.clear()
        uid = fleet.maps(0, cell=7)
        fleet.pass_frames(12)
        assert fleet.holders(uid) == holders
        assert not fleet.false_beliefs


# Who needs it -------------------------------------------------------------------------------------


def test_what_nobody_needs_is_kept_and_never_said():
    fleet = ManagerFleet(3, who_needs=needs(range(3), {AREA_DONE: 1}))
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(2)
    assert fleet.managers[0].holds(uid)
    assert items_said(fleet, 0) == []
    assert fleet.n_open == 0


def test_the_own_need_is_no_reason_to_send():
    fleet = ManagerFleet(3, who_needs=needs([0]))
    fleet.maps(0, cell=7)
    assert fleet.pass_slot().items == ()


def test_an_item_is_dropped_when_all_who_need_it_hold_it_though_others_lack_it():
    """Node 1 needs cells; node 2 does not, and hears nothing at all."""
    fleet = ManagerFleet(3, who_needs=needs([1]), lost=lambda slot, sender, receiver: receiver == 2)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(4)
    assert items_said(fleet, 0) == [uid]
    assert fleet.holders(uid) == [0, 1]
    assert fleet.n_open == 0


# Priorities ---------------------------------------------------------------------------------------


def test_the_more_urgent_goes_first_when_not_all_fits():
    """13 B are 104 bits; 17 are head and end, and for an item of one fact more than 44 of the rest are counted."""
    fleet = ManagerFleet(2, payload_bytes=13, codec=one_size_codec(2))
    fleet.maps(0, cell=1)
    fleet.maps(0, cell=2)
    (assignment,) = fleet.observe(0, (1, PLAYS_ROLE, role(2)))
    assert fleet.pass_slot().items == (assignment,)


def deaf_peer(payload_bytes: int, n_nodes: int = 2) -> ManagerFleet:
    """The last node is heard, but hears nobody: what it needs never settles."""
    last = n_nodes - 1
    return ManagerFleet(
        n_nodes,
        payload_bytes=payload_bytes,
        lost=lambda slot, sender, receiver: receiver == last,
        codec=one_size_codec(n_nodes),
    )


def test_the_urgent_cannot_starve_the_rest():
    """One item of each fits. Priority 50 is said slot after slot and begins at 0 each time, so it always has weight 50;
    that of priority 1 has weight k in the k-th own slot. It is the heavier in the 51st, and every 51st from there."""
    fleet = deaf_peer(payload_bytes=13)
    (urgent,) = fleet.observe(0, (1, PLAYS_ROLE, role(2)))
    patient = fleet.maps(0, cell=1)
    fleet.pass_frames(102)
    said = items_said(fleet, 0)
    assert [number for number, uid in enumerate(said, 1) if uid == patient] == [51, 102]
    assert said.count(urgent) == 100


def test_equals_take_turns():
    """Ten cells, one to a packet: each of them once in ten own slots."""
    fleet = deaf_peer(payload_bytes=13)
    uids = [fleet.maps(0, cell) for cell in range(10)]
    fleet.pass_frames(30)
    said = items_said(fleet, 0)
    assert [sorted(said[frame : frame + 10]) for frame in (0, 10, 20)] == [sorted(uids)] * 3


def test_a_packet_holds_as_many_items_as_fit():
    """40 cells fit into 2048 B; a peer that is silent keeps all of them open."""
    fleet = deaf_peer(payload_bytes=2048, n_nodes=3)
    uids = [fleet.maps(0, cell) for cell in range(40)]
    assert fleet.pass_slot().items == tuple(uids)
    fleet.pass_frames(4)
    assert set(items_said(fleet, 0)) == set(uids)
    assert all(fleet.managers[1].holds(uid) for uid in uids)


# Status -------------------------------------------------------------------------------------------


def test_only_the_newest_status_is_said_once_and_never_acknowledged():
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


def test_a_lost_status_is_not_repeated_but_the_next_one_is_said():
    fleet = ManagerFleet(2, lost=lambda slot, sender, receiver: slot == 0)
    fleet.observe(0, (0, POSITION, (1.0, 0.0)))
    fleet.pass_frames(2)
    assert fleet.models[1].value(0, POSITION) is None
    fleet.observe(0, (0, POSITION, (2.0, 0.0)))
    fleet.pass_slot()
    assert fleet.models[1].value(0, POSITION) == (2.0, 0.0)


def test_statuses_of_different_attributes_do_not_replace_each_other():
    fleet = ManagerFleet(2)
    fleet.observe(0, (0, POSITION, (1.0, 0.0)))
    fleet.observe(0, (0, BATTERY, 0.5))
    fleet.pass_slot()
    assert fleet.models[1].value(0, POSITION) == (1.0, 0.0)
    assert fleet.models[1].value(0, BATTERY) == 0.5


def test_a_block_that_is_status_only_in_part_is_an_item():
    fleet = ManagerFleet(2)
    (uid,) = fleet.observe(0, (0, POSITION, (1.0, 0.0)), (bay(2), AREA_DONE, 0))
    assert fleet.pass_slot().items == (uid,)


# Signals ------------------------------------------------------------------------------------------


def test_signals_are_said_once_and_the_last_call_counts():
    fleet = ManagerFleet(3)
    fleet.managers[0].offer_signals([InfluenceSignal(role(3), 5)])
    fleet.managers[0].offer_signals([InfluenceSignal(role(3), -40), InfluenceSignal(bay(3), 127)])
    fleet.pass_frames(2)
    expected = [(InfluenceSignal(role(3), -40), InfluenceSignal(bay(3), 127)), ()]
    for peer in (1, 2):
        assert [reception.signals for reception in fleet.heard[peer] if reception.sender == 0] == expected


def test_lost_signals_are_gone():
    fleet = ManagerFleet(2, lost=lambda slot, sender, receiver: slot == 0)
    fleet.managers[0].offer_signals([InfluenceSignal(role(2), 5)])
    fleet.pass_frames(3)
    assert all(reception.signals == () for reception in fleet.heard[1])


def test_of_many_roles_each_has_its_say_before_long():
    """40 roles, at most 15 signals in a packet: after three own slots all have been heard."""
    fleet = ManagerFleet(2, payload_bytes=512)
    signals = [InfluenceSignal(number % 6, number) for number in range(40)]
    for _ in range(3):
        fleet.managers[0].offer_signals(signals)
        fleet.pass_frames(1)
    assert {signal.value for reception in fleet.heard[1] for signal in reception.signals} == set(range(40))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(2, 8),
    st.sampled_from(sorted(POLICIES)),
    st.integers(20, 64),
    st.integers(0, 20),
    st.lists(st.integers(1, 12), max_size=8),
)
def test_a_packet_never_exceeds_its_room(
    n_nodes: int, policy: str, payload_bytes: int, n_signals: int, n_cells: list[int]
):
    """Whatever is offered: blocks of any length, statuses, and signals of any number."""
    try:
        fleet = ManagerFleet(n_nodes, policy, payload_bytes)
    except ConfigurationError:
        return  # the header alone is too large; see below
    for n in n_cells:
        try:
            fleet.observe(0, *((bay(n_nodes), MAPPED_CELL, float(cell)) for cell in range(n)))
        except ConfigurationError:
            continue  # a fact that fits no packet is refused when it is offered
    for _ in range(3):
        fleet.observe(0, (0, POSITION, (1.0, 1.0)))
        fleet.managers[0].offer_signals([InfluenceSignal(0, 1)] * n_signals)
        fleet.pass_frames(1)
    assert all(len(sent.data) <= payload_bytes for sent in fleet.said)
    assert all(sent.size_bits == 8 * len(sent.data) for sent in fleet.said)


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 6), st.integers(20, 64), st.integers(0, 6), st.integers(1, 14))
def test_what_has_been_accepted_gets_through_beside_the_signals(
    n_nodes: int, payload_bytes: int, n_signals: int, n_cells: int
):
    """A block is cut to what is left when the vehicle signals in every slot, as vehicles do."""
    fleet = ManagerFleet(n_nodes, payload_bytes=payload_bytes)
    try:
        uids = fleet.observe(0, *((bay(n_nodes), MAPPED_CELL, float(cell)) for cell in range(n_cells)))
    except ConfigurationError:
        return
    for _ in range(len(uids) + 1):
        fleet.managers[0].offer_signals([InfluenceSignal(0, 1)] * n_signals)
        fleet.pass_frames(1)
    assert all(fleet.holders(uid) == list(range(n_nodes)) for uid in uids)
    assert len(fleet.models[1].history(bay(n_nodes), MAPPED_CELL)) == n_cells


# Blocks -------------------------------------------------------------------------------------------


def test_a_block_in_parts_goes_in_whole_when_its_last_part_is_there():
    """Twelve cells in 32 B packets of which the first is lost: it is said again, and nothing goes in before."""
    fleet = ManagerFleet(2, payload_bytes=32, lost=lambda slot, sender, receiver: slot == 0)
    uids = fleet.observe(0, *((bay(2), MAPPED_CELL, float(cell)) for cell in range(12)))
    assert len(uids) > 1
    for _ in range(2 * len(uids) + 2):
        before = fleet.models[1].history(bay(2), MAPPED_CELL)
        fleet.pass_slot()
        after = fleet.models[1].history(bay(2), MAPPED_CELL)
        assert len(before) in (0, 12)
        assert len(after) in (0, 12)
    assert len(fleet.models[1].history(bay(2), MAPPED_CELL)) == 12
    assert fleet.n_open == 0


def test_a_part_repeated_after_its_block_is_whole_does_no_harm():
    """Node 1's acknowledgements are lost for long, so all parts are said again and again."""
    fleet = ManagerFleet(2, payload_bytes=32, lost=lambda slot, sender, receiver: sender == 1 and slot < 40)
    uids = fleet.observe(0, *((bay(2), MAPPED_CELL, float(cell)) for cell in range(12)))
    fleet.pass_frames(25)
    assert len(items_said(fleet, 0)) > 3 * len(uids)
    assert sum(len(reception.blocks) for reception in fleet.heard[1]) == 1
    assert [manager.n_faults for manager in fleet.managers] == [0, 0]
    assert fleet.n_open == 0


# Bad packets --------------------------------------------------------------------------------------


def packet_of(fleet: ManagerFleet, sender: int, *fragments: Fragment) -> bytes:
    return fleet.codec.encode(sender, [0] * fleet.n_nodes, fragments, slot_start_s=fleet.schedule.start_s(sender))


def test_a_bad_packet_is_counted_and_told_and_changes_nothing():
    fleet = ManagerFleet(3)
    uid = fleet.maps(0, cell=7)
    good = fleet.managers[0].packet_to_send(0.0).data
    for bad in (b"", b"\xff" * 9, good[:-1], bytes([good[0] ^ 1]) + good[1:], good + b"\0"):
        reception = fleet.managers[1].receive(bad, 1.0)
        assert reception.fault
        assert (reception.blocks, reception.items, reception.beliefs, reception.signals) == ((), (), (), ())
    assert fleet.managers[1].n_faults == 5
    assert not fleet.managers[1].holds(uid)
    assert fleet.managers[1].receive(good, 1.0).items == (uid,)
    assert fleet.managers[1].n_faults == 5


@pytest.mark.parametrize(("late_s", "is_heard"), [(0.1, True), (1.0, True), (1.1, False), (2.1, False)])
def test_a_packet_that_arrives_later_than_clocks_can_differ_is_refused(late_s: float, is_heard: bool):
    """Slot 0 of node 0 ends at 2 s; its packet names it, and clocks may differ by 1 s."""
    fleet = ManagerFleet(3)
    uid = fleet.maps(0, cell=7)
    late = fleet.managers[2].receive(fleet.managers[0].packet_to_send(0.0).data, fleet.schedule.start_s(1) + late_s)
    assert late.slot == 0
    assert (late.fault is None) == is_heard == fleet.managers[2].holds(uid)
    assert is_heard or str(late.fault).startswith("a packet of node 0 of slot 0 arrives in slot")


@pytest.mark.parametrize("policy", sorted(POLICIES))
@pytest.mark.parametrize("later_frames", range(1, 12))
def test_a_packet_played_again_in_a_later_frame_is_refused(policy: str, later_frames: int):
    """In its sender's slot of that frame, which is silent: nothing is learned of it by anybody."""
    fleet = ManagerFleet(3, policy, lost=lambda slot, sender, receiver: receiver == 2)
    fleet.maps(0, cell=7)
    old = fleet.pass_slot().data
    fleet.slot = 3 * later_frames
    again = fleet.deliver(2, old, fleet.now_s + 1.0)
    assert again.fault
    assert (again.items, again.beliefs) == ((), ())


def test_an_echo_of_the_own_packet_is_refused():
    """The surface returns it within the own slot; its acknowledgements are about nobody else."""
    fleet = ManagerFleet(3)
    fleet.maps(0, cell=7)
    echo = fleet.managers[0].receive(fleet.managers[0].packet_to_send(0.0).data, 1.5)
    assert echo.fault


def test_the_exchange_goes_on_through_noise():
    """After every packet each vehicle also hears 40 bytes of noise; four frames before have shown whom it hears."""
    generator = random.Random(4)
    fleet = ManagerFleet(3, "m-ack-repeat")
    fleet.pass_frames(4)
    uids = [fleet.maps(node, node) for node in range(3)]
    for _ in range(12):
        now_s = fleet.now_s
        fleet.pass_slot()
        for manager in fleet.managers:
            assert manager.receive(generator.randbytes(40), now_s + 1.1).fault
    assert all(fleet.holders(uid) == [0, 1, 2] for uid in uids)
    assert fleet.n_open == 0
    assert not fleet.false_beliefs
    assert [manager.n_faults for manager in fleet.managers] == [12, 12, 12]


def test_a_flipped_bit_never_stops_a_receiver():
    """6 instances in 3 bits leave the names 6 and 7 free: a single flipped bit makes one of them."""
    data = packet_of(ManagerFleet(2), 0, Fragment(0, 0, 0.0, cells(2, 2)), Fragment(0, 1, 0.0, cells(2, 1), 1, 2))
    word = int.from_bytes(data, "big")
    for bit in range(8 * len(data)):
        fleet = ManagerFleet(2)
        fleet.managers[1].receive((word ^ 1 << bit).to_bytes(len(data), "big"), 1.0)


def test_parts_that_disagree_never_stop_a_receiver():
    fleet = ManagerFleet(2)
    fleet.managers[1].receive(packet_of(fleet, 0, Fragment(0, 0, 0.0, cells(2, 1), 2, 3)), 1.0)
    fleet.managers[1].receive(packet_of(fleet, 0, Fragment(0, 0, 0.0, cells(2, 1), 0, 2)), 1.0)


def test_a_symbol_that_is_none_never_stops_a_receiver():
    """Three symbols take two bits; the fourth index means nothing. The bits are those of index 2, the lowest set,
    before 14 of sequence and 3 of the end."""
    kinds = (
        *TBOX.attributes,
        Attribute(len(TBOX.attributes), "tide", "urn:tide", 0, ValueKind.SYMBOL, symbols=("ebb", "slack", "flood")),
    )
    tbox = TBox(TBOX.classes, kinds)
    named = tuple(Instance(uid, 0, f"thing {uid}") for uid in range(4))
    codec = Codec(tbox, 4, 2, POLICIES["ack"], N_BLOCKS, DURATION_S)
    receiver = ExchangeManager(
        1,
        WorldModel(tbox, 1, named, n_origins=2, run_time_instances_per_origin=0),
        codec,
        TdmaSchedule(2, 1.0, 1.0),
        POLICIES["ack"],
        512,
        NeedsIndex(tbox, {}),
    )
    packing = codec.packing(0, 0, 0.0, 100)
    flood = Fragment(0, 0, 0.0, (PropertyValue(0, kinds[-1].uid, 2),))
    assert packing.add(flood)
    size_bits = codec.overhead_bits + 100 - packing.left_bits
    word = int.from_bytes(codec.encode(0, [0, 0], [flood]), "big")
    damaged = word | 1 << -size_bits % 8 + 3 + 14
    assert "tide: 3 of 3" in str(receiver.receive(damaged.to_bytes(-(-size_bits // 8), "big"), 0.5).fault)


# Slots --------------------------------------------------------------------------------------------


def test_speaking_in_a_foreign_slot_is_a_mistake_of_the_caller():
    fleet = ManagerFleet(3)
    with pytest.raises(ConfigurationError, match=r"slot 1 at 2\.0 s belongs to node 1, not to node 0"):
        fleet.managers[0].packet_to_send(2.0)


def test_a_policy_whose_header_fills_the_packet_is_refused_with_the_numbers():
    """20 nodes: the matrix alone has 380 bits, a 32 B packet 256."""
    with pytest.raises(ConfigurationError, match=r"256 bits.*m-ack needs for 20 nodes"):
        ManagerFleet(20, "m-ack", payload_bytes=32)


# Any loss, any policy -----------------------------------------------------------------------------


def random_fleet(
    seed: int, n_nodes: int, policy: str, carrier_evidence: bool, p_loss: float
) -> tuple[ManagerFleet, list[ItemUid]]:
    """A fleet on links that each lose with a probability of their own, up to ``p_loss``, and items all along."""
    generator = random.Random(seed)
    per = [[generator.uniform(0.0, p_loss) for _ in range(n_nodes)] for _ in range(n_nodes)]
    fleet = ManagerFleet(
        n_nodes,
        policy,
        payload_bytes=generator.choice([32, 64]),
        carrier_evidence=carrier_evidence,
        lost=lambda slot, sender, receiver: generator.random() < per[sender][receiver],
    )
    uids: list[ItemUid] = []
    for _ in range(6 * n_nodes):
        node = generator.randrange(n_nodes)
        n_cells = generator.choice([0, 0, 1, 1, 2, 9])
        if n_cells:
            uids += fleet.observe(
                node, *((bay(n_nodes), MAPPED_CELL, generator.randrange(4096)) for _ in range(n_cells))
            )
        fleet.observe(node, (node, POSITION, (1.0, 2.0)))
        fleet.managers[node].offer_signals([InfluenceSignal(role(n_nodes), -7)])
        fleet.pass_slot()
    return fleet, uids


EVERY_POLICY = [(policy, evidence) for policy in sorted(POLICIES) for evidence in (False, True)]


@pytest.mark.parametrize(("policy", "carrier_evidence"), EVERY_POLICY)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32), n_nodes=st.integers(2, 6), p_loss=st.floats(0.0, 1.0))
def test_nobody_ever_believes_what_is_not_so(
    policy: str, carrier_evidence: bool, seed: int, n_nodes: int, p_loss: float
):
    fleet, uids = random_fleet(seed, n_nodes, policy, carrier_evidence, p_loss)
    assert not fleet.false_beliefs
    for node, manager in enumerate(fleet.managers):
        for uid in uids:
            believed = [peer for peer in range(n_nodes) if peer != node and manager.believes(peer, uid)]
            assert set(believed) <= set(fleet.holders(uid))


@pytest.mark.parametrize(("policy", "carrier_evidence"), EVERY_POLICY)
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**32), n_nodes=st.integers(2, 5), p_loss=st.floats(0.0, 0.6))
def test_where_packets_get_through_everything_does_and_the_fleet_falls_silent(
    policy: str, carrier_evidence: bool, seed: int, n_nodes: int, p_loss: float
):
    """A frame delivers and confirms with 0.4 * 0.4 at worst. 54 items at most, four to a packet, are rid of in far less
    than 1500 frames: that one of them is still open then has a chance below 1e-9."""
    fleet, uids = random_fleet(seed, n_nodes, policy, carrier_evidence, p_loss)
    for _ in range(1500):
        if fleet.n_open == 0:
            break
        fleet.pass_frames(1)
    assert fleet.n_open == 0
    assert all(fleet.holders(uid) == list(range(n_nodes)) for uid in uids)
    known = [model.history(bay(n_nodes), MAPPED_CELL) for model in fleet.models]
    assert all(history == known[0] for history in known)
    assert not fleet.false_beliefs
