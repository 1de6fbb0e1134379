"""Policy study: time of delivery and of acknowledgement by policy and loss rate.

Reproduces figures 3 to 5 of Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world
information", and adds cases of its future work: items at every node, and items that arrive during the exchange. All
policies and loss rates use the same random numbers, so that differences are paired.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from exchange.errors import ConfigurationError
from exchange.policy.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, header_bits
from exchange.study import compiler, estimates, lanes
from exchange.study.estimates import TrialMean
from exchange.study.parameters import ExchangeStudy, LoadKind, StudyLoad
from exchange.study.parts import Tally, play_all


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
    means: list[TrialMean | None] = [estimates.mean(products) for products in tally.moments]
    means += [None] * (lanes.N_QUANTITIES - len(means))
    relative = [estimates.relative_mean(products) for products in tally.moments[: lanes.N_STAGES]]
    totals = tally.totals.tolist()
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
        censored_delivered=totals[lanes.DELIVERED][lanes.CENSORED],
        censored_source=totals[lanes.SOURCE_ACKED][lanes.CENSORED],
        censored_senders=totals[lanes.SENDERS_ACKED][lanes.CENSORED],
        false_beliefs=totals[lanes.FALSE_BELIEFS][lanes.SUM],
        slots_played=totals[lanes.SLOTS][lanes.SUM],
        cpu_s=tally.cpu_s,
    )


BASELINE = POLICIES["ack"]

KINDS = tuple(kind.name for kind in ACKNOWLEDGEMENTS)
"""Names of the shipped acknowledgements in display order, as in `StudyRow.acknowledgement`."""

LOADED_RATES = (0.005, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.18, 0.22, 0.26, 0.32)
"""Items per node and slot in the loaded case, from nearly idle to overload of every policy."""

LOADED_CAPACITY_BITS = 256


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
    tallies = play_all(study, loops, 1 if compiler.why_uncompiled() else jobs, progress)
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
