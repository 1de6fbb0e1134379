"""The mission: sites, and holes that take drills whose batteries do not last, as jobs that the strategy gives out.

Nobody but the vehicle with the drill is able to bore a hole. What moves others to bring it energy is help, as
``missions.meeting.helping`` has it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.figure import Declared, Place
from missions.meeting.helping import HELPING, URGENCY, HelpMission, HelpSettings
from missions.meeting.job_mission import JobScenario, founding_of, job_role, listed_faults, with_job_roles
from missions.meeting.meeting import Pursuit
from missions.meeting.staying import DONE_BY, THERE_M, SiteSurvey, SiteTable, SurveyingSite
from missions.metric import Metric
from missions.resupply.boring import BRINGS, IS_HALTED, Boring, Bringing, Drilling, HelpAtBerth
from missions.resupply.energy import STORE_CHARGE, ChargerSettings, DrillSettings, Energies, Transfer
from missions.resupply.passing import Passing
from missions.resupply.truth import ENERGY, FIGURES, METRICS, ResupplyTruth
from missions.scenarios.tables import Name, PointM, Positive, Raw, Section, entries, is_number, names_of, table_of
from remoras.activities import Objective
from remoras.avoidance import SEPARATION_M
from remoras.behaviours import Behaviour
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.mission import ABILITIES, FleetView
from remoras.recorder import Recorder, Table
from remoras.sensor import SensorSettings
from remoras.work import Job, Point

ROOM = 1.65
"""Vehicles that lie beside each other are so many separations apart at least: their margin, and half of it."""
FARTHEST_M = 20.0
"""No berth is farther beside its hole: an obstacle sonar sees who lies there."""
TOLD = {IS_HALTED: URGENCY, BRINGS: URGENCY, "isImpossible": URGENCY, STORE_CHARGE: 10}
"""How urgently vehicles need what the scenario does not list itself."""


class BoringTable(Section):
    """One ``[[boring]]``: a hole that takes a drill."""

    name: Name = Field(description="name of the hole")
    position_m: PointM = Field(description="where it is, x east, y north")
    stay_s: Positive = Field(300.0, description="how long the drill takes to bore it")
    drill: str = Field(description="name of the sensor that bores it, of type drill")


class TransferTable(Section):
    """The table ``[transfer]``: how energy passes from the store of one vehicle to the drill of another."""

    power_w: Positive = Field(500.0, description="power that leaves the store while both vehicles are in place")
    efficiency: float = Field(0.7, gt=0.0, le=1.0, description="share of it that comes into the battery")
    berth_m: Positive = Field(10.0, description="how far beside the hole, to the east, the vehicle with the store lies")


class ResupplyScenario(JobScenario):
    """The whole input of a run of this mission."""

    mission: HelpSettings = HelpSettings()
    site: tuple[SiteTable, ...] = ()
    boring: tuple[BoringTable, ...] = Field(min_length=1)
    transfer: TransferTable = TransferTable()


class ResupplyMission(HelpMission):
    """The mission, made from a scenario."""

    Scenario = ResupplyScenario
    group_missions = ("Sampling",)
    objective = "Sampling"
    needs = (*HelpMission.needs, "objectiveSampling", DONE_BY, IS_HALTED, BRINGS)
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"), ABILITIES)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {"drill": DrillSettings, "charger": ChargerSettings}
    tables: ClassVar[tuple[Table, ...]] = (*HelpMission.tables, ENERGY)
    metrics: ClassVar[tuple[Metric, ...]] = METRICS
    figures: ClassVar[tuple[Declared, ...]] = FIGURES
    scenario: ResupplyScenario

    @classmethod
    def completed(cls, raw: Raw) -> Raw:
        """The tables with a role for each site and hole in the first group; the latter call on the founding roles."""
        roles = [job_role("Surveyor", site) for site in names_of(raw, "site")]
        roles += [job_role("Borer", hole, founding_of(raw)) for hole in names_of(raw, "boring")]
        return with_job_roles(raw, roles, TOLD)

    @classmethod
    def check(cls, raw: Raw) -> Iterable[ConfigurationFault]:
        """Sites and holes outside of the world or with names that are taken, drills nobody has, berths too near."""
        yield from listed_faults(raw, "site", "position_m", taken=names_of(raw, "boring"))
        yield from listed_faults(raw, "boring", "position_m", taken=names_of(raw, "site"))
        drills = {
            str(sensor.get("name", "drill"))
            for vehicle in entries(raw, "vehicle")
            for sensor in entries(vehicle, "sensor")
            if sensor.get("type") == "drill"
        }
        for boring in entries(raw, "boring"):
            drill = boring.get("drill")
            if isinstance(drill, str) and drill not in drills:
                allowed = (
                    f"no vehicle has such a drill; allowed: {', '.join(sorted(drills)) or 'none, as there is no drill'}"
                )
                yield ConfigurationFault(f"boring.{boring.get('name')}.drill", f'"{drill}"', allowed)
        yield from _holes_in_each_other(raw)
        separation_m = table_of(raw, "guidance").get("separation_m", SEPARATION_M)
        least_m = ROOM * separation_m if is_number(separation_m) else 0.0
        berth_m = table_of(raw, "transfer").get("berth_m", TransferTable().berth_m)
        if is_number(berth_m) and berth_m > 0.0 and not least_m <= berth_m <= FARTHEST_M:
            why = "so that vehicles keep clear of each other, and see each other"
            allowed = f"allowed: {least_m:.3g} to {FARTHEST_M:g}, {why}"
            yield ConfigurationFault("transfer.berth_m", str(berth_m), allowed)

    def jobs_of(self, scenario: ResupplyScenario) -> Iterable[Job]:
        """The sites and the holes."""
        self._transfer = Transfer(**scenario.transfer.model_dump())
        self._borings = {one.name: Boring(one.name, one.position_m, one.stay_s, one.drill) for one in scenario.boring}
        self._sites = {one.name: SiteSurvey(one.name, one.position_m, one.stay_s) for one in scenario.site}
        return [*self._sites.values(), *self._borings.values()]

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        """The sites and the holes."""
        return [("Boring" if name in self._borings else "SiteSurvey", name) for name in self.jobs]

    @property
    def places(self) -> Sequence[Place]:
        """Rally points, sites and holes."""
        points = [Place(point.name, "rally point", (point.position_m,)) for point in self.scenario.rally_point]
        kinds = [("boring" if name in self._borings else "site", job) for name, job in self.jobs.items()]
        return [*points, *(Place(job.name, kind, (job.place_m,)) for kind, job in kinds)]

    def world(self, seed: int) -> Energies:
        """Full batteries and stores, and nothing bored."""
        return Energies()

    def nature(self, world: Energies) -> Callable[[FleetView, float], None]:
        """Energy passes, and drills work."""
        return Passing(self._borings, self._transfer, world).go_on

    def truth(self, recorder: Recorder, world: Energies) -> ResupplyTruth:
        """Notes what befell holes, and what was really bored."""
        return ResupplyTruth(self.meeting, self.objective, recorder, self._borings, world)

    # Who does what -------------------------------------------------------------------------------

    def switched_on(self, job: Job, data: VehicleData) -> tuple[str, ...]:
        """For a hole the drill, for a site nothing."""
        return (job.drill,) if isinstance(job, Boring) else ()

    @property
    def helped(self) -> Collection[str]:
        """The holes."""
        return self._borings

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        """Those of every mission in which others are helped; whoever helps has a charger, and switches it on."""
        sets, rests_on = super().activity_sets(objective, data, facts, position_m)
        if objective.name != HELPING:
            return sets, rests_on
        charger = data.sensor(ChargerSettings)
        if charger is None:
            return (), rests_on
        on = (charger.name,)
        return tuple(replace(one, activities=(replace(one.activities[0], sensors=on),)) for one in sets), rests_on

    def helper(self, job: str, group: str, holders: Collection[str], data: VehicleData) -> Behaviour:
        """To bring energy to a hole."""
        help = HelpAtBerth(job, group, holders, data.name, 1, BRINGS, self.helped)
        charger = data.sensor(ChargerSettings) or ChargerSettings()
        return Bringing(self._borings[job], self._transfer, help, charger, data)

    def behaviour_at(self, job: Job, data: VehicleData) -> Behaviour:
        """The survey of a site, or a boring."""
        if isinstance(job, Boring):
            others = {name for name, one in self._borings.items() if one.drill == job.drill and name != job.name}
            return Drilling(job, others, self.scenario.mission.wait_s, data)
        return SurveyingSite(self._sites[job.name], data)


def _holes_in_each_other(raw: Raw) -> Iterator[ConfigurationFault]:
    """Holes so near to each other that a drill would be at both."""
    least_m, before = 2.0 * THERE_M, list[tuple[Any, Point]]()
    for boring in entries(raw, "boring"):
        name, place_m = boring.get("name"), boring.get("position_m")
        if not isinstance(place_m, list | tuple) or len(place_m) != 2 or not all(map(is_number, place_m)):
            continue
        at_m = place_m[0], place_m[1]
        if other := next((other for other, other_m in before if distance(at_m, other_m) <= least_m), None):
            allowed = f"more than {least_m:g} m from {other}: a drill is at one hole"
            yield ConfigurationFault(f"boring.{name}.position_m", str(list(at_m)), allowed)
        before.append((name, at_m))
