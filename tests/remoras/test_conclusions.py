"""Conclusions of a vehicle, working sensors, and beacons carried by vehicles."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from missions.features.navigation import Drift
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.trident import TridentMission
from remoras.condition import Condition
from remoras.faults import Fault, condition_under
from remoras.mission import Finding, Quiet

NAME = "trident-intervention"


def fleet(*settings: str) -> Any:
    return assemble(resolved(load(NAME, [("--set", one) for one in settings])), 2)


def dead(vehicle: str, sensor: str) -> Condition:
    return condition_under([Fault("sensor", vehicle, 0.0, leaves=Condition(dead_sensors=frozenset({sensor})))])


def test_a_beacon_is_where_its_carrier_is_and_silent_with_it() -> None:
    whole, drift = fleet(), Drift(SimpleNamespace(scenario=load(NAME), seed=2))  # type: ignore[arg-type]
    asv = whole.vehicles[0]
    assert drift.carrier_m("ASV00", "usbl") is None  # nothing has begun
    drift.on_start(whole)
    assert drift.carrier_m("ASV00", "usbl") == asv.functional.motion.position_m
    for condition in (
        dead("ASV00", "usbl"),
        condition_under([Fault("mute", "ASV00", 0.0, leaves=Condition(is_mute=True))]),
        condition_under([Fault("lost", "ASV00", 0.0, leaves=Condition(is_running=False))]),
    ):
        asv.suffer(condition)
        assert drift.carrier_m("ASV00", "usbl") is None
    asv.suffer(dead("ASV00", "console"))
    assert drift.carrier_m("ASV00", "usbl") is not None
    assert drift.carrier_m("ASV07", "usbl") is None  # it is simulated elsewhere


class Talkative(TridentMission):
    """Draws one conclusion and sends it once."""

    def conclusions(self, data: Any, organisation: Any, beliefs: Any, picture: Any, motion: Any) -> Sequence[Finding]:
        told = beliefs.get(("serviceCost", "ASV00 usbl"))
        return [] if told is not None or data.name != "ASV00" else [Finding("ASV00 usbl", "serviceCost", 7.0)]


class Wrong(TridentMission):
    """Draws an invalid conclusion."""

    def conclusions(self, *of: Any) -> Sequence[Finding]:
        return ["nothing"]  # type: ignore[list-item]


def of_mission(mission: type[TridentMission]) -> Any:
    setup = resolved(load(NAME, [("--set", "scenario.duration_s=30"), ("--per", "channel.per=0.0")]))
    return assemble(replace(setup, mission=mission.from_scenario(setup.scenario)), 2)


def test_conclusions_of_a_vehicle_are_recorded_and_sent() -> None:
    whole = of_mission(Talkative)
    whole.run()
    rows = [row for row in whole.recorder.items if row[5] == "serviceCost"]
    assert [(row[1], row[4], row[6], row[7]) for row in rows] == [("ASV00", "ASV00 usbl", "7.0", "told")]
    assert whole.vehicles[1].beliefs.get(("serviceCost", "ASV00 usbl")) == 7.0


class Distant(TridentMission):
    """Draws none within 10 m and before 20 s."""

    n_calls = 0

    def conclusions(self, *of: Any) -> Sequence[Finding]:
        Distant.n_calls += 1
        return Quiet(until_m=10.0, until_s=20.0)


@pytest.mark.parametrize(
    ("x_m", "now_s", "has_news", "n_calls"),
    [(9.9, 19.9, False, 1), (10.0, 19.9, False, 2), (9.9, 20.0, False, 2), (9.9, 19.9, True, 2)],
)
def test_a_mission_is_asked_again_at_the_end_of_its_quiet_or_upon_news(
    monkeypatch: pytest.MonkeyPatch, x_m: float, now_s: float, has_news: bool, n_calls: int
) -> None:
    monkeypatch.setattr(Distant, "n_calls", 0)
    vehicle = of_mission(Distant).vehicles[1]
    picture, motion, present = vehicle.functional.picture, vehicle.functional.believed, vehicle.social.present
    start_m = motion.x_m
    vehicle.social.conclusions.of_its_own(vehicle.data, present, picture, motion)
    if has_news:
        vehicle.conclude([vehicle.beliefs.fact("ASV00 usbl", "serviceCost", 7.0)], 0.0)
    picture.body.now_s, motion.x_m = now_s, start_m + x_m
    vehicle.social.conclusions.of_its_own(vehicle.data, present, picture, motion)
    assert Distant.n_calls == n_calls


def test_an_invalid_conclusion_is_refused_by_name() -> None:
    with pytest.raises(Exception, match=r"conclusions.*a list of Finding"):
        of_mission(Wrong).run()


def test_a_restarted_vehicle_observes_nothing_before_it_acts() -> None:
    """Else what stood under a sensor that went too fast to see would be seen by it at rest."""
    whole = assemble(resolved(load("mapping-rendezvous")), 2)
    while not any(vehicle.functional.sensors.looking for vehicle in whole.vehicles):
        whole.step()
    vehicle = next(one for one in whole.vehicles if one.functional.sensors.looking)
    for faults in ([Fault("lost", vehicle.name, 0.0, leaves=Condition(is_running=False))], []):
        vehicle.suffer(condition_under(faults))
        assert vehicle.functional.sensors.looking == ()
        assert vehicle.functional.motion.speed_mps == 0.0
    whole.step()
    assert vehicle.functional.sensors.looking
