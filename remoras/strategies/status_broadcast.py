"""Status broadcast: everybody tells the state of its mission again and again, and predicts those it does not hear.

Every ``period_rounds`` a vehicle broadcasts which job it is at and which jobs it knows to be done; repetition takes
the place of acknowledgement. From what it has heard it predicts when each other vehicle will have done its job and,
by the same rule that it follows itself, which one that vehicle will turn to: of the jobs that are left, the one it is
expected to finish first; vehicles choose in the order in which they become free. A vehicle that is free takes what
this prediction leaves to it. A vehicle that has not been heard for ``doubt_rounds`` is doubted: what it should have
finished as long ago, be it at that job or only predicted to be, is done again when nothing else is left. If two are at
the same job, the one that came later leaves it on hearing of the other.

Source: Sotzing, Lane 2010 (DELPHIS: broadcast of the mission state, prediction of silent partners).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.database import VehicleData
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.silence import Silence
from remoras.strategy import JOB_DONE, Declaration, Heard, Move, Situation, Statable, Statement
from remoras.work import Outlook, Point, Work

JOBS_PER_BLOCK = 8


@dataclass(frozen=True, slots=True)
class Engagement:
    """A vehicle at the job of a role: since when, and where it came from."""

    role: str
    since_s: float
    from_m: Point


class Broadcaster:
    """One vehicle's account of the mission, its own and what it has heard."""

    def __init__(self, me: str, group: Group, strategy: StatusBroadcast) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._at: dict[str, Engagement] = {}  # last known of every vehicle
        self._reported: set[str] = set()  # jobs that somebody says are done
        self._silence = Silence(me, strategy.doubt_rounds)
        self._silent: set[str] = set()

    def negotiate(self, situation: Situation) -> Move:
        """Hear, predict, leave what is done or was another's before, take what is left, tell the state."""
        for heard in situation.heard:
            self._hear(heard, situation.work)
        work = situation.work.knowing(self._reported)
        self._silent = self._silence.out_of_reach([data.name for data in work.workers], situation)
        outlooks = {data.name: self._outlook(data, work, situation) for data in work.workers}
        doubted = {name for name, then in outlooks.items() if self._is_overdue(name, then.free_s, situation)}
        held = work.held_by(self._me)
        left = [
            role
            for role in situation.work.held_by(self._me)
            if role not in held or self._is_later(role.name, doubted, work)
        ]
        said = [Statement(((self._me, "leftRole", self._group.path(role.name)),), told=False) for role in left]
        if all(role in left for role in held):
            self._at.pop(self._me, None)
            name = self._choice(work, outlooks, doubted, situation)
            if name is not None:
                self._at[self._me] = Engagement(name, round(situation.now_s), work.position_m(self._me))
                said.append(Statement(((self._me, "playsRole", self._group.path(name)),), told=False))
        if situation.round % self._with.period_rounds == 0 or said:
            said += self._state(work)
        return Move(tuple(said), holding=bool(work.unfinished))

    def _hear(self, heard: Heard, work: Work) -> None:
        """The state of the mission as a peer tells it."""
        said = {attribute: value for subject, attribute, value in heard.facts if subject == heard.issuer}
        group, _, role = str(said.get("worksOn", "")).partition(".")
        if group == self._group.name:
            known = self._at.get(heard.issuer)
            from_m = work.position_m(heard.issuer) if known is None or known.role != role else known.from_m
            self._at[heard.issuer] = Engagement(role, float(said.get("worksSince", heard.time_s)), from_m)
        self._reported.update(subject for subject, attribute, _ in heard.facts if attribute == "knownDone")

    def _is_later(self, role: str, doubted: Collection[str], work: Work) -> bool:
        """True if another member, one that is not doubted, was at the job of ``role`` before this vehicle."""
        mine, database = self._at.get(self._me), work.database
        return mine is not None and any(
            at.role == role and (at.since_s, database[name].node) < (mine.since_s, database[self._me].node)
            for name, at in self._at.items()
            if name not in doubted and name != self._me and name in work.members
        )

    # Prediction

    def _outlook(self, data: VehicleData, work: Work, situation: Situation) -> Outlook:
        """When and where a vehicle will have done what it was last known to be at.

        Without work it is free now, a silent one since it was heard.
        """
        at = self._at.get(data.name)
        role = next((r for r in work.unfinished if r.name == at.role), None) if at is not None else None
        if at is not None and role is not None and data.name != self._me:
            then = work.after(Outlook(at.since_s, at.from_m), data, role)
            if then is not None:
                return then
        free_s = situation.heard_s.get(data.name, 0.0) if data.name in self._silent else situation.now_s
        return Outlook(free_s, work.position_m(data.name))

    def _is_overdue(self, vehicle: str, free_s: float, situation: Situation) -> bool:
        """True if a vehicle is silent and should have been free long ago."""
        doubt_s = self._with.doubt_rounds * situation.now_s / situation.round
        return vehicle in self._silent and free_s + doubt_s <= situation.now_s

    def _choice(
        self, work: Work, outlooks: Mapping[str, Outlook], doubted: Collection[str], situation: Situation
    ) -> str | None:
        """The role that is left to this vehicle when all who become free choose in turn; None if there is none."""
        at = [(at.role, name) for name, at in self._at.items() if name in outlooks]
        taken = {role for role, _ in at}
        free = {role.name: role for role in work.open if role.name not in taken}
        found, predicted = self._in_turn(work.workers, outlooks, free, work)
        if found is None:  # nothing is left but what others are at, or should have done by now
            trusted = {role for role, name in at if name not in doubted}
            trusted |= {role for role, (name, s) in predicted.items() if not self._is_overdue(name, s, situation)}
            left = {role.name: role for role in work.open if role.name not in trusted}
            me = [data for data in work.workers if data.name == self._me]
            found, _ = self._in_turn(me, outlooks, left, work)
        return found

    def _in_turn(
        self,
        members: Sequence[VehicleData],
        outlooks: Mapping[str, Outlook],
        roles: Mapping[str, RoleSpecification],
        work: Work,
    ) -> tuple[str | None, dict[str, tuple[str, float]]]:
        """This vehicle's choice, and what others choose before: by role who, and when it will have done it."""
        outlook, left = {data.name: outlooks[data.name] for data in members}, dict(roles)
        chosen: dict[str, tuple[str, float]] = {}
        while left and self._me in outlook:
            data = min((d for d in members if d.name in outlook), key=lambda d: (outlook[d.name].free_s, d.node))
            then = [
                (o.free_s, name, o)
                for name, role in left.items()
                if (o := work.after(outlook[data.name], data, role)) is not None
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

    # Saying

    def _state(self, work: Work) -> list[Statement]:
        """The state of the mission as this vehicle knows it."""
        done = [role.job for role in work.roles if role.job is not None and role.job in work.done]
        facts: list[Statable] = [(job, "knownDone", True) for job in done]
        said = [Statement(tuple(facts[n : n + JOBS_PER_BLOCK])) for n in range(0, len(facts), JOBS_PER_BLOCK)]
        at = self._at.get(self._me)
        if at is not None:
            job, since = (self._me, "worksOn", self._group.path(at.role)), (self._me, "worksSince", at.since_s)
            said.append(Statement((job, since)))
        return said


@dataclass(frozen=True, slots=True)
class StatusBroadcast:
    """Mission states, repeated; see the module's text."""

    period_rounds: Annotated[
        int, Field(ge=1, le=1000, description="TDMA frames between two broadcasts of the state")
    ] = 3
    doubt_rounds: Annotated[
        int, Field(ge=0, le=10_000, description="TDMA frames that a vehicle may be silent, and its job late")
    ] = 30

    name: ClassVar[str] = "status-broadcast"
    declaration: ClassVar[Declaration] = Declaration(
        source="Sotzing, Lane 2010 (DELPHIS)",
        messages={
            "worksOn": "the job that the sender is at; not acknowledged",
            "worksSince": "since when; not acknowledged",
            "knownDone": "a job that the sender knows to be done; not acknowledged",
            JOB_DONE: "the sender has done a job",
        },
        blocks_per_round=1,
    )
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def negotiator(self, me: str, group: Group) -> Broadcaster:
        """A broadcaster for each member."""
        return Broadcaster(me, group, self)


STRATEGY = StatusBroadcast()
