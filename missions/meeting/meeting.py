"""Rendezvous: activities of group members besides their jobs, and the gathering at the end.

Three objectives and their activities (Table II of the REMORAS paper)::

    GroupSupervision  -> MissionPlanner | LeaderInformationGathering | Following (Leader to ...)
    MissionGathering  -> Following (Follower to ...)
    RendezVous(p)     -> Homing(p)

PerformerSubordination and the navigation activities of the table are omitted. MissionPlanner also optimises the
organisation: its steps allocate roles, by the strategy. LeaderInformationGathering is perceived,
not performed; it determines the leader's satisfaction. Leaders hold GroupSupervision initially.

Operators of the leader's HTN planner:

=================  ==========================  =======================================  ==============================
task               test                        effects                                  expected
=================  ==========================  =======================================  ==============================
GiveMission        the group exists            the group has the mission                immediate
AllocateRoles      the group exists            its roles are allocated                  immediate
FormGroup          the group does not exist    it exists                                immediate
DissolveGroup      the group exists            it does not exist                        immediate
AssignObjective    roles are allocated, or     the objective is valid; also, a job is   travel and work of the role's
                   this one initially          done, or a rally point: the group has    holder at survey speed; or
                                               met                                      travel at transit speed
=================  ==========================  =======================================  ==============================

If a role loses its holder before its objectives are reached, the roles are allocated again. The rest of the mission is
not replanned.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from pydantic import Field

from exchange.arithmetic import distance, length
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour, FollowingLeader, Homing, LeadingFollowers, Planning, Supervision
from remoras.beliefs import Beliefs, Key
from remoras.database import VehicleData
from remoras.group_hierarchy import meets_after
from remoras.htn import ANY, Expected, FactsLike, Method, Operator, Task
from remoras.mission import ALLOCATE_ROLES, ASSIGN_OBJECTIVE, DISSOLVE_GROUP, FORM_GROUP, GIVE_MISSION, Finding
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.table import Section
from remoras.work import Job, Outlook, Point

ASSIGNED = (ASSIGN_OBJECTIVE,)  # tasks that assign objectives to a role
ALLOCATED = (ALLOCATE_ROLES, *ASSIGNED)  # tasks that reassign them after the role is released


def entrusted(orders: Callable[[str, str], list[Task]]) -> list[Method]:
    """Methods of a task (group, role, ...) that assign objectives by the tasks of ``orders``."""

    def is_left(facts: FactsLike, group: str, role: str, *of: str) -> bool:
        return bool(facts.get(("lost", f"{group}.{role}")))

    def to_another(facts: FactsLike, group: str, role: str, *of: str) -> list[Task]:
        return [Task(ALLOCATE_ROLES, (group, *facts.get(("lost", f"{group}.{role}")))), *orders(group, role)]

    return [
        Method("to who plays it", lambda facts, group, role, *of: orders(group, role), uses=ASSIGNED),
        Method("to another", to_another, is_left, ALLOCATED),
    ]


def last_known_m(facts: FactsLike, data: VehicleData) -> Point:
    """Last known position of a vehicle; its start before any."""
    at_m: Point | None = facts.get(("position", data.name))
    return data.start_m if at_m is None else at_m


def expected_of(facts: FactsLike, job: str, data: VehicleData) -> Expected | None:
    """Expected time (s) and energy (J) of what is left of a job, at survey speed; None if not known, or unable."""
    left: Job | None = facts.get(("job", job))
    after = None if left is None else left.after(Outlook(0.0, last_known_m(facts, data)), data)
    return None if after is None else Expected(after.free_s, after.free_s * data.power_w(data.survey_speed_mps))


SUPERVISION, GATHERING, RENDEZ_VOUS = "GroupSupervision", "MissionGathering", "RendezVous"
OBJECTIVES = (SUPERVISION, GATHERING, RENDEZ_VOUS)
"""Objectives of ``Meeting``; ``objective`` + each is an attribute of the core ontology."""
NEEDS = (
    "playsRole", "leftRole", "position", "gatheredAt", *(f"objective{name}" for name in OBJECTIVES)
)  # fmt: skip
MEET = "Meet"
GATHER = "Gather"  # task of a group and an initially assigned role: come to the rendezvous
HEARD_TOLERANCE_M = 1.0  # tolerance for received positions, which are quantised on the wire
NEWS_FRAMES = 20.0
"""TDMA frames after which a received position is outdated: 0.8^20 = 1 % for one reception in five frames."""

Pursuit = tuple[tuple[ActivitySet, ...], frozenset[Key]]
"""Activities for an objective, and the facts on which the choice depends."""


def importance_of(table: Mapping[str, float], objective: Objective) -> float:
    """Look up ``Group.Role.Objective``, then ``Role.Objective``, then ``Objective``; default 0."""
    of_role = f"{objective.role}.{objective.name}"
    of_any = table.get(of_role, table.get(objective.name, 0.0))
    return table.get(f"{objective.group}.{of_role}", of_any)


class MeetingSettings(Section):
    """Keys of the table ``[mission]`` on meetings."""

    arrival_radius_m: float = Field(20.0, gt=0.0, description="distance within which a vehicle has arrived")
    follow_distance_m: float = Field(
        40.0, gt=0.0, description="distance to its leader at which a follower catches up, by half"
    )
    patience_s: float = Field(
        60.0, gt=0.0, description="a leader is satisfied by an update in this time, a mapping worker by progress"
    )
    meeting_deadline_s: float = Field(
        900.0, gt=0.0, description="time after which a leader at the rally point meets with the vehicles present"
    )


@dataclass(frozen=True)
class Meeting:
    """Rendezvous component of a mission.

    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> meeting: Meeting = resolved(load("mapping-rendezvous")).mission.meeting
    >>> meeting.rally_points_m["operational rally"]
    (450.0, 450.0)
    """

    groups: Mapping[str, Group]
    rally_points_m: Mapping[str, Point]
    settings: MeetingSettings
    importance: Mapping[str, float]
    opens_s: float = 0.0
    jobs: Mapping[str, Job] = field(default_factory=dict)
    says_impossible: bool = False

    def founding_objectives(self) -> list[Objective]:
        """Supervision of each group by its leader."""
        return self.objectives(SUPERVISION, of_leaders=True)

    def objectives(self, name: str, of_leaders: bool = False) -> list[Objective]:
        """Return an objective about its group for each initially assigned role, or for leaders alone."""
        return [
            Objective(group.name, role.name, name, group.name)
            for group in self.groups.values()
            for role in group.roles
            if (role.head if of_leaders else role.founding)
        ]

    def methods(self) -> dict[str, list[Method]]:
        """Gathering: initially assigned roles follow the leader and go to the rally point."""

        def meet(facts: FactsLike, group: str) -> list[Task]:
            return [Task(GATHER, (group, role.name)) for role in self.groups[group].roles if role.founding]

        return {MEET: [Method("at the rally point", meet, uses=(GATHER,))], GATHER: entrusted(self._orders)}

    def _orders(self, group: str, role: str) -> list[Task]:
        head = self.groups[group].role(role)
        follow = [] if head is None or head.head else [Task(ASSIGN_OBJECTIVE, (group, role, GATHERING, group))]
        point = self.groups[group].rally_point
        return follow if point is None else [*follow, Task(ASSIGN_OBJECTIVE, (group, role, RENDEZ_VOUS, point))]

    def operators(self, working: str) -> list[Operator]:
        """Operators of the groups' missions, see the module; ``working`` is the objective that does a job."""
        founding = {(group.name, role.name) for group in self.groups.values() for role in group.roles if role.founding}

        def exists(facts: FactsLike, group: str, *args: str) -> bool:
            return group in self.groups and (self.groups[group].formed_by is None or bool(facts.get(("formed", group))))

        def is_to_come(facts: FactsLike, group: str) -> bool:
            return group in self.groups and not exists(facts, group)

        def has_role(facts: FactsLike, group: str, role: str, *args: str) -> bool:
            return (group, role) in founding or facts.get(("allocated", group)) is not None

        def assigned(facts: FactsLike, group: str, role: str, objective: str, argument: str) -> Mapping[Hashable, Any]:
            counts: dict[Hashable, Any] = {("objective", f"{group}.{role}.{objective}"): argument}
            if objective == working:
                return {**counts, self.jobs[argument].done: ANY}
            return {**counts, ("gatheredAt", group): argument} if objective == RENDEZ_VOUS else counts

        def expected(facts: FactsLike, group: str, role: str, objective: str, argument: str) -> Expected | None:
            if objective not in (working, RENDEZ_VOUS):
                return Expected()
            holders = facts.get(("members", f"{group}.{role}"))
            if not holders:
                return None
            data: VehicleData = facts.get(("data", holders[0]))
            if objective == RENDEZ_VOUS:
                way_m = distance(last_known_m(facts, data), self.rally_points_m[argument])
                time_s = way_m / data.transit_speed_mps
                return Expected(time_s, time_s * data.power_w(data.transit_speed_mps))
            return expected_of(facts, argument, data)

        forming = (
            Operator(FORM_GROUP, is_to_come, lambda facts, group: {("formed", group): True}),
            Operator(DISSOLVE_GROUP, exists, lambda facts, group: {("formed", group): False}),
        )
        return [
            Operator(GIVE_MISSION, exists, lambda facts, group, mission: {("given", f"{group}.{mission}"): True}),
            Operator(ALLOCATE_ROLES, exists, lambda facts, group, *lost: {("allocated", group): True}),
            Operator(ASSIGN_OBJECTIVE, has_role, assigned, expected=expected),
            *(forming if any(group.formed_by is not None for group in self.groups.values()) else ()),
        ]

    def activity_sets(self, objective: Objective, vehicle: str, facts: FactsLike) -> Pursuit:
        """Activity sets for one of the three objectives, and the facts on which they depend."""
        group = self.groups[objective.group]
        head_key = "members", f"{group.name}.{group.head_role}"
        match objective.name:
            case "GroupSupervision":
                keys = {("members", group.path(role.name)) for role in group.roles if role.founding} - {head_key}
                followers = tuple(sorted({name for key in keys for name in facts.get(key)}))
                following = Activity("Following", ActivityType.GUIDANCE, ("leader", followers, group.name))
                planner = Activity("MissionPlanner", ActivityType.PLANNING)
                watching = Activity("LeaderInformationGathering", ActivityType.ORGANISATIONAL)
                # Pending planning has priority over all but survival.
                planning = ActivitySet(objective, ActivityKind.COLLECTIVE, (planner,), 1.0)
                return (planning, self._set(objective, watching), self._set(objective, following)), frozenset(keys)
            case "MissionGathering":
                first, rests_on = self._first(group, vehicle, facts)
                following = Activity(
                    "Following", ActivityType.GUIDANCE, ("follower", facts.get(head_key), group.name, first)
                )
                return (self._set(objective, following),), rests_on | {head_key}
        first, rests_on = self._first(group, vehicle, facts)
        parameters = self.rally_points_m[objective.argument], group.name, first
        return (self._set(objective, Activity("Homing", ActivityType.GUIDANCE, parameters)),), rests_on

    def _first(self, group: Group, vehicle: str, facts: FactsLike) -> tuple[tuple[str, ...], frozenset[Key]]:
        """Groups of the vehicle that meet before this one, and the facts on which this depends."""
        roles = {
            other: {("members", self.groups[other].path(role.name)) for role in self.groups[other].roles}
            for other in self._before(group)
        }
        first = tuple(other for other, keys in roles.items() if any(vehicle in facts.get(key) for key in keys))
        return first, frozenset(key for keys in roles.values() for key in keys)

    def _set(self, objective: Objective, *activities: Activity) -> ActivitySet:
        importance = importance_of(self.importance, objective)
        return ActivitySet(objective, ActivityKind.COLLECTIVE, activities, importance)

    def behaviour(self, activity: Activity, data: VehicleData) -> Behaviour | None:
        """Return the behaviour of a rendezvous activity; None for other activities."""
        match activity.name:
            case "MissionPlanner":
                return Planning()
            case "LeaderInformationGathering":
                return Supervision(self.settings.patience_s)
            case "Homing":
                point_m, group, first = activity.parameters
                return Homing(point_m, self.settings.arrival_radius_m, group, data, after=first)
            case "Following" if activity.parameters[0] == "follower":
                _, leaders, group, first = activity.parameters
                return FollowingLeader(leaders, group, self.settings.follow_distance_m, data, first)
            case "Following":
                _, followers, group = activity.parameters
                return LeadingFollowers(followers, group, 2.0 * self.settings.follow_distance_m, data)
        return None

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """Return the finding that a leader's group has gathered: by received positions, by sonar, or overdue."""
        if group.rally_point is None or not self._is_there(group, motion.position_m, 0.0):
            return ()
        if picture.body.now_s < self.opens_s:
            return ()
        has_met = group.name in picture.groups.gathered
        # A group that met without a member meets again after its return.
        if has_met and self._is_complete(group, organisation, beliefs, picture):
            return ()
        is_overdue = not has_met and self.is_overdue(group, beliefs, picture)
        if not is_overdue and not self._all_are_there(group, organisation, beliefs, picture):
            return ()
        return (Finding(group.name, "gatheredAt", group.rally_point),)

    def _is_complete(self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture) -> bool:
        met_s = beliefs.observed_s(("gatheredAt", group.name))
        returned_s = (picture.groups.returned_s.get(name, -math.inf) for name in organisation.members(group.name))
        return met_s is not None and max(returned_s, default=-math.inf) <= met_s

    def met_s(self, group: Group, beliefs: Beliefs, picture: Picture) -> float | None:
        """Known time at which a group and all later ones have met; None before."""
        if not picture.groups.gathered:
            return None
        names = [group.name, *(name for name, before in self.meets_after.items() if group.name in before)]
        due = [name for name in names if self.groups[name].rally_point]
        if not picture.groups.gathered.issuperset(due):
            return None
        return max((beliefs.observed_s(("gatheredAt", name)) or 0.0 for name in due), default=None)

    def is_overdue(self, group: Group, beliefs: Beliefs, picture: Picture) -> bool:
        """True once a leader has waited for the deadline, idle and after earlier groups have met."""
        idle_s = picture.groups.idle_since_s.get(group.name, math.inf)
        since_s = max(picture.body.settled_s, idle_s, self.opens_s)
        for other in self._before(group):
            met_s = beliefs.observed_s(("gatheredAt", other))
            since_s = max(since_s, math.inf if met_s is None else met_s)
        return picture.body.now_s - since_s >= self.settings.meeting_deadline_s

    def _before(self, group: Group) -> tuple[str, ...]:
        return self.meets_after.get(group.name, ())

    @cached_property  # 1 to 2 % of a mission
    def meets_after(self) -> Mapping[str, tuple[str, ...]]:
        """Groups that meet before each group, by name."""
        return meets_after(group for group in self.groups.values() if group.formed_by is None)

    def _all_are_there(self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture) -> bool:
        n_heard, n_not_heard = 0, 0
        others = set(organisation.members(group.name)).difference(organisation.heads(group.name))
        # A leader alone waits for earlier groups, from which a member may still arrive.
        if not others and any(beliefs.observed_s(("gatheredAt", name)) is None for name in self._before(group)):
            return False
        late_s = picture.body.now_s - NEWS_FRAMES * picture.frame_s
        for name in others:
            observed_s, position_m = beliefs.observed_s(("position", name)), picture.peers.positions_m.get(name)
            if observed_s is None or position_m is None or observed_s < late_s:
                n_not_heard += 1
            elif self._is_there(group, position_m, HEARD_TOLERANCE_M):
                n_heard += 1
            else:
                return False
        n_seen = sum(self._is_there(group, contact_m, HEARD_TOLERANCE_M) for contact_m in picture.body.contacts_m)
        n_silent = 0  # an isolated vehicle meets with those present
        if not picture.groups.meets_unheard:
            n_silent = sum(heard_s < late_s for name, heard_s in picture.peers.heard_s.items() if name not in others)
        # Each contact stands for one vehicle: first for those received there, then for silent ones of other groups.
        return n_not_heard <= max(0, n_seen - n_heard - n_silent)

    def _is_there(self, group: Group, position_m: Point, tolerance_m: float) -> bool:
        x_m, y_m = self.rally_points_m[group.rally_point or ""]
        return length(position_m[0] - x_m, position_m[1] - y_m) <= self.settings.arrival_radius_m + tolerance_m
