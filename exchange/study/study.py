"""Policy study: time of delivery and of acknowledgement by policy and loss rate.

Reproduces figures 3 to 5 of Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world
information", and adds cases of its future work: items at every node, and items that arrive during the exchange. All
policies and loss rates use the same random numbers, so that differences are paired.
"""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from exchange.arithmetic import exp
from exchange.errors import ConfigurationError
from exchange.policy.planning import names_bits
from exchange.policy.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits
from exchange.study import estimates, trial
from exchange.study.estimates import TrialMean
from exchange.study.parameters import BOUND, ExchangeStudy, LoadKind, StudyLoad, workload_named
from exchange.study.parts import Tally, TrialPlan, play_all
from exchange.study.trial import Floats

NO_COLUMNS = ("acknowledgement", "repeats")
"""Fields of a row that tables omit."""


@dataclass(frozen=True, slots=True)
class StudyRow:
    """Results of one policy at one loss rate; times in slots from slot 0 or generation.

    Relative values are ratios to policy `ack`. An estimate is None if all trials are censored or the quantity needs
    Poisson load. With `links`, `per` is the mean over links. `acknowledgement` and `repeats` are for figures, not table
    columns.
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
    acknowledgement: str
    repeats: bool

    def as_json(self) -> dict[str, Any]:
        """Return plain values; the interval of a relative value becomes a separate field."""
        values = asdict(self)
        for name in NO_COLUMNS:
            del values[name]
        for name in ("relative_source", "relative_senders", "relative_delivered"):
            estimate: TrialMean | None = getattr(self, name)
            values[name] = estimate and estimate.mean
            values[f"{name}_ci95"] = estimate and [estimate.ci95_low, estimate.ci95_high]
        return values


def row_of(study: ExchangeStudy, per: float, policy: AckPolicy, tally: Tally) -> StudyRow:
    """Build the row of one policy at one loss rate."""
    means: list[TrialMean | None] = [estimates.mean(products) for products in tally.moments]
    means += [None] * (trial.N_QUANTITIES - len(means))
    relative = [estimates.relative_mean(products) for products in tally.moments[: trial.N_STAGES]]
    delivered, source, senders = (int(number) for number in tally.censored)
    return StudyRow(
        nodes=study.nodes,
        per=per,
        policy=policy.name,
        trials=study.trials,
        items=None if study.load.kind is LoadKind.POISSON else study.load.items,
        load=str(study.load),
        item_bits=study.item_bits,
        capacity_bits=study.capacity_bits,
        carrier_evidence=study.carrier_evidence,
        seed=study.seed,
        header_bits=header_bits(policy, study.nodes),
        source_acked_slots=means[trial.SOURCE_ACKED],
        senders_acked_slots=means[trial.SENDERS_ACKED],
        delivered_slots=means[trial.DELIVERED],
        item_transmissions=means[trial.TRANSMISSIONS],
        relative_source=relative[trial.SOURCE_ACKED],
        relative_senders=relative[trial.SENDERS_ACKED],
        relative_delivered=relative[trial.DELIVERED],
        items_in_flight=means[trial.IN_FLIGHT],
        goodput_items_per_slot=means[trial.GOODPUT],
        offered_items_per_slot=means[trial.OFFERED],
        refused_fraction=means[trial.REFUSED],
        censored_delivered=delivered,
        censored_source=source,
        censored_senders=senders,
        false_beliefs=tally.false_beliefs,
        slots_played=tally.slots,
        cpu_s=tally.cpu_s,
        acknowledgement=policy.acknowledgement.name,
        repeats=policy.repeat,
    )


__all__ = [
    "BOUND",
    "KINDS",
    "LOADED_RATES",
    "PAPER_PER",
    "ExchangeStudy",
    "LoadKind",
    "StudyLoad",
    "StudyRow",
    "TrialMean",
    "loaded_studies",
    "paper_studies",
    "run",
    "workload_named",
]

BASELINE = POLICIES["ack"]

KINDS = tuple(kind.name for kind in ACKNOWLEDGEMENTS)
"""Names of the shipped acknowledgements in display order, as in `StudyRow.acknowledgement`."""

PAPER_PER = tuple(step / 20 for step in range(1, 17))
"""Loss rates of figures 3 to 5: 0.05 to 0.8."""

LOADED_RATES = (0.005, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.18, 0.22, 0.26, 0.32)
"""Items per node and slot in the loaded case, from nearly idle to overload of every policy."""

SYMBOL_MORE_BITS = 10
"""Extra size of an item in a symbol, where its encoding does not depend on the packet."""

LOADED_CAPACITY_BITS = 256
"""Packet size of the loaded case: 32 bytes."""


def run(
    study: ExchangeStudy,
    jobs: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
    say: Callable[[str], None] = lambda text: None,
) -> list[StudyRow]:
    """Run a study; return a row per loss rate and policy, in the order given.

    Args:
        jobs: threads; results do not depend on it.
        progress: called with batches done and in total.
        say: receives an announcement before compilation, or the reason why it is impossible.

    Raises:
        ConfigurationError: `jobs` is not positive, or an acknowledgement cannot be compiled.
    """
    if jobs < 1:
        raise ConfigurationError(f"jobs is {jobs}: at least 1 is needed")
    from exchange.study.compiler import slot_loops, why_uncompiled

    plan = TrialPlan(
        study.nodes,
        (BASELINE, *(policy for policy in study.chosen if policy != BASELINE)),
        study.carrier_evidence,
        p_loss_matrices(study),
        load_of(study),
        study.seed,
        study.trials,
    )
    tallies = play_all(
        plan,
        slot_loops([policy.acknowledgement for policy in plan.policies], say),
        1 if why_uncompiled() else jobs,
        progress,
    )
    return [
        row_of(study, per, policy, tallies_of_per[plan.policies.index(policy)])
        for per, tallies_of_per in zip(study.per or (_mean_link(plan.matrices[0]),), tallies, strict=True)
        for policy in study.chosen
    ]


def paper_studies(trials: int = 2000, seed: int = 1) -> list[ExchangeStudy]:
    """Return the studies of figures 3 and 4 (five nodes) and figure 5 (ten nodes)."""
    return [ExchangeStudy(nodes=nodes, per=PAPER_PER, trials=trials, seed=seed) for nodes in (5, 10)]


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


def load_of(study: ExchangeStudy) -> trial.Load:
    """Convert the load for the slot loop."""
    n_sources = 1 if study.load.kind is LoadKind.SINGLE else study.nodes
    columns = study.load.items
    window_start = window_end = 0
    if study.load.kind is LoadKind.POISSON:
        columns = study.queue_items
        window_start = study.warmup_frames * study.nodes
        window_end = window_start + study.window_frames * study.nodes
    capacity_bits = trial.NEVER if study.capacity_bits is None else study.capacity_bits
    return trial.Load(
        n_sources, columns, study.load.rate, study.item_bits, capacity_bits, window_start, window_end, study.max_slots,
        exp(-study.load.rate), number_bits_of(study), study.item_bits + SYMBOL_MORE_BITS,
    )  # fmt: skip


def number_bits_of(study: ExchangeStudy) -> int:
    """Return the bits of a sequence for the expected items per node, as in a vehicle."""
    n_items: float = study.load.items
    if study.load.kind is LoadKind.POISSON:
        n_items = 1 + study.load.rate * (study.warmup_frames + study.window_frames) * study.nodes
    return names_bits(math.ceil(n_items) + 1)


def p_loss_matrices(study: ExchangeStudy) -> tuple[Floats, ...]:
    """Return the loss matrix (from row to column) of each setting, with 1 on the diagonal."""
    if study.links is not None:
        matrices = [np.array(study.links, np.float64)]
    else:
        matrices = [np.full((study.nodes, study.nodes), p_loss) for p_loss in study.per]
    for matrix in matrices:
        np.fill_diagonal(matrix, 1.0)
    return tuple(matrices)


def _mean_link(matrix: Floats) -> float:
    n_nodes = len(matrix)
    return float((math.fsum(matrix.flat) - n_nodes) / (n_nodes * (n_nodes - 1)))
