"""The mission: sites, and objects that take several vehicles at once, as jobs that the strategy gives out.

Whoever is given an object takes one end of it and waits. What moves others to the other ends is help, as
``missions.meeting.helping`` has it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.figure import Declared, Place
from missions.meeting.helping import JUDGED, URGENCY, HelpMission, HelpSettings
from missions.meeting.job_mission import JobScenario, founding_of, job_role, listed_faults, with_job_roles
from missions.meeting.staying import DONE_BY, SiteSurvey, SiteTable, SurveyingSite
from missions.metric import Metric
from missions.recovery.lifting import (
    HELPS,
    LYING_AT,
    Helping,
    Lift,
    Lifting,
    SeaField,
    SonarSettings,
    laid_out,
)
from missions.recovery.truth import FIGURES, LIFTS, METRICS, RecoveryTruth
from missions.scenarios.tables import (
    Positive,
    Raw,
    Section,
    entries,
    is_number,
    names_of,
    numbered,
    table_of,
)
from remoras.avoidance import SEPARATION_M
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.mission import ABILITIES
from remoras.recorder import Recorder, Table
from remoras.sensor import SensorSettings
from remoras.work import Job

MOST_LIFTS = 20
ROOM = 1.65
"""Vehicles at two ends are so many separations apart at least: their margin, and half of it."""


class LiftsTable(Section):
    """The table ``[lifts]``: objects that lie near sites; nobody knows where before a sonar shows one."""

    number: int = Field(
        4, ge=0, le=MOST_LIFTS, description="how many objects there are, each near a site that is drawn"
    )
    vehicles: int = Field(2, ge=1, le=6, description="how many vehicles it takes at once to lift one")
    lift_s: Positive = Field(60.0, description="how long it takes once all are there")
    length_m: Positive = Field(10.0, description="distance of the places of two of them")


class RecoveryScenario(JobScenario):
    """The whole input of a run of this mission."""

    mission: HelpSettings = HelpSettings()
    site: tuple[SiteTable, ...] = Field(min_length=1)
    lifts: LiftsTable = LiftsTable()


class RecoveryMission(HelpMission):
    """The mission, made from a scenario."""

    Scenario = RecoveryScenario
    group_missions = ("Recovery",)
    objective = "Recovering"
    needs = (*HelpMission.needs, "objectiveRecovering", DONE_BY, LYING_AT)
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), ABILITIES)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {"sonar": SonarSettings}
    tables: ClassVar[tuple[Table, ...]] = (*HelpMission.tables, LIFTS)
    metrics: ClassVar[tuple[Metric, ...]] = METRICS
    figures: ClassVar[tuple[Declared, ...]] = FIGURES
    scenario: RecoveryScenario

    @classmethod
    def completed(cls, raw: Raw) -> Raw:
        """The tables with a role for each site and object in the first group; the latter call on the founding roles."""
        number = table_of(raw, "lifts").get("number", LiftsTable().number)
        if type(number) is not int or not 0 <= number <= MOST_LIFTS:
            number = 0  # reported elsewhere
        roles = [job_role("Surveyor", site) for site in names_of(raw, "site")]
        roles += [job_role("Lifter", lift, founding_of(raw)) for lift in numbered("lift", number)]
        return with_job_roles(raw, roles, {LYING_AT: URGENCY, HELPS: URGENCY, **JUDGED})

    @classmethod
    def check(cls, raw: Raw) -> Iterable[ConfigurationFault]:
        """Sites outside of the world or with names that are taken, objects for too many vehicles or too short."""
        vehicles, lifts, usual = entries(raw, "vehicle"), table_of(raw, "lifts"), LiftsTable()
        number = lifts.get("number", usual.number)
        lifted = numbered("lift", number) if type(number) is int and 0 < number <= MOST_LIFTS else ()
        yield from listed_faults(raw, "site", "position_m", taken=lifted)
        takes, length_m = lifts.get("vehicles", usual.vehicles), lifts.get("length_m", usual.length_m)
        if type(takes) is int and lifted and 0 < len(vehicles) < takes:
            allowed = f"an object takes more vehicles than there are; allowed: 1 to {len(vehicles)}"
            yield ConfigurationFault("lifts.vehicles", str(takes), allowed)
        separation_m = table_of(raw, "guidance").get("separation_m", SEPARATION_M)
        least_m = ROOM * separation_m if is_number(separation_m) else 0.0
        if is_number(length_m) and takes != 1 and 0.0 < length_m < least_m:
            allowed = f"allowed: {least_m:.3g} or more, so that vehicles keep clear of each other there"
            yield ConfigurationFault("lifts.length_m", str(length_m), allowed)
        if lifted and not any(sensor.get("type") == "sonar" for v in vehicles for sensor in entries(v, "sensor")):
            allowed = 'nobody would find one: give a vehicle a sensor of type "sonar"'
            yield ConfigurationFault("lifts.number", str(number), allowed)

    def jobs_of(self, scenario: RecoveryScenario) -> Iterable[Job]:
        """The sites and the objects."""
        lifts, sites = scenario.lifts, [SiteSurvey(site.name, site.position_m, site.stay_s) for site in scenario.site]
        names = numbered("lift", lifts.number)
        self._sites = tuple(sites)
        self._lifts = {name: Lift(name, lifts.lift_s, lifts.vehicles, lifts.length_m) for name in names}
        return [*sites, *self._lifts.values()]

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        """The sites and the objects."""
        return [*(("SiteSurvey", site.name) for site in self._sites), *(("Lift", name) for name in self._lifts)]

    @property
    def places(self) -> Sequence[Place]:
        """Rally points and sites; where objects lie differs from run to run."""
        points = [Place(point.name, "rally point", (point.position_m,)) for point in self.scenario.rally_point]
        return [*points, *(Place(site.name, "site", (site.place_m,)) for site in self._sites)]

    def world(self, seed: int) -> SeaField:
        """Where the objects lie in the run with that seed."""
        ranges_m = [
            sensor.range_m
            for vehicle in self.scenario.vehicle
            for sensor in (SonarSettings(**table) for table in vehicle.sensor if table.get("type") == "sonar")
        ]
        return laid_out(tuple(self._lifts.values()), self._sites, min(ranges_m, default=0.0), seed)

    def truth(self, recorder: Recorder, world: SeaField) -> RecoveryTruth:
        """Notes what was really lifted."""
        return RecoveryTruth(self.meeting, self.objective, recorder, self._lifts, world)

    # Who does what -------------------------------------------------------------------------------

    @property
    def helped(self) -> Collection[str]:
        """The objects."""
        return self._lifts

    def helper(self, job: str, group: str, holders: Collection[str], data: VehicleData) -> Behaviour:
        """Help with an object."""
        return Helping(self._lifts[job], group, holders, data, self.helped, self.scenario.mission.wait_s)

    def behaviour_at(self, job: Job, data: VehicleData) -> Behaviour:
        """The survey of a site, or the lift of an object."""
        if not isinstance(job, Lift):
            return SurveyingSite(self._sites[self._sites.index(job)], data)
        return Lifting(job, data, self.scenario.mission.wait_s)
