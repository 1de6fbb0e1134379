"""Conformance checks of exchange policies and value rules, raising ``AssertionError``."""

import dataclasses
import math
import random
from collections.abc import Callable, Iterator
from itertools import pairwise, permutations
from random import Random

import numpy as np

from exchange.policy.acknowledgement import PacketLog, fields, members
from exchange.policy.candidates import Moment, QueuePlace, ValueRule, Waiting
from exchange.policy.policies import AckPolicy, header_bits, policy_fault, policy_named
from exchange.study.compiler import as_python, slot_loops
from exchange.study.parameters import ExchangeStudy, LoadKind, StudyLoad
from exchange.study.study import REMEMBERED_WORDS, case_of, play
from exchange.wire.codec import Codec
from remoras.plugins import named_object
from remoras.testing.behaviours import passed
from worldmodel import Terms, core_ontology_paths, read_tbox

TBOX = read_tbox(*core_ontology_paths())
Exchange = list[tuple[int, int | None]]
"""Per slot: receivers (bit i for node i), and the origin of a new item or None."""
SIZES = (2, 3, 5)
"""Fleet sizes checked."""
N_EXCHANGES = 12
N_SLOTS = 90
P_HEARD = 0.5
SETTLING_FRAMES = 8
"""Frames per header period to settle an item without loss; the paper needs 2."""
ALL = -1


class Node:
    """One node as a vehicle runs it: the log of packets, and the items (set) that it believes each node to hold."""

    def __init__(self, policy: AckPolicy, me: int, n_nodes: int) -> None:
        self.log = PacketLog(policy.acknowledgement, me, n_nodes)
        self.held = [0] * n_nodes


class Nodes:
    """Nodes as vehicles run them, without bits on the wire: new items come in any slot."""

    def __init__(self, policy: AckPolicy, n_nodes: int, carrier_evidence: bool) -> None:
        self.policy, self.n_nodes, self.carrier_evidence = policy, n_nodes, carrier_evidence
        self.nodes = [Node(policy, me, n_nodes) for me in range(n_nodes)]
        self.origins: list[int] = []

    @property
    def n_items(self) -> int:
        """Items so far."""
        return len(self.origins)

    def add_item(self, node: int) -> None:
        """Give the node an item of its own."""
        self.nodes[node].held[node] |= 1 << self.n_items
        self.origins.append(node)

    def wanted(self, node: int) -> list[int]:
        """Items that the node goes on sending."""
        held, everywhere = self.nodes[node].held, -1
        for of_peer in held:
            everywhere &= of_peer
        open_items = members(held[node] & ~everywhere)
        return [column for column in open_items if self.policy.repeat or self.origins[column] == node]

    def play(self, slot: int, heard_by: int) -> None:
        """Simulate one slot; bit i of ``heard_by`` is set if node i receives the packet."""
        n_nodes = self.n_nodes
        owner = slot % n_nodes
        for member in self.nodes:
            member.log.open(slot)
        columns, sender = self.wanted(owner), self.nodes[owner]
        content = sum(1 << column for column in columns)
        acks = sender.log.compose(slot, content, sender.held)
        for node, member in enumerate(self.nodes):
            if node != owner and heard_by >> node & 1:
                for column in columns:
                    for holder in (node, self.origins[column], owner if self.carrier_evidence else node):
                        member.held[holder] |= 1 << column
                member.log.learn(slot, content, acks, ALL, member.held)

    def play_all(self, exchange: Exchange) -> Iterator[list[list[int]]]:
        """Play an exchange; yield the beliefs after each slot."""
        for slot, (heard_by, birth) in enumerate(exchange):
            if birth is not None:
                self.add_item(birth)
            self.play(slot, heard_by)
            yield self.beliefs()

    def beliefs(self) -> list[list[int]]:
        """Believed holders of each item (bit masks), by node."""
        return [
            [sum(1 << peer for peer, held in enumerate(node.held) if held >> item & 1) for item in range(self.n_items)]
            for node in self.nodes
        ]

    def false_belief(self) -> str | None:
        """Describe a false belief of a node about holders; None without one."""
        for node, believer in enumerate(self.nodes):
            for peer, held in enumerate(believer.held):
                if false := held & ~self.nodes[peer].held[peer]:
                    return f"node {node} believes that node {peer} holds item {members(false)[0]}, which it lacks"
        return None


def exchanges(n_nodes: int) -> Iterator[Exchange]:
    """Yield sampled exchanges: with many new items, few, and a single one."""
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


# Declaration --------------------------------------------------------------------------------------


def check_value(policy: AckPolicy) -> None:
    """Check type and parts of the policy."""
    fault = policy_fault(policy)
    assert fault is None, fault


def check_header_bits(policy: AckPolicy) -> None:
    """Headers are as long as promised, on paper and on the wire."""
    kind = policy.acknowledgement
    for n_nodes in SIZES:
        codec = Codec(TBOX, n_nodes, n_nodes, policy, n_items=N_SLOTS, duration_s=N_SLOTS)
        for frame in range(2 * kind.period_frames):
            for sender in range(n_nodes):
                promised = header_bits(policy, n_nodes, frame, sender)
                where = f"header of node {sender} of {n_nodes} in frame {frame}"
                place = n_nodes, frame % kind.period_frames, sender
                pairs = permutations(range(n_nodes), 2)
                carried = {pair for pair in pairs if kind.carries(*place, *pair)}
                again = {field[:2] for field in fields(kind, *place)}
                assert carried == again, f"{where} differs when ``carries`` is asked again"
                assert header_bits(policy, n_nodes) >= promised, f"{where} is larger than the largest"
                repeated = header_bits(policy, n_nodes, frame + kind.period_frames, sender)
                assert repeated == promised, f"{where} does not repeat after period_frames = {kind.period_frames}"
                size_bits = codec.overhead_bits - header_bits(policy, n_nodes) + promised
                sent = len(codec.encode(sender, ALL, [], (), frame))
                assert sent == -(-size_bits // 8), f"{where} takes another number of bits on the wire than promised"


# Beliefs -------------------------------------------------------------------------------------------


def check_no_false_beliefs(policy: AckPolicy) -> None:
    """Check that under losses no node believes that a peer holds an item it lacks."""
    for n_nodes in SIZES:
        for carrier_evidence in (False, True):
            for exchange in exchanges(n_nodes):
                nodes = Nodes(policy, n_nodes, carrier_evidence)
                for slot, _ in enumerate(nodes.play_all(exchange)):
                    false = nodes.false_belief()
                    assert false is None, f"slot {slot}: {false}"


def check_settles(policy: AckPolicy) -> None:
    """Check that without losses the origin soon stops sending its item."""
    n_frames = SETTLING_FRAMES * policy.acknowledgement.period_frames
    for n_nodes in SIZES:
        nodes = Nodes(policy, n_nodes, False)
        nodes.add_item(0)
        for slot in range(n_frames * n_nodes):
            nodes.play(slot, ALL)
        assert not nodes.wanted(0), f"{n_nodes} nodes, no losses: the item is still sent after {n_frames} frames"


def check_deterministic(policy: AckPolicy) -> None:
    """Check that equal packets yield equal beliefs."""
    exchange = next(exchanges(SIZES[-1]))
    first, second = (list(Nodes(policy, SIZES[-1], False).play_all(exchange)) for _ in range(2))
    assert first == second, "the same packets make other beliefs the second time"


# Compilation ---------------------------------------------------------------------------------------


def check_compiles(policy: AckPolicy) -> None:
    """Check that compiled functions equal interpreted ones; takes seconds the first time."""
    kind, capacity_bits = policy.acknowledgement, 57 * 2 + header_bits(policy, 4)
    for load in (StudyLoad(LoadKind.BATCH, 3), StudyLoad(LoadKind.BATCH, 20), StudyLoad()):
        study = ExchangeStudy(
            4, (0.5,), policies=(policy,), trials=2 if load.items > 1 else 70, load=load, item_bits=57,
            capacity_bits=capacity_bits, seed=7, max_slots=300,
        )  # fmt: skip
        case = case_of(study, policy, p_loss=0.5)
        interpreted, compiled = (
            play(loop, kind, case, np.zeros((REMEMBERED_WORDS, study.trials), np.int64))
            for loop in (as_python(kind), slot_loops([kind], print)[kind])
        )
        assert (interpreted == compiled).all(), "the compiled form comes to other results than the functions as Python"


# All checks ---------------------------------------------------------------------------------------

CHECKS: tuple[Callable[[AckPolicy], None], ...] = (
    check_value,
    check_header_bits,
    check_no_false_beliefs,
    check_settles,
    check_deterministic,
    check_compiles,
)


def conforms(name: str) -> Iterator[str]:
    """Run all checks of a named policy and yield their names."""
    return passed(CHECKS, named_object(name) if ":" in name else policy_named(name))


FRAME_S = 20.0
N_CANDIDATES = 60
N_LATER = 12


def candidates(draw: random.Random, moment: Moment) -> list[Waiting]:
    """Return queued candidates, all queued before the moment."""
    waiting = []
    for _ in range(N_CANDIDATES):
        slots_ago = draw.randrange(40)
        since_s = max(0.0, moment.now_s - FRAME_S * slots_ago - draw.choice([0.0, 3.7]))
        waiting.append(
            Waiting(
                priority=draw.choice([1, 1, 3, 10, 50, 1000]),
                observed_s=max(0.0, since_s - draw.choice([0.0, 0.5, 400.0])),
                since_s=since_s,
                since_slot=max(0, moment.n_slots - slots_ago),
                credit=draw.choice([0, 0, 7, 300]),
                n_sent=draw.choice([0, 0, 1, 2, 30]),
                terms=Terms(draw.choice([math.inf, 30.0, 900.0])),
            )
        )
    return waiting


def check_value_rule(rule: ValueRule, seed: int = 1) -> None:
    """Check name, finite deterministic values, and an order that persists over time."""
    assert isinstance(rule.name, str), f"name is {rule.name!r}, not a text"
    assert rule.name, "name is empty"
    draw = random.Random(seed)
    moment = Moment(2000.0, 100)
    waiting = candidates(draw, moment)
    for item in waiting:
        before = dataclasses.replace(item)
        place, value = rule.place(item), rule.value(item, moment)
        assert item == before, f"it changes what it is asked about: {before} is {item}"
        assert isinstance(value, int | float), f"value gives {value!r}, not a number, for {before}"
        assert math.isfinite(value), f"value gives {value!r}, not a finite number, for {before}"
        assert (rule.place(item), rule.value(item, moment)) == (place, value), (
            f"another answer the second time: {before}"
        )
        assert place is None or isinstance(place, QueuePlace), f"place gives {place!r}, neither a Place nor None"
        assert place is None or math.isfinite(place.rank), f"rank {place.rank} of {before}"
    for step in range(N_LATER):
        later = Moment(moment.now_s + FRAME_S * step, moment.n_slots + step)
        _check_order(rule, waiting, later)


def _check_order(rule: ValueRule, waiting: list[Waiting], moment: Moment) -> None:
    """Check that a higher rank never has a lower value within a group."""
    groups: dict[object, list[tuple[float, float, Waiting]]] = {}
    for item in waiting:
        place = rule.place(item)
        if place is not None:
            groups.setdefault((item.priority, place.group), []).append((place.rank, rule.value(item, moment), item))
    for group, ranked in groups.items():
        ranked.sort(key=lambda member: member[0])
        for (_, value, lower), (_, better, higher) in pairwise(ranked):
            # Rank and value are computed apart: rounding errors are no fault.
            assert value <= better * (1 + 1e-12) + 1e-9, (
                f"group {group} at {moment}: {higher} has the higher rank and the lower value, {better} below {value} "
                f"of {lower}; place has to give None, or other groups"
            )
