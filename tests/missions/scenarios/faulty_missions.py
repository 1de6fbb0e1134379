"""Missions and sensors from outside, each with one fault; the pond of ``small_mission`` names them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, Self

from missions.mapping import MappingMission
from missions.mapping.truth import MappingTruth
from missions.meeting import JobMission
from missions.metric import Better, Metric
from missions.runs.run import Run
from remoras.database import VehicleData
from remoras.htn import Domain, Method, Operator, Task
from remoras.mission import FleetView, Mission
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
from remoras.sensor import Observation, Pose, Sensor, SensorSettings


class Sound(MappingMission):
    """Nothing is wrong with it."""


class Lacking(Mission):
    """Has its tables, and neither truth nor jobs nor anything else that is compulsory but these."""

    Scenario = MappingMission.Scenario
    group_missions = MappingMission.group_missions


class OtherScenario(MappingMission):
    """Its Scenario is a class, but none of scenarios."""

    Scenario = SimpleNamespace  # type: ignore[assignment]


class ObjectAsScenario(MappingMission):
    """Its Scenario is no class."""

    Scenario = 5  # type: ignore[assignment]


class WrongTruth(MappingMission):
    """Its truth takes no recorder."""

    def truth(self) -> Any:  # type: ignore[override]
        return None


class FromScenarioRaises(MappingMission):
    """It cannot be made."""

    @classmethod
    def from_scenario(cls, scenario: Any) -> Self:
        raise KeyError("buoys")


class CheckRaises(MappingMission):
    """Its check does not hold what TOML may give."""

    @classmethod
    def check(cls, raw: Mapping[str, Any]) -> Iterable[Any]:
        raise KeyError("buoys")


class NoDirection(MappingMission):
    """Nobody knows which of two wear values is the better one."""

    metrics = (*MappingMission.metrics, Metric("wear", "", None, "wear", lambda run: 0.0))  # type: ignore[arg-type]


class SameMetricTwice(MappingMission):
    """A metric of every run, declared anew."""

    metrics = (*MappingMission.metrics, Metric("energy_j", "J", Better.LOWER, "energy", lambda run: 0.0))


class NoMetric(MappingMission):
    """A function where a metric belongs."""

    metrics = (len,)  # type: ignore[assignment]


def _raise(run: Run) -> float:
    raise ZeroDivisionError("nothing was worn")


class MetricRaises(MappingMission):
    """Its metric raises."""

    metrics = (*MappingMission.metrics, Metric("wear", "", Better.LOWER, "wear", _raise))


class MetricOfText(MappingMission):
    """Its metric is no number."""

    metrics = (*MappingMission.metrics, Metric("wear", "", Better.LOWER, "wear", lambda run: "much"))  # type: ignore[arg-type, return-value]


class MetricNotFinite(MappingMission):
    """Its metric is infinite."""

    metrics = (*MappingMission.metrics, Metric("wear", "", Better.LOWER, "wear", lambda run: float("inf")))


class OtherColumns(MappingMission):
    """One of its tables has the name of another."""

    tables = (
        *MappingMission.tables,
        Table("coverage", (TIME, Column("depth_m", "float", "m"))),
    )


class NoVocabulary(MappingMission):
    """Its vocabulary is not there."""

    vocabulary = (Path("/nowhere/buoys.ttl"),)


class TextAsVocabulary(MappingMission):
    """Its vocabulary is one path instead of several."""

    vocabulary = "buoys.ttl"  # type: ignore[assignment]


class Turning(MappingMission):
    """Its vocabulary is a file that a test writes beside the scenario."""

    vocabulary: ClassVar[tuple[Path, ...]] = ()


class NoSensorSettings(MappingMission):
    """Its kind of sensor is no settings."""

    sensors: ClassVar[Any] = {"mapping": dict}


# Sensors ------------------------------------------------------------------------------------------


class Sounder:
    """Measures the depth; a table of its own."""

    table: Any = Table("soundings", (TIME, VEHICLE, Column("depth_m", "float", "m")))

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        return [Observation(row=(pose.depth_m,))]


class SounderSettings(SensorSettings):
    """A sensor with a table."""

    interval_s: float = 1.0

    def make(self, data: VehicleData) -> Sensor:
        return Sounder()


class Broken(Sounder):
    """Raises at sea."""

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        raise ZeroDivisionError("no echo")


class Numbers(Sounder):
    """Returns numbers at sea."""

    def sense(self, pose: Pose, world: Any, now_s: float) -> Any:
        return [pose.depth_m]


class NoTable(Sounder):
    """Its table is a name."""

    table = "soundings"


class OtherTable(Sounder):
    """Its table has the name of one of every run."""

    table = Table("packets", (TIME, VEHICLE, Column("depth_m", "float", "m")))


class ShortRow(Sounder):
    """Its rows have no value for the column that its table declares."""

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        return [Observation(row=("deep",))]


class Mute:
    """Lacks sense."""

    table = None


class _Making(SensorSettings):
    """Mapping settings, so that the vehicle maps with what the subclass makes."""

    made: ClassVar[Any] = None

    def make(self, data: VehicleData) -> Sensor:
        if self.made is None:
            raise RuntimeError("no transducer")
        sensor: Sensor = self.made()
        return sensor


class Unmakable(_Making):
    """Its sensor cannot be made."""


class BrokenSettings(_Making):
    """See ``Broken``."""

    made = Broken


class NumbersSettings(_Making):
    """See ``Numbers``."""

    made = Numbers


class NoTableSettings(_Making):
    """See ``NoTable``."""

    made = NoTable


class OtherTableSettings(_Making):
    """See ``OtherTable``."""

    made = OtherTable


class ShortRowSettings(_Making):
    """See ``ShortRow``."""

    made = ShortRow


class MuteSettings(_Making):
    """See ``Mute``."""

    made = Mute


class Bare(SensorSettings):
    """Does not say how its sensor is made."""


class Tableless(Sounder):
    """Gives rows, and has no table for them."""

    table: Any = None


class TablelessSettings(_Making):
    """Of a sensor without a table."""

    made = Tableless


class SwitchesAllOn(MappingMission):
    """Every activity set that maps or does anything else switches all sensors of the vehicle on."""

    def activity_sets(self, objective: Any, data: VehicleData, facts: Any, position_m: Any) -> Any:
        from dataclasses import replace

        sets, keys = super().activity_sets(objective, data, facts, position_m)
        on = tuple(sensor.name for sensor in data.sensors)
        return tuple(replace(s, activities=tuple(replace(a, sensors=on) for a in s.activities)) for s in sets), keys


class WorldRaises(MappingMission):
    """Has no world."""

    def world(self, seed: int) -> Any:
        raise KeyError("buoys")


class DomainOfNumbers(MappingMission):
    """Its domain is none."""

    @property
    def social_domain(self) -> Any:
        return 5


class Dancing(MappingMission):
    """Plans what no vehicle can do."""

    @property
    def social_domain(self) -> Domain:
        return Domain.of([Operator("Dance")], {"AreaMapping": [Method("dance", lambda facts, group: [Task("Dance")])]})


class NoTruth(MappingMission):
    """Nobody watches its runs."""

    def truth(self, recorder: Recorder, world: Any) -> Any:
        return None


class Undecided(MappingMission):
    """Does not say whether enough is done."""

    def is_enough(self, facts: Any) -> Any:
        return "perhaps"


class TruthRaises(MappingMission):
    """Its truth fails while it watches."""

    def truth(self, recorder: Recorder, world: Any) -> MappingTruth:
        class Truth(MappingTruth):
            def observe(self, fleet: FleetView, now_s: float) -> bool:
                raise KeyError("buoys")

        return Truth(self.meeting, world, self.swaths_m, self.settings.goal, recorder)


class FigureOfNumbers(MappingMission):
    """Lists a number among its figures."""

    figures: ClassVar[Any] = (3,)


class UnknownClass(MappingMission):
    """Names instances of a class that no vocabulary has."""

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [("Boy", name) for name in self.corners_m]


class JobsOfNumbers(MappingMission):
    """Its jobs are none."""

    @property
    def jobs(self) -> Any:
        return {"north bank": 1}


class PlacesRaise(MappingMission):
    """Its map has no places to show."""

    @property
    def places(self) -> Sequence[Any]:
        raise KeyError("buoys")


class PlacesOfNumbers(MappingMission):
    """Its places are none."""

    @property
    def places(self) -> Any:
        return [3]


class InstancesOfNumbers(MappingMission):
    """Its instances are none."""

    @property
    def instances(self) -> Any:
        return [3]


class CountOfText(MappingMission):
    """Counts in words what its sensors find."""

    instances_found_per_vehicle: Any = "many"


class CheckOfText(MappingMission):
    """Its check finds faults that are mere text."""

    @classmethod
    def check(cls, raw: Mapping[str, Any]) -> Iterable[Any]:
        return ["no buoys"]


class MetricNamedSeed(MappingMission):
    """Declares a metric with the name of another field of the summary."""

    metrics = (*MappingMission.metrics, Metric("seed", "", Better.LOWER, "seeds", lambda run: 7))


class Objectless(JobMission):
    """A mission of jobs that does not say what roles with a job pursue."""

    group_missions = ("AreaMapping",)

    def jobs_of(self, scenario: Any) -> list[Any]:
        return []

    def behaviour_at(self, job: Any, data: VehicleData) -> Any:
        return None
