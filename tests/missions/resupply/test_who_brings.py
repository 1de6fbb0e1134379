"""Who goes to give energy, who leaves it to others, and how a run ends where nobody is left to."""

import math
from collections import defaultdict

import pytest
from resupplying import OFF, events, sampled

from missions.meeting.helping import Help
from missions.resupply.boring import Bringing, HelpAtBerth
from missions.runs.assembly import assemble
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.scenarios import load

HELPERS = ("AUV00", "AUV01", "AUV02")
ONE_STORE = tuple(
    f"vehicle.{name}.sensor.charger.store_j={store_j}" for name, store_j in zip(HELPERS, (1.5e6, 0.0, 0.0), strict=True)
)
LOST = 'fault=[{kind="lost",vehicle="AUV03",at_s=700.0}]'


def anew(seed: int, *keys: str) -> Run:
    """A run that is not taken from those that were made before."""
    return run(load("resupply-field", [("--set", key) for key in keys]), seed)


def ended_s(of: Run) -> float:
    """When it really ended: ``end_s`` is the whole duration where a mission is not complete."""
    return float(of.recorder.trajectories[-1][0])


def crowded_s(of: Run) -> int:
    """For how long two helpers were about the same berth."""
    at_m: dict[float, list[tuple[float, float]]] = defaultdict(list)
    for time_s, vehicle, x_m, y_m, *_ in of.recorder.trajectories:
        if vehicle in HELPERS:
            at_m[time_s].append((x_m, y_m))
    holes_m = [boring["position_m"] for boring in of.scenario.model_dump()["boring"]]
    berths_m = [(x_m + 10.0, y_m) for x_m, y_m in holes_m]
    return sum(any(sum(math.dist(one, at) < 15.0 for one in there) > 1 for at in berths_m) for there in at_m.values())


@pytest.mark.slow
def test_one_helper_lies_at_a_berth_and_the_others_keep_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where each goes by what is nearer, as in other missions, idle vehicles lie about the same berth."""
    assert crowded_s(sampled(1, OFF)) < 30
    monkeypatch.setattr(HelpAtBerth, "goes_before", Help.goes_before)
    assert crowded_s(anew(1, OFF)) > 200


@pytest.mark.slow
@pytest.mark.parametrize("cause", ["leaves for others", "counts on who has nothing"])
def test_one_vehicle_with_all_energy_helps_two_drills(monkeypatch: pytest.MonkeyPatch, cause: str) -> None:
    """It goes on until a battery is full, and counts on nobody to come who has nothing to give."""
    assert sampled(1, *ONE_STORE).end_s < sampled(1, *ONE_STORE, OFF).end_s - 50.0
    if cause == "leaves for others":
        monkeypatch.setattr(Bringing, "_is_giving", lambda self, picture: False)
    else:
        monkeypatch.setattr(HelpAtBerth, "stay_away", Help.stay_away)
    assert anew(1, *ONE_STORE).end_s > sampled(1, *ONE_STORE, OFF).end_s + 50.0


@pytest.mark.slow
def test_nobody_helps_at_a_hole_whose_vehicle_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The run ends once the others are home; a helper that did not see that nobody waits lay there for 1000 s more."""
    done = sampled(1, LOST)
    assert not done.completed
    assert "no vehicle left that is able to do hole 2, hole 3, hole 4" in done.reason
    monkeypatch.setattr(Bringing, "_is_awaited", lambda self, picture: True)
    assert ended_s(anew(1, LOST)) > ended_s(done) + 500.0


@pytest.mark.parametrize("strategy", ["cbba", "status-broadcast"])
def test_whose_job_nobody_is_told_of_is_helped_too(strategy: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """No holder is known of who claims a job for itself alone: that it lies at the hole is heard."""
    keys = (f'strategy.name="{strategy}"',)
    assert sampled(1, *keys).completed
    monkeypatch.setattr(Bringing, "_is_awaited", lambda self, picture: bool(self._help.holders))
    assert not anew(1, *keys).completed


def test_where_nobody_tells_anybody_the_run_ends_and_says_what_had_no_energy() -> None:
    """Under ``fixed-partition`` no call is heard: both drills give up after ``wait_s``, and all come home."""
    done = sampled(1, 'strategy.name="fixed-partition"', "mission.wait_s=600.0")
    assert not done.completed
    assert ended_s(done) < 2500.0
    halted = {hole for _, _, hole, _ in events(done, "halted")}
    assert len(halted) == 2
    assert "without energy: " in done.reason
    assert all(f"{hole} since" in done.reason for hole in halted)


def test_a_run_says_what_was_not_done_though_somebody_said_so() -> None:
    """All believe AUV01 and meet; the site is not surveyed, so the mission is not complete, and says why."""
    fleet = assemble(resolved(load("resupply-field", [("--set", "scenario.duration_s=3600.0")])), 1)
    while fleet.running:
        fleet.step()
        if fleet.steps == 60:
            assert fleet.let_say("AUV01", lambda beliefs: [beliefs.fact("site 18", "jobDone", "AUV01")])
    assert not fleet.completed
    assert fleet.reason == "jobs not done: site 18"
