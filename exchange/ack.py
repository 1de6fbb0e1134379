"""The acknowledgements of TDMA-based exchange, written once: plain loops over the state of one node.

Theory (Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world information",
section 5). N nodes send in turn: node s owns the slots t with t mod N = s and sends in each of them, with
items or without. Every packet carries bits A[i][j], "i received the packet that j sent in j's last slot
before i's last slot". Which of these bits a header carries, and how they are set and read, is the matter of an
`Acknowledgement`; `exchange.policies` has those of the paper. What holds for every kind is here: `open_slot`,
`compose`, `absorb`, `settled`, and the pieces that kinds are put together from.

The manager of a vehicle and the policy study call `open_slot` at the start of every slot at every node. Then the
slot's owner calls `compose`, and every node that receives the packet calls `absorb`. One thing always holds,
whatever is lost: no node believes that a peer holds an item which that peer lacks.

The same functions run interpreted in a vehicle, on lists and on item sets that are single Python integers
of any width (`n_words` 1), and compiled in the policy study, on arrays of 64-bit words. A set of nodes is
one word: bit j is node j. A matrix is N sets, one per row. All state is flat: one index reaches it.

For a single item the study slices the bits (Biham, "A fast new DES implementation in software", 1997): a word of
items is a word of trials, whose bit t says whether the item is in the set in trial t. A set of nodes is then N words of
trials, and what holds of a node, "it was heard", is a word: all or none in a vehicle, some of the trials when sliced.
So a rule reaches sets of nodes by `has`, `put` and `add_matrix`, asks whether there is any of a set of items by `some`,
and branches on a word only to pass over what is empty.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol

MAX_NODES = 64
"""A set of nodes is one 64-bit word in the compiled form."""


class Words(Protocol):
    """A fixed run of integers: a tuple, a list or a one-dimensional array."""

    def __getitem__(self, index: int, /) -> int: ...
    def __iter__(self) -> Iterator[int]: ...


class MutableWords(Words, Protocol):
    """Words that can be replaced."""

    def __setitem__(self, index: int, value: int, /) -> None: ...


class AckState(NamedTuple):
    """What one node knows about packets, items and peers.

    `n_words`: words that make up one set of items.
    `heard`: the nodes whose last packet this node received, one set.
    `content[(age * N + j) * n_words + w]`: items in j's last (age 0) or second-last (age 1) packet. Empty
        unless this node received that packet or sent it itself.
    `believes[i * n_words + w]`: items that node i is believed to hold; the own entry is what this node holds.
    `held[(k * N + i) * set_words + w]`: row i of the matrix last received from k; it counts while `heard` has k.
    `set_words`: words that make up one set of nodes: 1, or N if bits are sliced.
    `received`: trials in which this node hears the packet that it is told of: all where bits are not sliced.
    """

    n_words: int
    heard: MutableWords
    content: MutableWords
    believes: MutableWords
    held: MutableWords
    set_words: int = 1
    received: int = -1


class Acknowledgement(NamedTuple):
    """What a packet's header says about packets heard: a plug-in, made of plain functions.

    The functions run interpreted in vehicles and compiled in the policy study. So they are module-level functions of
    loops, integers and the arguments given, and call only functions of that kind, such as those of this module. The
    latter reach sets of nodes in either form; if nothing else reaches them, the study can slice the bits.

    Attributes:
        name: short, as in `m-ack`; policies, figures and messages use it.
        title: a noun phrase for listings.
        carries: called with ``(n_nodes, frame, sender, row, column)``.
            True if the header that `sender` sends in that TDMA frame has the
            bit A[row][column]. Sender and receivers ask it alike, so that both know the header's layout and size.
            `frame` is below `period_frames`. Nobody acknowledges itself: row and column differ.
        compose: called with ``(state, n_nodes, frame, me, rows_out)``.
            Write the bits of the own packet, one word per row. Called by `exchange.ack.compose`, after the packet's
            content is noted in `state`. Rows without carried bits may be left.
        learn: called with ``(state, n_nodes, frame, sender, rows)``.
            Update `state.believes` by the bits of a packet received. Called by
            `exchange.ack.absorb`, after the packet's items are noted. Bits that are not carried have no meaning.
        remembers_second_last: nodes remember the content of second-last packets too; matrices need it.
        period_frames: the layout of headers repeats after so many TDMA frames.
        bit_sliced: True promises that the functions serve sliced bits, too: the study plays 64 trials of one item at
            once. They then leave sets of nodes to the functions of this module, combine words by ``&``, ``|`` and ``~``
            alone, and branch on a word only to pass over what is empty.
        states: packets state what their senders hold, too, and what they repeat is planned by that; see
            `exchange.planning` and `exchange.planning`.
        codes: they repair by coded symbols, see `exchange.coding`.

    A kind of one's own that states every second frame only what the sender heard:

    >>> from exchange.policies import ACK, AckPolicy, header_bits
    >>> def every_other_frame(n_nodes, frame, sender, row, column):
    ...     return frame == 0 and row == sender
    >>> def learn(state, n_nodes, frame, sender, rows):
    ...     if frame == 0:
    ...         learn_from_row(state, n_nodes, sender, rows)
    >>> title = "acknowledgements in every second frame"
    >>> sparse = Acknowledgement("sparse", title, every_other_frame, ACK.compose, learn, False, 2, bit_sliced=True)
    >>> [header_bits(AckPolicy(sparse, repeat=False), 5, frame) for frame in (0, 1, 2)]
    [4, 0, 4]
    """

    name: str
    title: str
    carries: Callable[[int, int, int, int, int], bool]
    compose: Callable[["AckState", int, int, int, "MutableWords"], None]
    learn: Callable[["AckState", int, int, int, "Words"], None]
    remembers_second_last: bool = False
    period_frames: int = 1
    bit_sliced: bool = False
    states: bool = False
    codes: bool = False


class AckRules(Protocol):
    """The part of an `Acknowledgement` that acts slot by slot: the whole of it, or its compiled form."""

    @property
    def carries(self) -> Callable[[int, int, int, int, int], bool]:
        """True if a header has a bit."""

    @property
    def compose(self) -> Callable[["AckState", int, int, int, "MutableWords"], None]:
        """Write the bits of the own packet."""

    @property
    def learn(self) -> Callable[["AckState", int, int, int, "Words"], None]:
        """Believe what the bits of a packet say."""

    @property
    def remembers_second_last(self) -> bool:
        """True if second-last packets are remembered."""

    @property
    def period_frames(self) -> int:
        """Frames after which layouts repeat."""


def new_state(n_nodes: int) -> AckState:
    """The interpreted form: the state of a node that has heard nothing and holds nothing."""
    return AckState(1, [0], [0] * (2 * n_nodes), [0] * n_nodes, [0] * (n_nodes * n_nodes))


def spoken_since(j: int, slot_owner: int) -> int:
    """The nodes that have sent since j last did, in a slot of `slot_owner`, which has: one word, of which bit j is 0.

    Of these the bit A[i][j] is about j's last packet, of all others about its second-last.

    >>> bin(spoken_since(1, slot_owner=3)), [spoken_since(3, slot_owner=1) >> i & 1 for i in range(4)]
    ('0b1100', [1, 1, 0, 0])
    """
    return (2 << slot_owner) - (2 << j) - int(j > slot_owner)


def bits_carried(kind: AckRules, n_nodes: int, frame: int, sender: int) -> int:
    """Size of the acknowledgement header that `sender` sends in a TDMA frame, in bits."""
    n_bits = 0
    for row in range(n_nodes):
        for column in range(n_nodes):
            if row != column and kind.carries(n_nodes, frame % kind.period_frames, sender, row, column):
                n_bits += 1
    return n_bits


def open_slot(kind: AckRules, state: AckState, n_nodes: int, slot_owner: int) -> None:
    """Age what is known of the slot's owner: its last packet is now its second-last, the new one is unheard."""
    if state.set_words > 1:  # here and not in a function: every node comes here in every slot
        state.heard[slot_owner] = 0
    else:
        state.heard[0] &= ~(1 << slot_owner)
    n_words, content = state.n_words, state.content
    for last in range(slot_owner * n_words, (slot_owner + 1) * n_words):
        if kind.remembers_second_last:
            content[n_nodes * n_words + last] = content[last]
        content[last] = 0


def compose(
    kind: AckRules, state: AckState, n_nodes: int, frame: int, me: int, content: Words, rows_out: MutableWords
) -> None:
    """Remember what the own packet carries, and write its acknowledgement bits.

    Args:
        kind: of the policy; its `compose` writes the bits.
        state: of this node.
        n_nodes: size of the fleet.
        frame: number of the TDMA frame, counted from 0.
        me: this node, the slot's owner.
        content: the items that the packet carries, `n_words` words.
        rows_out: takes a set per row of the matrix; rows that the header does not carry may be left as they are.
    """
    for w in range(state.n_words):
        state.content[me * state.n_words + w] = content[w]
    kind.compose(state, n_nodes, frame % kind.period_frames, me, rows_out)


def has(state: AckState, sets: Words, at: int, node: int) -> int:
    """Where that set of nodes has the node: all, or none; the trials, if bits are sliced.

    >>> [has(new_state(4), [0, 0b0100], 1, node) for node in range(4)]
    [0, 0, -1, 0]
    """
    return sets[at * state.set_words + node] if state.set_words > 1 else -(sets[at] >> node & 1)


def put(state: AckState, sets: MutableWords, at: int, node: int, where: int) -> None:
    """Add the node to that set of nodes, in the trials `where`; if bits are not sliced, if there is any."""
    if state.set_words > 1:
        sets[at * state.set_words + node] |= where
    elif where:
        sets[at] |= 1 << node


def some(state: AckState, items: int) -> int:
    """Where there is any of the items: all, or none; the trials themselves, if bits are sliced."""
    return items if state.set_words > 1 else -int(items != 0)


def add_matrix(state: AckState, n_nodes: int, me: int, k: int, not_since: int, rows_out: MutableWords) -> None:
    """Add what the matrix last received from k says of some nodes about each other.

    These are `not_since`, one word in any case: from the node after me to k.
    """
    if state.set_words > 1:
        received = state.heard[k]
        low, high = (k + 1, n_nodes) if k < me else (0, k + 1)
        for i in range(n_nodes if received else 0):
            if not_since >> i & 1:
                row, matrix_row = i * n_nodes, (k * n_nodes + i) * n_nodes
                for j in range(low):
                    rows_out[row + j] |= state.held[matrix_row + j] & received
                for j in range(me + 1, high):
                    rows_out[row + j] |= state.held[matrix_row + j] & received
    elif state.heard[0] >> k & 1:
        for i in range(n_nodes):
            if not_since >> i & 1:
                rows_out[i] |= state.held[k * n_nodes + i] & not_since


def unite_matrices(state: AckState, n_nodes: int, me: int, rows_out: MutableWords) -> None:
    """OR of the matrices held from the own last slot on, without the bits that later slots have made stale.

    When slot k opens, the paper clears column k of every matrix and the whole matrix last received from k.
    Row k must go too: an older pseudo-acknowledgement A[k][j] of j's second-last packet would from then on
    be read as being about j's last. So of a matrix count the rows and columns of nodes that have not sent
    since. We go from the oldest matrix to the newest; the nodes passed are those that have not sent since
    the one we are at.
    """
    for at in range(n_nodes * state.set_words):
        rows_out[at] = 0
    not_since = 0
    for step in range(1, n_nodes):
        k = me + step if me + step < n_nodes else me + step - n_nodes
        not_since |= 1 << k
        add_matrix(state, n_nodes, me, k, not_since, rows_out)


def add_pseudo_acknowledgements(state: AckState, n_nodes: int, me: int, rows_out: MutableWords) -> None:
    """Set A[i][j] where i is believed to hold all items of the packet of j meant, if it is known to have any."""
    for j in range(n_nodes):
        if j == me or not carried_items(state, n_nodes, j):
            continue
        since = spoken_since(j, me)
        for i in range(n_nodes):
            if i == j:
                continue
            packet = ((1 - (since >> i & 1)) * n_nodes + j) * state.n_words
            carried = 0
            lacking = 0
            for w in range(state.n_words):
                items = state.content[packet + w]
                carried |= items
                lacking |= items & ~state.believes[i * state.n_words + w]
            put(state, rows_out, i, j, some(state, carried) & ~some(state, lacking))


def absorb(
    kind: AckRules,
    carrier_evidence: bool,
    state: AckState,
    n_nodes: int,
    frame: int,
    me: int,
    sender: int,
    rows: Words,
    content: Words,
    origins: Words,
) -> None:
    """Learn from a packet received in the slot of `sender`: its items, who holds them, and what its bits say.

    Args:
        kind: of the policy; its `learn` reads the bits.
        carrier_evidence: take the sender's carrying an item as evidence that it holds it.
        state: of this node.
        n_nodes: size of the fleet.
        frame: number of the TDMA frame, counted from 0.
        me: this node.
        sender: the slot's owner.
        rows: the acknowledgement bits received, a set per row; only those that the header carries have a meaning.
        content: the items received, `n_words` words.
        origins: `origins[i * n_words + w]`, the items that originated at node i: it is known to hold them.
    """
    n_words, believes = state.n_words, state.believes
    if state.set_words > 1:
        state.heard[sender] = state.received
    else:
        state.heard[0] |= 1 << sender
    for w in range(n_words):
        items = content[w] & state.received
        state.content[sender * n_words + w] = items
        if items != 0:
            believes[me * n_words + w] |= items
            if carrier_evidence:
                believes[sender * n_words + w] |= items
            for i in range(n_nodes):
                believes[i * n_words + w] |= items & origins[i * n_words + w]
    kind.learn(state, n_nodes, frame % kind.period_frames, sender, rows)


def remember_matrix(state: AckState, n_nodes: int, sender: int, rows: Words) -> None:
    """Keep the matrix received from the sender, for `unite_matrices`.

    Where bits are sliced, the sender's own is kept for all: who has not received it does not look at it.
    """
    if state.set_words == 1:
        for i in range(n_nodes):
            state.held[sender * n_nodes + i] = rows[i]


def learn_from_row(state: AckState, n_nodes: int, sender: int, rows: Words) -> None:
    """Believe that the sender holds the last packets that its row acknowledges, as far as they are known."""
    n_words, content = state.n_words, state.content
    for w in range(n_words):
        learned, unknown = 0, ~state.believes[sender * n_words + w]
        for j in range(n_nodes):
            items = content[j * n_words + w] & unknown
            if items != 0:
                learned |= items & has(state, rows, sender, j)
        state.believes[sender * n_words + w] |= learned & state.received


def learn_from_matrix(state: AckState, n_nodes: int, sender: int, rows: Words) -> None:
    """Believe that every node i holds the packets that row i acknowledges, as far as they are known."""
    n_words = state.n_words
    for j in range(n_nodes):
        since = spoken_since(j, sender)
        for w in range(n_words):
            last = state.content[j * n_words + w] & state.received
            second_last = state.content[(n_nodes + j) * n_words + w] & state.received
            if last | second_last == 0:
                continue
            for i in range(n_nodes):
                items = last if since >> i & 1 else second_last
                state.believes[i * n_words + w] |= items & has(state, rows, i, j)


def carried_items(state: AckState, n_nodes: int, j: int) -> bool:
    """True if any item is known to have been in the last two packets of j."""
    for w in range(j * state.n_words, (j + 1) * state.n_words):
        if state.content[w] != 0 or state.content[n_nodes * state.n_words + w] != 0:
            return True
    return False


def settled(state: AckState, n_nodes: int, unneeded: Words | None, w: int) -> int:
    """Word w of the items that need no more sending: this node believes that all who need them hold them.

    Args:
        state: of this node.
        n_nodes: size of the fleet.
        unneeded: `unneeded[i * n_words + w]`, the items that node i has no need of, none at this node itself; None if
            every node needs every item.
        w: which word of the set.
    """
    items, n_words, believes = -1, state.n_words, state.believes
    for i in range(n_nodes):
        at = i * n_words + w
        if unneeded is None:
            items &= believes[at]
        else:
            items &= believes[at] | unneeded[at]
    return items
