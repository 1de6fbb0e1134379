"""Central assignment: the head gives members areas one by one, as they finish.

A member holds at most ``queue`` areas. Whenever it finishes one, which it tells, the head gives it another, so that the
next areas are finished as early as possible. Assignments and results are facts: they are acknowledged, and repeated
until they are. A member that has not been heard for ``silence_rounds`` TDMA frames, or is heard but has not
acknowledged an area for ``acknowledge_rounds``, is taken to be out of reach: what it held goes to others. If the head
falls silent, members finish what they hold and wait.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.allocation import Expectations, at_work, open_roles, shared_out, surveyors
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.silence import QUEUE, SILENCE, Silence
from remoras.strategy import Declaration, Evidence, Move, Situation, Statement


class Dispatcher:
    """The head's part; other members have nothing to decide."""

    def __init__(self, me: str, group: Group, strategy: Central) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._silence = Silence(me, strategy.silence_rounds)
        self._unheard_since: dict[tuple[str, str], int] = {}  # round, by (vehicle, role)
        self._expectations = Expectations()

    def negotiate(self, situation: Situation) -> Move:
        group, organisation, evidence = self._group, situation.organisation, situation.evidence
        if self._me not in organisation.heads(group.name):
            return Move()
        unfinished = open_roles(group, evidence)
        members = surveyors(group, organisation, evidence.database)
        silent = self._silence.out_of_reach([data.name for data in members], situation) | self._deaf(situation)
        held = {data.name: at_work(data.name, group, organisation, evidence) for data in members}
        taken_back = [(name, role) for name in sorted(silent & held.keys()) for role in held[name]]
        said = [(name, "leftRole", group.path(role.name)) for name, role in taken_back]
        vacant = [role for role in unfinished if not organisation.members(group.name, role.name)]
        outlooks = {
            data.name: self._expectations.of(data, held[data.name], situation.now_s, evidence) for data in members
        }
        for _ in range(self._with.queue):
            free = [data for data in members if data.name not in silent and len(held[data.name]) < self._with.queue]
            given = shared_out(group, vacant, free, outlooks, evidence, 1)
            for one in given:
                role = next(role for role in vacant if role.name == one.role)
                vacant.remove(role)
                held[one.vehicle].append(role)
                data = evidence.database[one.vehicle]
                outlooks[one.vehicle] = self._expectations.of(data, held[one.vehicle], situation.now_s, evidence)
            said += [(one.vehicle, "playsRole", group.path(one.role)) for one in given]
        return Move(tuple(Statement((fact,)) for fact in said), holding=bool(unfinished))

    def _deaf(self, situation: Situation) -> set[str]:
        """Members that do not acknowledge what they are given."""
        unheard = [(name, role) for name, roles in situation.unheard.items() for role in sorted(roles)]
        self._unheard_since = {key: self._unheard_since.get(key, situation.round) for key in unheard}
        return {
            name
            for (name, _), since in self._unheard_since.items()
            if situation.round - since >= self._with.acknowledge_rounds
        }


@dataclass(frozen=True, slots=True)
class Central:
    """A leader that assigns and is told; see the module's text."""

    queue: Annotated[int, QUEUE] = 2
    silence_rounds: Annotated[int, SILENCE] = 60
    acknowledge_rounds: Annotated[
        int, Field(ge=1, le=10_000, description="TDMA frames that a member may take to acknowledge an area")
    ] = 300

    name: ClassVar[str] = "central"
    declaration: ClassVar[Declaration] = Declaration(
        source="leader-follower assignment, as in most fleets today",
        messages={
            "playsRole": "the head gives a member an area",
            "leftRole": "the head takes an area back",
            "areaDone": "a vehicle has finished an area",
        },
    )

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        return founded(database, groups)

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        return common_roles(group, organisation, evidence)

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        return Dispatcher(me, group, self)


STRATEGY = Central()
