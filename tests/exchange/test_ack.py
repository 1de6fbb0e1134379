"""The acknowledgement rules, each alone, and against an independent model of the paper."""

import random
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import product

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import ReferenceStudy
from exchange.policy.acknowledgement import PacketLog
from exchange.policy.policies import ACK, M_ACK, MPS_ACK, PAPER_POLICIES, AckPolicy
from exchange.study import trials

Items = frozenset[int]
Bits = frozenset[tuple[int, int]]


class PaperNode:
    """Section 5 of the paper as printed, with slot numbers and sets, plus the clearing of the opening node's row."""

    def __init__(self, policy: AckPolicy, n_nodes: int, me: int, carrier_evidence: bool) -> None:
        self.policy, self.n_nodes, self.me = policy, n_nodes, me
        self.carrier_evidence = carrier_evidence
        self.packets: dict[tuple[int, int], Items] = {}  # (sender, slot): what it carried, if known
        self.matrices: dict[int, set[tuple[int, int]]] = {}
        self.believes: list[set[int]] = [set() for _ in range(n_nodes)]

    def last_slot(self, node: int, before: int) -> int:
        return before - 1 - (before - 1 - node) % self.n_nodes

    def meant(self, i: int, j: int, slot: int) -> tuple[int, int]:
        """Rule 2: j's last slot strictly before i's last slot, which for the sender is this slot."""
        slot_of_i = slot if i == slot % self.n_nodes else self.last_slot(i, slot)
        return j, self.last_slot(j, slot_of_i)

    def open(self, slot: int) -> None:
        """Rule 3."""
        k = slot % self.n_nodes
        self.matrices.pop(k, None)
        for matrix in self.matrices.values():
            matrix -= {(i, j) for i, j in matrix if k in (i, j)}

    def compose(self, slot: int, content: Items) -> Bits:
        """Rule 4."""
        bits = {
            (self.me, j) for j in range(self.n_nodes) if j != self.me and self.meant(self.me, j, slot) in self.packets
        }
        if self.policy.acknowledgement != ACK:
            bits |= {bit for matrix in self.matrices.values() for bit in matrix if bit[0] != self.me}
        if self.policy.acknowledgement == MPS_ACK:
            for i in range(self.n_nodes):
                for j in set(range(self.n_nodes)) - {i, self.me}:
                    carried = self.packets.get(self.meant(i, j, slot), frozenset())
                    if carried and carried <= self.believes[i]:
                        bits.add((i, j))
        self.packets[self.me, slot] = content
        return frozenset(bits)

    def absorb(self, slot: int, bits: Bits, content: Items, origins: Sequence[Items]) -> None:
        """Rules 5 and 6."""
        sender = slot % self.n_nodes
        self.packets[sender, slot] = content
        self.matrices[sender] = set(bits)
        self.believes[self.me] |= content
        if self.carrier_evidence:
            self.believes[sender] |= content
        for i in range(self.n_nodes):
            self.believes[i] |= content & origins[i]
        for i, j in bits:
            self.believes[i] |= self.packets.get(self.meant(i, j, slot), frozenset())

    def wanted(self, own: Items) -> Items:
        unsettled = frozenset(self.believes[self.me]) - frozenset.intersection(*map(frozenset, self.believes))
        return unsettled if self.policy.repeat else unsettled & own


class PaperFleet:
    """The same fleet of paper nodes."""

    def __init__(self, policy: AckPolicy, n_nodes: int, carrier_evidence: bool) -> None:
        self.nodes = [PaperNode(policy, n_nodes, me, carrier_evidence) for me in range(n_nodes)]
        self.origins: list[Items] = [frozenset()] * n_nodes
        self.bits: Bits = frozenset()
        self.content: Items = frozenset()

    def add_item(self, node: int, item: int) -> None:
        self.origins[node] |= {item}
        self.nodes[node].believes[node].add(item)

    def play(self, slot: int, receivers: Iterable[int]) -> None:
        for node in self.nodes:
            node.open(slot)
        owner = self.nodes[slot % len(self.nodes)]
        self.content = owner.wanted(self.origins[owner.me])
        self.bits = owner.compose(slot, self.content)
        for receiver in set(receivers) - {owner.me}:
            self.nodes[receiver].absorb(slot, self.bits, self.content, self.origins)

    def false_beliefs(self) -> list[tuple[int, int]]:
        return [
            (node.me, peer.me)
            for node in self.nodes
            for peer in self.nodes
            if not node.believes[peer.me] <= peer.believes[peer.me]
        ]


@st.composite
def exchanges(draw: st.DrawFn) -> tuple[int, list[tuple[Items, list[int]]]]:
    """Number of nodes, and per slot the receivers and the nodes that get an item of their own."""
    n_nodes = draw(st.integers(2, 6))
    nodes = st.integers(0, n_nodes - 1)
    births = st.lists(nodes, max_size=2)
    slots = draw(st.lists(st.tuples(st.frozensets(nodes), births), min_size=5, max_size=60))
    return n_nodes, slots


def random_exchange(seed: int, n_nodes: int = 5) -> list[tuple[Items, list[int]]]:
    dice = random.Random(seed)
    return [
        (
            frozenset(node for node in range(n_nodes) if dice.random() < 0.5),
            [dice.randrange(n_nodes)] if dice.random() < 0.3 else [],
        )
        for _ in range(80)
    ]


@pytest.mark.parametrize("carrier_evidence", [False, True])
@pytest.mark.parametrize("policy", PAPER_POLICIES.values(), ids=PAPER_POLICIES)
@settings(max_examples=20)
@given(exchanges())
@example((5, random_exchange(0)))
@example((5, random_exchange(1)))
@example((3, random_exchange(2, 3)))
def test_contents_and_beliefs_follow_the_paper_and_are_never_false(policy, carrier_evidence, exchange):
    n_nodes, slots = exchange
    born = Counter(node for _, births in slots for node in births)
    most = max(born.values(), default=1)
    study = ReferenceStudy(policy, n_nodes, most, carrier_evidence, item_bits=1, room=1 << 40)
    trials.forget_lanes(study.fleet, 0)
    paper, columns = PaperFleet(policy, n_nodes, carrier_evidence), list[int]()
    for slot, (receivers, births) in enumerate(slots):
        for node in births:
            paper.add_item(node, len(columns))
            born[node] -= 1
            columns.append(node * most + born[node])
            trials.add_item(study.case, study.fleet, columns[-1], 1)
        study.pass_slot(slot, sum(1 << node for node in receivers - {slot % n_nodes}))
        paper.play(slot, receivers)
        loaded = study.fleet.loaded[slot % (2 * n_nodes), columns]
        assert {item for item, word in enumerate(loaded) if word & 1} == paper.content
        for node, peer in product(range(n_nodes), repeat=2):
            believed = {item for item, column in enumerate(columns) if study.believes(node, peer, column)}
            assert believed == paper.nodes[node].believes[peer]
        assert not paper.false_beliefs()


@pytest.mark.parametrize("restarts", [False, True])
def test_reports_of_receptions_in_an_earlier_life_are_not_relayed(restarts: bool) -> None:
    """Node 0 receives 1 in slot 1, in slot 2 that 2 has; it then reports for itself and, unless 2 restarts, for 2."""
    n_nodes, log = 3, PacketLog(M_ACK, me=0, n_nodes=3)
    own, of_2 = 1 << n_nodes, 1 << n_nodes + 2  # receivers of the packet of slot 1
    for slot, acks in ((1, 0), (2, of_2)):
        log.open(slot)
        log.learn(slot, items=1, acks=acks, heeded=1 << slot)
    if restarts:
        log.forget(2)
    log.open(3)
    reported = log.compose(3, items=0, held=[0] * n_nodes)
    assert reported & (own | of_2) == (own if restarts else own | of_2)


def test_the_module_loads_neither_numba_nor_numpy() -> None:
    """A vehicle never waits for a compiler."""
    code = "import sys, exchange, exchange.manager.manager; print({'numba', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
