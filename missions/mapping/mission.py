"""Mission mapping: areas surveyed in zigzags, and the rendezvous after it.

Its tasks, top down. Missions become objectives of roles (the social layer plans them)::

    Supervision(group)   give the other groups their missions; meet at the rally point
    AreaMapping(group)   allocate roles; explore and map every area; inspect what is found; meet at the rally point;
                         where a group is declared for that: form it once something is found, dissolve it in the end
    Inspection(group)    of a group formed at sea: recruit members, and allocate what is found among them

Objectives become activities (each vehicle plans its own, with its own characteristics; Table II)::

    GroupSupervision  -> OrganisationalPerformanceOptimiser + MissionPlanner | LeaderInformationGathering
                         | Following (Leader to ...)
    MissionGathering  -> Following (Follower to ...)
    RendezVous(p)     -> Homing(p)
    Exploring(area)   -> ZigzagExploring(area), while nobody has finished the area
    Mapping           -> Mapping, at the side of ZigzagExploring
    Inspecting(find)  -> Inspecting(find), while nobody has inspected it
    Positioning       -> Positioning(place in the formation)

Activities that one method names side by side are performed simultaneously; ``|`` separates those that need not.
Nothing in here says when a vehicle turns from one to another: that is decided by motivations alone.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Self

from missions.errors import ConfigurationFault
from missions.figure import Declared, Place
from missions.mapping.behaviours import MappingAlong, WorkLeft, ZigzagExploring, formation_of, positioning, room_of
from missions.mapping.detections import (
    Inspecting,
    InspectionJob,
    find_names,
    inspecting,
    seabed_with_finds,
    weight_in_cells,
    with_inspectors,
)
from missions.mapping.ground import grounds_of
from missions.mapping.jobs import SurveyJob, swaths_of
from missions.mapping.metrics import FIGURES, METRICS, places
from missions.mapping.scenario import NEEDED_OBJECTIVES, Area, FindsTable, MappingScenario, MappingSettings
from missions.mapping.sensors import (
    COVERAGE,
    FOUND_PER_OBJECT,
    MOST_LOOKS,
    ClassifierSettings,
    Seabed,
    SeaObject,
    SwathSettings,
    seabed_of,
)
from missions.mapping.survey import contains, overlap
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
from missions.meeting.meeting import OBJECTIVES, Meeting, importance_of
from missions.metric import Metric
from missions.scenarios.organisation import FORMATION_WORDS
from missions.scenarios.parts import database_of, groups_of
from missions.scenarios.tables import one_of, place_error_m
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour, Homing
from remoras.beliefs import Beliefs, Key, Known
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Task
from remoras.mission import Finding, Mission
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.work import Point

MAX_CELLS = 4096
"""Cells of one area that ``mappedCell`` can name."""


def mapping_faults(scenario: MappingScenario, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    """All faults of areas, of roles that explore them, of importances, and of the goal.

    Args:
        scenario: the whole input.
        missions: names of missions, which no area may have.
    """
    found = list(_of_tables(scenario, missions))
    yield from found or [*_overlaps(scenario), *_goal(scenario)]


def _of_tables(scenario: MappingScenario, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Faults of everything but overlaps and the goal, which can be judged only where there are none."""
    yield from _names(scenario, missions)
    corners = [(f"area.{area.name}.corners_m", at_m) for area in scenario.area for at_m in area.corners_m]
    yield from scenario.world.outside(corners)
    yield from _areas(scenario)
    yield from _explorers(scenario)
    yield from _mappers(scenario)
    yield from _finds(scenario)
    for key in scenario.mission.importance:
        role, dot, _ = key.rpartition(".")
        names = [f"{group}.{name}" if "." in role else name for group, name in scenario.roles]
        if dot:
            yield from one_of(f"mission.importance.{key}", role, names)


def _names(scenario: MappingScenario, missions: Sequence[str]) -> Iterator[ConfigurationFault]:
    others = scenario.taken_names()
    forms_groups = any(group.formed_by is not None for group in scenario.group)
    if forms_groups and (kind := scenario.taken_names("area").get(INSPECTION)):
        yield ConfigurationFault(f"{kind}.{INSPECTION}.name", "", "is the name of a mission")
    for name, count in Counter(area.name for area in scenario.area).items():
        if count > 1 or name in others:
            allowed = f"used {count + (name in others)} times; areas need names of their own"
            yield ConfigurationFault(f"area.{name}.name", "", allowed)
        if name in missions:
            yield ConfigurationFault(f"area.{name}.name", "", "is the name of a mission")


def _areas(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """Areas too deep for every vehicle with a sensor, or of too many cells."""
    cell_m, limits_m = scenario.world.cell_m, [one.depth_limit_m for one in scenario.vehicle if one.sensor]
    deepest_m = max(limits_m, default=0.0)
    for area in scenario.area:
        if area.depth_m is not None and area.depth_m > deepest_m:
            allowed = f"too deep for every vehicle with a sensor: allowed: above 0 to depth_limit_m = {deepest_m:g}"
            yield ConfigurationFault(f"area.{area.name}.depth_m", "", allowed)
        n_cells = _n_cells(area.corners_m, cell_m)
        if not 1 <= n_cells <= MAX_CELLS:
            given, allowed = f"{n_cells} cells of {cell_m} m", f"allowed: 1 to {MAX_CELLS}; change world.cell_m"
            yield ConfigurationFault(f"area.{area.name}.corners_m", given, allowed)


def _overlaps(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """Areas on the same ground: its cells would be work twice over, and each would be mapped for two areas."""
    for number, area in enumerate(scenario.area):
        for other in scenario.area[:number]:
            if overlap(area.corners_m, other.corners_m):
                allowed = f"on the same ground as {other.name}: areas may share a border, and no more; move one of them"
                yield ConfigurationFault(f"area.{area.name}.corners_m", "", allowed)


def _n_cells(corners: Sequence[tuple[float, float]], cell_m: float) -> int:
    """Cells of an area; where there are far too many, about how many."""
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    in_box = (max(xs) - min(xs)) * (max(ys) - min(ys)) / (cell_m * cell_m)
    return int(in_box) if in_box > 4 * MAX_CELLS else len(Seabed.of_areas(cell_m, {"": tuple(corners)}).cells)


def _explorers(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """Roles whose area is not there, or that nobody with a mapping sensor is able to play."""
    jobs = [*(area.name for area in scenario.area), *find_names(scenario.n_finds)]
    for (group, name), role in scenario.roles.items():
        key, able = f"group.{group}.role.{name}", scenario.able_to_play(group, name)
        yield from one_of(f"{key}.job", role.job, jobs)
        if role.job is not None and able and not any(vehicle.sensor for vehicle in able):
            allowed = "explores an area, but no vehicle able to play it has a [vehicle.sensor]"
            yield ConfigurationFault(key, "", allowed)


def _mappers(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """Groups with fewer places for those who map than vehicles that may explore: somebody would explore in vain.

    Whoever has a role without a job, which none has from the start, maps what it explores.
    """
    for group in scenario.group:
        exploring = [role.name for role in group.role if role.job is not None]
        mapping = [role for role in group.role if role.job is None and not role.founding]
        limits = [role.maximum for role in mapping if role.maximum is not None]
        can_explore = [
            one for one in scenario.vehicle if one.sensor and any(one.can_play(group.name, name) for name in exploring)
        ]
        n_places, n_able = sum(limits), len(can_explore)
        if mapping and len(limits) == len(mapping) and n_places < n_able:
            allowed = (
                f"allowed: {n_able - n_places + limits[-1]} or more, or none; "
                f"{n_able} vehicles may explore, and only the holder of such a role maps"
            )
            key = f"group.{group.name}.role.{mapping[-1].name}.maximum"
            yield ConfigurationFault(key, str(limits[-1]), allowed)


def _finds(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """More finds than there are cells, names that are taken, and a radius larger than a cell."""
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
    finds = find_names(number)
    if scenario.area and not {role.job for role in scenario.roles.values()}.issuperset(finds):
        allowed = "nobody would inspect them: give a group a role with an area, and no role of its own named Inspector1"
        yield ConfigurationFault("finds.number", "", allowed)
    for name, kind in scenario.taken_names("area").items():
        if name in finds:
            yield ConfigurationFault(f"{kind}.{name}.name", "", "is the name of a find; rename it")


def _goal(scenario: MappingScenario) -> Iterator[ConfigurationFault]:
    """A goal that asks for more cells than the areas have that some vehicle is able to map."""
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
    """True if a vehicle with a sensor that stands its depth is able to play a role with the area."""
    roles = [key for key, role in scenario.roles.items() if role.job == area.name]
    able = (vehicle for role in roles for vehicle in scenario.able_to_play(*role) if vehicle.sensor)
    return any(vehicle.depth_limit_m >= (area.depth_m or 0.0) for vehicle in able)


COLLECTIVE = frozenset({*OBJECTIVES, "Positioning"})

ACTIVITY_TYPES = {
    "Positioning": ActivityType.GUIDANCE,
    "ZigzagExploring": ActivityType.GUIDANCE,
    "Inspecting": ActivityType.GUIDANCE,
    "Mapping": ActivityType.PRODUCTIVE,
}

LEADS_SET = ("Positioning", "ZigzagExploring")
"""Activities whose behaviour speaks for the set they are performed in."""

SENSING = ("Mapping", "Inspecting")
"""Activities that switch the sensors of a vehicle on."""

NO_FINDS = FindsTable.usual()
FINDS_WORDS = Path(__file__).with_name("finds.ttl")

SENSORS: Mapping[str, type[SensorSettings]] = {"mapping": SwathSettings, "classifier": ClassifierSettings}
"""Kinds of sensors that scenarios name shortly."""

ACTIVITY_NEEDS = {"Mapping": "ZigzagExploring"}


class MappingMission(Mission):
    """The mission, made from the parts of a scenario.

    Args:
        settings: the ``[mission]`` table.
        groups: groups with the demands of their roles.
        formation: place in the formation (row, side) of positional roles, by (group, role).
        room_m: least distance of such a place from each vehicle, by name.
        corners_m: corners of every area, by name; rally_points_m: rally points by name.
        cell_m: side of a seabed cell.
        swaths_m: of the vehicles that are able to map each area, by name of area and vehicle.
        places: what pictures show.
        finds: what may be found.
        find_weight: cells that a find counts for in the goal.
        depths_m: of the areas that are deep, by name.
        objects: that lie in the sea.
        fix_m: error that vehicles come to in the time of a fix; 0 where they make none.
    """

    Scenario = MappingScenario
    group_missions = MISSIONS
    delegating_mission = SUPERVISION
    needs = ("playsRole", "hasMission", "position", "gatheredAt", *(f"objective{name}" for name in NEEDED_OBJECTIVES))
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), FINDS_WORDS, FORMATION_WORDS)
    sensors = SENSORS
    tables = (COVERAGE, GOAL)
    metrics: ClassVar[tuple[Metric, ...]] = METRICS
    figures: ClassVar[tuple[Declared, ...]] = FIGURES

    def __init__(
        self,
        settings: MappingSettings,
        groups: Sequence[Group],
        formation: Mapping[tuple[str, str], tuple[str, str]],
        room_m: Mapping[str, float],
        corners_m: Mapping[str, tuple[Point, ...]],
        rally_points_m: Mapping[str, Point],
        cell_m: float,
        swaths_m: Mapping[str, Mapping[str, float]],
        places: Sequence[Place],
        finds: FindsTable,
        find_weight: float,
        depths_m: Mapping[str, float],
        objects: Sequence[SeaObject],
        fix_m: float,
    ) -> None:
        self.settings = settings
        self.groups = {group.name: group for group in groups}
        self.corners_m = corners_m
        self.rally_points_m = rally_points_m
        self.formation, self._room_m, self._cell_m = formation, room_m, cell_m
        self._places, self.swaths_m = places, swaths_m
        grounds = grounds_of(cell_m, tuple(corners_m.items()), fix_m)
        self._surveys = {
            name: SurveyJob(name, corners, (), grounds[name], depth_m=depths_m.get(name, 0.0))
            for name, corners in corners_m.items()
        }
        self.finds, self._find_weight, self._objects = finds, find_weight, tuple(objects)
        self._inspections = {name: InspectionJob(name, finds.mean_stay_s) for name in find_names(finds.number)}
        self._unfinished = partial(Unfinished, goal=settings.goal, finds=self._inspections)
        self._unfinished_by_all = self._unfinished(self._surveys.values())
        self.meeting = Meeting(
            self.groups,
            rally_points_m,
            settings.arrival_radius_m,
            settings.follow_distance_m,
            settings.patience_s,
            settings.meeting_deadline_s,
            settings.importance,
        )

    @classmethod
    def from_scenario(cls, scenario: MappingScenario) -> Self:
        """The mission of a scenario."""
        groups, database = groups_of(scenario), database_of(scenario, cls)
        depths_m = {area.name: area.depth_m or 0.0 for area in scenario.area}
        swaths_m = swaths_of(groups, database, depths_m)
        mapping = {name for of_area in swaths_m.values() for name in of_area}
        finds, mappers = scenario.finds or NO_FINDS, [data for data in database.values() if data.name in mapping]
        return cls(
            scenario.mission,
            groups,
            formation_of(scenario),
            room_of(database.values(), scenario.guidance.separation_m),
            {area.name: area.corners_m for area in scenario.area},
            {rally.name: rally.position_m for rally in scenario.rally_point},
            scenario.world.cell_m,
            swaths_m,
            places(scenario),
            finds,
            weight_in_cells(finds, scenario.world.cell_m, mappers),
            depths_m,
            [thing.lying() for thing in scenario.object],
            place_error_m(scenario, mappers) or 0.0,
        )

    @classmethod
    def completed(cls, scenario: MappingScenario) -> MappingScenario:
        """With a role for everything that may be found."""
        return with_inspectors(scenario)

    @classmethod
    def check(cls, scenario: MappingScenario) -> Iterable[ConfigurationFault]:
        """What is wrong with areas, with the roles that explore them, and with importances."""
        return mapping_faults(scenario, cls.group_missions)

    @cached_property
    def social_domain(self) -> Domain:
        """Supervision and AreaMapping into objectives of roles."""
        return social_domain(self.groups, self.meeting, self.jobs, self._inspections)

    @property
    def jobs(self) -> Mapping[str, SurveyJob | InspectionJob]:
        """A survey for each area, and an inspection for everything that may be found."""
        return {**self._surveys, **self._inspections}

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        """The areas, what may be found, and the mission of groups that are formed for it."""
        given = [("Mission", INSPECTION)] if _forms(self.groups) else []
        return [*(("Area", area) for area in self.corners_m), *(("Find", find) for find in self._inspections), *given]

    @property
    def vocabulary_used(self) -> tuple[Path, ...]:
        """Without the words for finds where there is nothing to be found, and those for groups where none is formed."""
        used = {FINDS_WORDS: self._inspections, FORMATION_WORDS: _forms(self.groups)}
        return tuple(path for path in self.vocabulary if used.get(path, True))

    @property
    def instances_found_per_vehicle(self) -> int:
        """As many as a vehicle may take for different ones of the objects that lie in the sea."""
        return FOUND_PER_OBJECT * len(self._objects)

    @property
    def most_observations(self) -> int:
        """A vehicle maps every cell once at the most, finds and inspects everything once, and looks at objects."""
        return len(self._seabed.cells) + 2 * len(self._inspections) + MOST_LOOKS * len(self._objects)

    def world(self, seed: int) -> Seabed:
        """The cells of all areas, and what lies in them in the run with that seed."""
        return seabed_with_finds(self._seabed, self.finds, seed, self._objects)

    @cached_property
    def _seabed(self) -> Seabed:
        return seabed_of(self._cell_m, tuple(self.corners_m.items()))

    def truth(self, recorder: Recorder, world: Seabed) -> MappingTruth:
        """Keeps the map of what was really covered, and watches for the ends of surveys and for meetings."""
        return MappingTruth(self.meeting, world, self.swaths_m, self.settings.goal, recorder, self._find_weight)

    @property
    def places(self) -> Sequence[Place]:
        """Areas and rally points."""
        return self._places

    def founding_objectives(self) -> Sequence[Objective]:
        """Heads supervise their groups; what the holder of a role with a find is to do needs no word."""
        return [*self.meeting.founding_objectives(), *inspecting(self.groups.values(), self._inspections)]

    def is_individual(self, objective: Objective) -> bool:
        """True for exploring and mapping."""
        return objective.name not in COLLECTIVE

    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        """Those of the meeting; the others are planned, see ``activities``."""
        return self.meeting.activity_sets(objective, data.name, facts)

    @cached_property
    def activity_domain(self) -> Domain:
        """Exploring, mapping, inspecting and positioning into activities."""
        return activity_domain(self.jobs)

    def activities(
        self,
        steps: Sequence[Sequence[Task]],
        objective: Objective,
        data: VehicleData,
        facts: FactsLike,
        position_m: Point,
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        """Activities of Table II, with the vehicle's own characteristics."""
        rests_on: set[Key] = set()
        sets = []
        for names in ([step.name for step in together] for together in steps):
            activities = []
            for name in names:
                parameters, keys = _parameters(self, name, objective, data, facts, position_m)
                rests_on |= keys
                activities.append(Activity(name, ACTIVITY_TYPES[name], parameters, _switched_on(name, data)))
            activities.sort(key=lambda activity: activity.name not in LEADS_SET)
            kind = ActivityKind.INDIVIDUAL if self.is_individual(objective) else ActivityKind.COLLECTIVE
            needs = next((ACTIVITY_NEEDS[name] for name in names if name in ACTIVITY_NEEDS), None)
            importance = importance_of(self.settings.importance, objective)
            sets.append(ActivitySet(objective, kind, tuple(activities), importance, needs))
        return tuple(sets), frozenset(rests_on)

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """The behaviour that carries out the set which ``activity`` leads."""
        settings, parameters = self.settings, activity.parameters
        unfinished = self._unfinished(_own(self._surveys, self.swaths_m, data.name))
        match activity.name:
            case "Homing":
                point_m, group, first = parameters
                return Homing(point_m, settings.arrival_radius_m, group, data, unfinished.answers, first)
            case "Mapping":
                return MappingAlong(settings.patience_s, self._work(*parameters))
            case "ZigzagExploring":
                area, group, others = parameters
                return ZigzagExploring(self._surveys[area], data, self._work(group), others=others)
            case "Inspecting":
                return Inspecting(parameters[0], self.finds, data)
            case "Positioning":
                place, leaders, group = parameters
                return positioning(place, leaders, group, data, settings.formation_spacing_m, self._room_m)
        if (found := self.meeting.behaviour(activity, data)) is not None:
            return AfterWork(found, unfinished)
        raise _unknown(activity.name)

    def is_enough(self, facts: Known) -> bool:
        """True if no more is left than the goal spares, and every find is inspected."""
        return not self._unfinished_by_all.is_work_left(facts)

    def _work(self, group: str) -> WorkLeft:
        """What is left of the areas of a group."""
        jobs = [self._surveys[role.job] for role in self.groups[group].roles if role.job in self._surveys]
        return WorkLeft(jobs, self.settings.half_left)

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """A head at the rally point that has lately heard all others there takes the group for gathered.

        As long as a find is known that nobody has inspected, an area given anew is not done, or all others seem to be
        absent and an area is not done, it waits, but not beyond the deadline or its patience. A group that was formed
        to inspect does not meet. After a meeting see ``given_anew``.
        """
        if group.formed_by is not None:
            return ()
        found = self.meeting.findings(group, organisation, beliefs, picture, motion) or given_anew(
            group, organisation, self._surveys, self.meeting, beliefs, picture
        )
        if not found or self.meeting.is_overdue(group, beliefs, picture):
            return found
        of = [other for other in self.groups.values() if group.name in (other.name, other.formed_by)]
        is_left = (
            is_open_again(group, self._surveys, beliefs)
            or (is_alone_with_work(group, organisation, self._surveys, beliefs) and not picture.groups.meets_unheard)
            or any(waiting(beliefs, other, self._inspections) for other in of)
        )
        return () if is_left else found

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        """An area that is explored is done."""
        return Finding(objective.argument, "areaDone", vehicle) if objective.name == "Exploring" else None


def _parameters(
    mission: MappingMission, name: str, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
) -> tuple[tuple[Any, ...], set[Key]]:
    """Parameters of an activity, and the facts looked up for them."""
    group = mission.groups[objective.group]
    head_key = ("members", f"{group.name}.{group.head_role}")
    match name:
        case "ZigzagExploring":
            if (role := group.role(objective.role)) is None or role.maximum == 1:
                return (objective.argument, group.name, ()), set()
            holders_key = ("members", group.path(objective.role))
            others = _at_it_before(
                mission.corners_m[objective.argument], data.name, facts.get(holders_key), facts, position_m
            )
            return (objective.argument, group.name, others), {holders_key}
        case "Mapping":
            return (group.name,), set()
        case "Inspecting":
            return (objective.argument,), set()
        case "Positioning":
            place = mission.formation.get((group.name, objective.role), ("top", "middle"))
            return (place, facts.get(head_key), group.name), {head_key}
    raise _unknown(name)


def _own(
    surveys: Mapping[str, SurveyJob], swaths_m: Mapping[str, Mapping[str, float]], vehicle: str
) -> Iterable[SurveyJob]:
    """Surveys that a vehicle is able to do: it may hear of no others; all, if it is able to do none."""
    return [job for name, job in surveys.items() if vehicle in swaths_m[name]] or surveys.values()


def _forms(groups: Mapping[str, Group]) -> bool:
    """True if some of the groups are formed at sea."""
    return any(group.formed_by is not None for group in groups.values())


def _unknown(activity: str) -> PlanningError:
    return PlanningError(f"activity {activity!r} has no behaviour; allowed: {', '.join(ACTIVITY_TYPES)}")


def _at_it_before(
    corners_m: Sequence[Point], me: str, holders: Sequence[str], facts: FactsLike, position_m: Point
) -> tuple[str, ...]:
    """Vehicles that are at an area before this one: none if it is there itself; else those that are, else who is
    listed before it."""
    if contains(corners_m, position_m):
        return ()
    positions_m = {name: facts.get(("position", name)) for name in holders if name != me}
    there = tuple(name for name, at_m in positions_m.items() if at_m is not None and contains(corners_m, at_m))
    return there or tuple(holders[: holders.index(me)] if me in holders else ())


def _switched_on(activity: str, data: VehicleData) -> tuple[str, ...]:
    """Names of the sensors that an activity of the vehicle switches on: all that it has, while it maps or inspects."""
    if activity not in SENSING or data.sensor(SwathSettings) is None:
        return ()
    return tuple(sensor.name for sensor in data.sensors)
