"""Slot lists that a person orders: one vehicle tells the fleet who sends in which slots from now on.

What comes of it is decided by every vehicle for itself, from what it has heard; see ``exchange.peering.turns``.
"""

from __future__ import annotations

from dataclasses import dataclass

from exchange.peering.turns import SENDS_IN
from remoras.beliefs import Beliefs, Fact

__all__ = ["SENDS_IN", "NewSlots"]


@dataclass(frozen=True, slots=True)
class NewSlots:
    """A slot list as a scenario declares it.

    Attributes:
        issuer: vehicle that says so.
        at_s: when it is said.
        masks: of each vehicle by its name: bit p for slot p of the frame.
    """

    issuer: str
    at_s: float
    masks: tuple[tuple[str, int], ...]

    def facts(self, beliefs: Beliefs) -> list[Fact]:
        """The list as facts, one for each vehicle; ``beliefs`` of the issuer have the names."""
        return [beliefs.fact(vehicle, SENDS_IN, mask) for vehicle, mask in self.masks]
