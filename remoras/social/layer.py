"""Social layer: the flotilla as an organisation, and the missions it performs (REMORAS, section IV).

Its eight modules, by the paper's names:

* ``auv_database``: data of the vehicles;
* ``optimiser`` (of organisational performances): allocates roles, a ``Strategy``;
* ``groups`` and ``roles``: which vehicles belong to and play which;
* ``missions``: which mission each group has;
* mission planner (``plan_missions``): turns the missions of the groups that this vehicle leads into objectives, by HTN;
* ``individual_objectives`` of a vehicle and ``collective_objectives`` of a role.

Organisational data are facts of the world model and travel as such. What is said in one TDMA frame is one
round of consultation: in it every vehicle has had its say. An assignment counts at a vehicle from the end of
the frame in which the vehicle heard it (or made it), and only if its issuer is a member of the group.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from remoras.activities import ActivitySet, Objective
from remoras.behaviours import Picture
from remoras.beliefs import Beliefs, Key
from remoras.database import AUVDatabase
from remoras.htn import NoPlan, Task, plan
from remoras.mission import Mission
from remoras.motion import Motion
from remoras.organisation import Outcome, RoleAssignment
from remoras.social.agreement import Agreement
from remoras.social.negotiation import ROLE_ATTRIBUTES, Negotiation
from remoras.strategy import Evidence, Strategy
from worldmodel import Change, Observation, TBox

Fact = tuple[int, int, Any]  # subject, attribute, value
OBJECTIVE_PREFIX = "objective"


@dataclass(slots=True)
class Consultation:
    """What a round of consultation changed at this vehicle."""

    assigned: list[RoleAssignment] = field(default_factory=list)
    left: list[RoleAssignment] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    activities_due: bool = False


@dataclass(frozen=True, slots=True)
class Deliberation:
    """Facts that planning decided on, and missions for which there is no plan."""

    facts: list[Fact]
    impossible: list[NoPlan]


def _age(observation: Observation) -> tuple[float, int, int, int]:
    """The world model's order of facts: time, then origin, sequence and position."""
    return observation.time_s, observation.origin, observation.block.sequence, observation.position


class SocialLayer:
    """Organisation, missions and objectives as one vehicle sees them.

    Args:
        me: own name.
        database: static data of all vehicles.
        beliefs: facts of this vehicle.
        mission: the mission's tasks.
        strategy: forms the organisation and allocates roles.
        agreement: what was agreed before the mission.
    """

    def __init__(
        self,
        me: str,
        database: AUVDatabase,
        beliefs: Beliefs,
        mission: Mission,
        strategy: Strategy,
        agreement: Agreement,
    ) -> None:
        self.me = me
        self.auv_database = database
        self.optimiser = strategy
        self.organisation = agreement.organisation
        self._beliefs = beliefs
        self._mission = mission
        self._tbox: TBox = beliefs.model.tbox
        names = {a.uid: a.name for a in self._tbox.attributes}
        self._organisational = {u for u, n in names.items() if n in ROLE_ATTRIBUTES or n.startswith(OBJECTIVE_PREFIX)}
        self._objectives: dict[tuple[str, str, str], Objective] = {
            (o.group, o.role, o.name): o for o in agreement.objectives
        }
        self._standing = mission.standing_sets(database[me])
        self._pending: list[Observation] = []
        self._newest: dict[tuple[str, ...], tuple[float, int, int, int]] = {}  # what counts, and since when
        self._proposed: dict[RoleAssignment | Objective, None] = {}  # issued in this round, not yet counting
        self._done: set[str] = set()  # areas
        self._denied: dict[tuple[str, str, str], None] = {}  # (group, role, vehicle): there was no room for it
        self._plans_rest_on: dict[str, frozenset[Key]] = {}  # group led -> facts of its mission's plan
        self._activities: dict[Objective, tuple[tuple[ActivitySet, ...], frozenset[Key]]] = {}
        self._led = self._groups_led()
        self._plans_rest_on |= {group: agreement.rests_on[group] for group in self._led if group in agreement.rests_on}
        self._due: set[str] = {g for g in self._led if g not in self._plans_rest_on and self.missions.get(g)}
        self._negotiation = Negotiation(me, strategy, self.organisation, beliefs, mission.rally_points_m)
        self.issued: set[RoleAssignment] = set()
        self.issued_objectives: set[Objective] = set()
        self.finished: list[Objective] = []
        self.unheard: Mapping[str, Collection[str]] = {}
        """Vehicles that are not known to hold what this vehicle assigned at sea, and which roles it gave them by it."""
        self._awaited: set[tuple[str, str]] = set()  # (vehicle, area): given to it, and not seen to be begun

    # The modules that are mappings ---------------------------------------------------------------

    @property
    def groups(self) -> Mapping[str, tuple[str, ...]]:
        """Groups: members of each."""
        return {group: self.organisation.members(group) for group in self.organisation.groups}

    @property
    def roles(self) -> Mapping[tuple[str, str], tuple[str, ...]]:
        """Roles: players of each (group, role)."""
        return {
            (a.group, a.role): self.organisation.members(a.group, a.role) for a in sorted(self.organisation.assignments)
        }

    @property
    def missions(self) -> Mapping[str, str]:
        """Missions: what each group is to do, as far as known."""
        found = {}
        for group in self.organisation.groups.values():
            mission = self._beliefs.get(("hasMission", group.name), group.mission)
            if mission is not None:
                found[group.name] = mission
        return found

    def individual_objectives(self, vehicle: str) -> tuple[Objective, ...]:
        """Objectives that ``vehicle`` pursues without interacting with others."""
        return tuple(o for o in self.objectives_of(vehicle) if self._mission.is_individual(o))

    def collective_objectives(self, group: str, role: str) -> tuple[Objective, ...]:
        """Objectives of ``role`` that need others."""
        return tuple(
            o
            for o in self._objectives.values()
            if (o.group, o.role) == (group, role) and not self._mission.is_individual(o)
        )

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """All objectives of the roles that ``vehicle`` plays."""
        played = {(a.group, a.role) for a in self.organisation.roles_of(vehicle)}
        return tuple(o for o in self._objectives.values() if (o.group, o.role) in played)

    def leads(self, group: str) -> bool:
        """Is this vehicle a head of ``group``, with the social layer to lead it?"""
        return group in self._led

    def _groups_led(self) -> tuple[str, ...]:
        if not self.auv_database[self.me].social_layer:
            return ()
        groups = self.organisation.groups
        return tuple(group for group in groups if self.me in self.organisation.heads(group))

    # Hearing -------------------------------------------------------------------------------------

    def consider(self, changes: Sequence[Change]) -> bool:
        """Take note of changed facts; True if activities rest on them and have to be chosen anew.

        Organisational facts wait for the end of the round; a mission for a group that this vehicle leads,
        or a fact that one of its plans rests on, makes planning due now.
        """
        for change in changes:
            for position, fact in enumerate(change.block.facts):
                if fact.attribute in self._organisational:
                    self._pending.append(Observation(change.block, position))
            self._negotiation.note(change)
            if self._awaited:
                issuer = self._beliefs.name(change.block.origin)
                self._awaited -= {(issuer, self._beliefs.name(fact.subject)) for fact in change.block.facts}
        keys = self._beliefs.keys_of(changes)
        self._done.update(area for attribute, area in keys if attribute == "areaDone")
        for group in self._led:
            rests_on = self._plans_rest_on.get(group, frozenset())
            if ("hasMission", group) in keys or not keys.isdisjoint(rests_on):
                self._due.add(group)
        return self.reconsider_activities(keys)

    def reconsider_activities(self, keys: set[Key]) -> bool:
        """Drop the activities that rest on any of the facts ``keys``; True if there were some."""
        stale = [o for o, (_, rests_on) in self._activities.items() if not keys.isdisjoint(rests_on)]
        for objective in stale:
            del self._activities[objective]
        return bool(stale)

    @property
    def planned(self) -> frozenset[str]:
        """Groups whose mission this vehicle has planned."""
        return frozenset(self._plans_rest_on)

    @property
    def planning_due(self) -> bool:
        return bool(self._due)

    @property
    def consultation_due(self) -> bool:
        return bool(self._pending)

    def consult(self) -> Consultation:
        """End of a round: what was heard in it counts from now on, unless something newer counts already."""
        result = Consultation()
        pending = sorted(self._pending, key=_age)
        self._pending = []
        self._proposed.clear()
        for observation in pending:
            fact = observation.fact
            name = self._tbox.attributes[fact.attribute].name
            issuer = self._beliefs.name(observation.origin)
            is_objective = name.startswith(OBJECTIVE_PREFIX)
            group, role = self._beliefs.name(fact.subject if is_objective else fact.target).split(".")
            if not self.organisation.may_assign(issuer, group):
                result.refused.append(f"{issuer} is no member of {group}, its {name} does not count")
                continue
            about = (group, role, name if is_objective else self._beliefs.name(fact.subject))
            if self._newest.get(about, (-1.0, 0, 0, 0)) > _age(observation):
                continue
            self._newest[about] = _age(observation)
            if is_objective:
                target = self._beliefs.name(fact.target)
                objective = Objective(group, role, name.removeprefix(OBJECTIVE_PREFIX), target)
                self._objectives[group, role, objective.name] = objective
                result.activities_due = True
            else:
                self._take(self._beliefs.name(fact.subject), group, role, name == "playsRole", result)
        self._led = self._groups_led()
        return result

    def _take(self, vehicle: str, group: str, role: str, plays: bool, result: Consultation) -> None:
        change = self.organisation.assign if plays else self.organisation.leave_role
        self.organisation, outcome = change(vehicle, group, role)
        self._denied.pop((group, role, vehicle), None)
        if outcome is Outcome.ACCESS_DENIED:
            self._denied[group, role, vehicle] = None
        if outcome is Outcome.SUCCESS:
            if not plays and group in self._plans_rest_on:
                self._due.add(group)  # somebody has to take over
            result.activities_due |= self.reconsider_activities({("members", f"{group}.{role}")})
            if vehicle == self.me:
                (result.assigned if plays else result.left).append(RoleAssignment(group, role, vehicle))
                result.activities_due = True
            waiting = [v for g, r, v in self._denied if (g, r) == (group, role)]
            if not plays and waiting:  # who was to take the role over was heard of first
                self._take(waiting[-1], group, role, True, result)
        elif outcome not in (Outcome.ROLE_ALREADY_HANDLED, Outcome.ROLE_NOT_HANDLED):
            result.refused.append(f"{vehicle} as {role} of {group}: {outcome.value}")

    def negotiate(self, now_s: float, picture: Picture, motion: Motion) -> list[tuple[list[Fact], bool]]:
        """End of a round: facts that this vehicle states together to organise its groups, and whether it tells them."""
        if not self._negotiation.takes_part:
            return []
        evidence = self._evidence({**picture.positions, self.me: motion.position_m})
        statements = self._negotiation.negotiate(now_s, self.organisation, evidence, picture.heard_s, self.unheard)
        return [([self._beliefs.fact(*fact) for fact in said.facts], said.told) for said in statements]

    # Planning ------------------------------------------------------------------------------------

    def plan_missions(self, picture: Picture) -> Deliberation:
        """Plan the missions that are due, and let the optimiser allocate what the plans ask for."""
        facts: list[Fact] = []
        impossible: list[NoPlan] = []
        for group in sorted(self._due):
            mission = self.missions.get(group)
            if mission is None:
                continue
            found = plan(self._mission.social_domain, self._beliefs, Task(mission, (group,)))
            self._plans_rest_on[group] = found.rests_on
            if isinstance(found, NoPlan):
                impossible.append(found)
                continue
            for task in found.tasks:
                facts += self._carry_out(task, picture)
        self._due.clear()
        return Deliberation(facts, impossible)

    def _carry_out(self, task: Task, picture: Picture) -> list[Fact]:
        beliefs = self._beliefs
        if task.name == "AllocateRoles":
            return self._allocate(task.args[0], picture)
        if task.name == "GiveMission":
            group, mission = task.args
            if self.missions.get(group) == mission:
                return []
            return [beliefs.fact(group, "hasMission", mission)]
        objective = Objective(*task.args)
        known = self._objectives.get((objective.group, objective.role, objective.name))
        if objective in self._proposed or known == objective:
            return []
        self._proposed[objective] = None
        self.issued_objectives.add(objective)
        subject = f"{objective.group}.{objective.role}"
        return [beliefs.fact(subject, OBJECTIVE_PREFIX + objective.name, objective.argument)]

    def _allocate(self, group: str, picture: Picture) -> list[Fact]:
        expected = self.organisation
        for proposed in self._proposed:
            if isinstance(proposed, RoleAssignment):
                expected, _ = expected.assign(proposed.vehicle, proposed.group, proposed.role)
        allocated = self.optimiser.adapt(expected.groups[group], expected, self._evidence(picture.positions))
        allowed = [a for a in allocated if self.organisation.is_member(a.vehicle, a.group)]
        self.issued.update(allowed)
        areas = {role.name: role.area for role in expected.groups[group].roles}
        self._awaited |= {(a.vehicle, area) for a in allowed if (area := areas[a.role]) and a.vehicle != self.me}
        self._proposed.update(dict.fromkeys(allowed))
        return [self._beliefs.fact(a.vehicle, "playsRole", f"{a.group}.{a.role}") for a in allowed]

    def _evidence(self, positions_m: Mapping[str, tuple[float, float]]) -> Evidence:
        return Evidence(self.auv_database, dict(positions_m), self._mission.corners_m, frozenset(self._done))

    def findings(self, picture: Picture, motion: Motion) -> list[Fact]:
        """What this vehicle concludes as the leader of its groups, as facts."""
        facts: list[Fact] = []
        for name in self._led:
            if self.holds(name):
                continue
            group = self.organisation.groups[name]
            for finding in self._mission.findings(group, self.organisation, self._beliefs, picture, motion):
                facts.append(self._beliefs.fact(finding.subject, finding.attribute, finding.value))
        return facts

    def addressed(self, change: Change) -> dict[str, set[str]]:
        """Who has to hear of what the block gives out: who is given roles, by name; all members if plans ask for it."""
        given: dict[str, set[str]] = {}
        for fact in change.block.facts:
            if fact.attribute in self._organisational:
                name = self._tbox.attributes[fact.attribute].name
                role = self._beliefs.name(fact.subject if name.startswith(OBJECTIVE_PREFIX) else fact.target)
                if name == "playsRole":
                    given.setdefault(self._beliefs.name(fact.subject), set()).add(role)
                if not self.optimiser.declaration.planned_before:
                    for member in self.organisation.members(role.split(".")[0]):
                        given.setdefault(member, set())
        given.pop(self.me, None)
        return given

    def gives_out(self, group: str) -> bool:
        """Has ``group`` areas that this vehicle has still to give out, or to see done?"""
        return group in self._negotiation.holding

    def holds(self, group: str) -> bool:
        """Is ``group`` not to be taken for gathered, since it has work to be given out or heard of?"""
        if self.gives_out(group):
            return True
        return self.leads(group) and any(v in self.unheard and area not in self._done for v, area in self._awaited)

    def gathered(self) -> set[str]:
        """Groups believed to be together; a meeting before those that it must follow does not count."""
        observed = {group: self._beliefs.observed_s(("gatheredAt", group)) for group in self.organisation.groups}
        return {
            group
            for group, when_s in observed.items()
            if when_s is not None
            and all((before_s := observed[g]) is None or before_s <= when_s for g in self._mission.meets_after[group])
        }

    def resign(self) -> list[Fact]:
        """Leave all roles: a vehicle that has to look after itself is of no use to its groups."""
        return [
            self._beliefs.fact(self.me, "leftRole", f"{a.group}.{a.role}") for a in self.organisation.roles_of(self.me)
        ]

    def completed(self, objective: Objective) -> list[Fact]:
        """What to make known when all has been done for ``objective``."""
        finding = self._mission.completion(objective, self.me)
        if finding is None:
            return []
        self.finished.append(objective)
        return [self._beliefs.fact(finding.subject, finding.attribute, finding.value)]

    # For the executive layer ---------------------------------------------------------------------

    def get(self, key: Key, default: Any = None, /) -> Any:
        """A fact for planning: ``("members", "Group.Role")`` from the organisation, others from the beliefs."""
        if key[0] == "members":
            return self.organisation.members(*key[1].split("."))
        return self._beliefs.get(key, default)

    def activity_sets(self, position_m: tuple[float, float]) -> tuple[ActivitySet, ...]:
        """Own objectives turned into activities, by HTN and with the vehicle's own characteristics.

        Activities under way are kept as they are unless a fact that they rest on has changed.
        """
        data = self.auv_database[self.me]
        objectives = sorted(self.objectives_of(self.me), key=lambda o: (o.group, o.role, o.name, o.argument))
        self._activities = {
            objective: self._activities.get(objective) or self._mission.activity_sets(objective, data, self, position_m)
            for objective in objectives
        }
        chosen = [self._standing, *(sets for sets, _ in self._activities.values())]
        return tuple(activity_set for sets in chosen for activity_set in sets)
