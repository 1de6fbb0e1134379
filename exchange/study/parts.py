"""Batches of trials that fit into memory, run by threads and summed in a fixed order."""

import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from exchange.arithmetic import exp
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.planning import names_bits
from exchange.policy.policies import AckPolicy
from exchange.study import lanes
from exchange.study.compiler import SlotLoop, arguments_of
from exchange.study.estimates import Moments, moments
from exchange.study.lanes import Case, Floats, Ints
from exchange.study.parameters import BOUND, ExchangeStudy, LoadKind

TRIALS_AT_ONCE = 1000
"""Trials of a batch; memory grows with it, not with the number of trials."""

REMEMBERED_WORDS = 400
"""Words of loss draws per trial cached for the next policy; later ones are drawn again."""

SYMBOL_MORE_BITS = 10
"""Extra size of an item in a symbol, where its encoding does not depend on the packet."""


def case_of(study: ExchangeStudy, policy: AckPolicy) -> Case:
    """Convert the parameters of a policy's trials for the slot loop."""
    kind, load, is_poisson = policy.acknowledgement, study.load, study.load.kind is LoadKind.POISSON
    warmup_frames, window_frames = (study.warmup_frames, study.window_frames) if is_poisson else (0, 0)
    window_start, window_end = warmup_frames * study.nodes, (warmup_frames + window_frames) * study.nodes
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
        number_bits=names_bits(math.ceil(expected_items) + 1),  # as in a vehicle
        capacity_bits=lanes.NEVER if study.capacity_bits is None else study.capacity_bits,
        window_start=window_start,
        window_end=window_end,
        max_slots=study.max_slots,
        seed=study.seed,
    )


def p_loss_matrices(study: ExchangeStudy) -> tuple[Floats, ...]:
    """Return the loss matrix (from row to column) of each loss rate, with 1 on the diagonal."""
    is_diagonal = np.eye(study.nodes, dtype=bool)
    return tuple(np.where(is_diagonal, 1.0, p_loss) for p_loss in study.per)


class Tally(NamedTuple):
    """Sums over the trials of one policy at one loss matrix; moments of quantities with means."""

    moments: Moments
    totals: Ints  # [quantity, sum or count or censored]
    cpu_s: float

    def plus(self, other: "Tally") -> "Tally":
        """Add the sums of more trials."""
        return Tally(self.moments + other.moments, self.totals + other.totals, self.cpu_s + other.cpu_s)


def play_all(
    study: ExchangeStudy, loops: Mapping[AckPolicy, SlotLoop], jobs: int, progress: Callable[[int, int], None]
) -> list[dict[AckPolicy, Tally]]:
    """Run the trials of all policies, baseline first, by ``jobs`` threads (1 for Python loops).

    Return tallies per loss matrix and policy, which do not depend on threads. ``progress`` is called with the numbers
    of batches done and in total.
    """
    matrices = p_loss_matrices(study)

    def played(batch: tuple[int, int]) -> dict[AckPolicy, Tally]:
        setting, first_trial = batch
        return play_batch(study, loops, matrices[setting], first_trial)

    tallies: list[dict[AckPolicy, Tally]] = [{} for _ in matrices]
    batches = [(setting, first) for setting in range(len(matrices)) for first in range(0, study.trials, TRIALS_AT_ONCE)]
    pool = ThreadPoolExecutor(jobs)
    try:
        # Both yield in the order of the batches, so that sums of floats do not depend on threads.
        results = map(played, batches) if jobs == 1 else pool.map(played, batches)
        for done, ((setting, _), of_batch) in enumerate(zip(batches, results, strict=True), start=1):
            earlier = tallies[setting]
            tallies[setting] = {
                policy: earlier[policy].plus(tally) if earlier else tally for policy, tally in of_batch.items()
            }
            progress(done, len(batches))
    finally:
        pool.shutdown(cancel_futures=True)  # an interruption waits for running batches only
    return tallies


def play_batch(
    study: ExchangeStudy, loops: Mapping[AckPolicy, SlotLoop], p_loss: Floats, first_trial: int
) -> dict[AckPolicy, Tally]:
    """Run the trials of a batch under each policy, baseline first."""
    received = np.zeros((REMEMBERED_WORDS, min(TRIALS_AT_ONCE, study.trials - first_trial)), np.int64)
    n_estimated = lanes.FALSE_BELIEFS if study.load.kind is LoadKind.POISSON else lanes.IN_FLIGHT
    baseline = np.empty(0, np.int64)
    tallies: dict[AckPolicy, Tally] = {}
    for policy, loop in loops.items():
        # Of this thread only: process time would include the other batches.
        began_s = time.thread_time()
        case = case_of(study, policy)._replace(first_trial=first_trial)
        outcomes = play(loop, policy.acknowledgement, case, p_loss, received)
        cpu_s = time.thread_time() - began_s
        if not tallies:
            baseline = outcomes
        products = moments(outcomes[:, :n_estimated], baseline[:, :n_estimated])
        tallies[policy] = Tally(products, outcomes.sum(axis=0), cpu_s)
    return tallies


def play(loop: SlotLoop, kind: Acknowledgement, case: Case, p_loss: Floats, received: Ints) -> Ints:
    """Return the outcomes of trials, shape (n_trials, N_QUANTITIES, 3); `received` has a column per trial."""
    outcomes = np.zeros((received.shape[1], lanes.N_QUANTITIES, 3), np.int64)
    loop(*arguments_of(kind, case, lanes.thresholds_of(p_loss), received, outcomes))
    return outcomes
