"""A mission other than mapping: visits with a dwell time and an order, for whole runs of every strategy."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

import tomli_w
from pydantic import Field

from missions.scenarios import Scenario, load
from missions.scenarios.organisation import groups_of
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import ADVANCING, CAPTURE_M, DONE, DUE, Behaviour, Homing, Perception, Planning, Reference
from remoras.behaviours import distance_m as to_go_m
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.htn import Domain, FactsLike, Method, Operator, Task
from remoras.mission import Finding, FleetView, Milestone, Mission
from remoras.motion import Motion
from remoras.organisation import Group
from remoras.picture import Picture
from remoras.recorder import Recorder
from remoras.table import Name, PointM, Section
from remoras.testing.sample_worlds import Visit
from remoras.work import Point

WORDS = """
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .

rm:objectiveVisiting a owl:ObjectProperty ; rdfs:label "objective: visiting"@en ;
    rdfs:domain rm:Role ; rdfs:range rm:Job .
"""
FOLDER = Path(tempfile.mkdtemp(prefix="visiting-mission-"))
VOCABULARY = FOLDER / "visiting.ttl"
VOCABULARY.write_text(WORDS, encoding="utf-8")
HEARD = ("playsRole", "leftRole", "objectiveVisiting", "jobDone", "gatheredAt", "position")
STAY_S = 40.0
PLACES_M = ((60.0, 60.0), (120.0, -60.0), (-60.0, 120.0), (-120.0, -60.0), (0.0, 150.0))
NEEDS = {1: ("place 0",), 2: ("place 0", "place 1"), 4: ("place 3",)}
"""Visits that others must come before, by number: a chain of three, and a pair."""


class VisitTable(Section):
    """One ``[[visit]]``."""

    name: Name = Field(description="name of the place")
    place_m: PointM = Field(description="where it is")
    stay_s: float = Field(gt=0.0, description="how long the vehicle stays")
    needs: tuple[str, ...] = Field((), description="visits that come before")


class VisitingScenario(Scenario):
    """The tables of a scenario, and the visits."""

    visit: tuple[VisitTable, ...] = Field(min_length=1, description="places to be visited")


class Visiting(Behaviour):
    """Goes to a place and stays."""

    def __init__(self, visit: Visit, data: VehicleData) -> None:
        self._visit, self._speed_mps = visit, data.transit_speed_mps
        self._here_s: float | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if to_go_m(motion, self._visit.place_m) > 5.0 * CAPTURE_M:
            return ADVANCING if performed else DUE
        if not performed or self._here_s is None:
            self._here_s = picture.body.now_s
        if picture.body.now_s - self._here_s >= self._visit.stay_s:
            return DONE
        return ADVANCING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        is_here = to_go_m(motion, self._visit.place_m) <= CAPTURE_M
        return Reference(self._visit.place_m, 0.0 if is_here else self._speed_mps)


class VisitingTruth:
    """Notes when each visit has ended; the mission is complete when all have."""

    def __init__(self, jobs: Sequence[str], recorder: Recorder) -> None:
        self._jobs, self.recorder = jobs, recorder
        self.milestones: list[Milestone] = []

    @property
    def is_over(self) -> bool:
        return False

    @property
    def goal_fraction(self) -> float:
        return len({one.name for one in self.milestones}) / len(self._jobs)

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        for vehicle in fleet.vehicles:
            for objective in vehicle.finished:
                milestone = Milestone(now_s, f"visited {objective.argument}", vehicle.name)
                if not any((one.name, one.vehicle) == (milestone.name, vehicle.name) for one in self.milestones):
                    self.milestones.append(milestone)
        return {one.name for one in self.milestones} == {f"visited {job}" for job in self._jobs}

    def close(self, fleet: FleetView, now_s: float) -> str:
        return f"visited only: {', '.join(sorted({one.name for one in self.milestones}))}"


class VisitingMission(Mission):
    """Visits, given out by whatever strategy."""

    Scenario = VisitingScenario
    group_missions = ("Visiting",)
    needs = ("playsRole", "objectiveVisiting", "jobDone")
    vocabulary: ClassVar[tuple[Path, ...]] = (VOCABULARY,)
    Truth = VisitingTruth

    def __init__(self, groups: Sequence[Group], visits: Mapping[str, Visit], rally_m: Mapping[str, Point]) -> None:
        self._groups = {group.name: group for group in groups}
        self._visits, self._rally_m = visits, rally_m

    @classmethod
    def from_scenario(cls, scenario: VisitingScenario) -> Self:
        visits = {v.name: Visit(v.name, v.place_m, v.stay_s, v.needs) for v in scenario.visit}
        return cls(groups_of(scenario), visits, {r.name: r.position_m for r in scenario.rally_point})

    @property
    def jobs(self) -> Mapping[str, Visit]:
        return self._visits

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [("Job", name) for name in self._visits]

    @property
    def social_domain(self) -> Domain:
        def visit(facts: FactsLike, group: str) -> list[Task]:
            roles = [role for role in self._groups[group].roles if role.job is not None]
            given = [Task("AssignObjective", (group, role.name, "Visiting", role.job)) for role in roles]
            return [Task("AllocateRoles", (group,)), *given]

        operators = [Operator("AllocateRoles"), Operator("AssignObjective"), Operator("GiveMission")]
        return Domain.of(operators, {"Visiting": [Method("visit all", visit)]})

    def founding_objectives(self) -> Sequence[Objective]:
        return [
            objective
            for group in self._groups.values()
            for role in group.roles
            if role.founding
            for objective in (
                *([Objective(group.name, role.name, "GroupSupervision", group.name)] if role.head else []),
                Objective(group.name, role.name, "RendezVous", group.rally_point or ""),  # where the group meets
            )
        ]

    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        if objective.name == "GroupSupervision":
            planner = Activity("MissionPlanner", ActivityType.PLANNING)
            return (ActivitySet(objective, ActivityKind.COLLECTIVE, (planner,), 1.0, None),), frozenset()
        if objective.name == "RendezVous":
            homing = Activity("Homing", ActivityType.GUIDANCE, (objective.argument, objective.group))
            return (ActivitySet(objective, ActivityKind.COLLECTIVE, (homing,), 0.2, None),), frozenset()
        done = self._visits[objective.argument].done
        if facts.get(done) is not None:
            return (), frozenset({done})
        going = Activity("Visiting", ActivityType.GUIDANCE, (objective.argument,))
        return (ActivitySet(objective, ActivityKind.INDIVIDUAL, (going,), 0.6, None),), frozenset({done})

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        if activity.name == "Visiting":
            return Visiting(self._visits[activity.parameters[0]], data)
        if activity.name == "Homing":
            point, group = activity.parameters
            return Homing(self._rally_m[point], 20.0, group, data)
        return Planning()

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        return Finding(objective.argument, "jobDone", vehicle) if objective.name == "Visiting" else None

    def truth(self, recorder: Recorder, world: Any) -> VisitingTruth:
        return self.Truth(tuple(self._visits), recorder)


def visiting_scenario(per: float) -> VisitingScenario:
    """Three vehicles, five visits, some of which need others."""
    roles = [f"Visitor{n}" for n in range(len(PLACES_M))]
    raw: dict[str, Any] = {
        "scenario": {"name": "visits", "mission": f"{__name__}:VisitingMission", "duration_s": 1200.0},
        "world": {"x_m": [-300.0, 300.0], "y_m": [-300.0, 300.0]},
        "communication": {
            "modem": "s2c-18-34", "range_m": 1000.0, "policy": "mps-ack-repeat", "needs": dict.fromkeys(HEARD, 50),
        },
        "channel": {"name": "bernoulli", "per": per},
        "strategy": {"name": "remoras"},
        "rally_point": [{"name": "buoy", "position_m": [0.0, -100.0]}],
        "visit": [
            {"name": f"place {n}", "place_m": list(place_m), "stay_s": STAY_S, "needs": list(NEEDS.get(n, ()))}
            for n, place_m in enumerate(PLACES_M)
        ],
        "group": [{"name": "Team", "rally_point": "buoy", "mission": "Visiting", "role": [
            {"name": "Head", "minimum": 1, "maximum": 1, "head": True, "founding": True},
            {"name": "Hand", "founding": True},
            *({"name": role, "maximum": 1, "job": f"place {n}"} for n, role in enumerate(roles)),
        ]}],
        "vehicle": [
            {
                "name": f"AUV{n:02d}", "vehicle_type": "AUV", "slot": n, "start_m": [20.0 * n, -120.0],
                "depth_m": 10.0 + 10.0 * n, "depth_limit_m": 100.0, "transit_speed_mps": 2.0, "survey_speed_mps": 1.5,
                "energy_j": 2.0e6, "hotel_w": 20.0, "drag_w_per_mps3": 10.0,
                "playable_roles": ["Hand", *roles] if n else ["Head", "Hand", *roles],
            }
            for n in range(3)
        ],
    }  # fmt: skip
    file = FOLDER / f"visits-{per}.toml"
    file.write_text(tomli_w.dumps(raw), encoding="utf-8")
    scenario = load(str(file))
    assert isinstance(scenario, VisitingScenario)
    return scenario
