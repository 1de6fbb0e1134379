"""Fixed partition: everything is planned before the dive, nobody says a word. The floor of a comparison.

Each vehicle surveys the areas it was given and goes to the rally point. The head leaves it for the next rendezvous at
a time agreed before: when the last one is expected to have come, and ``margin`` of that time later. What happens
otherwise than planned, nobody learns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.allocation import Outlook, at_work, nearest_first, surveyors
from remoras.strategies.founding import founded
from remoras.strategies.remoras import all_areas
from remoras.strategy import Declaration, Evidence, Move, Situation, Statement


class Timetable:
    """The head's clock: when the group is taken for gathered."""

    def __init__(self, me: str, group: Group, margin: float) -> None:
        self._me = me
        self._group = group
        self._margin = margin
        self._meeting_s: float | None = None
        self._met = False

    def negotiate(self, situation: Situation) -> Move:
        if self._meeting_s is None:
            self._meeting_s = self._expected_s(situation)
        group, organisation = self._group, situation.organisation
        if situation.now_s < self._meeting_s or at_work(self._me, group, organisation, situation.evidence):
            return Move(holding=True)
        if self._met or group.rally_point is None or self._me not in organisation.heads(group.name):
            return Move()
        self._met = True
        return Move((Statement(((group.name, "gatheredAt", group.rally_point),), told=False),))

    def _expected_s(self, situation: Situation) -> float:
        """When the last one is expected at the rally point, and the margin later."""
        database = situation.evidence.database
        at_start = Evidence(database, {}, situation.evidence.corners_m, frozenset())
        last_s = 0.0
        for data in surveyors(self._group, situation.organisation, database):
            roles = at_work(data.name, self._group, situation.organisation, at_start)
            areas = [at_start.corners_m[role.area or ""] for role in roles]
            outlook = nearest_first(Outlook(0.0, data.start_m), data, areas)
            way_m = 0.0 if situation.rally_m is None else math.dist(outlook.position_m, situation.rally_m)
            last_s = max(last_s, outlook.free_s + way_m / data.transit_speed_mps)
        return (1.0 + self._margin) * last_s


@dataclass(frozen=True, slots=True)
class FixedPartition:
    """No communication; see the module's text."""

    margin: Annotated[
        float, Field(ge=0.0, le=100.0, description="how much later than expected the head leaves, as a share")
    ] = 0.15

    name: ClassVar[str] = "fixed-partition"
    declaration: ClassVar[Declaration] = Declaration(
        source="the floor that any communication has to beat", messages={}, communicates=False
    )

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        return founded(database, groups)

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        return all_areas(group, organisation, evidence)

    def negotiator(self, me: str, group: Group) -> Timetable | None:
        return Timetable(me, group, self.margin)


STRATEGY = FixedPartition()
