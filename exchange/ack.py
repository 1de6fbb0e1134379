"""The acknowledgement policies of TDMA-based exchange, written once: plain loops over the state of one node.

Theory (Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world information",
section 5). N nodes send in turn: node s owns the slots t with t mod N = s and sends in each of them, with
items or without. Every packet carries bits A[i][j], "i received the packet that j sent in j's last slot
before i's last slot". Under ACK a sender s states its own row A[s] only. Under M-ACK it repeats what it was
told of the other rows. Under MPS-ACK it also sets a bit on behalf of a peer that it believes to hold the
whole content of the packet meant, whether or not that peer received that very packet.

Call `open_slot` at the start of every slot at every node. Then the slot's owner calls `compose`, and every
node that receives the packet calls `absorb`. One thing always holds, whatever is lost: no node believes
that a peer holds an item which that peer lacks.

The same functions run interpreted in a vehicle, on lists and on item sets that are single Python integers
of any width (`n_words` 1), and compiled in the policy study, on arrays of 64-bit words. A set of nodes is
one word: bit j is node j. A matrix is N words, one per row. All state is flat: one index reaches it.
"""

from typing import NamedTuple, Protocol

from exchange.policies import ACK, MPS_ACK

MAX_NODES = 64
"""A set of nodes is one 64-bit word in the compiled form."""


class Words(Protocol):
    """A fixed run of integers: a tuple, a list or a one-dimensional array."""

    def __getitem__(self, index: int, /) -> int: ...


class MutableWords(Words, Protocol):
    """Words that can be replaced."""

    def __setitem__(self, index: int, value: int, /) -> None: ...


class AckState(NamedTuple):
    """What one node knows about packets, items and peers.

    `n_words`: words that make up one set of items.
    `heard[0]`: the nodes whose last packet this node received, one word.
    `content[(age * N + j) * n_words + w]`: items in j's last (age 0) or second-last (age 1) packet. Empty
        unless this node received that packet or sent it itself.
    `believes[i * n_words + w]`: items that node i is believed to hold; the own entry is what this node holds.
    `held[k * N + i]`: row i of the matrix last received from k; it counts while `heard` has k.
    """

    n_words: int
    heard: MutableWords
    content: MutableWords
    believes: MutableWords
    held: MutableWords


def new_state(n_nodes: int) -> AckState:
    """The interpreted form: the state of a node that has heard nothing and holds nothing."""
    return AckState(1, [0], [0] * (2 * n_nodes), [0] * n_nodes, [0] * (n_nodes * n_nodes))


def packet_meant(i: int, j: int, slot_owner: int, n_nodes: int) -> int:
    """Which packet of j the bit A[i][j] in a slot of `slot_owner` is about: 0 the last, 1 the second-last.

    It is the last one if j has not sent since i last did, and the second-last if it has.

    >>> [packet_meant(i, 1, slot_owner=3, n_nodes=4) for i in (0, 2, 3)]
    [1, 0, 0]
    """
    slots_since_i = slot_owner - i if i <= slot_owner else slot_owner - i + n_nodes
    slots_since_j = slot_owner - j if j <= slot_owner else slot_owner - j + n_nodes
    return 0 if slots_since_j > slots_since_i else 1


def open_slot(acknowledgement: int, state: AckState, n_nodes: int, slot_owner: int) -> None:
    """Age what is known of the slot's owner: its last packet is now its second-last, the new one is unheard.

    A second-last packet is meant by bits of a matrix only.
    """
    state.heard[0] &= ~(1 << slot_owner)
    n_words = state.n_words
    for last in range(slot_owner * n_words, (slot_owner + 1) * n_words):
        if acknowledgement != ACK:
            state.content[n_nodes * n_words + last] = state.content[last]
        state.content[last] = 0


def compose(
    acknowledgement: int, state: AckState, n_nodes: int, me: int, content: Words, rows_out: MutableWords
) -> None:
    """Write the acknowledgement bits of the own packet, and remember what the packet carries.

    Args:
        content: the items that the packet carries, `n_words` words.
        rows_out: takes one word per row of the matrix. Under ACK only row `me` is written.
    """
    for w in range(state.n_words):
        state.content[me * state.n_words + w] = content[w]
    if acknowledgement != ACK:
        unite_matrices(state, n_nodes, me, rows_out)
    rows_out[me] = state.heard[0]
    if acknowledgement == MPS_ACK:
        add_pseudo_acknowledgements(state, n_nodes, me, rows_out)


def unite_matrices(state: AckState, n_nodes: int, me: int, rows_out: MutableWords) -> None:
    """OR of the matrices held from the own last slot on, without the bits that later slots have made stale.

    When slot k opens, the paper clears column k of every matrix and the whole matrix last received from k.
    Row k must go too: an older pseudo-acknowledgement A[k][j] of j's second-last packet would from then on
    be read as being about j's last. So of a matrix count the rows and columns of nodes that have not sent
    since. We go from the oldest matrix to the newest; the nodes passed are those that have not sent since
    the one we are at.
    """
    for i in range(n_nodes):
        rows_out[i] = 0
    not_since = 0
    for step in range(1, n_nodes):
        k = me + step if me + step < n_nodes else me + step - n_nodes
        not_since |= 1 << k
        if (state.heard[0] >> k) & 1:
            for i in range(n_nodes):
                if (not_since >> i) & 1:
                    rows_out[i] |= state.held[k * n_nodes + i] & not_since


def add_pseudo_acknowledgements(state: AckState, n_nodes: int, me: int, rows_out: MutableWords) -> None:
    """Set A[i][j] where i is believed to hold all items of the packet of j meant, if it is known to have any."""
    for j in range(n_nodes):
        if j == me or not carried_items(state, n_nodes, j):
            continue
        for i in range(n_nodes):
            if i == j:
                continue
            packet = (packet_meant(i, j, me, n_nodes) * n_nodes + j) * state.n_words
            carried = 0
            lacking = 0
            for w in range(state.n_words):
                items = state.content[packet + w]
                carried |= items
                lacking |= items & ~state.believes[i * state.n_words + w]
            rows_out[i] |= int(carried != 0 and lacking == 0) << j


def absorb(
    acknowledgement: int,
    carrier_evidence: bool,
    state: AckState,
    n_nodes: int,
    me: int,
    sender: int,
    rows: Words,
    content: Words,
    origins: Words,
) -> None:
    """Learn from a packet received in the slot of `sender`: its items, who holds them, and what its bits say.

    Args:
        carrier_evidence: take the sender's carrying an item as evidence that it holds it.
        rows: the acknowledgement bits received, one word per row; under ACK only the sender's row is read.
        content: the items received, `n_words` words.
        origins: `origins[i * n_words + w]`, the items that originated at node i: it is known to hold them.
    """
    n_words = state.n_words
    state.heard[0] |= 1 << sender
    for w in range(n_words):
        items = content[w]
        state.content[sender * n_words + w] = items
        if items != 0:
            state.believes[me * n_words + w] |= items
            if carrier_evidence:
                state.believes[sender * n_words + w] |= items
            for i in range(n_nodes):
                state.believes[i * n_words + w] |= items & origins[i * n_words + w]

    if acknowledgement == ACK:
        learn_from_row(state, n_nodes, sender, rows[sender])
    else:
        for i in range(n_nodes):
            state.held[sender * n_nodes + i] = rows[i]
        learn_from_matrix(state, n_nodes, sender, rows)


def learn_from_row(state: AckState, n_nodes: int, sender: int, row: int) -> None:
    """Believe that the sender holds the last packets that its row acknowledges, as far as they are known."""
    for w in range(state.n_words):
        learned = 0
        for j in range(n_nodes):
            learned |= state.content[j * state.n_words + w] & all_if(row >> j)
        state.believes[sender * state.n_words + w] |= learned


def learn_from_matrix(state: AckState, n_nodes: int, sender: int, rows: Words) -> None:
    """Believe that every node i holds the packets that row i acknowledges, as far as they are known."""
    n_words = state.n_words
    for j in range(n_nodes):
        for w in range(n_words):
            last = state.content[j * n_words + w]
            second_last = state.content[(n_nodes + j) * n_words + w]
            if last | second_last == 0:
                continue
            for i in range(n_nodes):
                items = second_last if packet_meant(i, j, sender, n_nodes) else last
                state.believes[i * n_words + w] |= items & all_if(rows[i] >> j)


def all_if(word: int) -> int:
    """A mask that keeps all if the lowest bit of the word is set, else nothing.

    >>> 0b1100 & all_if(1), 0b1100 & all_if(2)
    (12, 0)
    """
    return -(word & 1)


def carried_items(state: AckState, n_nodes: int, j: int) -> bool:
    """Is any item known to have been in the last two packets of j?"""
    for w in range(j * state.n_words, (j + 1) * state.n_words):
        if state.content[w] != 0 or state.content[n_nodes * state.n_words + w] != 0:
            return True
    return False


def settled(state: AckState, n_nodes: int, w: int) -> int:
    """Word w of the set of items that this node believes all nodes, itself included, to hold."""
    items = state.believes[w]
    for i in range(1, n_nodes):
        items &= state.believes[i * state.n_words + w]
    return items
