"""Drills and chargers measure what they have: nobody takes a hole for bored that is not, wherever others lie."""

from pathlib import Path
from typing import Any

import pytest
from resupplying import events, raw, sampled, written
from sample_vehicles import AUV

from missions.errors import ConfigurationError
from missions.nodes import NodePlan
from missions.resupply import ResupplyMission
from missions.resupply.energy import (
    BORING,
    GIVING,
    HALTED,
    Charger,
    ChargerSettings,
    Drill,
    DrillSettings,
    Energies,
)
from missions.runs.assembly import assemble
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.sensor import Fact, Pose
from remoras.testing import sensors as conformance

AT = Pose(0.0, 0.0, 20.0, 0.0, 0.0)
DRILL, CHARGER = DrillSettings(type="drill", name="corer"), ChargerSettings(type="charger", name="charger")


def flown_with_sites_at_berths(folder: Path, seed: int, *keys: str) -> Run:
    """A run with one more site at the berth of each hole."""
    tables = raw()
    tables["site"] += [
        {"name": f"berth of {hole['name']}", "position_m": [hole["position_m"][0] + 10.0, hole["position_m"][1]]}
        for hole in tables["boring"]
    ]
    return run(load(str(written(folder, tables)), [("--set", key) for key in keys]), seed)


def claimed_too_early(of: Run) -> set[str]:
    """Holes that were said to be bored before they were, or that never were."""
    bored_s = {hole: time_s for time_s, _, hole, _ in events(of, "bored")}
    claims = [(row[4], row[3]) for row in of.recorder.items if row[5] == "jobDone" and row[4].startswith("hole")]
    return {hole for hole, time_s in claims if hole not in bored_s or time_s < bored_s[hole]}


@pytest.mark.slow
@pytest.mark.parametrize("keys", [(), ("decision.weight_external=0.0",)])
def test_who_surveys_a_site_at_a_berth_is_not_taken_for_a_charger(tmp_path: Path, keys: tuple[str, ...]) -> None:
    done = flown_with_sites_at_berths(tmp_path, 1, *keys)
    assert done.completed
    assert not claimed_too_early(done)


@pytest.mark.slow
def test_a_drill_that_counts_time_in_place_of_measuring_claims_what_is_not_bored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cause: what vehicles said was so before they measured."""
    honest = DrillSettings.reading

    def counts(self: DrillSettings, vehicle: str, energies: Energies) -> list[Fact]:
        drill = self.of(vehicle, energies)
        return honest(self, vehicle, energies) if drill.state != HALTED else [(drill.hole, "boredShare", 1.0)]

    monkeypatch.setattr(DrillSettings, "reading", counts)
    done = flown_with_sites_at_berths(tmp_path, 1, "scenario.duration_s=1500.0")
    assert claimed_too_early(done)
    assert "said to be bored and not: hole" in done.reason


def test_what_is_measured_is_what_was_so_a_tick_before() -> None:
    """A drill has nothing left; its vehicle knows that in its next motion tick."""
    done = sampled(1, "scenario.duration_s=1500.0")
    read = [(row[4], row[3]) for row in done.recorder.items if row[5:7] == ("drillState", HALTED)]
    for halted_s, vehicle, *_ in events(done, "halted"):
        assert (vehicle, halted_s + 1.0) in read


def test_a_reading_is_told_in_steps_and_at_its_ends() -> None:
    """Of 90 kJ in 1000 steps down to nothing: at the start, where it passes a tenth, and at the end."""
    drill = Drill(90e3, BORING, "hole 1")
    world, sensor = Energies({(AUV.name, "corer"): drill}, bored={"hole 1": 0.0}), DRILL.make(AUV)
    told = []
    for step in range(1001):
        drill.left_j = 90e3 * (1000 - step) / 1000
        told += [
            fact[2] for one in sensor.sense(AT, world, float(step)) for fact in one.facts if fact[1] == "drillCharge"
        ]
    assert len(told) == 12  # full, ten steps, empty
    assert (told[0], told[-1]) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("settings", "world", "n"),
    [
        (DRILL, Energies({(AUV.name, "corer"): Drill(1e3, HALTED, "hole 1")}, bored={"hole 1": 0.5}), 1),
        (DRILL, Energies(), 1),
        (CHARGER, Energies(chargers={(AUV.name, "charger"): Charger(2e5, GIVING)}), 1),
    ],
)
def test_equipment_conforms(settings: Any, world: Energies, n: int) -> None:
    """Nothing changes on the way, so that each tells all once."""
    assert conformance.check(settings, AUV, world, [("Boring", "hole 1")], ResupplyMission.vocabulary) == n


@pytest.mark.slow
def test_a_vehicle_that_lost_its_memory_measures_its_battery_anew() -> None:
    """What it reads is what the truth has, and so it says of no hole that it is bored which is not."""
    done = sampled(1, 'fault=[{kind="restarts",vehicle="AUV03",at_s=700.0,until_s=760.0,memory="lost"}]')
    assert done.completed
    assert not claimed_too_early(done)
    charges = [(row[3], float(row[6])) for row in done.recorder.items if row[4:6] == ("AUV03", "drillCharge")]
    before = [share for time_s, share in charges if time_s < 700.0][-1]
    after = next(share for time_s, share in charges if time_s > 760.0)
    came = any(vehicle != "AUV03" and 600.0 < time_s < 760.0 for time_s, vehicle, *_ in events(done, "came"))
    assert came or after <= before + 0.1


def test_a_vehicle_by_itself_is_refused_a_mission_in_which_energy_passes() -> None:
    plan = NodePlan.of(load("resupply-field"), "AUV03", 1, 100.0, 0.0)
    with pytest.raises(ConfigurationError, match="in which nothing passes between vehicles") as refused:
        plan.setup()
    assert "\n" not in str(refused.value)


def test_what_one_run_does_to_its_world_the_next_one_does_not_have() -> None:
    """The mission serves all runs."""
    setup = resolved(load("resupply-field", [("--set", "scenario.duration_s=600.0")]))
    bored = []
    for _ in range(2):
        fleet = assemble(setup, 1)
        fleet.run()
        bored.append([row for row in fleet.recorder.rows("energy") if row[3] == "bored"])
    assert len(bored[0]) == 2
    assert bored[0] == bored[1]


def test_nature_has_to_be_callable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ResupplyMission, "nature", lambda self, world: "wind")
    with pytest.raises(ConfigurationError, match=r"nature .*None, or what is called with the fleet and the time"):
        load("resupply-field")
