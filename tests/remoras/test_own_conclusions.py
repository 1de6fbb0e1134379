"""What a vehicle concludes for itself, which of its sensors tell that they work, and beacons that vehicles carry."""

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from stress.invariants_of_runs import AnswersHold

from missions.features.navigation import Carriers
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.trident import TridentMission
from remoras.faults import Condition, Fault, condition_under
from remoras.mission import Finding, Nothing
from remoras.navigation import Beacon, Navigation, NavigationConstants

NAME = "trident-intervention"


def fleet(*settings: str) -> Any:
    return assemble(resolved(load(NAME, [("--set", one) for one in settings])), 2)


def dead(vehicle: str, sensor: str) -> Condition:
    return condition_under([Fault("sensor", vehicle, 0.0, leaves=Condition(dead_sensors=frozenset({sensor})))])


def test_a_vehicle_sees_which_of_its_sensors_say_that_they_work() -> None:
    asv, auv = fleet("vehicle.IAUV00.sensor.1.self_test=false").vehicles
    assert asv.functional.picture.body.answering == ("multibeam", "usbl", "console")
    assert "stereo" not in auv.functional.picture.body.answering  # it tells nothing, working or not
    asv.suffer(dead("ASV00", "usbl"))
    assert asv.functional.picture.body.answering == ("multibeam", "console")
    asv.suffer(condition_under([]))
    assert asv.functional.picture.body.answering == ("multibeam", "usbl", "console")


def test_a_beacon_is_where_its_carrier_is_and_silent_with_it() -> None:
    whole, carriers = fleet(), Carriers()
    asv = whole.vehicles[0]
    assert carriers.position_m("ASV00", "usbl") is None  # nothing has begun
    carriers.begin(whole)
    assert carriers.position_m("ASV00", "usbl") == asv.functional.motion.position_m
    for condition in (
        dead("ASV00", "usbl"),
        condition_under([Fault("mute", "ASV00", 0.0, leaves=Condition(is_mute=True))]),
        condition_under([Fault("lost", "ASV00", 0.0, leaves=Condition(is_running=False))]),
    ):
        asv.suffer(condition)
        assert carriers.position_m("ASV00", "usbl") is None
    asv.suffer(dead("ASV00", "console"))
    assert carriers.position_m("ASV00", "usbl") is not None
    assert carriers.position_m("ASV07", "usbl") is None  # it is simulated elsewhere


def test_an_error_shrinks_near_a_beacon_that_moves_and_grows_when_it_is_gone() -> None:
    at_m: list[Any] = [(1000.0, 0.0)]
    beacon = Beacon(lambda: at_m[0], 50.0)
    adrift = Navigation(NavigationConstants(0.1, 10.0, (beacon,)), 20.0, lambda n: 0.0)
    adrift.go((0.0, 0.0), 100.0, 10.0)
    assert adrift.error_m == pytest.approx((10.0, 0.0))
    at_m[0] = (30.0, 0.0)
    adrift.go((0.0, 0.0), 0.0, 10.0)
    assert adrift.error_m == pytest.approx((10.0 / math.e, 0.0))
    at_m[0] = None
    adrift.go((0.0, 0.0), 100.0, 10.0)
    assert adrift.error_m == pytest.approx((10.0 / math.e + 10.0, 0.0))


class Talkative(TridentMission):
    """Concludes one thing, and says it once."""

    def conclusions(self, data: Any, organisation: Any, beliefs: Any, picture: Any, motion: Any) -> Sequence[Finding]:
        told = beliefs.get(("serviceCost", "ASV00 usbl"))
        return [] if told is not None or data.name != "ASV00" else [Finding("ASV00 usbl", "serviceCost", 7.0)]


class Wrong(TridentMission):
    """Concludes what is no finding."""

    def conclusions(self, *of: Any) -> Sequence[Finding]:
        return ["nothing"]  # type: ignore[list-item]


def of_mission(mission: type[TridentMission]) -> Any:
    setup = resolved(load(NAME, [("--set", "scenario.duration_s=30"), ("--per", "channel.per=0.0")]))
    return assemble(replace(setup, mission=mission.from_scenario(setup.scenario)), 2)


def test_what_a_vehicle_concludes_is_recorded_and_told() -> None:
    whole = of_mission(Talkative)
    whole.run()
    rows = [row for row in whole.recorder.items if row[5] == "serviceCost"]
    assert [(row[1], row[4], row[6], row[7]) for row in rows] == [("ASV00", "ASV00 usbl", "7.0", "told")]
    assert whole.vehicles[1].beliefs.get(("serviceCost", "ASV00 usbl")) == 7.0


def test_what_is_no_finding_is_refused_by_name() -> None:
    with pytest.raises(Exception, match=r"conclusions.*a list of Finding"):
        of_mission(Wrong).run()


def test_plans_may_ask_what_is_of_a_class() -> None:
    whole = fleet()
    auv = whole.vehicles[1]
    assert auv.social.facts.get(("instances", "Manipulation")) == ("IAUV00 arm", "IAUV00 gripper")
    assert auv.social.facts.get(("instances", "TargetReacquisition")) == ()
    auv.conclude([auv.beliefs.fact("IAUV00 camera", "providedBy", "IAUV00")], 1.0)
    assert auv.social.facts.get(("instances", "TargetReacquisition")) == ("IAUV00 camera",)


def test_who_is_back_looks_at_nothing_before_it_acts_again() -> None:
    """Else what stood under a sensor that went too fast to see would be seen by it at rest."""
    whole = assemble(resolved(load("mapping-rendezvous")), 2)
    while not any(vehicle.functional.sensing for vehicle in whole.vehicles):
        whole.step()
    vehicle = next(one for one in whole.vehicles if one.functional.sensing)
    for faults in ([Fault("lost", vehicle.name, 0.0, leaves=Condition(is_running=False))], []):
        vehicle.suffer(condition_under(faults))
        assert vehicle.functional.sensing == ()
        assert vehicle.functional.motion.speed_mps == 0.0
    whole.step()
    assert vehicle.functional.sensing


class Patient(TridentMission):
    """Counts how often it is asked, and says of nothing that it holds for ten seconds, or until there is news."""

    asked: ClassVar[list[tuple[str, float]]] = []

    def conclusions(self, data: Any, organisation: Any, beliefs: Any, picture: Any, motion: Any) -> Sequence[Finding]:
        Patient.asked.append((data.name, picture.body.now_s))
        return Nothing(10.0)


def test_who_concludes_nothing_until_a_time_is_not_asked_before() -> None:
    """Both are asked as they plan and hear of it, and from 10 s on at each decision, every 2 s to the end at 30 s."""
    Patient.asked.clear()
    fleet = of_mission(Patient)
    fleet.run()
    late = {name: [time_s for of, time_s in Patient.asked if of == name and time_s >= 10.0] for name in fleet.names}
    early = [time_s for _, time_s in Patient.asked if time_s < 10.0]
    assert all(len(times) >= 10 for times in late.values())
    assert len(early) < 10


class Unsaid(TridentMission):
    """Says of nothing how long it holds."""

    def conclusions(self, *of: Any) -> Sequence[Finding]:
        return list(super().conclusions(*of))


@pytest.mark.slow
def test_what_holds_until_there_is_news_is_what_would_be_answered() -> None:
    """A mission that is asked at each decision leaves the same rows: two blocks, a choice and a recovery."""
    setup = resolved(load(NAME, [("--set", "scenario.duration_s=4000")]))
    runs = [assemble(replace(setup, mission=of.from_scenario(setup.scenario)), 1) for of in (TridentMission, Unsaid)]
    for fleet in runs:
        fleet.run()
    held, asked = (fleet.recorder for fleet in runs)
    assert {name for name in held.tables if held.rows(name) != asked.rows(name)} == set()
    assert "chosen" in {row[5] for row in held.items}


class Boastful(TridentMission):
    """Says that it concludes nothing until there is news, and does all the same after 20 s."""

    def conclusions(self, data: Any, organisation: Any, beliefs: Any, picture: Any, motion: Any) -> Sequence[Finding]:
        return Nothing() if picture.body.now_s < 20.0 else [Finding("ASV00 usbl", "serviceCost", 7.0)]


def test_who_concludes_something_before_is_named() -> None:
    fleet = of_mission(Boastful)
    broken = None
    while fleet.running and broken is None:
        fleet.step()
        broken = AnswersHold().broken(SimpleNamespace(fleet=fleet, now_s=fleet.now_s))
    assert broken is not None
    assert broken.startswith("conclusions of ")
    assert fleet.now_s >= 20.0


def test_nothing_until_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match="not a number"):
        Nothing(math.nan)
