"""The acknowledgement rules, one by one, and against an independent reading of the paper in sets and slot numbers."""

import random
import subprocess
import sys
from collections.abc import Iterable, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exchange import ack, policies
from exchange.ack import AckState, absorb, compose, new_state, open_slot, settled
from exchange.policies import ACK, MPS_ACK, PAPER_POLICIES, AckPolicy, may_send

Items = frozenset[int]
Bits = frozenset[tuple[int, int]]


def items_of(word: int) -> Items:
    return frozenset(bit for bit in range(word.bit_length()) if word >> bit & 1)


def word_of(items: Iterable[int]) -> int:
    return sum(1 << item for item in items)


class Fleet:
    """Nodes as vehicles run them: lists, item sets as integers; every node offers its items until all are settled."""

    def __init__(self, policy: AckPolicy, n_nodes: int, carrier_evidence: bool = False) -> None:
        self.policy, self.n_nodes, self.carrier_evidence = policy, n_nodes, carrier_evidence
        self.states = [new_state(n_nodes) for _ in range(n_nodes)]
        self.origins = [0] * n_nodes
        self.n_items = 0
        self.rows = [0] * n_nodes
        self.content = 0

    def add_item(self, node: int) -> int:
        item = self.n_items
        self.n_items += 1
        self.origins[node] |= 1 << item
        self.states[node].believes[node] |= 1 << item
        return item

    def wanted(self, node: int) -> int:
        unsettled = self.states[node].believes[node] & ~settled(self.states[node], self.n_nodes, None, 0)
        return may_send(self.policy.repeat, unsettled, self.origins[node])

    def play(self, slot: int, receivers: Iterable[int]) -> None:
        owner = slot % self.n_nodes
        kind = self.policy.acknowledgement
        for state in self.states:
            open_slot(kind, state, self.n_nodes, owner)
        self.rows = [0] * self.n_nodes
        self.content = self.wanted(owner)
        compose(kind, self.states[owner], self.n_nodes, slot // self.n_nodes, owner, (self.content,), self.rows)
        for node in receivers:
            if node != owner:
                absorb(
                    kind, self.carrier_evidence, self.states[node], self.n_nodes, slot // self.n_nodes, node, owner,
                    tuple(self.rows), (self.content,), self.origins,
                )  # fmt: skip

    def bits(self) -> Bits:
        return frozenset((i, j) for i in range(self.n_nodes) for j in range(self.n_nodes) if self.rows[i] >> j & 1)

    def believes(self, node: int, peer: int) -> Items:
        return items_of(self.states[node].believes[peer])

    def false_beliefs(self) -> list[tuple[int, int]]:
        return [
            (node, peer)
            for node in range(self.n_nodes)
            for peer in range(self.n_nodes)
            if not self.believes(node, peer) <= self.believes(peer, peer)
        ]


class PaperNode:
    """Section 5 of the paper as printed, with slot numbers and sets, plus the clearing of the opening node's row."""

    def __init__(self, policy: AckPolicy, n_nodes: int, me: int, carrier_evidence: bool, clear_rows: bool) -> None:
        self.policy, self.n_nodes, self.me = policy, n_nodes, me
        self.carrier_evidence, self.clear_rows = carrier_evidence, clear_rows
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
            matrix -= {(i, j) for i, j in matrix if j == k or (i == k and self.clear_rows)}

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

    def __init__(self, policy: AckPolicy, n_nodes: int, carrier_evidence: bool, clear_rows: bool = True) -> None:
        self.nodes = [PaperNode(policy, n_nodes, me, carrier_evidence, clear_rows) for me in range(n_nodes)]
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


@settings(max_examples=150)
@given(exchanges(), st.sampled_from(list(PAPER_POLICIES.values())), st.booleans())
def test_bits_and_beliefs_are_those_of_the_paper_and_never_false(
    exchange: tuple[int, list[tuple[Items, list[int]]]], policy: AckPolicy, carrier_evidence: bool
) -> None:
    compare_with_paper(*exchange, policy, carrier_evidence)


@pytest.mark.parametrize("carrier_evidence", [False, True])
@pytest.mark.parametrize("name", PAPER_POLICIES)
def test_long_exchanges_too(name: str, carrier_evidence: bool) -> None:
    for seed in range(8):
        compare_with_paper(5, random_exchange(seed), PAPER_POLICIES[name], carrier_evidence)


def compare_with_paper(
    n_nodes: int, slots: list[tuple[Items, list[int]]], policy: AckPolicy, carrier_evidence: bool
) -> None:
    fleet = Fleet(policy, n_nodes, carrier_evidence)
    paper = PaperFleet(policy, n_nodes, carrier_evidence)
    for slot, (receivers, births) in enumerate(slots):
        for node in births:
            paper.add_item(node, fleet.add_item(node))
        fleet.play(slot, receivers)
        paper.play(slot, receivers)
        assert items_of(fleet.content) == paper.content
        assert fleet.bits() == paper.bits
        for node in range(n_nodes):
            assert [fleet.believes(node, peer) for peer in range(n_nodes)] == paper.nodes[node].believes
        assert fleet.false_beliefs() == []


def random_exchange(seed: int, n_nodes: int = 5, n_slots: int = 80) -> list[tuple[Items, list[int]]]:
    dice = random.Random(seed)
    return [
        (
            frozenset(node for node in range(n_nodes) if dice.random() < 0.5),
            [dice.randrange(n_nodes)] if dice.random() < 0.3 else [],
        )
        for _ in range(n_slots)
    ]


def count_false(fleet: Fleet | PaperFleet, slots: list[tuple[Items, list[int]]]) -> int:
    n_false = item = 0
    for slot, (receivers, births) in enumerate(slots):
        for node in births:
            if isinstance(fleet, Fleet):
                fleet.add_item(node)
            else:
                fleet.add_item(node, item)
            item += 1
        fleet.play(slot, receivers)
        n_false += len(fleet.false_beliefs())
    return n_false


@pytest.mark.parametrize("name", ["mps-ack", "mps-ack-repeat"])
def test_without_row_clearing_the_paper_believes_what_is_false(name: str) -> None:
    """Rule 3: with many items what the paper prints is not enough."""
    exchanges = [random_exchange(seed) for seed in range(20)]
    assert sum(count_false(PaperFleet(PAPER_POLICIES[name], 5, False, clear_rows=False), one) for one in exchanges) > 0
    assert sum(count_false(PaperFleet(PAPER_POLICIES[name], 5, False, clear_rows=True), one) for one in exchanges) == 0


def unite_without_row_clearing(state: AckState, n_nodes: int, me: int, rows_out: ack.MutableWords) -> None:
    """`ack.unite_matrices`, mutated: stale columns are left out, stale rows are not."""
    for i in range(n_nodes):
        rows_out[i] = 0
    not_since = 0
    for step in range(1, n_nodes):
        k = (me + step) % n_nodes
        not_since |= 1 << k
        if (state.heard[0] >> k) & 1:
            for i in range(n_nodes):
                rows_out[i] |= state.held[k * n_nodes + i] & not_since


@pytest.mark.parametrize("name", ["mps-ack", "mps-ack-repeat"])
def test_without_row_clearing_this_program_would_too(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    exchanges = [random_exchange(seed) for seed in range(20)]
    assert sum(count_false(Fleet(PAPER_POLICIES[name], 5), one) for one in exchanges) == 0
    monkeypatch.setattr(policies, "unite_matrices", unite_without_row_clearing)
    assert sum(count_false(Fleet(PAPER_POLICIES[name], 5), one) for one in exchanges) > 0


@pytest.mark.parametrize("name", ["m-ack", "m-ack-repeat"])
def test_without_pseudo_acknowledgements_no_row_is_ever_stale(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A true bit A[k][j] goes with column j, which opens before k speaks again: only a pseudo one outlives it."""
    monkeypatch.setattr(policies, "unite_matrices", unite_without_row_clearing)
    assert sum(count_false(Fleet(PAPER_POLICIES[name], 5), random_exchange(seed)) for seed in range(20)) == 0


def test_with_a_single_item_the_missing_clearing_does_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policies, "unite_matrices", unite_without_row_clearing)
    for seed in range(30):
        slots = [(receivers, [0] if slot == 0 else []) for slot, (receivers, _) in enumerate(random_exchange(seed))]
        assert count_false(Fleet(PAPER_POLICIES["mps-ack-repeat"], 5), slots) == 0


# Single rules ---------------------------------------------------------------------------------------------------------

ALL = range(8)


def test_a_bit_is_about_the_packet_before_the_acknowledging_node_spoke() -> None:
    """Rule 2, N = 5, in the slot of node 3: j's last packet if j has not sent since i did."""
    for i in range(5):
        for j in range(5):
            since_i, since_j = (3 - i) % 5, (3 - j) % 5
            assert ack.spoken_since(j, 3) >> i & 1 == (1 if since_j > since_i else 0)
    assert [ack.spoken_since(j, 3) >> 3 & 1 for j in (0, 1, 2, 4)] == [1, 1, 1, 1]


def test_ack_speaks_of_the_own_row_only() -> None:
    """Rule 4: every node heard every other, yet node 2 vouches for nobody else."""
    fleet = Fleet(PAPER_POLICIES["ack"], 4)
    for slot in range(7):
        fleet.play(slot, ALL[:4])
    assert fleet.bits() == {(2, 0), (2, 1), (2, 3)}


def test_a_matrix_passes_on_what_others_said() -> None:
    """Node 2 tells that node 1 received node 0, though node 0 did not hear node 1."""
    fleet = Fleet(PAPER_POLICIES["m-ack"], 4)
    item = fleet.add_item(0)
    fleet.play(0, {1})
    fleet.play(1, {2})
    fleet.play(2, {0})
    assert fleet.bits() == {(2, 1), (1, 0)}
    assert fleet.believes(0, 1) == {item}


def test_opening_a_slot_clears_column_and_matrix_of_its_owner() -> None:
    """Rule 3: of what node 2 said in slot 2, column 0 goes in slot 3 and column 1 in slot 4; node 0 was not heard."""
    fleet = Fleet(PAPER_POLICIES["m-ack"], 3)
    for slot in range(3):
        fleet.play(slot, ALL[:3])
    assert fleet.bits() == {(2, 0), (2, 1), (1, 0)}
    fleet.play(3, ())
    assert fleet.bits() == {(0, 1), (0, 2), (2, 1)}
    fleet.play(4, ())
    assert fleet.bits() == {(1, 2)}


def test_pseudo_acknowledgement_needs_belief_in_the_whole_content() -> None:
    """Rule 4: node 1 knows that node 2 holds item 0 but not item 1; it vouches for a packet with item 0 only."""
    for second_item in (False, True):
        fleet = Fleet(PAPER_POLICIES["mps-ack"], 3)
        fleet.add_item(0)
        fleet.play(0, {1, 2})
        fleet.play(1, ())
        fleet.play(2, {1})
        assert fleet.believes(1, 2) == {0}
        if second_item:
            fleet.add_item(0)
        fleet.play(3, {1})
        for slot in (4, 5, 6):
            fleet.play(slot, ())
        fleet.play(7, {0})  # A[2][0] is about slot 3: node 0 has sent since node 2 did
        assert ((2, 0) in fleet.bits()) is not second_item
        assert fleet.false_beliefs() == []


def test_no_pseudo_acknowledgement_of_an_empty_packet() -> None:
    fleet = Fleet(PAPER_POLICIES["mps-ack-repeat"], 3)
    fleet.play(0, {1})
    fleet.play(1, {2})
    assert fleet.bits() == {(1, 0)}


def test_a_bit_about_an_unknown_packet_teaches_nothing() -> None:
    """Rule 5: node 2 lost node 0's packet, so it does not know what node 1 acknowledges."""
    fleet = Fleet(PAPER_POLICIES["m-ack"], 3)
    fleet.add_item(0)
    fleet.play(0, {1})
    fleet.play(1, {0, 2})
    assert fleet.believes(2, 1) == frozenset()
    assert fleet.believes(0, 1) == {0}


@pytest.mark.parametrize("carrier_evidence", [False, True])
def test_carrying_is_evidence_only_if_asked_for(carrier_evidence: bool) -> None:
    """Rule 6: node 2 hears the item from node 1; that node 0, its origin, holds it, is known in any case."""
    fleet = Fleet(PAPER_POLICIES["ack-repeat"], 3, carrier_evidence)
    item = fleet.add_item(0)
    fleet.play(0, {1})
    fleet.play(1, {2})
    assert fleet.content == 1 << item
    assert fleet.believes(2, 0) == {item}
    assert fleet.believes(2, 1) == ({item} if carrier_evidence else frozenset())


def test_nodes_stop_when_they_believe_that_all_hold_it() -> None:
    """Rule 7: with perfect links the source needs one frame; repeating peers need their own packet acknowledged."""
    fleet = Fleet(PAPER_POLICIES["ack"], 3)
    fleet.add_item(0)
    for slot in range(3):
        fleet.play(slot, ALL[:3])
    assert [fleet.wanted(node) for node in range(3)] == [0, 0, 0]
    fleet.play(3, ALL[:3])
    assert fleet.content == 0


@pytest.mark.parametrize(
    ("name", "n_nodes"),
    [*((name, n_nodes) for name in PAPER_POLICIES for n_nodes in (2, 3, 16)), ("ack", 64), ("mps-ack", 64)],
)
def test_perfect_links_settle_an_item_within_two_frames(name: str, n_nodes: int) -> None:
    fleet = Fleet(PAPER_POLICIES[name], n_nodes)
    item = fleet.add_item(n_nodes - 1)
    for slot in range(2 * n_nodes):
        fleet.play(slot, range(n_nodes))
    assert fleet.false_beliefs() == []
    assert all(fleet.believes(n_nodes - 1, peer) == {item} for peer in range(n_nodes))
    assert fleet.wanted(n_nodes - 1) == 0


def test_items_may_be_many() -> None:
    """An item set of a vehicle is one integer of any width."""
    fleet = Fleet(PAPER_POLICIES["mps-ack-repeat"], 3)
    for number in range(300):
        fleet.add_item(number % 3)
    for slot in range(9):
        fleet.play(slot, ALL[:3])
    assert fleet.believes(2, 0) == frozenset(range(300))
    assert [fleet.wanted(node) for node in range(3)] == [0, 0, 0]


def test_the_module_loads_neither_numba_nor_numpy() -> None:
    """A vehicle never waits for a compiler."""
    code = "import sys, exchange, exchange.manager; print({'numba', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
