"""Loss probability of a packet on a link; ``loss`` draws the outcome."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from exchange.channel import loss


class Transmission(NamedTuple):
    """Transmission of one packet; ``positions_m`` of all nodes at ``start_s`` (s of the run) is empty if unknown."""

    slot: int
    sender: int
    start_s: float
    size_bits: int
    positions_m: Sequence[tuple[float, float]] = ()


class LinkModel(Protocol):
    """Links of one run; answers depend on the arguments only, not on earlier queries."""

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the probability (0 to 1) that ``receiver`` at ``range_m`` loses a packet."""


@dataclass(frozen=True, slots=True)
class Bernoulli:
    """Independent losses with one probability ``per`` on all links."""

    per: float

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return ``per``."""
        return self.per


@dataclass(frozen=True, slots=True)
class Matrix:
    """Independent losses per directed link (sender, receiver); ``per`` if not listed."""

    per: float
    per_of: Mapping[tuple[int, int], float]

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the rate of the link."""
        return self.per_of.get((packet.sender, receiver), self.per)


@dataclass(frozen=True, slots=True)
class GilbertElliott:
    """Burst losses: every directed link is in a good or bad state (Gilbert 1960; Elliott 1963).

    The states of a link are a stationary Markov chain over all slots, owned by the sender or not. A keyed uniform
    number u per slot moves the link to bad if u < p_good_to_bad, to good if u >= 1 - p_bad_to_good, from either state;
    else the state stays (the coupling of Propp and Wilson 1996). The state is thus a pure function of (seed, trial,
    slot, sender, receiver). Runs of one seed are paired: a higher p_good_to_bad or loss rate, or a lower p_bad_to_good,
    loses a superset of packets (if per_good <= per_bad).

    The probabilities ``p_good_to_bad`` and ``p_bad_to_good`` are per slot, their sum above 0 and at most 1.
    """

    p_good_to_bad: float
    p_bad_to_good: float
    per_good: float
    per_bad: float
    seed: int
    trial: int = 0
    _known: dict[tuple[int, int], tuple[int, bool]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not 0.0 < self.p_good_to_bad + self.p_bad_to_good <= 1.0:
            raise ValueError(f"p_good_to_bad + p_bad_to_good must be above 0 and at most 1: {self}")

    @property
    def bad_share(self) -> float:
        """Stationary probability of the bad state."""
        return self.p_good_to_bad / (self.p_good_to_bad + self.p_bad_to_good)

    @property
    def mean_per(self) -> float:
        """Stationary loss probability."""
        return self.per_good + self.bad_share * (self.per_bad - self.per_good)

    def is_bad(self, slot: int, sender: int, receiver: int) -> bool:
        """True if a link is in the bad state in a slot."""
        key = loss.state_key(self.seed, self.trial)
        # The cached state bounds the look-back: in slot order, at most one draw per elapsed slot.
        known_slot, bad = self._known.get((sender, receiver), (slot + 1, False))
        if known_slot > slot:
            # The chain starts in its stationary distribution, so that early slots lose as much as later ones.
            known_slot, bad = -1, loss.link_uniform(loss.slot_key(key, -1), sender, receiver) < self.bad_share
        # Backwards to the last decisive number: earlier ones have no effect on the state.
        for earlier in range(slot, known_slot, -1):
            number = loss.link_uniform(loss.slot_key(key, earlier), sender, receiver)
            if number < self.p_good_to_bad or number >= 1.0 - self.p_bad_to_good:
                bad = number < self.p_good_to_bad
                break
        self._known[sender, receiver] = slot, bad
        return bad

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the loss rate of the link's state."""
        return self.per_bad if self.is_bad(packet.slot, packet.sender, receiver) else self.per_good
