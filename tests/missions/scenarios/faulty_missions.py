"""User missions and sensors with one fault each; scenarios derived from ``small_mission`` name them."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from missions.mapping import MappingMission
from missions.mapping.truth import MappingTruth
from missions.meeting import JobMission, StayJob
from missions.metric import Better, Metric
from remoras.database import VehicleData
from remoras.htn import Domain, Method, Operator, Task
from remoras.mission import Mission
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import Observation, Pose, Sensor, SensorSettings

DEPTH = Column("depth_m", "float", "m")


def raises(*given: Any, **more: Any) -> Any:
    """Do not hold what TOML may give."""
    raise KeyError("buoys")


def broken(*given: Any, **more: Any) -> Any:
    """Fail at sea."""
    raise ZeroDivisionError("no echo")


def gives(value: Any) -> Any:
    """Method that returns a constant for any arguments."""
    return lambda *given, **more: value


def with_metric(name: str, unit: str, better: Any, of: Any) -> dict[str, Any]:
    """The metrics of mapping, and one more."""
    return {"metrics": (*MappingMission.metrics, Metric(name, unit, better, name, of))}


class Sound(MappingMission):
    """Nothing is wrong with it."""


class Lacking(Mission):
    """Has its tables, and neither truth nor jobs nor anything else that is compulsory but these."""

    Scenario = MappingMission.Scenario
    group_missions = MappingMission.group_missions


class SwitchesAllOn(MappingMission):
    """Every activity set switches all sensors of the vehicle on."""

    def activity_sets(self, objective: Any, data: VehicleData, facts: Any, position_m: Any) -> Any:
        sets, keys = super().activity_sets(objective, data, facts, position_m)
        on = tuple(sensor.name for sensor in data.sensors)
        return tuple(replace(s, activities=tuple(replace(a, sensors=on) for a in s.activities)) for s in sets), keys


class TruthRaises(MappingMission):
    """Its truth fails while it watches."""

    def truth(self, *given: Any) -> MappingTruth:
        truth = super().truth(*given)
        truth.observe = raises  # type: ignore[method-assign]
        return truth


class Objectless(JobMission):
    """Mission of jobs that does not declare the objective of roles with a job."""

    group_missions = ("AreaMapping",)
    jobs_of, behaviour_at = gives([]), gives(None)


def with_jobs(*places_m: Any, stay_s: float = 5.0) -> dict[str, Any]:
    """The jobs of mapping, and a buoy at each of these places."""
    buoys = [StayJob("buoy", place_m, stay_s) for place_m in places_m]
    return {"jobs_of": lambda self, scenario: [*MappingMission.jobs_of(self, scenario), *buoys]}


DANCE = Domain.of([Operator("Dance")], {"AreaMapping": [Method("dance", lambda facts, group: [Task("Dance")])]})
LOWER = Better.LOWER
FAULTY: dict[str, dict[str, Any]] = {
    "OtherScenario": {"Scenario": SimpleNamespace},
    "WrongTruth": {"truth": lambda self: None}, "FromScenarioRaises": {"from_scenario": classmethod(raises)},
    "CheckRaises": {"check": classmethod(raises)}, "CheckOfText": {"check": classmethod(gives(["no buoys"]))},
    "NoDirection": with_metric("wear", "", None, gives(0.0)),
    "MetricRaises": with_metric("wear", "", LOWER, broken),
    "NoMetric": {"metrics": (len,)},
    "OtherColumns": {"tables": (*MappingMission.tables, Table("coverage", (TIME, DEPTH)))},
    "NoVocabulary": {"vocabulary": (Path("/nowhere/buoys.ttl"),)},
    "NoSensorSettings": {"sensors": {"mapping": dict}},
    "DomainOfNumbers": {"social_domain": 5}, "Dancing": {"social_domain": DANCE},
    "NoTruth": {"truth": lambda self, recorder, world: None}, "Undecided": {"is_enough": gives("perhaps")},
    "Undivided": {"is_individual": gives("perhaps")},
    "JobOutside": with_jobs((9999.0, 0.0)), "JobNowhere": with_jobs((0.0, math.nan)), "JobAtNumber": with_jobs(5.0),
    "Doubling": with_jobs((0.0, 0.0), (0.0, 0.0)), "EndsBefore": with_jobs((0.0, 0.0), stay_s=-500.0),
    "NeverEnds": with_jobs((0.0, 0.0), stay_s=math.nan),
    "ManyFound": {"instances_found_per_vehicle": "many"}, "LessThanNone": {"most_observations": -1},
    "NoPairs": {"instances": ("buoy",)}, "DomainOfText": {"activity_domain": "survey"},
    "NatureOfNumber": {"nature": gives(7)}, "Incomplete": {"completed": classmethod(gives(None))},
    "FigureOfNumbers": {"figures": (3,)},
    "UnknownClass": {"instances": property(lambda self: [("Boy", name) for name in self.corners_m])},
}  # fmt: skip
globals().update({name: type(name, (MappingMission,), {"__module__": __name__, **of}) for name, of in FAULTY.items()})


# Sensors ------------------------------------------------------------------------------------------


class Sounder:
    """Sensor that measures the depth; it has its own table."""

    table: Any = Table("soundings", (TIME, VEHICLE, DEPTH))

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        return [Observation(row=(pose.depth_m,))]


class SounderSettings(SensorSettings):
    """A sensor with a table."""

    interval_s: float = 1.0

    def make(self, data: VehicleData) -> Sensor:
        return Sounder()


class OffByDefault(SounderSettings):
    """A default outside the bounds of its own key."""

    interval_s: float = Field(-1.0, gt=0.0)


class Bare(SensorSettings):
    """Sensor settings without ``make``."""


class Unmakable(SensorSettings):
    """Its sensor cannot be made."""

    made: ClassVar[Any] = None

    def make(self, data: VehicleData) -> Sensor:
        if self.made is None:
            raise RuntimeError("no transducer")
        sensor: Sensor = self.made
        return sensor


SENSORS: dict[str, Any] = {
    "BrokenSettings": (Sounder, {"sense": broken}),
    "NumbersSettings": (Sounder, {"sense": lambda self, pose, world, now_s: [pose.depth_m]}),
    "ShortRowSettings": (Sounder, {"sense": gives([Observation(row=("deep",))])}),
    "NoTableSettings": (Sounder, {"table": "soundings"}),
    "TablelessSettings": (Sounder, {"table": None}),
    "MuteSettings": (object, {"table": None}),
}
for name, (base, body) in SENSORS.items():
    made = type(name.removesuffix("Settings"), (base,), body)()
    of = {"__module__": __name__, "__annotations__": {"made": ClassVar[Any]}, "made": made}
    globals()[name] = type(name, (Unmakable,), of)
