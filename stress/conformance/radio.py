"""A small fleet on the air: its ontology, its managers, and a scripted link between them, slot by slot."""

from collections.abc import Callable, Sequence
from functools import cache

from exchange.manager import ExchangeManager, Options
from exchange.packets import Fragment, ItemUid, Reception, Transmission
from exchange.policies import POLICIES, AckPolicy
from exchange.schedule import TdmaSchedule
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


def block_of_cells(n_nodes: int, n: int, origin: int = 0, sequence: int = 0) -> Block:
    """A block that says of so many cells that they are mapped."""
    return Block(origin, sequence, 1.0, cells(n_nodes, n))
