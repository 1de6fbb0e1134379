"""Trident mission: a submerged vehicle with an arm and a surface vehicle recover a target."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from missions.errors import ConfigurationFault, one_of, repeated
from missions.figure import Mark, Place, Tiles
from missions.meeting.job_mission import JobMission, names_apart, with_needs
from missions.meeting.meeting import Pursuit
from missions.meeting.truth import JOBS
from missions.scenarios.features import locating
from missions.scenarios.fleet import database_of, inferred_classes, sensors_of
from missions.scenarios.knowledge import words_in
from missions.trident.behaviours import (
    AwaitingPartner,
    Escorting,
    Intervening,
    Missing,
    Ranging,
    Reacquiring,
    Surveying,
)
from missions.trident.conclusions import Concluding
from missions.trident.jobs import (
    MISSING,
    RANGING,
    REACQUIRING,
    SERVING,
    STANDING_BY,
    SURVEYING,
    WORKING,
    BlockSurvey,
    RecoveryJob,
    activity_domain,
)
from missions.trident.scenario import ActivityTable, BlockTable, TridentScenario
from missions.trident.services import (
    ATTEMPTS,
    CHARTED,
    CHOOSE,
    FOUND_PER_OBJECT,
    MOST_LOOKS,
    SURVEY,
    EffectorSettings,
    FinderSettings,
    FixerSettings,
    Matching,
    ModuleSettings,
    SeabedBlock,
    Site,
    SurveyorSettings,
    lying,
)
from missions.trident.truth import CHOREOGRAPHY, FIGURES, METRICS, TridentTruth, unsound
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour
from remoras.beliefs import Beliefs
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Task
from remoras.mission import ABILITIES, Finding, Mission
from remoras.motion import Motion
from remoras.organisation import Organisation
from remoras.picture import Picture
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.work import Job, Point
from worldmodel import TBox

SERVICE = "Service"
MOST_TILES = 1024  # largest number of tiles per block that ``chartedTile`` can encode


def _blocks(scenario: TridentScenario) -> Iterator[ConfigurationFault]:
    tile_m, before = scenario.mission.tile_m, list[BlockTable]()
    yield from names_apart(scenario, ("block",), [scenario.recovery.name])
    for block in scenario.block:
        key, ((west, east), (south, north)) = f"block.{block.name}", (block.x_m, block.y_m)
        yield from scenario.world.outside((f"{key}.x_m, y_m", at_m) for at_m in ((west, south), (east, north)))
        if (east - west) * (north - south) / (tile_m * tile_m) > MOST_TILES:
            yield ConfigurationFault(key, "", f"more than {MOST_TILES} tiles; allowed: a greater mission.tile_m")
        for other in before:
            (w, e), (s, n) = other.x_m, other.y_m
            if west < e and w < east and south < n and s < north:
                yield ConfigurationFault(key, "", f"overlaps block {other.name}; allowed: blocks side by side")
        before.append(block)


# Services


def _services(scenario: TridentScenario, mission: type[Mission], tbox: TBox) -> Iterator[ConfigurationFault]:
    named = {ontology_class.name: ontology_class.uid for ontology_class in tbox.classes}
    kinds = sorted(tbox.classes[uid].name for uid in tbox.subclasses(named[SERVICE]))
    modules = {
        f"{vehicle.name} {module.name}": (vehicle, module)
        for vehicle in scenario.vehicle
        for module in sensors_of(vehicle, mission.sensors)
        if isinstance(module, ModuleSettings)
    }
    offered = {
        name: inferred_classes(tbox, module.capability, "providedBy", (vehicle.vehicle_type,)) - {SERVICE}
        for name, (vehicle, module) in modules.items()
    }
    for vehicle, module in modules.values():
        yield from one_of(f"vehicle.{vehicle.name}.sensor.{module.name}.capability", module.capability, kinds)
    activities: list[tuple[str, ActivityTable]] = list(scenario.activity)
    for activity, table in activities:
        key, able = f"activity.{activity}", [name for name, classes in offered.items() if table.requires in classes]
        yield from one_of(f"{key}.requires", table.requires, kinds)
        if table.requires in kinds and not able:
            allowed = "a service that no vehicle offers; allowed: " + ", ".join(sorted(set().union(*offered.values())))
            yield ConfigurationFault(f"{key}.requires", "", allowed)
        if activity == SURVEY:
            for block in scenario.block:
                yield from _named(f"block.{block.name}", block, able)
        else:
            yield from _named(key, table, able)
        for name in able if activity == CHOOSE else ():
            vehicle, module = modules[name]
            if not module.self_test:
                allowed = f"{name} makes choices, so it has to report whether it works; allowed: self_test = true"
                yield ConfigurationFault(f"vehicle.{vehicle.name}.sensor.{module.name}.self_test", "false", allowed)


def _named(key: str, table: ActivityTable | BlockTable, able: Collection[str]) -> Iterator[ConfigurationFault]:
    if not able:
        return
    if not table.service:
        yield ConfigurationFault(f"{key}.service", "", f"is missing; allowed: {', '.join(able)}")
    for where, name in [("service", table.service or None), *(("spare", spare) for spare in table.spare)]:
        yield from one_of(f"{key}.{where}", name, sorted(able))


# The choreography


def _choreography(scenario: TridentScenario, tbox: TBox) -> Iterator[ConfigurationFault]:
    table, faults = scenario.choreography, list[ConfigurationFault]()
    states = [state.name for state in table.state]
    for name, count in repeated(states):
        yield ConfigurationFault(f"choreography.state.{name}", "", f"listed {count} times; allowed: once")
    attributes = {attribute.name: attribute for attribute in tbox.attributes}
    needed = [name for name in scenario.communication.needs if name in attributes]
    speakers = list(dict.fromkeys([*scenario.vehicle_names, *(role for _, role in scenario.roles)]))
    for number, entry in enumerate(table.message, 1):
        key = f"choreography.message.{number}"
        symbols = attributes[entry.says].symbols if entry.says in attributes else ()
        for field, known in (("state", states), ("to", states), ("says", needed), ("by", speakers), ("value", symbols)):
            value = getattr(entry, field)
            if field in ("state", "to", "says") or (value and known):
                faults += one_of(f"{key}.{field}", value, known)
    yield from faults
    if states and not faults:
        final = [state.name for state in table.state if state.final]
        for state, wrong in unsound(states, final, [(message.state, message.to) for message in table.message]):
            yield ConfigurationFault(f"choreography.state.{state}", "", wrong)


FURTHER_NEEDS = {"unableTo": 40, "isImpossible": 20, "surveysAgain": 40, "surveyedAgain": 20, "isExhausted": 40}
ESCORTING = "Escorting"
ESCORT_IMPORTANCE = 0.55  # importance of escorting a vehicle with fixes: below work, above the rendezvous


class TridentMission(JobMission):
    """Two-phase mission: survey, then recovery of the chosen object."""

    Scenario = TridentScenario
    group_missions = ("Intervention",)
    objective = WORKING
    needs = (
        *JobMission.needs, f"objective{WORKING}", "surveyedBy", "recoveredBy", "chosen", "chosenAt", "verdict",
        "looksLike", "location", "likeness", "serviceStatus", "providedBy", "requestedOf", "chartedTile",
    )  # fmt: skip
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), ABILITIES)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {
        "module": ModuleSettings,
        "surveyor": SurveyorSettings,
        "finder": FinderSettings,
        "effector": EffectorSettings,
        "fixer": FixerSettings,
    }
    tables = (JOBS, CHARTED, ATTEMPTS, CHOREOGRAPHY)
    metrics = METRICS
    figures = (
        *FIGURES,
        Mark("chosen", "target chosen"),
        Mark("held", "vehicle holds on"),
        Mark("recovered", "target recovered"),
        Mark("mistaken", "decoy recovered"),
    )
    scenario: TridentScenario

    def __init__(self, scenario: TridentScenario) -> None:
        # ``super().__init__`` calls ``jobs_of``, which reads the database, the matching and the blocks.
        self._database = database_of(scenario, type(self))
        self.matching = Matching.of(scenario, self._database.values())
        self.blocks = {
            block.name: SeabedBlock(block.name, block.x_m, block.y_m, scenario.mission.tile_m)
            for block in scenario.block
        }
        super().__init__(scenario)
        recovery = scenario.recovery.name
        self.concluding = Concluding(self.matching, self.groups, self.blocks, recovery, scenario.mission)

    @classmethod
    def check(cls, scenario: TridentScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        yield from _blocks(scenario)
        places_m = {"recovery.target_m": scenario.recovery.target_m}
        places_m["transponder.position_m"] = scenario.transponder.position_m if scenario.transponder else None
        yield from scenario.world.outside((key, at_m) for key, at_m in places_m.items() if at_m is not None)
        # Faults of the vocabulary itself are reported by the scenario.
        tbox = words_in(scenario, cls)
        if tbox is not None:
            yield from _services(scenario, cls, tbox)
            yield from _choreography(scenario, tbox)

    @classmethod
    def completed(cls, scenario: TridentScenario) -> TridentScenario:
        return with_needs(scenario, FURTHER_NEEDS)

    # Content -------------------------------------------------------------------------------------

    def jobs_of(self, scenario: TridentScenario) -> Iterable[Job]:
        services, matches = self.matching.services, self.matching.response == "matching"
        heeded = services.items() if matches else ()  # other plans respond to outcomes only
        surveying = tuple(name for name, s in heeded if isinstance(s.settings, SurveyorSettings))
        on_board = tuple(name for name, s in heeded if isinstance(s.settings, EffectorSettings | FinderSettings))
        for name, block in self.blocks.items():
            planned = {services[service].vehicle for service in self.matching.planned(self.matching.blocks[name])}
            yield BlockSurvey(block, frozenset(self._database if matches else planned), services=surveying)
        xs, ys = zip(*(block.centre_m for block in self.blocks.values()), strict=True)
        middle_m = math.fsum(xs) / len(xs), math.fsum(ys) / len(ys)
        yield RecoveryJob(scenario.recovery.name, middle_m, needs=tuple(self.blocks), services=on_board)

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        services = [(service.settings.capability, name) for name, service in self.matching.services.items()]
        return [*(("SurveyBlock", name) for name in self.blocks), ("Recovery", self.scenario.recovery.name), *services]

    @property
    def instances_found_per_vehicle(self) -> int:
        return FOUND_PER_OBJECT * (1 + self.scenario.recovery.decoys)

    @property
    def most_observations(self) -> int:
        n_modules = len(self.matching.services)
        n_tiles = sum(len(block.tiles) for block in self.blocks.values())
        return n_modules * (n_tiles + MOST_LOOKS * (1 + self.scenario.recovery.decoys)) + 100

    def world(self, seed: int) -> Site:
        scenario, blocks = self.scenario, tuple(self.blocks.values())
        objects = lying(blocks, scenario.recovery.target_m, scenario.recovery.decoys, seed)
        return Site(blocks, objects, scenario.transponder, seed)

    @property
    def places(self) -> Sequence[Place]:
        places = self.rally_places
        for name, block in self.blocks.items():
            tiles = Tiles(block.tile_m, block.tiles, "chartedTile", CHARTED.name, ("column", "row"))
            places.append(Place(name, "survey block", block.outline_m, tiles))
        if self.scenario.transponder is not None:
            places.append(Place("transponder", "transponder", (self.scenario.transponder.position_m,)))
        return places

    def truth(self, recorder: Recorder, world: Site) -> TridentTruth:
        return TridentTruth(self.meeting, self.scenario, recorder, world)

    # Activities ----------------------------------------------------------------------------------

    def founding_objectives(self) -> Sequence[Objective]:
        """Supervision by leaders; service by all initially assigned roles."""
        return [*super().founding_objectives(), *self.meeting.objectives(SERVING)]

    @property
    def activity_domain(self) -> Domain:
        """Decomposition of work into steps bound to services."""
        return activity_domain(self.matching, self.groups, self.scenario.recovery.name)

    def activities(
        self,
        steps: Sequence[Sequence[Task]],
        objective: Objective,
        data: VehicleData,
        facts: FactsLike,
        position_m: Point,
    ) -> Pursuit:
        rests_on = {*self.matching.rests_on(), self._jobs[objective.argument].done, ("gatheredAt", objective.group)}
        rests_on.add(("chosen", self.scenario.recovery.name))
        sets = [self._set(objective, task, data) for together in steps for task in together]
        return tuple(sets), frozenset(rests_on)

    def _set(self, objective: Objective, step: Task, data: VehicleData) -> ActivitySet:
        if step.name == STANDING_BY:
            doing = Activity(step.name, ActivityType.GUIDANCE)
        elif step.name == MISSING:
            doing = Activity(step.name, ActivityType.GUIDANCE, step.args)
        else:
            service = self.matching.services[step.args[1] if step.name == SURVEYING else step.args[2]]
            modules = (service.settings.name,) if service.vehicle == data.name else ()
            doing = Activity(step.name, ActivityType.GUIDANCE, (service.name, *step.args), modules)
        return ActivitySet(objective, ActivityKind.INDIVIDUAL, (doing,), self.importance_of(objective))

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        if objective.name != SERVING:
            return super().activity_sets(objective, data, facts, position_m)
        importance, sets = self.meeting.importance["Work"], []
        own = [service for service in self.matching.services.values() if service.vehicle == data.name]
        for service in own if self.matching.response == "matching" else ():
            if not isinstance(service.settings, SurveyorSettings):
                continue
            for block in self.blocks:
                parameters = service.name, block, SERVING
                doing = Activity(SURVEYING, ActivityType.GUIDANCE, parameters, (service.settings.name,))
                sets.append(ActivitySet(objective, ActivityKind.INDIVIDUAL, (doing,), importance))
        if self.scenario.mission.escort_m > 0.0 and (names := self._escorted(data)):
            home_m = self.meeting.rally_points_m.get(self.groups[objective.group].rally_point or "", data.start_m)
            doing = Activity(ESCORTING, ActivityType.GUIDANCE, (names, home_m))
            sets.append(ActivitySet(objective, ActivityKind.INDIVIDUAL, (doing,), ESCORT_IMPORTANCE))
        # The behaviours perceive requests and positions themselves, so the sets depend on no fact.
        return tuple(sets), frozenset()

    def _escorted(self, data: VehicleData) -> tuple[str, ...]:
        if data.name not in locating(self.scenario):
            return ()
        return tuple(other.name for other in self._database.values() if other.depth_m > 0.0)

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """Behaviour of a step by its service, or of the rendezvous."""
        if (behaviour := self.meeting.behaviour(activity, data)) is not None:
            return behaviour
        settings = self.scenario.mission
        if activity.name == ESCORTING:
            names, home_m = activity.parameters
            return Escorting(names, home_m, settings.arrival_radius_m, settings.escort_m, data)
        if activity.name == STANDING_BY:
            return AwaitingPartner()
        if activity.name == MISSING:
            return Missing(activity.parameters[1])
        service = self.matching.services[activity.parameters[0]]
        if service.vehicle != data.name:
            return AwaitingPartner()
        sensor = service.settings
        if activity.name == SURVEYING and isinstance(sensor, SurveyorSettings):
            asked = (service.name, self.scenario.recovery.name) if activity.parameters[2] == SERVING else None
            return Surveying(self.blocks[activity.parameters[1]], sensor, data, settings.patience_work_s, asked)
        if activity.name == RANGING and self.scenario.transponder is not None:
            return Ranging(self.scenario.transponder.position_m, data, settings.patience_work_s)
        job, candidate = activity.parameters[1:3]
        if activity.name == REACQUIRING and isinstance(sensor, FinderSettings):
            return Reacquiring(job, candidate, sensor, data, settings.search_m, settings.patience_work_s)
        if isinstance(sensor, EffectorSettings):
            return Intervening(job, candidate, sensor, data)
        raise PlanningError(f"activity {activity.name!r} cannot be done by {service.name!r}")

    def conclusions(
        self, data: VehicleData, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        return self.concluding.of(data.name, organisation, beliefs, picture)
