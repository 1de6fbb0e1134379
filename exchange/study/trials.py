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
from exchange.study import lanes
from exchange.study.lanes import SUM, Case, Ints, Lanes, lane_bit, lanes_of, n_columns_of

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

    layouts: Layouts
    lanes: Lanes
    statements: Any  # see `exchange.study.stating`; None for other policies
    known: Annotated[Ints, "node", "place"]  # lanes in which the node received the packet, or sent it
    loaded: Annotated[Ints, "place", "column"]  # lanes in which the packet had the item
    some: Annotated[Ints, "place"]  # lanes in which the packet had any
    reported: Annotated[Ints, "place", "place", "receiver"]  # lanes: it reports that a receiver has an earlier one
    holders: Annotated[Ints, "node", "column", "holder"]  # lanes in which the node believes the holder to hold the item
    settled: Annotated[Ints, "node", "column"]  # lanes in which the node believes all to hold it
    done: Annotated[Ints, "node"]  # lanes in which it believes so of all items
    acks: Annotated[Ints, "bit"]  # of the header that is sent
    queued: Annotated[Ints, "column"]  # lanes in which the item waits to be sent
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


# One slot -----------------------------------------------------------------------------------------


def acknowledge(header: Header, case: Case, fleet: Fleet, slot: Slot) -> None:
    """Open a slot at all nodes and compose its owner's header.

    Acknowledgements of a packet are shared: they count for each node that received it, as long as the kind keeps them
    (`Layouts.n_headers`; `PacketLog` of a vehicle).
    """
    n_nodes, owner, place, at, layouts = case.n_nodes, slot.owner, slot.place, slot.at, fleet.layouts
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


def fill(case: Case, fleet: Fleet, slot: Slot, room: int, playing: int) -> None:
    """Fill the owner's packet with ``room`` of the items that it believes a node to lack."""
    owner, loaded, queued = slot.owner, fleet.loaded[slot.place], fleet.queued
    is_limited = room < n_columns_of(case)
    for column in range(n_columns_of(case)):
        is_sender = case.repeat or column // case.columns_per_source == owner
        open_lanes = fleet.holders[owner, column, owner] & ~fleet.settled[owner, column]
        queued[column] = open_lanes if is_sender else 0
        loaded[column] = 0 if is_limited else queued[column]
    for lane in lanes_of(playing if is_limited else 0):
        choose(fleet.weights[lane, owner], queued, loaded, lane, room)
    note_load(fleet, slot.place)


def note_load(fleet: Fleet, place: int) -> None:
    """Record the lanes in which a packet has any item."""
    some = 0
    for column in range(fleet.loaded.shape[1]):
        some |= fleet.loaded[place, column]
    fleet.some[place] = some


def choose(weights: Ints, queued: Ints, loaded: Ints, lane: int, room: int) -> None:
    """Load the queued items of greatest weight that fit one lane's packet; see `take_best`."""
    for column in range(len(queued)):
        # A weight grows by the need priority, here 1, in each own slot; it restarts when sent (Maurelli et al., 6).
        weights[column] += queued[column] >> lane & 1
    take_best(weights, queued, loaded, lane, room)
    for column in range(len(queued)):
        weights[column] *= ~loaded[column] >> lane & 1


def take_best(weights: Ints, queued: Ints, taken: Ints, lane: int, room: int) -> int:
    """Move up to ``room`` items of one lane from `queued` to `taken`, the heaviest first; return how many.

    Both have by column the lanes with the item. Of equals the first is taken.
    """
    for n_taken in range(room):
        heaviest = -1
        for column in range(len(queued)):
            if queued[column] >> lane & 1 and (heaviest < 0 or weights[column] > weights[heaviest]):
                heaviest = column
        if heaviest < 0:
            return n_taken
        queued[heaviest] &= ~lane_bit(lane)
        taken[heaviest] |= lane_bit(lane)
    return room


def hear(case: Case, fleet: Fleet, slot: Slot, node: int, heard: int) -> None:
    """Process the packet of a slot at a node in the lanes `heard`."""
    at, place, layouts = slot.at, slot.place, fleet.layouts
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


def play_slot(header: Header, case: Case, fleet: Fleet, slot: Slot, heard: Ints, playing: int, noted: int) -> None:
    """Run one slot of a policy of the paper, or of the bound.

    ``heard`` has by node the lanes in which it receives the packet, ``noted`` the lanes in which transmissions count.
    """
    if case.knows_all:
        pass_freely(case, fleet, slot.owner, heard, playing, noted)
        return
    acknowledge(header, case, fleet, slot)
    fill(case, fleet, slot, (case.capacity_bits - fleet.layouts.n_bits[slot.at]) // case.item_bits, playing)
    for column in range(n_columns_of(case)):
        lanes.count(fleet.lanes.digits, fleet.loaded[slot.place, column] & noted)
    for node in range(case.n_nodes):
        if heard[node] != 0:
            hear(case, fleet, slot, node, heard[node])


def pass_freely(case: Case, fleet: Fleet, owner: int, heard: Ints, playing: int, noted: int) -> None:
    """Run one slot of the bound: each receiver takes lacked items that fit, rarest first.

    A packet carries all knowledge of its sender about holders, without a header. No policy receives more. For a single
    item this is a lower bound of the time in every trial. For several items, rarest first is a good heuristic, not
    proved optimal; coded packets may also use receptions that bring no item here.
    """
    holders, room = fleet.holders, case.capacity_bits // case.item_bits
    for lane in lanes_of(playing):
        rarity, most = fleet.weights[lane, owner], 0
        for column in range(n_columns_of(case)):
            rarity[column] = 0
            for node in range(case.n_nodes):
                rarity[column] -= holders[node, column, node] >> lane & 1
        for node in range(case.n_nodes):
            if heard[node] >> lane & 1:
                for column in range(n_columns_of(case)):
                    fleet.queued[column] = holders[owner, column, owner] & ~holders[node, column, node]
                most = max(most, take_best(rarity, fleet.queued, holders[node, :, node], lane, room))
        # Receivers may take different items of one packet: it counts as the most that one of them takes.
        for _ in range(most):
            lanes.count(fleet.lanes.digits, lane_bit(lane) & noted)
    for node in range(case.n_nodes):
        for column in range(n_columns_of(case) if heard[node] != 0 else 0):
            all_hold = ALL_LANES
            for holder in range(case.n_nodes):
                if holder != node:
                    holders[node, column, holder] |= heard[node] & holders[owner, column, holder]
                all_hold &= holders[node, column, holder]
            fleet.settled[node, column] |= heard[node] & all_hold


def note_false_beliefs(case: Case, fleet: Fleet, playing: int) -> None:
    """Count the lanes in which a node has a false belief that a peer holds an item."""
    wrong = 0
    for column in range(n_columns_of(case)):
        for holder in range(case.n_nodes):
            lacked = ~fleet.holders[holder, column, holder] & playing
            for node in range(case.n_nodes):
                wrong |= fleet.holders[node, column, holder] & lacked
    for lane in lanes_of(wrong):
        fleet.lanes.outcomes[fleet.lanes.trials[lane], lanes.FALSE_BELIEFS, SUM] += 1


def note_progress(case: Case, fleet: Fleet, slot: int, playing: int) -> int:
    """Record items, or whole batches, that reach a stage in this slot; return lanes with one at the last stage."""
    last, reached, n_counted = 0, fleet.lanes.reached, n_columns_of(case) if case.rate == 0.0 else 1
    for first in range(0, n_columns_of(case), n_counted):
        delivered = source = senders = ALL_LANES
        for column in range(first, first + n_counted):
            for node in range(case.n_nodes):
                delivered &= fleet.holders[node, column, node]
                if case.repeat:
                    senders &= fleet.settled[node, column]
            source &= fleet.settled[column // case.columns_per_source, column]
        for stage in range(lanes.N_STAGES):
            now = delivered if stage == lanes.DELIVERED else source
            if stage == lanes.SENDERS_ACKED:
                now &= senders
            new = now & playing & ~reached[stage, first]
            reached[stage, first] |= new
            if stage == lanes.SENDERS_ACKED:
                last |= new
            for lane in lanes_of(new):
                lanes.note_item(case, fleet.lanes, lane, stage, first, lanes.own_slot(case, fleet.lanes, lane, slot))
    return last


# Trials -------------------------------------------------------------------------------------------


def add_item(case: Case, fleet: Fleet, column: int, begun: int) -> None:
    """Start a new item in a column, in some lanes; clear the state of the old one."""
    for node in range(case.n_nodes):
        for holder in range(case.n_nodes):
            fleet.holders[node, column, holder] &= ~begun
        fleet.settled[node, column] &= ~begun
        fleet.done[node] &= ~begun
    for stage in range(lanes.N_STAGES):
        fleet.lanes.reached[stage, column] &= ~begun
    origin = column // case.columns_per_source
    fleet.holders[origin, column, origin] |= begun


def begin(case: Case, fleet: Fleet, frame: int, n_begun: int, idle: int) -> tuple[int, int]:
    """Start trials in idle lanes; return these lanes and the number of trials begun so far."""
    of_lanes, begun, is_batch = fleet.lanes, 0, case.rate == 0.0
    for lane in lanes_of(idle):
        if n_begun < len(of_lanes.outcomes):
            begun |= lane_bit(lane)
            of_lanes.trials[lane] = n_begun
            of_lanes.began_frame[lane] = frame
            of_lanes.free_slot[lane] = lanes.NEVER if is_batch else 0
            of_lanes.outcomes[n_begun, lanes.OFFERED, SUM] = int(is_batch)
            fleet.weights[lane] = 0
            n_begun += 1
    forget_lanes(fleet, ~begun)
    for column in range(n_columns_of(case) if is_batch else 0):
        add_item(case, fleet, column, begun)
    return begun, n_begun


def forget_lanes(fleet: Fleet, kept: int) -> None:
    """Clear the state of all lanes but `kept`."""
    np.bitwise_and(fleet.holders, kept, fleet.holders)
    for matrix in (fleet.known, fleet.loaded, fleet.settled, fleet.lanes.reached):
        np.bitwise_and(matrix, kept, matrix)
    for words in (fleet.done, fleet.lanes.digits):
        np.bitwise_and(words, kept, words)


def arrive(case: Case, fleet: Fleet, slot: int, playing: int) -> int:
    """Generate the Poisson arrivals of a slot; return lanes whose slot is in the window.

    Draws use the link of each node to itself.
    """
    of_lanes, in_window = fleet.lanes, 0
    for lane in lanes_of(playing):
        own, outcome = lanes.own_slot(case, of_lanes, lane, slot), of_lanes.outcomes[of_lanes.trials[lane]]
        is_noted, key = case.window_start <= own < case.window_end, slot_key(lanes.key_of(case, of_lanes, lane), own)
        in_window |= lane_bit(lane) if is_noted else 0
        for origin in range(case.n_sources):
            for _ in range(lanes.poisson_number(link_uniform(key, origin, origin), case.rate, case.p_none)):
                column = lanes.free_column(case, of_lanes, lane, origin, own)
                if is_noted:
                    outcome[lanes.OFFERED, SUM] += 1
                    outcome[lanes.REFUSED, SUM] += int(column < 0)
                if column >= 0:
                    of_lanes.born_slot[lane, column], of_lanes.free_slot[lane, column] = own, lanes.NEVER
                    add_item(case, fleet, column, lane_bit(lane))
                    fleet.weights[lane, :, column] = 0
    return in_window


def run_trials(slot_rule: Callable[..., None], header: Header, case: Case, fleet: Fleet) -> None:
    """Run the trials `case.first_trial` and following of one policy with new state; their results are `lanes.outcomes`.

    ``slot_rule`` is as `play_slot`; ``header`` is the rule of the acknowledgement.
    """
    n_nodes, n_trials, word_slots = case.n_nodes, len(fleet.lanes.outcomes), lanes.slots_of_word(case.n_nodes)
    # Plans of policies with received sets are numbers, not bits: one trial at a time.
    usable = 1 if case.states else ALL_LANES
    n_begun = playing = frame = 0
    while n_begun < n_trials or playing != 0:
        # Lanes share one header layout, so trials begin with its period.
        if n_begun < n_trials and playing != usable and frame * 2 * n_nodes % len(fleet.layouts.n_bits) == 0:
            begun, n_begun = begin(case, fleet, frame, n_begun, usable & ~playing)
            playing |= begun
        for first in range(0, n_nodes, word_slots):
            lanes.draw(case, fleet.lanes, frame, first, playing)
            for owner in range(first, min(first + word_slots, n_nodes)):
                slot = slot_of(fleet.layouts, n_nodes, frame, owner)
                heard = fleet.lanes.drawn[(owner - first) * n_nodes : (owner - first + 1) * n_nodes]
                noted = arrive(case, fleet, slot.number, playing) if case.rate != 0.0 else playing
                slot_rule(header, case, fleet, slot, heard, playing, noted)
                note_false_beliefs(case, fleet, playing)
                last = note_progress(case, fleet, slot.number, playing)
                # Under Poisson load or at the limit, a trial may end in a slot that settles no item.
                if case.rate != 0.0 or slot.number + 1 >= case.max_slots:
                    last = playing
                if last != 0:
                    playing &= ~lanes.ended(case, fleet.lanes, slot.number, last)
        frame += 1
