"""Needs as facts: what a vehicle needs of the others, told by itself.

A need is an instance of ``InformationNeed``. Every vehicle has names for a few of its own; what it states about one of
them goes to all, since everybody needs the needs of others (steps 1 and 2 of the cooperation paper, section IV). Needs
that are agreed before the mission need not be told. One of priority 0 is taken back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from remoras.beliefs import Beliefs
from remoras.beliefs import Fact as OfInstance
from remoras.events import Host, Part, Says, say_at
from remoras.sensor import Fact
from worldmodel import InformationNeed

NEED = "InformationNeed"
"""Class of the ontology that needs are of."""
NEEDED_BY, ATTRIBUTE, OF_CLASS, OF_INSTANCE = "neededBy", "neededAttribute", "neededOfClass", "neededOfInstance"
PRIORITY, TIME_TO_LIVE, BLACKOUT = "needPriority", "needTimeToLive", "needBlackout"
QUEUE_LIMIT, NEWEST_FIRST, ACKNOWLEDGED = "needQueueLimit", "needNewestFirst", "needAcknowledged"
NEED_ATTRIBUTES = (
    NEEDED_BY, ATTRIBUTE, OF_CLASS, OF_INSTANCE, PRIORITY, TIME_TO_LIVE, BLACKOUT, QUEUE_LIMIT, NEWEST_FIRST,
    ACKNOWLEDGED,
)  # fmt: skip
"""Attributes of needs."""


def need_name(vehicle: str, number: int) -> str:
    """Name of the instance that is the need of a vehicle with that number, from 1.

    >>> need_name("AUV01", 2)
    'need 2 of AUV01'
    """
    return f"need {number} of {vehicle}"


@dataclass(frozen=True, slots=True)
class StatedNeed:
    """A need of one vehicle.

    Attributes:
        vehicle: that has it; number: of its needs, from 1.
        need: what it needs.
        from_s: when it says so, 0 if that is agreed before the mission.
        until_s: when it takes the need back, infinite for never.
    """

    vehicle: str
    number: int
    need: InformationNeed
    from_s: float = 0.0
    until_s: float = math.inf

    def facts(self) -> tuple[Fact, ...]:
        """What the vehicle says of it, by names: for ``Observation.facts`` of a sensor, say."""
        name, need, terms = need_name(self.vehicle, self.number), self.need, self.need.terms
        of = (OF_INSTANCE, need.instance) if need.instance is not None else (OF_CLASS, need.class_uid)
        said: list[Fact] = [
            (name, NEEDED_BY, self.vehicle),
            (name, ATTRIBUTE, float(need.attribute)),
            (name, of[0], float(of[1] or 0)),
            (name, PRIORITY, float(need.priority)),
        ]
        if math.isfinite(terms.time_to_live_s):
            said.append((name, TIME_TO_LIVE, terms.time_to_live_s))
        if terms.blackout_s:
            said.append((name, BLACKOUT, terms.blackout_s))
        if terms.queue_limit is not None:
            said.append((name, QUEUE_LIMIT, float(terms.queue_limit)))
        if terms.newest_first:
            said.append((name, NEWEST_FIRST, True))
        if not terms.acknowledged:
            said.append((name, ACKNOWLEDGED, False))
        return tuple(said)

    def taken_back(self) -> tuple[Fact, ...]:
        """What the vehicle says when it needs that no more."""
        return ((need_name(self.vehicle, self.number), PRIORITY, 0.0),)


def needs_part(needs: Iterable[StatedNeed]) -> Part:
    """What lets vehicles state needs, and take them back, at their times; one of the beginning is agreed."""

    def begin(host: Host) -> None:
        for need in needs:
            if need.from_s > 0.0:
                say_at(host, need.from_s, Says(need.vehicle, _named(need.facts())))
            say_at(host, need.until_s, Says(need.vehicle, _named(need.taken_back())))

    return Part(begin)


def _named(facts: Iterable[Fact]) -> Callable[[Beliefs], list[OfInstance]]:
    return lambda beliefs: [beliefs.fact(*fact) for fact in facts]
