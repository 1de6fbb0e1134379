"""The mission of the REMORAS paper, section VII: explore and map areas together, then meet.

Its tasks, top down. Missions become objectives of roles (the social layer plans them)::

    Supervision(group)   give the other groups their missions; meet at the rally point
    AreaMapping(group)   allocate roles; explore and map every area; meet at the rally point

Objectives become activities (each vehicle plans its own, with its own characteristics; Table II)::

    GroupSupervision  -> OrganisationalPerformanceOptimiser + MissionPlanner | LeaderInformationGathering
                         | GlobalReactiveNavigation + Following (Leader to ...)
    MissionGathering  -> PerformerSubordination | LocalReactiveNavigation + Following (Follower to ...)
    RendezVous(p)     -> GlobalReactiveNavigation + Homing(p)
    Exploring(area)   -> GlobalReactiveNavigation + ZigzagExploring(grid), while nobody has finished the area
    Mapping           -> Mapping, at the side of ZigzagExploring
    Positioning       -> GlobalReactiveNavigation + Positioning(place in the formation)

Activities that one method names side by side are performed simultaneously; ``|`` separates those that need not.
Nothing in here says when a vehicle turns from one to another: that is decided by motivations alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import (
    Behaviour,
    Evading,
    FollowingLeader,
    Homing,
    LeadingFollowers,
    Picture,
    Planning,
    Positioning,
    ReturningHome,
    ReturningToArea,
    Standing,
    Supervision,
    ZigzagExploring,
)
from remoras.beliefs import Beliefs, Key
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Method, Operator, Plan, Task, plan
from remoras.mission import Finding, Milestone
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.survey import Point, grid, zigzag

POSITIVE = Annotated[float, Field(gt=0.0)]
VITAL_IMPORTANCE = 3.0
"""Above anything that objectives, continuing and influence signals add up to."""
ROUTINE_IMPORTANCE = 0.1
HEARD_TOLERANCE_M = 1.0
"""A position heard is rounded on the wire."""
COLLECTIVE = frozenset({"RendezVous", "MissionGathering", "GroupSupervision", "Positioning"})


class Settings(BaseModel):
    """The ``[mission]`` table.

    Attributes:
        arrival_radius_m: a vehicle this near to a rally point has arrived.
        follow_distance_m: a follower lets the leader get this far ahead.
        formation_spacing_m: distance between places of the formation.
        patience_s: a leader is content if it heard news of the mission in this time.
        importance: by "Role.Objective" or "Objective".
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    arrival_radius_m: POSITIVE
    follow_distance_m: POSITIVE
    formation_spacing_m: POSITIVE
    patience_s: POSITIVE
    importance: dict[str, Annotated[float, Field(ge=0.0, le=1.0)]]


ACTIVITY_TYPES = {
    "OrganisationalPerformanceOptimiser": ActivityType.ORGANISATIONAL,
    "MissionPlanner": ActivityType.PLANNING,
    "LeaderInformationGathering": ActivityType.ORGANISATIONAL,
    "PerformerSubordination": ActivityType.ORGANISATIONAL,
    "GlobalReactiveNavigation": ActivityType.NAVIGATION,
    "LocalReactiveNavigation": ActivityType.NAVIGATION,
    "Following": ActivityType.GUIDANCE,
    "Homing": ActivityType.GUIDANCE,
    "Positioning": ActivityType.GUIDANCE,
    "ZigzagExploring": ActivityType.GUIDANCE,
    "Mapping": ActivityType.PRODUCTIVE,
    "SendingInfluenceSignals": ActivityType.COMMUNICATION,
    "CollisionAvoidance": ActivityType.SURVIVAL,
    "EnergyPreservation": ActivityType.SURVIVAL,
    "AreaKeeping": ActivityType.SURVIVAL,
    "Evading": ActivityType.GUIDANCE,
    "ReturningHome": ActivityType.GUIDANCE,
    "ReturningToArea": ActivityType.GUIDANCE,
}

LEADS_SET = ("Following", "Homing", "Positioning", "ZigzagExploring", "Evading", "ReturningHome", "ReturningToArea")
"""Activities whose behaviour speaks for the set they are performed in."""

ACTIVITY_NEEDS = {"Mapping": "ZigzagExploring"}


def _supervision_methods(groups: Sequence[Group]) -> list[Method]:
    def delegate(facts: FactsLike, group: str) -> list[Task]:
        own = next(g for g in groups if g.name == group)
        others = [g for g in groups if g.name != group]
        return [*(Task("GiveMission", (g.name, "AreaMapping")) for g in others), *_meeting(own)]

    return [Method("delegate the mapping", delegate)]


def _meeting(group: Group) -> list[Task]:
    """Objectives by which a group comes together: the head supervises, its other founding roles gather."""
    tasks = []
    for role in group.roles:
        if role.founding:
            if not role.head:
                tasks.append(Task("AssignObjective", (group.name, role.name, "MissionGathering", group.name)))
            if group.rally_point is not None:
                tasks.append(Task("AssignObjective", (group.name, role.name, "RendezVous", group.rally_point)))
    return tasks


def _mapping_methods(groups: Sequence[Group]) -> list[Method]:
    by_name = {group.name: group for group in groups}

    def unfinished(facts: FactsLike, group: Group) -> list[tuple[str, str]]:
        return [
            (role.name, role.area)
            for role in group.roles
            if role.area is not None and facts.get(("areaDone", role.area)) is None
        ]

    def together(facts: FactsLike, group: str) -> bool:
        return facts.get(("gatheredAt", group)) is not None

    def explore(facts: FactsLike, group: str) -> list[Task]:
        tasks = [Task("AllocateRoles", (group,))]
        for role, area in unfinished(facts, by_name[group]):
            tasks.append(Task("AssignObjective", (group, role, "Positioning", area)))
            tasks.append(Task("AssignObjective", (group, role, "Exploring", area)))
        for role in by_name[group].roles:
            if not role.founding and role.area is None:
                tasks.append(Task("AssignObjective", (group, role.name, "Mapping", group)))
        return [*tasks, *_meeting(by_name[group])]

    return [
        Method("stay together", lambda facts, group: [], together),
        Method(
            "explore, then meet", explore, lambda facts, group: bool(unfinished(facts, by_name[group]))
        ),
        Method("meet", lambda facts, group: _meeting(by_name[group])),
    ]


def _activity_domain() -> Domain:
    """Objectives into activities; every method sees the facts, its vehicle's data and where it is."""

    def activities(*names: str) -> Callable[..., list[Task]]:
        return lambda facts, *args: [Task(name, args) for name in names]

    def is_open(facts: FactsLike, context: Context) -> bool:
        objective = context.objective
        return (
            facts.get(("gatheredAt", objective.group)) is None
            and facts.get(("areaDone", objective.argument)) is None
        )

    def apart(facts: FactsLike, context: Context) -> bool:
        return facts.get(("gatheredAt", context.objective.group)) is None

    def has_sensor(facts: FactsLike, context: Context) -> bool:
        return context.data.swath_m > 0.0

    methods: dict[str, list[Method]] = {
        "PursueGroupSupervision": [
            Method("supervise", activities("Organising", "Watching", "Leading"))
        ],
        "Organising": [
            Method("optimise and plan", activities("OrganisationalPerformanceOptimiser", "MissionPlanner"))
        ],
        "Watching": [Method("gather information", activities("LeaderInformationGathering"))],
        "Leading": [Method("lead", activities("GlobalReactiveNavigation", "Following"))],
        "PursueMissionGathering": [Method("follow", activities("Obeying", "KeepingContact"))],
        "Obeying": [Method("obey", activities("PerformerSubordination"))],
        "KeepingContact": [Method("follow the leader", activities("LocalReactiveNavigation", "Following"))],
        "PursueRendezVous": [Method("home", activities("GlobalReactiveNavigation", "Homing"))],
        "PursueExploring": [
            Method(
                "zigzag",
                activities("GlobalReactiveNavigation", "ZigzagExploring"),
                lambda facts, context: has_sensor(facts, context) and is_open(facts, context),
            ),
            Method("nothing left to explore", activities()),
        ],
        "PursueMapping": [
            Method("map what is explored", activities("Mapping"),
                   lambda facts, context: has_sensor(facts, context) and apart(facts, context)),
            Method("nothing left to map", activities()),
        ],
        "PursuePositioning": [Method("take place", activities("GlobalReactiveNavigation", "Positioning"))],
    }  # fmt: skip
    return Domain.of([Operator(name) for name in ACTIVITY_TYPES], methods)


class Context:
    """What the activity domain's methods know of the vehicle that plans."""

    def __init__(self, objective: Objective, data: VehicleData) -> None:
        self.objective = objective
        self.data = data


class MappingRendezvous:
    """The mission, made from the parts of a scenario.

    Args:
        settings: the ``[mission]`` table.
        groups: groups with the demands of their roles.
        places: place in the formation (row, side) of positional roles, by (group, role).
        corners_m: corners of every area; rally_points_m: rally points by name.
        bounds_m: area of operations (x_min, y_min, x_max, y_max).
    """

    Settings = Settings
    MISSIONS = ("Supervision", "AreaMapping")

    def __init__(
        self,
        settings: Settings,
        groups: Sequence[Group],
        places: Mapping[tuple[str, str], tuple[str, str]],
        corners_m: Mapping[str, tuple[Point, ...]],
        rally_points_m: Mapping[str, Point],
        bounds_m: tuple[float, float, float, float],
    ) -> None:
        self.settings = settings
        self.groups = {group.name: group for group in groups}
        self.corners_m = corners_m
        self.rally_points_m = rally_points_m
        self._places = places
        self._bounds_m = bounds_m
        self.social_domain = Domain.of(
            [Operator("GiveMission"), Operator("AllocateRoles"), Operator("AssignObjective")],
            dict(zip(self.MISSIONS, (_supervision_methods(groups), _mapping_methods(groups)), strict=True)),
        )
        self._activity_domain = _activity_domain()

    def known_before(self, database: AUVDatabase) -> Mapping[Key, Any]:
        return {}

    def founding_objectives(self) -> Sequence[Objective]:
        return [
            Objective(group.name, role.name, "GroupSupervision", group.name)
            for group in self.groups.values()
            for role in group.roles
            if role.head
        ]

    def is_individual(self, objective: Objective) -> bool:
        return objective.name not in COLLECTIVE

    # Objectives into activities -------------------------------------------------------------------

    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        found = plan(self._activity_domain, facts, Task(f"Pursue{objective.name}", (Context(objective, data),)))
        if not isinstance(found, Plan):
            raise PlanningError(f"{data.name} has no way to pursue {objective}")
        together: dict[tuple[Any, ...], list[str]] = {}
        for step in found.steps:
            together.setdefault(tuple(task.name for task in step.ancestors), []).append(step.task.name)
        rests_on: set[Key] = set(found.rests_on)  # type: ignore[arg-type]  # keys of this package's facts
        sets = []
        for names in together.values():
            activities = []
            for name in names:
                parameters, keys = self._parameters(name, objective, data, facts, position_m)
                rests_on |= keys
                activities.append(Activity(name, ACTIVITY_TYPES[name], parameters))
            activities.sort(key=lambda activity: activity.name not in LEADS_SET)
            kind = ActivityKind.INDIVIDUAL if self.is_individual(objective) else ActivityKind.COLLECTIVE
            needs = next((ACTIVITY_NEEDS[name] for name in names if name in ACTIVITY_NEEDS), None)
            importance = self._importance(objective)
            if "MissionPlanner" in names:
                importance = 1.0  # to plan what is due comes before everything but survival
            sets.append(ActivitySet(objective, kind, tuple(activities), importance, needs))
        return tuple(sets), frozenset(rests_on)

    def _importance(self, objective: Objective) -> float:
        table = self.settings.importance
        return table.get(f"{objective.role}.{objective.name}", table.get(objective.name, 0.0))

    def _parameters(
        self, name: str, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[Any, ...], set[Key]]:
        """Parameters of an activity, and the facts looked up for them."""
        group = self.groups[objective.group]
        head_key = ("members", f"{group.name}.{group.head_role}")
        match name:
            case "ZigzagExploring":
                waypoints = zigzag(self.corners_m[objective.argument], data.swath_m, position_m)
                return (tuple(waypoints), grid(waypoints, data.swath_m)), set()
            case "Homing":
                return (self.rally_points_m[objective.argument], group.name), set()
            case "Following" if objective.name == "MissionGathering":
                return ("follower", facts.get(head_key)), {head_key}
            case "Following":
                keys = {("members", f"{group.name}.{role.name}") for role in group.roles if role.founding}
                keys.discard(head_key)
                followers = sorted({name for key in keys for name in facts.get(key)})
                return ("leader", tuple(followers), group.name), keys
            case "Positioning":
                place = self._places.get((group.name, objective.role), ("top", "middle"))
                return (place, facts.get(head_key), group.name), {head_key}
        return (), set()

    def standing_sets(self, data: VehicleData) -> tuple[ActivitySet, ...]:
        def vital(survival: str, guidance: str, navigation: str) -> ActivitySet:
            activities = tuple(Activity(name, ACTIVITY_TYPES[name]) for name in (guidance, survival, navigation))
            return ActivitySet(None, ActivityKind.VITAL, activities, VITAL_IMPORTANCE)

        sending = Activity("SendingInfluenceSignals", ActivityType.COMMUNICATION)
        return (
            ActivitySet(None, ActivityKind.INDIVIDUAL, (sending,), ROUTINE_IMPORTANCE),
            vital("CollisionAvoidance", "Evading", "LocalReactiveNavigation"),
            vital("EnergyPreservation", "ReturningHome", "GlobalReactiveNavigation"),
            vital("AreaKeeping", "ReturningToArea", "GlobalReactiveNavigation"),
        )

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        settings, parameters = self.settings, activity.parameters
        match activity.name:
            case "OrganisationalPerformanceOptimiser":
                return Planning()
            case "LeaderInformationGathering":
                return Supervision(settings.patience_s)
            case "ZigzagExploring":
                return ZigzagExploring(parameters[0], data)
            case "Homing":
                return Homing(parameters[0], settings.arrival_radius_m, parameters[1], data)
            case "Following" if parameters[0] == "follower":
                return FollowingLeader(parameters[1], settings.follow_distance_m, data)
            case "Following":
                return LeadingFollowers(parameters[1], parameters[2], 2.0 * settings.follow_distance_m)
            case "Positioning":
                (row, side), leaders, group = parameters
                ahead = {"top": 0.0, "bottom": -settings.formation_spacing_m}[row]
                left = {"left": 1.0, "middle": 0.0, "right": -1.0}[side] * settings.formation_spacing_m
                others = tuple(name for name in leaders if name != data.name)
                return Positioning(others, group, (ahead, left), data)
            case "Evading":
                return Evading(data)
            case "ReturningHome":
                return ReturningHome(data)
            case "ReturningToArea":
                x_min, y_min, x_max, y_max = self._bounds_m
                return ReturningToArea(((x_min + x_max) / 2.0, (y_min + y_max) / 2.0), data)
        return Standing()

    # What a leader concludes ----------------------------------------------------------------------

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        if group.rally_point is None or group.name in picture.gathered:
            return ()
        x_m, y_m = self.rally_points_m[group.rally_point]
        radius_m = self.settings.arrival_radius_m
        if math.hypot(motion.x_m - x_m, motion.y_m - y_m) > radius_m:
            return ()
        members = organisation.members(group.name)
        heard = [picture.positions.get(name) for name in members if name not in organisation.heads(group.name)]
        here = [
            position is not None
            and math.hypot(position[0] - x_m, position[1] - y_m) <= radius_m + HEARD_TOLERANCE_M
            for position in heard
        ]
        return (Finding(group.name, "gatheredAt", group.rally_point),) if here and all(here) else ()

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        return Finding(objective.argument, "areaDone", vehicle) if objective.name == "Exploring" else None

    def truth(self) -> MappingTruth:
        return MappingTruth(self)


class MappingTruth:
    """Watches the run: when consultation ends, who finishes or gives up, which group is together."""

    def __init__(self, mission: MappingRendezvous) -> None:
        self.milestones: list[Milestone] = []
        self._mission = mission
        self._consulted = False
        self._last_decision: dict[str, Any] = {}
        self._exploring: dict[str, bool] = {}
        self._stopped: dict[str, Milestone] = {}
        self._finished: set[Objective] = set()
        self._apart = [group for group in mission.groups.values() if group.rally_point is not None]

    def observe(self, fleet: Any, now_s: float) -> bool:
        if not self._consulted:
            if not self._is_consulted(fleet):
                return False
            self._consulted = True
            self.milestones.append(Milestone(now_s, "consultation_done"))
        self._watch_mapping(fleet, now_s)
        for group in list(self._apart):
            if self._is_together(fleet, group):
                self._apart.remove(group)
                self.milestones.append(Milestone(now_s, "gathered", group=group.name))
        if self._apart:
            return False
        self.milestones.append(Milestone(now_s, "mission_complete"))
        return True

    def close(self, fleet: Any, now_s: float) -> str:
        done = {milestone.vehicle for milestone in self.milestones if milestone.name == "mapping_done"}
        self.milestones += [stop for name, stop in self._stopped.items() if name not in done]
        self.milestones.sort(key=lambda milestone: milestone.time_s)
        if not self._consulted:
            return f"consultation had not ended after {now_s:.0f} s"
        if self._apart:
            names = ", ".join(group.name for group in self._apart)
            exhausted = [v.name for v in fleet.vehicles if v.functional.exhausted]
            why = f"; battery exhausted: {', '.join(exhausted)}" if exhausted else ""
            return f"not together after {now_s:.0f} s: {names}{why}"
        return ""

    @staticmethod
    def _is_consulted(fleet: Any) -> bool:
        """Has every mission been planned, and does everything assigned count where it was meant to?"""
        by_name = {vehicle.name: vehicle for vehicle in fleet.vehicles}
        for vehicle in fleet.vehicles:
            social = vehicle.social
            for group in social.organisation.groups:
                if social.leads(group) and group not in social.planned:
                    return False
            for a in social.issued:
                if not by_name[a.vehicle].social.organisation.plays(a.vehicle, a.group, a.role):
                    return False
            for objective in social.issued_objectives:
                for holder in social.organisation.members(objective.group, objective.role):
                    if objective not in by_name[holder].social.objectives_of(holder):
                        return False
        return True

    def _watch_mapping(self, fleet: Any, now_s: float) -> None:
        for vehicle in fleet.vehicles:
            decision = vehicle.executive.decision
            if decision is self._last_decision.get(vehicle.name):
                continue
            self._last_decision[vehicle.name] = decision
            exploring = any(
                vehicle.executive.sets[index].name == "ZigzagExploring" for index in decision.chosen
            )
            if exploring:
                self._stopped.pop(vehicle.name, None)
            elif self._exploring.get(vehicle.name):
                self._stopped[vehicle.name] = Milestone(now_s, "mapping_stopped", vehicle.name)
            self._exploring[vehicle.name] = exploring
            for objective in vehicle.social.finished:
                if objective.name == "Exploring" and objective not in self._finished:
                    self._finished.add(objective)
                    self.milestones.append(Milestone(now_s, "mapping_done", vehicle.name))

    def _is_together(self, fleet: Any, group: Group) -> bool:
        x_m, y_m = self._mission.rally_points_m[group.rally_point or ""]
        radius_m = self._mission.settings.arrival_radius_m
        members = [v for v in fleet.vehicles if v.social.organisation.is_member(v.name, group.name)]
        return all(
            math.hypot(v.functional.motion.x_m - x_m, v.functional.motion.y_m - y_m) <= radius_m for v in members
        )
