"""Missions that break one rule each, derived from a conforming mission of visits."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

from visiting_mission import VisitingMission, VisitingScenario, VisitingTruth

from missions.metric import Better, Metric
from remoras.activities import Activity, Objective
from remoras.behaviours import Behaviour, Standing
from remoras.database import VehicleData
from remoras.htn import Domain, FactsLike, Method, Operator, Task
from remoras.mission import FleetView, Mission
from remoras.recorder import TIME, Column, Table
from remoras.testing.sample_worlds import Visit


class Partial(Mission):
    """Lacks nearly all."""


class Wordless(VisitingMission):
    """Assigns an objective that its vocabulary does not have."""

    @property
    def social_domain(self) -> Domain:
        def dream(facts: FactsLike, group: str) -> list[Task]:
            return [Task("AssignObjective", (group, "Head", "Daydreaming", group))]

        return Domain.of([Operator("AssignObjective")], {"Visiting": [Method("dream", dream)]})


class Misdirected(VisitingMission):
    """Gives an objective about an instance of another class."""

    def founding_objectives(self) -> Sequence[Objective]:
        return [*super().founding_objectives(), Objective("Team", "Head", "RendezVous", "Team")]


class TooMuch(VisitingMission):
    """Has a job that no role names."""

    @property
    def jobs(self) -> Mapping[str, Visit]:
        return {**super().jobs, "the moon": Visit("the moon", (0.0, 0.0))}


class Helpless(VisitingMission):
    """Has no behaviour for one of its activities."""

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Any:
        return None if activity.name == "Homing" else super().behaviour_for(activity, data)


class Remembering(VisitingMission):
    """Counts queries in an object shared by all vehicles."""

    n_asked = 0

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        self.n_asked += 1
        return super().behaviour_for(activity, data)


class Individual(VisitingMission):
    """Each instance differs from the others."""

    _made: ClassVar[Any] = itertools.count()

    @classmethod
    def from_scenario(cls, scenario: VisitingScenario) -> Self:
        made = super().from_scenario(scenario)
        made._rally_m = {name: (x + next(cls._made), y) for name, (x, y) in made._rally_m.items()}
        return made


class Meddling(VisitingMission):
    """Its truth carries a vehicle to its visit."""

    class Truth(VisitingTruth):
        def observe(self, fleet: FleetView, now_s: float) -> bool:
            fleet.vehicles[0]._vehicle.functional.motion.x_m += 0.1  # type: ignore[attr-defined]
            return super().observe(fleet, now_s)


class Speechless(VisitingMission):
    """Never completes and gives no reason."""

    class Truth(VisitingTruth):
        def observe(self, fleet: FleetView, now_s: float) -> bool:
            return False

        def close(self, fleet: FleetView, now_s: float) -> str:
            return ""


class Boundless(VisitingMission):
    """Has a metric that is no finite number."""

    metrics = (Metric("luck", "", Better.HIGHER, "luck", lambda run: math.inf),)


class Careless(VisitingMission):
    """Writes rows that do not fit its table."""

    tables = (Table("looks", (TIME, Column("n_vehicles", "int"))),)

    class Truth(VisitingTruth):
        def observe(self, fleet: FleetView, now_s: float) -> bool:
            self.recorder.rows("looks").append((now_s, "many"))
            return super().observe(fleet, now_s)


class ByHash(VisitingMission):
    """Where vehicles meet depends on the hash of a name."""

    @classmethod
    def from_scenario(cls, scenario: VisitingScenario) -> Self:
        made = super().from_scenario(scenario)
        made._rally_m = {name: (x + hash(name) % 97, y) for name, (x, y) in made._rally_m.items()}
        return made


class Idle(VisitingMission):
    """Has an objective that no vehicle can pursue."""

    def activity_sets(self, objective: Objective, data: VehicleData, facts: Any, position_m: Any) -> Any:
        if objective.name == "RendezVous":
            return (), frozenset()
        return super().activity_sets(objective, data, facts, position_m)


class Overexcited(VisitingMission):
    """Has a behaviour that breaks the rules of behaviours."""

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        class Loud(Standing):
            def perceive(self, motion: Any, picture: Any, performed: bool) -> Any:
                return 1.0

        return Loud() if activity.name == "Homing" else super().behaviour_for(activity, data)


class Biased(Standing):
    """Breaks the rules on one vehicle."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Any, picture: Any, performed: bool) -> Any:
        return 1.0 if self._data.node == 2 else super().perceive(motion, picture, performed)


class Partisan(VisitingMission):
    """Has a behaviour that breaks the rules on one of several vehicles alike but for name and place."""

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        return Biased(data) if activity.name == "Homing" else super().behaviour_for(activity, data)
