"""Field missions: jobs assigned by the strategy, some with needs beyond their holder.

In a passage, holders of loads call each other as equals for right of way; ``remoras.motion.attraction`` resolves it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, cast

from pydantic import Field

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.fieldwork.assistance import (
    HELPING,
    JUDGED,
    URGENCY,
    Help,
    HelpMission,
    HelpSettings,
    n_helpers,
    unseen_by_sonar,
)
from missions.fieldwork.drawn_lines import DrawnLines
from missions.fieldwork.energy import (
    BRINGS,
    IS_HALTED,
    STORE_CHARGE,
    Boring,
    ChargerSettings,
    DrillSettings,
    Energies,
    HelpAtBerth,
    Passing,
    TransferTable,
)
from missions.fieldwork.jobs import (
    ESCORTS,
    HELPS,
    LYING_AT,
    Delivery,
    Lift,
    SeaField,
    SiteSurvey,
    SonarSettings,
    SurveyLine,
    laid_out,
)
from missions.fieldwork.truth import (
    ENERGY,
    ESCORT_FIGURES,
    ESCORT_METRICS,
    ESCORTING,
    FERRY_FIGURES,
    FERRY_METRICS,
    LIFTS,
    PASSAGE,
    RECOVERY_FIGURES,
    RECOVERY_METRICS,
    RESUPPLY_FIGURES,
    RESUPPLY_METRICS,
    EnergyTruth,
    EscortTruth,
    LiftTruth,
)
from missions.figure import Place
from missions.files import MISSIONS
from missions.meeting.job_mission import (
    DONE_BY,
    THERE_M,
    JobMission,
    JobScenario,
    JobSettings,
    founding_of,
    job_role,
    listed_faults,
    numbered,
    with_job_roles,
)
from missions.meeting.meeting import Pursuit
from missions.scenarios.fleet import sensors_of
from remoras.activities import Objective
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.mission import ABILITIES, FleetView
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.table import Name, NotNegative, PointM, Positive, Section
from remoras.work import IS_IMPOSSIBLE, Job, Point

Kind = TypeVar("Kind")
ROOM = 1.65  # least distance of vehicles side by side, in separations: their margin and half of it
FARTHEST_M = 20.0  # greatest distance of a berth from its drill site, within obstacle sonar
SHORTEST_M = 10.0


class LiftsTable(Section):
    """Table ``[lifts]``: objects near sites, at positions unknown until a sonar shows them."""

    number: int = Field(4, ge=0, le=20, description="number of objects, each near a drawn site")
    vehicles: int = Field(2, ge=1, le=6, description="number of vehicles needed to lift one")
    lift_s: Positive = Field(60.0, description="duration once all are in place")
    length_m: Positive = Field(10.0, description="distance between positions of two of them")


class DeliveryTable(Section):
    """One ``[[delivery]]``."""

    name: Name = Field(description="name of the delivery")
    from_m: PointM = Field(description="position of the pick-up, x east, y north")
    to_m: PointM = Field(description="position of the hand-over")


class FerrySettings(JobSettings):
    """Table ``[mission]``."""

    handling_s: NotNegative = Field(10.0, description="duration of a pick-up or hand-over")


class EscortSettings(HelpSettings):
    """Table ``[mission]``."""

    within_m: float = Field(
        20.0, ge=10.0, le=30.0, description="largest effective distance of an escort from the surveying vehicle"
    )


class RecoveryScenario(JobScenario):
    """Input of a recovery run."""

    mission: HelpSettings = HelpSettings()
    site: tuple[SiteSurvey, ...] = Field(min_length=1)
    lifts: LiftsTable = LiftsTable()

    @property
    def jobs(self) -> Sequence[Any]:
        """Site surveys and lifts."""
        table = self.lifts
        names = numbered("lift", table.number)
        lifts = (Lift(name, table.lift_s, n_vehicles=table.vehicles, length_m=table.length_m) for name in names)
        return (*self.site, *lifts)


class FerryScenario(JobScenario):
    """Input of a ferry run."""

    mission: FerrySettings = FerrySettings.usual()
    delivery: tuple[DeliveryTable, ...] = Field(min_length=1)

    @property
    def jobs(self) -> Sequence[Any]:
        """Deliveries, through the passage if a reef separates their places."""
        table, handling_s = self.of_feature(PASSAGE), self.mission.handling_s
        length_m = distance if table is None else table.passage(self.guidance.separation_m).length_m
        return tuple(Delivery(d.name, d.from_m, d.to_m, handling_s, length_m) for d in self.delivery)


class EscortScenario(JobScenario):
    """Input of an escort run."""

    mission: EscortSettings = EscortSettings()
    line: tuple[SurveyLine, ...] = ()
    drawn_lines: DrawnLines | None = Field(None, description="lines drawn by the seed, in place of [[line]]")

    @property
    def jobs(self) -> Sequence[Any]:
        """Line surveys; a run replaces drawn ones, until then of seed 0."""
        return self.line

    def for_seed(self, seed: int) -> Self:
        """Return the scenario with the lines of a seed."""
        if self.drawn_lines is None:
            return self
        return self.model_copy(update={"line": self.drawn_lines.of_seed(self.world, seed), "drawn_lines": None})


class ResupplyScenario(JobScenario):
    """Input of a resupply run."""

    mission: HelpSettings = HelpSettings()
    site: tuple[SiteSurvey, ...] = ()
    boring: tuple[Boring, ...] = Field(min_length=1)
    transfer: TransferTable = TransferTable()

    @property
    def jobs(self) -> Sequence[Any]:
        """Site surveys and drillings."""
        return (*self.site, *self.boring)


def _too_near(scenario: JobScenario, key: str, given_m: float, most_m: float, why: str) -> Iterator[ConfigurationFault]:
    least_m = ROOM * scenario.guidance.separation_m
    if not least_m <= given_m <= most_m:
        to = f"to {most_m:g}" if most_m < math.inf else "or more"
        allowed = f"allowed: {least_m:.3g} {to}, so that vehicles keep clear of each other{why}"
        yield ConfigurationFault(key, str(given_m), allowed)


def _vocabulary(name: str) -> Path:
    return MISSIONS / name / "vocabulary.ttl"


class FieldworkMission(JobMission):
    """Base of missions with jobs of several kinds."""

    urgencies: ClassVar[Mapping[str, int]] = {}

    @classmethod
    def completed(cls, scenario: Any) -> Any:
        founding = founding_of(scenario)
        roles = [job_role(job.PLAYER, job.name, founding if n_helpers(job) else ()) for job in scenario.jobs]
        return with_job_roles(scenario, roles, cls.urgencies)

    def jobs_of(self, scenario: Any) -> Iterable[Job]:
        return cast(Sequence[Job], scenario.jobs)

    def all_of(self, kind: type[Kind]) -> dict[str, Kind]:
        """Return jobs of a kind, by name."""
        return {name: job for name, job in self.jobs.items() if type(job) is kind}

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [(type(job).__name__, name) for name, job in self.jobs.items()]

    @property
    def places(self) -> Sequence[Place]:
        """Rally points and the ends of jobs; objects differ from run to run and are not shown."""
        jobs = [job for job in self.scenario.jobs if job.SHOWN]
        return [*self.rally_places, *(Place(job.name, job.SHOWN, _ends_m(job)) for job in jobs)]

    def behaviour_at(self, job: Any, data: VehicleData) -> Behaviour:
        return cast(Behaviour, job.behaviour(data, self.scenario))


def _ends_m(job: Job) -> tuple[Point, ...]:
    end_m = getattr(job, "to_m", None)
    return (job.place_m,) if end_m is None else (job.place_m, end_m)


class RecoveryMission(FieldworkMission, HelpMission):
    """Recovery: sites, and objects near them that need several vehicles at once."""

    Scenario = RecoveryScenario
    group_missions = ("Recovery",)
    objective = "Recovering"
    help_by = Help, HELPS
    needs = (*HelpMission.needs, "objectiveRecovering", DONE_BY, LYING_AT)
    vocabulary = (_vocabulary("recovery"), ABILITIES)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {"sonar": SonarSettings}
    urgencies: ClassVar[Mapping[str, int]] = {LYING_AT: URGENCY, HELPS: URGENCY, **JUDGED}
    tables = (*HelpMission.tables, LIFTS)
    metrics = RECOVERY_METRICS
    figures = RECOVERY_FIGURES
    scenario: RecoveryScenario

    @classmethod
    def check(cls, scenario: RecoveryScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        lifts, n_vehicles = scenario.lifts, len(scenario.vehicle)
        yield from listed_faults(scenario, "site", "position_m", taken=numbered("lift", lifts.number))
        if lifts.number and lifts.vehicles > 1:
            yield from unseen_by_sonar(scenario)
        if lifts.number and n_vehicles < lifts.vehicles:
            allowed = f"an object takes more vehicles than there are; allowed: 1 to {n_vehicles}"
            yield ConfigurationFault("lifts.vehicles", str(lifts.vehicles), allowed)
        # A single vehicle lifts at the middle and needs no distance from others.
        if lifts.vehicles != 1:
            yield from _too_near(scenario, "lifts.length_m", lifts.length_m, math.inf, " there")
        if lifts.number and not any(sensor.get("type") == "sonar" for v in scenario.vehicle for sensor in v.sensor):
            allowed = 'no vehicle could find one: give a vehicle a sensor of type "sonar"'
            yield ConfigurationFault("lifts.number", str(lifts.number), allowed)

    def world(self, seed: int) -> SeaField:
        ranges_m = [
            sensor.range_m
            for vehicle in self.scenario.vehicle
            for sensor in sensors_of(vehicle, self.sensors)
            if isinstance(sensor, SonarSettings)
        ]
        # The shortest range, so that a survey of the site by any sonar detects the object.
        return laid_out(self.all_of(Lift), [*self.all_of(SiteSurvey).values()], min(ranges_m, default=0.0), seed)

    def truth(self, recorder: Recorder, world: SeaField) -> LiftTruth:
        return LiftTruth(self.meeting, self.objective, recorder, self.all_of(Lift), world)


class FerryMission(FieldworkMission):
    """Ferry: loads carried through a narrow passage."""

    Scenario = FerryScenario
    group_missions = ("Ferry",)
    objective = "Carrying"
    needs = (*JobMission.needs, "objectiveCarrying", DONE_BY)
    vocabulary = (_vocabulary("ferry"),)
    metrics = FERRY_METRICS
    figures = FERRY_FIGURES
    scenario: FerryScenario

    @classmethod
    def completed(cls, scenario: FerryScenario) -> FerryScenario:
        carriers = [f"{job.PLAYER} of {job.name}" for job in scenario.jobs]
        roles = [job_role(job.PLAYER, job.name, [*carriers, *founding_of(scenario)]) for job in scenario.jobs]
        return with_job_roles(scenario, roles, {}, carriers)

    @classmethod
    def check(cls, scenario: FerryScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        yield from listed_faults(scenario, "delivery", "from_m", "to_m")
        reef = scenario.of_feature(PASSAGE)
        for delivery in scenario.delivery if reef is not None else ():
            for key, at_m in (("from_m", delivery.from_m), ("to_m", delivery.to_m)):
                if reef.x_m[0] <= at_m[0] <= reef.x_m[1]:
                    allowed = f"in the reef or its passage, x {reef.x_m[0]:g} to {reef.x_m[1]:g}; place it outside"
                    yield ConfigurationFault(f"delivery.{delivery.name}.{key}", f"[{at_m[0]:g}, {at_m[1]:g}]", allowed)


class EscortMission(FieldworkMission, HelpMission):
    """Escort: line surveys, some of which need an escort."""

    Scenario = EscortScenario
    group_missions = ("LineSurvey",)
    objective = "Surveying"
    help_activity = "Following"
    help_by = Help, ESCORTS
    needs = (*HelpMission.needs, "objectiveSurveying", DONE_BY, ESCORTS)
    vocabulary = (_vocabulary("escort"), ABILITIES)
    urgencies: ClassVar[Mapping[str, int]] = {ESCORTS: URGENCY, **JUDGED}
    tables = (*HelpMission.tables, ESCORTING)
    metrics = ESCORT_METRICS
    figures = ESCORT_FIGURES
    scenario: EscortScenario

    @classmethod
    def completed(cls, scenario: EscortScenario) -> EscortScenario:
        """Add roles; with ``[drawn_lines]``, for lines of the names that every run has."""
        if scenario.drawn_lines is not None:
            lines = scenario.drawn_lines.of_seed(scenario.world, 0)
            scenario = scenario.model_copy(update={"line": lines})
        return cast(EscortScenario, super().completed(scenario))

    @classmethod
    def check(cls, scenario: EscortScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        if not scenario.line:
            yield ConfigurationFault("line", "", "allowed: at least one [[line]], or the table [drawn_lines]")
        yield from listed_faults(scenario, "line", "from_m", "to_m")
        if any(line.escorted for line in scenario.line):
            yield from unseen_by_sonar(scenario)
        for line in scenario.line:
            if distance(line.from_m, line.to_m) < SHORTEST_M:
                value = f"[{line.to_m[0]:g}, {line.to_m[1]:g}]"
                allowed = f"the line is too short; allowed: {SHORTEST_M:g} m or more from from_m"
                yield ConfigurationFault(f"line.{line.name}.to_m", value, allowed)
            if line.escorted and len(scenario.vehicle) == 1:
                allowed = "takes two vehicles, and there is one; allowed: false"
                yield ConfigurationFault(f"line.{line.name}.escorted", "true", allowed)

    def truth(self, recorder: Recorder, world: Any) -> EscortTruth:
        return EscortTruth(self.meeting, self.objective, recorder, self.helped, self.scenario.mission.within_m)


class ResupplyMission(FieldworkMission, HelpMission):
    """Resupply: sites, and drill sites that exceed the battery of the only able vehicles."""

    Scenario = ResupplyScenario
    group_missions = ("Sampling",)
    objective = "Sampling"
    help_by = HelpAtBerth, BRINGS
    needs = (*HelpMission.needs, "objectiveSampling", DONE_BY, IS_HALTED, BRINGS)
    vocabulary = (_vocabulary("resupply"), ABILITIES)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {"drill": DrillSettings, "charger": ChargerSettings}
    urgencies: ClassVar[Mapping[str, int]] = {
        IS_HALTED: URGENCY, BRINGS: URGENCY, IS_IMPOSSIBLE: URGENCY, STORE_CHARGE: 10,
    }  # fmt: skip
    tables = (*HelpMission.tables, ENERGY)
    metrics = RESUPPLY_METRICS
    figures = RESUPPLY_FIGURES
    scenario: ResupplyScenario

    @classmethod
    def check(cls, scenario: ResupplyScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        yield from listed_faults(scenario, "site", "position_m", taken=[table.name for table in scenario.boring])
        yield from listed_faults(scenario, "boring", "position_m", taken=[table.name for table in scenario.site])
        sensors = [sensor for vehicle in scenario.vehicle for sensor in vehicle.sensor]
        drills = {str(sensor.get("name", "drill")) for sensor in sensors if sensor.get("type") == "drill"}
        least_m = 2.0 * THERE_M
        for number, table in enumerate(scenario.boring):
            if table.drill not in drills:
                known = ", ".join(sorted(drills)) or "none, as there is no drill"
                allowed = f"no vehicle has such a drill; allowed: {known}"
                yield ConfigurationFault(f"boring.{table.name}.drill", f'"{table.drill}"', allowed)
            others = scenario.boring[:number]
            near = next((other for other in others if distance(table.position_m, other.position_m) <= least_m), None)
            if near is not None:
                allowed = f"more than {least_m:g} m from {near.name}: a drill is at one hole"
                yield ConfigurationFault(f"boring.{table.name}.position_m", "", allowed)
        berth_m = scenario.transfer.berth_m
        yield from _too_near(scenario, "transfer.berth_m", berth_m, FARTHEST_M, ", and see each other")

    def world(self, seed: int) -> Energies:
        return Energies()

    def nature(self, world: Energies) -> Callable[[FleetView, float], None]:
        return Passing(self.all_of(Boring), self.scenario.transfer, world).go_on

    def truth(self, recorder: Recorder, world: Energies) -> EnergyTruth:
        return EnergyTruth(self.meeting, self.objective, recorder, self.all_of(Boring), world)

    # Activities ----------------------------------------------------------------------------------

    def switched_on(self, job: Job, data: VehicleData) -> tuple[str, ...]:
        return (job.drill,) if isinstance(job, Boring) else ()

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        """Activity sets of help missions; helpers need a charger and switch it on."""
        sets, rests_on = super().activity_sets(objective, data, facts, position_m)
        if objective.name != HELPING:
            return sets, rests_on
        charger = data.sensor(ChargerSettings)
        if charger is None:
            return (), rests_on
        on = (charger.name,)
        return tuple(replace(s, activities=(replace(s.activities[0], sensors=on),)) for s in sets), rests_on
