"""The functional layer: sensing, integrity, motion as decided, and checks of plug-ins."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from samples import activity_set, auv

from missions.features.current import Current, in_current
from remoras.activities import Activity, ActivitySet, ActivityType, Wait
from remoras.behaviours import ALWAYS_DUE, DUE, Behaviour, Homing, Perception, Reference, Standing
from remoras.beliefs import Beliefs
from remoras.database import VehicleData
from remoras.errors import PluginError
from remoras.functional.layer import FunctionalLayer, Sensed
from remoras.functional.vital import VITAL_NAMES, VITAL_SETS
from remoras.motion import Motion
from remoras.motion.avoidance import Neighbour
from remoras.picture import Picture
from remoras.recorder import TIME, VEHICLE, Column, Table
from remoras.sensor import Observation, Pose, Quiet
from remoras.work import Point
from worldmodel import Instance, WorldModel, core_ontology_paths, read_tbox

BOUNDS_M = (-100.0, -100.0, 800.0, 800.0)
N_VITAL = len(VITAL_SETS)
HOMING = activity_set(("Homing", ActivityType.GUIDANCE))
WORKING = activity_set(("Working", ActivityType.PRODUCTIVE), sensors=("depth",))
DEPTHS = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))


class Shore:
    """A mission: homing and something to be done, on a sea floor that falls off to the east."""

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        return Homing((100.0, 0.0), 5.0, "Operational", data) if activity.name == "Homing" else Standing()

    def world(self, seed: int) -> Callable[[float], float]:
        return lambda x_m: 0.1 * x_m


class DepthSounder:
    """Writes a row in every tick; a depth below 1 m is worth a fact too."""

    table = DEPTHS

    def sense(self, pose: Pose, world: Callable[[float], float], now_s: float) -> Sequence[Observation]:
        return [Observation(row=(world(pose.x_m),))]


class Hydrophone:
    """Observes something every other second."""

    table = None

    def sense(self, pose: Pose, world: Any, now_s: float) -> Sequence[Observation]:
        return [Observation((("AUV01", "position", (pose.x_m, pose.y_m)),))] if now_s % 2.0 == 0.0 else []


def layer(*sets: ActivitySet, mission: Any = None, sensors: Any = None, **changes: object) -> FunctionalLayer:
    of_vehicle = {"depth": DepthSounder(), "sound": Hydrophone()} if sensors is None else sensors
    of_mission = mission or Shore()
    functional = FunctionalLayer(auv(**changes), of_mission, of_mission.world(1), of_vehicle, BOUNDS_M, Picture())
    functional.prepare(sets)
    return functional


def perform(functional: FunctionalLayer, *numbers: int) -> None:
    """Perform sets of the mission, by their number."""
    functional.perform([N_VITAL + number for number in numbers])


def perceived(functional: FunctionalLayer, *performed: int) -> list[Perception]:
    """What the sets of the mission perceive, if those of these numbers are performed."""
    return functional.perceive([N_VITAL + number for number in performed])[N_VITAL:]


def test_no_behaviour_exceeds_the_speed_limit_of_a_vehicle() -> None:
    class Racing(Standing):
        def reference(self, motion: Motion, picture: Picture) -> Reference | None:
            return Reference((1000.0, 0.0), 99.0)

    functional = layer(HOMING, mission=Answering(Racing()), transit_speed_mps=2.0, survey_speed_mps=1.5)
    perform(functional, 0)
    for _ in range(60):
        functional.act(1.0)
    assert functional.motion.speed_mps == 2.0


@pytest.mark.parametrize(("target_m", "speed_mps", "n_asked"), [
    ((700.0, 0.0), 1.5, 1), ((0.0, 0.0), 1.5, 10), ((5.0, 0.0), 0.0, 1)
])  # fmt: skip
def test_a_reference_is_asked_again_only_within_its_distance(target_m: Point, speed_mps: float, n_asked: int) -> None:
    asked: list[Reference] = []

    class Going(Standing):
        def reference(self, motion: Motion, picture: Picture) -> Reference | None:
            asked.append(Reference(target_m, speed_mps, 2.0))
            return asked[-1]

    functional = layer(HOMING, mission=Answering(Going()), transit_speed_mps=2.0, survey_speed_mps=1.5)
    perform(functional, 0)
    for _ in range(10):
        functional.act(1.0)
    assert len(asked) == n_asked


@pytest.mark.parametrize("stays", [True, False])
def test_a_vehicle_at_rest_makes_room_one_tick_after_its_sonar_detects_another(stays: bool) -> None:
    functional = layer(HOMING, start_m=(96.0, 0.0))
    perform(functional, 0)
    other = [Neighbour(-40.0, 0.0, 0.0, 0.0)]
    for now_s, neighbours in ((1.0, []), (2.0, []), (3.0, other), (4.0, other if stays else [])):
        assert functional.motion.speed_mps == 0.0
        functional.act(1.0, neighbours)
        functional.sense(now_s, neighbours)
    assert functional.motion.speed_mps > 0.0


# Sensors ------------------------------------------------------------------------------------------


def test_a_sensor_is_read_only_while_an_activity_uses_it() -> None:
    functional = layer(HOMING, WORKING, start_m=(30.0, 0.0))
    perform(functional, 0)
    assert functional.sense(0.0, ()) == []
    perform(functional, 0, 1)
    assert functional.sense(1.0, ()) == [Sensed("depth", DEPTHS, Observation(row=(3.0,)))]
    perform(functional, 0)
    assert functional.sense(2.0, ()) == []


# What others write --------------------------------------------------------------------------------


class Answering(Shore):
    """A mission whose behaviour is given, or raised."""

    def __init__(self, made: Any) -> None:
        self._made = made

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Any:
        if isinstance(self._made, BaseException):
            raise self._made
        return self._made


class Saying:
    """A behaviour with given answers, which it raises if they are errors."""

    def __init__(self, perception: Any = DUE, reference: Any = None) -> None:
        self._answers = perception, reference

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Any:
        return self._answer(0)

    def reference(self, motion: Motion, picture: Picture) -> Any:
        return self._answer(1)

    def _answer(self, number: int) -> Any:
        answer = self._answers[number]
        if isinstance(answer, BaseException):
            raise answer
        return answer


@pytest.mark.parametrize("made", [None, "homing", KeyError("rally"), SystemExit(0)])
def test_an_object_that_is_no_behaviour_is_refused(made: Any) -> None:
    says = "mission Answering, activity Homing: behaviour_for (returned|raised) .*; expected: a Behaviour"
    with pytest.raises(PluginError, match=says):
        layer(HOMING, mission=Answering(made))


@pytest.mark.parametrize(
    ("perception", "says"),
    [
        (None, "returned None; expected: a Perception"),
        (1.0, "returned 1.0; expected: a Perception"),
        (Perception(1.5), r"returned Perception\(stimulus=1.5.*; expected: a Perception, stimulus 0..1"),
        (Perception(math.nan), "returned .*; expected: a Perception, stimulus 0..1"),
        (Perception(1.0, until_s=math.nan), "returned .*; expected: a Perception, stimulus 0..1, until_s no NaN"),
        (Perception("much"), r"returned Perception\(stimulus='much'.*; expected: a Perception, stimulus 0..1"),  # type: ignore[arg-type]
        (KeyError("AUV01"), "raised KeyError: 'AUV01'"),
        (SystemExit(0), "raised SystemExit: 0"),
    ],
)
def test_a_wrong_perception_is_one_clear_message(perception: Any, says: str) -> None:
    functional = layer(HOMING, mission=Answering(Saying(perception)))
    with pytest.raises(PluginError, match=f"mission Answering, activity Homing: perceive {says}"):
        functional.perceive(())


@pytest.mark.parametrize(
    ("reference", "says"),
    [
        ((0.0, 0.0), r"returned \(0.0, 0.0\)"),
        (Reference((math.inf, 0.0), 1.0), "returned Reference"),
        (Reference((0.0, 0.0), -1.0), "returned Reference"),
        (Reference((0.0, 0.0), 1.0, math.nan), "returned Reference"),
        (Reference((0.0, 0.0), 1.0, -5.0), "returned Reference"),
        (Reference(None, 1.0), "raised TypeError"),  # type: ignore[arg-type]
        (ZeroDivisionError("no way"), "raised ZeroDivisionError: no way"),
        (SystemExit(0), "raised SystemExit: 0"),
    ],
)
def test_a_wrong_reference_is_one_clear_message(reference: Any, says: str) -> None:
    functional = layer(HOMING, mission=Answering(Saying(DUE, reference)))
    perform(functional, 0)
    with pytest.raises(PluginError, match=f"activity Homing: reference {says}.*; expected: None, or a Reference"):
        functional.act(1.0)


def test_a_behaviour_is_queried_again_when_its_answer_expires() -> None:
    """At 1 m/s from 10 m away: it is asked at 10 m, and from 4 m on; after a decision at once."""
    asked_at_m: list[float] = []

    class Going(Saying):
        def reference(self, motion: Motion, picture: Picture) -> Reference:
            asked_at_m.append(round(10.0 - motion.x_m, 6))
            return Reference((10.0, 0.0), 1.0, 4.0)

    functional = layer(HOMING, mission=Answering(Going()))
    perform(functional, 0)
    functional.motion.speed_mps = 1.0
    for _ in range(8):
        functional.act(1.0)
    assert asked_at_m == [10.0, 4.0, 3.0]
    functional.motion.x_m = 0.0
    functional.act(1.0)
    functional.perceive((0,))
    functional.act(1.0)
    assert asked_at_m[3:] == [9.0]


@pytest.mark.parametrize(
    ("reads", "asked_after"),
    [
        (lambda facts: facts.values(("knownDone", "left")), ["left"]),
        (lambda facts: facts.get(("position", "AUV00")), []),
    ],
    ids=["by values", "otherwise"],
)
def test_a_valid_perception_ends_with_a_change_of_the_facts_that_it_read(
    reads: Callable[[Beliefs], object], asked_after: list[str]
) -> None:
    """What reads one job by ``values`` depends on it alone; what reads otherwise, on no fact."""
    asked: list[str] = []

    class Reading(Standing):
        def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
            asked.append(now)
            reads(held)
            return ALWAYS_DUE

    tbox = read_tbox(*core_ontology_paths())
    named = (("AUV", "AUV00"), ("Job", "left"), ("Job", "right"))
    instances = tuple(Instance(uid, tbox.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named))
    held = Beliefs(WorldModel(tbox, 0, instances, n_origins=1, run_time_instances_per_origin=0))
    functional = layer(HOMING, mission=Answering(Reading()))
    functional.picture.facts = held
    for job in ("left", "right"):
        held.values(("knownDone", job))
    now = "at first"
    functional.perceive(())
    for now in ("left", "right"):
        held.model.record([held.fact(now, "knownDone", True)], 1.0)
        held.note()
        functional.perceive(())
        functional.perceive(())
    assert asked == ["at first", *asked_after]


def test_waits_are_cleared_when_activities_are_replaced() -> None:
    class Waiting(Standing):
        def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
            return Perception(1.0, waits=Wait("a vehicle", 60.0))

    class Queue(Shore):
        def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
            return Waiting() if activity.name == "Waiting" else super().behaviour_for(activity, data)

    waiting = activity_set(("Waiting", ActivityType.GUIDANCE))
    functional = layer(waiting, mission=Queue())
    perform(functional, 0)
    perceived(functional, 0)
    assert functional.waits == Wait("a vehicle", 60.0)
    functional.prepare([HOMING, waiting])
    perform(functional, 0)
    assert functional.waits is None


def test_a_quiet_sensor_is_read_again_at_its_time_or_distance() -> None:
    read: list[float] = []

    class Resting(DepthSounder):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Quiet:
            read.append(now_s)
            return Quiet(until_m=5.0, until_s=3.0) if now_s < 3.0 else Quiet(until_m=5.0)

    functional = layer(WORKING, sensors={"depth": Resting()})
    perform(functional, 0)
    for now_s in (0.0, 1.0, 2.0, 3.0, 4.0):
        functional.sense(now_s, ())
    assert read == [0.0, 3.0]
    for now_s, x_m in ((5.0, 4.9), (6.0, 5.1), (7.0, 0.2), (8.0, 0.0)):
        functional.motion.x_m = x_m
        functional.sense(now_s, ())
    assert read == [0.0, 3.0, 6.0, 8.0]
    assert functional.sensors.looking == ("depth",)
    perform(functional, 0)  # a decision that switches sensors reads them again
    functional.sense(9.0, ())
    assert read[-1] == 9.0
    with pytest.raises(ValueError, match="has a NaN"):
        Quiet(until_s=float("nan"))


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (None, "raised TypeError"),
        (["deep"], r"returned \('deep',\)"),
        (OSError("wet"), "raised OSError: wet"),
        (SystemExit(0), "raised SystemExit: 0"),
    ],
)
def test_a_wrong_observation_is_one_clear_message(answer: Any, says: str) -> None:
    class Broken(DepthSounder):
        def sense(self, pose: Pose, world: Any, now_s: float) -> Any:
            if isinstance(answer, BaseException):
                raise answer
            return answer

    functional = layer(WORKING, sensors={"depth": Broken()})
    perform(functional, 0)
    with pytest.raises(PluginError, match=f"sensor depth of AUV00: sense {says}.*; expected: a list of Observation"):
        functional.sense(0.0, ())


@pytest.mark.parametrize("name", sorted(VITAL_NAMES))
def test_a_mission_cannot_override_vital_behaviours(name: str) -> None:
    with pytest.raises(PluginError, match=f"'{name}' is the name of an activity of the vehicle itself"):
        layer(activity_set(("Working", ActivityType.PRODUCTIVE), (name, ActivityType.GUIDANCE)))
    with pytest.raises(PluginError, match=r"importance is 5\.0; allowed: 0 to 1"):
        layer(activity_set(("Working", ActivityType.PRODUCTIVE), importance=5.0))


# Integrity ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("position", "outside_m"),
    [((0.0, 0.0), 0.0), ((-100.0, 800.0), 0.0), ((-130.0, 0.0), 30.0), ((0.0, 810.0), 10.0), ((850.0, -101.0), 50.0)],
)
def test_distance_outside_the_area_of_operations(position: tuple[float, float], outside_m: float) -> None:
    functional = layer(start_m=position)
    functional.perceive(())
    assert functional.picture.body.outside_m == outside_m


def test_a_vehicle_switched_on_drifts_with_the_present_current() -> None:
    """At 300 s of a tide of 600 s the current has turned: in a second it carries a vehicle 0.2 m west, not east."""
    shore = Shore()
    functional = FunctionalLayer(auv(), shore, shore.world(1), {}, BOUNDS_M, Picture())
    in_current(functional, Current(0.2, 0.0, tide_period_s=600.0))
    functional.prepare([])
    functional.act(1.0, (), 300.0)
    heading_m = functional.motion.speed_mps * functional.motion.ahead[0]
    assert functional.motion.x_m - heading_m == pytest.approx(-0.2)
