"""Mapping mission: zigzag surveys of areas, then a rendezvous.

Missions decompose into objectives of roles (planned by the social layer)::

    Supervision(group)   give the other groups their missions; meet at the rally point
    AreaMapping(group)   allocate roles; explore and map every area; inspect finds; meet at the rally point;
                         with a group declared for inspections: form it after the first find, dissolve it at the end
    Inspection(group)    of a group formed at run time: recruit members, allocate finds among them

Objectives decompose into activities (planned by each vehicle; Table II), besides those of
``missions.meeting.meeting``::

    Exploring(area)   -> ZigzagExploring(area), while the area is unfinished
    Mapping           -> Mapping, beside ZigzagExploring
    Inspecting(find)  -> Inspecting(find), while uninspected
    Positioning       -> Positioning(place in the formation)

The activities of one method are performed simultaneously.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from missions.errors import ConfigurationFault, one_of
from missions.figure import Place, Tiles
from missions.mapping.behaviours import MappingAlong, WorkLeft, ZigzagExploring, formation_of, positioning, room_of
from missions.mapping.detections import (
    INSPECTING,
    Inspecting,
    InspectionJob,
    inspecting,
    seabed_with_finds,
    weight_in_cells,
    with_inspectors,
)
from missions.mapping.jobs import SurveyJob, ground_of, grounds_of, swaths_of
from missions.mapping.metrics import FIGURES, METRICS
from missions.mapping.scenario import STATED_OBJECTIVES, Area, FindsTable, MappingScenario
from missions.mapping.sensors import (
    COVERAGE,
    FOUND_PER_OBJECT,
    MOST_LOOKS,
    ClassifierSettings,
    Seabed,
    SwathSettings,
    mapping_sensor,
    seabed_of,
)
from missions.mapping.tasks import (
    INSPECTION,
    MISSIONS,
    SUPERVISION,
    AfterWork,
    Unfinished,
    activity_domain,
    given_anew,
    is_alone_with_work,
    is_open_again,
    social_domain,
    waiting,
)
from missions.mapping.truth import GOAL, MappingTruth
from missions.meeting.job_mission import JobMission, importance_faults, names_apart, numbered
from missions.meeting.meeting import GATHERING, OBJECTIVES, RENDEZ_VOUS, importance_of
from missions.meeting.survey import contains, overlap
from missions.scenarios.features import place_error_m
from missions.scenarios.fleet import database_of
from missions.scenarios.organisation import FORMATION_WORDS, groups_of
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour
from remoras.beliefs import Beliefs, Key, Known
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Task
from remoras.mission import Finding
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.work import Job, Point

MAX_CELLS = 4096  # largest number of cells per area that ``mappedCell`` can encode


def _of_tables(scenario: MappingScenario, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Yield all faults except overlaps and the goal, which presume valid tables."""
    yield from _names(scenario, missions)
    corners = [(f"area.{area.name}.corners_m", at_m) for area in scenario.area for at_m in area.corners_m]
    yield from scenario.world.outside(corners)
    yield from _areas(scenario)
    yield from _explorers(scenario)
    yield from _mappers(scenario)
    yield from _finds(scenario)
    yield from _importances(scenario)


def _importances(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    importance, finds = scenario.mission.importance, numbered("find", scenario.n_finds)
    yield from importance_faults(scenario, (*OBJECTIVES, "Exploring", "Mapping", "Positioning", INSPECTING))
    meet = {group.name for group in scenario.group if group.formed_by is None}
    for (group, name), role in scenario.roles.items():
        meeting = ([RENDEZ_VOUS] if role.head else [RENDEZ_VOUS, GATHERING]) if group in meet else []
        work = ["Mapping" if role.job is None else INSPECTING if role.job in finds else "Exploring"]
        for objective in meeting if role.founding else work:
            keys = objective, f"{name}.{objective}", f"{group}.{name}.{objective}"
            if importance.keys().isdisjoint(keys):
                allowed = f"missing; allowed: 0, never pursued, to 1, for the role or as {objective} for all roles"
                yield ConfigurationFault(f"mission.importance.{keys[1]}", "", allowed)


def _names(scenario: MappingScenario, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    forms_groups = any(group.formed_by is not None for group in scenario.group)
    if forms_groups and (kind := scenario.taken_names("area").get(INSPECTION)):
        yield ConfigurationFault(f"{kind}.{INSPECTION}.name", "", "is the name of a mission")
    yield from names_apart(scenario, ("area",))
    for name in dict.fromkeys(area.name for area in scenario.area if area.name in missions):
        yield ConfigurationFault(f"area.{name}.name", "", "is the name of a mission")


def _areas(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    cell_m, limits_m = scenario.world.cell_m, [v.depth_limit_m for v in scenario.vehicle if v.sensor]
    deepest_m = max(limits_m, default=0.0)
    for area in scenario.area:
        if area.depth_m is not None and area.depth_m > deepest_m:
            allowed = f"too deep for every vehicle with a sensor: allowed: above 0 to depth_limit_m = {deepest_m:g}"
            yield ConfigurationFault(f"area.{area.name}.depth_m", "", allowed)
        n_cells = _n_cells(area.corners_m, cell_m)
        if not 1 <= n_cells <= MAX_CELLS:
            size, allowed = f"{n_cells} cells of {cell_m} m", f"allowed: 1 to {MAX_CELLS}; change world.cell_m"
            yield ConfigurationFault(f"area.{area.name}.corners_m", size, allowed)


def _overlaps(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    for number, area in enumerate(scenario.area):
        for other in scenario.area[:number]:
            if overlap(area.corners_m, other.corners_m):
                allowed = f"on the same ground as {other.name}: areas may share a border, and no more; move one of them"
                yield ConfigurationFault(f"area.{area.name}.corners_m", "", allowed)


def _n_cells(corners: Sequence[tuple[float, float]], cell_m: float) -> int:
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    # An oversized area is refused in any case; listing its cells first could exhaust the memory.
    in_box = (max(xs) - min(xs)) * (max(ys) - min(ys)) / (cell_m * cell_m)
    return int(in_box) if in_box > 4 * MAX_CELLS else len(ground_of(tuple(corners), cell_m).cells)


def _explorers(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    jobs = [*(area.name for area in scenario.area), *numbered("find", scenario.n_finds)]
    for (group, name), role in scenario.roles.items():
        key, able = f"group.{group}.role.{name}", scenario.able_to_play(group, name)
        yield from one_of(f"{key}.job", role.job, jobs)
        if role.job is not None and able and not any(vehicle.sensor for vehicle in able):
            allowed = "explores an area, but no vehicle able to play it has a [vehicle.sensor]"
            yield ConfigurationFault(key, "", allowed)


def _mappers(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """Yield faults: groups with fewer mapping places (roles without a job) than explorers."""
    for group in scenario.group:
        exploring = [role.name for role in group.role if role.job is not None]
        mapping = [role for role in group.role if role.job is None and not role.founding]
        limits = [role.maximum for role in mapping if role.maximum is not None]
        can_explore = [
            v for v in scenario.vehicle if v.sensor and any(v.can_play(group.name, name) for name in exploring)
        ]
        n_places, n_able = sum(limits), len(can_explore)
        # A single role without a limit has room for every explorer.
        if mapping and len(limits) == len(mapping) and n_places < n_able:
            allowed = (
                f"allowed: {n_able - n_places + limits[-1]} or more, or none; "
                f"{n_able} vehicles may explore, and only the holder of such a role maps"
            )
            key = f"group.{group.name}.role.{mapping[-1].name}.maximum"
            yield ConfigurationFault(key, str(limits[-1]), allowed)


def _finds(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    cell_m, number = scenario.world.cell_m, scenario.n_finds
    if scenario.finds is None or not number:
        return
    if scenario.finds.close_radius_m > cell_m:
        allowed = f"allowed: 2 to world.cell_m = {cell_m:g}; a find may lie as far from where it was seen"
        yield ConfigurationFault("finds.close_radius_m", "", allowed)
    n_cells = sum(_n_cells(area.corners_m, cell_m) for area in scenario.area)
    if number > n_cells:
        allowed = f"allowed: 0 to {n_cells}, the cells of all areas, each of which holds one at most"
        yield ConfigurationFault("finds.number", "", allowed)
    finds = numbered("find", number)
    if scenario.area and not {role.job for role in scenario.roles.values()}.issuperset(finds):
        allowed = "no vehicle inspects them: give a group a role with an area, and no role of its own named Inspector1"
        yield ConfigurationFault("finds.number", "", allowed)
    for name, kind in scenario.taken_names("area").items():
        if name in finds:
            yield ConfigurationFault(f"{kind}.{name}.name", "", "is the name of a find; rename it")


def _goal(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    goal, areas = scenario.mission.goal, tuple((area.name, area.corners_m) for area in scenario.area)
    n_cells = {name: len(ground.cells) for name, ground in grounds_of(scenario.world.cell_m, areas).items()}
    lacking = [area.name for area in scenario.area if not _is_able_to_map(scenario, area)]
    n_all = sum(n_cells.values())
    n_reached = n_all - sum(n_cells[name] for name in lacking)
    if n_reached < goal * n_all:
        allowed = (
            f"out of reach: no vehicle with a sensor is able to play a role with the job {', '.join(lacking)}; "
            f"allowed: above 0 to {math.floor(1000.0 * n_reached / n_all) / 1000.0:g}, the share of the other areas"
        )
        yield ConfigurationFault("mission.goal", str(goal), allowed)


def _is_able_to_map(scenario: MappingScenario, area: Area) -> bool:
    roles = [key for key, role in scenario.roles.items() if role.job == area.name]
    able = (vehicle for role in roles for vehicle in scenario.able_to_play(*role) if vehicle.sensor)
    return any(vehicle.depth_limit_m >= (area.depth_m or 0.0) for vehicle in able)


ACTIVITY_TYPES = {
    "Positioning": ActivityType.GUIDANCE,
    "ZigzagExploring": ActivityType.GUIDANCE,
    "Inspecting": ActivityType.GUIDANCE,
    "Mapping": ActivityType.PRODUCTIVE,
}

SENSING = ("Mapping", "Inspecting")

NO_FINDS = FindsTable.usual()
FINDS_WORDS = Path(__file__).with_name("finds.ttl")

SENSORS: Mapping[str, type[SensorSettings]] = {"mapping": SwathSettings, "classifier": ClassifierSettings}


class MappingMission(JobMission):
    """Mapping mission, built from a scenario."""

    Scenario = MappingScenario
    group_missions = MISSIONS
    delegating_mission = SUPERVISION
    objective = "Exploring"
    collective = ("Positioning",)
    needs = ("playsRole", "hasMission", "position", "gatheredAt", *(f"objective{name}" for name in STATED_OBJECTIVES))
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), FINDS_WORDS, FORMATION_WORDS)
    sensors = SENSORS
    tables = (COVERAGE, GOAL)
    metrics = METRICS
    figures = FIGURES
    scenario: MappingScenario

    def __init__(self, scenario: MappingScenario) -> None:
        groups, database = groups_of(scenario), database_of(scenario, type(self))
        depths_m = {area.name: area.depth_m or 0.0 for area in scenario.area}
        self.swaths_m = swaths_of(groups, database, depths_m)
        mapping = {name for of_area in self.swaths_m.values() for name in of_area}
        mappers = [data for data in database.values() if data.name in mapping]
        self.corners_m = {area.name: area.corners_m for area in scenario.area}
        # ``super().__init__`` calls ``jobs_of``, which reads the attributes set here.
        self.formation = formation_of(scenario)
        self._room_m = room_of(database.values(), scenario.guidance.separation_m)
        fix_m = place_error_m(scenario, mappers) or 0.0
        grounds = grounds_of(scenario.world.cell_m, tuple(self.corners_m.items()), fix_m)
        self._surveys = {
            name: SurveyJob(name, corners, (), grounds[name], depth_m=depths_m[name])
            for name, corners in self.corners_m.items()
        }
        self.finds = finds = scenario.finds or NO_FINDS
        self._find_weight = weight_in_cells(finds, scenario.world.cell_m, mappers)
        self._inspections = {name: InspectionJob(name, finds.mean_stay_s) for name in numbered("find", finds.number)}
        self._forms_groups = any(group.formed_by is not None for group in groups)
        self._goal_known = partial(Unfinished, goal=scenario.mission.goal, finds=self._inspections)
        self._unfinished_by_all = self._goal_known(self._surveys.values())
        super().__init__(scenario)
        self._work_left = {
            name: WorkLeft(
                [self._surveys[role.job] for role in group.roles if role.job in self._surveys],
                scenario.mission.half_left,
            )
            for name, group in self.groups.items()
        }

    @classmethod
    def completed(cls, scenario: MappingScenario) -> MappingScenario:
        return with_inspectors(scenario)

    @classmethod
    def check(cls, scenario: MappingScenario) -> Iterable[ConfigurationFault]:
        return list(_of_tables(scenario, cls.group_missions)) or [*_overlaps(scenario), *_goal(scenario)]

    @property
    def social_domain(self) -> Domain:
        return social_domain(self.meeting, self._inspections)

    def jobs_of(self, scenario: MappingScenario) -> Iterable[Job]:
        return [*self._surveys.values(), *self._inspections.values()]

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        extra = [("Mission", INSPECTION)] if self._forms_groups else []
        return [*(("Area", area) for area in self.corners_m), *(("Find", find) for find in self._inspections), *extra]

    @property
    def vocabulary_used(self) -> tuple[Path, ...]:
        """Vocabulary without the terms for finds and formed groups if the scenario has none."""
        used = {FINDS_WORDS: self._inspections, FORMATION_WORDS: self._forms_groups}
        return tuple(path for path in self.vocabulary if used.get(path, True))

    @property
    def instances_found_per_vehicle(self) -> int:
        return FOUND_PER_OBJECT * len(self.scenario.object)

    @property
    def most_observations(self) -> int:
        return len(self._seabed.cells) + 2 * len(self._inspections) + MOST_LOOKS * len(self.scenario.object)

    def world(self, seed: int) -> Seabed:
        return seabed_with_finds(self._seabed, self.finds, seed, self.scenario.object)

    @property
    def _seabed(self) -> Seabed:
        return seabed_of(self.scenario.world.cell_m, tuple(self.corners_m.items()))

    def truth(self, recorder: Recorder, world: Seabed) -> MappingTruth:
        return MappingTruth(self.meeting, world, self.swaths_m, self.scenario.mission.goal, recorder, self._find_weight)

    @property
    def places(self) -> Sequence[Place]:
        places = self.rally_places
        for name, job in self._surveys.items():
            tiles = Tiles(job.on.cell_m, job.on.cells, "mappedCell", COVERAGE.name, ("cell_x", "cell_y"))
            corners_m = tuple((float(x), float(y)) for x, y in job.corners_m)
            places.append(Place(name, "area to map", corners_m, tiles))
        return places

    def founding_objectives(self) -> Sequence[Objective]:
        """Supervision of the groups by their leaders, and the inspections, which need no order."""
        return [*super().founding_objectives(), *inspecting(self.groups.values(), self._inspections)]

    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        return self.meeting.activity_sets(objective, data.name, facts)

    @property
    def activity_domain(self) -> Domain:
        return activity_domain(self.jobs)

    def activities(
        self,
        steps: Sequence[Sequence[Task]],
        objective: Objective,
        data: VehicleData,
        facts: FactsLike,
        position_m: Point,
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        rests_on: set[Key] = set()
        sets = []
        kind = ActivityKind.INDIVIDUAL if self.is_individual(objective) else ActivityKind.COLLECTIVE
        importance = importance_of(self.meeting.importance, objective)
        for name in (task.name for together in steps for task in together):
            parameters, keys = self._parameters(name, objective, data, facts, position_m)
            rests_on |= keys
            activity = Activity(name, ACTIVITY_TYPES[name], parameters, _switched_on(name, data))
            needs = "ZigzagExploring" if name == "Mapping" else None
            sets.append(ActivitySet(objective, kind, (activity,), importance, needs))
        return tuple(sets), frozenset(rests_on)

    def _parameters(
        self, name: str, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[Any, ...], set[Key]]:
        group = self.groups[objective.group]
        head_key = ("members", f"{group.name}.{group.head_role}")
        match name:
            case "ZigzagExploring":
                # A sole explorer has no other to keep away from, so its plan depends on no holder.
                if (role := group.role(objective.role)) is None or role.maximum == 1:
                    return (objective.argument, group.name, ()), set()
                holders_key = ("members", group.path(objective.role))
                others = _at_it_before(
                    self.corners_m[objective.argument], data.name, facts.get(holders_key), facts, position_m
                )
                # Positions are no part of the dependencies: each received one would restart the survey.
                return (objective.argument, group.name, others), {holders_key}
            case "Mapping":
                return (group.name,), set()
            case "Inspecting":
                return (objective.argument,), set()
            case "Positioning":
                place = self.formation.get((group.name, objective.role), ("top", "middle"))
                return (place, facts.get(head_key), group.name), {head_key}
        raise _unknown(name)

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        settings, parameters = self.scenario.mission, activity.parameters
        match activity.name:
            case "Mapping":
                return MappingAlong(settings.patience_s, self._work_left[parameters[0]], mapping_sensor(data))
            case "ZigzagExploring":
                area, group, others = parameters
                return ZigzagExploring(self._surveys[area], data, self._work_left[group], others)
            case "Inspecting":
                return Inspecting(parameters[0], self.finds, data)
            case "Positioning":
                place, leaders, group = parameters
                return positioning(place, leaders, group, data, settings.formation_spacing_m, self._room_m)
        if (behaviour := self.meeting.behaviour(activity, data)) is not None:
            # Needs follow from groups, so that a vehicle may receive no facts about areas that it cannot map.
            own = [job for name, job in self._surveys.items() if data.name in self.swaths_m[name]]
            return AfterWork(behaviour, self._goal_known(own or self._surveys.values()))
        raise _unknown(activity.name)

    def is_enough(self, facts: Known) -> bool:
        """Return True if the goal tolerates the remaining cells and every find is inspected."""
        return not self._unfinished_by_all.holds(facts)

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """Return the leader's finding that its group has gathered, or orders that reassign areas.

        Until the deadline, it waits while a find is uninspected, a reassigned area is unfinished, or all others are
        absent before the end of the work.
        """
        # A group formed for inspections is dissolved by its parent and has no rendezvous.
        if group.formed_by is not None:
            return ()
        findings = self.meeting.findings(group, organisation, beliefs, picture, motion) or given_anew(
            group, organisation, self._surveys, self.meeting, self._unfinished_by_all, beliefs, picture
        )
        if not findings or self.meeting.is_overdue(group, beliefs, picture):
            return findings
        groups = [other for other in self.groups.values() if group.name in (other.name, other.formed_by)]
        is_left = (
            is_open_again(group, self._surveys, beliefs)
            or (is_alone_with_work(group, organisation, self._surveys, beliefs) and not picture.groups.meets_unheard)
            or any(waiting(beliefs, other, self._inspections) for other in groups)
        )
        return () if is_left else findings


def _unknown(activity: str) -> PlanningError:
    return PlanningError(f"activity {activity!r} has no behaviour; allowed: {', '.join(ACTIVITY_TYPES)}")


def _at_it_before(
    corners_m: Sequence[Point], me: str, holders: Sequence[str], facts: FactsLike, position_m: Point
) -> tuple[str, ...]:
    if contains(corners_m, position_m):
        return ()
    positions_m = {name: facts.get(("position", name)) for name in holders if name != me}
    inside = tuple(name for name, at_m in positions_m.items() if at_m is not None and contains(corners_m, at_m))
    return inside or tuple(holders[: holders.index(me)] if me in holders else ())


def _switched_on(activity: str, data: VehicleData) -> tuple[str, ...]:
    if activity not in SENSING or data.sensor(SwathSettings) is None:
        return ()
    return tuple(sensor.name for sensor in data.sensors)
