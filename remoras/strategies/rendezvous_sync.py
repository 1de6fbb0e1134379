"""Rendezvous synchronisation: work is divided only when all have met.

Before the dive every member gets up to ``areas_per_leg`` areas. Whoever has done its areas goes to the rally point.
When the head, free itself, knows all members there, it gives out the next areas; each leaves for its own as soon as it
has heard of them. Between two meetings nothing needs to be heard, so losses can only prolong a meeting. When all who
are missing are overdue, they are waited for another ``wait_rounds``; then what they held is given out again.

Source: rendezvous point synchronisation as cited by Carlesi et al. 2011, section II.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.allocation import Expectations, Outlook, at_work, open_roles, shared_out, surveyors
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import Declaration, Evidence, Move, Situation, Statement


class Convener:
    """The head's part: who is here, and what is left to do; other members just come."""

    def __init__(self, me: str, group: Group, strategy: RendezvousSync) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._waiting_since: int | None = None
        self._expectations = Expectations()

    def negotiate(self, situation: Situation) -> Move:
        group, organisation, evidence = self._group, situation.organisation, situation.evidence
        if self._me not in organisation.heads(group.name):
            return Move()
        unfinished = open_roles(group, evidence)
        members = surveyors(group, organisation, evidence.database)
        held = {data.name: at_work(data.name, group, organisation, evidence) for data in members}
        absent = [name for name in held if held[name] or not self._is_here(name, situation)]
        expected_s = {d.name: self._expectations.of(d, held[d.name], situation.now_s, evidence).free_s for d in members}
        on_the_way = self._me in absent or any(expected_s[name] > situation.now_s for name in absent)
        if not unfinished or on_the_way or len(absent) == len(members):
            self._waiting_since = None
            return Move(holding=bool(unfinished))
        if self._waiting_since is None:
            self._waiting_since = situation.round
        if absent and situation.round - self._waiting_since < self._with.wait_rounds:
            return Move(holding=True)
        self._waiting_since = None
        taken_back = [(name, role) for name in absent for role in held[name]]
        said = [(name, "leftRole", group.path(role.name)) for name, role in taken_back]
        lost = [role for _, role in taken_back]
        vacant = [r for r in unfinished if r in lost or not organisation.members(group.name, r.name)]
        present = [data for data in members if data.name not in absent]
        outlooks = {data.name: Outlook(situation.now_s, evidence.position_m(data.name)) for data in present}
        given = shared_out(group, vacant, present, outlooks, evidence, self._with.areas_per_leg)
        said += [(one.vehicle, "playsRole", group.path(one.role)) for one in given]
        return Move(tuple(Statement((fact,)) for fact in said), holding=True)

    def _is_here(self, vehicle: str, situation: Situation) -> bool:
        position_m = situation.evidence.positions_m.get(vehicle)
        if position_m is None or situation.rally_m is None:
            return False
        return math.dist(position_m, situation.rally_m) <= self._with.meeting_radius_m


@dataclass(frozen=True, slots=True)
class RendezvousSync:
    """Meetings; see the module's text."""

    areas_per_leg: Annotated[int, Field(ge=1, le=64, description="most areas for a vehicle between two meetings")] = 2
    meeting_radius_m: Annotated[
        float, Field(gt=0.0, le=10_000.0, description="a vehicle this near to the rally point has come")
    ] = 30.0
    wait_rounds: Annotated[
        int,
        Field(ge=1, le=100_000, description="TDMA frames that those who have come wait for others that are overdue"),
    ] = 60

    name: ClassVar[str] = "rendezvous-sync"
    declaration: ClassVar[Declaration] = Declaration(
        source="rendezvous point synchronisation, cited by Carlesi et al. 2011",
        messages={
            "playsRole": "the head gives a member an area, at a meeting",
            "leftRole": "the head takes back what a member held that did not come",
            "areaDone": "a vehicle has finished an area",
        },
    )

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        return founded(database, groups)

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        common = common_roles(group, organisation, evidence)
        if any(organisation.members(group.name, role.name) for role in group.roles if role.area is not None):
            return common  # planned anew during the mission: areas are given out at meetings only
        members = surveyors(group, organisation, evidence.database)
        outlooks = {data.name: Outlook(0.0, evidence.position_m(data.name)) for data in members}
        return common + shared_out(group, open_roles(group, evidence), members, outlooks, evidence, self.areas_per_leg)

    def negotiator(self, me: str, group: Group) -> Convener:
        return Convener(me, group, self)


STRATEGY = RendezvousSync()
