"""The slot loop of the policy study: many trials of one policy at one set of loss probabilities.

Every node keeps the state that a vehicle keeps, and the functions of the policy and of `exchange.ack` act on it; what
goes into a packet is chosen by `exchange.study.selection`. This file only says who calls them when. It is plain Python
that `exchange.study.compiler` compiles for each kind of acknowledgement; uncompiled it does the same, slowly. The
losses of a trial are drawn once and serve every policy.
"""

from exchange.ack import AckRules, Words, absorb, bits_carried, compose, has, open_slot, settled
from exchange.acoustics.loss import link_uniform, slot_key, trial_key
from exchange.policies import may_send
from exchange.study.bound import pass_freely
from exchange.study.selection import select
from exchange.study.trial import (
    COUNT,
    FALSE_BELIEFS,
    OFFERED,
    REFUSED,
    SENDERS_ACKED,
    SLOTS,
    SUM,
    TRANSMISSIONS,
    WORD_BITS,
    Floats,
    Ints,
    Load,
    NodeStates,
    PolicyRules,
    add_item,
    clear,
    close_batch,
    close_window,
    free_column,
    new_nodes,
    node_state,
    note_progress,
)

NOT_DRAWN = -1
"""No set of receivers: all bits are set, and the slot's owner never hears itself."""


def receivers(trial_state: int, slot: int, n_nodes: int, p_loss: Floats) -> int:
    """The nodes that hear the owner of the slot, one word; `p_loss` is 1 from a node to itself."""
    key = slot_key(trial_state, slot)
    owner = slot % n_nodes
    word = 0
    for node in range(n_nodes):
        word |= int(link_uniform(key, owner, node) >= p_loss[owner, node]) << node
    return word


def drawn_receivers(received: Ints, trial_state: int, slot: int, n_nodes: int, p_loss: Floats) -> int:
    """The same from the memory of the trial, as far as that reaches."""
    if slot >= len(received):
        return receivers(trial_state, slot, n_nodes, p_loss)
    if received[slot] == NOT_DRAWN:
        received[slot] = receivers(trial_state, slot, n_nodes, p_loss)
    return int(received[slot])


def poisson_number(uniform: float, mean: float, p_none: float) -> int:
    """The Poisson number at that quantile, for small means; ``p_none`` is exp(-mean).

    >>> [poisson_number(u, 0.5, 0.6065306597126334) for u in (0.0, 0.60, 0.61, 0.95)]
    [0, 0, 1, 2]
    """
    number = 0
    probability = p_none
    cumulated = probability
    while uniform >= cumulated and probability > 0.0:
        number += 1
        probability *= mean / number
        cumulated += probability
    return number


def generate(rules: PolicyRules, load: Load, nodes: NodeStates, trial_state: int, slot: int, outcome: Ints) -> int:
    """Poisson arrivals of a slot, drawn from the link of each node to itself; returns how many are followed."""
    key = slot_key(trial_state, slot)
    in_window = load.window_start <= slot < load.window_end
    n_followed = 0
    for origin in range(load.n_sources):
        for _ in range(poisson_number(link_uniform(key, origin, origin), load.rate, load.p_none)):
            column = free_column(load, nodes, origin, slot)
            if column >= 0:
                add_item(rules, nodes, origin, column, slot)
            if in_window:
                outcome[OFFERED, SUM] += 1
                outcome[REFUSED, SUM] += int(column < 0)
                n_followed += int(column >= 0)
    return n_followed


def open_items(rules: PolicyRules, nodes: NodeStates, node: int, w: int) -> int:
    """Word w of the items that a node goes on sending."""
    at = node * rules.n_words + w
    return may_send(rules.repeat, nodes.holds[at] & ~nodes.settled[at], nodes.origins[at])


def fill_packet(rules: PolicyRules, load: Load, nodes: NodeStates, owner: int, header_bits: int) -> int:
    """Put into the packet what the owner of the slot sends beside its header; returns the number of items."""
    n_sent = 0
    for w in range(rules.n_words):
        wanted = nodes.packet[w] = open_items(rules, nodes, owner, w)
        while wanted != 0:
            wanted &= wanted - 1
            n_sent += 1
    n_columns = len(nodes.sizes_bits)
    room_bits = load.capacity_bits - header_bits
    if n_columns * load.item_bits <= room_bits:
        return n_sent

    for column in range(n_columns):
        nodes.eligible[column] = (nodes.packet[column // WORD_BITS] >> column % WORD_BITS) & 1
    n_sent = select(nodes.weights[owner], nodes.priorities, nodes.sizes_bits, nodes.eligible, room_bits, nodes.chosen)
    nodes.packet[:] = 0
    for position in range(n_sent):
        column = nodes.chosen[position]
        nodes.packet[column // WORD_BITS] |= 1 << column % WORD_BITS
    return n_sent


def header_sizes(kind: AckRules, n_nodes: int, sizes_out: Ints) -> None:
    """Write the size of the header of every slot, until the layouts repeat."""
    for slot in range(len(sizes_out)):
        sizes_out[slot] = bits_carried(kind, n_nodes, slot // n_nodes, slot % n_nodes)


def open_slots(kind: AckRules, rules: PolicyRules, nodes: NodeStates, owner: int) -> None:
    """Time comes to a slot of the owner at all nodes."""
    for node in range(rules.n_nodes):
        open_slot(kind, node_state(rules, nodes, node, -1), rules.n_nodes, owner)


def pass_packet(
    kind: AckRules, rules: PolicyRules, nodes: NodeStates, frame: int, owner: int, receivers: Words
) -> None:
    """The slot's owner sends the packet, and a set of nodes receives it."""
    n_nodes = rules.n_nodes
    packet, origins = nodes.packet, nodes.origins
    rows = (
        nodes.rows
        if rules.set_words == 1
        else nodes.held[0, owner * n_nodes * n_nodes : (owner + 1) * n_nodes * n_nodes]
    )
    sending = node_state(rules, nodes, owner, -1)
    compose(kind, sending, n_nodes, frame, owner, packet, rows)
    for node in range(n_nodes):
        received = has(sending, receivers, 0, node)
        if received != 0:
            state = node_state(rules, nodes, node, received)
            absorb(kind, rules.carrier_evidence, state, n_nodes, frame, node, owner, rows, packet, origins)
            for w in range(rules.n_words):
                at = node * rules.n_words + w
                nodes.holds[at] = state.believes[at]
                nodes.settled[at] = settled(state, n_nodes, None, w)


def play_slot(kind: AckRules, rules: PolicyRules, load: Load, nodes: NodeStates, slot: int, heard_by: int) -> int:
    """One slot of all nodes; bit i of `heard_by` says that node i receives the packet. Returns the items sent."""
    frame, owner = slot // rules.n_nodes, slot % rules.n_nodes
    if rules.knows_all:
        return pass_freely(rules, load, nodes, owner, heard_by)
    open_slots(kind, rules, nodes, owner)
    n_sent = fill_packet(rules, load, nodes, owner, nodes.header_bits[slot % len(nodes.header_bits)])
    pass_packet(kind, rules, nodes, frame, owner, (heard_by,))
    return n_sent


def count_false_beliefs(rules: PolicyRules, nodes: NodeStates, heard_by: int) -> int:
    """Receivers that believe a peer to hold something which it lacks."""
    n_false = 0
    for node in range(rules.n_nodes):
        if (heard_by >> node) & 1:
            wrong = 0
            for at in range(rules.n_nodes * rules.n_words):
                wrong |= nodes.believes[node, at] & ~nodes.holds[at]
            n_false += int(wrong != 0)
    return n_false


def play_trial(
    kind: AckRules,
    rules: PolicyRules,
    load: Load,
    nodes: NodeStates,
    p_loss: Floats,
    trial_state: int,
    received: Ints,
    outcome: Ints,
) -> None:
    """Play one trial to its end or to the bound."""
    clear(nodes)
    outcome[:] = 0
    is_batch = load.rate == 0.0
    n_followed = 0
    if is_batch:
        n_followed = len(nodes.sizes_bits)
        for column in range(n_followed):
            add_item(rules, nodes, column // load.columns_per_source, column, 0)
    slot = 0
    while slot < load.max_slots and (slot < load.window_end or outcome[SENDERS_ACKED, COUNT] < n_followed):
        if not is_batch:
            n_followed += generate(rules, load, nodes, trial_state, slot, outcome)
        heard_by = drawn_receivers(received, trial_state, slot, rules.n_nodes, p_loss)
        n_sent = play_slot(kind, rules, load, nodes, slot, heard_by)
        if is_batch or load.window_start <= slot < load.window_end:
            outcome[TRANSMISSIONS, SUM] += n_sent
        if heard_by != 0:
            outcome[FALSE_BELIEFS, SUM] += count_false_beliefs(rules, nodes, heard_by)
            note_progress(rules, load, nodes, slot, outcome)
        slot += 1
    outcome[SLOTS, SUM] = slot
    if is_batch:
        close_batch(n_followed, outcome)
    else:
        close_window(load, nodes, n_followed, outcome)


def run_trials(
    kind: AckRules,
    rules: PolicyRules,
    load: Load,
    p_loss: Floats,
    seed: int,
    first_trial: int,
    received: Ints,
    outcomes: Ints,
) -> None:
    """Play the trials `first_trial`, `first_trial` + 1, ... of one policy, one after the other in the same memory.

    Args:
        kind: acknowledgement of the policy, or its compiled form.
        rules: what else the policy says, and the size of the fleet.
        load: what there is to send.
        p_loss: loss probability of the link from row to column, shape (n_nodes, n_nodes); 1 on the diagonal.
        seed: of all random numbers.
        first_trial: number of the first trial.
        received: memory of who received what, shape (n_trials, any), at first all `NOT_DRAWN`; to be shared by
            policies that meet the same seed, trials and loss probabilities.
        outcomes: takes sum, count and censored number of every quantity, shape (n_trials, N_QUANTITIES, 3).
    """
    nodes = new_nodes(rules, load, kind.period_frames)
    header_sizes(kind, rules.n_nodes, nodes.header_bits)
    for index in range(len(outcomes)):
        trial_state = trial_key(seed, first_trial + index)
        play_trial(kind, rules, load, nodes, p_loss, trial_state, received[index], outcomes[index])
