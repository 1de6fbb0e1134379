"""Orders of group leaders: parts of a plan per receiver, members for a formed group.

A block is accepted whole or not at all, so one large block would start no vehicle before its last fragment arrives.
Each vehicle with work therefore gets its own part: its roles and their individual objectives. Then follow facts for
all, such as the rally point, then collective objectives of new roles. Proposed or valid facts are not stated again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact
from remoras.mission_parts import SocialPart
from remoras.organisation import Group, RoleAssignment
from remoras.organisation.leadership import PLAYS_ROLE, is_able_to_lead
from remoras.recorder import OBJECTIVES
from remoras.social.view import DISSOLVED, FORMATION, FORMED_UNDER
from remoras.strategy import Strategy, adapt_roles
from remoras.work import Outlook, Work
from worldmodel import Change, PropertyValue


def by_receiver(
    facts: Sequence[Fact],
    beliefs: Beliefs,
    role_named: Callable[[PropertyValue], tuple[str, str] | None],
    is_individual: Callable[[Objective], bool],
) -> list[list[Fact]]:
    """Split facts into parts, single vehicles first, in the order in which these get roles.

    ``role_named`` returns attribute and role of an organisational fact, else None. New holders get individual
    objectives.
    """
    named = [(fact, role_named(PropertyValue(*fact)) or ("", "")) for fact in facts]
    players: dict[str, list[str]] = {}  # by role
    parts: dict[str, list[Fact]] = {}
    for (subject, *_), (attribute, role) in named:
        if attribute == PLAYS_ROLE:
            players.setdefault(role, []).append(beliefs.name(subject))
            parts.setdefault(beliefs.name(subject), [])
    shared: list[Fact] = []
    together: list[Fact] = []
    for fact, (attribute, role) in named:
        if attribute == PLAYS_ROLE:
            parts[beliefs.name(fact[0])].append(fact)
        elif role not in players or not attribute.startswith(OBJECTIVES):
            shared.append(fact)
        elif is_individual(_objective(role, attribute, beliefs.name(fact[2]))):
            for name in players[role]:
                parts[name].append(fact)
        else:
            together.append(fact)
    return [part for part in (*parts.values(), shared, together) if part]


def _objective(path: str, attribute: str, argument: str) -> Objective:
    group, role = path.split(".")
    return Objective(group, role, attribute.removeprefix(OBJECTIVES), argument)


def aims(
    facts: Iterable[tuple[str, str, object]],
    objectives: Iterable[Objective],
    founding: Collection[Objective],
    beliefs: Beliefs,
    mission: SocialPart,
) -> list[Fact]:
    """Return individual objectives of roles assigned in ``facts``, except ``founding`` ones."""
    roles = [value for _, attribute, value in facts if attribute == PLAYS_ROLE]
    if not roles:
        return []
    return [
        beliefs.fact(f"{objective.group}.{objective.role}", OBJECTIVES + objective.name, objective.argument)
        for objective in objectives
        if objective not in founding
        and f"{objective.group}.{objective.role}" in roles
        and mission.is_individual(objective)
    ]


def nearness(work: Work, vehicle: str) -> tuple[float, int]:
    """Return completion time (s) of the first open job the vehicle could do, and its node."""
    data, here = work.database[vehicle], Outlook(work.now_s, work.position_m(vehicle))
    thens = [work.after(here, data, role) for role in work.open if work.affords(here, data, role)]
    return min((after.free_s for after in thens if after is not None), default=math.inf), data.node


def recruits(work: Work) -> list[RoleAssignment]:
    """Return members of the forming group for founding roles of a group formed at run time.

    Roles of leaders and roles with a job are excluded. Each role gets its minimum number of holders, nearest first.
    """
    group, organisation = work.group, work.organisation
    if group.formed_by is None:
        return []
    assignments: list[RoleAssignment] = []
    taken = set(work.members)
    for role in group.roles:
        if not role.founding or role.head or role.job is not None:
            continue
        free = set(organisation.members(group.formed_by)).difference(taken, work.unavailable)
        able = [name for name in free if work.database[name].can_play(group.name, role.name)]
        chosen = sorted(able, key=lambda name: nearness(work, name))[: max(0, role.minimum - len(work.holders(role)))]
        assignments += [work.assignment(role, name) for name in chosen]
        taken.update(chosen)
    return assignments


LAST_FORMATION = 255
"""Greatest formation number in the ontology."""


class Orders:
    """Orders of one leader; ``issued`` and ``issued_objectives`` are those it has given."""

    def __init__(self, me: str, beliefs: Beliefs, strategy: Strategy, at_sea: Mapping[str, Group]) -> None:
        self._me = me
        self._beliefs = beliefs
        self._strategy = strategy
        self._at_sea = at_sea
        self._proposed: dict[RoleAssignment | Objective | Fact, None] = {}  # stated in this round, not yet valid
        self._awaited: dict[RoleAssignment, str] = {}  # assigned jobs without acknowledgement
        self.issued: set[RoleAssignment] = set()
        self.issued_objectives: set[Objective] = set()

    def note(self, change: Change) -> None:
        """Take a statement about a job as acknowledgement of its assignment to the issuer."""
        if self._awaited:
            issuer = self._beliefs.name(change.block.origin)
            jobs = {self._beliefs.name(fact.subject) for fact in change.block.facts}
            acknowledged = [
                assignment for assignment, job in self._awaited.items() if assignment.vehicle == issuer and job in jobs
            ]
            for assignment in acknowledged:
                del self._awaited[assignment]

    def waits_for(self, peers: Collection[str], done: Collection[str]) -> bool:
        """Return whether a peer has not acknowledged an assigned job that is not done."""
        return any(assignment.vehicle in peers and job not in done for assignment, job in self._awaited.items())

    def end_round(self, left: Iterable[RoleAssignment]) -> None:
        """Forget proposals of this round, and orders for roles that vehicles have ``left``."""
        self._proposed.clear()
        for assignment in left:
            self.issued.discard(assignment)
            self._awaited.pop(assignment, None)

    def forget(self, group: str) -> None:
        """Forget all orders to a group that was formed or dissolved."""
        self.issued = {assignment for assignment in self.issued if assignment.group != group}
        self.issued_objectives = {objective for objective in self.issued_objectives if objective.group != group}
        self._awaited = {assignment: job for assignment, job in self._awaited.items() if assignment.group != group}

    # Steps ---------------------------------------------------------------------------------------

    def form(self, group: str, work: Mapping[str, Work], number: int) -> list[Fact]:
        """Form a group under the able member of its forming group that is nearest to the work.

        The forming leader takes the lead only if no other vehicle can.
        """
        group_to_form, former = self._at_sea[group], work[self._at_sea[group].formed_by or ""]
        able = [name for name in former.members if is_able_to_lead(former.database, name, group_to_form)]
        if number > LAST_FORMATION or not able:
            return []
        head = min(able, key=lambda name: (name == self._me, *nearness(replace(former, group=group_to_form), name)))
        return self._say(self._beliefs.fact(group, FORMED_UNDER, head), self._beliefs.fact(group, FORMATION, number))

    def dissolve(self, group: str, number: int) -> list[Fact]:
        """Dissolve the formation of a group with that number."""
        return self._say(self._beliefs.fact(group, DISSOLVED, number))

    def _say(self, *facts: Fact) -> list[Fact]:
        """Return facts stated together, once a round."""
        if facts[0] in self._proposed:
            return []
        self._proposed[facts[0]] = None
        return list(facts)

    def give_mission(self, group: str, mission: str, missions: Mapping[str, Collection[str]]) -> list[Fact]:
        """Add a mission to a group, unless known."""
        return [] if mission in missions.get(group, ()) else [self._beliefs.fact(group, "hasMission", mission)]

    def give(self, objective: Objective, objectives: Collection[Objective], again: bool = False) -> list[Fact]:
        """Give a role an objective, unless proposed or valid; ``again`` repeats a former leader's."""
        if objective in self._proposed or (objective in objectives and not again):
            return []
        self._proposed[objective] = None
        self.issued_objectives.add(objective)
        subject = f"{objective.group}.{objective.role}"
        return [self._beliefs.fact(subject, OBJECTIVES + objective.name, objective.argument)]

    def allocate(self, work: Work) -> list[Fact]:
        """Allocate roles by the strategy, given the proposals of this round; recruit members first."""
        expected = work.organisation
        for assignment in self._proposed:
            if isinstance(assignment, RoleAssignment):
                expected, _ = expected.assign(assignment.vehicle, assignment.group, assignment.role)
        recruited = recruits(replace(work, organisation=expected))
        for assignment in recruited:
            expected, _ = expected.assign(assignment.vehicle, assignment.group, assignment.role)
        allocated = adapt_roles(self._strategy, replace(work, organisation=expected))
        allowed = [
            *recruited,
            *(assignment for assignment in allocated if expected.is_member(assignment.vehicle, assignment.group)),
        ]
        self.issued.update(allowed)
        jobs = {role.name: role.job for role in work.group.roles}
        jobs_given = {assignment: job for assignment in allowed if (job := jobs.get(assignment.role))}
        self._awaited |= {assignment: job for assignment, job in jobs_given.items() if assignment.vehicle != self._me}
        self._proposed.update(dict.fromkeys(allowed))
        return [
            self._beliefs.fact(assignment.vehicle, "playsRole", f"{assignment.group}.{assignment.role}")
            for assignment in allowed
        ]
