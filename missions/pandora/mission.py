"""Pandora mission: inspection, cleaning and valve turning at an underwater structure.

Plan of a service by each vehicle (``mission.adaptation`` sets how much of it is used)::

    PursueServicing(part)  ->  Find, Do
    Find(valve)            ->  Looking                     | Seeking     if it is a HiddenPart
    Do(valve)              ->  Turning                     | Wrenching   if it is a StuckValve
    Do(anode)              ->  Cleaning
    Do(panel or chain)     ->  Inspecting

An alternative behind a bar follows the failure of the one before. Its condition is inferred, by the definitions of the
vocabulary, from what the failure asserted. Steps with valid effects are not repeated.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault, one_of
from missions.figure import Place
from missions.meeting.job_mission import JobMission, names_apart, with_job_roles, with_needs
from missions.meeting.meeting import expected_of
from missions.pandora.part_actions import (
    Acting,
    InspectingPart,
    Looking,
    Seeking,
    WorkingOnPart,
    Wrenching,
)
from missions.pandora.scenario import ANY_VALVE, KINDS, TOLD, URGENCY, PandoraScenario, job_of
from missions.pandora.structure import (
    LOOKS,
    TURNS,
    ArmSettings,
    CameraSettings,
    LogSettings,
    PlannedPart,
    Structure,
    WrenchSettings,
    planned_parts,
    structure_of,
)
from missions.pandora.truth import FIGURES, MET, METRICS, SERVICED, PandoraTruth
from missions.scenarios.fleet import sensors_of
from missions.scenarios.organisation import Role
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.htn import ANY, Domain, FactsLike, Method, Operator, Task
from remoras.mission import ABILITIES, PURSUE
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.table import PointM
from remoras.work import Point

APART_M = 2.5  # least distance between parts, so that a tool touches only one
SEEN_APART_M = 0.5  # least distance between inspected points: the tolerance of station keeping


def _key_of(kind: str, name: str) -> str:
    return f"{kind}.{name}.{'points_m' if kind == 'chain' else 'position_m'}"


def _tools(scenario: PandoraScenario) -> Iterator[ConfigurationFault]:
    carried = {table.get("type", "camera") for vehicle in scenario.vehicle for table in vehicle.sensor}
    demanded = {"camera": tuple(KINDS), "arm": ("valve", "anode")}
    for kind, parts in demanded.items():
        name = next((part.name for part_kind, part in scenario.parts if part_kind in parts), None)
        if name is not None and carried and kind not in carried:
            allowed = f'no vehicle has one, and the plan demands it for {name}; allowed: type = "{kind}" in one'
            yield ConfigurationFault("vehicle.sensor", kind, allowed)


def _too_near(places: Sequence[tuple[str, str, PointM]], least_m: float) -> Iterator[ConfigurationFault]:
    for number, (kind, name, at_m) in enumerate(places):
        for _, other, other_m in places[:number]:
            if distance(at_m, other_m) < least_m:
                allowed = f"{distance(at_m, other_m):.3g} m from {other}; allowed: {least_m:g} m or more"
                yield ConfigurationFault(_key_of(kind, name), str(list(at_m)), allowed)


def _upsets(scenario: PandoraScenario) -> Iterator[ConfigurationFault]:
    valves_m, seen = {valve.name: valve.position_m for valve in scenario.valve}, set[str]()
    west_m, south_m, east_m, north_m = scenario.world.box_m
    for number, upset in enumerate(scenario.upset, 1):
        key = f"upset.{number}"
        yield from one_of(f"{key}.part", upset.part, [*valves_m, ANY_VALVE])
        if upset.part != ANY_VALVE and upset.part in seen:
            yield ConfigurationFault(f"{key}.part", "", "is upset already; allowed: one upset for each valve")
        seen.add(upset.part)
        places_m = [at_m for name, at_m in valves_m.items() if upset.part in (ANY_VALVE, name)]
        rooms_m = [min(x - west_m, east_m - x, y - south_m, north_m - y) for x, y in places_m]
        if upset.distance_m is not None and 0.0 < min(rooms_m, default=0.0) < upset.distance_m:
            allowed = f"at most {min(rooms_m):g}: beyond, the valve may lie outside of the world"
            yield ConfigurationFault(f"{key}.distance_m", "", allowed)
    if len(scenario.upset) > len(valves_m):
        allowed = f"each affects another valve, and there are {len(valves_m)}"
        yield ConfigurationFault("upset", f"{len(scenario.upset)} tables", allowed)


ACTIONS: Mapping[str, tuple[type[Acting], tuple[type[SensorSettings], ...]]] = {
    "Looking": (Looking, (CameraSettings, LogSettings)),
    "Seeking": (Seeking, (CameraSettings, LogSettings)),
    "Inspecting": (InspectingPart, (CameraSettings, LogSettings)),
    "Turning": (WorkingOnPart, (CameraSettings, LogSettings, ArmSettings)),
    "Cleaning": (WorkingOnPart, (CameraSettings, LogSettings, ArmSettings)),
    "Wrenching": (Wrenching, (CameraSettings, LogSettings, WrenchSettings)),
}
"""Elementary tasks: their behaviour and the kinds of sensors switched on."""
FINDING = ("Looking", "Seeking")
BY_KIND = {"Valve": "Turning", "Anode": "Cleaning", "Panel": "Inspecting", "Chain": "Inspecting"}
OBSERVED_PER_PART = 400  # upper limit of observations per part and vehicle, besides periodic ones


class PandoraMission(JobMission):
    """Pandora mission, built from a scenario."""

    Scenario = PandoraScenario
    group_missions = ("Maintenance",)
    objective, kind = "Servicing", "ServiceTask"
    needs = (*JobMission.needs, "objectiveServicing", "jobDone")
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), ABILITIES)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {
        "camera": CameraSettings, "log": LogSettings, "arm": ArmSettings, "wrench": WrenchSettings,
    }  # fmt: skip
    tables = (*JobMission.tables, LOOKS, TURNS, SERVICED, MET)
    metrics = METRICS
    figures = FIGURES
    scenario: PandoraScenario

    def __init__(self, scenario: PandoraScenario) -> None:
        # ``super().__init__`` calls ``jobs_of``, which reads the parts.
        self._parts = planned_parts(scenario)
        super().__init__(scenario)

    @classmethod
    def completed(cls, scenario: PandoraScenario) -> PandoraScenario:
        if not scenario.parts:
            return scenario
        roles = [Role(name=f"Servicer of {p.name}", maximum=1, job=job_of(p.name)) for _, p in scenario.parts]
        completed = with_job_roles(scenario, roles, {}, able=lambda vehicle: bool(vehicle.sensor))
        return with_needs(completed, dict.fromkeys(TOLD, URGENCY))

    @classmethod
    def check(cls, scenario: PandoraScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        if not scenario.parts:
            tables = ", ".join(f"[[{kind}]]" for kind in KINDS)
            yield ConfigurationFault("panel", "", f"there is nothing to be serviced: give one of {tables}")
        yield from names_apart(scenario, tuple(KINDS))
        for kind, part in scenario.parts:
            if part.name == ANY_VALVE:
                yield ConfigurationFault(f"{kind}.{part.name}.name", "", "stands for a valve that is drawn")
        placed = [(kind, part.name, at_m) for kind, part in scenario.parts for at_m in part.points_m]
        yield from scenario.world.outside((_key_of(kind, name), at_m) for kind, name, at_m in placed)
        yield from _too_near([place for place in placed if place[0] in ("valve", "anode")], APART_M)
        yield from _too_near([place for place in placed if place[0] in ("panel", "chain")], SEEN_APART_M)
        yield from _tools(scenario)
        panels = [panel.name for panel in scenario.panel]
        for valve in scenario.valve:
            yield from one_of(f"valve.{valve.name}.panel", valve.panel, panels)
        yield from _upsets(scenario)

    def jobs_of(self, scenario: PandoraScenario) -> Iterable[PlannedPart]:
        return self._parts.values()

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [key for part in self._parts.values() for key in ((part.kind, part.of), (self.kind, part.name))]

    @property
    def places(self) -> Sequence[Place]:
        parts = (Place(part.name, part.kind.lower(), part.points_m) for part in self._parts.values())
        return [*self.rally_places, *parts]

    @property
    def instances_found_per_vehicle(self) -> int:
        """One focus area per valve."""
        return sum(part.kind == "Valve" for part in self._parts.values())

    @property
    def most_observations(self) -> int:
        every_s = [
            sensor.every_s
            for vehicle in self.scenario.vehicle
            for sensor in sensors_of(vehicle, self.sensors)
            if isinstance(sensor, CameraSettings | LogSettings)
        ]
        n_readings = self.scenario.scenario.duration_s / min(every_s, default=20.0)
        return int(8 * n_readings) + OBSERVED_PER_PART * len(self._parts)

    def world(self, seed: int) -> Structure:
        return structure_of(self._parts, self.scenario.upset, seed)

    def truth(self, recorder: Recorder, world: Structure) -> PandoraTruth:
        return PandoraTruth(self.meeting, self.objective, recorder, world, self._parts)

    # Plans ---------------------------------------------------------------------------------------

    @property
    def activity_domain(self) -> Domain:
        """Decomposition of a service, see the module; task arguments are the job and vehicle data."""
        assesses, repairs = self.scenario.mission.assesses, self.scenario.mission.repairs

        def is_fit(facts: FactsLike, data: VehicleData) -> bool:
            return not facts.get(("isA", f"{data.name}.UnfitVehicle"))

        def is_hidden(facts: FactsLike, job: str, data: VehicleData) -> bool:
            return is_fit(facts, data) and bool(facts.get(("isA", f"{self._parts[job].of}.HiddenPart")))

        def has(facts: FactsLike, data: VehicleData, kind: type[SensorSettings], tool: str) -> bool:
            return data.sensor(kind) is not None and facts.get(("toolDead", data.name)) not in (tool, "both")

        def is_stuck(facts: FactsLike, job: str, data: VehicleData) -> bool:
            has_wrench = has(facts, data, WrenchSettings, "wrench")
            return has_wrench and is_fit(facts, data) and bool(facts.get(("isA", f"{self._parts[job].of}.StuckValve")))

        def is_planned(facts: FactsLike, job: str, data: VehicleData) -> bool:
            return not (repairs and self._parts[job].takes_arm) or has(facts, data, ArmSettings, "arm")

        def is_left(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
            ends = self._parts[objective.argument].done, ("gatheredAt", objective.group)
            return all(facts.get(key) is None for key in ends)

        def is_placed(facts: FactsLike, job: str, data: VehicleData) -> bool:
            return not self._is_found_first(job) or facts.get(("placedAt", self._parts[job].of)) is not None

        def serve(facts: FactsLike, objective: Objective, data: VehicleData) -> list[Task]:
            args = objective.argument, data
            return [Task("Find", args), Task("Do", args)] if self._is_found_first(args[0]) else [Task("Do", args)]

        def effects(job: str, name: str) -> Mapping[Hashable, Any]:
            return {("placedAt", self._parts[job].of): ANY} if name in FINDING else {self._parts[job].done: ANY}

        def operator(name: str) -> Operator:
            return Operator(
                name,
                (lambda facts, job, data: True) if name in FINDING else is_placed,
                lambda facts, job, data: effects(job, name),
                expected=expected_of,
            )

        def by_kind(facts: FactsLike, job: str, data: VehicleData) -> list[Task]:
            return [Task(BY_KIND[self._parts[job].kind], (job, data))]

        seek = Method("seek in the focus area", lambda facts, *args: [Task("Seeking", args)], is_hidden, ("Seeking",))
        force = Method("with the wrench", lambda facts, *args: [Task("Wrenching", args)], is_stuck, ("Wrenching",))
        find = Method("where the plan has it", lambda facts, *args: [Task("Looking", args)], uses=("Looking",))
        do = Method("as planned", by_kind, is_planned, uses=tuple(sorted(set(BY_KIND.values()))))
        return Domain.of(
            [operator(name) for name in ACTIONS],
            {
                f"{PURSUE}{self.objective}": [
                    Method("serve", serve, is_left, ("Find", "Do") if assesses else ("Do",)),
                    Method("nothing left", lambda facts, *args: [], lambda facts, *args: not is_left(facts, *args), ()),
                ],
                "Find": [find, seek] if repairs else [find],
                "Do": [do, force] if repairs else [do],
            },
        )

    def _is_found_first(self, job: str) -> bool:
        # Only valves may be displaced; a plan without assessment trusts their planned places.
        return self.scenario.mission.assesses and self._parts[job].kind == "Valve"

    def activities(
        self,
        steps: Sequence[Sequence[Task]],
        objective: Objective,
        data: VehicleData,
        facts: FactsLike,
        position_m: Point,
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        importance = self.importance_of(objective)
        sets = []
        for task in (task for together in steps for task in together):
            kinds = ACTIONS[task.name][1]
            sensors = tuple(sensor.name for sensor in data.sensors if isinstance(sensor, kinds))
            activity = Activity(task.name, ActivityType.GUIDANCE, (objective.argument,), sensors)
            sets.append(ActivitySet(objective, ActivityKind.INDIVIDUAL, (activity,), importance))
        return tuple(sets), frozenset({("gatheredAt", objective.group)})

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        behaviour = self.meeting.behaviour(activity, data)
        if behaviour is not None:
            return behaviour
        make, _ = ACTIONS[activity.name]
        return make(self._parts[activity.parameters[0]], data, self.scenario)

    def behaviour_at(self, job: Any, data: VehicleData) -> Behaviour:
        return ACTIONS[BY_KIND[job.kind]][0](job, data, self.scenario)
