"""A bound of the policy study: no policy hears more than packets let it hear, and here nothing else stands in the way.

Each node that hears a packet takes out of it what it lacks of what the sender holds, as much as the packet has room for
and each its own choice: first what the fewest hold. So no sending is of no use to a hearer who lacks something. A
packet carries for nothing all that its sender knows of who holds what, and has no header. A single item waits for the
links alone, so no policy is sooner with it in any trial. With several items the choice of the rarest is a good one that
is not proved to be the best, and a code may make use of a packet of whose items a hearer lacks none.

Plain Python that `exchange.study.compiler` compiles, like `exchange.study.montecarlo`, whose slots these replace.
"""

from exchange.ack import Acknowledgement
from exchange.policies import ACK, AckPolicy
from exchange.study.trial import NEVER, WORD_BITS, Load, NodeStates, PolicyRules


def no_bits(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """A header without bits."""
    return False


BOUND = AckPolicy(
    Acknowledgement("bound", "each hearer takes what it lacks; knowledge is free", no_bits, ACK.compose, ACK.learn),
    repeat=False,
)
"""Stands among the policies of a study for the bound; it can be given to no vehicle."""


def n_holders(rules: PolicyRules, nodes: NodeStates, column: int) -> int:
    """How many nodes hold the item."""
    number = 0
    for node in range(rules.n_nodes):
        number += (nodes.holds[node * rules.n_words + column // WORD_BITS] >> column % WORD_BITS) & 1
    return number


def take(rules: PolicyRules, load: Load, nodes: NodeStates, owner: int, node: int) -> int:
    """A node takes what it lacks out of the owner's packet, of items that the fewest held; returns how many."""
    room = len(nodes.chosen)
    if load.capacity_bits != NEVER:
        room = load.capacity_bits // load.item_bits
    n_taken = 0
    while n_taken < room:
        rarest = -1
        for column in range(len(nodes.chosen)):
            w, bit = column // WORD_BITS, 1 << column % WORD_BITS
            is_lacking = nodes.holds[owner * rules.n_words + w] & ~nodes.holds[node * rules.n_words + w] & bit
            if is_lacking != 0 and (rarest < 0 or nodes.eligible[column] < nodes.eligible[rarest]):
                rarest = column
        if rarest < 0:
            return n_taken
        w = rarest // WORD_BITS
        nodes.holds[node * rules.n_words + w] |= 1 << rarest % WORD_BITS
        n_taken += 1
    return n_taken


def pass_freely(rules: PolicyRules, load: Load, nodes: NodeStates, owner: int, heard_by: int) -> int:
    """One slot of all nodes; bit i of `heard_by` says that node i receives the packet.

    Returns the most items that one of them takes.
    """
    n_nodes, n_words, most = rules.n_nodes, rules.n_words, 0
    for column in range(len(nodes.chosen)):
        nodes.eligible[column] = n_holders(rules, nodes, column)
    for node in range(n_nodes):
        if (heard_by >> node) & 1 == 0:
            continue
        most = max(most, take(rules, load, nodes, owner, node))
        for w in range(n_words):
            held, all_hold = nodes.holds[node * n_words + w], -1
            for i in range(n_nodes):
                known = nodes.believes[owner, i * n_words + w]
                if i == node:
                    known = held
                nodes.believes[node, i * n_words + w] |= known
                all_hold &= nodes.believes[node, i * n_words + w]
            nodes.settled[node * n_words + w] = all_hold
    return most
