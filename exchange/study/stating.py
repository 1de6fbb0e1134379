"""Slot rule of policies that report received sets, for one trial at a time in lane 0 of `exchange.study.trials`.

Reports about an origin follow `exchange.policy.planning`: all items below a number are held, by all nodes as the sender
believes; a mask covers the next ones. An item is a column with a number given by its origin. The same module plans
packets as in a vehicle. Symbols are over the field of `exchange.policy.coding`; only their coefficients are simulated,
which determine what a node can decode.

Plain Python that `exchange.study.compiler` compiles.
"""

from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from exchange.policy.coding import LOGS, MOST_ROWS, POWERS, coefficient, inverse, symbol_key
from exchange.policy.planning import (
    COUNT_BITS,
    END_BITS,
    IMPOSSIBLE,
    KEPT,
    LEAST_LACK,
    MOST_PASSED,
    MOST_STATED,
    SIZE_BITS,
    PacketPlan,
    Shares,
    holder_set_bits,
    holder_set_rank,
    kept_of_lack,
    lack_after,
    plan_packet,
    reception_of,
    share_of_symbols,
    statement_bits,
)
from exchange.study import trials
from exchange.study.lanes import Bytes, Case, Floats, Ints, allocated, count, n_columns_of, sizes_of
from exchange.study.trials import Fleet, Header, Slot, slot_of

UNKNOWN = -1
"""Slot of an event that never happened; bit that a header does not carry."""

_PRODUCTS = np.array(POWERS, np.uint8)[np.add.outer(LOGS, LOGS)]
_PRODUCTS[0] = _PRODUCTS[:, 0] = 0
_INVERSES = np.array([0, *map(inverse, range(1, 256))], np.uint8)


class Statements(NamedTuple):
    """State of nodes beside `Fleet`; item sets are flags by column."""

    plan: PacketPlan  # of the packet under construction
    confirmed: Annotated[Ints, "node", "column"]  # acknowledgements that the origin is known to have
    told: Annotated[Ints, "node", "column"]  # items that the last own packet reported as held
    lacks: Annotated[Floats, "node", "column", "peer"]  # probability that the peer lacks the item
    lost: Annotated[Floats, "node", "peer"]  # weighted number of own packets lost at the peer
    weight: Annotated[Floats, "node", "peer"]  # weighted number of own packets
    learned_slot: Annotated[Ints, "node", "column"]  # of the last news about holders of the item
    passed_slot: Annotated[Ints, "node", "column"]  # of its last report of a holder set
    n_passed: Annotated[Ints, "node", "column"]  # reports since the last news; `MOST_PASSED` without news
    n_rows: Annotated[Ints, "node"]  # undecoded symbols
    rows: Annotated[Bytes, "node", "row", "column"]  # their coefficients
    pivots: Annotated[Ints, "node", "row"]  # the first column of each that is not 0
    brought: Annotated[Ints, "node", "column"]  # items of its last packet, then those in its symbols
    n_plain: Annotated[Ints, "node"]  # the former
    n_coded: Annotated[Ints, "node"]  # the latter
    number: Annotated[Ints, "column"]  # sequence given by the origin; `UNKNOWN` without an item
    n_numbers: Annotated[Ints, "node"]  # items generated
    share: Annotated[Floats, "node", "sender", "peer"]  # probability that its last symbols delivered an item
    # Packet under construction:
    first: Annotated[Ints, "origin"]  # number that its statement begins with
    end: Annotated[Ints, "origin"]  # number behind its range
    stated: Annotated[Ints, "column"]  # items that statements report as held
    below: Annotated[Ints, "column"]  # items that statements report as held by all
    denied: Annotated[Ints, "column"]  # items that statements cover and omit
    shown: Annotated[Ints, "column"]  # items with a holder set
    received: Annotated[Ints, "sender"]  # 1 if the packet acknowledges the last one of that sender
    columns: Annotated[Ints, "column"]  # of each candidate
    vector: Annotated[Bytes, "column"]  # scratch: a symbol
    before: Annotated[Ints, "column", "peer"]  # scratch


def new_statements(case: Case) -> Statements:
    """Allocate the state; `forget_all` clears it before each trial."""
    return allocated(Statements, sizes_of(case) | {"row": MOST_ROWS}, new_plan(case.n_nodes * n_columns_of(case)))


def new_plan(n: int) -> PacketPlan:
    """Allocate the plan of a packet: ``n`` entries in each field, the most that any needs."""
    kinds = get_type_hints(PacketPlan).values()
    plan = PacketPlan._make(np.zeros(n, np.float64 if kind is Shares else np.int64) for kind in kinds)
    return plan._replace(weight=np.ones(n))


def forget_all(statements: Statements) -> None:
    """Clear the state of all nodes."""
    statements.lost[:] = 0.0
    statements.weight[:] = 0.0
    statements.number[:] = UNKNOWN
    statements.n_rows[:] = 0
    statements.n_plain[:] = 0
    statements.n_coded[:] = 0
    statements.share[:] = 0.0
    statements.n_numbers[:] = 0


def number_item(statements: Statements, origin: int, column: int) -> None:
    """Number a new item of the origin; clear the state of the column's old item."""
    for node in range(len(statements.confirmed)):
        statements.confirmed[node, column] = statements.told[node, column] = 0
        statements.n_passed[node, column] = MOST_PASSED
        statements.passed_slot[node, column] = UNKNOWN
        for peer in range(len(statements.confirmed)):
            statements.lacks[node, column, peer] = 1.0
    statements.number[column] = statements.n_numbers[origin]
    statements.n_numbers[origin] += 1


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


def place_of_last(n_nodes: int, node: int, slot: int) -> int:
    """Ring place of a node's last packet before or in a slot."""
    return (slot - (slot - node) % n_nodes) % (2 * n_nodes)


def knows_last(n_nodes: int, fleet: Fleet, node: int, sender: int, slot: int) -> bool:
    """True if a node received the last packet of a sender before a slot."""
    return bool(fleet.known[node, place_of_last(n_nodes, sender, slot)] & 1)


# Packet composition -------------------------------------------------------------------------------


def look_through(case: Case, fleet: Fleet, statements: Statements, owner: int) -> None:
    """Compute which item numbers the owner's statement about each origin covers.

    The range starts at the first unsettled item and ends after the last held one; at most ``MOST_STATED`` numbers.
    """
    for origin in range(len(statements.first)):
        first, end = statements.n_numbers[origin], 0
        for column in columns_of(case, origin):
            number = statements.number[column]
            if is_alive(statements, column) and not fleet.settled[owner, column] & 1:
                first = min(first, number)
            if is_alive(statements, column) and has_item(fleet, owner, column):
                end = max(end, number + 1)
        statements.first[origin], statements.end[origin] = first, min(max(first, end), first + MOST_STATED)


def count_owed(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int) -> None:
    """Count the unreported acknowledgements to each origin, and the size of a statement."""
    n_nodes, plan = len(statements.first), statements.plan
    for origin in range(n_nodes):
        plan.owed[origin], plan.statement_bits[origin] = 0.0, IMPOSSIBLE
        last, is_known = place_of_last(n_nodes, origin, slot), knows_last(n_nodes, fleet, owner, origin, slot)
        for column in columns_of(case, origin if origin != owner else case.n_sources):
            is_told = statements.confirmed[owner, column] or (is_known and fleet.loaded[last, column] & 1)
            if is_alive(statements, column) and has_item(fleet, owner, column) and not is_told:
                plan.owed[origin] += int(statements.number[column] < statements.end[origin])
        length = statements.end[origin] - statements.first[origin]
        if length > 0 or plan.owed[origin] > 0:
            length = 0 if origin == owner else length
            plan.statement_bits[origin] = statement_bits(n_nodes, case.number_bits, length)


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
                    lack = max(LEAST_LACK, statements.lacks[owner, column, peer])
                if peer != owner and lack < 1.0:
                    plan.is_new[c] = 0
                plan.lacks[c * n_nodes + peer] = lack
            c += 1
    return c


def compose_packet(case: Case, fleet: Fleet, statements: Statements, slot: Slot, n_bits: int) -> tuple[int, int]:
    """Compose the owner's packet behind a header of ``n_bits``; return its items and symbols."""
    n_nodes, plan = case.n_nodes, statements.plan
    owner, place = slot.owner, slot.place
    look_through(case, fleet, statements, owner)
    count_owed(case, fleet, statements, owner, slot.number)
    n_candidates = gather(case, fleet, statements, owner)
    for peer in range(n_nodes):
        reception = reception_of(statements.lost[owner, peer], statements.weight[owner, peer])
        plan.reception[peer] = 0.0 if peer == owner else reception
    left = case.capacity_bits - END_BITS - n_bits
    if case.codes:
        left -= COUNT_BITS
    n_symbols = plan_packet(plan, n_nodes, n_candidates, left, case.codes, slot.frame % 2 == 1)
    fleet.loaded[place, :] = 0
    n_sent = 0
    for c in range(n_candidates):
        if plan.takes[c] != 0:
            column = statements.columns[c]
            fleet.loaded[place, column] = 1
            statements.brought[owner, n_sent] = column
            left -= plan.size_bits[c]
            n_sent += 1
    statements.n_plain[owner] = n_sent
    for origin in range(n_nodes):
        if plan.states[origin] != 0:
            left -= plan.statement_bits[origin]
    if n_symbols > 0:
        left -= SIZE_BITS + n_symbols * case.symbol_bits
    state_holdings(case, fleet, statements, owner, place, n_symbols)
    show_holders(case, fleet, statements, owner, slot.number, left)
    note_told(case, fleet, statements, owner, slot.number)
    note_brought(case, fleet, statements, owner, owner, n_symbols)
    return n_sent, n_symbols


def state_holdings(case: Case, fleet: Fleet, statements: Statements, owner: int, place: int, n_symbols: int) -> None:
    """Write statements, their omissions, and the items that symbols cover."""
    n_plain, n_coded = statements.n_plain[owner], 0
    statements.stated[:] = 0
    statements.below[:] = 0
    statements.denied[:] = 0
    for origin in range(case.n_sources):
        length = statements.end[origin] - statements.first[origin]
        for column in columns_of(case, origin if statements.plan.states[origin] != 0 else case.n_sources):
            number = statements.number[column]
            if not is_alive(statements, column):
                continue
            if number < statements.first[origin]:
                statements.below[column] = 1
            elif number < statements.end[origin] and has_item(fleet, owner, column):
                statements.stated[column] = 1
                if n_symbols > 0 and not fleet.loaded[place, column]:
                    statements.brought[owner, n_plain + n_coded] = column
                    n_coded += 1
            elif number < statements.end[origin] or length < MOST_STATED:
                statements.denied[column] = 1
    statements.n_coded[owner] = n_coded


def show_holders(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int, room_bits: int) -> None:
    """Add holder sets to the packet within its capacity, in order of ``holder_set_rank``."""
    left, size_bits = room_bits, holder_set_bits(case.n_nodes, case.number_bits)
    statements.shown[:] = 0
    while left >= size_bits:
        chosen, lowest = UNKNOWN, slot
        for column in range(n_columns_of(case)):
            if can_show(fleet, statements, owner, column):
                rank = holder_set_rank(statements.learned_slot[owner, column], statements.passed_slot[owner, column])
                if rank < lowest:
                    chosen, lowest = column, rank
        if chosen == UNKNOWN:
            return
        statements.shown[chosen] = 1
        statements.passed_slot[owner, chosen] = slot
        statements.n_passed[owner, chosen] += 1
        left -= size_bits


def can_show(fleet: Fleet, statements: Statements, owner: int, column: int) -> bool:
    """True if the owner knows another holder of an item and has not reported it in this packet."""
    is_told = statements.n_passed[owner, column] >= MOST_PASSED
    if is_told or not is_alive(statements, column) or statements.shown[column]:
        return False
    n_holders = 0
    for peer in range(fleet.holders.shape[2]):
        n_holders += fleet.holders[owner, column, peer] & 1
    return n_holders > 1 and has_item(fleet, owner, column)


def note_told(case: Case, fleet: Fleet, statements: Statements, owner: int, slot: int) -> None:
    """Record what the packet reports of the owner's received set."""
    n_nodes = len(statements.first)
    for origin in range(case.n_sources):
        last, is_known = place_of_last(n_nodes, origin, slot), knows_last(n_nodes, fleet, owner, origin, slot)
        for column in columns_of(case, origin):
            said = statements.stated[column] | statements.below[column] | statements.shown[column]
            said |= fleet.loaded[slot % (2 * n_nodes), column] & 1
            if is_known:
                said |= fleet.loaded[last, column] & 1
            statements.told[owner, column] = said if has_item(fleet, owner, column) else 0


def note_brought(case: Case, fleet: Fleet, statements: Statements, node: int, owner: int, n_symbols: int) -> None:
    """Update a node's lack estimates by the owner's packet, for items that the node holds."""
    n_plain = statements.n_plain[owner]
    for peer in range(case.n_nodes):
        statements.share[node, owner, peer] = 0.0
        if peer in (node, owner):
            continue
        share = share_of_symbols(n_symbols, lacked_of_code(fleet, statements, node, owner, peer))
        reception = reception_of(statements.lost[node, peer], statements.weight[node, peer])
        statements.share[node, owner, peer] = share
        for place in range(n_plain + statements.n_coded[owner]):
            column = statements.brought[owner, place]
            if has_item(fleet, node, column):
                statements.lacks[node, column, peer] *= kept_of_lack(reception, 1.0 if place < n_plain else share)


def lacked_of_code(fleet: Fleet, statements: Statements, node: int, owner: int, peer: int) -> float:
    """Expected number of items in the owner's symbols that a peer lacks, by a node's estimate."""
    lacked, n_plain = 0.0, statements.n_plain[owner]
    for place in range(n_plain, n_plain + statements.n_coded[owner]):
        column = statements.brought[owner, place]
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


def note_fate(fleet: Fleet, statements: Statements, case: Case, node: int, owner: int) -> None:
    """Update link and lack estimates by the owner's acknowledgement of a node's last packet."""
    received = statements.received[node]
    lost, weight = statements.lost[node, owner], statements.weight[node, owner]
    statements.lost[node, owner] = KEPT * lost + (1 - received)
    statements.weight[node, owner] = KEPT * weight + 1.0
    for column in columns_of(case, owner if received else case.n_sources):
        statements.confirmed[node, column] |= statements.told[node, column]
    # With the delivery rate before this sample, which the lack was estimated with.
    reckon_fate(fleet, statements, node, owner, node, reception_of(lost, weight))


def reckon_fate(fleet: Fleet, statements: Statements, node: int, owner: int, sender: int, reception: float) -> None:
    """Correct lack estimates by the owner's acknowledgement of a sender's last packet."""
    is_received = statements.received[sender] == 1
    n_plain, share = statements.n_plain[sender], statements.share[node, sender, owner]
    for place in range(n_plain + statements.n_coded[sender]):
        column, of_place = statements.brought[sender, place], 1.0 if place < n_plain else share
        if has_item(fleet, node, column) and not (place < n_plain and is_received):
            lack = statements.lacks[node, column, owner]
            statements.lacks[node, column, owner] = lack_after(lack, reception, of_place, is_received)


def note_fates_of_others(n_nodes: int, fleet: Fleet, statements: Statements, node: int, owner: int, slot: int) -> None:
    """Apply the owner's acknowledgements of the last packets of others that the node received."""
    reception = reception_of(statements.lost[node, owner], statements.weight[node, owner])
    for sender in range(n_nodes):
        if sender not in (node, owner) and knows_last(n_nodes, fleet, node, sender, slot):
            reckon_fate(fleet, statements, node, owner, sender, reception)


def believe_statements(case: Case, fleet: Fleet, statements: Statements, node: int, owner: int) -> None:
    """Apply the owner's statements and holder sets."""
    for column in range(n_columns_of(case)):
        below, shown = statements.below[column], statements.shown[column]
        fleet.holders[node, column, owner] |= statements.stated[column] | below
        for peer in range(fleet.holders.shape[2]):
            fleet.holders[node, column, peer] |= below | shown & fleet.holders[owner, column, peer]
        if statements.denied[column]:
            statements.lacks[node, column, owner] = 1.0


def add_symbol(case: Case, fleet: Fleet, statements: Statements, node: int) -> None:
    """Add the symbol in `vector`, as `exchange.policy.coding.Decoder.add`, coefficients only."""
    rows, pivots, vector = statements.rows[node], statements.pivots[node], statements.vector
    n_rows = int(statements.n_rows[node])
    for row in range(n_rows):
        take_off(vector, int(vector[pivots[row]]), rows[row], pivots[row])
    pivot = pivot_of(vector)
    if pivot < 0 or n_rows == MOST_ROWS:
        return
    by = _INVERSES[vector[pivot]]
    for column in range(pivot, len(vector)):
        vector[column] = _PRODUCTS[by, vector[column]]
    for row in range(n_rows):
        take_off(rows[row], int(rows[row, pivot]), vector, pivot)
    overwrite(vector, rows[n_rows])
    pivots[n_rows] = pivot
    statements.n_rows[node] = n_rows + 1
    take_solved(case, fleet, statements, node)


def take_off(one: Bytes, factor: int, row: Bytes, pivot: int) -> None:
    """Subtract the factor times a row, which is zero before its pivot."""
    if factor != 0:
        for column in range(pivot, len(row)):
            one[column] ^= _PRODUCTS[factor, row[column]]


def overwrite(one: NDArray[Any], other: NDArray[Any]) -> None:
    """Copy the first row over the second."""
    for at in range(len(one)):
        other[at] = one[at]


def pivot_of(row: Bytes, begin: int = 0) -> int:
    """Return the first non-zero column from `begin`; -1 if all are 0."""
    for column in range(begin, len(row)):
        if row[column] != 0:
            return column
    return -1


def take_solved(case: Case, fleet: Fleet, statements: Statements, node: int) -> None:
    """Remove symbols of a single item; the node holds that item from now on."""
    rows, pivots, kept = statements.rows[node], statements.pivots[node], 0
    for row in range(statements.n_rows[node]):
        pivot = pivots[row]
        if pivot_of(rows[row], pivot + 1) < 0:
            fleet.holders[node, pivot, node] |= 1
            fleet.holders[node, pivot, pivot // case.columns_per_source] |= 1
        else:
            if kept < row:
                overwrite(rows[row], rows[kept])
            pivots[kept] = pivot
            kept += 1
    statements.n_rows[node] = kept


def drop_known(case: Case, fleet: Fleet, statements: Statements, node: int) -> None:
    """Eliminate known items from undecoded symbols, as `exchange.policy.coding.Decoder.learn`."""
    n_known, n_rows = 0, int(statements.n_rows[node])
    for row in range(n_rows):
        for column in range(n_columns_of(case)):
            n_known += int(statements.rows[node, row, column] != 0 and has_item(fleet, node, column))
    if n_known > 0:
        statements.n_rows[node] = 0
        for row in range(n_rows):
            for column in range(n_columns_of(case)):
                is_known = has_item(fleet, node, column)
                statements.vector[column] = 0 if is_known else statements.rows[node, row, column]
            add_symbol(case, fleet, statements, node)


def hear_symbols(case: Case, fleet: Fleet, statements: Statements, node: int, slot: int, n_symbols: int) -> None:
    """Decode the symbols of a packet."""
    drop_known(case, fleet, statements, node)
    for place in range(n_symbols):
        key, n_lacked = symbol_key(slot, place), 0
        for column in range(n_columns_of(case)):
            statements.vector[column] = 0
            if statements.stated[column] and not has_item(fleet, node, column):
                origin = column // case.columns_per_source
                statements.vector[column] = coefficient(key, origin, statements.number[column])
                n_lacked += 1
        if n_lacked == 0:
            return
        add_symbol(case, fleet, statements, node)


def hear(case: Case, fleet: Fleet, statements: Statements, slot: Slot, node: int, n_symbols: int) -> None:
    """Process the packet of a slot at a node."""
    n_nodes, owner = case.n_nodes, slot.owner
    for column in range(n_columns_of(case)):
        for peer in range(n_nodes):
            statements.before[column, peer] = fleet.holders[node, column, peer]
    if statements.received[node] != UNKNOWN:
        # Before its first slot a node has no packet to be acknowledged.
        if slot.number > node:
            note_fate(fleet, statements, case, node, owner)
        note_fates_of_others(n_nodes, fleet, statements, node, owner, slot.number)
    trials.hear(case, fleet, slot, node, 1)
    believe_statements(case, fleet, statements, node, owner)
    hear_symbols(case, fleet, statements, node, slot.number, n_symbols)
    note_brought(case, fleet, statements, node, owner, n_symbols)
    trials.settle(fleet, node)
    for column in range(n_columns_of(case)):
        for peer in range(n_nodes):
            if fleet.holders[node, column, peer] & ~statements.before[column, peer] & 1:
                statements.learned_slot[node, column] = slot.number
                statements.n_passed[node, column] = 0


# One slot -----------------------------------------------------------------------------------------


def number_items(case: Case, fleet: Fleet, statements: Statements, slot: int) -> None:
    """Number the items that are new in a slot; forget those whose column is free."""
    if slot == 0:
        forget_all(statements)
    for column in range(n_columns_of(case)):
        if fleet.lanes.free_slot[0, column] <= slot:
            statements.number[column] = UNKNOWN
        elif fleet.lanes.born_slot[0, column] == slot:
            number_item(statements, column // case.columns_per_source, column)


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
