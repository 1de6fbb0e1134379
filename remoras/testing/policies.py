"""Requirements on exchange policies and value rules, as checks that raise ``AssertionError``.

A policy by its name: ``python -m remoras.testing policy package.module:object``; from a test ``check``.
A value rule from a test: ``check_value``.
"""

import dataclasses
import math
import random
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import pairwise
from random import Random

import numpy as np

from exchange import ack
from exchange.errors import ConfigurationError
from exchange.manager import ExchangeManager, Options
from exchange.packets import Fragment, ItemUid, Reception, Transmission
from exchange.policies import POLICIES, AckPolicy, header_bits, may_send, policy_fault, policy_named
from exchange.schedule import TdmaSchedule
from exchange.study import montecarlo, stating, trial
from exchange.study.compiler import as_python, slot_loops
from exchange.study.parts import TrialPlan, memory_of, play
from exchange.study.trial import Load, PolicyRules
from exchange.values import Moment, QueuePlace, ValueRule, Waiting
from exchange.wire.codec import Codec
from exchange.wire.fragmentcodec import Packing
from missions.mapping import MappingMission
from remoras.plugins import named_object
from worldmodel import (
    Block,
    InformationNeed,
    Instance,
    Needs,
    NeedsIndex,
    PropertyValue,
    Terms,
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


SIZES = (2, 3, 5)
"""Fleets that are looked at."""
N_EXCHANGES = 12
N_SLOTS = 90
P_HEARD = 0.5
SETTLING_FRAMES = 8
"""Frames, times the period of the header, in which an item is settled where nothing is lost; the paper's need 2."""
ALL = -1
NUMBER_BITS = (N_BLOCKS - 1).bit_length()
"""Bits of the number of an item, where policies state holdings."""


class Nodes:
    """Nodes as vehicles run them, without bits on the wire: item sets are integers, new items come in any slot.

    Bits that a header does not carry arrive as ``noise`` says: as zeros or as ones. No policy may read them.
    """

    def __init__(self, policy: AckPolicy, n_nodes: int, carrier_evidence: bool, noise: int) -> None:
        self.policy, self.n_nodes, self.carrier_evidence, self.noise = policy, n_nodes, carrier_evidence, noise
        self.states = [ack.new_state(n_nodes) for _ in range(n_nodes)]
        self.origins = [0] * n_nodes
        self.n_items = 0

    def add_item(self, node: int) -> None:
        """Give the node an item of its own."""
        self.origins[node] |= 1 << self.n_items
        self.states[node].believes[node] |= 1 << self.n_items
        self.n_items += 1

    def wanted(self, node: int) -> int:
        """Items that the node goes on sending."""
        state = self.states[node]
        open_items = state.believes[node] & ~ack.settled(state, self.n_nodes, None, 0)
        return may_send(self.policy.repeat, open_items, self.origins[node])

    def play(self, slot: int, heard_by: int) -> None:
        """One slot; bit i of ``heard_by`` says that node i receives the packet."""
        kind, n_nodes = self.policy.acknowledgement, self.n_nodes
        frame, owner = slot // n_nodes, slot % n_nodes
        for state in self.states:
            ack.open_slot(kind, state, n_nodes, owner)
        content = (self.wanted(owner),)
        rows = [0] * n_nodes
        ack.compose(kind, self.states[owner], n_nodes, frame, owner, content, rows)
        carried = [self._carried(frame, owner, row) for row in range(n_nodes)]
        heard = [bits & mask | self.noise & ~mask for bits, mask in zip(rows, carried, strict=True)]
        for node in range(n_nodes):
            if node != owner and heard_by >> node & 1:
                state = self.states[node]
                ack.absorb(
                    kind, self.carrier_evidence, state, n_nodes, frame, node, owner, heard, content, self.origins
                )

    def _carried(self, frame: int, owner: int, row: int) -> int:
        kind = self.policy.acknowledgement
        phase = frame % kind.period_frames
        diagonal = 1 << row  # is always zero
        columns = (j for j in range(self.n_nodes) if j != row)
        return diagonal | sum(1 << j for j in columns if kind.carries(self.n_nodes, phase, owner, row, j))

    def beliefs(self) -> list[list[int]]:
        """Item sets by node and peer."""
        return [[state.believes[peer] for peer in range(self.n_nodes)] for state in self.states]

    def false_belief(self) -> str | None:
        """A belief that does not hold, in words."""
        for node, state in enumerate(self.states):
            for peer in range(self.n_nodes):
                if false := state.believes[peer] & ~self.states[peer].believes[peer]:
                    item = false.bit_length() - 1
                    return f"node {node} believes that node {peer} holds item {item}, which it lacks"
        return None


def exchanges(n_nodes: int) -> Iterator[list[tuple[int, int | None]]]:
    """Who hears each slot, and who gets a new item in it: dense ones, sparse ones, and a single item."""
    for seed in range(N_EXCHANGES):
        dice = Random(f"{seed} {n_nodes}")
        p_item = (0.3, 0.05, 0.0)[seed % 3]
        yield [
            (
                sum(1 << node for node in range(n_nodes) if dice.random() < P_HEARD),
                dice.randrange(n_nodes) if slot == 0 or dice.random() < p_item else None,
            )
            for slot in range(N_SLOTS)
        ]


# What it says of itself ---------------------------------------------------------------------------


def check_value(policy: AckPolicy) -> None:
    """It is an ``AckPolicy`` with all parts, of the right kinds."""
    fault = policy_fault(policy)
    assert fault is None, fault


def check_header_bits(policy: AckPolicy) -> None:
    """Headers are as long as promised, on paper and on the wire, and bits that are not carried are not read."""
    kind = policy.acknowledgement
    for n_nodes in SIZES:
        codec = Codec(TBOX, len(instances(n_nodes)), n_nodes, policy, N_BLOCKS, DURATION_S)
        for frame in range(2 * kind.period_frames):
            for sender in range(n_nodes):
                promised = header_bits(policy, n_nodes, frame, sender)
                where = f"header of node {sender} of {n_nodes} in frame {frame}"
                assert header_bits(policy, n_nodes) >= promised, f"{where} is larger than the largest"
                repeated = header_bits(policy, n_nodes, frame + kind.period_frames, sender)
                assert repeated == promised, f"{where} does not repeat after period_frames = {kind.period_frames}"
                size_bits = codec.overhead_bits - codec.header.largest_bits + promised
                sent = len(codec.encode(sender, [ALL] * n_nodes, [], (), frame))
                assert sent == -(-size_bits // 8), f"{where} takes another number of bits on the wire than promised"
        for exchange in exchanges(n_nodes):
            clean, noisy = Nodes(policy, n_nodes, False, 0), Nodes(policy, n_nodes, False, (1 << n_nodes) - 1)
            for slot, (heard_by, birth) in enumerate(exchange):
                for nodes in (clean, noisy):
                    if birth is not None:
                        nodes.add_item(birth)
                    nodes.play(slot, heard_by)
                assert clean.beliefs() == noisy.beliefs(), "reads bits that its header does not carry"


# What its vehicles believe ------------------------------------------------------------------------


def check_no_false_beliefs(policy: AckPolicy) -> None:
    """Whatever is lost, nobody ever believes that a peer holds an item which it lacks."""
    for n_nodes in SIZES:
        for carrier_evidence in (False, True):
            for exchange in exchanges(n_nodes):
                nodes = Nodes(policy, n_nodes, carrier_evidence, 0)
                for slot, (heard_by, birth) in enumerate(exchange):
                    if birth is not None:
                        nodes.add_item(birth)
                    nodes.play(slot, heard_by)
                    false = nodes.false_belief()
                    assert false is None, f"slot {slot}: {false}"


def check_settles(policy: AckPolicy) -> None:
    """Where nothing is lost, the origin soon knows that all hold its item, and stops sending it."""
    n_frames = SETTLING_FRAMES * policy.acknowledgement.period_frames
    for n_nodes in SIZES:
        nodes = Nodes(policy, n_nodes, False, 0)
        nodes.add_item(0)
        for slot in range(n_frames * n_nodes):
            nodes.play(slot, ALL)
        assert not nodes.wanted(0), f"{n_nodes} nodes, no losses: the item is still sent after {n_frames} frames"


def check_deterministic(policy: AckPolicy) -> None:
    """The same packets make the same beliefs."""
    exchange = next(exchanges(SIZES[-1]))
    seen = []
    for _ in range(2):
        nodes = Nodes(policy, SIZES[-1], False, 0)
        for slot, (heard_by, birth) in enumerate(exchange):
            if birth is not None:
                nodes.add_item(birth)
            nodes.play(slot, heard_by)
            seen.append(nodes.beliefs())
    assert seen[: len(exchange)] == seen[len(exchange) :], "the same packets make other beliefs the second time"


# What the study makes of it -----------------------------------------------------------------------


class ReferenceStudy:
    """The slot loop of the study, uncompiled, one slot at a time."""

    def __init__(
        self, policy: AckPolicy, n_nodes: int, items: int, evidence: bool, item_bits: int, room: int, of_symbol: int = 0
    ) -> None:
        self.kind = policy.acknowledgement
        n_words = -(-n_nodes * items // trial.WORD_BITS)
        self.rules = PolicyRules(policy.repeat, evidence, n_nodes, n_words, codes=self.kind.codes)
        capacity_bits = room + header_bits(policy, n_nodes)
        self.load = Load(n_nodes, items, 0.0, item_bits, capacity_bits, 0, 0, N_SLOTS, 1.0, NUMBER_BITS, of_symbol)
        self.nodes = trial.new_nodes(self.rules, self.load, self.kind.period_frames)
        montecarlo.header_sizes(self.kind, n_nodes, self.nodes.header_bits)
        trial.clear(self.nodes)
        for column in range(n_nodes * items):
            trial.add_item(self.rules, self.nodes, column // items, column, 0)
        self.statements = stating.new_statements(self.rules, n_nodes * items)
        self.plan = stating.new_plan(n_nodes, n_nodes * items)
        stating.forget_all(self.statements)
        for column in range(n_nodes * items):
            stating.number_item(self.rules, self.statements, column // items, column)

    def pass_slot(self, slot: int, heard_by: int) -> int:
        """Play a slot; returns how many items were sent."""
        if self.kind.states:
            state = self.nodes, self.statements, self.plan
            stating.play_stating_slot(self.kind, self.rules, self.load, *state, slot, heard_by)
        else:
            montecarlo.play_slot(self.kind, self.rules, self.load, self.nodes, slot, heard_by)
        return sum(int(word).bit_count() for word in self.nodes.packet)

    def believes(self, node: int, peer: int, column: int) -> bool:
        """True if the node believes that the peer holds the item."""
        word = self.nodes.believes[node, peer * self.rules.n_words + column // trial.WORD_BITS]
        return bool(word >> column % trial.WORD_BITS & 1)


def one_size_fleet(
    policy: AckPolicy, n_nodes: int, payload_bytes: int, evidence: bool, lost: Callable[[int, int, int], bool]
) -> ManagerFleet:
    """Vehicles that count one size for each item, own or relayed."""
    codec = one_size_codec(n_nodes, policy)
    fleet = ManagerFleet(n_nodes, policy, payload_bytes, evidence, lost=lost, codec=codec)
    for manager in fleet.managers:
        manager.do_without_extras()
    return fleet


def item_bits(fleet: ManagerFleet) -> int:
    """Bits that are counted for an observation of one cell."""
    return fleet.codec.fragment_bits(Fragment(0, 0, 0.0, (PropertyValue(fleet.n_nodes, MAPPED_CELL, 0.0),)))


def symbol_bits(fleet: ManagerFleet) -> int:
    """Bits of such an observation in a symbol, where the policy codes repairs."""
    block = Block(0, 0, 0.0, (PropertyValue(fleet.n_nodes, MAPPED_CELL, 0.0),))
    return sum(8 * len(accounts.block_bytes(block)) for accounts in fleet.codec.accounts)


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


def check_study_is_managers(policy: AckPolicy) -> None:
    """Vehicles with real packets and the policy study come to the same beliefs after every slot."""
    n_played = 0
    for seed in range(N_EXCHANGES):
        dice = Random(seed)
        n_nodes = SIZES[seed % len(SIZES)]
        heard = [dice.randrange(1 << n_nodes) for _ in range(8 * n_nodes)]
        n_played += assert_study_is_managers(policy, n_nodes, 1 + seed % 3, seed % 2 == 0, 64, heard)
    assert n_played, f"no fleet of {SIZES[0]} to {SIZES[-1]} nodes has room for its header in 64 bytes"


def check_compiles(policy: AckPolicy) -> None:
    """Compiled for the study, its functions do what they do as Python; takes some seconds the first time."""
    for n_sources, items in ((4, 3), (4, 20), (1, 1)):
        load = Load(n_sources, items, 0.0, 57, 57 * 2 + header_bits(policy, 4), 0, 0, 300)
        p_loss = np.full((4, 4), 0.5)
        np.fill_diagonal(p_loss, 1.0)
        plan = TrialPlan(4, (policy,), False, (p_loss,), load, 7, 2 if items > 1 else 70)
        loops = as_python(policy.acknowledgement), slot_loops(plan.forms, print)[policy.acknowledgement]
        part = next(plan.parts)
        interpreted, compiled = (play(plan, policy, loop, part, memory_of(plan, loop, part)) for loop in loops)
        assert (interpreted == compiled).all(), "the compiled form comes to other results than the functions as Python"


# All of it ----------------------------------------------------------------------------------------

CHECKS: tuple[Callable[[AckPolicy], None], ...] = (
    check_value,
    check_header_bits,
    check_no_false_beliefs,
    check_settles,
    check_deterministic,
    check_study_is_managers,
    check_compiles,
)


def check(policy: AckPolicy) -> None:
    """Make every check of a policy; raises AssertionError with what is wrong."""
    for check_one in CHECKS:
        check_one(policy)


def conforms(name: str) -> Iterator[str]:
    """Make every check of the policy that a scenario names so; yields the name of each that was passed."""
    policy = named_object(name) if ":" in name else policy_named(name)
    for check_one in CHECKS:
        check_one(policy)
        yield check_one.__name__


FRAME_S = 20.0
N_CANDIDATES = 60
N_LATER = 12


def candidates(draw: random.Random, moment: Moment) -> list[Waiting]:
    """Candidates as queues have them, all taken by then."""
    found = []
    for _ in range(N_CANDIDATES):
        slots_ago = draw.randrange(40)
        since_s = max(0.0, moment.now_s - FRAME_S * slots_ago - draw.choice([0.0, 3.7]))
        found.append(
            Waiting(
                priority=draw.choice([1, 1, 3, 10, 50, 1000]),
                observed_s=max(0.0, since_s - draw.choice([0.0, 0.5, 400.0])),
                since_s=since_s,
                since_slot=max(0, moment.n_slots - slots_ago),
                credit=draw.choice([0, 0, 7, 300]),
                n_said=draw.choice([0, 0, 1, 2, 30]),
                terms=Terms(draw.choice([math.inf, 30.0, 900.0])),
            )
        )
    return found


def check_value_rule(rule: ValueRule, seed: int = 1) -> None:
    """Hold a rule against the seam: names, finite values that are the same again, and an order that lasts."""
    assert isinstance(rule.name, str), f"name is {rule.name!r}, not a text"
    assert rule.name, "name is empty"
    draw = random.Random(seed)
    moment = Moment(2000.0, 100)
    waiting = candidates(draw, moment)
    for one in waiting:
        before = dataclasses.replace(one)
        place, value = rule.place(one), rule.value(one, moment)
        assert one == before, f"it changes what it is asked about: {before} is {one}"
        assert isinstance(value, int | float), f"value gives {value!r}, not a number, for {before}"
        assert math.isfinite(value), f"value gives {value!r}, not a finite number, for {before}"
        assert (rule.place(one), rule.value(one, moment)) == (place, value), f"another answer the second time: {before}"
        assert place is None or isinstance(place, QueuePlace), f"place gives {place!r}, neither a Place nor None"
        assert place is None or math.isfinite(place.rank), f"rank {place.rank} of {before}"
    for step in range(N_LATER):
        later = Moment(moment.now_s + FRAME_S * step, moment.n_slots + step)
        _check_order(rule, waiting, later)


def _check_order(rule: ValueRule, waiting: list[Waiting], moment: Moment) -> None:
    """In each group, the higher rank has no lower value at that moment."""
    groups: dict[object, list[tuple[float, float, Waiting]]] = {}
    for one in waiting:
        place = rule.place(one)
        if place is not None:
            groups.setdefault((one.priority, place.group), []).append((place.rank, rule.value(one, moment), one))
    for group, members in groups.items():
        members.sort(key=lambda member: member[0])
        for (_, value, lower), (_, better, higher) in pairwise(members):
            assert value <= better * (1 + 1e-12) + 1e-9, (
                f"group {group} at {moment}: {higher} has the higher rank and the lower value, {better} below {value} "
                f"of {lower}; place has to give None, or other groups"
            )
