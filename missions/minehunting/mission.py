"""Minehunting mission: views of contacts as jobs, classified by the group leader as the analyst."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from exchange.channel import loss
from missions.errors import ConfigurationFault
from missions.figure import Place
from missions.meeting.job_mission import (
    DONE_BY,
    JobMission,
    JobScenario,
    JobSettings,
    job_role,
    listed_faults,
    numbered,
    with_job_roles,
)
from missions.meeting.meeting import Pursuit
from missions.minehunting.imagery import (
    CLASSIFIED,
    ON_FLOOR,
    ON_TARGET,
    REVISITS,
    SHOWN,
    STRIPS,
    Analysing,
    ContactView,
    ImageryTable,
    Minefield,
    SnippetSonarSettings,
    beside_contact,
)
from missions.minehunting.truth import CLASSIFICATIONS, FIGURES, METRICS, MinehuntingTruth
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour
from remoras.beliefs import Beliefs
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.mission import Finding
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.recorder import Recorder
from remoras.sensor import SensorSettings
from remoras.table import Name, PointM, Positive, Section
from remoras.work import Job

ANALYSING = "Analysing"
MOST_REVISITS = 40
LEAST_APART_M = 7.0  # least distance between views of one contact: over twice the radius of a view
URGENCY = {REVISITS: 50, CLASSIFIED: 50, SHOWN: 20, ON_TARGET: 20, ON_FLOOR: 2}


class ContactTable(Section):
    """One ``[[contact]]``."""

    name: Name = Field(description="name of the contact")
    position_m: PointM = Field(description="position, x east, y north")


class MinehuntingSettings(JobSettings):
    """Table ``[mission]``."""

    confidence: float = Field(0.99, gt=0.5, lt=1.0, description="probability of being correct at which analysts decide")
    waits_s: Positive = Field(900.0, description="time that an analyst waits for missing strips")
    revisits: int = Field(6, ge=0, le=MOST_REVISITS, description="further views that analysts may request")
    view_m: float = Field(15.0, ge=LEAST_APART_M, description="distance of a view from its contact")


class MinehuntingScenario(JobScenario):
    """Scenario with the tables of this mission."""

    mission: MinehuntingSettings = MinehuntingSettings.usual()
    contact: tuple[ContactTable, ...] = Field(min_length=1)
    imagery: ImageryTable = ImageryTable.usual()


class MinehuntingMission(JobMission):
    """Minehunting mission, built from a scenario."""

    Scenario = MinehuntingScenario
    group_missions = ("Minehunting",)
    objective = "Viewing"
    collective = (ANALYSING,)
    needs = (*JobMission.needs, "objectiveViewing", DONE_BY, *URGENCY)
    vocabulary = (Path(__file__).with_name("vocabulary.ttl"),)
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {"sonar": SnippetSonarSettings}
    tables = (*JobMission.tables, STRIPS, CLASSIFICATIONS)
    metrics = METRICS
    figures = FIGURES
    scenario: MinehuntingScenario

    @classmethod
    def completed(cls, scenario: MinehuntingScenario) -> MinehuntingScenario:
        jobs = [*(contact.name for contact in scenario.contact), *numbered("revisit", scenario.mission.revisits)]
        return with_job_roles(scenario, [job_role("Viewer", job) for job in jobs], URGENCY)

    @classmethod
    def check(cls, scenario: MinehuntingScenario) -> Iterable[ConfigurationFault]:
        yield from super().check(scenario)
        n_revisits, view_m, contacts = scenario.mission.revisits, scenario.mission.view_m, scenario.contact
        yield from listed_faults(scenario, "contact", "position_m", taken=numbered("revisit", n_revisits))
        if n_revisits:
            apart_m = distance(beside_contact(0, n_revisits + 1, view_m), beside_contact(1, n_revisits + 1, view_m))
            if apart_m < LEAST_APART_M:
                least = f"{LEAST_APART_M:g} m or more, so fewer revisits or farther"
                allowed = f"its views would be {apart_m:.3g} m apart; {least}"
                yield ConfigurationFault("mission.view_m", str(view_m), allowed)
            for number, contact in enumerate(contacts):
                others = contacts[:number]
                # Sonars know a view only by its place.
                near = next((o for o in others if distance(contact.position_m, o.position_m) < 3.0 * view_m), None)
                if near is not None:
                    key = f"contact.{near.name}.position_m"
                    allowed = f"nearer than {3.0 * view_m:g} m to {key}: their views could be confused"
                    yield ConfigurationFault(f"contact.{contact.name}.position_m", "", allowed)
        if not any(sensor.get("type") == "sonar" for vehicle in scenario.vehicle for sensor in vehicle.sensor):
            allowed = 'no vehicle could detect one: give a vehicle a sensor of type "sonar"'
            yield ConfigurationFault("contact", str(len(contacts)), allowed)

    def jobs_of(self, scenario: MinehuntingScenario) -> Iterable[Job]:
        settings, imagery = scenario.mission, scenario.imagery
        contacts_m = {contact.name: contact.position_m for contact in scenario.contact}
        view_s, n_views = (imagery.strips + 1) * imagery.strip_s, settings.revisits + 1

        def view(name: str, number: int) -> ContactView:
            beside_m = beside_contact(number, n_views, settings.view_m)
            return ContactView(name, view_s, beside_m, number=number, contacts_m=contacts_m, beside_m=beside_m)

        self._firsts = tuple(view(name, 0).of(name) for name in contacts_m)
        self._revisits = tuple(view(name, n) for n, name in enumerate(numbered("revisit", settings.revisits), 1))
        return (*self._firsts, *self._revisits)

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [
            *(("ContactView", view.name) for view in self._firsts),
            *(("Revisit", view.name) for view in self._revisits),
        ]

    @property
    def instances_found_per_vehicle(self) -> int:
        return len(self.jobs)

    @property
    def places(self) -> Sequence[Place]:
        return [*self.rally_places, *(Place(c.name, "contact", (c.position_m,)) for c in self.scenario.contact)]

    def world(self, seed: int) -> Minefield:
        contacts = [contact.name for contact in self.scenario.contact]
        views = self._firsts[0], *self._revisits
        places = [(v.of(name).place_m, name, n, v.number) for n, name in enumerate(contacts) for v in views]
        share = self.scenario.imagery.mine_share
        mines = [name for n, name in enumerate(contacts) if loss.uniform(seed, loss.FINDS, n, 0, 0) < share]
        return Minefield(seed, tuple(places), frozenset(mines), self.scenario.imagery)

    def truth(self, recorder: Recorder, world: Minefield) -> MinehuntingTruth:
        contacts = [view.name for view in self._firsts]
        return MinehuntingTruth(self.meeting, self.objective, recorder, contacts, world)

    # Activities ----------------------------------------------------------------------------------

    def groups_of(self, subject: str) -> Collection[str] | None:
        """Return an empty set for revisits: every vehicle needs their requests. Else None."""
        return () if any(view.name == subject for view in self._revisits) else None

    def founding_objectives(self) -> Sequence[Objective]:
        return [*super().founding_objectives(), *self.meeting.objectives(ANALYSING, of_leaders=True)]

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: PointM) -> Pursuit:
        if objective.name != ANALYSING:
            return super().activity_sets(objective, data, facts, position_m)
        analysing = Activity(ANALYSING, ActivityType.ORGANISATIONAL)
        return (ActivitySet(objective, ActivityKind.INDIVIDUAL, (analysing,), 0.0),), frozenset()

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        if activity.name == ANALYSING:
            return Analysing(self.scenario, self._firsts, self._revisits)
        return super().behaviour_for(activity, data)

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """Return the gathering once all contacts are classified (revisits may follow until then)."""
        is_open = any(beliefs.get((CLASSIFIED, view.name)) is None for view in self._firsts)
        if is_open and not self.meeting.is_overdue(group, beliefs, picture):
            return ()
        return super().findings(group, organisation, beliefs, picture, motion)
