"""A vehicle that just stands is not asked again and again, and all comes out as if it was."""

from collections import Counter
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from missions.mapping.mission import MappingMission
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.behaviours import STANDING, Approach, Homing, Perception, Standing, Supervision
from remoras.fleet import Fleet
from remoras.functional.layer import FunctionalLayer
from remoras.holding import NOT, UNLESS_CONCERNED, Holds
from remoras.mission import Finding, Nothing
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.social.layer import SocialLayer
from remoras.truth import FleetView
from remoras.vehicle import Vehicle
from stress.invariants.answers import AnswersHold

RESTARTED = "fault=[{vehicle='ASV00', kind='restarts', at_s=200.0, until_s=300.0}]"
DRAINED = "fault=[{vehicle='ASV00', kind='drains', drain_w=9000.0, at_s=60.0}]"
LOST = "fault=[{vehicle='AUV02', kind='lost', at_s=200.0, until_s=99999.0}]"
RUNS = {
    "a leader that waits": ("mapping-rendezvous", 900.0, ("channel.per=0.2",)),
    "restarts": ("mapping-rendezvous", 500.0, ("channel.per=0.3", RESTARTED)),
    "silent, to the end": ("mapping-rendezvous", 3200.0, ("strategy.name=fixed-partition", LOST)),
    "emptied": ("mapping-rendezvous", 900.0, ("channel.per=0.2", DRAINED)),
}
"""By what happens in them: scenario, how long it lasts (s), and what is set."""


def fleet_of(name: str) -> Fleet:
    scenario, duration_s, settings = RUNS[name]
    given = [("--set", one) for one in (f"scenario.duration_s={duration_s}", *settings)]
    return assemble(resolved(load(scenario, given)), 1)


def rows_of(name: str) -> dict[str, list[Any]]:
    fleet = fleet_of(name)
    fleet.run()
    return {table: list(fleet.recorder.rows(table)) for table in fleet.recorder.tables}


@pytest.mark.parametrize("name", RUNS)
def test_who_stands_leaves_the_rows_of_one_that_is_asked_every_time(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    held = rows_of(name)
    monkeypatch.setattr(Vehicle, "_stand", lambda *of: None)
    asked = rows_of(name)
    assert {table for table in held if held[table] != asked[table]} == set()


def test_who_stands_neither_acts_nor_perceives(monkeypatch: pytest.MonkeyPatch) -> None:
    """The surface vehicle waits at the rally point all the time, with 900 ticks and 450 decisions."""
    asked = Counter[tuple[str, str]]()

    def counting(hook: str) -> None:
        before = getattr(FunctionalLayer, hook)

        def counted(self: FunctionalLayer, *of: Any) -> Any:
            asked[hook, self.data.name] += 1
            return before(self, *of)

        monkeypatch.setattr(FunctionalLayer, hook, counted)

    counting("act")
    counting("perceive")
    fleet_of("a leader that waits").run()
    assert asked["act", "AUV00"] >= 899
    assert asked["perceive", "AUV00"] >= 450
    assert asked["act", "ASV00"] < 400
    assert asked["perceive", "ASV00"] < 200


def test_nobody_looks_around_where_nobody_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the end of its mission a fleet without two jobs waits for who was lost, and its truth with it."""
    fleet = fleet_of("silent, to the end")
    looked = Counter[str]()
    observe, look = fleet.truth.observe, fleet.separation.look

    def counted(view: FleetView, now_s: float) -> bool:
        looked["truth"] += 1
        return observe(view, now_s)

    def seen() -> Any:
        looked["sonar"] += 1
        return look()

    while fleet.now_s < 3050.0:
        fleet.step()
    monkeypatch.setattr(fleet.truth, "observe", counted)
    monkeypatch.setattr(fleet.separation, "look", seen)
    fleet.run()
    assert looked["sonar"] == 0
    assert looked["truth"] < 60


def test_what_was_waited_for_is_no_way() -> None:
    """A metre in the two seconds since it would have been asked last, not in twelve: half the speed meant."""
    approach = Approach(1.0)
    approach.advance(9.0, 0.0, performed=True)
    approach.waited(10.0)
    assert approach.advance(8.0, 12.0, performed=True) == 0.5


def test_a_behaviour_of_ones_own_says_nothing_unless_it_says_it_anew() -> None:
    class Elsewhere(Homing):
        def perceive(self, *of: Any) -> Perception:
            return Perception(0.5)

    class Alike(Homing):
        """It changes nothing."""

    assert Standing().holds(None, None, False) == UNLESS_CONCERNED  # type: ignore[arg-type]
    assert Elsewhere.holds(None, None, None, False) == NOT  # type: ignore[arg-type]
    assert Alike.holds is Homing.holds


def broken_in(fleet: Fleet) -> str | None:
    while fleet.running and fleet.now_s < 900.0:
        fleet.step()
        if (broken := AnswersHold().broken(SimpleNamespace(fleet=fleet, now_s=fleet.now_s))) is not None:  # type: ignore[arg-type]
            return broken
    return None


@pytest.mark.slow
def test_all_that_holds_in_a_mission_does() -> None:
    assert broken_in(fleet_of("a leader that waits")) is None


def test_a_behaviour_that_holds_too_long_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A leader that says it is content until there is news becomes discontented after 500 s."""
    perceive = Supervision.perceive

    def moody(self: Supervision, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return STANDING if picture.body.now_s > 500.0 else perceive(self, motion, picture, performed)

    monkeypatch.setattr(Supervision, "perceive", moody)
    monkeypatch.setattr(Supervision, "holds", lambda *of: UNLESS_CONCERNED)
    broken = broken_in(fleet_of("a leader that waits"))
    assert broken is not None
    assert "perceive of ASV00 said to hold" in broken


def test_findings_that_come_too_early_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mission says that its heads conclude nothing for good, and from 60 s on they would."""

    def boasting(
        self: MappingMission, group: Any, organisation: Any, beliefs: Any, picture: Any, motion: Any
    ) -> Sequence[Finding]:
        early = picture.body.now_s < 60.0
        return Nothing() if early else [Finding(group.name, "gatheredAt", group.rally_point)]

    monkeypatch.setattr(MappingMission, "findings", boasting)
    monkeypatch.setattr(SocialLayer, "findings", _kept_for_good(SocialLayer.findings))
    broken = broken_in(fleet_of("a leader that waits"))
    assert broken is not None
    assert broken.startswith("findings of ")


def _kept_for_good(findings: Callable[..., Any]) -> Callable[..., Any]:
    """Nothing is asked again after 50 s, though there are news."""

    def asked(self: SocialLayer, motion: Any, now_s: float) -> Any:
        if now_s > 50.0:
            self.nothing.keep(Holds(), motion)
            return []
        return findings(self, motion, now_s)

    return asked
