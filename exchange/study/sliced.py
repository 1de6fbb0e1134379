"""The slot loop of the policy study for a single item: 64 trials to a word, a lane each.

The rules are those of `exchange.ack`, on words of trials instead of words of items (see there). All lanes are in the
same slot of a TDMA frame. A trial that ends leaves its lane to the next one at the end of the frame, so that few lanes
are ever idle. Like `exchange.study.montecarlo`, which plays one trial at a time and comes to the same numbers, this is
plain Python that is compiled.

Who receives what is drawn trial by trial, in words of a few slots, and remembered for the next policy. The lanes' words
are transposed before they are played: from slots and nodes of a trial to trials of a slot and node.
"""

from math import ceil, frexp
from typing import NamedTuple

import numpy as np

from exchange.ack import AckRules
from exchange.acoustics.loss import link_draw, slot_key, trial_key
from exchange.study.montecarlo import open_items, open_slots, pass_packet
from exchange.study.trial import (
    CENSORED,
    COUNT,
    DELIVERED,
    FALSE_BELIEFS,
    N_STAGES,
    SENDERS_ACKED,
    SLOTS,
    SOURCE_ACKED,
    SUM,
    TRANSMISSIONS,
    WORD_BITS,
    Floats,
    Ints,
    Load,
    NodeStates,
    PolicyRules,
    clear,
    new_nodes,
    progress,
)

LANES = 64
"""Trials that are played at once."""
N_DIGITS = 32
"""Binary digits of a number of transmissions."""


class Lanes(NamedTuple):
    """What is known of each lane beside the state of its nodes."""

    trials: Ints  # [lane] number of its trial, counted from the first that is played
    keys: Ints  # [lane] of its trial
    began_frame: Ints  # [lane]
    drawn: Ints  # [slot * n_nodes + node] lanes in which the node receives the packet of the slot, of a few slots
    digits: Ints  # [digit] lanes in whose number of transmissions the digit is 1


def lane_bit(lane: int) -> int:
    """The bit of the lane in a signed word."""
    return 1 << lane if lane < LANES - 1 else -1 << lane


def first_lane(lanes: int) -> int:
    """The lowest of some lanes; a power of two is a float without loss.

    >>> [first_lane(lanes) for lanes in (1, 0b11000, lane_bit(63))]
    [0, 3, 63]
    """
    return frexp(float(lanes & -lanes))[1] - 1


def slots_of_word(n_nodes: int) -> int:
    """Slots whose receivers are drawn into one word: as many as it takes, and at most a frame.

    >>> [slots_of_word(n_nodes) for n_nodes in (2, 5, 10, 64)]
    [2, 5, 6, 1]
    """
    return max(1, min(n_nodes, WORD_BITS // n_nodes))


def threshold(p_loss: float) -> int:
    """The least `link_draw` of a packet that is not lost: draws are compared as whole numbers.

    >>> threshold(0.0), threshold(1.0) == 2**53
    (0, True)
    """
    return ceil(p_loss * 2.0**53)


def thresholds_of(p_loss: Floats) -> Ints:
    """The thresholds of all links, same shape."""
    thresholds = np.zeros(p_loss.shape, np.int64)
    for sender in range(len(p_loss)):
        for receiver in range(len(p_loss)):
            thresholds[sender, receiver] = threshold(p_loss[sender, receiver])
    return thresholds


def draw_word(key: int, frame_slot: int, first: int, n_slots: int, n_nodes: int, thresholds: Ints) -> int:
    """Draw who receives the packets of some slots of a frame in a trial: bit n * n_nodes + node for the n-th slot."""
    word = 0
    for n in range(n_slots):
        owner = first + n
        key_of_slot = slot_key(key, frame_slot + owner)
        for node in range(n_nodes):
            if node != owner:
                heard = int(link_draw(key_of_slot, owner, node) >= thresholds[owner, node])
                word |= heard << (n * n_nodes + node)
    return word


def transpose(words: Ints, n_rows: int) -> None:
    """Bit i of word k becomes bit k of word i, of which so many are needed (Warren, Hacker's Delight, 7-3)."""
    width, mask = LANES // 2, (1 << LANES // 2) - 1
    while width != 0:
        for first in range(0, n_rows, 2 * width):
            for k in range(first, first + width):
                changed = (words[k] >> width ^ words[k + width]) & mask
                words[k] ^= changed << width
                words[k + width] ^= changed
        width >>= 1
        mask ^= mask << width


def draw(
    rules: PolicyRules,
    lanes: Lanes,
    frame: int,
    first: int,
    n_slots: int,
    thresholds: Ints,
    playing: int,
    received: Ints,
) -> None:
    """Put into `lanes.drawn` who receives the packets of some slots of the frame, remembered or drawn."""
    n_nodes = rules.n_nodes
    word_slots = slots_of_word(n_nodes)
    words_of_frame = -(-n_nodes // word_slots)
    for lane in range(LANES):
        word = 0
        if playing >> lane & 1:
            own_frame = frame - lanes.began_frame[lane]
            at = own_frame * words_of_frame + first // word_slots
            is_remembered = at < len(received)
            if is_remembered:
                word = received[at, lanes.trials[lane]]
            if word == 0:
                word = draw_word(lanes.keys[lane], own_frame * n_nodes, first, n_slots, n_nodes, thresholds)
                if is_remembered:
                    received[at, lanes.trials[lane]] = word
        lanes.drawn[lane] = word
    transpose(lanes.drawn, n_slots * n_nodes)


def begin(
    nodes: NodeStates, lanes: Lanes, frame: int, seed: int, first_trial: int, n_begun: int, n_trials: int, playing: int
) -> int:
    """Begin further trials in idle lanes; returns these."""
    begun = 0
    idle = ~playing
    while idle != 0 and n_begun < n_trials:
        lane = first_lane(idle)
        idle &= ~lane_bit(lane)
        lanes.trials[lane] = n_begun
        lanes.keys[lane] = trial_key(seed, first_trial + n_begun)
        lanes.began_frame[lane] = frame
        n_begun += 1
        begun |= lane_bit(lane)
    keep_lanes(nodes, lanes, ~begun)
    nodes.holds[0] |= begun
    nodes.believes[0, 0] |= begun
    return begun


def keep_lanes(nodes: NodeStates, lanes: Lanes, kept: int) -> None:
    """Nobody has heard or holds anything in the other lanes."""
    for node in range(len(nodes.holds)):
        nodes.holds[node] &= kept
        nodes.settled[node] &= kept
        for at in range(nodes.heard.shape[1]):
            nodes.heard[node, at] &= kept
            nodes.believes[node, at] &= kept
        for at in range(nodes.content.shape[1]):
            nodes.content[node, at] &= kept
    for digit in range(N_DIGITS):
        lanes.digits[digit] &= kept


def note_false_beliefs(
    rules: PolicyRules, nodes: NodeStates, lanes: Lanes, receivers: Ints, playing: int, outcomes: Ints
) -> None:
    """Count the receivers that believe a peer to hold something which it lacks."""
    anywhere = 0
    for i in range(rules.n_nodes):
        believed = 0
        for node in range(rules.n_nodes):
            believed |= nodes.believes[node, i]
        anywhere |= believed & ~nodes.holds[i]
    if anywhere & playing == 0:
        return
    for node in range(rules.n_nodes):
        wrong = 0
        for i in range(rules.n_nodes):
            wrong |= nodes.believes[node, i] & ~nodes.holds[i]
        wrong &= receivers[node] & playing
        for lane in range(LANES):
            outcomes[lanes.trials[lane], FALSE_BELIEFS, SUM] += wrong >> lane & 1


def count(digits: Ints, lanes: int) -> None:
    """Add 1 to the numbers of these lanes, of which every word has one binary digit."""
    digit = 0
    while lanes != 0:
        carried = digits[digit] & lanes
        digits[digit] ^= lanes
        lanes = carried
        digit += 1


def note(lanes: Lanes, frame: int, n_nodes: int, slot: int, stage: int, new: int, outcomes: Ints) -> None:
    """Note the lanes whose trials reach a stage in a slot of the frame."""
    while new != 0:
        lane = first_lane(new)
        new &= ~lane_bit(lane)
        n_slots = (frame - lanes.began_frame[lane]) * n_nodes + slot + 1
        outcome = outcomes[lanes.trials[lane]]
        outcome[stage, SUM] = n_slots
        outcome[stage, COUNT] = 1
        outcome[stage, CENSORED] = 0
        if stage == SENDERS_ACKED:
            outcome[SLOTS, SUM] = n_slots
            outcome[TRANSMISSIONS, COUNT] = 1
            digit = 0
            while n_slots >> digit != 0:
                outcome[TRANSMISSIONS, SUM] += (lanes.digits[digit] >> lane & 1) << digit
                digit += 1


def at_bound(lanes: Lanes, frame: int, n_nodes: int, slot: int, max_slots: int) -> int:
    """Lanes whose trials have come to the bound with this slot."""
    ended = 0
    for lane in range(LANES):
        if (frame - lanes.began_frame[lane]) * n_nodes + slot + 1 >= max_slots:
            ended |= lane_bit(lane)
    return ended


def run_sliced(
    kind: AckRules,
    rules: PolicyRules,
    load: Load,
    p_loss: Floats,
    seed: int,
    first_trial: int,
    received: Ints,
    outcomes: Ints,
) -> None:
    """Play the trials `first_trial`, `first_trial` + 1, ... of one policy.

    Args:
        kind: acknowledgement of the policy, or its compiled form; its functions leave bits sliced.
        rules: what else the policy says, and the size of the fleet; sets of nodes have a word for each.
        load: a single item that fits into every packet.
        p_loss: loss probability of the link from row to column, shape (n_nodes, n_nodes).
        seed: of all random numbers.
        first_trial: number of the first trial.
        received: memory of who received what, shape (any, n_trials), at first all zeros; to be shared by policies that
            meet the same seed, trials and loss probabilities.
        outcomes: takes sum, count and censored number of every quantity, shape (n_trials, N_QUANTITIES, 3).
    """
    n_nodes, n_trials, max_slots = rules.n_nodes, len(outcomes), load.max_slots
    nodes = new_nodes(rules, load, kind.period_frames)
    lanes = Lanes(
        np.zeros(LANES, np.int64), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64),
        np.zeros(N_DIGITS, np.int64),
    )  # fmt: skip
    thresholds = thresholds_of(p_loss)
    clear(nodes)
    nodes.origins[0] = -1
    outcomes[:] = 0
    outcomes[:, :N_STAGES, CENSORED] = 1
    outcomes[:, SLOTS, SUM] = max_slots
    word_slots = slots_of_word(n_nodes)
    n_begun = playing = delivered = source = frame = first_frame = 0
    while n_begun < n_trials or playing != 0:
        if n_begun < n_trials and playing != -1 and frame % kind.period_frames == 0:
            begun = begin(nodes, lanes, frame, seed, first_trial, n_begun, n_trials, playing)
            playing |= begun
            delivered &= ~begun
            source &= ~begun
            for lane in range(LANES):
                n_begun += begun >> lane & 1
        for first in range(0, n_nodes, word_slots):
            n_slots = min(word_slots, n_nodes - first)
            draw(rules, lanes, frame, first, n_slots, thresholds, playing, received)
            for slot in range(first, first + n_slots):
                receivers = lanes.drawn[(slot - first) * n_nodes : (slot - first + 1) * n_nodes]
                open_slots(kind, rules, nodes, slot)
                nodes.packet[0] = open_items(rules, nodes, slot, 0)
                count(lanes.digits, nodes.packet[0] & playing)
                pass_packet(kind, rules, nodes, frame, slot, receivers)
                note_false_beliefs(rules, nodes, lanes, receivers, playing, outcomes)
                held_by_all, source_acked, senders_acked = progress(rules, nodes, 0)
                new = held_by_all & playing & ~delivered
                if new != 0:
                    delivered |= new
                    note(lanes, frame, n_nodes, slot, DELIVERED, new, outcomes)
                new = source_acked & playing & ~source
                if new != 0:
                    source |= new
                    note(lanes, frame, n_nodes, slot, SOURCE_ACKED, new, outcomes)
                new = senders_acked & playing
                if new != 0:
                    playing &= ~new
                    note(lanes, frame, n_nodes, slot, SENDERS_ACKED, new, outcomes)
                if (frame - first_frame + 1) * n_nodes >= max_slots:
                    playing &= ~at_bound(lanes, frame, n_nodes, slot, max_slots)
        frame += 1
