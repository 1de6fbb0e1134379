"""The state of one trial of the policy study: all nodes, all items, and how far each item has got.

An item is a column: bit `column % WORD_BITS` of word `column // WORD_BITS`. Under Poisson load a node has a fixed
number of columns, its queue, and an item that finds it full is refused. A column is given to a new item only when every
sender has dropped the old one and no node remembers a packet that carried it: two items never mix.

Plain Python that `exchange.study.compiler` compiles, like all that `exchange.study.montecarlo` calls.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from exchange.ack import AckState
from exchange.policies import may_send

Ints: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]

WORD_BITS = 63
"""Items per word: one less than the word has bits, so that all words are positive."""

# What a trial reports, each as a sum and a count to divide it by: `outcomes[trial, quantity]`.
DELIVERED = 0  # slots until all nodes hold the item(s)
SOURCE_ACKED = 1  # slots until every origin believes that all hold its item(s)
SENDERS_ACKED = 2  # slots until every node that may send an item believes that all hold it
TRANSMISSIONS = 3  # times an item was sent; under Poisson load per item delivered
IN_FLIGHT = 4  # items that exist and are not source-acknowledged, per slot of the window
GOODPUT = 5  # items delivered, per slot of the window
OFFERED = 6  # items generated, per slot of the window
REFUSED = 7  # items that found the queue full, per item generated in the window
FALSE_BELIEFS = 8  # beliefs that a peer holds what it lacks: there is never one
SLOTS = 9  # slots played
N_QUANTITIES = 10

N_STAGES = 3  # an item is delivered, then source-acknowledged, then senders-acknowledged
SUM, COUNT, CENSORED = 0, 1, 2  # censored: trials, or under Poisson load items, that did not end

NEVER = 1 << 62


class PolicyRules(NamedTuple):
    """What a policy says beside its acknowledgement, and the size of the fleet.

    `n_words` is the number of words in a set of items, `set_words` that in a set of nodes: `n_nodes` where bits are
    sliced, else 1.
    """

    repeat: bool
    carrier_evidence: bool
    n_nodes: int
    n_words: int
    set_words: int = 1
    knows_all: bool = False
    codes: bool = False


class Load(NamedTuple):
    """What there is to send: nodes 0 to `n_sources` - 1 have as many columns each.

    `rate` is 0 for a batch: every column is an item of slot 0. Under Poisson load it is the mean number of items
    generated per node and slot; those generated in the window are followed to their end, while generation goes on.
    `p_none` is exp(-rate). Where holdings are stated, `number_bits` name an item of a node, and a symbol has
    `symbol_bits`.
    """

    n_sources: int
    columns_per_source: int
    rate: float
    item_bits: int
    capacity_bits: int
    window_start: int
    window_end: int
    max_slots: int
    p_none: float = 1.0
    number_bits: int = 0
    symbol_bits: int = 0


class NodeStates(NamedTuple):
    """State of all nodes, a row each, and of all columns."""

    heard: Ints
    content: Ints
    believes: Ints
    held: Ints
    holds: Ints  # [node * n_words + word] items that the node holds: its belief about itself
    settled: Ints  # [node * n_words + word] items that the node believes all to hold
    origins: Ints  # [node * n_words + word] columns of the node's own items
    weights: Ints  # [node, column]
    reached: Ints  # [stage, word] items that have reached the stage
    born_slot: Ints  # [column]
    free_slot: Ints  # [column] from this slot on the column may be given to a new item
    packet: Ints  # [word] items being sent
    rows: Ints  # [node * set_words + word] acknowledgement bits being sent
    header_bits: Ints  # [slot] size of the header of each slot, until the layouts repeat
    eligible: Ints  # [column]
    chosen: Ints  # [column]
    priorities: Ints  # [column]
    sizes_bits: Ints  # [column]


def new_nodes(rules: PolicyRules, load: Load, period_frames: int) -> NodeStates:
    """Memory for all trials of one load; `clear` it before each.

    `header_bits` is the acknowledgement's to fill in.
    """
    n_nodes, n_words, set_words = rules.n_nodes, rules.n_words, rules.set_words
    n_columns = load.n_sources * load.columns_per_source
    n_holders = n_nodes if set_words == 1 else 1
    origins = np.zeros(n_nodes * n_words, np.int64)
    for column in range(n_columns):
        origin = column // load.columns_per_source
        origins[origin * n_words + column // WORD_BITS] |= 1 << column % WORD_BITS
    return NodeStates(
        heard=np.empty((n_nodes, set_words), np.int64),
        content=np.empty((n_nodes, 2 * n_nodes * n_words), np.int64),
        believes=np.empty((n_nodes, n_nodes * n_words), np.int64),
        held=np.zeros((n_holders, n_nodes * n_nodes * set_words), np.int64),
        holds=np.empty(n_nodes * n_words, np.int64),
        settled=np.empty(n_nodes * n_words, np.int64),
        origins=origins,
        weights=np.empty((n_nodes, n_columns), np.int64),
        reached=np.empty((N_STAGES, n_words), np.int64),
        born_slot=np.empty(n_columns, np.int64),
        free_slot=np.empty(n_columns, np.int64),
        packet=np.empty(n_words, np.int64),
        rows=np.empty(n_nodes, np.int64),
        header_bits=np.empty(n_nodes * period_frames, np.int64),
        eligible=np.empty(n_columns, np.int64),
        chosen=np.empty(n_columns, np.int64),
        priorities=np.ones(n_columns, np.int64),
        sizes_bits=np.full(n_columns, load.item_bits, np.int64),
    )


def clear(nodes: NodeStates) -> None:
    """Nobody has heard anything, and there are no items."""
    nodes.heard[:] = 0
    nodes.content[:] = 0
    nodes.believes[:] = 0
    nodes.holds[:] = 0
    nodes.settled[:] = 0
    nodes.weights[:] = 0
    nodes.reached[:] = 0
    nodes.free_slot[:] = 0


def node_state(rules: PolicyRules, nodes: NodeStates, node: int, received: int) -> AckState:
    """The acknowledgement state of one node, which receives a packet in some trials."""
    n_words, set_words, heard, content = rules.n_words, rules.set_words, nodes.heard[node], nodes.content[node]
    held = nodes.held[node if set_words == 1 else 0]
    return AckState(n_words, heard, content, nodes.believes[node], held, set_words, received)


def add_item(rules: PolicyRules, nodes: NodeStates, origin: int, column: int, slot: int) -> None:
    """Give the column to a new item of `origin`; nothing remains of an older one."""
    w = column // WORD_BITS
    bit = 1 << column % WORD_BITS
    for node in range(rules.n_nodes):
        for i in range(rules.n_nodes):
            nodes.believes[node, i * rules.n_words + w] &= ~bit
        nodes.holds[node * rules.n_words + w] &= ~bit
        nodes.settled[node * rules.n_words + w] &= ~bit
        nodes.weights[node, column] = 0
    for stage in range(N_STAGES):
        nodes.reached[stage, w] &= ~bit
    nodes.believes[origin, origin * rules.n_words + w] |= bit
    nodes.holds[origin * rules.n_words + w] |= bit
    nodes.born_slot[column] = slot
    nodes.free_slot[column] = NEVER


def free_column(load: Load, nodes: NodeStates, origin: int, slot: int) -> int:
    """A column of `origin` without an item, or -1."""
    for column in range(origin * load.columns_per_source, (origin + 1) * load.columns_per_source):
        if nodes.free_slot[column] <= slot:
            return column
    return -1


def progress(rules: PolicyRules, nodes: NodeStates, w: int) -> tuple[int, int, int]:
    """Word w of the items of each stage: held by all, acknowledged to their origin, acknowledged to all who send."""
    held_by_all = -1
    source_acked = 0
    senders_acked = -1
    for node in range(rules.n_nodes):
        at = node * rules.n_words + w
        held_by_all &= nodes.holds[at]
        source_acked |= nodes.settled[at] & nodes.origins[at]
        senders_acked &= nodes.settled[at] | ~may_send(rules.repeat, -1, nodes.origins[at])
    return held_by_all, source_acked, senders_acked & source_acked


def note_progress(rules: PolicyRules, load: Load, nodes: NodeStates, slot: int, outcome: Ints) -> None:
    """Note the items that reach a stage in this slot."""
    for w in range(rules.n_words):
        held_by_all, source_acked, senders_acked = progress(rules, nodes, w)
        for stage in range(N_STAGES):
            now = held_by_all if stage == DELIVERED else source_acked if stage == SOURCE_ACKED else senders_acked
            new = now & ~nodes.reached[stage, w]
            if new != 0:
                nodes.reached[stage, w] = now
                for b in range(WORD_BITS):
                    if (new >> b) & 1:
                        note_item(rules, load, nodes, stage, w * WORD_BITS + b, slot, outcome)


def note_item(
    rules: PolicyRules, load: Load, nodes: NodeStates, stage: int, column: int, slot: int, outcome: Ints
) -> None:
    """Note that an item reaches a stage in this slot."""
    if load.rate == 0.0:
        outcome[stage, SUM] = slot + 1
        outcome[stage, COUNT] += 1
        return
    born = nodes.born_slot[column]
    if load.window_start <= born < load.window_end:
        outcome[stage, SUM] += slot + 1 - born
        outcome[stage, COUNT] += 1
    if stage == DELIVERED and load.window_start <= slot < load.window_end:
        outcome[GOODPUT, SUM] += 1
    if stage == SOURCE_ACKED:
        outcome[IN_FLIGHT, SUM] += slots_in_window(load, born, slot + 1)
    if stage == SENDERS_ACKED:
        # Two frames later no node remembers a packet that carried the item.
        nodes.free_slot[column] = slot + 1 + 2 * rules.n_nodes


def slots_in_window(load: Load, start: int, stop: int) -> int:
    """Slots from `start` to before `stop` that lie in the window."""
    return max(0, min(stop, load.window_end) - max(start, load.window_start))


def close_batch(n_followed: int, outcome: Ints) -> None:
    """Complete the sums and counts of a trial of a batch: it counts once, or as censored."""
    for stage in range(N_STAGES):
        ended = int(outcome[stage, COUNT] == n_followed)
        outcome[stage, SUM] *= ended
        outcome[stage, COUNT] = ended
        outcome[stage, CENSORED] = 1 - ended
    outcome[TRANSMISSIONS, COUNT] = outcome[SENDERS_ACKED, COUNT]
    outcome[TRANSMISSIONS, SUM] *= outcome[SENDERS_ACKED, COUNT]


def close_window(load: Load, nodes: NodeStates, n_followed: int, outcome: Ints) -> None:
    """Complete the sums and counts of a trial of Poisson load: each item followed counts, or is censored."""
    for stage in range(N_STAGES):
        outcome[stage, CENSORED] = n_followed - outcome[stage, COUNT]
    for column in range(len(nodes.free_slot)):
        acknowledged = (nodes.reached[SOURCE_ACKED, column // WORD_BITS] >> column % WORD_BITS) & 1
        if nodes.free_slot[column] == NEVER and not acknowledged:
            outcome[IN_FLIGHT, SUM] += slots_in_window(load, nodes.born_slot[column], load.window_end)
    outcome[TRANSMISSIONS, COUNT] = outcome[GOODPUT, SUM]
    outcome[REFUSED, COUNT] = outcome[OFFERED, SUM]
    for quantity in (IN_FLIGHT, GOODPUT, OFFERED):
        outcome[quantity, COUNT] = load.window_end - load.window_start
