"""Lanes of the policy study: 64 trials per word, their parameters, draws, items and results.

Method of Biham, "A fast new DES implementation in software", 1997. Bit t of a word is the state in the trial of lane t.
All lanes are in the same slot of a TDMA frame. A trial that ends frees its lane for the next one at the start of a
frame.

Receptions are drawn trial by trial, in words of a few slots, and cached for the next policy. The words of all lanes are
transposed before use: from slots and nodes of a trial to trials of a slot and node.

An item is a column. Under Poisson load a node's queue has a fixed number of columns; an item that finds it full is
refused. A column is reused once every sender has dropped the old item and no node remembers a packet with it: items
never mix.

Plain Python that `exchange.study.compiler` compiles, as all that the slot loops call.
"""

from collections.abc import Iterator, Mapping
from math import frexp
from typing import Annotated, Any, NamedTuple, TypeAlias, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from exchange.channel.loss import link_uniform, slot_key, trial_key

Ints: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]
Bytes: TypeAlias = NDArray[np.uint8]
_DTYPES: dict[Any, type[np.generic]] = {Ints: np.int64, Floats: np.float64, Bytes: np.uint8}
_State = TypeVar("_State", bound=NamedTuple)

LANES = 64
"""Trials that run at once."""
N_DIGITS = 32
"""Binary digits of a number of transmissions."""
WORD_BITS = 63
"""Bits used of a word of draws; the sign bit stays 0."""

# Quantities of a trial, each a sum and a count to divide it by: `outcomes[trial, quantity]`.
DELIVERED = 0  # slots until all nodes hold the item(s)
SOURCE_ACKED = 1  # slots until every origin believes that all hold its item(s)
SENDERS_ACKED = 2  # slots until every node that may send an item believes that all hold it
TRANSMISSIONS = 3  # times an item was sent; under Poisson load per item delivered
IN_FLIGHT = 4  # items not source-acknowledged, per slot of the window
GOODPUT = 5  # items delivered, per slot of the window
OFFERED = 6  # items generated, per slot of the window; 1 for a batch, which counts as a whole
REFUSED = 7  # items refused by a full queue, per item generated in the window
FALSE_BELIEFS = 8  # slots with a belief that a peer holds an item it lacks: always 0
SLOTS = 9  # slots played
N_QUANTITIES = 10

N_STAGES = 3  # an item is delivered, then source-acknowledged, then senders-acknowledged
SUM, COUNT = 0, 1

NEVER = 1 << 62


class Case(NamedTuple):
    """Policy beside its header rule, load and seed of trials that run together.

    Nodes 0 to `n_sources` - 1 have as many columns each. `rate` is 0 for a batch: every column is an item of slot 0,
    and a stage is reached when all items reach it. Under Poisson load it is the mean number of new items per node and
    slot; items generated in the window are followed to their end, while generation continues. `p_none` is exp(-rate),
    `number_bits` the size of a sequence, for policies that report received sets (`states`). `knows_all` marks the
    bound.
    """

    n_nodes: int
    repeat: bool = False
    carrier_evidence: bool = False
    relays: bool = False
    infers: bool = False
    states: bool = False
    codes: bool = False
    knows_all: bool = False
    n_sources: int = 1
    columns_per_source: int = 1
    rate: float = 0.0
    p_none: float = 1.0
    item_bits: int = 1
    symbol_bits: int = 0
    number_bits: int = 0
    capacity_bits: int = NEVER
    window_start: int = 0
    window_end: int = 1
    max_slots: int = 0
    p_loss: float = 0.0
    seed: int = 0
    first_trial: int = 0


def n_columns_of(case: Case) -> int:
    """Columns of all sources."""
    return case.n_sources * case.columns_per_source


class Lanes(NamedTuple):
    """State of each lane beside its nodes."""

    received: Ints  # [word, trial] cache of receptions
    outcomes: Annotated[Ints, "trial", "quantity", "sum or count"]
    trials: Annotated[Ints, "lane"]  # number of its trial, counted from the first that is played
    began_frame: Annotated[Ints, "lane"]
    drawn: Annotated[Ints, "lane"]  # [slot * n_nodes + node] lanes in which the node receives the packet of the slot
    digits: Annotated[Ints, "digit"]  # lanes whose transmission counter has the digit 1
    reached: Annotated[Ints, "stage", "column"]  # lanes in which the item has reached the stage; a batch: column 0
    born_slot: Annotated[Ints, "lane", "column"]  # of the item
    free_slot: Annotated[Ints, "lane", "column"]  # from this slot on the column may be given to a new item


def sizes_of(case: Case) -> dict[str, int]:
    """Return the lengths of the axes of the state."""
    n_nodes, nodes = case.n_nodes, ("node", "holder", "receiver", "sender", "origin", "peer")
    sizes = {"column": n_columns_of(case), "place": 2 * n_nodes, "lane": LANES, "digit": N_DIGITS, "stage": N_STAGES}
    return sizes | {"quantity": N_QUANTITIES, "sum or count": 2} | dict.fromkeys(nodes, n_nodes)


def allocated(state: type[_State], sizes: Mapping[str, int], *given: Any) -> _State:
    """Allocate arrays of zeros along the axes that the fields of a state declare, behind those ``given``."""
    fields = list(get_type_hints(state, include_extras=True).values())[len(given) :]
    arrays = (np.zeros([sizes[axis] for axis in field.__metadata__], _DTYPES[field.__origin__]) for field in fields)
    return state._make((*given, *arrays))


def lane_bit(lane: int) -> int:
    """Bit of the lane in a signed word."""
    # The last lane is the sign bit, and 1 << 63 exceeds a signed word.
    return 1 << lane if lane < LANES - 1 else -1 << lane


def lanes_of(word: int) -> Iterator[int]:
    """Yield the lanes of a word; a power of two is an exact float.

    >>> [*lanes_of(0b11001 | lane_bit(63))]
    [0, 3, 4, 63]
    """
    word = int(word)
    while word != 0:
        lane = frexp(float(word & -word))[1] - 1
        word &= ~lane_bit(lane)
        yield lane


def count(digits: Ints, lanes: int) -> None:
    """Add 1 to the bit-sliced counters of these lanes."""
    digit = 0
    while lanes != 0:
        carried = digits[digit] & lanes
        digits[digit] ^= lanes
        lanes = carried
        digit += 1


def counted(digits: Ints, lane: int) -> int:
    """Read the counter of a lane."""
    number = 0
    for digit in range(len(digits)):
        number += (digits[digit] >> lane & 1) << digit
    return number


def own_slot(case: Case, lanes: Lanes, lane: int, slot: int) -> int:
    """Return the slot number within the trial of a lane."""
    return int(slot - lanes.began_frame[lane] * case.n_nodes)


def key_of(case: Case, lanes: Lanes, lane: int) -> int:
    """Return the generator key of a lane's trial; recomputed, since it needs all 64 bits."""
    return trial_key(case.seed, int(case.first_trial + lanes.trials[lane]))


# Receptions ---------------------------------------------------------------------------------------


def slots_of_word(n_nodes: int) -> int:
    """Number of slots with receptions in one word: as many as fit, at most a frame.

    >>> [slots_of_word(n_nodes) for n_nodes in (2, 5, 10, 64)]
    [2, 5, 6, 1]
    """
    return max(1, min(n_nodes, WORD_BITS // n_nodes))


def draw_word(case: Case, key: int, frame_slot: int, first: int, n_slots: int) -> int:
    """Draw the receptions of some slots of a trial: bit n * n_nodes + node for the n-th slot."""
    word = 0
    for n in range(n_slots):
        owner = first + n
        key_of_slot = slot_key(key, frame_slot + owner)
        for node in range(case.n_nodes):
            if node != owner:
                heard = int(link_uniform(key_of_slot, owner, node) >= case.p_loss)
                word |= heard * lane_bit(n * case.n_nodes + node)
    return word


def transpose(words: Ints, n_rows: int) -> None:
    """Transpose a bit matrix, first `n_rows` words only (Warren, Hacker's Delight, 7-3)."""
    width, mask = LANES // 2, (1 << LANES // 2) - 1
    while width != 0:
        for first in range(0, n_rows, 2 * width):
            for k in range(first, first + width):
                changed = (words[k] >> width ^ words[k + width]) & mask
                words[k] ^= changed << width
                words[k + width] ^= changed
        width >>= 1
        mask ^= mask << width


def draw(case: Case, lanes: Lanes, frame: int, first: int, playing: int) -> None:
    """Set `lanes.drawn` to the receptions of the slots of a word from the frame's slot `first` on, cached or drawn."""
    word_slots = slots_of_word(case.n_nodes)
    words_of_frame, n_slots = -(-case.n_nodes // word_slots), min(word_slots, case.n_nodes - first)
    for lane in range(LANES):
        word = 0
        if playing >> lane & 1:
            own_frame = int(frame - lanes.began_frame[lane])
            at = own_frame * words_of_frame + first // word_slots
            is_cached = at < len(lanes.received)
            if is_cached:
                word = lanes.received[at, lanes.trials[lane]]
            # Not cached, or all lost: drawn again, the latter is 0 again.
            if word == 0:
                word = draw_word(case, key_of(case, lanes, lane), own_frame * case.n_nodes, first, n_slots)
                if is_cached:
                    lanes.received[at, lanes.trials[lane]] = word
        lanes.drawn[lane] = word
    transpose(lanes.drawn, n_slots * case.n_nodes)


# Items --------------------------------------------------------------------------------------------


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


def free_column(case: Case, lanes: Lanes, lane: int, origin: int, slot: int) -> int:
    """Return the first column of an origin that is free in a lane; -1 without one."""
    first = origin * case.columns_per_source
    for column in range(first, first + case.columns_per_source):
        if lanes.free_slot[lane, column] <= slot:
            return column
    return -1


def slots_in_window(case: Case, start: int, stop: int) -> int:
    """Number of slots from `start` to before `stop` inside the window."""
    return max(0, min(stop, case.window_end) - max(start, case.window_start))


def note_item(case: Case, lanes: Lanes, lane: int, stage: int, column: int, slot: int) -> None:
    """Record that an item, or a whole batch, reaches a stage in this slot of a lane's trial."""
    outcome, born = lanes.outcomes[lanes.trials[lane]], lanes.born_slot[lane, column]
    if case.window_start <= born < case.window_end:
        outcome[stage, SUM] += slot + 1 - born
        outcome[stage, COUNT] += 1
    if stage == DELIVERED and case.window_start <= slot < case.window_end:
        outcome[GOODPUT, SUM] += 1
    if stage == SOURCE_ACKED:
        outcome[IN_FLIGHT, SUM] += slots_in_window(case, born, slot + 1)
    if stage == SENDERS_ACKED:
        # Two frames later no node remembers a packet that carried the item.
        lanes.free_slot[lane, column] = slot + 1 + 2 * case.n_nodes


def ended(case: Case, lanes: Lanes, slot: int, asked: int) -> int:
    """Close the trials of `asked` that end with a slot; return their lanes."""
    over = 0
    for lane in lanes_of(asked):
        n_slots, outcome = own_slot(case, lanes, lane, slot) + 1, lanes.outcomes[lanes.trials[lane]]
        n_followed = outcome[OFFERED, SUM] - outcome[REFUSED, SUM]
        is_settled = n_slots >= case.window_end and outcome[SENDERS_ACKED, COUNT] >= n_followed
        if is_settled or n_slots >= case.max_slots:
            over |= lane_bit(lane)
            outcome[SLOTS, SUM] = n_slots
            outcome[TRANSMISSIONS, SUM] = counted(lanes.digits, lane)
            close(case, lanes, lane, outcome)
    return over


def close(case: Case, lanes: Lanes, lane: int, outcome: Ints) -> None:
    """Complete the sums and counts of a trial."""
    if case.rate == 0.0:
        # Transmissions of a censored batch do not count.
        outcome[TRANSMISSIONS, COUNT] = outcome[SENDERS_ACKED, COUNT]
        outcome[TRANSMISSIONS, SUM] *= outcome[SENDERS_ACKED, COUNT]
        return
    for column in range(n_columns_of(case)):
        if lanes.free_slot[lane, column] == NEVER and not lanes.reached[SOURCE_ACKED, column] >> lane & 1:
            outcome[IN_FLIGHT, SUM] += slots_in_window(case, lanes.born_slot[lane, column], case.window_end)
    outcome[TRANSMISSIONS, COUNT] = outcome[GOODPUT, SUM]
    outcome[REFUSED, COUNT] = outcome[OFFERED, SUM]
    for quantity in (IN_FLIGHT, GOODPUT, OFFERED):
        outcome[quantity, COUNT] = case.window_end - case.window_start
