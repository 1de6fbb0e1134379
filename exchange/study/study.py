"""The policy study: how long each policy takes to deliver items, and to know it, at which loss rate.

Reproduces figures 3 to 5 of Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world
information", and goes on to what the paper leaves to future work: items at every node, and items that arrive while
others are under way. Every policy and every loss rate meets the same random numbers, so that differences are paired.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from exchange.ack import MAX_NODES
from exchange.errors import ConfigurationError
from exchange.policies import POLICIES, AckPolicy, header_bits, policy_named
from exchange.study import estimates, trial
from exchange.study.estimates import Estimate
from exchange.study.parts import Plan, Tally, play_all
from exchange.study.trial import Floats

__all__ = [
    "LOADED_RATES",
    "PAPER_PER",
    "Estimate",
    "ExchangeStudy",
    "LoadKind",
    "StudyRow",
    "Workload",
    "loaded_studies",
    "paper_studies",
    "run",
    "workload_named",
]

BASELINE = POLICIES["ack"]

MAX_SEED = 1 << 62

PAPER_PER = tuple(step / 20 for step in range(1, 17))
"""Loss rates of figures 3 to 5: 0.05 to 0.8."""

LOADED_RATES = (0.005, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.18, 0.22, 0.26, 0.32)
"""Items per node and slot of the loaded case: from nearly idle to more than any policy carries."""

LOADED_CAPACITY_BITS = 256
"""Packet size of the loaded case: 32 bytes."""


class LoadKind(StrEnum):
    """What there is to send."""

    SINGLE = "single"
    BATCH = "batch"
    POISSON = "poisson"


@dataclass(frozen=True, slots=True)
class Workload:
    """One item at node 0; or `items` at every node at slot 0; or `rate` items per node and slot, steady state."""

    kind: LoadKind = LoadKind.SINGLE
    items: int = 1
    rate: float = 0.0

    def __post_init__(self) -> None:
        if self.kind is not LoadKind.BATCH and self.items != 1:
            raise ConfigurationError(f"items is {self.items}, but a number of items is for load batch, not {self.kind}")
        if self.items < 1:
            raise ConfigurationError(f"items is {self.items}: a batch has at least 1 item per node")
        if self.kind is LoadKind.POISSON and not 0.0 < self.rate <= 100.0:
            raise ConfigurationError(f"load poisson:{self.rate:g}: the rate must be above 0 and at most 100")

    def __str__(self) -> str:
        return f"{self.kind}:{self.rate:g}" if self.kind is LoadKind.POISSON else str(self.kind)


def workload_named(text: str, items: int = 1) -> Workload:
    """The load that a text such as `single`, `batch` or `poisson:0.02` stands for.

    >>> str(workload_named("poisson:0.02"))
    'poisson:0.02'
    """
    name, colon, rate = text.partition(":")
    try:
        if name == LoadKind.POISSON and colon:
            return Workload(LoadKind.POISSON, items, float(rate))
        if not colon:
            return Workload(LoadKind(name), items)
    except ValueError:
        pass
    raise ConfigurationError(f"unknown load {text!r}: allowed are single, batch and poisson:RATE, as in poisson:0.02")


@dataclass(frozen=True)
class ExchangeStudy:
    """Everything that the study's numbers depend on.

    Attributes:
        nodes: vehicles in the fleet.
        per: loss probabilities, each the same on all links.
        links: loss probability of every link instead, from row to column; `per` is then empty.
        policies: names.
        trials: per policy and loss rate.
        load: what there is to send.
        item_bits: size of an item.
        capacity_bits: size of a packet, header charged; None for no limit.
        carrier_evidence: take a node that sends an item as holding it; the paper does not.
        seed: of all random numbers.
        max_slots: bound of a trial; one that has not ended is reported as censored.
        queue_items: Poisson load: items of its own that a node keeps; more are refused.
        warmup_frames, window_frames: Poisson load: frames before the window, and of it; make the warm-up long against
            the latencies, which under saturation and high loss are thousands of slots.
    """

    nodes: int = 5
    per: tuple[float, ...] = (0.5,)
    links: tuple[tuple[float, ...], ...] | None = None
    policies: tuple[str, ...] = tuple(POLICIES)
    trials: int = 2000
    load: Workload = Workload()
    item_bits: int = 60
    capacity_bits: int | None = None
    carrier_evidence: bool = False
    seed: int = 1
    max_slots: int = 200_000
    queue_items: int = 32
    warmup_frames: int = 200
    window_frames: int = 200

    def __post_init__(self) -> None:
        faults = list(self._faults())
        if faults:
            raise ConfigurationError("; ".join(faults))

    def _faults(self) -> Iterator[str]:
        if not 2 <= self.nodes <= MAX_NODES:
            yield f"nodes is {self.nodes}: allowed are 2 to {MAX_NODES}"
        if self.trials < 1:
            yield f"trials is {self.trials}: at least 1 is needed"
        if not 0 <= self.seed < MAX_SEED:
            yield f"seed is {self.seed}: allowed are 0 to {MAX_SEED - 1}"
        for name, least in (("item_bits", 1), ("max_slots", 1), ("queue_items", 1), ("window_frames", 1)):
            if getattr(self, name) < least:
                yield f"{name} is {getattr(self, name)}: at least {least} is needed"
        if self.warmup_frames < 0:
            yield f"warmup_frames is {self.warmup_frames}: it cannot be negative"
        if (
            self.load.kind is LoadKind.POISSON
            and self.max_slots <= (self.warmup_frames + self.window_frames) * self.nodes
        ):
            yield f"max_slots is {self.max_slots}: warm-up and window alone take as long"
        yield from self._loss_faults()
        yield from self._policy_faults()

    def _loss_faults(self) -> Iterator[str]:
        if self.links is None:
            if not self.per:
                yield "per is empty: at least one loss probability is needed"
            for p_loss in self.per:
                yield from _p_loss_faults("per", p_loss)
            return
        if self.per:
            yield "per and links are both given: a study takes one of them"
        if len(self.links) != self.nodes or any(len(row) != self.nodes for row in self.links):
            yield f"links must have {self.nodes} rows of {self.nodes} loss probabilities, one for every node"
            return
        for sender, row in enumerate(self.links):
            for receiver, p_loss in enumerate(row):
                if sender != receiver:
                    yield from _p_loss_faults(f"links[{sender}][{receiver}]", p_loss)

    def _policy_faults(self) -> Iterator[str]:
        if not self.policies:
            yield f"policies is empty: allowed are {', '.join(POLICIES)}"
        for name in self.policies:
            try:
                policy = policy_named(name)
            except ConfigurationError as fault:
                yield str(fault)
                continue
            least = header_bits(policy, self.nodes) + self.item_bits
            if self.capacity_bits is not None and self.capacity_bits < least:
                yield (
                    f"capacity_bits is {self.capacity_bits}: with {self.nodes} nodes policy {name} needs {least}, "
                    f"{least - self.item_bits} for its header and {self.item_bits} for one item"
                )


def _p_loss_faults(what: str, p_loss: float) -> Iterator[str]:
    if p_loss == 1.0:
        yield f"{what} is 1: every packet is lost and the exchange never ends; it must be from 0 to below 1"
    elif not 0.0 <= p_loss < 1.0:
        yield f"{what} is {p_loss:g}: a loss probability must be from 0 to below 1"


@dataclass(frozen=True, slots=True)
class StudyRow:
    """Results of one policy at one loss rate; times in slots, from slot 0 or from an item's generation.

    Relative values are those of the policy over those of `ack`. An estimate is None where no trial counts: because all
    are censored, or because the quantity belongs to Poisson load. With `links`, `per` is the mean over the links.
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
    source_acked_slots: Estimate | None
    senders_acked_slots: Estimate | None
    delivered_slots: Estimate | None
    item_transmissions: Estimate | None
    relative_source: Estimate | None
    relative_senders: Estimate | None
    relative_delivered: Estimate | None
    items_in_flight: Estimate | None
    goodput_items_per_slot: Estimate | None
    offered_items_per_slot: Estimate | None
    refused_fraction: Estimate | None
    censored_delivered: int
    censored_source: int
    censored_senders: int
    false_beliefs: int
    slots_played: int
    cpu_s: float

    def as_json(self) -> dict[str, Any]:
        """The row as plain values; a relative value is one number, its interval stands beside it."""
        values = asdict(self)
        for name in ("relative_source", "relative_senders", "relative_delivered"):
            estimate: Estimate | None = getattr(self, name)
            values[name] = estimate and estimate.mean
            values[f"{name}_ci95"] = estimate and [estimate.ci95_low, estimate.ci95_high]
        return values


def run(
    study: ExchangeStudy,
    jobs: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
    say: Callable[[str], None] = lambda text: None,
) -> list[StudyRow]:
    """Run a study: a row for every loss rate and policy, in the order given.

    Args:
        jobs: threads; the numbers do not depend on it.
        progress: is told how many parts of how many are done.
        say: is told before the machine code is made, which takes some seconds and happens once.

    Raises:
        ConfigurationError: `jobs` is not positive.
    """
    if jobs < 1:
        raise ConfigurationError(f"jobs is {jobs}: at least 1 is needed")
    from exchange.study.compiler import compiled

    policies = [policy_named(name) for name in study.policies]
    plan = Plan(
        study.nodes,
        (BASELINE, *(policy for policy in policies if policy != BASELINE)),
        study.carrier_evidence,
        p_loss_matrices(study),
        load_of(study),
        study.seed,
        study.trials,
    )
    tallies = play_all(plan, compiled(plan.n_words == 1, say), jobs, progress)
    return [
        _row(study, per, policy, tallies_of_per[plan.policies.index(policy)])
        for per, tallies_of_per in zip(study.per or (_mean_link(plan.matrices[0]),), tallies, strict=True)
        for policy in policies
    ]


def paper_studies(trials: int = 2000, seed: int = 1) -> list[ExchangeStudy]:
    """The studies behind figures 3 and 4 (five nodes) and figure 5 (ten nodes)."""
    return [ExchangeStudy(nodes=nodes, per=PAPER_PER, trials=trials, seed=seed) for nodes in (5, 10)]


def loaded_studies(nodes: int = 5, per: float = 0.3, trials: int = 100, seed: int = 1) -> list[ExchangeStudy]:
    """The loaded case: one study for every rate at which items are generated."""
    return [
        ExchangeStudy(
            nodes=nodes,
            per=(per,),
            trials=trials,
            load=Workload(LoadKind.POISSON, rate=rate),
            capacity_bits=LOADED_CAPACITY_BITS,
            seed=seed,
        )
        for rate in LOADED_RATES
    ]


def load_of(study: ExchangeStudy) -> trial.Load:
    """The load as the slot loop takes it."""
    n_sources = 1 if study.load.kind is LoadKind.SINGLE else study.nodes
    columns = study.load.items
    window_start = window_end = 0
    if study.load.kind is LoadKind.POISSON:
        columns = study.queue_items
        window_start = study.warmup_frames * study.nodes
        window_end = window_start + study.window_frames * study.nodes
    capacity_bits = trial.NEVER if study.capacity_bits is None else study.capacity_bits
    return trial.Load(
        n_sources, columns, study.load.rate, study.item_bits, capacity_bits, window_start, window_end, study.max_slots
    )


def p_loss_matrices(study: ExchangeStudy) -> tuple[Floats, ...]:
    """The loss probability of every link, from row to column, for each setting; a node never hears itself."""
    if study.links is not None:
        matrices = [np.array(study.links, np.float64)]
    else:
        matrices = [np.full((study.nodes, study.nodes), p_loss) for p_loss in study.per]
    for matrix in matrices:
        np.fill_diagonal(matrix, 1.0)
    return tuple(matrices)


def _mean_link(matrix: Floats) -> float:
    """Mean of the loss probabilities of the links."""
    n_nodes = len(matrix)
    return float((matrix.sum() - n_nodes) / (n_nodes * (n_nodes - 1)))


def _row(study: ExchangeStudy, per: float, policy: AckPolicy, tally: Tally) -> StudyRow:
    means = [estimates.mean(products) for products in tally.moments]
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
    )
