"""Packet plan of policies that report received sets: items, statements and coded repairs.

A node estimates the probability that a peer lacks an item. The expected gain of an item is the sum over peers of
reception times lack probability. The gain of symbols over a set of items is bounded by the number lacked and the number
of symbols; symbols possibly received reduce the number lacked. A statement saves its origin repeats of items that no
node lacks; its gain grows with the unreported acknowledgements and the loss of acknowledgement bits. The plan fills the
packet by expected gain. Symbols replace items if they gain more, up to the number of use.

Plain loops, compiled by the policy study and interpreted by vehicles, as those of `exchange.policy.acknowledgement`.

Layout of the holdings section behind the acknowledgement vector; a bit precedes each entry, another ends each list::

    statement   origin w(nodes) | usual 1 [else epoch 2 or more, all 1] | first w(items) | length 4 | mask
                all items of the origin below ``first`` are held; ``usual``: first epoch, and all nodes are known to
                hold them. The mask covers the ``length`` items from ``first`` on; a statement of own items has none,
                since all are held. Items behind it are lacked if the length is below 15
    holder set  origin w(nodes) | usual 1 [else epoch 2 or more] | number w(items) | holders, nodes - 1

With coded repairs the number of symbols follows: 3 [size in bytes 6 | symbols].
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

END_BITS = 2
"""Bits that end the statements and the holder sets."""
LENGTH_BITS = 4
MOST_STATED = (1 << LENGTH_BITS) - 1
"""Largest number of items in the mask of a statement."""
COUNT_BITS = 3
MOST_SYMBOLS = (1 << COUNT_BITS) - 1
"""Largest number of symbols in one packet."""
SIZE_BITS = 6
MOST_SYMBOL_BYTES = (1 << SIZE_BITS) - 1
MOST_PASSED = 16
"""Reports of an item's holders after the last news about them."""


def width(n_values: int) -> int:
    """Bits that distinguish ``n_values`` values: 1 -> 0, 2 -> 1, 5 -> 3."""
    bits = 0
    while 1 << bits < n_values:
        bits += 1
    return bits


def statement_bits(n_nodes: int, number_bits: int, length: int) -> int:
    """Size of a usual statement with a mask of ``length`` bits, presence bit included."""
    return 2 + width(n_nodes) + number_bits + LENGTH_BITS + length


def holder_set_bits(n_nodes: int, number_bits: int) -> int:
    """Size of a usual holder set, presence bit included."""
    return 1 + width(n_nodes) + number_bits + n_nodes


LEAST_LACK = 0.02
"""Lower bound of the lack probability of a peer not known to hold an item."""
RESERVING = 0.5
"""Statements reserve capacity if this share of their gain exceeds that of an item all lack."""
FIRST_STATEMENT = 0.5
"""Gain per bit, relative to the best item, that the first statement needs; others need 1."""
TOLD_TO_ALL = 0.2
"""Gain per unreported acknowledgement from other receivers of a statement."""
STATED_BY_THE_WAY = 0.25
"""Share of a statement's gain that counts if it is sent to name coded items."""
IMPOSSIBLE = 1 << 40
"""Size of a statement or symbol that cannot be made."""
KEPT = 1.0 - 1.0 / 64.0
"""Decay factor of a link sample's weight per new sample."""
PRIOR_LOSS = 0.5
"""Prior loss of a link; it counts as ``PRIOR_WEIGHT`` samples."""
PRIOR_WEIGHT = 2.0
LEAST_SHARE = 0.02
"""Lower bound of estimated loss and of estimated delivery."""


class Counts(Protocol):
    """List or array of integers."""

    def __getitem__(self, position: int, /) -> int: ...
    def __setitem__(self, position: int, value: int, /) -> None: ...


class Shares(Protocol):
    """List or array of floats."""

    def __getitem__(self, position: int, /) -> float: ...
    def __setitem__(self, position: int, value: float, /) -> None: ...


def loss_of(lost: float, weight: float) -> float:
    """Posterior loss of a link from weighted numbers of samples: lost, and all."""
    return (lost + PRIOR_LOSS * PRIOR_WEIGHT) / (weight + PRIOR_WEIGHT)


def reception_of(lost: float, weight: float) -> float:
    """Estimated delivery rate of a link, neither certain nor impossible; arguments as of ``loss_of``."""
    return 1.0 - min(max(loss_of(lost, weight), LEAST_SHARE), 1.0 - LEAST_SHARE)


def kept_of_lack(reception: float, share: float) -> float:
    """Factor of a lack probability after a packet that has the item with probability ``share``."""
    return 1.0 - reception * share


def share_of_symbols(n_symbols: int, lacked: float) -> float:
    """Probability that symbols bring a peer an item if it lacks ``lacked`` of those covered."""
    return min(1.0 - LEAST_LACK, n_symbols / lacked) if lacked > 0.0 else 0.0


def lack_after(lack: float, reception: float, share: float, is_received: bool) -> float:
    """Return the lack probability once the peer acknowledges a packet or its loss.

    ``lack`` is the estimate that includes the packet, ``reception`` the delivery rate used for it, ``share`` the
    probability that the packet, if received, brings the item.
    """
    return min(1.0, lack / kept_of_lack(reception, share) * (1.0 - share if is_received else 1.0))


def holder_set_rank(learned_slot: int, passed_slot: int) -> int:
    """Rank of a holder set, lowest first: latest learned, then longest time since its report."""
    return passed_slot if learned_slot <= passed_slot else -1 - learned_slot


class PacketPlan(NamedTuple):
    """Input, result and scratch of a packet plan.

    Candidates c are items that the node holds, may send, and does not know all to hold; origins o and peers r are
    nodes.

    Attributes:
        reception: [r] probability that the peer receives a packet of this node; 0 for the node itself.
        origin, size_bits: [c] of the item; ``symbol_bits`` in a symbol.
        is_new: [c] 1 for an own item that all interested nodes are assumed to lack.
        is_stated: [c] 1 if a statement about its origin reports it as held.
        weight: [c] utility for each peer that gets it.
        lacks: [c * n_nodes + r] lack probability.
        owed: [o] weight of the origin's items with unreported acknowledgements of this node.
        statement_bits: [o] size of a statement about the origin.
        gain: [c] result: expected gain as a plain item.
        takes: [c] result: 1 for plain items; states: [o] 1 for statements.
        rests, with_code, lacked, worth_lacked: [c], [o], [r], [r] scratch.
        begin, end: [o] scratch: range of candidates with the origin's codable ones.
    """

    reception: Shares
    origin: Counts
    size_bits: Counts
    symbol_bits: Counts
    is_new: Counts
    is_stated: Counts
    weight: Shares
    lacks: Shares
    owed: Shares
    statement_bits: Counts
    gain: Shares
    takes: Counts
    states: Counts
    rests: Counts
    with_code: Counts
    lacked: Shares
    worth_lacked: Shares
    begin: Counts
    end: Counts


def plan_packet(
    plan: PacketPlan, n_nodes: int, n_candidates: int, room_bits: int, codes: bool, large_first: bool
) -> int:
    """Plan a packet; return its number of symbols, which cover the reported items not taken.

    ``room_bits`` is the capacity for items, statements and symbols (if ``codes``). ``large_first``: an item of more
    than half of it precedes statements. Callers set that for every second packet, since statements due in every packet
    would block the item for ever.
    """
    best = 0.0
    for c in range(n_candidates):
        gain = 0.0
        for r in range(n_nodes):
            gain += plan.weight[c] * plan.reception[r] * plan.lacks[c * n_nodes + r]
        plan.gain[c], plan.takes[c] = gain, 0
    for o in range(n_nodes):
        plan.states[o] = 0
    left = room_bits
    if large_first:
        left = take_large(plan, n_candidates, room_bits)
    left = take_new(plan, n_nodes, n_candidates, left)
    for c in range(n_candidates):
        if plan.takes[c] == 0 and plan.size_bits[c] <= left:
            best = max(best, plan.gain[c] / plan.size_bits[c])
    left = take_statements(plan, n_nodes, left, best)
    by_items, n_symbols = leave_rests(plan, n_candidates, left), 0
    if codes:
        n_symbols = take_symbols(plan, n_nodes, n_candidates, left, by_items)
    if n_symbols == 0:
        for c in range(n_candidates):
            plan.takes[c] = 1 - plan.rests[c]
    return n_symbols


def statement_worth(plan: PacketPlan, o: int) -> float:
    """Expected gain of a statement about an origin."""
    return (1.0 - plan.reception[o] + TOLD_TO_ALL) * plan.owed[o]


def take_large(plan: PacketPlan, n_candidates: int, room_bits: int) -> int:
    """Take the best item above half of the capacity if it gains most; return what remains."""
    chosen, most = -1, 0.0
    for c in range(n_candidates):
        if room_bits < 2 * plan.size_bits[c] <= 2 * room_bits and plan.gain[c] > most:
            chosen, most = c, plan.gain[c]
    if chosen < 0 or most < leave_rests(plan, n_candidates, room_bits):
        return room_bits
    plan.takes[chosen] = 1
    return room_bits - plan.size_bits[chosen]


def take_new(plan: PacketPlan, n_nodes: int, n_candidates: int, room_bits: int) -> int:
    """Take own items that all nodes lack, best first; return the remaining capacity."""
    wanted = 0
    for c in range(n_candidates):
        if plan.is_new[c] != 0 and plan.takes[c] == 0:
            wanted += plan.size_bits[c]
    if wanted == 0:
        return room_bits
    # Without a reserve, new items in every packet would keep out statements for ever.
    most, reserved = 0.0, 0
    for o in range(n_nodes):
        worth = statement_worth(plan, o)
        if plan.owed[o] > 0 and worth > most and plan.statement_bits[o] < room_bits:
            most, reserved = worth, plan.statement_bits[o]
    all_lack = 0.0
    for r in range(n_nodes):
        all_lack += plan.reception[r]
    if wanted <= room_bits - reserved or RESERVING * most <= all_lack:
        reserved = 0
    left = room_bits
    while True:
        chosen, most = -1, 0.0
        for c in range(n_candidates):
            is_next = plan.is_new[c] != 0 and plan.takes[c] == 0 and plan.gain[c] > most
            if is_next and plan.size_bits[c] <= left - reserved:
                chosen, most = c, plan.gain[c]
        if chosen < 0:
            return left
        plan.takes[chosen] = 1
        left -= plan.size_bits[chosen]


def take_statements(plan: PacketPlan, n_nodes: int, room_bits: int, best: float) -> int:
    """Take statements that gain more per bit than items (``best``); return what remains."""
    left, share = room_bits, FIRST_STATEMENT
    while True:
        chosen, most = -1, 0.0
        for o in range(n_nodes):
            if plan.owed[o] > 0 and plan.states[o] == 0 and plan.statement_bits[o] <= left:
                worth = statement_worth(plan, o) / plan.statement_bits[o]
                if worth > most:
                    chosen, most = o, worth
        if chosen < 0 or most < share * best:
            return left
        plan.states[chosen] = 1
        left -= plan.statement_bits[chosen]
        share = 1.0


def leave_rests(plan: PacketPlan, n_candidates: int, room_bits: int) -> float:
    """Mark the items left over by a greedy choice of gain per bit; return that choice's gain."""
    left, total = room_bits, 0.0
    for c in range(n_candidates):
        plan.rests[c] = 1 - plan.takes[c]
    while True:
        chosen, most = -1, 0.0
        for c in range(n_candidates):
            if plan.rests[c] != 0 and plan.size_bits[c] <= left and plan.gain[c] > most * plan.size_bits[c]:
                chosen, most = c, plan.gain[c] / plan.size_bits[c]
        if chosen < 0:
            return total
        plan.rests[chosen] = 0
        left -= plan.size_bits[chosen]
        total += plan.gain[chosen]


def can_be_coded(plan: PacketPlan, o: int, c: int) -> bool:
    """True if symbols can cover an item of an origin."""
    return plan.origin[c] == o and plan.takes[c] == 0 and plan.is_stated[c] != 0


def find_coded(plan: PacketPlan, n_nodes: int, n_candidates: int) -> None:
    """Find the range of codable candidates of each origin."""
    for o in range(n_nodes):
        plan.begin[o] = plan.end[o] = 0
    for c in range(n_candidates):
        o = plan.origin[c]
        if can_be_coded(plan, o, c):
            if plan.end[o] == 0:
                plan.begin[o] = c
            plan.end[o] = c + 1


def add_lacked(plan: PacketPlan, n_nodes: int, o: int) -> None:
    """Add an origin's codable items to the expected numbers that peers lack."""
    for c in range(plan.begin[o], plan.end[o]):
        if can_be_coded(plan, o, c):
            for r in range(n_nodes):
                plan.lacked[r] += plan.lacks[c * n_nodes + r]
                plan.worth_lacked[r] += plan.weight[c] * plan.lacks[c * n_nodes + r]


def symbols_worth(plan: PacketPlan, n_nodes: int, o: int, n_symbols: int) -> float:
    """Expected gain of symbols if the items of origin ``o`` are coded too; -1 for no origin."""
    begin, end, total = 0, 0, 0.0
    if o >= 0:
        begin, end = plan.begin[o], plan.end[o]
    for r in range(n_nodes):
        if plan.reception[r] > 0.0:
            lacked, worth = plan.lacked[r], plan.worth_lacked[r]
            for c in range(begin, end):
                if can_be_coded(plan, o, c):
                    lacked += plan.lacks[c * n_nodes + r]
                    worth += plan.weight[c] * plan.lacks[c * n_nodes + r]
            if n_symbols > 0:
                # The minimum of both numbers if the number lacked is known; with its mean, a smooth approximation.
                worth *= n_symbols / math.sqrt(lacked * lacked + n_symbols * n_symbols)
            else:
                worth = 0.0
            total += plan.reception[r] * worth
    return total


def largest_symbol(plan: PacketPlan, o: int, at_least: int) -> int:
    """Size (bits) of a symbol that also covers items of an origin."""
    for c in range(plan.begin[o], plan.end[o]):
        if can_be_coded(plan, o, c):
            at_least = max(at_least, plan.symbol_bits[c])
    return at_least


def number_of_symbols(room_bits: int, size_bits: int) -> int:
    """Number of symbols of that size that fit."""
    return max(0, min(MOST_SYMBOLS, (room_bits - SIZE_BITS) // size_bits))


def symbols_of_use(plan: PacketPlan, n_nodes: int) -> int:
    """Expected number of symbols until the neediest peer has received and acknowledged its lack.

    What it lacks is sent 1 / ((1 - p) (1 - p)) times (Maurelli et al., section 5.2).
    """
    most = 0.0
    for r in range(n_nodes):
        if plan.reception[r] > 0.0:
            most = max(most, plan.lacked[r] / (plan.reception[r] * plan.reception[r]))
    return int(most + 0.5)


def take_symbols(plan: PacketPlan, n_nodes: int, n_candidates: int, room_bits: int, by_items: float) -> int:
    """Take statements of coded origins if symbols gain more than items; return the symbols."""
    find_coded(plan, n_nodes, n_candidates)
    left, size_bits, current = room_bits, 1, 0.0
    for r in range(n_nodes):
        plan.lacked[r] = 0.0
        plan.worth_lacked[r] = 0.0
    for o in range(n_nodes):
        plan.with_code[o] = plan.states[o]
        if plan.states[o] != 0:
            size_bits = largest_symbol(plan, o, size_bits)
            add_lacked(plan, n_nodes, o)
    if size_bits > 1:
        current = symbols_worth(plan, n_nodes, -1, number_of_symbols(left, size_bits))
    while True:
        # A gain within rounding must not add a statement.
        chosen, most = -1, current + 1e-9
        for o in range(n_nodes):
            if plan.with_code[o] == 0 and plan.statement_bits[o] <= left:
                size = largest_symbol(plan, o, size_bits)
                if size > 1:
                    n_symbols = number_of_symbols(left - plan.statement_bits[o], size)
                    worth = symbols_worth(plan, n_nodes, o, n_symbols)
                    worth += STATED_BY_THE_WAY * statement_worth(plan, o)
                    if worth > most:
                        chosen, most = o, worth
        if chosen < 0:
            break
        plan.with_code[chosen] = 1
        left -= plan.statement_bits[chosen]
        size_bits = largest_symbol(plan, chosen, size_bits)
        add_lacked(plan, n_nodes, chosen)
        current = most
    n_coded = 0
    for c in range(n_candidates):
        is_coded = plan.with_code[plan.origin[c]] != 0 and can_be_coded(plan, plan.origin[c], c)
        n_coded += int(is_coded and plan.gain[c] > 0.0)
    n_symbols = min(number_of_symbols(left, size_bits), n_coded, symbols_of_use(plan, n_nodes))
    if n_symbols == 0 or current <= by_items:
        return 0
    for o in range(n_nodes):
        plan.states[o] = plan.with_code[o]
    return n_symbols
