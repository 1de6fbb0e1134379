"""Probability that a packet is lost on a link. The draw itself is made in ``loss``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from exchange.acoustics import loss


class Transmission(NamedTuple):
    """What a sender sends once, as a model of losses sees it.

    Attributes:
        slot: TDMA slot, counted from 0.
        sender: node that owns the slot.
        start_s: time at which the packet starts, from the start of the run.
        size_bits: of the packet.
        positions_m: (x east, y north) of every node when it starts; empty where nobody says.
    """

    slot: int
    sender: int
    start_s: float
    size_bits: int
    positions_m: Sequence[tuple[float, float]] = ()


class LinkModel(Protocol):
    """The links of one run: how likely a packet is lost on each.

    ``exchange.acoustics.channel.BroadcastChannel`` asks once for each packet and receiver within range, and compares
    the answer with a uniform number of its own. The answer depends on the arguments alone, not on earlier questions.
    """

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Probability that ``receiver`` loses a packet.

        Args:
            packet: what is sent, when and by whom.
            receiver: another node than its sender.
            range_m: distance between them when it starts, in metres; in depth too if the model of the channel says so.

        Returns:
            A number from 0 to 1.
        """
        ...


@dataclass(frozen=True, slots=True)
class Perfect:
    """Every packet arrives: the bound from above."""

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """No packet is lost."""
        return 0.0


@dataclass(frozen=True, slots=True)
class Bernoulli:
    """Every receiver loses every packet with the same probability ``per``, independently."""

    per: float

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """The same for every packet."""
        return self.per


@dataclass(frozen=True, slots=True)
class Matrix:
    """Every directed link loses packets with a probability of its own, independently.

    Args:
        per: loss probability of the links that are not listed.
        per_of: loss probability by (sender, receiver).
    """

    per: float
    per_of: Mapping[tuple[int, int], float]

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """The rate of the link."""
        return self.per_of.get((packet.sender, receiver), self.per)


@dataclass(frozen=True, slots=True)
class GilbertElliott:
    """Losses in bursts: every directed link is in its good or its bad state (Gilbert 1960; Elliott 1963).

    The states of a link are a stationary Markov chain over all slots, the sender's own or not. They are drawn here, so
    this model, unlike the others, is one realisation and knows its seed. One keyed number u of each slot moves the
    link: to bad if u < p_good_to_bad, to good if u >= 1 - p_bad_to_good, whatever its state was; else the state stays
    (the coupling of Propp and Wilson 1996). So the state follows from the last slot whose number decides; before there
    is one, from the number of slot -1, which is compared with the stationary share. It is a pure function of (seed,
    trial, slot, sender, receiver), whatever has been asked before. Runs of one seed are paired: more ways into the bad
    state, fewer out of it, or more losses in either state lose a superset of packets (if per_good <= per_bad).

    The last state asked for is kept for each link, to look back no farther than to it. Asked in the order of slots, a
    state takes at most one draw (1 us) for each slot that went by, however slow the chain; in another order at most
    slot + 1, and 1 / (p_good_to_bad + p_bad_to_good) on average. This never changes the answer.

    Args:
        p_good_to_bad: probability per slot that a good link turns bad.
        p_bad_to_good: probability per slot that a bad link turns good; the sum of both is above 0 and at most 1.
        per_good: probability that a packet is lost in the good state.
        per_bad: the same in the bad state.
        seed: of the whole study or mission, as ``loss.uniform`` takes it.
        trial: number of the run, or 0.
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
        """Stationary probability that a packet is lost."""
        return self.per_good + self.bad_share * (self.per_bad - self.per_good)

    def is_bad(self, slot: int, sender: int, receiver: int) -> bool:
        """State of a link in a slot, counted from 0."""
        key = loss.state_key(self.seed, self.trial)
        known_slot, bad = self._known.get((sender, receiver), (slot + 1, False))
        if known_slot > slot:
            known_slot, bad = -1, loss.link_uniform(loss.slot_key(key, -1), sender, receiver) < self.bad_share
        for earlier in range(slot, known_slot, -1):
            number = loss.link_uniform(loss.slot_key(key, earlier), sender, receiver)
            if number < self.p_good_to_bad or number >= 1.0 - self.p_bad_to_good:
                bad = number < self.p_good_to_bad
                break
        self._known[sender, receiver] = slot, bad
        return bad

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """The rate of the state that the link is in."""
        return self.per_bad if self.is_bad(packet.slot, packet.sender, receiver) else self.per_good
