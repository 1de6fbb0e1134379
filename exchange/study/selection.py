"""Which items go into a packet of the policy study: the plain form of the rule by which the queue of a vehicle chooses.

The study compiles it. `exchange.queueing.queue` chooses the same without looking at all that waits, and a test compares
the two.

In each of a node's own slots the weight of every candidate grows by the item's need priority, and the
heaviest candidates that fit are sent. An item sent is in progress until its acknowledgement timer of one
TDMA frame expires, which is in its sender's next slot; its weight restarts at 0. What all interested peers
are known to hold is no candidate any more (Maurelli et al., section 6).
"""

from typing import Protocol


class QueueNumbers(Protocol):
    """Numbers by position in the queue: a list or an array."""

    def __len__(self) -> int: ...
    def __getitem__(self, position: int, /) -> int: ...


class MutableRow(QueueNumbers, Protocol):
    """A row whose numbers can be replaced."""

    def __setitem__(self, position: int, value: int, /) -> None: ...


def select(
    weights: MutableRow,
    priorities: QueueNumbers,
    sizes_bits: QueueNumbers,
    eligible: MutableRow,
    capacity_bits: int,
    chosen_out: MutableRow,
) -> int:
    """Choose, in decreasing weight, the candidates that fit into a packet; one too large is passed over.

    Of equal weights the lower position comes first.

    Args:
        weights: weight of each item so far: grows by the priority if eligible, restarts at 0 if chosen.
        priorities: need priority of each item, not negative.
        sizes_bits: size of each item.
        eligible: 1 for candidates, else 0; the entries of the chosen are set to 0.
        capacity_bits: what the packet has left for items, its header paid.
        chosen_out: takes the positions of the chosen; room for all.

    Returns:
        How many were chosen.

    >>> weights, chosen = [3, 0, 9], [0, 0, 0]
    >>> n_chosen = select(weights, [1, 1, 1], [60, 60, 60], [1, 1, 1], 130, chosen)
    >>> chosen[:n_chosen], weights
    ([2, 0], [0, 1, 0])
    """
    for position in range(len(weights)):
        if eligible[position]:
            weights[position] += priorities[position]

    n_chosen = 0
    left_bits = capacity_bits
    while True:
        heaviest = -1
        most = -1
        for position in range(len(weights)):
            if eligible[position] and weights[position] > most and sizes_bits[position] <= left_bits:
                heaviest = position
                most = weights[position]
        if heaviest < 0:
            return n_chosen
        chosen_out[n_chosen] = heaviest
        n_chosen += 1
        eligible[heaviest] = 0
        weights[heaviest] = 0
        left_bits -= sizes_bits[heaviest]
