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
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, field_validator

from missions.mapping.survey import Point, grid, zigzag
from missions.mapping.tasks import Context, activity_domain, mapping_methods, supervision_methods
from missions.mapping.truth import MappingTruth
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
    Working,
    ZigzagExploring,
)
from remoras.beliefs import Beliefs, Key
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Operator, Plan, Task, plan
from remoras.mission import Finding
from remoras.motion import Motion
from remoras.organisation import Group, Organisation

VITAL_IMPORTANCE = 3.0
"""Above anything that objectives, continuing and influence signals add up to."""
ROUTINE_IMPORTANCE = 0.1
HEARD_TOLERANCE_M = 1.0
"""A position heard is rounded on the wire."""
NEWS_FRAMES = 20.0
"""A position heard more TDMA frames ago does not tell where a vehicle is: meanwhile it may have left for work.

Of a vehicle that is heard in one frame of five, 0.8^20 = 1 % of such intervals bring nothing.
"""
NEEDED_OBJECTIVES = ("MissionGathering", "RendezVous", "Exploring", "Mapping")
"""Without an importance for these nothing would come of the mission."""
OBJECTIVES = (*NEEDED_OBJECTIVES, "GroupSupervision", "Positioning")
COLLECTIVE = frozenset({"RendezVous", "MissionGathering", "GroupSupervision", "Positioning"})


class MappingSettings(BaseModel):
    """The ``[mission]`` table."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    arrival_radius_m: float = Field(gt=0.0, description="a vehicle this near to a rally point has arrived")
    follow_distance_m: float = Field(gt=0.0, description="a follower lets its leader get this far ahead")
    formation_spacing_m: float = Field(gt=0.0, description="distance between places of the formation")
    patience_s: float = Field(
        gt=0.0, description="a leader is content if news came in this time, a worker if its work yielded something"
    )
    importance: dict[str, Annotated[float, Field(ge=0.0, le=1.0)]] = Field(
        description="importance of objectives, by Role.Objective or by Objective"
    )

    @field_validator("importance")
    @classmethod
    def _known_objectives(cls, importance: dict[str, float]) -> dict[str, float]:
        named = {key: key.split(".")[-1] for key in importance}
        unknown = [key for key, objective in named.items() if objective not in OBJECTIVES]
        missing = [objective for objective in NEEDED_OBJECTIVES if objective not in named.values()]
        if unknown or missing:
            faults = [f"{key} is none" for key in unknown] + [f"{objective} is missing" for objective in missing]
            raise ValueError(f"importance of objectives {', '.join(OBJECTIVES)}: {'; '.join(faults)}")
        return importance


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

LEADS_SET = (
    "Following",
    "Homing",
    "Positioning",
    "ZigzagExploring",
    "Evading",
    "ReturningHome",
    "ReturningToArea",
)
"""Activities whose behaviour speaks for the set they are performed in."""

ACTIVITY_NEEDS = {"Mapping": "ZigzagExploring"}


class MappingRendezvous:
    """The mission, made from the parts of a scenario.

    Args:
        settings: the ``[mission]`` table.
        groups: groups with the demands of their roles.
        places: place in the formation (row, side) of positional roles, by (group, role).
        corners_m: corners of every area; rally_points_m: rally points by name.
        bounds_m: area of operations (x_min, y_min, x_max, y_max); cell_m: side of a seabed cell.
    """

    Settings = MappingSettings
    MISSIONS = ("Supervision", "AreaMapping")
    DELEGATING_MISSION = "Supervision"
    NEEDS = ("playsRole", "hasMission", "position", "gatheredAt", *(f"objective{name}" for name in NEEDED_OBJECTIVES))

    def __init__(
        self,
        settings: MappingSettings,
        groups: Sequence[Group],
        places: Mapping[tuple[str, str], tuple[str, str]],
        corners_m: Mapping[str, tuple[Point, ...]],
        rally_points_m: Mapping[str, Point],
        bounds_m: tuple[float, float, float, float],
        cell_m: float,
    ) -> None:
        self.settings = settings
        self.groups = {group.name: group for group in groups}
        self.corners_m = corners_m
        self.rally_points_m = rally_points_m
        supervised = tuple(g.name for g in groups if g.mission is None and g.rally_point is not None)
        self.meets_after = {g.name: supervised if g.mission is not None else () for g in groups}
        self._places = places
        self._bounds_m = bounds_m
        self._cell_m = cell_m
        self.social_domain = Domain.of(
            [Operator("GiveMission"), Operator("AllocateRoles"), Operator("AssignObjective")],
            dict(zip(self.MISSIONS, (supervision_methods(groups), mapping_methods(groups)), strict=True)),
        )
        self._activity_domain = activity_domain(ACTIVITY_TYPES)

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
        rests_on: set[Key] = set(found.rests_on)
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
                inset_m = min(data.swath_m, self._cell_m) / 2.0
                waypoints = zigzag(self.corners_m[objective.argument], data.swath_m, position_m, inset_m)
                return (tuple(waypoints), grid(waypoints, data.swath_m)), set()
            case "Homing":
                return (self.rally_points_m[objective.argument], group.name), set()
            case "Following" if objective.name == "MissionGathering":
                return ("follower", facts.get(head_key)), {head_key}
            case "Following":
                keys = {("members", group.path(role.name)) for role in group.roles if role.founding}
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
            case "Mapping":
                return Working(settings.patience_s)
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
                if side == "middle":
                    ahead -= settings.formation_spacing_m  # behind the leader, not in its place
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
        for name in set(organisation.members(group.name)).difference(organisation.heads(group.name)):
            observed_s, position = beliefs.observed_s(("position", name)), picture.positions.get(name)
            if observed_s is None or position is None or picture.now_s - observed_s > NEWS_FRAMES * picture.frame_s:
                return ()
            if math.hypot(position[0] - x_m, position[1] - y_m) > radius_m + HEARD_TOLERANCE_M:
                return ()
        return (Finding(group.name, "gatheredAt", group.rally_point),)

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        return Finding(objective.argument, "areaDone", vehicle) if objective.name == "Exploring" else None

    def truth(self) -> MappingTruth:
        return MappingTruth(self.groups.values(), self.rally_points_m, self.settings.arrival_radius_m)
