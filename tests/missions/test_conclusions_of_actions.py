"""What missions may rest on: batteries that drain, behaviours that conclude facts, classes that follow from facts."""

import pytest

from missions.runs.assembly import assemble
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.scenario import Scenario

QUIET = {"fault": "[]", "upset": "[]", "current.surge": "[]", "scenario.duration_s": "200.0"}


def scenario(**settings: str) -> Scenario:
    """The shipped scenario for 200 s, with nothing that befalls but what is set; ``__`` stands for a dot."""
    given = {**QUIET, **{key.replace("__", "."): value for key, value in settings.items()}}
    return load("pandora-inspection", [("--set", f"{key}={value}") for key, value in given.items()])


def test_a_battery_that_drains_loses_that_power() -> None:
    """From 50 s to 150 s 30 W are 3000 J, beside what the vehicle uses."""
    fault = "[{vehicle='AUV01', kind='drains', drain_w=30.0, at_s=50.0, until_s=150.0}]"
    used_j = []
    for faults in ("[]", fault):
        done = run(scenario(mission__adaptation="'none'", fault=faults), 1)
        used_j.append([row[6] for row in done.recorder.trajectories if row[1] == "AUV01"][-1])
    assert used_j[1] - used_j[0] == pytest.approx(3000.0, abs=31.0)


def test_what_follows_from_facts_is_known_to_plans() -> None:
    fleet = assemble(resolved(scenario()), 1)
    vehicle = fleet.vehicles[0]
    assert not vehicle.social.facts.get(("isA", "valve A1.StuckValve"))
    vehicle.conclude([vehicle.beliefs.fact("valve A1", "anomaly", "resists")], 0.0)
    assert vehicle.social.facts.get(("isA", "valve A1.StuckValve")) is True
    assert vehicle.social.facts.get(("isA", "valve A1.AnomalousPart")) is True
    assert not vehicle.social.facts.get(("isA", "valve A2.StuckValve"))


def test_what_an_action_concludes_is_recorded_and_told() -> None:
    done = run(scenario(upset="[{kind='turned', part='valve A1'}]", scenario__duration_s="900.0"), 1)
    (said,) = [row for row in done.recorder.items if row[5] == "anomaly"]
    assert (said[4], said[6], said[7]) == ("valve A1", "turned", "told")
    heard = {row[1] for row in done.recorder.knowledge if row[2] == said[0] and row[4] == "received"}
    assert len(heard) == 2
