"""Policy study: time of delivery and of acknowledgement by policy and loss rate.

Reproduces figures 3 to 5 of Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world
information", and adds cases of its future work: items at every node, and items that arrive during the exchange. All
policies and loss rates use the same random numbers, so that differences are paired.

Trials run in batches that fit into memory, by threads, and are summed in a fixed order. A trial reports a sum and a
count per quantity: slots until the end and 1, or latencies of many items and their number. The mean is the sum of sums
over the sum of counts. Its variance, and that of the ratio to a baseline in the same trials, follow from linearised
residuals (Cochran, Sampling Techniques, 1977, chapter 6), which need only the sums of products. Intervals are normal,
for thirty trials or more.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from operator import add
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exchange.arithmetic import exp
from exchange.errors import ConfigurationError
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.planning import width
from exchange.policy.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits
from exchange.study import compiler, lanes
from exchange.study.compiler import SlotLoop
from exchange.study.lanes import Case, Ints
from exchange.study.parameters import BOUND, ExchangeStudy, LoadKind, StudyLoad

BASELINE = POLICIES["ack"]

KINDS = tuple(kind.name for kind in ACKNOWLEDGEMENTS)
"""Names of the shipped acknowledgements in display order, as in `StudyRow.acknowledgement`."""

LOADED_RATES = (0.005, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.18, 0.22, 0.26, 0.32)
"""Items per node and slot in the loaded case, from nearly idle to overload of every policy."""

LOADED_CAPACITY_BITS = 256

TRIALS_AT_ONCE = 1000
"""Trials of a batch; memory grows with it, not with the number of trials."""

REMEMBERED_WORDS = 400
"""Words of loss draws per trial cached for the next policy; later ones are drawn again."""

SYMBOL_MORE_BITS = 10
"""Extra size of an item in a symbol, where its encoding does not depend on the packet."""

# Estimates -----------------------------------------------------------------------------------------


Z_95 = 1.959964
ROUNDING = 1e-13
"""Variance, as a share of its terms, below which it is rounding."""

Moments = NDArray[np.float64]
"""Summed products of (1, sum, count, baseline sum, baseline count), shape (..., 5, 5)."""


@dataclass(frozen=True, slots=True)
class TrialMean:
    """Mean with 95 % confidence interval; the interval is None for a single trial."""

    mean: float
    ci95_low: float | None
    ci95_high: float | None


def moments(outcomes: NDArray[np.int64], baseline: NDArray[np.int64]) -> Moments:
    """Sum the products over trials; return shape (n_quantities, 5, 5).

    ``outcomes`` has shape (n_trials, n_quantities, 2): sum, count; ``baseline`` the same trials under the baseline
    policy.
    """
    n_trials, n_quantities, _ = outcomes.shape
    vectors = np.empty((n_quantities, 5, n_trials))
    vectors[:, 0] = 1.0
    vectors[:, 1:3] = outcomes.transpose(1, 2, 0)
    vectors[:, 3:] = baseline.transpose(1, 2, 0)
    products: Moments = vectors @ vectors.transpose(0, 2, 1)
    return products


def mean(products: Moments) -> TrialMean | None:
    """Return the mean of one quantity, shape (5, 5); None if no trial counts.

    >>> trials = np.array([[[1, 1]], [[2, 1]], [[6, 1]]])
    >>> mean(moments(trials, trials)[0]).mean
    3.0
    """
    rows = products.tolist()
    _, total, count, _, _ = rows[0]
    if count == 0:
        return None
    value = total / count
    # Partial derivatives of total / count; the residuals sum to 0, so the constant term is 0.
    return _estimate(value, (0.0, 1.0 / count, -value / count, 0.0, 0.0), rows)


def relative_mean(products: Moments) -> TrialMean | None:
    """Return the mean over that of the baseline; None if no trial of either counts, or one is 0."""
    rows = products.tolist()
    _, total, count, base_total, base_count = rows[0]
    if count == 0 or base_count == 0 or total == 0 or base_total == 0:
        return None
    value = (total / count) / (base_total / base_count)
    weights = 0.0, value * (1 / total), value * (-1 / count), value * (-1 / base_total), value * (1 / base_count)
    return _estimate(value, weights, rows)


def _estimate(value: float, weights: Sequence[float], products: Sequence[Sequence[float]]) -> TrialMean:
    """Return the estimate whose residual in a trial is the weighted sum of its numbers."""
    n_trials = products[0][0]
    if n_trials < 2:
        return TrialMean(value, None, None)
    terms = [u * v * p for u, row in zip(weights, products, strict=True) for v, p in zip(weights, row, strict=True)]
    variance = math.fsum(terms) * n_trials / (n_trials - 1)
    rounding = math.fsum(map(abs, terms)) * ROUNDING
    half = Z_95 * math.sqrt(variance) if variance > rounding else 0.0
    return TrialMean(value, value - half, value + half)


# Batches of trials ---------------------------------------------------------------------------------


def case_of(study: ExchangeStudy, policy: AckPolicy, p_loss: float) -> Case:
    """Convert the parameters of a policy's trials for the slot loop."""
    kind, load, is_poisson = policy.acknowledgement, study.load, study.load.kind is LoadKind.POISSON
    window_start, window_end = 0, 1
    if is_poisson:
        window_start = study.warmup_frames * study.nodes
        window_end = window_start + study.window_frames * study.nodes
    expected_items = 1 + load.rate * window_end if is_poisson else load.items
    return Case(
        study.nodes,
        repeat=policy.repeat or policy == BOUND,
        carrier_evidence=study.carrier_evidence,
        relays=kind.relays,
        infers=kind.infers,
        states=kind.states,
        codes=kind.codes,
        knows_all=policy == BOUND,
        n_sources=1 if load.kind is LoadKind.SINGLE else study.nodes,
        columns_per_source=study.queue_items if is_poisson else load.items,
        rate=load.rate,
        p_none=exp(-load.rate),
        item_bits=study.item_bits,
        symbol_bits=study.item_bits + SYMBOL_MORE_BITS,
        number_bits=width(math.ceil(expected_items) + 1),  # as in a vehicle
        capacity_bits=lanes.NEVER if study.capacity_bits is None else study.capacity_bits,
        window_start=window_start,
        window_end=window_end,
        max_slots=study.max_slots,
        p_loss=p_loss,
        seed=study.seed,
    )


class Tally(NamedTuple):
    """Sums over the trials of one policy at one loss rate, see `moments`."""

    moments: Moments
    cpu_s: float


def play_batch(
    study: ExchangeStudy, loops: Mapping[AckPolicy, SlotLoop], p_loss: float, first_trial: int
) -> dict[AckPolicy, Tally]:
    """Run the trials of a batch under each policy, baseline first."""
    received = np.zeros((REMEMBERED_WORDS, min(TRIALS_AT_ONCE, study.trials - first_trial)), np.int64)
    baseline: Ints | None = None
    tallies: dict[AckPolicy, Tally] = {}
    for policy, loop in loops.items():
        # Of this thread only: process time would include the other batches.
        began_s = time.thread_time()
        case = case_of(study, policy, p_loss)._replace(first_trial=first_trial)
        outcomes = play(loop, policy.acknowledgement, case, received)
        cpu_s = time.thread_time() - began_s
        baseline = outcomes if baseline is None else baseline
        tallies[policy] = Tally(moments(outcomes, baseline), cpu_s)
    return tallies


def play(loop: SlotLoop, kind: Acknowledgement, case: Case, received: Ints) -> Ints:
    """Return the outcomes of trials, shape (n_trials, N_QUANTITIES, 2); `received` has a column per trial."""
    fleet = compiler.new_fleet(kind, case, received)
    loop(case, fleet)
    return fleet.lanes.outcomes


# Rows ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class StudyRow:
    """Results of one policy at one loss rate; times in slots from slot 0 or generation.

    Relative values are ratios to policy `ack`. An estimate is None if all trials are censored or the quantity needs
    Poisson load.
    """

    nodes: int
    per: float
    policy: str
    trials: int
    items: int | None
    load: str
    item_bits: int
    capacity_bits: int | None
    carrier_evidence: bool
    seed: int
    header_bits: int
    source_acked_slots: TrialMean | None
    senders_acked_slots: TrialMean | None
    delivered_slots: TrialMean | None
    item_transmissions: TrialMean | None
    relative_source: TrialMean | None
    relative_senders: TrialMean | None
    relative_delivered: TrialMean | None
    items_in_flight: TrialMean | None
    goodput_items_per_slot: TrialMean | None
    offered_items_per_slot: TrialMean | None
    refused_fraction: TrialMean | None
    censored_delivered: int
    censored_source: int
    censored_senders: int
    false_beliefs: int
    slots_played: int
    cpu_s: float

    def as_json(self) -> dict[str, Any]:
        """Return plain values; the interval of a relative value becomes a separate field."""
        values = asdict(self)
        for name in ("relative_source", "relative_senders", "relative_delivered"):
            estimate: TrialMean | None = getattr(self, name)
            values[name] = estimate and estimate.mean
            values[f"{name}_ci95"] = estimate and [estimate.ci95_low, estimate.ci95_high]
        return values


def row_of(study: ExchangeStudy, per: float, policy: AckPolicy, tally: Tally) -> StudyRow:
    """Build the row of one policy at one loss rate."""
    is_poisson = study.load.kind is LoadKind.POISSON
    means = [
        mean(products) if is_poisson or quantity < lanes.IN_FLIGHT else None
        for quantity, products in enumerate(tally.moments)
    ]
    relative = [relative_mean(products) for products in tally.moments[: lanes.N_STAGES]]
    sums, counts = tally.moments[:, 0, 1:3].astype(int).T.tolist()
    n_followed = sums[lanes.OFFERED] - sums[lanes.REFUSED]
    return StudyRow(
        nodes=study.nodes,
        per=per,
        policy=policy.name,
        trials=study.trials,
        items=None if is_poisson else study.load.items,
        load=str(study.load),
        item_bits=study.item_bits,
        capacity_bits=study.capacity_bits,
        carrier_evidence=study.carrier_evidence,
        seed=study.seed,
        header_bits=header_bits(policy, study.nodes),
        source_acked_slots=means[lanes.SOURCE_ACKED],
        senders_acked_slots=means[lanes.SENDERS_ACKED],
        delivered_slots=means[lanes.DELIVERED],
        item_transmissions=means[lanes.TRANSMISSIONS],
        relative_source=relative[lanes.SOURCE_ACKED],
        relative_senders=relative[lanes.SENDERS_ACKED],
        relative_delivered=relative[lanes.DELIVERED],
        items_in_flight=means[lanes.IN_FLIGHT],
        goodput_items_per_slot=means[lanes.GOODPUT],
        offered_items_per_slot=means[lanes.OFFERED],
        refused_fraction=means[lanes.REFUSED],
        censored_delivered=n_followed - counts[lanes.DELIVERED],
        censored_source=n_followed - counts[lanes.SOURCE_ACKED],
        censored_senders=n_followed - counts[lanes.SENDERS_ACKED],
        false_beliefs=sums[lanes.FALSE_BELIEFS],
        slots_played=sums[lanes.SLOTS],
        cpu_s=tally.cpu_s,
    )


def run(
    study: ExchangeStudy,
    jobs: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
    say: Callable[[str], None] = lambda text: None,
) -> list[StudyRow]:
    """Run a study; return a row per loss rate and policy, in the order given, whatever the number of threads
    (``jobs``).

    ``progress`` is called with batches done and in total; ``say`` receives an announcement before compilation, or the
    reason why it is impossible. Raises ConfigurationError if ``jobs`` is not positive, or an acknowledgement cannot be
    compiled.
    """
    if jobs < 1:
        raise ConfigurationError(f"jobs is {jobs}: at least 1 is needed")
    policies = dict.fromkeys((BASELINE, *study.chosen))
    of_kind = compiler.slot_loops([policy.acknowledgement for policy in policies], say)
    loops = {policy: of_kind[policy.acknowledgement] for policy in policies}
    rates, starts = zip(*product(study.per, range(0, study.trials, TRIALS_AT_ONCE)), strict=True)
    tallies: list[dict[AckPolicy, Tally]] = []
    pool = ThreadPoolExecutor(jobs)
    try:
        # Both yield in the order of the batches, so that sums of floats do not depend on threads. Python loops run in
        # this thread, where an interruption reaches them.
        in_order = map if compiler.why_uncompiled() or jobs == 1 else pool.map
        for done, of_batch in enumerate(in_order(partial(play_batch, study, loops), rates, starts), start=1):
            if starts[done - 1] == 0:
                tallies.append(of_batch)
            else:
                tallies[-1] = {
                    policy: Tally(*map(add, tally, of_batch[policy])) for policy, tally in tallies[-1].items()
                }
            progress(done, len(starts))
    finally:
        pool.shutdown(cancel_futures=True)  # an interruption waits for running batches only
    return [
        row_of(study, per, policy, of_policy[policy])
        for per, of_policy in zip(study.per, tallies, strict=True)
        for policy in study.chosen
    ]


def loaded_studies(trials: int = 100, seed: int = 1) -> list[ExchangeStudy]:
    """Return the loaded case: five nodes, 30 % loss, one study per rate of new items."""
    return [
        ExchangeStudy(
            nodes=5,
            per=(0.3,),
            trials=trials,
            load=StudyLoad(LoadKind.POISSON, rate=rate),
            capacity_bits=LOADED_CAPACITY_BITS,
            seed=seed,
        )
        for rate in LOADED_RATES
    ]
