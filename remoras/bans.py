"""Bans that a person orders: one vehicle tells the fleet not to believe another, and may take that back.

What comes of it is decided by every vehicle for itself, from what it has heard; see ``worldmodel.bans``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from remoras.beliefs import Beliefs, Fact
from remoras.events import Host, Part, Says, say_at
from worldmodel.bans import BANNED_FROM

__all__ = ["BANNED_FROM", "Ban", "bans_part", "word"]


@dataclass(frozen=True, slots=True)
class Ban:
    """A ban as a scenario declares it.

    Attributes:
        issuer: vehicle that says so; vehicle: whose observations do not count.
        at_s: when it is said.
        from_s: from which time on observations do not count.
        until_s: when it is taken back, infinite for never.
    """

    issuer: str
    vehicle: str
    at_s: float
    from_s: float = 0.0
    until_s: float = math.inf


def word(beliefs: Beliefs, vehicle: str, from_s: float | None) -> Fact:
    """The fact that nobody is to believe what ``vehicle`` observed from a time on (s); None takes the ban back.

    Args:
        beliefs: of whoever says so, for names.
        vehicle: its name.
        from_s: from which time on.
    """
    attribute = beliefs.model.tbox.attribute_named(BANNED_FROM)
    return beliefs.fact(vehicle, BANNED_FROM, attribute.fields[0].maximum if from_s is None else from_s)


def bans_part(bans: Iterable[Ban]) -> Part:
    """What lets vehicles say bans, and take them back, at their times."""

    def begin(host: Host) -> None:
        for ban in bans:
            for at_s, from_s in ((ban.at_s, ban.from_s), (ban.until_s, None)):
                said = _said(ban.vehicle, from_s)
                say_at(host, at_s, Says(ban.issuer, said, ("ban not said", ban.vehicle)))

    return Part(begin)


def _said(vehicle: str, from_s: float | None) -> Callable[[Beliefs], list[Fact]]:
    return lambda beliefs: [word(beliefs, vehicle, from_s)]
