"""Status broadcast: everybody tells the state of its mission again and again, and predicts those it does not hear.

Every ``period_rounds`` a vehicle broadcasts which area it is at and which areas it knows to be done; repetition takes
the place of acknowledgement. From what it has heard it predicts when each other vehicle will have done its area and,
by the same rule that it follows itself, which one that vehicle will turn to: of the areas that are left, the one it is
expected to finish first; vehicles choose in the order in which they become free. A vehicle that is free takes what
this prediction leaves to it. A vehicle that has not been heard for ``doubt_rounds`` is doubted: what it should have
finished as long ago, be it at that area or only predicted to be, is done again when nothing else is left. If two are at
the same area, the one that came later leaves it on hearing of the other.

Source: Sotzing, Lane 2010 (DELPHIS: broadcast of the mission state, prediction of silent partners).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import Outlook, after, at_work, open_roles, surveyors
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.silence import Silence
from remoras.strategy import Declaration, Evidence, Fact, Heard, Move, Situation, Statement
from remoras.work import Point

AREAS_PER_BLOCK = 8


@dataclass(frozen=True, slots=True)
class Work:
    """A vehicle at the area of a role, and since when."""

    role: str
    since_s: float
    from_m: Point


class Broadcaster:
    """One vehicle's account of the mission, its own and what it has heard."""

    def __init__(self, me: str, group: Group, strategy: StatusBroadcast) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._work: dict[str, Work] = {}  # last known of every vehicle
        self._done: set[str] = set()  # areas that somebody reported
        self._silence = Silence(me, strategy.doubt_rounds)
        self._silent: set[str] = set()

    def negotiate(self, situation: Situation) -> Move:
        group, organisation, evidence = self._group, situation.organisation, situation.evidence
        for heard in situation.heard:
            self._hear(heard, evidence)
        roles = {r.name: r for r in open_roles(group, evidence) if r.area not in self._done}
        members = surveyors(group, organisation, evidence.database)
        self._silent = self._silence.out_of_reach([data.name for data in members], situation)
        outlooks = {data.name: self._outlook(data, roles, situation) for data in members}
        doubted = {name for name, then in outlooks.items() if self._is_overdue(name, then.free_s, situation)}
        said: list[Statement] = []
        held = [role for role in at_work(self._me, group, organisation, evidence) if role.name in roles]
        for role in at_work(self._me, group, organisation, evidence):
            if role.name not in roles or self._is_later(role.name, doubted, situation):
                said.append(Statement(((self._me, "leftRole", self._group.path(role.name)),), told=False))
                held = [other for other in held if other is not role]
        if not held:
            self._work.pop(self._me, None)
            name = self._choice(roles, members, outlooks, doubted, situation)
            if name is not None:
                self._work[self._me] = Work(name, round(situation.now_s), evidence.position_m(self._me))
                said.append(Statement(((self._me, "playsRole", self._group.path(name)),), told=False))
        if situation.round % self._with.period_rounds == 0 or any(not statement.told for statement in said):
            said += self._state(evidence)
        return Move(tuple(said), holding=bool(roles))

    def _hear(self, heard: Heard, evidence: Evidence) -> None:
        """The state of the mission as a peer tells it."""
        said = {attribute: value for subject, attribute, value in heard.facts if subject == heard.issuer}
        group, _, role = str(said.get("worksOn", "")).partition(".")
        if group == self._group.name:
            known = self._work.get(heard.issuer)
            from_m = evidence.position_m(heard.issuer) if known is None or known.role != role else known.from_m
            self._work[heard.issuer] = Work(role, float(said.get("worksSince", heard.time_s)), from_m)
        self._done.update(subject for subject, attribute, _ in heard.facts if attribute == "knownDone")

    def _is_later(self, role: str, doubted: Collection[str], situation: Situation) -> bool:
        """Was another member, one that is not doubted, at the area of ``role`` before this vehicle?"""
        mine, database = self._work.get(self._me), situation.evidence.database
        return mine is not None and any(
            work.role == role and (work.since_s, database[name].node) < (mine.since_s, database[self._me].node)
            for name, work in self._work.items()
            if name not in doubted and name != self._me and situation.organisation.is_member(name, self._group.name)
        )

    # Prediction ----------------------------------------------------------------------------------

    def _outlook(self, data: VehicleData, roles: Mapping[str, RoleSpecification], situation: Situation) -> Outlook:
        """When and where a vehicle will have done what it was last known to be at; without work it is free, a silent
        one since it was heard."""
        evidence, work = situation.evidence, self._work.get(data.name)
        if work is not None and work.role in roles and data.name != self._me:
            then = after(Outlook(work.since_s, work.from_m), data, self._corners(roles[work.role], evidence))
            if then is not None:
                return then
        free_s = situation.heard_s.get(data.name, 0.0) if data.name in self._silent else situation.now_s
        return Outlook(free_s, evidence.position_m(data.name))

    def _is_overdue(self, vehicle: str, free_s: float, situation: Situation) -> bool:
        """Is a vehicle silent that should have been free long ago?"""
        doubt_s = self._with.doubt_rounds * situation.now_s / situation.round
        return vehicle in self._silent and free_s + doubt_s <= situation.now_s

    def _choice(
        self,
        roles: Mapping[str, RoleSpecification],
        members: Sequence[VehicleData],
        outlooks: Mapping[str, Outlook],
        doubted: Collection[str],
        situation: Situation,
    ) -> str | None:
        """The role that is left to this vehicle when all who become free choose in turn; None if there is none."""
        at = [(work.role, name) for name, work in self._work.items() if name in outlooks]
        taken = {role for role, _ in at}
        free = {name: role for name, role in roles.items() if name not in taken}
        found, predicted = self._in_turn(members, outlooks, free, situation.evidence)
        if found is None:  # nothing is left but what others are at, or should have done by now
            trusted = {role for role, name in at if name not in doubted}
            trusted |= {role for role, (name, s) in predicted.items() if not self._is_overdue(name, s, situation)}
            left = {name: role for name, role in roles.items() if name not in trusted}
            me = [data for data in members if data.name == self._me]
            found, _ = self._in_turn(me, outlooks, left, situation.evidence)
        return found

    def _in_turn(
        self,
        members: Sequence[VehicleData],
        outlooks: Mapping[str, Outlook],
        roles: Mapping[str, RoleSpecification],
        evidence: Evidence,
    ) -> tuple[str | None, dict[str, tuple[str, float]]]:
        """(own choice, what others choose before: by role who, and when it will have done it)."""
        outlook, left = {data.name: outlooks[data.name] for data in members}, dict(roles)
        chosen: dict[str, tuple[str, float]] = {}
        while left and self._me in outlook:
            data = min((d for d in members if d.name in outlook), key=lambda d: (outlook[d.name].free_s, d.node))
            then = [
                (o.free_s, name, o)
                for name, role in left.items()
                if data.can_play(name) and (o := after(outlook[data.name], data, self._corners(role, evidence)))
            ]
            if not then:
                del outlook[data.name]
                continue
            _, name, outlook[data.name] = min(then)
            if data.name == self._me:
                return name, chosen
            chosen[name] = data.name, outlook[data.name].free_s
            del left[name]
        return None, chosen

    @staticmethod
    def _corners(role: RoleSpecification, evidence: Evidence) -> tuple[Point, ...]:
        return evidence.corners_m[role.area or ""]

    # Saying --------------------------------------------------------------------------------------

    def _state(self, evidence: Evidence) -> list[Statement]:
        """The state of the mission as this vehicle knows it."""
        areas = [role.area for role in self._group.roles if role.area is not None]
        facts: list[Fact] = [(area, "knownDone", True) for area in areas if area in evidence.done or area in self._done]
        said = [Statement(tuple(facts[n : n + AREAS_PER_BLOCK])) for n in range(0, len(facts), AREAS_PER_BLOCK)]
        work = self._work.get(self._me)
        if work is not None:
            at, since = (self._me, "worksOn", self._group.path(work.role)), (self._me, "worksSince", work.since_s)
            said.append(Statement((at, since)))
        return said


@dataclass(frozen=True, slots=True)
class StatusBroadcast:
    """Mission states, repeated; see the module's text."""

    period_rounds: Annotated[
        int, Field(ge=1, le=1000, description="TDMA frames between two broadcasts of the state")
    ] = 3
    doubt_rounds: Annotated[
        int, Field(ge=0, le=10_000, description="TDMA frames that a vehicle may be silent, and its area late")
    ] = 30

    name: ClassVar[str] = "status-broadcast"
    declaration: ClassVar[Declaration] = Declaration(
        source="Sotzing, Lane 2010 (DELPHIS)",
        messages={
            "worksOn": "the area that the sender is at; not acknowledged",
            "worksSince": "since when; not acknowledged",
            "knownDone": "an area that the sender knows to be done; not acknowledged",
            "areaDone": "the sender has finished an area",
        },
        blocks_per_round=1,
    )

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        return founded(database, groups)

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        return common_roles(group, organisation, evidence)

    def negotiator(self, me: str, group: Group) -> Broadcaster:
        return Broadcaster(me, group, self)


STRATEGY = StatusBroadcast()
