"""Strategy: vehicles take turns; each takes the job that it can finish soonest."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.authority import Authority
from remoras.strategies.initial_roles import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration, Move, Statement
from remoras.work import Outlook


class Chooser:
    """One vehicle's part in one group."""

    def __init__(self, me, group, turn_rounds):
        self.me, self.group, self.turn_rounds = me, group, turn_rounds

    def negotiate(self, situation):
        work = situation.work
        data, here = work.database[self.me], Outlook(situation.now_s, work.position_m(self.me))
        vacant = [role for role in work.vacant if work.able(data, role)]
        my_turn = situation.round // self.turn_rounds % len(work.members) == work.members.index(self.me)
        statements = []
        if my_turn and vacant and not work.held_by(self.me):
            role = min(vacant, key=lambda role: (work.after(here, data, role).free_s, role.name))
            statements.append(Statement(((self.me, "playsRole", self.group.path(role.name)),)))
        return Move(tuple(statements), holding=bool(work.unfinished))  # the group gathers once all jobs are done


@dataclass(frozen=True)
class Nearest:
    turn_rounds: Annotated[int, Field(ge=1, le=100, description="TDMA frames that a turn lasts")] = 1

    name: ClassVar[str] = "nearest"
    declaration: ClassVar[Declaration] = Declaration(
        source="an example",
        messages={"playsRole": "the sender has taken a job", JOB_DONE: "a vehicle has done a job"},
        authorities=frozenset({Authority.TAKE}),  # else only the group leader assigns roles
    )
    form = staticmethod(founded)  # as all shipped strategies do
    adapt = staticmethod(common_roles)  # roles without a job; jobs are taken during the mission

    def negotiator(self, me, group):
        return Chooser(me, group, self.turn_rounds)


NEAREST = Nearest()
