"""Slot lists that a person orders: one vehicle tells the fleet who sends in which slots from now on.

What comes of it is decided by every vehicle for itself, from what it has heard; see ``exchange.turns``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from exchange.turns import SENDS_IN
from remoras.beliefs import Beliefs, Fact
from remoras.events import Host, Part, Says, say_at

__all__ = ["SENDS_IN", "NewSlots", "slots_part"]


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


def slots_part(lists: Iterable[NewSlots]) -> Part:
    """What lets vehicles say slot lists at their times."""

    def begin(host: Host) -> None:
        for one in lists:
            say_at(host, one.at_s, Says(one.issuer, one.facts, ("slots not said", "their speaker is away")))

    return Part(begin)
