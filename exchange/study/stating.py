"""The slot loop of policies that state holdings, in the policy study: `exchange.study.montecarlo` has that of others.

What a node holds of an origin it states as `exchange.planning` has it: all below a number it holds, and knows all to
hold; of those from it on, a mask says which. An item is a column, and has the number that its origin gave it. What goes
into a packet is planned by `exchange.planning`, as in a vehicle; symbols are over the field of `exchange.coding`, of
which only the coefficients matter here: what a node can decode. All else is shared with the other policies.

Plain Python that `exchange.study.compiler` compiles.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from exchange.ack import AckRules, absorb, compose, open_slot, settled
from exchange.acoustics.loss import trial_key
from exchange.coding import LOGS, MOST_ROWS, POWERS, coefficient, inverse, symbol_key
from exchange.planning import (
    COUNT_BITS,
    END_BITS,
    IMPOSSIBLE,
    KEPT,
    LEAST_LACK,
    MOST_PASSED,
    MOST_STATED,
    SIZE_BITS,
    PacketPlan,
    holder_set_bits,
    kept_of_lack,
    lack_after,
    plan_packet,
    reception_of,
    share_of_symbols,
    statement_bits,
)
from exchange.policies import may_send
from exchange.study.montecarlo import count_false_beliefs, drawn_receivers, generate, header_sizes
from exchange.study.trial import (
    COUNT,
    FALSE_BELIEFS,
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
    new_nodes,
    node_state,
    note_progress,
)

UNKNOWN = -1
"""Slot in which nothing was told."""

Bytes: TypeAlias = NDArray[np.uint8]

_PRODUCTS = np.array(POWERS, np.uint8)[np.add.outer(LOGS, LOGS)]
"""Products in the field of `exchange.coding`."""
_PRODUCTS[0] = _PRODUCTS[:, 0] = 0
_INVERSES = np.array([0, *map(inverse, range(1, 256))], np.uint8)


_BIT_OF = np.zeros(67, np.int64)
"""The bit that is set in a power of two, by its remainder: the powers below 2^63 have 63 different ones."""
for _bit in range(WORD_BITS):
    _BIT_OF[(1 << _bit) % 67] = _bit


class Statements(NamedTuple):
    """What nodes reckon with beside `NodeStates`; a row each.

    Shapes: [node, word] of sets, [node, column], [node, peer].
    """

    confirmed: Ints  # items of others that their origin is known to know this node to hold
    told: Ints  # those that the last own packet told it to hold
    lacks: Floats  # [node, column, peer] probability that the peer lacks the item
    lost: Floats  # weighted number of own packets that the peer has lost
    weight: Floats  # of how many
    learned_slot: Ints  # in which the node last learned who holds the item
    passed_slot: Ints  # in which it last told a holder set of it
    n_passed: Ints  # how often, since it learned
    telling: Ints  # [node, word] items of which it has learned that, and not told often enough
    n_rows: Ints  # [node] symbols that wait to be decoded
    rows: Bytes  # [node, row, column] their coefficients
    pivots: Ints  # [node, row] the first column of each that is not 0
    waiting: Ints  # [node, word] items that they are over, at least
    brought: Ints  # [node, place] columns of the items of its last packet, and behind them those that are coded
    n_plain: Ints  # [node] the former
    n_coded: Ints  # [node] the latter
    number: Ints  # [column] that the origin gave the item
    n_numbers: Ints  # [node] items that it has had
    # Of the packet that is being sent:
    first: Ints  # [origin] number that its statement begins with
    end: Ints  # [origin] number behind those that it tells of
    is_total: Ints  # [origin] 1 if it tells of all items of the origin
    stated: Ints  # [word] items that statements say to be held
    below: Ints  # [word] items that statements say all to hold
    coded: Ints  # [word] items that symbols are over
    denied: Ints  # [place] columns that statements cover and leave out
    n_denied: Ints  # [0] how many
    shown: Ints  # [word] items of which a holder set is told
    columns: Ints  # [candidate]
    alive: Ints  # [word] columns that have an item
    tellable: Ints  # [word] scratch: items of which a holder set can be told
    share: Floats  # [node, sender, peer] how surely the symbols of its last packet brought the peer what they are over
    kept: Floats  # [peer] scratch: what is left of its lacking an item that was brought
    vector: Bytes  # [column] scratch: a symbol
    before: Ints  # [word of believes] scratch


def new_statements(rules: PolicyRules, n_columns: int) -> Statements:
    """Memory for all trials; `forget_all` clears it before each."""
    n_nodes, n_words = rules.n_nodes, rules.n_words
    return Statements(
        confirmed=np.zeros((n_nodes, n_words), np.int64),
        told=np.zeros((n_nodes, n_words), np.int64),
        lacks=np.ones((n_nodes, n_columns, n_nodes)),
        lost=np.zeros((n_nodes, n_nodes)),
        weight=np.zeros((n_nodes, n_nodes)),
        learned_slot=np.zeros((n_nodes, n_columns), np.int64),
        passed_slot=np.zeros((n_nodes, n_columns), np.int64),
        n_passed=np.zeros((n_nodes, n_columns), np.int64),
        telling=np.zeros((n_nodes, n_words), np.int64),
        n_rows=np.zeros(n_nodes, np.int64),
        rows=np.zeros((n_nodes, MOST_ROWS, n_columns), np.uint8),
        pivots=np.zeros((n_nodes, MOST_ROWS), np.int64),
        waiting=np.zeros((n_nodes, n_words), np.int64),
        brought=np.zeros((n_nodes, n_columns), np.int64),
        n_plain=np.zeros(n_nodes, np.int64),
        n_coded=np.zeros(n_nodes, np.int64),
        number=np.zeros(n_columns, np.int64),
        n_numbers=np.zeros(n_nodes, np.int64),
        first=np.zeros(n_nodes, np.int64),
        end=np.zeros(n_nodes, np.int64),
        is_total=np.zeros(n_nodes, np.int64),
        stated=np.zeros(n_words, np.int64),
        below=np.zeros(n_words, np.int64),
        coded=np.zeros(n_words, np.int64),
        denied=np.zeros(n_columns, np.int64),
        n_denied=np.zeros(1, np.int64),
        shown=np.zeros(n_words, np.int64),
        columns=np.zeros(n_columns, np.int64),
        alive=np.zeros(n_words, np.int64),
        tellable=np.zeros(n_words, np.int64),
        share=np.zeros((n_nodes, n_nodes, n_nodes)),
        kept=np.zeros(n_nodes),
        vector=np.zeros(n_columns, np.uint8),
        before=np.zeros(n_nodes * n_words, np.int64),
    )


def new_plan(n_nodes: int, n_columns: int) -> PacketPlan:
    """Memory for the plan of a packet."""
    return PacketPlan(
        reception=np.zeros(n_nodes),
        origin=np.zeros(n_columns, np.int64),
        size_bits=np.zeros(n_columns, np.int64),
        symbol_bits=np.zeros(n_columns, np.int64),
        is_new=np.zeros(n_columns, np.int64),
        is_stated=np.zeros(n_columns, np.int64),
        weight=np.ones(n_columns),
        lacks=np.zeros(n_columns * n_nodes),
        owed=np.zeros(n_nodes),
        statement_bits=np.zeros(n_nodes, np.int64),
        gain=np.zeros(n_columns),
        takes=np.zeros(n_columns, np.int64),
        states=np.zeros(n_nodes, np.int64),
        rests=np.zeros(n_columns, np.int64),
        with_code=np.zeros(n_nodes, np.int64),
        lacked=np.zeros(n_nodes),
        worth_lacked=np.zeros(n_nodes),
        begin=np.zeros(n_nodes, np.int64),
        end=np.zeros(n_nodes, np.int64),
    )


def forget_all(statements: Statements) -> None:
    """Nobody has told or heard anything."""
    statements.confirmed[:] = 0
    statements.told[:] = 0
    statements.lost[:] = 0.0
    statements.weight[:] = 0.0
    statements.telling[:] = 0
    statements.alive[:] = 0
    statements.n_rows[:] = 0
    statements.waiting[:] = 0
    statements.n_plain[:] = 0
    statements.n_coded[:] = 0
    statements.share[:] = 0.0
    statements.n_numbers[:] = 0


def number_item(rules: PolicyRules, statements: Statements, origin: int, column: int) -> None:
    """The column has a new item of the origin; nothing remains of an older one."""
    w, bit = column // WORD_BITS, 1 << column % WORD_BITS
    for node in range(rules.n_nodes):
        statements.confirmed[node, w] &= ~bit
        statements.told[node, w] &= ~bit
        statements.telling[node, w] &= ~bit
        statements.passed_slot[node, column] = UNKNOWN
        for peer in range(rules.n_nodes):
            statements.lacks[node, column, peer] = 1.0
    statements.number[column] = statements.n_numbers[origin]
    statements.n_numbers[origin] += 1
    statements.alive[w] |= bit


def is_in(words: Ints, column: int) -> bool:
    """True if the set of items has the column."""
    return bool((words[column // WORD_BITS] >> column % WORD_BITS) & 1)


def first_in(items: int, w: int) -> int:
    """The first column of a set of items of which word w is given, and the others are empty."""
    return w * WORD_BITS + int(_BIT_OF[(items & -items) % len(_BIT_OF)])


def has_item(rules: PolicyRules, nodes: NodeStates, node: int, column: int) -> bool:
    """True if the node holds the item."""
    at = node * rules.n_words + column // WORD_BITS
    return bool((nodes.believes[node, at] >> column % WORD_BITS) & 1)


# What goes into a packet --------------------------------------------------------------------------


def look_through(rules: PolicyRules, nodes: NodeStates, statements: Statements, owner: int) -> None:
    """Find what the owner of the slot can state of each origin: from where to where."""
    n_words = rules.n_words
    for origin in range(rules.n_nodes):
        first = n_numbers = statements.n_numbers[origin]
        for w in range(n_words):
            items = statements.alive[w] & nodes.origins[origin * n_words + w] & ~nodes.settled[owner * n_words + w]
            while items != 0:
                first = min(first, statements.number[first_in(items, w)])
                items &= items - 1
        end = first
        for w in range(n_words if first < n_numbers else 0):
            items = statements.alive[w] & nodes.origins[origin * n_words + w] & nodes.holds[owner * n_words + w]
            while items != 0:
                end = max(end, statements.number[first_in(items, w)] + 1)
                items &= items - 1
        statements.is_total[origin] = int(end - first < MOST_STATED)
        statements.first[origin], statements.end[origin] = first, min(end, first + MOST_STATED)


def count_owed(
    rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, plan: PacketPlan, owner: int
) -> None:
    """Count what the owner has to tell each origin of holding its items, and what a statement takes."""
    n_nodes, n_words = rules.n_nodes, rules.n_words
    for origin in range(n_nodes):
        plan.owed[origin], plan.statement_bits[origin] = 0.0, IMPOSSIBLE
        acknowledged = -(nodes.heard[owner, 0] >> origin & 1)
        for w in range(n_words if origin != owner else 0):
            at = origin * n_words + w
            told = statements.confirmed[owner, w] | nodes.content[owner, at] & acknowledged
            items = statements.alive[w] & nodes.origins[at] & nodes.holds[owner * n_words + w] & ~told
            while items != 0:
                plan.owed[origin] += int(statements.number[first_in(items, w)] < statements.end[origin])
                items &= items - 1
        length = statements.end[origin] - statements.first[origin]
        if length > 0 or plan.owed[origin] > 0:
            length = 0 if origin == owner else length
            plan.statement_bits[origin] = statement_bits(n_nodes, load.number_bits, length)


def gather(
    rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, plan: PacketPlan, owner: int
) -> int:
    """Gather what the owner may send and does not know all to hold; returns how many items."""
    n_nodes, n_words, c = rules.n_nodes, rules.n_words, 0
    for turn in range(n_nodes * n_words):  # own ones first: of equals each node takes others
        origin, w = (owner + turn // n_words) % n_nodes, turn % n_words
        at = owner * n_words + w
        may_go = may_send(rules.repeat, nodes.holds[at] & ~nodes.settled[at], nodes.origins[at])
        items = may_go & nodes.origins[origin * n_words + w]
        while items != 0:
            column, bit = first_in(items, w), items & -items
            items &= items - 1
            number = statements.number[column]
            statements.columns[c] = column
            plan.origin[c] = origin
            plan.size_bits[c], plan.symbol_bits[c] = nodes.sizes_bits[column], load.symbol_bits
            plan.is_new[c] = int(origin == owner)
            plan.is_stated[c] = int(statements.first[origin] <= number < statements.end[origin])
            for peer in range(n_nodes):
                lack = 0.0
                if peer != owner and nodes.believes[owner, peer * n_words + w] & bit == 0:
                    lack = max(LEAST_LACK, statements.lacks[owner, column, peer])
                if peer != owner and lack < 1.0:
                    plan.is_new[c] = 0
                plan.lacks[c * n_nodes + peer] = lack
            c += 1
    return c


def compose_packet(
    rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, plan: PacketPlan, owner: int, slot: int
) -> tuple[int, int]:
    """Put into the packet what the owner of the slot sends; returns the number of items and symbols."""
    n_nodes = rules.n_nodes
    look_through(rules, nodes, statements, owner)
    count_owed(rules, load, nodes, statements, plan, owner)
    n_candidates = gather(rules, load, nodes, statements, plan, owner)
    for peer in range(n_nodes):
        reception = reception_of(statements.lost[owner, peer], statements.weight[owner, peer])
        plan.reception[peer] = 0.0 if peer == owner else reception
    left = load.capacity_bits - END_BITS - nodes.header_bits[slot % len(nodes.header_bits)]
    if rules.codes:
        left -= COUNT_BITS
    n_symbols = plan_packet(plan, n_nodes, n_candidates, left, rules.codes, slot // n_nodes % 2 == 1)
    nodes.packet[:] = 0
    n_sent = 0
    for c in range(n_candidates):
        if plan.takes[c] != 0:
            column = statements.columns[c]
            nodes.packet[column // WORD_BITS] |= 1 << column % WORD_BITS
            statements.brought[owner, n_sent] = column
            left -= plan.size_bits[c]
            n_sent += 1
    statements.n_plain[owner] = n_sent
    for origin in range(n_nodes):
        if plan.states[origin] != 0:
            left -= plan.statement_bits[origin]
    if n_symbols > 0:
        left -= SIZE_BITS + n_symbols * load.symbol_bits
    state_holdings(rules, load, nodes, statements, plan, owner, n_symbols)
    show_holders(rules, load, nodes, statements, owner, slot, left)
    note_told(rules, nodes, statements, owner)
    note_brought(rules, nodes, statements, owner, owner, n_symbols)
    return n_sent, n_symbols


def state_holdings(
    rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, plan: PacketPlan, owner: int,
    n_symbols: int,
) -> None:  # fmt: skip
    """Write what the statements say, what they leave out, and what symbols are over."""
    n_words, per_source = rules.n_words, load.columns_per_source
    n_plain, n_coded, n_denied = statements.n_plain[owner], 0, 0
    statements.stated[:] = 0
    statements.below[:] = 0
    statements.coded[:] = 0
    for origin in range(load.n_sources):
        for column in range(origin * per_source, (origin + 1) * per_source if plan.states[origin] != 0 else 0):
            w, bit, number = column // WORD_BITS, 1 << column % WORD_BITS, statements.number[column]
            if statements.alive[w] & bit == 0:
                continue
            if number < statements.first[origin]:
                statements.below[w] |= bit
            elif number < statements.end[origin] and nodes.holds[owner * n_words + w] & bit != 0:
                statements.stated[w] |= bit
                if n_symbols > 0 and nodes.packet[w] & bit == 0:
                    statements.coded[w] |= bit
                    statements.brought[owner, n_plain + n_coded] = column
                    n_coded += 1
            elif number < statements.end[origin] or statements.is_total[origin] != 0:
                statements.denied[n_denied] = column
                n_denied += 1
    statements.n_coded[owner], statements.n_denied[0] = n_coded, n_denied


def show_holders(
    rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, owner: int, slot: int, room_bits: int
) -> None:
    """Tell of the items of which something was learned last who holds them, as far as there is room."""
    n_words, left = rules.n_words, room_bits
    size_bits = holder_set_bits(rules.n_nodes, load.number_bits)
    for w in range(n_words):
        held = held_twice = 0
        for peer in range(rules.n_nodes):
            held_twice |= held & nodes.believes[owner, peer * n_words + w]
            held |= nodes.believes[owner, peer * n_words + w]
        items = statements.telling[owner, w] & statements.alive[w]
        statements.tellable[w] = items & held_twice & nodes.holds[owner * n_words + w]
        statements.shown[w] = 0
    while left >= size_bits:
        first = slot
        for w in range(n_words):
            items = statements.tellable[w]
            while items != 0:
                first = min(first, rank(statements, owner, first_in(items, w)))
                items &= items - 1
        if first == slot:
            return
        for w in range(n_words):
            items = statements.tellable[w]
            while items != 0 and left >= size_bits:
                column, bit = first_in(items, w), items & -items
                items &= items - 1
                if rank(statements, owner, column) == first:
                    statements.tellable[w] &= ~bit
                    statements.shown[w] |= bit
                    statements.passed_slot[owner, column] = slot
                    statements.n_passed[owner, column] += 1
                    if statements.n_passed[owner, column] == MOST_PASSED:
                        statements.telling[owner, w] &= ~bit
                    left -= size_bits


def rank(statements: Statements, owner: int, column: int) -> int:
    """Of what it can tell, a node tells the lowest first: the newest of news, then what it told the longest ago."""
    learned, passed = statements.learned_slot[owner, column], statements.passed_slot[owner, column]
    return int(passed if learned <= passed else -1 - learned)


def note_told(rules: PolicyRules, nodes: NodeStates, statements: Statements, owner: int) -> None:
    """Note what the packet tells of the owner's holdings."""
    n_words = rules.n_words
    for w in range(n_words):
        said = statements.stated[w] | statements.below[w] | statements.shown[w] | nodes.packet[w]
        for origin in range(rules.n_nodes):
            if nodes.heard[owner, 0] >> origin & 1 != 0:
                said |= nodes.content[owner, origin * n_words + w] & nodes.origins[origin * n_words + w]
        statements.told[owner, w] = said & nodes.holds[owner * n_words + w]


def note_brought(
    rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int, n_symbols: int
) -> None:
    """Reckon with what the owner's packet, which a node has sent or heard, brings to others: of items that it holds."""
    n_nodes, n_plain, n_coded = rules.n_nodes, statements.n_plain[owner], statements.n_coded[owner]
    for peer in range(n_nodes):
        reception = reception_of(statements.lost[node, peer], statements.weight[node, peer])
        statements.kept[peer] = 1.0 if peer in (node, owner) else kept_of_lack(reception, 1.0)
    reckon_brought(rules, nodes, statements, node, owner, 0, n_plain)
    for peer in range(n_nodes):
        share = 0.0
        if peer not in (node, owner):
            share = share_of_symbols(n_symbols, lacked_of_code(rules, nodes, statements, node, owner, peer))
        reception = reception_of(statements.lost[node, peer], statements.weight[node, peer])
        statements.share[node, owner, peer], statements.kept[peer] = share, kept_of_lack(reception, share)
    reckon_brought(rules, nodes, statements, node, owner, n_plain, n_plain + n_coded)


def lacked_of_code(
    rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int, peer: int
) -> float:
    """How many items of those that the owner's symbols are over a node reckons a peer to lack."""
    lacked, n_plain = 0.0, statements.n_plain[owner]
    for place in range(n_plain, n_plain + statements.n_coded[owner]):
        column = statements.brought[owner, place]
        at = peer * rules.n_words + column // WORD_BITS
        if not has_item(rules, nodes, node, column):
            lacked += 1.0
        elif (nodes.believes[node, at] >> column % WORD_BITS) & 1 == 0:
            lacked += statements.lacks[node, column, peer]
    return lacked


def reckon_brought(
    rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int, begin: int, end: int
) -> None:
    """Reckon with some of what it brings: ``kept`` is left of what each peer lacked."""
    for place in range(begin, end):
        column = statements.brought[owner, place]
        if has_item(rules, nodes, node, column):
            for peer in range(rules.n_nodes):
                statements.lacks[node, column, peer] *= statements.kept[peer]


# What is made of one ------------------------------------------------------------------------------


def note_fate(rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int) -> None:
    """Learn from the owner's bit about a node's own last packet what became of that."""
    n_words = rules.n_words
    received = nodes.rows[owner] >> node & 1
    lost, weight = statements.lost[node, owner], statements.weight[node, owner]
    reception = reception_of(lost, weight)
    statements.lost[node, owner] = KEPT * lost + (1 - received)
    statements.weight[node, owner] = KEPT * weight + 1.0
    for w in range(n_words):
        if received != 0:
            statements.confirmed[node, w] |= statements.told[node, w] & nodes.origins[owner * n_words + w]
    reckon_fate(rules, nodes, statements, node, owner, node, reception)


def reckon_fate(
    rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int, sender: int, reception: float
) -> None:
    """The owner says whether it has received the last packet of a sender, which the node has: no longer guess."""
    is_received = bool((nodes.rows[owner] >> sender) & 1)
    n_plain, share = statements.n_plain[sender], statements.share[node, sender, owner]
    for place in range(n_plain + statements.n_coded[sender]):
        column, of_place = statements.brought[sender, place], 1.0 if place < n_plain else share
        if has_item(rules, nodes, node, column) and not (place < n_plain and is_received):
            lack = statements.lacks[node, column, owner]
            statements.lacks[node, column, owner] = lack_after(lack, reception, of_place, is_received)


def note_fates_of_others(rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int) -> None:
    """Learn from the owner's bits about the last packets of others, as far as the node has received them."""
    reception = reception_of(statements.lost[node, owner], statements.weight[node, owner])
    for sender in range(rules.n_nodes):
        is_known = nodes.heard[node, 0] >> sender & 1 != 0
        if sender not in (node, owner) and is_known:
            reckon_fate(rules, nodes, statements, node, owner, sender, reception)


def believe_statements(rules: PolicyRules, nodes: NodeStates, statements: Statements, node: int, owner: int) -> None:
    """Believe what statements and holder sets of the owner say."""
    n_nodes, n_words = rules.n_nodes, rules.n_words
    for w in range(n_words):
        below, shown = statements.below[w], statements.shown[w]
        nodes.believes[node, owner * n_words + w] |= statements.stated[w] | below
        for peer in range(n_nodes):
            nodes.believes[node, peer * n_words + w] |= below | shown & nodes.believes[owner, peer * n_words + w]
    for place in range(statements.n_denied[0]):
        statements.lacks[node, statements.denied[place], owner] = 1.0


def add_symbol(nodes: NodeStates, statements: Statements, rules: PolicyRules, node: int) -> None:
    """Take in the symbol that stands in `vector`: `exchange.coding.Decoder.add`, of which only coefficients count."""
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
        statements.waiting[node, column // WORD_BITS] |= int(vector[column] != 0) << column % WORD_BITS
    for row in range(n_rows):
        take_off(rows[row], int(rows[row, pivot]), vector, pivot)
    overwrite(vector, rows[n_rows])
    pivots[n_rows] = pivot
    statements.n_rows[node] = n_rows + 1
    take_solved(nodes, statements, rules, node)


def take_off(one: Bytes, factor: int, row: Bytes, pivot: int) -> None:
    """Take the factor times a row, which has nothing before its pivot, off another."""
    if factor != 0:
        for column in range(pivot, len(row)):
            one[column] ^= _PRODUCTS[factor, row[column]]


def overwrite(one: NDArray[Any], other: NDArray[Any]) -> None:
    """Write the numbers of one row over those of the other."""
    for at in range(len(one)):
        other[at] = one[at]


def pivot_of(row: Bytes, begin: int = 0) -> int:
    """The first column from `begin` on that is not 0; -1 if all are."""
    for column in range(begin, len(row)):
        if row[column] != 0:
            return column
    return -1


def take_solved(nodes: NodeStates, statements: Statements, rules: PolicyRules, node: int) -> None:
    """Take out the symbols of a single item, which the node holds from now on."""
    rows, pivots, kept = statements.rows[node], statements.pivots[node], 0
    for row in range(statements.n_rows[node]):
        pivot = pivots[row]
        if pivot_of(rows[row], pivot + 1) < 0:
            w, bit = pivot // WORD_BITS, 1 << pivot % WORD_BITS
            statements.waiting[node, w] &= ~bit
            nodes.believes[node, node * rules.n_words + w] |= bit
            for origin in range(rules.n_nodes):
                at = origin * rules.n_words + w
                nodes.believes[node, at] |= bit & nodes.origins[at]
        else:
            if kept < row:
                overwrite(rows[row], rows[kept])
            pivots[kept] = pivot
            kept += 1
    statements.n_rows[node] = kept


def drop_known(nodes: NodeStates, statements: Statements, rules: PolicyRules, node: int) -> None:
    """Take what the node holds out of the symbols that wait, each solved anew: `exchange.coding.Decoder.learn`."""
    known = 0
    for w in range(rules.n_words):
        known |= statements.waiting[node, w] & nodes.believes[node, node * rules.n_words + w]
    if known != 0:
        n_rows, statements.n_rows[node] = int(statements.n_rows[node]), 0
        statements.waiting[node, :] = 0
        for row in range(n_rows):
            for column in range(len(statements.vector)):
                is_known = has_item(rules, nodes, node, column)
                statements.vector[column] = 0 if is_known else statements.rows[node, row, column]
            add_symbol(nodes, statements, rules, node)


def hear_symbols(
    rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, node: int, slot: int, n_symbols: int
) -> None:
    """Take in the symbols of a packet."""
    drop_known(nodes, statements, rules, node)
    for place in range(n_symbols):
        lacked = 0
        for w in range(rules.n_words):
            lacked |= statements.coded[w] & ~nodes.believes[node, node * rules.n_words + w]
        if lacked == 0:
            return
        key = symbol_key(slot, place)
        for column in range(len(statements.vector)):
            statements.vector[column] = 0
            if is_in(statements.coded, column) and not has_item(rules, nodes, node, column):
                origin = column // load.columns_per_source
                statements.vector[column] = coefficient(key, origin, statements.number[column])
        add_symbol(nodes, statements, rules, node)


def hear(
    kind: AckRules, rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, owner: int,
    node: int, slot: int, n_symbols: int,
) -> None:  # fmt: skip
    """A node receives the packet of the owner of the slot."""
    n_nodes, n_words, frame = rules.n_nodes, rules.n_words, slot // rules.n_nodes
    state = node_state(rules, nodes, node, -1)
    overwrite(nodes.believes[node], statements.before)
    if kind.carries(n_nodes, frame % kind.period_frames, owner, owner, node):
        if slot > node:
            note_fate(rules, nodes, statements, node, owner)
        note_fates_of_others(rules, nodes, statements, node, owner)
    evidence = rules.carrier_evidence
    absorb(kind, evidence, state, n_nodes, frame, node, owner, nodes.rows, nodes.packet, nodes.origins)
    believe_statements(rules, nodes, statements, node, owner)
    hear_symbols(rules, load, nodes, statements, node, slot, n_symbols)
    note_brought(rules, nodes, statements, node, owner, n_symbols)
    for w in range(n_words):
        at, news = node * n_words + w, 0
        nodes.holds[at] = nodes.believes[node, at]
        nodes.settled[at] = settled(state, n_nodes, None, w)
        for of_peer in range(w, n_nodes * n_words, n_words):
            news |= nodes.believes[node, of_peer] & ~statements.before[of_peer]
        statements.telling[node, w] |= news
        while news != 0:
            column = first_in(news, w)
            statements.learned_slot[node, column] = slot
            statements.n_passed[node, column] = 0
            news &= news - 1


# The loop -----------------------------------------------------------------------------------------


def play_stating_slot(
    kind: AckRules, rules: PolicyRules, load: Load, nodes: NodeStates, statements: Statements, plan: PacketPlan,
    slot: int,
    heard_by: int,
) -> int:  # fmt: skip
    """One slot of all nodes; bit i of `heard_by` says that node i receives the packet. Returns the items sent."""
    n_nodes = rules.n_nodes
    frame, owner = slot // n_nodes, slot % n_nodes
    for node in range(n_nodes):
        open_slot(kind, node_state(rules, nodes, node, -1), n_nodes, owner)
    n_sent, n_symbols = compose_packet(rules, load, nodes, statements, plan, owner, slot)
    compose(kind, node_state(rules, nodes, owner, -1), n_nodes, frame, owner, nodes.packet, nodes.rows)
    for node in range(n_nodes):
        if heard_by >> node & 1 != 0:
            hear(kind, rules, load, nodes, statements, owner, node, slot, n_symbols)
    return n_sent + n_symbols


def run_stating_trials(
    kind: AckRules,
    rules: PolicyRules,
    load: Load,
    p_loss: Floats,
    seed: int,
    first_trial: int,
    received: Ints,
    outcomes: Ints,
) -> None:
    """Play the trials `first_trial`, `first_trial` + 1, ... of one policy, as `montecarlo.run_trials` does."""
    n_columns, is_batch = load.n_sources * load.columns_per_source, load.rate == 0.0
    nodes = new_nodes(rules, load, kind.period_frames)
    header_sizes(kind, rules.n_nodes, nodes.header_bits)
    statements, plan = new_statements(rules, n_columns), new_plan(rules.n_nodes, n_columns)
    for index in range(len(outcomes)):
        trial_state, outcome = trial_key(seed, first_trial + index), outcomes[index]
        clear(nodes)
        forget_all(statements)
        outcome[:] = 0
        n_followed = slot = 0
        if is_batch:
            n_followed = n_columns
            for column in range(n_columns):
                add_item(rules, nodes, column // load.columns_per_source, column, 0)
                number_item(rules, statements, column // load.columns_per_source, column)
        while slot < load.max_slots and (slot < load.window_end or outcome[SENDERS_ACKED, COUNT] < n_followed):
            if not is_batch:
                n_followed += generate(rules, load, nodes, trial_state, slot, outcome)
                for column in range(n_columns):
                    if nodes.free_slot[column] <= slot:
                        statements.alive[column // WORD_BITS] &= ~(1 << column % WORD_BITS)
                    elif nodes.born_slot[column] == slot:
                        number_item(rules, statements, column // load.columns_per_source, column)
            heard_by = drawn_receivers(received[index], trial_state, slot, rules.n_nodes, p_loss)
            n_sent = play_stating_slot(kind, rules, load, nodes, statements, plan, slot, heard_by)
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
