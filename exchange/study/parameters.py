"""Parameters of a policy study: fleet, loss rates, policies, load; validated on creation."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from exchange.errors import ConfigurationError
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import ACK, PAPER_POLICIES, POLICIES, AckPolicy, checked_policy, header_bits, policy_named

MAX_NODES = 64
MAX_SEED = 1 << 62
"""Exclusive upper bound of seeds."""


def no_bits(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """Header without bits."""
    return False


BOUND = AckPolicy(
    Acknowledgement("bound", "receivers take the items they lack; knowledge is free", no_bits, ACK.header),
    repeat=False,
)
"""Placeholder policy of the bound (`exchange.study.trials.pass_freely`), not for vehicles."""


class LoadKind(StrEnum):
    """Kind of load."""

    SINGLE = "single"
    BATCH = "batch"
    POISSON = "poisson"


@dataclass(frozen=True, slots=True)
class StudyLoad:
    """One item at node 0; or ``items`` per node at slot 0; or ``rate`` per node and slot."""

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


def workload_named(text: str, items: int = 1) -> StudyLoad:
    """Parse a load: `single`, `batch` or `poisson:0.02`.

    >>> str(workload_named("poisson:0.02"))
    'poisson:0.02'
    """
    name, colon, rate = text.partition(":")
    try:
        if name == LoadKind.POISSON and colon:
            return StudyLoad(LoadKind.POISSON, items, float(rate))
        if not colon:
            return StudyLoad(LoadKind(name), items)
    except ValueError:
        pass
    raise ConfigurationError(f"unknown load {text!r}: allowed are single, batch and poisson:RATE, as in poisson:0.02")


@dataclass(frozen=True)
class ExchangeStudy:
    """Complete parameters of a study, which determine its numbers.

    Attributes:
        per: loss probabilities, each equal on all links.
        policies: shipped names, by default those of the paper, or own policies; names must differ.
        trials: per policy and loss rate.
        capacity_bits: packet size, header included; None for no limit.
        carrier_evidence: a sender of an item counts as its holder, unlike in the paper.
        bound: add a bound with free knowledge as policy `bound`, see `exchange.study.trials`.
        max_slots: limit of a trial; unfinished ones are reported as censored.
        queue_items: Poisson load: own items that a node queues; more are refused.
        warmup_frames: Poisson load: frames before the window; longer than the latencies, which are thousands of slots
            under saturation and high loss.
        window_frames: Poisson load: frames in which items and slots count.
    """

    nodes: int = 5
    per: tuple[float, ...] = (0.5,)
    policies: tuple[str | AckPolicy, ...] = tuple(PAPER_POLICIES)
    trials: int = 2000
    load: StudyLoad = StudyLoad()
    item_bits: int = 60
    capacity_bits: int | None = None
    carrier_evidence: bool = False
    seed: int = 1
    max_slots: int = 200_000
    queue_items: int = 32
    warmup_frames: int = 200
    window_frames: int = 200
    bound: bool = False

    def __post_init__(self) -> None:
        faults = list(self._faults())
        if faults:
            raise ConfigurationError("; ".join(dict.fromkeys(faults)))

    def _faults(self) -> Iterator[str]:
        if not 2 <= self.nodes <= MAX_NODES:
            yield f"nodes is {self.nodes}: allowed are 2 to {MAX_NODES}"
        if not 0 <= self.seed < MAX_SEED:
            yield f"seed is {self.seed}: allowed are 0 to {MAX_SEED - 1}"
        for name in ("trials", "item_bits", "max_slots", "queue_items", "window_frames"):
            if getattr(self, name) < 1:
                yield f"{name} is {getattr(self, name)}: at least 1 is needed"
        if self.warmup_frames < 0:
            yield f"warmup_frames is {self.warmup_frames}: it cannot be negative"
        if (
            self.load.kind is LoadKind.POISSON
            and self.max_slots <= (self.warmup_frames + self.window_frames) * self.nodes
        ):
            yield f"max_slots is {self.max_slots}: it must exceed the slots of warm-up and window"
        yield from self._loss_faults()
        yield from self._policy_faults()

    def _loss_faults(self) -> Iterator[str]:
        if not self.per:
            yield "per is empty: at least one loss probability is needed"
        for p_loss in self.per:
            if p_loss == 1.0:
                yield "per is 1: every packet is lost and the exchange never ends; it must be from 0 to below 1"
            elif not 0.0 <= p_loss < 1.0:
                yield f"per is {p_loss:g}: a loss probability must be from 0 to below 1"

    @property
    def chosen(self) -> tuple[AckPolicy, ...]:
        """Policies as values, the bound last if requested."""
        policies = [policy_named(policy) if isinstance(policy, str) else policy for policy in self.policies]
        return (*policies, BOUND) if self.bound else tuple(policies)

    def _policy_faults(self) -> Iterator[str]:
        if not self.policies:
            yield f"policies is empty: allowed are {', '.join(POLICIES)} and AckPolicy values"
        names: dict[str, AckPolicy] = {BOUND.name: BOUND}
        for asked in self.policies:
            try:
                policy = policy_named(asked) if isinstance(asked, str) else checked_policy(asked, str(asked))
            except ConfigurationError as fault:
                yield str(fault)
                continue
            if names.setdefault(policy.name, policy) != policy:
                yield f"two policies have the name {policy.name}: give the acknowledgement of one another name"
            if self.capacity_bits is None or not 2 <= self.nodes <= MAX_NODES:
                continue
            least = header_bits(policy, self.nodes) + self.item_bits
            if self.capacity_bits < least:
                yield (
                    f"capacity_bits is {self.capacity_bits}: with {self.nodes} nodes policy {policy.name} "
                    f"needs {least}, {least - self.item_bits} for its header and {self.item_bits} for one item"
                )
