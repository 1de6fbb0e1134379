"""The slot loop of the policy study: 64 trials to a word, a lane each (Biham, "A fast new DES implementation in
software", 1997).

Bit t of a word says whether something holds in the trial of lane t. What headers state is the policy's own rule
(`exchange.ack.Acknowledgement.header`), which combines words; around it stand loops over slots, nodes and items. All
lanes are in the same slot of a TDMA frame. A trial that ends leaves its lane to the next one at the end of the frame.

Which nodes receive a packet is drawn trial by trial, in words of a few slots, and remembered for the next policy. The
lanes' words are transposed before they are played: from slots and nodes of a trial to trials of a slot and node.

Plain Python that `exchange.study.compiler` compiles; uncompiled it does the same, slowly.
"""

from collections.abc import Callable
from functools import lru_cache
from math import ceil, frexp
from typing import NamedTuple

import numpy as np

from exchange.ack import Acknowledgement, layout, members
from exchange.acoustics.loss import link_draw, slot_key, trial_key
from exchange.study.trial import (
    DELIVERED,
    FALSE_BELIEFS,
    N_STAGES,
    NEVER,
    SENDERS_ACKED,
    SOURCE_ACKED,
    SUM,
    TRANSMISSIONS,
    Floats,
    Ints,
    Items,
    Load,
    PolicyRules,
    close,
    generate,
    is_over,
    n_columns_of,
    note_item,
)

LANES = 64
"""Trials that are played at once."""
N_DIGITS = 32
"""Binary digits of a number of transmissions."""
WORD_BITS = 63
"""Bits of a word of draws: one less than it has, so that all are positive."""

Header = Callable[[int, int, int, int], int]
"""Rule of an acknowledgement: what a header states."""


class Layouts(NamedTuple):
    """What headers carry, by slot, until layout and place in the ring of two frames repeat.

    Attributes:
        n_bits: [slot] bits of the header.
        place, node: [slot, bit] place in the ring of the packet that a bit is about, and who received it.
        mine, others: [slot, bit] all bits if the sender is who received it; if that packet is not its own.
        relays: nodes keep what headers state.
        infers: the header goes by who holds the items of a packet.
    """

    n_bits: Ints
    place: Ints
    node: Ints
    mine: Ints
    others: Ints
    relays: bool
    infers: bool


class Fleet(NamedTuple):
    """What all nodes know, in all lanes; `place` is a slot in the ring of two frames."""

    known: Ints  # [node, place] lanes in which the node received the packet, or sent it
    loaded: Ints  # [place, column] lanes in which the packet had the item
    some: Ints  # [place] lanes in which the packet had any
    said: Ints  # [place, earlier place, receiver] lanes in which the packet stated that the receiver received one
    holders: Ints  # [node, column, holder] lanes in which the node believes the holder to hold the item
    settled: Ints  # [node, column] lanes in which the node believes all to hold it
    done: Ints  # [node] lanes in which it believes so of all items
    acks: Ints  # [bit] of the header that is sent
    weights: Ints  # [lane, node, column] of the queue of each node
    reached: Ints  # [stage, column] lanes in which the item has reached the stage


class Lanes(NamedTuple):
    """What is known of each lane beside the state of its nodes."""

    trials: Ints  # [lane] number of its trial, counted from the first that is played
    numbers: Ints  # [lane] number of its trial in the study
    began_frame: Ints  # [lane]
    n_followed: Ints  # [lane] items whose end is awaited
    drawn: Ints  # [slot * n_nodes + node] lanes in which the node receives the packet of the slot, of a few slots
    digits: Ints  # [digit] lanes in whose number of transmissions the digit is 1
    born_slot: Ints  # [lane, column] see `Items`
    free_slot: Ints  # [lane, column]
    born: Ints  # [place] columns of new items; scratch


@lru_cache(maxsize=16)  # takes as long as a few hundred trials
def layouts_of(kind: Acknowledgement, n_nodes: int) -> Layouts:
    """The layouts of an acknowledgement."""
    ring = 2 * n_nodes
    carried: list[list[tuple[int, int, int, int]]] = []
    for slot in range(ring * kind.period_frames):
        owner, bits = slot % n_nodes, []
        for ago, nodes in layout(kind, n_nodes, slot // n_nodes % kind.period_frames, owner):
            for node in members(nodes):
                bits.append(((slot - ago) % ring, node, -int(node == owner), -int(ago % n_nodes != 0)))
        carried.append(bits)
    most = max(1, *map(len, carried))
    fields = np.array([[*bits, *[(0, 0, 0, 0)] * (most - len(bits))] for bits in carried], np.int64)
    n_bits, fields = np.array([*map(len, carried)], np.int64), np.ascontiguousarray(fields.transpose(2, 0, 1))
    return Layouts(n_bits, fields[0], fields[1], fields[2], fields[3], kind.relays, kind.infers)


def new_fleet(n_nodes: int, n_columns: int, n_bits: int) -> Fleet:
    """Memory for all trials."""
    return Fleet(
        np.zeros((n_nodes, 2 * n_nodes), np.int64),
        np.zeros((2 * n_nodes, n_columns), np.int64),
        np.zeros(2 * n_nodes, np.int64),
        np.zeros((2 * n_nodes, 2 * n_nodes, n_nodes), np.int64),
        np.zeros((n_nodes, n_columns, n_nodes), np.int64),
        np.zeros((n_nodes, n_columns), np.int64),
        np.zeros(n_nodes, np.int64),
        np.zeros(n_bits, np.int64),
        np.zeros((LANES, n_nodes, n_columns), np.int64),
        np.zeros((N_STAGES, n_columns), np.int64),
    )


def new_lanes(n_columns: int) -> Lanes:
    """Memory for all trials."""
    return Lanes(
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(LANES, np.int64),
        np.zeros(N_DIGITS, np.int64),
        np.zeros((LANES, n_columns), np.int64),
        np.zeros((LANES, n_columns), np.int64),
        np.zeros(n_columns, np.int64),
    )


# Lanes --------------------------------------------------------------------------------------------


def lane_bit(lane: int) -> int:
    """The bit of the lane in a signed word."""
    return 1 << lane if lane < LANES - 1 else -1 << lane


def first_lane(lanes: int) -> int:
    """The lowest of some lanes; a power of two is a float without loss.

    >>> [first_lane(lanes) for lanes in (1, 0b11000, lane_bit(63))]
    [0, 3, 63]
    """
    lanes = int(lanes)
    return frexp(float(lanes & -lanes))[1] - 1


def count(digits: Ints, lanes: int) -> None:
    """Add 1 to the numbers of these lanes, of which every word has one binary digit."""
    digit = 0
    while lanes != 0:
        carried = digits[digit] & lanes
        digits[digit] ^= lanes
        lanes = carried
        digit += 1


def counted(digits: Ints, lane: int) -> int:
    """The number of a lane."""
    number = 0
    for digit in range(len(digits)):
        number += (digits[digit] >> lane & 1) << digit
    return number


def own_slot(lanes: Lanes, lane: int, n_nodes: int, frame: int, owner: int) -> int:
    """Slot of the trial of a lane."""
    return int((frame - lanes.began_frame[lane]) * n_nodes + owner)


def key_of(lanes: Lanes, lane: int, seed: int) -> int:
    """State of the generator of the trial of a lane; as a word of all 64 bits it is not kept."""
    return trial_key(seed, int(lanes.numbers[lane]))


def items_of(lanes: Lanes, lane: int) -> Items:
    """Items of the trial of a lane."""
    return Items(lanes.born_slot[lane], lanes.free_slot[lane])


# Who receives what --------------------------------------------------------------------------------


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
                word |= heard * lane_bit(n * n_nodes + node)
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
    n_nodes: int,
    lanes: Lanes,
    seed: int,
    frame: int,
    first: int,
    n_slots: int,
    thresholds: Ints,
    playing: int,
    received: Ints,
) -> None:
    """Put into `lanes.drawn` who receives the packets of some slots of the frame, remembered or drawn."""
    word_slots = slots_of_word(n_nodes)
    words_of_frame = -(-n_nodes // word_slots)
    for lane in range(LANES):
        word = 0
        if playing >> lane & 1:
            own_frame = int(frame - lanes.began_frame[lane])
            at = own_frame * words_of_frame + first // word_slots
            is_remembered = at < len(received)
            if is_remembered:
                word = received[at, lanes.trials[lane]]
            if word == 0:
                word = draw_word(key_of(lanes, lane, seed), own_frame * n_nodes, first, n_slots, n_nodes, thresholds)
                if is_remembered:
                    received[at, lanes.trials[lane]] = word
        lanes.drawn[lane] = word
    transpose(lanes.drawn, n_slots * n_nodes)


# One slot -----------------------------------------------------------------------------------------


def acknowledge(header: Header, layouts: Layouts, fleet: Fleet, at: int, owner: int, place: int) -> None:
    """Open a slot at all nodes, and let its owner write its header.

    What a packet stated is shared: it counts for a node that received it, until the sender of the packet that it is
    about has another slot. See `exchange.ack.PacketLog`.

    Args:
        header, layouts: of the acknowledgement.
        fleet: all nodes.
        at: slot, until the layouts repeat.
        owner: of the slot.
        place: of the slot in the ring.
    """
    n_nodes = len(fleet.known)
    known, holders = fleet.known[owner], fleet.holders[owner]
    for node in range(n_nodes):
        fleet.known[node, place] = 0
    if layouts.relays:
        fleet.said[place] = 0
    for bit in range(layouts.n_bits[at]):
        earlier, node = layouts.place[at, bit], layouts.node[at, bit]
        received, held = known[earlier] & layouts.others[at, bit], 0
        if layouts.infers:
            held = fleet.some[earlier] & received
            if held != 0:
                for column in range(len(holders)):
                    held &= holders[column, node] | ~fleet.loaded[earlier, column]
        said = 0
        at_peer = place
        for _ in range((owner - earlier) % n_nodes if layouts.relays else 0):
            at_peer = at_peer - 1 if at_peer > 0 else 2 * n_nodes - 1
            said |= fleet.said[at_peer, earlier, node] & known[at_peer]
        fleet.acks[bit] = header(said, layouts.mine[at, bit], received, held)
        if layouts.relays:
            fleet.said[place, earlier, node] = fleet.acks[bit]
    known[place] = -1


def fill(rules: PolicyRules, load: Load, fleet: Fleet, owner: int, place: int, room_bits: int, playing: int) -> None:
    """Let the owner of a slot put into its packet items that it knows some node to lack.

    Args:
        rules: of the policy.
        load: what there is to send.
        fleet: all nodes.
        owner: of the slot.
        place: of the slot in the ring.
        room_bits: behind the header.
        playing: lanes.
    """
    for column in range(n_columns_of(load)):
        is_sender = rules.repeat or column // load.columns_per_source == owner
        open_lanes = fleet.holders[owner, column, owner] & ~fleet.settled[owner, column]
        fleet.loaded[place, column] = open_lanes if is_sender else 0
    if room_bits // load.item_bits < n_columns_of(load):
        for lane in range(LANES):
            if playing >> lane & 1:
                choose(fleet.weights[lane, owner], fleet.loaded[place], lane, room_bits // load.item_bits)
    note_load(fleet, place)


def note_load(fleet: Fleet, place: int) -> None:
    """Note where a packet has any items."""
    some = 0
    for column in range(fleet.loaded.shape[1]):
        some |= fleet.loaded[place, column]
    fleet.some[place] = some


def choose(weights: Ints, loaded: Ints, lane: int, room: int) -> None:
    """Leave in a packet, of one lane, the candidates of greatest weight that have room; of equals the first ones.

    The weight of a candidate grows by its need priority, here 1, in each own slot; when it is sent, it restarts at 0
    (Maurelli et al., section 6). `exchange.queueing.queue` chooses the same without looking at all that waits.

    Args:
        weights: by column, of the candidates of the sender.
        loaded: by column, lanes in which the item waits; of those not chosen it is taken out.
        lane: of the trial.
        room: number of items.
    """
    bit = lane_bit(lane)
    for column in range(len(loaded)):
        weights[column] += loaded[column] >> lane & 1
    for _ in range(room):
        heaviest = -1
        for column in range(len(loaded)):
            is_left = loaded[column] & bit != 0 and weights[column] >= 0
            if is_left and (heaviest < 0 or weights[column] > weights[heaviest]):
                heaviest = column
        if heaviest < 0:
            break
        weights[heaviest] = -1  # for now
    for column in range(len(loaded)):
        if weights[column] < 0:
            weights[column] = 0
        else:
            loaded[column] &= ~bit


def hear(
    layouts: Layouts, rules: PolicyRules, load: Load, fleet: Fleet, at: int, owner: int, place: int, node: int,
    heard: int,
) -> None:  # fmt: skip
    """Let a node receive the packet of a slot in the lanes `heard`; other arguments as of `acknowledge`."""
    known, holders = fleet.known[node], fleet.holders[node]
    known[place] = heard
    for column in range(n_columns_of(load) if fleet.some[place] & heard != 0 else 0):
        taken = heard & fleet.loaded[place, column]
        holders[column, node] |= taken
        holders[column, column // load.columns_per_source] |= taken
        if rules.carrier_evidence:
            holders[column, owner] |= taken
    learns, places, receivers = heard & ~fleet.done[node], layouts.place[at], layouts.node[at]
    for bit in range(layouts.n_bits[at] if learns != 0 else 0):
        earlier = places[bit]
        stated = fleet.acks[bit] & known[earlier] & fleet.some[earlier] & learns
        if stated != 0:
            for column in range(len(holders)):
                holders[column, receivers[bit]] |= stated & fleet.loaded[earlier, column]
    if learns != 0:
        settle(fleet, node)


def settle(fleet: Fleet, node: int) -> None:
    """Note which items a node believes all to hold."""
    holders, done = fleet.holders[node], -1
    for column in range(len(holders)):
        all_hold = -1
        for holder in range(holders.shape[1]):
            all_hold &= holders[column, holder]
        fleet.settled[node, column] = all_hold
        done &= all_hold
    fleet.done[node] = done


def pass_freely(
    rules: PolicyRules, load: Load, fleet: Fleet, lanes: Lanes, owner: int, heard: Ints, playing: int, noted: int
) -> None:
    """Play one slot of the bound: each receiver takes what it lacks, as much as has room, first what the fewest hold.

    A packet carries all that its sender knows of the holders, and has no header. No policy hears more than packets let
    it hear. A single item waits for the links alone, so no policy is sooner with it in any trial. With several items
    the choice of the rarest is a good one that is not proved to be the best, and a code may make use of a packet of
    whose items a receiver lacks none. As sent counts what the receiver takes that takes most.
    """
    for lane in range(LANES):
        if playing >> lane & 1:
            n_holders, most = fleet.weights[lane, owner], 0
            for column in range(n_columns_of(load)):
                n_holders[column] = 0
                for node in range(rules.n_nodes):
                    n_holders[column] += fleet.holders[node, column, node] >> lane & 1
            for node in range(rules.n_nodes):
                if heard[node] >> lane & 1:
                    most = max(most, take(load, fleet, n_holders, lane, owner, node))
            for _ in range(most):
                count(lanes.digits, lane_bit(lane) & noted)
    for node in range(rules.n_nodes):
        for column in range(n_columns_of(load) if heard[node] != 0 else 0):
            all_hold = -1
            for holder in range(rules.n_nodes):
                if holder != node:
                    fleet.holders[node, column, holder] |= heard[node] & fleet.holders[owner, column, holder]
                all_hold &= fleet.holders[node, column, holder]
            fleet.settled[node, column] |= heard[node] & all_hold


def take(load: Load, fleet: Fleet, n_holders: Ints, lane: int, owner: int, node: int) -> int:
    """Let a node take what it lacks out of the owner's packet, of items that the fewest held; return how many."""
    room = n_columns_of(load) if load.capacity_bits == NEVER else load.capacity_bits // load.item_bits
    n_taken = 0
    while n_taken < room:
        rarest = -1
        for column in range(n_columns_of(load)):
            lacks = fleet.holders[owner, column, owner] & ~fleet.holders[node, column, node]
            if lacks >> lane & 1 and (rarest < 0 or n_holders[column] < n_holders[rarest]):
                rarest = column
        if rarest < 0:
            return n_taken
        fleet.holders[node, rarest, node] |= lane_bit(lane)
        n_taken += 1
    return n_taken


def note_false_beliefs(n_nodes: int, fleet: Fleet, lanes: Lanes, heard: Ints, playing: int, outcomes: Ints) -> None:
    """Count the receivers that believe a peer to hold something which it lacks."""
    n_columns = fleet.holders.shape[1]
    anywhere = 0
    for column in range(n_columns):
        for holder in range(n_nodes):
            lacked = ~fleet.holders[holder, column, holder]
            for node in range(n_nodes):
                anywhere |= fleet.holders[node, column, holder] & lacked
    if anywhere & playing == 0:
        return
    for node in range(n_nodes):
        wrong = 0
        for column in range(n_columns):
            for holder in range(n_nodes):
                wrong |= fleet.holders[node, column, holder] & ~fleet.holders[holder, column, holder]
        wrong &= heard[node] & playing
        for lane in range(LANES):
            outcomes[lanes.trials[lane], FALSE_BELIEFS, SUM] += wrong >> lane & 1


def note_progress(
    rules: PolicyRules, load: Load, fleet: Fleet, lanes: Lanes, frame: int, owner: int, playing: int, outcomes: Ints
) -> int:
    """Note the items that reach a stage in this slot; return lanes in which one reaches the last."""
    last = 0
    for column in range(n_columns_of(load)):
        origin = column // load.columns_per_source
        delivered = senders = -1
        for node in range(rules.n_nodes):
            delivered &= fleet.holders[node, column, node]
            if rules.repeat:
                senders &= fleet.settled[node, column]
        source = fleet.settled[origin, column]
        for stage in range(N_STAGES):
            now = delivered if stage == DELIVERED else source if stage == SOURCE_ACKED else senders & source
            new = now & playing & ~fleet.reached[stage, column]
            fleet.reached[stage, column] |= new
            if stage == SENDERS_ACKED:
                last |= new
            while new != 0:
                lane = first_lane(new)
                new &= ~lane_bit(lane)
                slot, items = own_slot(lanes, lane, rules.n_nodes, frame, owner), items_of(lanes, lane)
                note_item(rules, load, items, stage, column, slot, outcomes[lanes.trials[lane]])
    return last


# Trials -------------------------------------------------------------------------------------------


def add_item(load: Load, fleet: Fleet, column: int, begun: int) -> None:
    """Give the column to a new item in some lanes; nothing remains of an older one."""
    for node in range(len(fleet.known)):
        for holder in range(len(fleet.known)):
            fleet.holders[node, column, holder] &= ~begun
        fleet.settled[node, column] &= ~begun
        fleet.done[node] &= ~begun
    for stage in range(N_STAGES):
        fleet.reached[stage, column] &= ~begun
    origin = column // load.columns_per_source
    fleet.holders[origin, column, origin] |= begun


def begin(
    load: Load, fleet: Fleet, lanes: Lanes, frame: int, first_trial: int, n_begun: int, n_trials: int,
    idle: int,
) -> int:  # fmt: skip
    """Begin further trials in idle lanes; return these."""
    begun = 0
    while idle != 0 and n_begun < n_trials:
        lane = first_lane(idle)
        idle &= ~lane_bit(lane)
        lanes.trials[lane] = n_begun
        lanes.numbers[lane] = first_trial + n_begun
        lanes.began_frame[lane] = frame
        lanes.n_followed[lane] = n_columns_of(load) if load.rate == 0.0 else 0
        lanes.free_slot[lane] = 0
        fleet.weights[lane] = 0
        n_begun += 1
        begun |= lane_bit(lane)
    forget_lanes(fleet, lanes, ~begun)
    for column in range(n_columns_of(load)):
        add_item(load, fleet, column, begun if load.rate == 0.0 else 0)
    return begun


def forget_lanes(fleet: Fleet, lanes: Lanes, kept: int) -> None:
    """Nobody knows anything in the other lanes."""
    for node in range(fleet.known.shape[0]):
        for place in range(fleet.known.shape[1]):
            fleet.known[node, place] &= kept
    for column in range(fleet.loaded.shape[1]):
        for place in range(fleet.loaded.shape[0]):
            fleet.loaded[place, column] &= kept
        for node in range(fleet.holders.shape[0]):
            fleet.settled[node, column] &= kept
            fleet.done[node] &= kept
            for holder in range(fleet.holders.shape[2]):
                fleet.holders[node, column, holder] &= kept
        for stage in range(N_STAGES):
            fleet.reached[stage, column] &= kept
    for digit in range(N_DIGITS):
        lanes.digits[digit] &= kept


def arrive(
    rules: PolicyRules,
    load: Load,
    fleet: Fleet,
    lanes: Lanes,
    seed: int,
    frame: int,
    owner: int,
    playing: int,
    outcomes: Ints,
) -> int:
    """Let the Poisson arrivals of a slot come in all lanes; return lanes whose slot is in the window."""
    in_window = 0
    for lane in range(LANES):
        if playing >> lane & 1:
            slot, bit = own_slot(lanes, lane, rules.n_nodes, frame, owner), lane_bit(lane)
            if load.window_start <= slot < load.window_end:
                in_window |= bit
            items, outcome = items_of(lanes, lane), outcomes[lanes.trials[lane]]
            lanes.n_followed[lane] += generate(load, items, key_of(lanes, lane, seed), slot, lanes.born, outcome)
            for column in lanes.born:
                if column < 0:
                    break
                add_item(load, fleet, column, bit)
                for node in range(rules.n_nodes):
                    fleet.weights[lane, node, column] = 0
    return in_window


def ended(
    rules: PolicyRules, load: Load, fleet: Fleet, lanes: Lanes, frame: int, owner: int, asked: int, outcomes: Ints
) -> int:
    """Close the trials that end with a slot, of those that are asked for; return their lanes."""
    over = 0
    while asked != 0:
        lane = first_lane(asked)
        asked &= ~lane_bit(lane)
        slot, outcome = own_slot(lanes, lane, rules.n_nodes, frame, owner) + 1, outcomes[lanes.trials[lane]]
        if is_over(load, slot, lanes.n_followed[lane], outcome):
            over |= lane_bit(lane)
            outcome[TRANSMISSIONS, SUM] = counted(lanes.digits, lane)
            acknowledged = fleet.reached[SOURCE_ACKED]
            close(load, items_of(lanes, lane), acknowledged, lane, slot, lanes.n_followed[lane], outcome)
    return over


def run_trials(
    header: Header, layouts: Layouts, rules: PolicyRules, load: Load, p_loss: Floats, seed: int, first_trial: int,
    received: Ints, outcomes: Ints,
) -> None:  # fmt: skip
    """Play the trials `first_trial`, `first_trial` + 1, ... of one policy.

    Args:
        header: rule of the acknowledgement, or its compiled form.
        layouts: of its headers.
        rules: what else the policy says, and the size of the fleet.
        load: what there is to send.
        p_loss: loss probability of the link from row to column, shape (n_nodes, n_nodes); 1 on the diagonal.
        seed: of all random numbers.
        first_trial: number of the first trial.
        received: memory of who received what, shape (any, n_trials), at first all zeros; to be shared by policies that
            meet the same seed, trials and loss probabilities.
        outcomes: takes sum, count and censored number of every quantity, shape (n_trials, N_QUANTITIES, 3).
    """
    n_nodes, n_trials, period = rules.n_nodes, len(outcomes), len(layouts.n_bits)
    fleet, lanes = new_fleet(n_nodes, n_columns_of(load), layouts.node.shape[1]), new_lanes(n_columns_of(load))
    thresholds, word_slots = thresholds_of(p_loss), slots_of_word(n_nodes)
    outcomes[:] = 0
    n_begun = playing = frame = 0
    while n_begun < n_trials or playing != 0:
        if n_begun < n_trials and playing != -1 and frame % (period // (2 * n_nodes)) == 0:
            begun = begin(load, fleet, lanes, frame, first_trial, n_begun, n_trials, ~playing)
            playing |= begun
            for lane in range(LANES):
                n_begun += begun >> lane & 1
        for first in range(0, n_nodes, word_slots):
            n_slots = min(word_slots, n_nodes - first)
            draw(n_nodes, lanes, seed, frame, first, n_slots, thresholds, playing, received)
            for owner in range(first, first + n_slots):
                heard = lanes.drawn[(owner - first) * n_nodes : (owner - first + 1) * n_nodes]
                at, place = (frame * n_nodes + owner) % period, (frame * n_nodes + owner) % (2 * n_nodes)
                noted = playing
                if load.rate != 0.0:
                    noted = arrive(rules, load, fleet, lanes, seed, frame, owner, playing, outcomes)
                if rules.knows_all:
                    pass_freely(rules, load, fleet, lanes, owner, heard, playing, noted)
                else:
                    acknowledge(header, layouts, fleet, at, owner, place)
                    fill(rules, load, fleet, owner, place, load.capacity_bits - layouts.n_bits[at], playing)
                    for column in range(n_columns_of(load)):
                        count(lanes.digits, fleet.loaded[place, column] & noted)
                    for node in range(n_nodes):
                        if heard[node] != 0:
                            hear(layouts, rules, load, fleet, at, owner, place, node, heard[node])
                note_false_beliefs(n_nodes, fleet, lanes, heard, playing, outcomes)
                last = note_progress(rules, load, fleet, lanes, frame, owner, playing, outcomes)
                if load.rate != 0.0 or (frame + 1) * n_nodes >= load.max_slots:
                    last = playing
                playing &= ~ended(rules, load, fleet, lanes, frame, owner, last, outcomes)
        frame += 1
