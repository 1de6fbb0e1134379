"""What a packet carries under a policy that states holdings: items, statements, coded repairs; one plan for all three.

A node reckons with what each peer may still lack. An item that it sends brings, for each peer that receives the packet,
the probability that it lacks it; so many symbols over a set of items bring as many of them as the peer lacks, and no
more than there are symbols. Of what a peer may have heard in symbols it lacks as many items less, whichever these are.
A statement of what a node holds of an origin spares that origin repeating what nobody lacks; it is worth as much as
there is to tell, and the more, the less the bits of the acknowledgements get through. The plan fills the packet with
what brings most, takes symbols if they bring more than the items would by themselves, and no more than are of use.

Plain loops, which the policy study compiles and vehicles interpret, as those of `exchange.ack`.

What a packet says of its sender's holdings: the sizes that vehicles and policy study reckon with.

Behind the vector of acknowledgements stand, each with a bit before it and a bit behind the last::

    statement   origin w(nodes) | usual 1 [else epoch 2 or more, all 1] | first w(items) | length 4 | mask
                all items of the origin below ``first`` are held; ``usual``: it is in its first epoch, and all are known
                to hold them. Of the ``length`` items from ``first`` on the mask says which are held, in a statement of
                one's own items without a mask, since all are; behind it none is, if the length is below 15
    holder set  origin w(nodes) | usual 1 [else epoch 2 or more] | number w(items) | who holds it, nodes - 1

and, where repairs are coded, how many symbols there are 3 [size in bytes 6 | symbols].
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

END_BITS = 2
"""Behind the last statement, and behind the last holder set."""
LENGTH_BITS = 4
MOST_STATED = (1 << LENGTH_BITS) - 1
"""Items from the first on that a statement tells of."""
COUNT_BITS = 3
MOST_SYMBOLS = (1 << COUNT_BITS) - 1
"""Symbols in one packet."""
SIZE_BITS = 6
MOST_SYMBOL_BYTES = (1 << SIZE_BITS) - 1
MOST_PASSED = 16
"""How often a node tells who holds an item, after it has last learned anything of that."""


def names_bits(n_nodes: int) -> int:
    """Bits that tell so many nodes apart."""
    bits = 0
    while 1 << bits < n_nodes:
        bits += 1
    return bits


def statement_bits(n_nodes: int, number_bits: int, length: int) -> int:
    """Size of a usual statement with a mask of that length, the bit before it among its bits."""
    return 2 + names_bits(n_nodes) + number_bits + LENGTH_BITS + length


def holder_set_bits(n_nodes: int, number_bits: int) -> int:
    """Size of a usual holder set, the bit before it among its bits."""
    return 1 + names_bits(n_nodes) + number_bits + n_nodes


LEAST_LACK = 0.02
"""A peer that is not known to hold an item is reckoned to lack it with this probability at least."""
RESERVING = 0.5
"""A statement keeps new items out of a packet if so much of it is worth more than an item that all lack."""
FIRST_STATEMENT = 0.5
"""The first statement in a packet goes if it is worth so much of what an item brings, bit by bit; others need all."""
TOLD_TO_ALL = 0.2
"""What it is worth, for each item owed, that the other peers hear a statement, too."""
STATED_BY_THE_WAY = 0.25
"""Share of the worth of a statement that counts where it is sent as the name of what is coded."""
IMPOSSIBLE = 1 << 40
"""Bits of a statement that cannot be made."""
KEPT = 1.0 - 1.0 / 64.0
"""What is left of the weight of a sample of a link after the next one."""
PRIOR_LOSS = 0.5
"""Loss that is reckoned with before there is a sample; it counts as ``PRIOR_WEIGHT`` samples."""
PRIOR_WEIGHT = 2.0
LEAST_SHARE = 0.02
"""A link neither loses nor delivers less than this share of packets, as far as plans reckon with it."""


class Counts(Protocol):
    """Whole numbers by position: a list or an array."""

    def __len__(self) -> int: ...
    def __getitem__(self, position: int, /) -> int: ...
    def __setitem__(self, position: int, value: int, /) -> None: ...


class Shares(Protocol):
    """Numbers by position: a list or an array."""

    def __getitem__(self, position: int, /) -> float: ...
    def __setitem__(self, position: int, value: float, /) -> None: ...


def reception_of(lost: float, weight: float) -> float:
    """Share of packets that a link is reckoned to deliver, by the weighted numbers of samples: lost, and all."""
    p_loss = (lost + PRIOR_LOSS * PRIOR_WEIGHT) / (weight + PRIOR_WEIGHT)
    return 1.0 - min(max(p_loss, LEAST_SHARE), 1.0 - LEAST_SHARE)


def kept_of_lack(reception: float, share: float) -> float:
    """What is left of the probability that a peer lacks an item, by a packet that brings it with that certainty."""
    return 1.0 - reception * share


def share_of_symbols(n_symbols: int, lacked: float) -> float:
    """How surely so many symbols bring a peer an item of those that they are over, of which it lacks so many."""
    return min(1.0 - LEAST_LACK, n_symbols / lacked) if lacked > 0.0 else 0.0


def lack_after(lack: float, reception: float, share: float, is_received: bool) -> float:
    """What the probability that a peer lacks an item is once it says whether it received a packet.

    Args:
        lack: as reckoned before that was known, the packet included.
        reception: of the link, as reckoned with then.
        share: how surely the packet brought it.
        is_received: what the peer says.
    """
    return min(1.0, lack / kept_of_lack(reception, share) * (1.0 - share if is_received else 1.0))


class PacketPlan(NamedTuple):
    """What a packet can carry, and what it shall.

    Candidates c are items that the node holds, may send, and does not know all to hold; origins o and peers r are
    nodes.

    Attributes:
        reception: [r] probability that the peer receives a packet of this node; 0 for the node itself.
        origin, size_bits: [c] of the item, ``symbol_bits`` in a symbol.
        is_new: [c] 1 for an own item that all who need it are reckoned to lack, as one that was never sent.
        is_stated: [c] 1 if a statement about its origin says that this node holds it.
        weight: [c] what it is worth that a peer gets it.
        lacks: [c * n_nodes + r] probability that the peer lacks it.
        owed: [o] weight of the items of which the origin is not known to know that this node holds them.
        statement_bits: [o] size of a statement about the origin.
        gain: [c] filled in: what it brings by itself.
        takes: [c] 1 for items to be sent by themselves; states: [o] 1 for statements.
        rests, with_code, lacked, worth_lacked: [c], [o], [r], [r] scratch.
        begin, end: [o] scratch: between these candidates are those of the origin that can be coded.
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
    """Fill a packet; returns how many symbols it has, over the items stated that are not taken.

    Args:
        plan: of the packet.
        n_nodes: size of the fleet.
        n_candidates: items that may go.
        room_bits: for them, statements and symbols.
        codes: symbols may go.
        large_first: an item of more than half of the room goes before statements. So it is in each second packet:
            statements that are owed anew in every packet would else leave it unsaid for good.
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
    """What a statement about an origin brings."""
    return (1.0 - plan.reception[o] + TOLD_TO_ALL) * plan.owed[o]


def take_large(plan: PacketPlan, n_candidates: int, room_bits: int) -> int:
    """Take, of the items of more than half of the room, the one that brings most, if others in its place do not bring
    more; returns what is left of the room."""
    chosen, most = -1, 0.0
    for c in range(n_candidates):
        if room_bits < 2 * plan.size_bits[c] <= 2 * room_bits and plan.gain[c] > most:
            chosen, most = c, plan.gain[c]
    if chosen < 0 or most < leave_rests(plan, n_candidates, room_bits):
        return room_bits
    plan.takes[chosen] = 1
    return room_bits - plan.size_bits[chosen]


def take_new(plan: PacketPlan, n_nodes: int, n_candidates: int, room_bits: int) -> int:
    """Take own items that all lack, first what brings most; returns what is left of the room."""
    wanted = 0
    for c in range(n_candidates):
        if plan.is_new[c] != 0 and plan.takes[c] == 0:
            wanted += plan.size_bits[c]
    if wanted == 0:
        return room_bits
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
    """Take the statements that are worth more than items, bit by bit; returns what is left of the room.

    Args:
        plan: of the packet.
        n_nodes: size of the fleet.
        room_bits: for them and items.
        best: the most that an item brings, for each of its bits.
    """
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
    """See which items would rest if those that bring most for each of their bits went; returns what these bring."""
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
    """True if symbols can be over an item of an origin."""
    return plan.origin[c] == o and plan.takes[c] == 0 and plan.is_stated[c] != 0


def find_coded(plan: PacketPlan, n_nodes: int, n_candidates: int) -> None:
    """Find between which candidates those of each origin are that can be coded."""
    for o in range(n_nodes):
        plan.begin[o] = plan.end[o] = 0
    for c in range(n_candidates):
        o = plan.origin[c]
        if can_be_coded(plan, o, c):
            if plan.end[o] == 0:
                plan.begin[o] = c
            plan.end[o] = c + 1


def add_lacked(plan: PacketPlan, n_nodes: int, o: int) -> None:
    """Add to what each peer is reckoned to lack of what is coded the items of an origin."""
    for c in range(plan.begin[o], plan.end[o]):
        if can_be_coded(plan, o, c):
            for r in range(n_nodes):
                plan.lacked[r] += plan.lacks[c * n_nodes + r]
                plan.worth_lacked[r] += plan.weight[c] * plan.lacks[c * n_nodes + r]


def symbols_worth(plan: PacketPlan, n_nodes: int, o: int, n_symbols: int) -> float:
    """What so many symbols bring if the items of an origin are coded, too; of none, if that is -1.

    It would be the lesser of their number and what a peer lacks, were that known; where only its mean is, the bend is
    rounded.
    """
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
                worth *= n_symbols / math.sqrt(lacked * lacked + n_symbols * n_symbols)
            else:
                worth = 0.0
            total += plan.reception[r] * worth
    return total


def largest_symbol(plan: PacketPlan, o: int, at_least: int) -> int:
    """Size of a symbol that items of an origin are part of, too, in bits."""
    for c in range(plan.begin[o], plan.end[o]):
        if can_be_coded(plan, o, c):
            at_least = max(at_least, plan.symbol_bits[c])
    return at_least


def number_of_symbols(room_bits: int, size_bits: int) -> int:
    """How many symbols of that size have room."""
    return max(0, min(MOST_SYMBOLS, (room_bits - SIZE_BITS) // size_bits))


def symbols_of_use(plan: PacketPlan, n_nodes: int) -> int:
    """How many symbols it takes, in the mean, until what a peer lacks of what is coded has come, and word of it back.

    Of the peer of whom that is most: others need no more. What it lacks is sent 1 / ((1 - p) (1 - p)) times (Maurelli
    et al., section 5.2).
    """
    most = 0.0
    for r in range(n_nodes):
        if plan.reception[r] > 0.0:
            most = max(most, plan.lacked[r] / (plan.reception[r] * plan.reception[r]))
    return int(most + 0.5)


def take_symbols(plan: PacketPlan, n_nodes: int, n_candidates: int, room_bits: int, by_items: float) -> int:
    """Take statements of origins whose items are coded, if symbols bring more than items do; returns their number."""
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
