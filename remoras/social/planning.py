"""Planning: the missions of the groups that a vehicle leads become roles and objectives, by HTN.

A plan rests on the facts that its search looked up. When one of them changes, or when somebody leaves the group, the
mission is planned again; what was proposed or counts already is not said twice.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact, Key
from remoras.htn import Domain, FactsLike, NoPlan, Task, plan
from remoras.organisation import Group, RoleAssignment
from remoras.social.requests import OBJECTIVE_PREFIX
from remoras.strategy import Strategy, adapt_roles
from remoras.work import Work, precedence
from worldmodel import Change


@dataclass(frozen=True, slots=True)
class Deliberation:
    """What came of planning.

    Attributes:
        facts: that it decided on.
        impossible: missions for which there is no plan.
        parts: the same facts by the vehicles that they concern, see ``remoras.social.receivers``.
    """

    facts: list[Fact]
    impossible: list[NoPlan]
    parts: list[list[Fact]] = field(default_factory=list)


def missions_of(groups: Iterable[Group], given: Mapping[str, str]) -> dict[str, str]:
    """What each group is to do, by its name, as far as it is known.

    Args:
        groups: with the missions that some have from the start.
        given: missions that groups were given since, by their names.
    """
    found = {group.name: given.get(group.name, group.mission) for group in groups}
    return {group: mission for group, mission in found.items() if mission is not None}


class MissionPlanner:
    """Plans the missions of the groups that one vehicle leads, and lets the strategy allocate roles for them.

    Args:
        me: own name.
        domain: HTN of the mission, from missions of groups to elementary tasks.
        beliefs: of the vehicle.
        strategy: allocates roles.
        rests_on: for each group whose mission was planned before, the facts that its plan rests on.
    """

    def __init__(
        self, me: str, domain: Domain, beliefs: Beliefs, strategy: Strategy, rests_on: Mapping[str, frozenset[Key]]
    ) -> None:
        self._me = me
        self._domain = domain
        self._beliefs = beliefs
        self._strategy = strategy
        self._rests_on = dict(rests_on)
        self._due: set[str] = set()
        self._proposed: dict[RoleAssignment | Objective, None] = {}  # said in this round, not yet counting
        self._awaited: set[tuple[str, str]] = set()  # (vehicle, job) given to it, of which nothing has come back
        self.issued: set[RoleAssignment] = set()
        self.issued_objectives: set[Objective] = set()

    # What is due ---------------------------------------------------------------------------------

    @property
    def is_due(self) -> bool:
        """True while there is a mission to be planned."""
        return bool(self._due)

    def has_planned(self, group: str) -> bool:
        """True once the mission of ``group`` has been planned."""
        return group in self._rests_on

    def take_on(self, groups: Iterable[str]) -> None:
        """Missions of these groups are due unless they have been planned."""
        self._due.update(group for group in groups if group not in self._rests_on)

    def note(self, change: Change) -> None:
        """Whoever says something about a job has heard that it is his."""
        if self._awaited:
            issuer = self._beliefs.name(change.block.origin)
            self._awaited -= {(issuer, self._beliefs.name(fact.subject)) for fact in change.block.facts}

    def reconsider(self, keys: Collection[Key], led: Iterable[str]) -> None:
        """Of the groups led, those whose mission or plan rests on one of the changed facts ``keys`` are due."""
        for group in led:
            if ("hasMission", group) in keys or not self._rests_on.get(group, frozenset()).isdisjoint(keys):
                self._due.add(group)

    def lead(self, groups: Collection[str], taken_over: Collection[str]) -> None:
        """Missions of these groups are this vehicle's to plan; of those taken over they are due.

        Args:
            groups: that it leads now.
            taken_over: those of them that it did not lead before.
        """
        self._due.intersection_update(groups)
        self._due.update(taken_over)

    def replace_who_left(self, groups: Iterable[str]) -> None:
        """Somebody left these groups or came back: their missions are due again if they have been planned here."""
        self._due.update(self._rests_on.keys() & set(groups))

    def waits_for(self, peers: Collection[str], done: Collection[str]) -> bool:
        """True while one of ``peers`` was given a job that is not done and of which nothing has come back."""
        return any(vehicle in peers and job not in done for vehicle, job in self._awaited)

    def end_round(self, left: Iterable[RoleAssignment]) -> None:
        """What was proposed in this round has been said; roles that vehicles have left are given out no longer."""
        self._proposed.clear()
        self.issued.difference_update(left)

    # Planning ------------------------------------------------------------------------------------

    def plan(
        self,
        facts_known: FactsLike,
        missions: Mapping[str, str],
        work: Mapping[str, Work],
        objectives: Collection[Objective],
    ) -> Deliberation:
        """Plan the missions that are due.

        Args:
            facts_known: what the plans rest on.
            missions: of the groups, by name.
            work: of the groups, by name.
            objectives: that count already.
        """
        facts: list[Fact] = []
        impossible: list[NoPlan] = []
        for group in sorted(self._due):
            mission = missions.get(group)
            if mission is None:
                continue
            found = plan(self._domain, facts_known, Task(mission, (group,)))
            self._rests_on[group] = found.rests_on | precedence(work[group].group, work[group].jobs)
            if isinstance(found, NoPlan):
                impossible.append(found)
                continue
            for task in found.tasks:
                match task.name, task.args:
                    case "AllocateRoles", (of,):
                        facts += self._allocate(work[of])
                    case "GiveMission", (of, given):
                        facts += [] if missions.get(of) == given else [self._beliefs.fact(of, "hasMission", given)]
                    case _, args:
                        facts += self._give(Objective(*args), objectives)
        self._due.clear()
        return Deliberation(facts, impossible)

    def _give(self, objective: Objective, objectives: Collection[Objective]) -> list[Fact]:
        if objective in self._proposed or objective in objectives:
            return []
        self._proposed[objective] = None
        self.issued_objectives.add(objective)
        subject = f"{objective.group}.{objective.role}"
        return [self._beliefs.fact(subject, OBJECTIVE_PREFIX + objective.name, objective.argument)]

    def _allocate(self, work: Work) -> list[Fact]:
        """Let the strategy allocate roles to members of the group, on top of what was proposed in this round."""
        expected = work.organisation
        for one in self._proposed:
            if isinstance(one, RoleAssignment):
                expected, _ = expected.assign(one.vehicle, one.group, one.role)
        allocated = adapt_roles(self._strategy, replace(work, organisation=expected))
        allowed = [one for one in allocated if work.organisation.is_member(one.vehicle, one.group)]
        self.issued.update(allowed)
        jobs = {role.name: role.job for role in work.group.roles}
        self._awaited |= {
            (one.vehicle, job) for one in allowed if (job := jobs.get(one.role)) and one.vehicle != self._me
        }
        self._proposed.update(dict.fromkeys(allowed))
        return [self._beliefs.fact(one.vehicle, "playsRole", f"{one.group}.{one.role}") for one in allowed]
