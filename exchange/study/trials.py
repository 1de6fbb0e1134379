"""Bit-sliced slot loop of the policy study: loops over slots, nodes and items, 64 trials per word.

Headers follow the policy's own rule (`exchange.policy.acknowledgement`), which combines words. Lanes and their results
are in `exchange.study.lanes`. `run_trials` takes the rule of a slot: here that of the policies of the paper and of the
bound, in `exchange.study.stating` that of the policies that report received sets.

Plain Python that `exchange.study.compiler` compiles; uncompiled it gives the same results slowly.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from exchange.channel.loss import link_uniform, slot_key
from exchange.policy.acknowledgement import Acknowledgement, layout, members
from exchange.study.lanes import (
    DELIVERED,
    FALSE_BELIEFS,
    LANES,
    N_STAGES,
    NEVER,
    OFFERED,
    REFUSED,
    SENDERS_ACKED,
    SOURCE_ACKED,
    SUM,
    Case,
    Ints,
    Lanes,
    allocated,
    count,
    draw,
    ended,
    first_lane,
    free_column,
    key_of,
    lane_bit,
    n_columns_of,
    note_item,
    own_slot,
    poisson_number,
    sizes_of,
    slots_of_word,
)

Header = Callable[[int, int, int, int], int]

ALL_LANES = -1


class Layouts(NamedTuple):
    """Header layouts by slot, over the period of layout and ring of two frames.

    Attributes:
        n_bits: [slot] bits of the header.
        place, node: [slot, bit] ring place of the acknowledged packet, and its receiver.
        n_headers: [slot, bit] slots before it whose headers count: those since the sender of the acknowledged packet
            sent again, or since that packet.
    """

    n_bits: Ints
    place: Ints
    node: Ints
    n_headers: Ints


class Slot(NamedTuple):
    """Slot of a frame, with its numbers since the first frame, in the ring and in the period of layouts."""

    frame: int
    owner: int
    number: int
    place: int
    at: int


def slot_of(layouts: Layouts, n_nodes: int, frame: int, owner: int) -> Slot:
    """Return a slot of a frame."""
    frames = len(layouts.n_bits) // n_nodes
    return Slot(frame, owner, frame * n_nodes + owner, frame % 2 * n_nodes + owner, frame % frames * n_nodes + owner)


class Fleet(NamedTuple):
    """State of all nodes in all lanes; `place` is a slot in the ring of two frames."""

    known: Annotated[Ints, "node", "place"]  # lanes in which the node received the packet, or sent it
    loaded: Annotated[Ints, "place", "column"]  # lanes in which the packet had the item
    some: Annotated[Ints, "place"]  # lanes in which the packet had any
    reported: Annotated[Ints, "place", "place", "receiver"]  # lanes: it reports that a receiver has an earlier one
    holders: Annotated[Ints, "node", "column", "holder"]  # lanes in which the node believes the holder to hold the item
    settled: Annotated[Ints, "node", "column"]  # lanes in which the node believes all to hold it
    done: Annotated[Ints, "node"]  # lanes in which it believes so of all items
    acks: Annotated[Ints, "bit"]  # of the header that is sent
    weights: Annotated[Ints, "lane", "node", "column"]  # of the queue of each node


@lru_cache(maxsize=16)  # costs as much as a few hundred trials
def layouts_of(kind: Acknowledgement, n_nodes: int) -> Layouts:
    """Compute the header layouts of an acknowledgement."""
    ring = 2 * n_nodes
    carried: list[list[tuple[int, int, int]]] = []
    for slot in range(ring * kind.period_frames):
        facts = layout(kind, n_nodes, slot // n_nodes % kind.period_frames, slot % n_nodes)
        lasting = ring if kind.lasts else n_nodes
        carried.append([((slot - ago) % ring, node, ago % lasting) for ago, nodes in facts for node in members(nodes)])
    n_bits = np.array([*map(len, carried)], np.int64)
    fields = np.zeros((3, len(carried), max(1, *n_bits)), np.int64)
    for slot, bits in enumerate(carried):
        fields[:, slot, : len(bits)] = np.reshape(bits, (-1, 3)).T
    return Layouts(n_bits, *fields)


def new_fleet(case: Case, layouts: Layouts) -> Fleet:
    """Allocate the state of all nodes."""
    return allocated(Fleet, sizes_of(case) | {"bit": layouts.node.shape[1]})


# One slot -----------------------------------------------------------------------------------------


def acknowledge(header: Header, layouts: Layouts, case: Case, fleet: Fleet, slot: Slot) -> None:
    """Open a slot at all nodes and compose its owner's header.

    Acknowledgements of a packet are shared: they count for each node that received it, as long as the kind keeps them
    (`Layouts.n_headers`; `PacketLog` of a vehicle).
    """
    n_nodes, owner, place, at = case.n_nodes, slot.owner, slot.place, slot.at
    known, holders = fleet.known[owner], fleet.holders[owner]
    for node in range(n_nodes):
        fleet.known[node, place] = 0
    if case.relays:
        fleet.reported[place] = 0
    for bit in range(layouts.n_bits[at]):
        earlier, node = layouts.place[at, bit], layouts.node[at, bit]
        received, holding = known[earlier] if earlier % n_nodes != owner else 0, 0
        if case.infers:
            holding = fleet.some[earlier] & received
            if holding != 0:
                for column in range(len(holders)):
                    holding &= holders[column, node] | ~fleet.loaded[earlier, column]
        reported = 0
        at_peer = place
        for _ in range(layouts.n_headers[at, bit] if case.relays else 0):
            at_peer = at_peer - 1 if at_peer > 0 else 2 * n_nodes - 1
            reported |= fleet.reported[at_peer, earlier, node] & known[at_peer]
        fleet.acks[bit] = header(reported, -int(node == owner), received, holding)
        if case.relays:
            fleet.reported[place, earlier, node] = fleet.acks[bit]
    known[place] = ALL_LANES


def fill(case: Case, fleet: Fleet, slot: Slot, room_bits: int, playing: int) -> None:
    """Fill the owner's packet behind its header with items that it believes a node to lack."""
    owner, loaded = slot.owner, fleet.loaded[slot.place]
    for column in range(n_columns_of(case)):
        is_sender = case.repeat or column // case.columns_per_source == owner
        open_lanes = fleet.holders[owner, column, owner] & ~fleet.settled[owner, column]
        loaded[column] = open_lanes if is_sender else 0
    if room_bits // case.item_bits < n_columns_of(case):
        for lane in range(LANES):
            if playing >> lane & 1:
                choose(fleet.weights[lane, owner], loaded, lane, room_bits // case.item_bits)
    note_load(fleet, slot.place)


def note_load(fleet: Fleet, place: int) -> None:
    """Record the lanes in which a packet has any item."""
    some = 0
    for column in range(fleet.loaded.shape[1]):
        some |= fleet.loaded[place, column]
    fleet.some[place] = some


def choose(weights: Ints, loaded: Ints, lane: int, room: int) -> None:
    """Keep the candidates of greatest weight that fit one lane's packet (``room`` items); of equals the first.

    ``loaded`` has by column the lanes with the item queued; the lane is cleared for items not chosen.
    """
    bit = lane_bit(lane)
    for column in range(len(loaded)):
        # A weight grows by the need priority, here 1, in each own slot; it restarts when sent (Maurelli et al., 6).
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


def hear(layouts: Layouts, case: Case, fleet: Fleet, slot: Slot, node: int, heard: int) -> None:
    """Process the packet of a slot at a node in the lanes `heard`."""
    at, place = slot.at, slot.place
    known, holders = fleet.known[node], fleet.holders[node]
    known[place] = heard
    for column in range(n_columns_of(case) if fleet.some[place] & heard != 0 else 0):
        taken = heard & fleet.loaded[place, column]
        holders[column, node] |= taken
        holders[column, column // case.columns_per_source] |= taken
        if case.carrier_evidence:
            holders[column, slot.owner] |= taken
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


def play_slot(
    header: Header, layouts: Layouts, case: Case, state: Any, fleet: Fleet, lanes: Lanes, slot: Slot, heard: Ints,
    playing: int, noted: int,
) -> None:  # fmt: skip
    """Run one slot of a policy of the paper, or of the bound.

    ``state`` is of another rule, here unused; ``heard`` has by node the lanes in which it receives the packet,
    ``noted`` the lanes in which transmissions count.
    """
    if case.knows_all:
        pass_freely(case, fleet, lanes, slot.owner, heard, playing, noted)
        return
    acknowledge(header, layouts, case, fleet, slot)
    fill(case, fleet, slot, case.capacity_bits - layouts.n_bits[slot.at], playing)
    for column in range(n_columns_of(case)):
        count(lanes.digits, fleet.loaded[slot.place, column] & noted)
    for node in range(case.n_nodes):
        if heard[node] != 0:
            hear(layouts, case, fleet, slot, node, heard[node])


def pass_freely(case: Case, fleet: Fleet, lanes: Lanes, owner: int, heard: Ints, playing: int, noted: int) -> None:
    """Run one slot of the bound: each receiver takes lacked items that fit, rarest first.

    A packet carries all knowledge of its sender about holders, without a header. No policy receives more. For a single
    item this is a lower bound of the time in every trial. For several items, rarest first is a good heuristic, not
    proved optimal; coded packets may also use receptions that bring no item here.
    """
    for lane in range(LANES):
        if playing >> lane & 1:
            n_holders, most = fleet.weights[lane, owner], 0
            for column in range(n_columns_of(case)):
                n_holders[column] = 0
                for node in range(case.n_nodes):
                    n_holders[column] += fleet.holders[node, column, node] >> lane & 1
            for node in range(case.n_nodes):
                if heard[node] >> lane & 1:
                    most = max(most, take(case, fleet, n_holders, lane, owner, node))
            # Receivers may take different items of one packet: it counts as the most that one of them takes.
            for _ in range(most):
                count(lanes.digits, lane_bit(lane) & noted)
    for node in range(case.n_nodes):
        for column in range(n_columns_of(case) if heard[node] != 0 else 0):
            all_hold = -1
            for holder in range(case.n_nodes):
                if holder != node:
                    fleet.holders[node, column, holder] |= heard[node] & fleet.holders[owner, column, holder]
                all_hold &= fleet.holders[node, column, holder]
            fleet.settled[node, column] |= heard[node] & all_hold


def take(case: Case, fleet: Fleet, n_holders: Ints, lane: int, owner: int, node: int) -> int:
    """Transfer lacked items of the owner to a node, rarest first; return how many."""
    room = n_columns_of(case) if case.capacity_bits == NEVER else case.capacity_bits // case.item_bits
    n_taken = 0
    while n_taken < room:
        rarest = -1
        for column in range(n_columns_of(case)):
            lacks = fleet.holders[owner, column, owner] & ~fleet.holders[node, column, node]
            if lacks >> lane & 1 and (rarest < 0 or n_holders[column] < n_holders[rarest]):
                rarest = column
        if rarest < 0:
            return n_taken
        fleet.holders[node, rarest, node] |= lane_bit(lane)
        n_taken += 1
    return n_taken


def note_false_beliefs(case: Case, fleet: Fleet, lanes: Lanes, playing: int) -> None:
    """Count the lanes in which a node has a false belief that a peer holds an item."""
    wrong = 0
    for column in range(n_columns_of(case)):
        for holder in range(case.n_nodes):
            lacked = ~fleet.holders[holder, column, holder] & playing
            for node in range(case.n_nodes):
                wrong |= fleet.holders[node, column, holder] & lacked
    while wrong != 0:
        lane = first_lane(wrong)
        wrong &= ~lane_bit(lane)
        lanes.outcomes[lanes.trials[lane], FALSE_BELIEFS, SUM] += 1


def note_progress(case: Case, fleet: Fleet, lanes: Lanes, slot: int, playing: int) -> int:
    """Record items that reach a stage in this slot; return lanes with one at the last stage."""
    last = 0
    for column in range(n_columns_of(case)):
        delivered = senders = ALL_LANES
        for node in range(case.n_nodes):
            delivered &= fleet.holders[node, column, node]
            if case.repeat:
                senders &= fleet.settled[node, column]
        source = fleet.settled[column // case.columns_per_source, column]
        for stage in range(N_STAGES):
            now = delivered if stage == DELIVERED else source if stage == SOURCE_ACKED else senders & source
            new = now & playing & ~lanes.reached[stage, column]
            lanes.reached[stage, column] |= new
            if stage == SENDERS_ACKED:
                last |= new
            while new != 0:
                lane = first_lane(new)
                new &= ~lane_bit(lane)
                note_item(case, lanes, lane, stage, column, own_slot(case, lanes, lane, slot))
    return last


# Trials -------------------------------------------------------------------------------------------


def add_item(case: Case, fleet: Fleet, lanes: Lanes, column: int, begun: int) -> None:
    """Start a new item in a column, in some lanes; clear the state of the old one."""
    for node in range(case.n_nodes):
        for holder in range(case.n_nodes):
            fleet.holders[node, column, holder] &= ~begun
        fleet.settled[node, column] &= ~begun
        fleet.done[node] &= ~begun
    for stage in range(N_STAGES):
        lanes.reached[stage, column] &= ~begun
    origin = column // case.columns_per_source
    fleet.holders[origin, column, origin] |= begun


def begin(case: Case, fleet: Fleet, lanes: Lanes, frame: int, n_begun: int, idle: int) -> tuple[int, int]:
    """Start trials in idle lanes; return these lanes and the number of trials begun so far."""
    begun, is_batch = 0, case.rate == 0.0
    while idle != 0 and n_begun < len(lanes.outcomes):
        lane = first_lane(idle)
        idle &= ~lane_bit(lane)
        begun |= lane_bit(lane)
        lanes.trials[lane] = n_begun
        lanes.began_frame[lane] = frame
        lanes.n_followed[lane] = n_columns_of(case) if is_batch else 0
        lanes.free_slot[lane] = NEVER if is_batch else 0
        fleet.weights[lane] = 0
        n_begun += 1
    forget_lanes(fleet, lanes, ~begun)
    for column in range(n_columns_of(case) if is_batch else 0):
        add_item(case, fleet, lanes, column, begun)
    return begun, n_begun


def forget_lanes(fleet: Fleet, lanes: Lanes, kept: int) -> None:
    """Clear the state of all lanes but `kept`."""
    keep(fleet.known, kept)
    keep(fleet.loaded, kept)
    keep(fleet.settled, kept)
    keep(lanes.reached, kept)
    for node in range(len(fleet.holders)):
        keep(fleet.holders[node], kept)
        fleet.done[node] &= kept
    for digit in range(len(lanes.digits)):
        lanes.digits[digit] &= kept


def keep(words: Ints, kept: int) -> None:
    """Clear all lanes but `kept` of a matrix."""
    for row in range(len(words)):
        for at in range(words.shape[1]):
            words[row, at] &= kept


def arrive(case: Case, fleet: Fleet, lanes: Lanes, slot: int, playing: int) -> int:
    """Generate the Poisson arrivals of a slot; return lanes whose slot is in the window.

    Draws use the link of each node to itself.
    """
    in_window = 0
    for lane in range(LANES):
        if playing >> lane & 1:
            own, outcome = own_slot(case, lanes, lane, slot), lanes.outcomes[lanes.trials[lane]]
            is_noted, key = case.window_start <= own < case.window_end, slot_key(key_of(case, lanes, lane), own)
            in_window |= lane_bit(lane) if is_noted else 0
            for origin in range(case.n_sources):
                for _ in range(poisson_number(link_uniform(key, origin, origin), case.rate, case.p_none)):
                    column = free_column(case, lanes, lane, origin, own)
                    if is_noted:
                        outcome[OFFERED, SUM] += 1
                        outcome[REFUSED, SUM] += int(column < 0)
                        lanes.n_followed[lane] += int(column >= 0)
                    if column >= 0:
                        lanes.born_slot[lane, column], lanes.free_slot[lane, column] = own, NEVER
                        add_item(case, fleet, lanes, column, lane_bit(lane))
                        for node in range(case.n_nodes):
                            fleet.weights[lane, node, column] = 0
    return in_window


def run_trials(
    slot_rule: Callable[..., None], header: Header, layouts: Layouts, case: Case, fleet: Fleet, lanes: Lanes, state: Any
) -> None:
    """Run the trials `case.first_trial` and following of one policy with new state; their results are `lanes.outcomes`.

    ``slot_rule`` is as `play_slot`, ``state`` its own; ``header`` is the rule of the acknowledgement, or its compiled
    form.
    """
    n_nodes, n_trials, word_slots = case.n_nodes, len(lanes.outcomes), slots_of_word(case.n_nodes)
    # Plans of policies with received sets are numbers, not bits: one trial at a time.
    usable = 1 if case.states else ALL_LANES
    n_begun = playing = frame = 0
    while n_begun < n_trials or playing != 0:
        # Lanes share one header layout, so trials begin with its period.
        if n_begun < n_trials and playing != usable and frame * 2 * n_nodes % len(layouts.n_bits) == 0:
            begun, n_begun = begin(case, fleet, lanes, frame, n_begun, usable & ~playing)
            playing |= begun
        for first in range(0, n_nodes, word_slots):
            draw(case, lanes, frame, first, playing)
            for owner in range(first, min(first + word_slots, n_nodes)):
                slot = slot_of(layouts, n_nodes, frame, owner)
                heard = lanes.drawn[(owner - first) * n_nodes : (owner - first + 1) * n_nodes]
                noted = arrive(case, fleet, lanes, slot.number, playing) if case.rate != 0.0 else playing
                slot_rule(header, layouts, case, state, fleet, lanes, slot, heard, playing, noted)
                note_false_beliefs(case, fleet, lanes, playing)
                last = note_progress(case, fleet, lanes, slot.number, playing)
                # Under Poisson load or at the limit, a trial may end in a slot that settles no item.
                if case.rate != 0.0 or slot.number + 1 >= case.max_slots:
                    last = playing
                if last != 0:
                    playing &= ~ended(case, lanes, slot.number, last)
        frame += 1
