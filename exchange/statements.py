"""What a packet says of its sender's holdings: the sizes that vehicles and policy study reckon with.

Behind the vector of acknowledgements stand, each with a bit before it and a bit behind the last::

    statement   origin w(nodes) | usual 1 [else epoch 2 or more, all 1] | first w(items) | length 4 | mask
                all items of the origin below ``first`` are held; ``usual``: it is in its first epoch, and all are known
                to hold them. Of the ``length`` items from ``first`` on the mask says which are held, in a statement of
                one's own items without a mask, since all are; behind it none is, if the length is below 15
    holder set  origin w(nodes) | usual 1 [else epoch 2 or more] | number w(items) | who holds it, nodes - 1

and, where repairs are coded, how many symbols there are 3 [size in bytes 6 | symbols].
"""

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
