"""Load, quantities and items of the policy study's trials.

An item is a column. Under Poisson load a node's queue has a fixed number of columns; an item that finds it full is
refused. A column is reused once every sender has dropped the old item and no node remembers a packet with it: items
never mix.

Plain Python that `exchange.study.compiler` compiles, as all that the slot loops call.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from exchange.channel.loss import link_uniform, slot_key

Ints: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]

# Quantities of a trial, each a sum and a count to divide it by: `outcomes[trial, quantity]`.
DELIVERED = 0  # slots until all nodes hold the item(s)
SOURCE_ACKED = 1  # slots until every origin believes that all hold its item(s)
SENDERS_ACKED = 2  # slots until every node that may send an item believes that all hold it
TRANSMISSIONS = 3  # times an item was sent; under Poisson load per item delivered
IN_FLIGHT = 4  # items not source-acknowledged, per slot of the window
GOODPUT = 5  # items delivered, per slot of the window
OFFERED = 6  # items generated, per slot of the window
REFUSED = 7  # items refused by a full queue, per item generated in the window
FALSE_BELIEFS = 8  # beliefs that a peer holds an item it lacks: always 0
SLOTS = 9  # slots played
N_QUANTITIES = 10

N_STAGES = 3  # an item is delivered, then source-acknowledged, then senders-acknowledged
SUM, COUNT, CENSORED = 0, 1, 2  # censored: trials, or under Poisson load items, that did not end

NEVER = 1 << 62


class PolicyRules(NamedTuple):
    """Policy beside its acknowledgement, and size of the fleet."""

    repeat: bool
    carrier_evidence: bool
    n_nodes: int
    knows_all: bool = False
    codes: bool = False


class Load(NamedTuple):
    """Items to send: nodes 0 to `n_sources` - 1 have as many columns each.

    `rate` is 0 for a batch: every column is an item of slot 0. Under Poisson load it is the mean number of new items
    per node and slot; items generated in the window are followed to their end, while generation continues. `p_none` is
    exp(-rate). `number_bits` is the size of a sequence, for policies that report received sets.
    """

    n_sources: int
    columns_per_source: int
    rate: float
    item_bits: int
    capacity_bits: int
    window_start: int
    window_end: int
    max_slots: int
    p_none: float = 1.0
    number_bits: int = 0
    symbol_bits: int = 0


def n_columns_of(load: Load) -> int:
    """Columns of all sources."""
    return load.n_sources * load.columns_per_source


class Items(NamedTuple):
    """Items of one trial, by column."""

    born_slot: Ints
    free_slot: Ints  # from this slot on the column may be given to a new item


def poisson_number(uniform: float, mean: float, p_none: float) -> int:
    """Return the Poisson quantile for small means; ``p_none`` is exp(-mean).

    >>> [poisson_number(u, 0.5, 0.6065306597126334) for u in (0.0, 0.60, 0.61, 0.95)]
    [0, 0, 1, 2]
    """
    number = 0
    probability = p_none
    cumulated = probability
    while uniform >= cumulated and probability > 0.0:
        number += 1
        probability *= mean / number
        cumulated += probability
    return number


def generate(load: Load, items: Items, key: int, slot: int, born: Ints, outcome: Ints) -> int:
    """Draw the Poisson arrivals of a slot; return how many are followed.

    Draws use the link of each node to itself. ``born`` receives the columns of new items, then -1.
    """
    key = slot_key(key, slot)
    in_window = load.window_start <= slot < load.window_end
    n_followed = n_born = 0
    for origin in range(load.n_sources):
        first = origin * load.columns_per_source
        for _ in range(poisson_number(link_uniform(key, origin, origin), load.rate, load.p_none)):
            column = first
            while column < first + load.columns_per_source and items.free_slot[column] > slot:
                column += 1
            is_free = column < first + load.columns_per_source
            if is_free:
                items.born_slot[column], items.free_slot[column] = slot, NEVER
                born[n_born] = column
                n_born += 1
            if in_window:
                outcome[OFFERED, SUM] += 1
                outcome[REFUSED, SUM] += int(not is_free)
                n_followed += int(is_free)
    if n_born < len(born):
        born[n_born] = -1
    return n_followed


def note_item(rules: PolicyRules, load: Load, items: Items, stage: int, column: int, slot: int, outcome: Ints) -> None:
    """Record that an item reaches a stage in this slot."""
    if load.rate == 0.0:
        outcome[stage, SUM] = slot + 1
        outcome[stage, COUNT] += 1
        return
    born = items.born_slot[column]
    if load.window_start <= born < load.window_end:
        outcome[stage, SUM] += slot + 1 - born
        outcome[stage, COUNT] += 1
    if stage == DELIVERED and load.window_start <= slot < load.window_end:
        outcome[GOODPUT, SUM] += 1
    if stage == SOURCE_ACKED:
        outcome[IN_FLIGHT, SUM] += slots_in_window(load, born, slot + 1)
    if stage == SENDERS_ACKED:
        # Two frames later no node remembers a packet that carried the item.
        items.free_slot[column] = slot + 1 + 2 * rules.n_nodes


def slots_in_window(load: Load, start: int, stop: int) -> int:
    """Number of slots from `start` to before `stop` inside the window."""
    return max(0, min(stop, load.window_end) - max(start, load.window_start))


def is_over(load: Load, slot: int, n_followed: int, outcome: Ints) -> bool:
    """True if a trial ends before this slot."""
    if slot >= load.max_slots:
        return True
    return bool(slot >= load.window_end and outcome[SENDERS_ACKED, COUNT] >= n_followed)


def close(
    load: Load, items: Items, acknowledged: Ints, lane: int, n_slots: int, n_followed: int, outcome: Ints
) -> None:
    """Complete the sums and counts of a trial.

    A batch counts once, or as censored; under Poisson load each followed item does. Bit `lane` of
    ``acknowledged[column]`` marks a source-acknowledged item.
    """
    outcome[SLOTS, SUM] = n_slots
    if load.rate == 0.0:
        for stage in range(N_STAGES):
            ended = int(outcome[stage, COUNT] == n_followed)
            outcome[stage, SUM] *= ended
            outcome[stage, COUNT] = ended
            outcome[stage, CENSORED] = 1 - ended
        outcome[TRANSMISSIONS, COUNT] = outcome[SENDERS_ACKED, COUNT]
        outcome[TRANSMISSIONS, SUM] *= outcome[SENDERS_ACKED, COUNT]
        return
    for stage in range(N_STAGES):
        outcome[stage, CENSORED] = n_followed - outcome[stage, COUNT]
    for column in range(len(items.free_slot)):
        if items.free_slot[column] == NEVER and not acknowledged[column] >> lane & 1:
            outcome[IN_FLIGHT, SUM] += slots_in_window(load, items.born_slot[column], load.window_end)
    outcome[TRANSMISSIONS, COUNT] = outcome[GOODPUT, SUM]
    outcome[REFUSED, COUNT] = outcome[OFFERED, SUM]
    for quantity in (IN_FLIGHT, GOODPUT, OFFERED):
        outcome[quantity, COUNT] = load.window_end - load.window_start
