"""What a policy study answers: a row for every policy and loss rate."""

from dataclasses import asdict, dataclass
from typing import Any

from exchange.policies import AckPolicy, header_bits
from exchange.study import estimates, trial
from exchange.study.estimates import TrialMean
from exchange.study.parameters import ExchangeStudy, LoadKind
from exchange.study.parts import Tally

NO_COLUMNS = ("acknowledgement", "repeats")
"""Fields of a row that tables leave out."""


@dataclass(frozen=True, slots=True)
class StudyRow:
    """Results of one policy at one loss rate; times in slots, from slot 0 or from an item's generation.

    Relative values are those of the policy over those of `ack`. An estimate is None where no trial counts: because all
    are censored, or because the quantity belongs to Poisson load. With `links`, `per` is the mean over the links.
    `acknowledgement` and `repeats` say what the policy is made of, for figures; they are no columns of tables.
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
        """The row as plain values; a relative value is one number, its interval stands beside it."""
        values = asdict(self)
        for name in NO_COLUMNS:
            del values[name]
        for name in ("relative_source", "relative_senders", "relative_delivered"):
            estimate: TrialMean | None = getattr(self, name)
            values[name] = estimate and estimate.mean
            values[f"{name}_ci95"] = estimate and [estimate.ci95_low, estimate.ci95_high]
        return values


def row_of(study: ExchangeStudy, per: float, policy: AckPolicy, tally: Tally) -> StudyRow:
    """The row of one policy at one loss rate."""
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
