"""Strategies with a planning leader: one implementation with four factors.

The leader plans for all members of its group by the shared allocator. Each factor can be varied alone: prior knowledge
(``common_plan``), messages (``announces``), helpers (``help_s``) and plan repair (``repairs``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar

from remoras.errors import StrategyError
from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import all_jobs
from remoras.strategies.dispatch import ACKNOWLEDGE, HELP, MARGIN, NEXT_JOBS, Dispatcher, Dispatching
from remoras.strategies.factors import (
    ALL,
    MISSIONS_AT_SEA,
    NO_HELP_S,
    Announces,
    CommonPlan,
    Factors,
    Repairs,
    helps,
)
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import INFLUENCE_SIGNAL, JOB_DONE, Declaration
from remoras.work import Work

TOLD = {
    "playsRole": "a head gives a member a role",
    "leftRole": "a vehicle leaves a role, or its head takes it back",
    JOB_DONE: "a vehicle has done a job",
}
CALLS = {INFLUENCE_SIGNAL: "one signed byte for every role that the sender plays, in every slot"}


@lru_cache
def _declared(source: str, common_plan: str, repairs: str) -> Declaration:
    calls, before = repairs == "calls", common_plan != "none"
    messages = {**({} if before else MISSIONS_AT_SEA), **TOLD, **(CALLS if calls else {})}
    return Declaration(source=source, messages=messages, planned_before=before, influences=calls)


@dataclass(frozen=True, slots=True)
class HeadLed:
    """Leader that plans and assigns; see the module docstring.

    Raises:
        StrategyError: two factors exclude each other.
    """

    margin: Annotated[float, MARGIN] = 0.05
    help_s: Annotated[float, HELP] = 60.0
    acknowledge_rounds: Annotated[int, ACKNOWLEDGE] = 400
    common_plan: CommonPlan = "jobs"
    announces: Announces = "plan"
    repairs: Repairs = "changes"

    name: ClassVar[str]
    source: ClassVar[str]
    form = staticmethod(founded)

    def __post_init__(self) -> None:
        if self.common_plan == "jobs" and self.announces == "next-jobs":
            excluded = 'common_plan = "jobs", by which all jobs are known at 0 s, excludes announces = "next-jobs"'
            raise StrategyError(
                "common_plan", f'{excluded}; allowed: announces = "plan", or common_plan "none", "missions"'
            )
        if self.repairs == "never" and self.help_s < NO_HELP_S:
            excluded = f'repairs = "never", by which no vehicle is reassigned, excludes help_s = {self.help_s:g}'
            raise StrategyError(
                "repairs", f'{excluded}; allowed: help_s = {NO_HELP_S:.0f}, or repairs "changes", "calls"'
            )

    @property
    def declaration(self) -> Declaration:
        """Declaration for the current factor levels."""
        return _declared(self.source, self.common_plan, self.repairs)

    @property
    def factors(self) -> Factors:
        """Factor levels of this strategy."""
        return Factors(self.common_plan, "head", "all", self.announces, helps(self.help_s), self.repairs)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Return common roles, and all open jobs unless the leader assigns next jobs only.

        If missions are sent at run time, only vehicles with a job get common roles, since each role takes time to send.
        """
        is_begun = any(work.holders(role) or role.job in work.done for role in work.roles)
        if self.common_plan == "missions" or (self.repairs == "never" and is_begun):
            return common_roles(work)
        given = all_jobs(work, self.help_s) if self.announces == "plan" else ()
        if self.common_plan == "jobs" or not work.roles:
            return common_roles(work) + given
        return given + common_roles(work, {assignment.vehicle for assignment in given})

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """Return the dispatcher of one member: any may succeed the leader."""
        queue = ALL if self.announces == "plan" else getattr(self, "queue", NEXT_JOBS)
        dispatching = Dispatching(queue, self.margin, self.help_s, self.acknowledge_rounds, self.repairs)
        return Dispatcher(me, group, dispatching)
