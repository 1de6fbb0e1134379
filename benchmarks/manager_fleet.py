"""Managers with real packets, over links that a test scripts, and the study's slot loop beside them."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import get_args

import numpy as np

from exchange.errors import ConfigurationError
from exchange.manager.manager import ExchangeManager, OptionalPart, Options
from exchange.packets import Fragment, ItemUid, Reception, Transmission
from exchange.policy.policies import POLICIES, AckPolicy, header_bits
from exchange.schedule import TdmaSchedule
from exchange.study import trials
from exchange.study.compiler import new_fleet, slot_rule_of
from exchange.study.lanes import Case
from exchange.wire.codec import Codec
from exchange.wire.fragmentcodec import Packing
from missions.mapping import MappingMission
from worldmodel import (
    Block,
    InformationNeed,
    Instance,
    Needs,
    NeedsIndex,
    PropertyValue,
    Value,
    WorldModel,
    core_ontology_paths,
    merge,
    read_tbox,
)

TBOX = read_tbox(*core_ontology_paths(), MappingMission.vocabulary[0])
DURATION_S = 14_400.0
N_BLOCKS = 1 << 14
SLOT_S = 2.0


def attribute(name: str) -> int:
    """Number of the attribute of a name."""
    return TBOX.attribute_named(name).uid


MAPPED_CELL, AREA_DONE, POSITION, BATTERY, PLAYS_ROLE = map(
    attribute, ("mappedCell", "areaDone", "position", "batteryFraction", "playsRole")
)
PRIORITIES = {MAPPED_CELL: 1, AREA_DONE: 10, PLAYS_ROLE: 50, POSITION: 3, BATTERY: 1}


def bay(n_nodes: int) -> int:
    """The uid of the one area: it comes behind the vehicles."""
    return n_nodes


def role(n_nodes: int) -> int:
    """Instance of a role, behind those of the vehicles."""
    return n_nodes + 1


@cache
def instances(n_nodes: int) -> tuple[Instance, ...]:
    """n vehicles, an area, a role, a group, a rally point."""
    named = [("AUV", f"AUV{node:02d}") for node in range(n_nodes)]
    named += [("Area", "bay"), ("Role", "team.explorer"), ("Group", "team"), ("RallyPoint", "buoy")]
    return tuple(Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))


@cache
def codec_of(n_nodes: int, policy: str | AckPolicy = "ack") -> Codec:
    """Codec of so many nodes under a policy."""
    chosen = POLICIES[policy] if isinstance(policy, str) else policy
    return Codec(TBOX, len(instances(n_nodes)), n_nodes, chosen, N_BLOCKS, DURATION_S)


class OneSizePacking(Packing):
    """Room for fragments that all take the most bits that a fragment may take: the study knows one size of an item."""

    def size_bits(self, fragment: Fragment, body_bits: int) -> int:
        """Size of a fragment (bits): the most that any takes."""
        return self._codec.most_bits(fragment, relayed=True)


class OneSizeCodec(Codec):
    """Of packets whose fragments take less than is counted for them."""

    def packing(self, sender: int, epoch: int, slot_start_s: float, room_bits: int) -> Packing:
        """A packet to be filled, in which sizes are the greatest."""
        return OneSizePacking(self.fragments, sender, epoch, slot_start_s, room_bits)


def one_size_codec(n_nodes: int, policy: AckPolicy = POLICIES["ack"]) -> OneSizeCodec:
    """The codec of a fleet whose packets count one size for each fragment."""
    return OneSizeCodec(TBOX, len(instances(n_nodes)), n_nodes, policy, N_BLOCKS, DURATION_S)


def needs(peers: Sequence[int], priorities: dict[int, int] | None = None) -> NeedsIndex:
    """The same needs for every one of ``peers``: {attribute: priority}."""
    wanted = PRIORITIES if priorities is None else priorities
    every = [InformationNeed(a, priority, class_uid=TBOX.attributes[a].domain) for a, priority in wanted.items()]
    return NeedsIndex(TBOX, dict.fromkeys(peers, every))


class ManagerFleet:
    """Managers with their world models, and what each heard; ``lost(slot, sender, receiver)`` scripts the link."""

    def __init__(
        self,
        n_nodes: int,
        policy: str | AckPolicy = "ack",
        payload_bytes: int = 64,
        carrier_evidence: bool = True,
        who_needs: Needs | Sequence[Needs] | None = None,
        lost: Callable[[int, int, int], bool] = lambda slot, sender, receiver: False,
        selective: bool = False,
        codec: Codec | None = None,
    ) -> None:
        self.n_nodes = n_nodes
        self.payload_bytes = payload_bytes
        self.schedule = TdmaSchedule(n_nodes, SLOT_S - 0.5, 0.5)
        self.codec = codec or codec_of(n_nodes, policy)
        self.lost = lost
        self.models = [
            WorldModel(TBOX, node, instances(n_nodes), n_origins=n_nodes, run_time_instances_per_origin=0)
            for node in range(n_nodes)
        ]
        self.managers = [
            ExchangeManager(
                node,
                model,
                self.codec,
                self.schedule,
                POLICIES[policy] if isinstance(policy, str) else policy,
                8 * payload_bytes,
                who_needs[node] if isinstance(who_needs, Sequence) else who_needs or needs(range(n_nodes)),
                Options(carrier_evidence, selective),
            )
            for node, model in enumerate(self.models)
        ]
        self.slot = 0
        self.said: list[Transmission] = []
        self.heard: list[list[Reception]] = [[] for _ in range(n_nodes)]
        self.false_beliefs: list[tuple[int, int, ItemUid]] = []

    @property
    def now_s(self) -> float:
        """When the slot that is next opens (s)."""
        return self.schedule.start_s(self.slot)

    def observe(self, node: int, *facts: tuple[int, int, Value]) -> tuple[ItemUid, ...]:
        """Node records facts of its own and offers them."""
        change = self.models[node].record(facts, self.now_s)
        return tuple(fragment.uid for fragment in self.managers[node].offer([change]))

    def maps(self, node: int, cell: int) -> ItemUid:
        """Node maps a cell of the bay; one block, one item."""
        (uid,) = self.observe(node, (bay(self.n_nodes), MAPPED_CELL, cell))
        return uid

    def pass_slot(self) -> Transmission:
        """One slot: its owner speaks, all who do not lose the packet hear it and merge what it brings."""
        now_s = self.now_s
        sender = self.schedule.owner(self.slot)
        sent = self.managers[sender].packet_to_send(now_s)
        self.said.append(sent)
        for receiver in range(self.n_nodes):
            if receiver != sender and not self.lost(self.slot, sender, receiver):
                self.deliver(receiver, sent.data, now_s + 1.0)
        self.slot += 1
        return sent

    def deliver(self, receiver: int, data: bytes, now_s: float) -> Reception:
        """Let a packet arrive at a node, and note what came of it."""
        reception = self.managers[receiver].receive(data, now_s)
        self.heard[receiver].append(reception)
        merge(self.models[receiver], reception.blocks)
        for peer, uid in reception.beliefs:
            if not self.managers[peer].holds(uid):
                self.false_beliefs.append((receiver, peer, uid))
        return reception

    def pass_frames(self, n: int) -> list[Transmission]:
        """Let so many frames pass; what was sent in them."""
        return [self.pass_slot() for _ in range(n * self.n_nodes)]

    def holders(self, uid: ItemUid) -> list[int]:
        """Nodes that hold an item."""
        return [node for node, manager in enumerate(self.managers) if manager.holds(uid)]

    @property
    def n_open(self) -> int:
        """Items that nodes still have to tell, all together."""
        return sum(manager.n_open for manager in self.managers)


def cells(n_nodes: int, n: int) -> tuple[PropertyValue, ...]:
    """n facts about n cells of the bay."""
    return tuple(PropertyValue(bay(n_nodes), MAPPED_CELL, float(cell)) for cell in range(n))


NUMBER_BITS = (N_BLOCKS - 1).bit_length()
"""Bits of the number of an item, where policies state holdings."""


class ReferenceStudy:
    """The slot loop of the study, uncompiled, one slot at a time, on its first lane."""

    def __init__(
        self, policy: AckPolicy, n_nodes: int, items: int, evidence: bool, item_bits: int, room: int, of_symbol: int = 0
    ) -> None:
        self.kind = policy.acknowledgement
        capacity_bits = room + header_bits(policy, n_nodes)
        self.case = Case(
            n_nodes, policy.repeat, evidence, self.kind.relays, self.kind.infers, self.kind.states, self.kind.codes,
            n_sources=n_nodes, columns_per_source=items, item_bits=item_bits, symbol_bits=of_symbol,
            number_bits=NUMBER_BITS, capacity_bits=capacity_bits,
        )  # fmt: skip
        self.fleet = new_fleet(self.kind, self.case, np.zeros((0, 1), np.int64))
        trials.begin(self.case, self.fleet, 0, 0, 1)
        self.play = slot_rule_of(self.kind)

    def pass_slot(self, slot: int, heard_by: int) -> int:
        """Play a slot; returns how many items were sent."""
        n_nodes = self.case.n_nodes
        now = trials.slot_of(self.fleet.layouts, n_nodes, slot // n_nodes, slot % n_nodes)
        heard = np.array([heard_by >> node & 1 for node in range(n_nodes)])
        self.play(self.kind.header, self.case, self.fleet, now, heard, 1, 1)
        return sum(int(word) & 1 for word in self.fleet.loaded[now.place])

    def believes(self, node: int, peer: int, column: int) -> bool:
        """True if the node believes that the peer holds the item."""
        return bool(self.fleet.holders[node, column, peer] & 1)


def one_size_fleet(
    policy: AckPolicy, n_nodes: int, payload_bytes: int, evidence: bool, lost: Callable[[int, int, int], bool]
) -> ManagerFleet:
    """Vehicles that count one size for each item, own or relayed."""
    codec = one_size_codec(n_nodes, policy)
    fleet = ManagerFleet(n_nodes, policy, payload_bytes, evidence, lost=lost, codec=codec)
    for manager in fleet.managers:
        for part in get_args(OptionalPart):
            manager.leave_out(part)  # what the policy says, and no more
    return fleet


def item_bits(fleet: ManagerFleet) -> int:
    """Bits that are counted for an observation of one cell."""
    return fleet.codec.fragment_bits(Fragment(0, 0, 0.0, (PropertyValue(fleet.n_nodes, MAPPED_CELL, 0.0),)))


def symbol_bits(fleet: ManagerFleet) -> int:
    """Bits of such an observation in a symbol, where the policy codes repairs."""
    block = Block(0, 0, 0.0, (PropertyValue(fleet.n_nodes, MAPPED_CELL, 0.0),))
    return 0 if fleet.codec.accounts is None else 8 * len(fleet.codec.accounts.block_bytes(block))


def assert_study_is_managers(
    policy: AckPolicy, n_nodes: int, items: int, evidence: bool, payload_bytes: int, heard: list[int]
) -> bool:
    """Play an exchange by the study and by managers with real bits; after each slot, beliefs must agree.

    Returns:
        False if the exchange does not suit: the packet has no room for its header and an item.
    """

    def lost(slot: int, sender: int, receiver: int) -> bool:
        return not heard[slot] >> receiver & 1

    try:
        fleet = one_size_fleet(policy, n_nodes, payload_bytes, evidence, lost)
    except ConfigurationError:  # the header does not fit the packet
        return False
    size_bits, room_bits = item_bits(fleet), 8 * payload_bytes - fleet.codec.overhead_bits
    if room_bits < size_bits:
        return False
    study = ReferenceStudy(policy, n_nodes, items, evidence, size_bits, room_bits, symbol_bits(fleet))
    uids = [fleet.maps(node, node * items + index) for node in range(n_nodes) for index in range(items)]
    for slot, heard_by in enumerate(heard):
        sent = fleet.pass_slot()
        n_sent = study.pass_slot(slot, heard_by & ~(1 << slot % n_nodes))
        assert len(sent.items) == n_sent, f"slot {slot}: vehicles send {len(sent.items)} items, the study {n_sent}"
        for node in range(n_nodes):
            for peer in range(n_nodes):
                held = [(column, uid) for column, uid in enumerate(uids) if fleet.managers[node].holds(uid)]
                believed = [uid for _, uid in held if believes(fleet, node, peer, uid)]
                studied = [uid for column, uid in held if study.believes(node, peer, column)]
                assert believed == studied, f"slot {slot}: vehicles and study differ in what {node} believes of {peer}"
    assert not fleet.false_beliefs, f"a vehicle believes what is false: {fleet.false_beliefs[0]}"
    return True


def believes(fleet: ManagerFleet, node: int, peer: int, uid: ItemUid) -> bool:
    """True if the node's manager believes that the peer holds the item; of itself it knows."""
    manager = fleet.managers[node]
    return manager.holds(uid) if node == peer else manager.believes(peer, uid)
