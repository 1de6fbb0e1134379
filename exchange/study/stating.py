"""Slot rule of policies that report received sets, for one trial at a time in lane 0 of `exchange.study.trials`.

Reports about an origin follow `exchange.policy.planning`: all items below a number are held, by all nodes as the sender
believes; a mask covers the next ones. An item is a column with a number given by its origin. The same module plans
packets as in a vehicle. Symbols are over the field of `exchange.policy.coding`; only their coefficients are simulated,
which determine what a node can decode.

Plain Python that `exchange.study.compiler` compiles.
"""

from typing import Annotated, NamedTuple, get_type_hints

import numpy as np

from exchange.policy import planning
from exchange.policy.coding import LOGS, MOST_ROWS, POWERS, coefficient, inverse, symbol_key
from exchange.study import trials
from exchange.study.lanes import Bytes, Case, Floats, Ints, allocated, count, n_columns_of, sizes_of
from exchange.study.trials import Fleet, Header, Slot, slot_of

UNKNOWN = -1
"""Slot of an event that never happened; bit that a header does not carry."""

BELOW, STATED, DENIED = 1, 2, 3
"""Content of statements about an item: held by all, held by the sender, not held by the sender."""

_PRODUCTS = np.array(POWERS, np.uint8)[np.add.outer(LOGS, LOGS)]
_PRODUCTS[0] = _PRODUCTS[:, 0] = 0
_INVERSES = np.array([0, *map(inverse, range(1, 256))], np.uint8)


class Statements(NamedTuple):
    """State of nodes beside `Fleet`; item sets are flags by column."""

    plan: planning.PacketPlan  # of the packet under construction
    confirmed: Annotated[Ints, "node", "column"]  # acknowledgements that the origin is known to have
    told: Annotated[Ints, "node", "column"]  # items that the last own packet reported as held
    lacks: Annotated[Floats, "node", "column", "peer"]  # probability that the peer lacks the item
    lost: Annotated[Floats, "node", "peer"]  # weighted number of own packets lost at the peer
    weight: Annotated[Floats, "node", "peer"]  # weighted number of own packets
    learned_slot: Annotated[Ints, "node", "column"]  # of the last news about holders of the item
    passed_slot: Annotated[Ints, "node", "column"]  # of its last report of a holder set
    n_passed: Annotated[Ints, "node", "column"]  # reports since the last news; the most allowed without news
    n_rows: Annotated[Ints, "node"]  # undecoded symbols
    rows: Annotated[Bytes, "node", "row", "column"]  # their coefficients, in reduced form
    n_brought: Annotated[Ints, "node"]
    brought: Annotated[Ints, "node", "column"]  # so many items of its last packet, those in its symbols included
    number: Annotated[Ints, "column"]  # sequence given by the origin; `UNKNOWN` without an item
    n_numbers: Annotated[Ints, "node"]  # items generated
    share: Annotated[Floats, "node", "sender", "peer"]  # probability that its last symbols delivered an item
    # Packet under construction:
    first: Annotated[Ints, "origin"]  # number that its statement begins with
    end: Annotated[Ints, "origin"]  # number behind its range
    report: Annotated[Ints, "column"]  # content of its statements about the item
    shown: Annotated[Ints, "column"]  # items with a holder set
    received: Annotated[Ints, "sender"]  # 1 if the packet acknowledges the last one of that sender
    columns: Annotated[Ints, "column"]  # of each candidate
    vector: Annotated[Bytes, "column"]  # scratch: a symbol
    n_holders: Annotated[Ints, "column"]  # scratch: known holders before a packet


def new_statements(case: Case) -> Statements:
    """Allocate the state; `forget_all` clears it before each trial."""
    return allocated(Statements, sizes_of(case) | {"row": MOST_ROWS}, new_plan(case.n_nodes * n_columns_of(case)))


def new_plan(n: int) -> planning.PacketPlan:
    """Allocate the plan of a packet: ``n`` entries in each field, the most that any needs."""
    kinds = get_type_hints(planning.PacketPlan).values()
    plan = planning.PacketPlan._make(np.zeros(n, np.float64 if kind is planning.Shares else np.int64) for kind in kinds)
    return plan._replace(weight=np.ones(n))


def number_items(case: Case, fleet: Fleet, statements: Statements, slot: int) -> None:
    """Number the items that are new in a slot; forget those whose column is free, and all in the first slot."""
    if slot == 0:
        statements.number[:] = UNKNOWN
        for numbers in (statements.n_numbers, statements.n_rows, statements.n_brought):
            numbers[:] = 0
        for shares in (statements.lost, statements.weight):
            shares[:] = 0.0
        statements.share[:] = 0.0
    for column in range(n_columns_of(case)):
        if fleet.lanes.free_slot[0, column] <= slot:
            statements.number[column] = UNKNOWN
        elif fleet.lanes.born_slot[0, column] == slot:
            origin = column // case.columns_per_source
            statements.number[column] = statements.n_numbers[origin]
            statements.n_numbers[origin] += 1
            statements.confirmed[:, column] = 0
            statements.told[:, column] = 0
            statements.n_passed[:, column] = planning.MOST_PASSED
            statements.passed_slot[:, column] = UNKNOWN
            statements.lacks[:, column] = 1.0


def columns_of(case: Case, origin: int) -> range:
    """Columns of an origin."""
    first = origin * case.columns_per_source
    return range(first, first + (case.columns_per_source if origin < case.n_sources else 0))


def is_alive(statements: Statements, column: int) -> bool:
    """True if the column has an item."""
    return bool(statements.number[column] != UNKNOWN)


def has_item(fleet: Fleet, node: int, column: int) -> bool:
    """True if the node holds the item."""
    return bool(fleet.holders[node, column, node] & 1)


def n_known_holders(fleet: Fleet, node: int, column: int) -> int:
    """Number of nodes that a node believes to hold the item."""
    number = 0
    for holder in range(len(fleet.known)):
        number += fleet.holders[node, column, holder] & 1
    return number


def place_of_last(fleet: Fleet, node: int, slot: int) -> int:
    """Ring place of a node's last packet before or in a slot."""
    n_nodes = len(fleet.known)
    return (slot - (slot - node) % n_nodes) % (2 * n_nodes)


def delivery_rate(statements: Statements, node: int, peer: int) -> float:
    """Delivery rate from a node to a peer, by the node's estimate."""
    return planning.reception_of(statements.lost[node, peer], statements.weight[node, peer])


# Packet composition -------------------------------------------------------------------------------


def look_through(case: Case, fleet: Fleet, statements: Statements, owner: int) -> None:
    """Compute which item numbers the owner's statement about each origin covers.

    The range starts at the first unsettled item and ends after the last held one; at most ``MOST_STATED`` numbers.
    """
    for origin in range(case.n_nodes):
        first, end = statements.n_numbers[origin], 0
        for column in columns_of(case, origin):
            number = statements.number[column]
            if is_alive(statements, column) and not fleet.settled[owner, column] & 1:
                first = min(first, number)
            if is_alive(statements, column) and has_item(fleet, owner, column):
                end = max(end, number + 1)
        statements.first[origin] = first
        statements.end[origin] = min(max(first, end), first + planning.MOST_STATED)


def count_owed(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int) -> None:
    """Count the unreported acknowledgements to each origin, and the size of a statement."""
    plan = statements.plan
    for origin in range(case.n_nodes):
        plan.owed[origin], plan.statement_bits[origin] = 0.0, planning.IMPOSSIBLE
        last = place_of_last(fleet, origin, slot)
        is_known = fleet.known[owner, last] & 1
        for column in columns_of(case, origin if origin != owner else case.n_sources):
            is_told = statements.confirmed[owner, column] | is_known & fleet.loaded[last, column]
            if is_alive(statements, column) and has_item(fleet, owner, column) and not is_told:
                plan.owed[origin] += int(statements.number[column] < statements.end[origin])
        length = statements.end[origin] - statements.first[origin]
        if length > 0 or plan.owed[origin] > 0:
            length = 0 if origin == owner else length
            plan.statement_bits[origin] = planning.statement_bits(case.n_nodes, case.number_bits, length)


def gather(case: Case, fleet: Fleet, statements: Statements, owner: int) -> int:
    """Collect held items that, to the owner's knowledge, some node lacks; return their number."""
    n_nodes, plan, c = case.n_nodes, statements.plan, 0
    for turn in range(n_nodes):  # own first: with equal values, nodes choose different items
        origin = (owner + turn) % n_nodes
        for column in columns_of(case, origin if case.repeat or origin == owner else case.n_sources):
            if not has_item(fleet, owner, column) or fleet.settled[owner, column] & 1:
                continue
            statements.columns[c] = column
            plan.origin[c] = origin
            plan.size_bits[c], plan.symbol_bits[c] = case.item_bits, case.symbol_bits
            plan.is_new[c] = int(origin == owner)
            plan.is_stated[c] = int(statements.first[origin] <= statements.number[column] < statements.end[origin])
            for peer in range(n_nodes):
                lack = 0.0
                if peer != owner and not fleet.holders[owner, column, peer] & 1:
                    lack = max(planning.LEAST_LACK, statements.lacks[owner, column, peer])
                if peer != owner and lack < 1.0:
                    plan.is_new[c] = 0
                plan.lacks[c * n_nodes + peer] = lack
            c += 1
    return c


def compose_packet(case: Case, fleet: Fleet, statements: Statements, slot: Slot, n_bits: int) -> tuple[int, int]:
    """Compose the owner's packet behind a header of ``n_bits``; return its items and symbols."""
    owner, plan = slot.owner, statements.plan
    look_through(case, fleet, statements, owner)
    count_owed(case, fleet, statements, owner, slot.number)
    n_candidates = gather(case, fleet, statements, owner)
    for peer in range(case.n_nodes):
        plan.reception[peer] = 0.0 if peer == owner else delivery_rate(statements, owner, peer)
    left = case.capacity_bits - planning.END_BITS - n_bits - (planning.COUNT_BITS if case.codes else 0)
    n_symbols = planning.plan_packet(plan, case.n_nodes, n_candidates, left, case.codes, slot.frame % 2 == 1)
    fleet.loaded[slot.place, :] = 0
    n_sent = 0
    for c in range(n_candidates):
        if plan.takes[c] != 0:
            fleet.loaded[slot.place, statements.columns[c]] = 1
            statements.brought[owner, n_sent] = statements.columns[c]
            left -= plan.size_bits[c]
            n_sent += 1
    statements.n_brought[owner] = n_sent
    for origin in range(case.n_nodes):
        left -= plan.states[origin] * plan.statement_bits[origin]
    if n_symbols > 0:
        left -= planning.SIZE_BITS + n_symbols * case.symbol_bits
    state_holdings(case, fleet, statements, owner, slot.place, n_symbols)
    show_holders(case, fleet, statements, owner, slot.number, left)
    note_told(case, fleet, statements, owner, slot.number)
    note_brought(case, fleet, statements, owner, slot, n_symbols)
    return n_sent, n_symbols


def state_holdings(case: Case, fleet: Fleet, statements: Statements, owner: int, place: int, n_symbols: int) -> None:
    """Write statements, their omissions, and the items that symbols cover."""
    statements.report[:] = 0
    for origin in range(case.n_sources):
        length = statements.end[origin] - statements.first[origin]
        for column in columns_of(case, origin if statements.plan.states[origin] != 0 else case.n_sources):
            number = statements.number[column]
            if not is_alive(statements, column):
                continue
            if number < statements.first[origin]:
                statements.report[column] = BELOW
            elif number < statements.end[origin] and has_item(fleet, owner, column):
                statements.report[column] = STATED
                if n_symbols > 0 and not fleet.loaded[place, column]:
                    statements.brought[owner, statements.n_brought[owner]] = column
                    statements.n_brought[owner] += 1
            elif number < statements.end[origin] or length < planning.MOST_STATED:
                statements.report[column] = DENIED


def show_holders(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int, room_bits: int) -> None:
    """Add holder sets to the packet within its capacity, in order of ``holder_set_rank``."""
    left, size_bits = room_bits, planning.holder_set_bits(case.n_nodes, case.number_bits)
    learned, passed = statements.learned_slot[owner], statements.passed_slot[owner]
    statements.shown[:] = 0
    while left >= size_bits:
        chosen, lowest = UNKNOWN, slot
        for column in range(n_columns_of(case)):
            if can_show(fleet, statements, owner, column):
                rank = planning.holder_set_rank(learned[column], passed[column])
                if rank < lowest:
                    chosen, lowest = column, rank
        if chosen == UNKNOWN:
            return
        statements.shown[chosen] = 1
        passed[chosen] = slot
        statements.n_passed[owner, chosen] += 1
        left -= size_bits


def can_show(fleet: Fleet, statements: Statements, owner: int, column: int) -> bool:
    """True if the owner knows another holder of an item and has not reported it in this packet."""
    is_told = statements.n_passed[owner, column] >= planning.MOST_PASSED
    if is_told or not is_alive(statements, column) or statements.shown[column]:
        return False
    return has_item(fleet, owner, column) and n_known_holders(fleet, owner, column) > 1


def note_told(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int) -> None:
    """Record what the packet reports of the owner's received set."""
    own = place_of_last(fleet, owner, slot)
    for origin in range(case.n_sources):
        last = place_of_last(fleet, origin, slot)
        is_known = fleet.known[owner, last] & 1
        for column in columns_of(case, origin):
            is_told = fleet.loaded[own, column] | is_known & fleet.loaded[last, column] | statements.shown[column]
            is_told |= int(statements.report[column] in (BELOW, STATED))
            statements.told[owner, column] = is_told & fleet.holders[owner, column, owner]


def note_brought(case: Case, fleet: Fleet, statements: Statements, node: int, slot: Slot, n_symbols: int) -> None:
    """Update a node's lack estimates by the owner's packet, for items that the node holds."""
    owner = slot.owner
    for peer in range(case.n_nodes):
        statements.share[node, owner, peer] = 0.0
        if peer in (node, owner):
            continue
        share = planning.share_of_symbols(n_symbols, lacked_of_code(fleet, statements, node, slot, peer))
        reception = delivery_rate(statements, node, peer)
        statements.share[node, owner, peer] = share
        for at in range(statements.n_brought[owner]):
            column = statements.brought[owner, at]
            if has_item(fleet, node, column):
                kept = planning.kept_of_lack(reception, 1.0 if fleet.loaded[slot.place, column] else share)
                statements.lacks[node, column, peer] *= kept


def lacked_of_code(fleet: Fleet, statements: Statements, node: int, slot: Slot, peer: int) -> float:
    """Expected number of items in the owner's symbols that a peer lacks, by a node's estimate."""
    lacked = 0.0
    for at in range(statements.n_brought[slot.owner]):
        column = statements.brought[slot.owner, at]
        if fleet.loaded[slot.place, column]:
            continue
        if not has_item(fleet, node, column):
            lacked += 1.0
        elif not fleet.holders[node, column, peer] & 1:
            lacked += statements.lacks[node, column, peer]
    return lacked


# Packet reception ---------------------------------------------------------------------------------


def note_answers(fleet: Fleet, statements: Statements, slot: Slot) -> None:
    """Read from the owner's header which last packets it received."""
    statements.received[:] = UNKNOWN
    layouts = fleet.layouts
    for bit in range(layouts.n_bits[slot.at]):
        if layouts.node[slot.at, bit] == slot.owner:
            statements.received[layouts.place[slot.at, bit] % len(statements.received)] = fleet.acks[bit] & 1


def note_fates(case: Case, fleet: Fleet, statements: Statements, node: int, slot: Slot) -> None:
    """Update link and lack estimates by the owner's acknowledgements of the last packets of this node and others."""
    owner, received = slot.owner, statements.received[node]
    # Before its first slot a node has no packet to be acknowledged.
    if slot.number > node:
        # With the delivery rate before this sample, which the lack was estimated with.
        reckon_fate(fleet, statements, node, slot, node, delivery_rate(statements, node, owner))
        statements.lost[node, owner] = planning.KEPT * statements.lost[node, owner] + (1 - received)
        statements.weight[node, owner] = planning.KEPT * statements.weight[node, owner] + 1.0
        for column in columns_of(case, owner if received else case.n_sources):
            statements.confirmed[node, column] |= statements.told[node, column]
    reception = delivery_rate(statements, node, owner)
    for sender in range(case.n_nodes):
        is_known = fleet.known[node, place_of_last(fleet, sender, slot.number)] & 1
        if sender not in (node, owner) and is_known:
            reckon_fate(fleet, statements, node, slot, sender, reception)


def reckon_fate(fleet: Fleet, statements: Statements, node: int, slot: Slot, sender: int, reception: float) -> None:
    """Correct lack estimates by the owner's acknowledgement of a sender's last packet."""
    is_received, share = statements.received[sender] == 1, statements.share[node, sender, slot.owner]
    last, lacks = place_of_last(fleet, sender, slot.number), statements.lacks[node, :, slot.owner]
    for at in range(statements.n_brought[sender]):
        column = statements.brought[sender, at]
        is_plain = fleet.loaded[last, column] != 0
        if has_item(fleet, node, column) and not (is_plain and is_received):
            lacks[column] = planning.lack_after(lacks[column], reception, 1.0 if is_plain else share, is_received)


def believe_statements(case: Case, fleet: Fleet, statements: Statements, node: int, owner: int) -> None:
    """Apply the owner's statements and holder sets."""
    for column in range(n_columns_of(case)):
        report, holders = statements.report[column], fleet.holders[node, column]
        if report in (BELOW, STATED):
            holders[owner] |= 1
        elif report == DENIED:
            statements.lacks[node, column, owner] = 1.0
        for peer in range(case.n_nodes):
            holders[peer] |= int(report == BELOW) | statements.shown[column] & fleet.holders[owner, column, peer]


def drop_known(case: Case, fleet: Fleet, statements: Statements, node: int) -> None:
    """Eliminate known items from undecoded symbols, as `exchange.policy.coding.Decoder.learn`."""
    n_rows = statements.n_rows[node]
    statements.n_rows[node] = 0
    for row in range(n_rows):
        overwrite(statements.vector, statements.rows[node, row])
        add_symbol(case, fleet, statements, node)


def hear_symbols(case: Case, fleet: Fleet, statements: Statements, node: int, slot: int, n_symbols: int) -> None:
    """Decode the symbols of a packet."""
    vector = statements.vector
    for place in range(n_symbols):
        key = symbol_key(slot, place)
        for column in range(n_columns_of(case)):
            vector[column] = 0
            if statements.report[column] == STATED:
                vector[column] = coefficient(key, column // case.columns_per_source, statements.number[column])
        add_symbol(case, fleet, statements, node)


def add_symbol(case: Case, fleet: Fleet, statements: Statements, node: int) -> None:
    """Add the symbol in `vector` to the undecoded ones of a node, as `Decoder.add`; take items that they determine."""
    rows, vector, n_rows = statements.rows[node], statements.vector, statements.n_rows[node]
    for column in range(n_columns_of(case)):
        if has_item(fleet, node, column):
            vector[column] = 0
    for row in range(n_rows):
        eliminate(vector, rows[row], pivot_of(rows[row], 0))
    pivot = pivot_of(vector, 0)
    if pivot == UNKNOWN or n_rows == MOST_ROWS:
        return
    by = _INVERSES[vector[pivot]]
    for column in range(n_columns_of(case)):
        vector[column] = _PRODUCTS[by, vector[column]]
    for row in range(n_rows):
        eliminate(rows[row], vector, pivot)
    overwrite(rows[n_rows], vector)
    kept = 0
    for row in range(n_rows + 1):
        pivot = pivot_of(rows[row], 0)
        if pivot_of(rows[row], pivot + 1) == UNKNOWN:
            fleet.holders[node, pivot, node] |= 1
            fleet.holders[node, pivot, pivot // case.columns_per_source] |= 1
        else:
            overwrite(rows[kept], rows[row])
            kept += 1
    statements.n_rows[node] = kept


def eliminate(one: Bytes, row: Bytes, pivot: int) -> None:
    """Subtract the multiple of a row whose pivot is 1 that makes this column 0."""
    factor = int(one[pivot])
    if factor != 0:
        for column in range(pivot, len(row)):
            one[column] ^= _PRODUCTS[factor, row[column]]


def overwrite(one: Bytes, other: Bytes) -> None:
    """Copy the other row into the first."""
    for column in range(len(one)):
        one[column] = other[column]


def pivot_of(row: Bytes, begin: int) -> int:
    """Return the first non-zero column from `begin`; `UNKNOWN` if all are 0."""
    for column in range(begin, len(row)):
        if row[column] != 0:
            return column
    return UNKNOWN


def hear(case: Case, fleet: Fleet, statements: Statements, slot: Slot, node: int, n_symbols: int) -> None:
    """Process the packet of a slot at a node."""
    owner, n_held = slot.owner, fleet.holders[node, :, node].sum()
    for column in range(n_columns_of(case)):
        statements.n_holders[column] = n_known_holders(fleet, node, column)
    if statements.received[node] != UNKNOWN:
        note_fates(case, fleet, statements, node, slot)
    trials.hear(case, fleet, slot, node, 1)
    believe_statements(case, fleet, statements, node, owner)
    if fleet.holders[node, :, node].sum() > n_held:
        drop_known(case, fleet, statements, node)
    hear_symbols(case, fleet, statements, node, slot.number, n_symbols)
    note_brought(case, fleet, statements, node, slot, n_symbols)
    trials.settle(fleet, node)
    for column in range(n_columns_of(case)):
        if n_known_holders(fleet, node, column) > statements.n_holders[column]:
            statements.learned_slot[node, column] = slot.number
            statements.n_passed[node, column] = 0


# One slot -----------------------------------------------------------------------------------------


def play_slot(header: Header, case: Case, fleet: Fleet, slot: Slot, heard: Ints, playing: int, noted: int) -> None:
    """Run one slot; arguments as of `trials.play_slot`, but lane 0 only."""
    slot = slot_of(fleet.layouts, case.n_nodes, slot.frame - fleet.lanes.began_frame[0], slot.owner)
    statements = fleet.statements
    number_items(case, fleet, statements, slot.number)
    trials.acknowledge(header, case, fleet, slot)
    n_sent, n_symbols = compose_packet(case, fleet, statements, slot, fleet.layouts.n_bits[slot.at])
    trials.note_load(fleet, slot.place)
    note_answers(fleet, statements, slot)
    for node in range(case.n_nodes):
        if heard[node] & 1:
            hear(case, fleet, statements, slot, node, n_symbols)
    for _ in range(n_sent + n_symbols):
        count(fleet.lanes.digits, noted)
