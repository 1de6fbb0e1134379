"""Central assignment: the head gives members jobs one by one, as they finish.

A member holds at most ``queue`` jobs. Whenever it finishes one, which it tells, the head gives it another, so that the
next jobs are finished as early as possible. Assignments and results are facts: they are acknowledged, and repeated
until they are. A member that has not been heard for ``silence_rounds`` TDMA frames, or is heard but has not
acknowledged a job for ``acknowledge_rounds``, is taken to be out of reach: what it held goes to others. If the head
falls silent, members finish what they hold and wait.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.organisation import Group, RoleSpecification
from remoras.strategies.allocation import Expectations, shared_out
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.silence import QUEUE, SILENCE, Silence
from remoras.strategy import JOB_DONE, Declaration, Move, Situation, Statable, Statement


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
        """Take back what those out of reach hold, then give out what is vacant."""
        work = situation.work
        if self._me not in work.heads:
            return Move()
        names = [data.name for data in work.workers]
        silent = self._silence.out_of_reach(names, situation) | self._deaf(situation)
        held = {name: work.held_by(name) for name in names}
        taken_back = [(name, role) for name in sorted(silent & held.keys()) for role in held[name]]
        said: list[Statable] = [(name, "leftRole", self._group.path(role.name)) for name, role in taken_back]
        said += self._given_out(held, silent, situation)
        return Move(tuple(Statement((fact,)) for fact in said), holding=bool(work.unfinished))

    def _given_out(
        self, held: dict[str, list[RoleSpecification]], silent: Collection[str], situation: Situation
    ) -> list[Statable]:
        """Vacant roles, one at a time to each member with room, up to ``queue``."""
        work, now_s = situation.work, situation.now_s
        vacant = {role.name: role for role in work.vacant}
        outlooks = {data.name: self._expectations.of(data, held[data.name], now_s, work) for data in work.workers}
        said: list[Statable] = []
        for _ in range(self._with.queue):
            free = [d for d in work.workers if d.name not in silent and len(held[d.name]) < self._with.queue]
            for one in shared_out(work, tuple(vacant.values()), free, outlooks, 1):
                held[one.vehicle].append(vacant.pop(one.role))
                data = work.database[one.vehicle]
                outlooks[one.vehicle] = self._expectations.of(data, held[one.vehicle], now_s, work)
                said.append((one.vehicle, "playsRole", self._group.path(one.role)))
        return said

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
        int, Field(ge=1, le=10_000, description="TDMA frames that a member may take to acknowledge a job")
    ] = 300

    name: ClassVar[str] = "central"
    declaration: ClassVar[Declaration] = Declaration(
        source="leader-follower assignment, as in most fleets today",
        messages={
            "playsRole": "the head gives a member a job",
            "leftRole": "the head takes a job back",
            JOB_DONE: "a vehicle has done a job",
        },
    )
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """The head's part, for each member: another may come to lead."""
        return Dispatcher(me, group, self)


STRATEGY = Central()
