"""Orders of group leaders: who receives which part of a plan, and members for a formed group.

A block goes in whole or not at all. Cut anywhere, a large plan would begin for nobody before its last fragment is
heard. So each vehicle that is given work has a part of its own, with all that it needs to begin: its roles, and what
their holders pursue on their own. Then comes what concerns all, such as where to meet, and last what the holders of
new roles pursue together.

What was proposed in a round, or counts already, is not said twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from remoras.activities import Objective
from remoras.beliefs import Beliefs, Fact
from remoras.mission import SocialPart
from remoras.organisation import Group, RoleAssignment
from remoras.social.leadership import PLAYS_ROLE, is_able_to_lead
from remoras.social.view import DISSOLVED, FORMATION, FORMED_UNDER, OBJECTIVE_PREFIX
from remoras.strategy import Strategy, adapt_roles
from remoras.work import Outlook, Work
from worldmodel import Change, PropertyValue


def by_receiver(
    facts: Sequence[Fact],
    beliefs: Beliefs,
    role_named: Callable[[PropertyValue], tuple[str, str] | None],
    is_individual: Callable[[Objective], bool],
) -> list[list[Fact]]:
    """The same facts in parts, those of single vehicles first, in the order in which these are given roles.

    An individual objective is in the part of each vehicle that is given its role.

    Args:
        facts: that a plan comes down to.
        beliefs: of the vehicle, for names.
        role_named: attribute and role of an organisational fact; None for any other fact.
        is_individual: True for objectives that a vehicle pursues without others.
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
        elif role not in players or not attribute.startswith(OBJECTIVE_PREFIX):
            shared.append(fact)
        elif is_individual(_objective(role, attribute, beliefs.name(fact[2]))):
            for name in players[role]:
                parts[name].append(fact)
        else:
            together.append(fact)
    return [part for part in (*parts.values(), shared, together) if part]


def _objective(path: str, attribute: str, argument: str) -> Objective:
    group, role = path.split(".")
    return Objective(group, role, attribute.removeprefix(OBJECTIVE_PREFIX), argument)


def aims(
    facts: Iterable[tuple[str, str, object]],
    objectives: Iterable[Objective],
    founding: Collection[Objective],
    beliefs: Beliefs,
    mission: SocialPart,
) -> list[Fact]:
    """Individual objectives of the roles given in ``facts``: whoever gets such a role may not have heard of them.

    Args:
        facts: stated of vehicles, by names.
        objectives: that count.
        founding: those agreed before the dive, of which everybody knows.
        beliefs: of the vehicle.
        mission: says which objectives a vehicle pursues without others.
    """
    roles = [value for _, attribute, value in facts if attribute == PLAYS_ROLE]
    if not roles:
        return []
    return [
        beliefs.fact(f"{objective.group}.{objective.role}", OBJECTIVE_PREFIX + objective.name, objective.argument)
        for objective in objectives
        if objective not in founding
        and f"{objective.group}.{objective.role}" in roles
        and mission.is_individual(objective)
    ]


def nearness(work: Work, vehicle: str) -> tuple[float, int]:
    """How soon a vehicle would have done the first of the open jobs, to be compared: the lesser is nearer.

    Args:
        work: of the group that has the jobs.
        vehicle: member or not.
    """
    data, here = work.database[vehicle], Outlook(work.now_s, work.position_m(vehicle))
    thens = [work.after(here, data, role) for role in work.open if work.affords(here, data, role)]
    return min((then.free_s for then in thens if then is not None), default=math.inf), data.node


def recruits(work: Work) -> list[RoleAssignment]:
    """Members of the forming group that are to come into a group formed at sea, where it lacks holders of roles.

    These are its founding roles without a job, but for that of the head, up to the fewest holders that each demands:
    the nearest vehicles that are able to.

    Args:
        work: of the group.
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
"""The ontology numbers formations up to this one."""


class Orders:
    """Orders of one head.

    Args:
        me: own name.
        beliefs: of the vehicle.
        strategy: allocates roles.
        at_sea: groups that are formed at sea, by name.

    Attributes:
        issued: roles that it has given out; issued_objectives: objectives that it has given to roles.
    """

    def __init__(self, me: str, beliefs: Beliefs, strategy: Strategy, at_sea: Mapping[str, Group]) -> None:
        self._me = me
        self._beliefs = beliefs
        self._strategy = strategy
        self._at_sea = at_sea
        self._proposed: dict[RoleAssignment | Objective | Fact, None] = {}  # said in this round, not yet counting
        self._awaited: dict[RoleAssignment, str] = {}  # jobs given out, of which nothing has come back
        self.issued: set[RoleAssignment] = set()
        self.issued_objectives: set[Objective] = set()

    def note(self, change: Change) -> None:
        """Whoever says something about a job has heard that it is his."""
        if self._awaited:
            issuer = self._beliefs.name(change.block.origin)
            jobs = {self._beliefs.name(fact.subject) for fact in change.block.facts}
            heard = [
                assignment for assignment, job in self._awaited.items() if assignment.vehicle == issuer and job in jobs
            ]
            for assignment in heard:
                del self._awaited[assignment]

    def waits_for(self, peers: Collection[str], done: Collection[str]) -> bool:
        """True while one of ``peers`` was given a job that is not done and of which nothing has come back."""
        return any(assignment.vehicle in peers and job not in done for assignment, job in self._awaited.items())

    def end_round(self, left: Iterable[RoleAssignment]) -> None:
        """What was proposed in this round has been said; roles that vehicles have ``left`` are given out no longer."""
        self._proposed.clear()
        for assignment in left:
            self.issued.discard(assignment)
            self._awaited.pop(assignment, None)

    def forget(self, group: str) -> None:
        """A group was formed or dissolved at sea: what was said of it before is over."""
        self.issued = {assignment for assignment in self.issued if assignment.group != group}
        self.issued_objectives = {objective for objective in self.issued_objectives if objective.group != group}
        self._awaited = {assignment: job for assignment, job in self._awaited.items() if assignment.group != group}

    # Steps ---------------------------------------------------------------------------------------

    def form(self, group: str, work: Mapping[str, Work], number: int) -> list[Fact]:
        """Let a group be formed under whoever of the forming group is able to lead it and would be at its work first.

        Who forms it leads it itself if nobody else can.

        Args:
            group: its name.
            work: of all groups, by name.
            number: of the formation.
        """
        of, former = self._at_sea[group], work[self._at_sea[group].formed_by or ""]
        able = [name for name in former.members if is_able_to_lead(former.database, name, of)]
        if number > LAST_FORMATION or not able:
            return []
        head = min(able, key=lambda name: (name == self._me, *nearness(replace(former, group=of), name)))
        return self._say(self._beliefs.fact(group, FORMED_UNDER, head), self._beliefs.fact(group, FORMATION, number))

    def dissolve(self, group: str, number: int) -> list[Fact]:
        """Let the formation of a group with that number be over."""
        return self._say(self._beliefs.fact(group, DISSOLVED, number))

    def _say(self, *facts: Fact) -> list[Fact]:
        """Facts that are said together, once in a round."""
        if facts[0] in self._proposed:
            return []
        self._proposed[facts[0]] = None
        return list(facts)

    def give_mission(self, group: str, mission: str, missions: Mapping[str, Collection[str]]) -> list[Fact]:
        """Let a group have a mission, beside those that it has, unless that is known."""
        return [] if mission in missions.get(group, ()) else [self._beliefs.fact(group, "hasMission", mission)]

    def give(self, objective: Objective, objectives: Collection[Objective], again: bool = False) -> list[Fact]:
        """Let a role have an objective, unless it has, or that was proposed.

        What a former head gave is given ``again``: nobody else knows which members have heard of it.
        """
        if objective in self._proposed or (objective in objectives and not again):
            return []
        self._proposed[objective] = None
        self.issued_objectives.add(objective)
        subject = f"{objective.group}.{objective.role}"
        return [self._beliefs.fact(subject, OBJECTIVE_PREFIX + objective.name, objective.argument)]

    def allocate(self, work: Work) -> list[Fact]:
        """Let the strategy allocate roles to members of the group, on top of what was proposed in this round.

        A group that is formed at sea recruits first, see ``recruits``.
        """
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
