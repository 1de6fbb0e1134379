"""Probability that a packet is lost on a link. The draw itself is made in ``loss``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


class LinkModel(Protocol):
    """Loss probability of one packet on one link."""

    def p_loss(self, slot: int, sender: int, receiver: int, range_m: float) -> float:
        """Probability in [0, 1] that ``receiver`` loses the packet that ``sender`` sends in ``slot``."""
        ...


@dataclass(frozen=True, slots=True)
class Perfect:
    """Every packet arrives: the bound from above."""

    def p_loss(self, slot: int, sender: int, receiver: int, range_m: float) -> float:
        return 0.0


@dataclass(frozen=True, slots=True)
class Bernoulli:
    """Every receiver loses every packet with the same probability ``per``, independently."""

    per: float

    def p_loss(self, slot: int, sender: int, receiver: int, range_m: float) -> float:
        return self.per


LINKS = {
    "perfect": "every packet arrives",
    "bernoulli": "every receiver loses every packet with probability per, independently",
}
"""Loss models that a scenario can name, and what they do."""


def link_named(name: str, per: float) -> LinkModel:
    """The loss model of a scenario; ``name`` is a key of ``LINKS``."""
    return Perfect() if name == "perfect" else Bernoulli(per)
