"""The slot loop of the policy study: many trials of one policy at one set of loss probabilities.

Every node keeps the state that a vehicle keeps, and the functions of `exchange.ack` and `exchange.selection` act on it:
this file only says who calls them when. It is plain Python that `exchange.study.compiler` compiles; uncompiled it
does the same, slowly. The losses of a trial are drawn once and serve every policy.
"""

import math

from exchange.ack import absorb, compose, open_slot, settled
from exchange.acoustics.loss import link_uniform, slot_key, trial_key
from exchange.policies import acknowledgement_bits
from exchange.selection import select
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
    Fleet,
    Floats,
    Ints,
    Load,
    Rules,
    add_item,
    clear,
    close_batch,
    close_window,
    free_column,
    new_fleet,
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


def poisson_number(uniform: float, mean: float) -> int:
    """The Poisson number at that quantile, for small means.

    >>> [poisson_number(u, 0.5) for u in (0.0, 0.60, 0.61, 0.95)]
    [0, 0, 1, 2]
    """
    number = 0
    probability = math.exp(-mean)
    cumulated = probability
    while uniform >= cumulated and probability > 0.0:
        number += 1
        probability *= mean / number
        cumulated += probability
    return number


def generate(rules: Rules, load: Load, fleet: Fleet, trial_state: int, slot: int, outcome: Ints) -> int:
    """Poisson arrivals of a slot, drawn from the link of each node to itself; returns how many are followed."""
    key = slot_key(trial_state, slot)
    in_window = load.window_start <= slot < load.window_end
    n_followed = 0
    for origin in range(load.n_sources):
        for _ in range(poisson_number(link_uniform(key, origin, origin), load.rate)):
            column = free_column(load, fleet, origin, slot)
            if column >= 0:
                add_item(rules, fleet, origin, column, slot)
            if in_window:
                outcome[OFFERED, SUM] += 1
                outcome[REFUSED, SUM] += int(column < 0)
                n_followed += int(column >= 0)
    return n_followed


def fill_packet(rules: Rules, load: Load, fleet: Fleet, owner: int) -> int:
    """Put into the packet what the owner of the slot sends; returns the number of items."""
    n_sent = 0
    for w in range(rules.n_words):
        cell = owner * rules.n_words + w
        wanted = fleet.holds[cell] & ~fleet.settled[cell]
        if not rules.repeat:
            wanted &= fleet.origins[cell]
        fleet.packet[w] = wanted
        while wanted != 0:
            wanted &= wanted - 1
            n_sent += 1
    n_columns = len(fleet.sizes_bits)
    room_bits = load.capacity_bits - acknowledgement_bits(rules.acknowledgement, rules.n_nodes)
    if n_columns * load.item_bits <= room_bits:
        return n_sent

    for column in range(n_columns):
        fleet.eligible[column] = (fleet.packet[column // WORD_BITS] >> column % WORD_BITS) & 1
    n_sent = select(fleet.weights[owner], fleet.priorities, fleet.sizes_bits, fleet.eligible, room_bits, fleet.chosen)
    fleet.packet[:] = 0
    for position in range(n_sent):
        column = fleet.chosen[position]
        fleet.packet[column // WORD_BITS] |= 1 << column % WORD_BITS
    return n_sent


def play_slot(rules: Rules, load: Load, fleet: Fleet, slot: int, heard_by: int) -> int:
    """One slot of all nodes; bit i of `heard_by` says that node i receives the packet. Returns the items sent."""
    acknowledgement, n_nodes = rules.acknowledgement, rules.n_nodes
    owner = slot % n_nodes
    for node in range(n_nodes):
        open_slot(acknowledgement, node_state(rules, fleet, node), n_nodes, owner)
    n_sent = fill_packet(rules, load, fleet, owner)
    packet, rows, origins = fleet.packet, fleet.rows, fleet.origins
    compose(acknowledgement, node_state(rules, fleet, owner), n_nodes, owner, packet, rows)
    for node in range(n_nodes):
        if (heard_by >> node) & 1:
            state = node_state(rules, fleet, node)
            absorb(acknowledgement, rules.carrier_evidence, state, n_nodes, node, owner, rows, packet, origins)
            for w in range(rules.n_words):
                cell = node * rules.n_words + w
                fleet.holds[cell] = state.believes[cell]
                fleet.settled[cell] = settled(state, n_nodes, w)
    return n_sent


def count_false_beliefs(rules: Rules, fleet: Fleet, heard_by: int) -> int:
    """Receivers that believe a peer to hold something which it lacks."""
    n_false = 0
    for node in range(rules.n_nodes):
        if (heard_by >> node) & 1:
            wrong = 0
            for cell in range(rules.n_nodes * rules.n_words):
                wrong |= fleet.believes[node, cell] & ~fleet.holds[cell]
            n_false += int(wrong != 0)
    return n_false


def run_trial(
    rules: Rules, load: Load, fleet: Fleet, p_loss: Floats, trial_state: int, received: Ints, outcome: Ints
) -> None:
    """Play one trial to its end or to the bound."""
    clear(fleet)
    outcome[:] = 0
    is_batch = load.rate == 0.0
    n_followed = 0
    if is_batch:
        n_followed = len(fleet.sizes_bits)
        for column in range(n_followed):
            add_item(rules, fleet, column // load.columns_per_source, column, 0)
    slot = 0
    while slot < load.max_slots and (slot < load.window_end or outcome[SENDERS_ACKED, COUNT] < n_followed):
        if not is_batch:
            n_followed += generate(rules, load, fleet, trial_state, slot, outcome)
        heard_by = drawn_receivers(received, trial_state, slot, rules.n_nodes, p_loss)
        n_sent = play_slot(rules, load, fleet, slot, heard_by)
        if is_batch or load.window_start <= slot < load.window_end:
            outcome[TRANSMISSIONS, SUM] += n_sent
        if heard_by != 0:
            outcome[FALSE_BELIEFS, SUM] += count_false_beliefs(rules, fleet, heard_by)
            note_progress(rules, load, fleet, slot, outcome)
        slot += 1
    outcome[SLOTS, SUM] = slot
    if is_batch:
        close_batch(n_followed, outcome)
    else:
        close_window(load, fleet, n_followed, outcome)


def run_block(
    rules: Rules, load: Load, p_loss: Floats, seed: int, first_trial: int, received: Ints, outcomes: Ints
) -> None:
    """Play trials one after the other in the memory of one fleet."""
    fleet = new_fleet(rules, load)
    for index in range(len(outcomes)):
        trial_state = trial_key(seed, first_trial + index)
        run_trial(rules, load, fleet, p_loss, trial_state, received[index], outcomes[index])


def run_trials(
    rules: Rules, load: Load, p_loss: Floats, seed: int, first_trial: int, received: Ints, outcomes: Ints
) -> None:
    """Play the trials `first_trial`, `first_trial` + 1, ... of one policy.

    Args:
        p_loss: loss probability of the link from row to column, shape (n_nodes, n_nodes); 1 on the diagonal.
        received: memory of who received what, shape (n_trials, any), at first all `NOT_DRAWN`; to be shared by
            policies that meet the same seed, trials and loss probabilities.
        outcomes: takes sum, count and censored number of every quantity, shape (n_trials, N_QUANTITIES, 3).
    """
    run_block(rules, load, p_loss, seed, first_trial, received, outcomes)


def run_narrow_trials(
    rules: Rules, load: Load, p_loss: Floats, seed: int, first_trial: int, received: Ints, outcomes: Ints
) -> None:
    """`run_trials` where all items fit into one word: with that constant the compiler drops every loop over words."""
    narrow = Rules(rules.acknowledgement, rules.repeat, rules.carrier_evidence, rules.n_nodes, 1)
    run_block(narrow, load, p_loss, seed, first_trial, received, outcomes)
