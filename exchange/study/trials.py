"""Bit-sliced slot loop of the policy study: 64 trials per word, one per lane.

Method of Biham, "A fast new DES implementation in software", 1997. Bit t of a word is the state in the trial of lane t.
Headers follow the policy's own rule (`exchange.policy.acknowledgement`), which combines words; around it are loops over
slots, nodes and items. All lanes are in the same slot of a TDMA frame. A trial that ends frees its lane for the next
one at the end of the frame.

Receptions are drawn trial by trial, in words of a few slots, and cached for the next policy. The words of all lanes are
transposed before use: from slots and nodes of a trial to trials of a slot and node.

Plain Python that `exchange.study.compiler` compiles; uncompiled it gives the same results slowly.
"""

from collections.abc import Callable
from functools import lru_cache
from math import ceil, frexp
from typing import NamedTuple

import numpy as np

from exchange.channel.loss import link_draw, slot_key, trial_key
from exchange.policy.acknowledgement import Acknowledgement, layout, members
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
"""Trials that run at once."""
N_DIGITS = 32
"""Binary digits of a number of transmissions."""
WORD_BITS = 63
"""Bits used of a word of draws; the sign bit stays 0."""

Header = Callable[[int, int, int, int], int]
"""Header rule of an acknowledgement."""


class Layouts(NamedTuple):
    """Header layouts by slot, over the period of layout and ring of two frames.

    Attributes:
        n_bits: [slot] bits of the header.
        place, node: [slot, bit] ring place of the acknowledged packet, and the receiver.
        mine, others: [slot, bit] all bits if the sender is the receiver; if that packet is not its own.
        relays: nodes store acknowledgements in received headers.
        infers: the header depends on known holders of a packet's items.
    """

    n_bits: Ints
    place: Ints
    node: Ints
    mine: Ints
    others: Ints
    relays: bool
    infers: bool


class Fleet(NamedTuple):
    """State of all nodes in all lanes; `place` is a slot in the ring of two frames."""

    known: Ints  # [node, place] lanes in which the node received the packet, or sent it
    loaded: Ints  # [place, column] lanes in which the packet had the item
    some: Ints  # [place] lanes in which the packet had any
    said: (
        Ints  # [place, earlier place, receiver] lanes in which the packet acknowledges the earlier one for the receiver
    )
    holders: Ints  # [node, column, holder] lanes in which the node believes the holder to hold the item
    settled: Ints  # [node, column] lanes in which the node believes all to hold it
    done: Ints  # [node] lanes in which it believes so of all items
    acks: Ints  # [bit] of the header that is sent
    weights: Ints  # [lane, node, column] of the queue of each node
    reached: Ints  # [stage, column] lanes in which the item has reached the stage


class Lanes(NamedTuple):
    """State of each lane beside its nodes."""

    trials: Ints  # [lane] number of its trial, counted from the first that is played
    numbers: Ints  # [lane] number of its trial in the study
    began_frame: Ints  # [lane]
    n_followed: Ints  # [lane] items followed to their end
    drawn: Ints  # [slot * n_nodes + node] lanes in which the node receives the packet of the slot, of a few slots
    digits: Ints  # [digit] lanes whose transmission counter has the digit 1
    born_slot: Ints  # [lane, column] see `Items`
    free_slot: Ints  # [lane, column]
    born: Ints  # [place] columns of new items; scratch


@lru_cache(maxsize=16)  # costs as much as a few hundred trials
def layouts_of(kind: Acknowledgement, n_nodes: int) -> Layouts:
    """Compute the header layouts of an acknowledgement."""
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
    """Allocate the state of all nodes."""
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
    """Allocate the state of all lanes."""
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
    """Bit of the lane in a signed word."""
    return 1 << lane if lane < LANES - 1 else -1 << lane


def first_lane(lanes: int) -> int:
    """Return the lowest lane of a set; a power of two is an exact float.

    >>> [first_lane(lanes) for lanes in (1, 0b11000, lane_bit(63))]
    [0, 3, 63]
    """
    lanes = int(lanes)
    return frexp(float(lanes & -lanes))[1] - 1


def count(digits: Ints, lanes: int) -> None:
    """Add 1 to the bit-sliced counters of these lanes."""
    digit = 0
    while lanes != 0:
        carried = digits[digit] & lanes
        digits[digit] ^= lanes
        lanes = carried
        digit += 1


def counted(digits: Ints, lane: int) -> int:
    """Read the counter of a lane."""
    number = 0
    for digit in range(len(digits)):
        number += (digits[digit] >> lane & 1) << digit
    return number


def own_slot(lanes: Lanes, lane: int, n_nodes: int, frame: int, owner: int) -> int:
    """Return the slot number within the trial of a lane."""
    return int((frame - lanes.began_frame[lane]) * n_nodes + owner)


def key_of(lanes: Lanes, lane: int, seed: int) -> int:
    """Return the generator key of a lane's trial; recomputed, since it needs all 64 bits."""
    return trial_key(seed, int(lanes.numbers[lane]))


def items_of(lanes: Lanes, lane: int) -> Items:
    """Return the items of a lane's trial."""
    return Items(lanes.born_slot[lane], lanes.free_slot[lane])


# Receptions ---------------------------------------------------------------------------------------


def slots_of_word(n_nodes: int) -> int:
    """Number of slots with receptions in one word: as many as fit, at most a frame.

    >>> [slots_of_word(n_nodes) for n_nodes in (2, 5, 10, 64)]
    [2, 5, 6, 1]
    """
    return max(1, min(n_nodes, WORD_BITS // n_nodes))


def threshold(p_loss: float) -> int:
    """Return the least `link_draw` of a packet that is not lost, for integer comparison.

    >>> threshold(0.0), threshold(1.0) == 2**53
    (0, True)
    """
    return ceil(p_loss * 2.0**53)


def thresholds_of(p_loss: Floats) -> Ints:
    """Return the thresholds of all links, same shape."""
    thresholds = np.zeros(p_loss.shape, np.int64)
    for sender in range(len(p_loss)):
        for receiver in range(len(p_loss)):
            thresholds[sender, receiver] = threshold(p_loss[sender, receiver])
    return thresholds


def draw_word(key: int, frame_slot: int, first: int, n_slots: int, n_nodes: int, thresholds: Ints) -> int:
    """Draw the receptions of some slots: bit n * n_nodes + node for the n-th slot."""
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
    """Transpose a bit matrix, first `n_rows` words only (Warren, Hacker's Delight, 7-3)."""
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
    """Set `lanes.drawn` to the receptions of some slots of the frame, cached or drawn."""
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
    """Open a slot at all nodes and compose its owner's header.

    Acknowledgements of a packet are shared: they count for each node that received it, until the next slot of the
    sender that they refer to (`PacketLog` of a vehicle). ``at`` is the slot modulo the period of layouts, ``place`` its
    ring place.
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
    """Fill the owner's packet behind its header with items that it believes a node to lack."""
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
    """Record the lanes in which a packet has any item."""
    some = 0
    for column in range(fleet.loaded.shape[1]):
        some |= fleet.loaded[place, column]
    fleet.some[place] = some


def choose(weights: Ints, loaded: Ints, lane: int, room: int) -> None:
    """Keep the candidates of greatest weight that fit one lane's packet; of equals the first.

    The weight of a candidate grows by its need priority, here 1, in each own slot and restarts at 0 when it is sent
    (Maurelli et al., section 6). `exchange.policy.queue` implements the same rule incrementally.

    Args:
        weights: by column, of the sender.
        loaded: by column, lanes with the item queued; the lane is cleared for items not chosen.
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
        weights[heaviest] = -1  # marks a chosen item; reset below
    for column in range(len(loaded)):
        if weights[column] < 0:
            weights[column] = 0
        else:
            loaded[column] &= ~bit


def hear(
    layouts: Layouts, rules: PolicyRules, load: Load, fleet: Fleet, at: int, owner: int, place: int, node: int,
    heard: int,
) -> None:  # fmt: skip
    """Process the packet of a slot at a node in the lanes `heard`; others as in `acknowledge`."""
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
    """Update the items that a node believes all nodes to hold."""
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
    """Run one slot of the bound: each receiver takes lacked items that fit, rarest first.

    A packet carries all knowledge of its sender about holders, without a header. No policy receives more. For a single
    item this is a lower bound of the time in every trial. For several items, rarest first is a good heuristic, not
    proved optimal; coded packets may also use receptions that bring no item here. Transmissions count by the receiver
    that takes most.
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
    """Transfer lacked items of the owner to a node, rarest first; return how many."""
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
    """Count receivers with a false belief that a peer holds an item."""
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
    """Record items that reach a stage in this slot; return lanes with one at the last stage."""
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
    """Start a new item in a column, in some lanes; clear the state of the old one."""
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
    """Start trials in idle lanes; return these lanes."""
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
    """Clear the state of all lanes but `kept`."""
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
    """Generate the Poisson arrivals of a slot; return lanes whose slot is in the window."""
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
    """Close the trials of `asked` that end with a slot; return their lanes."""
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
    """Run the trials `first_trial`, `first_trial` + 1, ... of one policy.

    Args:
        header: rule of the acknowledgement, or its compiled form.
        p_loss: loss probability from row to column, shape (n_nodes, n_nodes); 1 on the diagonal.
        received: cache of receptions, shape (any, n_trials), initially zero; shared by policies with the same seed,
            trials and loss probabilities.
        outcomes: filled with sum, count and censored number of every quantity, shape (n_trials, N_QUANTITIES, 3).
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
