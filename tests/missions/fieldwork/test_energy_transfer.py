"""Energy transfer to drills: measurement, calls, helpers with spare energy."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from recorded import flown
from sample_vehicles import AUV
from varied import Varied

from missions.errors import ConfigurationError
from missions.fieldwork.energy import (
    BORING,
    HALTED,
    Bringing,
    ChargerSettings,
    DrillSettings,
    Energies,
    HelpAtBerth,
    Store,
)
from missions.nodes import NodePlan
from missions.runs.run import Run
from missions.scenarios import load
from remoras.picture import Picture
from remoras.sensor import Pose

sampled = Varied("resupply-field", "field.toml").flown
OFF = "decision.weight_external=0.0"


def events(of: Run, event: str) -> list[tuple[float, str, str, float]]:
    """Events at holes: time, vehicle, hole, energy."""
    return [(row[0], row[1], row[2], row[4]) for row in of.recorder.rows("energy") if row[3] == event]


def lost(vehicle: str, at_s: float) -> str:
    return f'fault=[{{kind="lost",vehicle="{vehicle}",at_s={at_s}}}]'


def mean_wait_s(of: Run) -> float:
    """Until the first vehicle comes to a hole where the work is halted."""
    came = events(of, "came")
    waits_s = [
        min((time_s for time_s, _, of_hole, _ in came if of_hole == hole and time_s > at_s), default=of.end_s) - at_s
        for at_s, _, hole, _ in events(of, "halted")
    ]
    return math.fsum(waits_s) / len(waits_s)


@pytest.mark.slow
def test_missions_are_shorter_where_calls_are_answered() -> None:
    """A call draws vehicles from their own sites; without calls they help only once they have no other work."""
    on, off = sampled(1), sampled(1, OFF)
    assert on.completed
    assert off.completed
    assert on.end_s < 0.95 * off.end_s
    assert mean_wait_s(on) < 0.6 * mean_wait_s(off)


def test_energy_of_drills_is_conserved() -> None:
    """Drills use the energy of their batteries plus the transferred energy; no vehicle gives more than it has."""
    done = sampled(1)
    brought_j = math.fsum(energy_j for *_, energy_j in events(done, "brought"))
    taken_j = 8 * 240.0 * 300.0
    assert taken_j * 0.98 - 2 * 90e3 <= brought_j <= taken_j
    for vehicle in ("AUV00", "AUV01", "AUV02"):
        assert math.fsum(row[3] for row in events(done, "brought") if row[1] == vehicle) <= 0.7 * 500e3


@pytest.mark.slow
def test_hole_is_reported_as_bored_only_after_it_was() -> None:
    """Also where a helper is lost while it gives."""
    done = sampled(2, lost("AUV02", 700.0))
    bored_s = {hole: time_s for time_s, _, hole, _ in events(done, "bored")}
    claimed = {row[4]: row[3] for row in reversed(done.recorder.items) if row[5] == "jobDone" and "hole" in row[4]}
    assert done.completed
    assert len(claimed) == len(bored_s) == 8
    assert all(claimed[hole] >= bored_s[hole] for hole in claimed)


AT = Pose(0.0, 0.0, 20.0, 0.0, 0.0)
DRILL, CHARGER = DrillSettings(type="drill", name="corer"), ChargerSettings(type="charger", name="charger")


def test_halted_drill_is_known_in_the_next_tick() -> None:
    """A drill has nothing left; its vehicle knows that in its next motion tick."""
    done = sampled(1, "scenario.duration_s=1500.0")
    read = [(row[4], row[3]) for row in done.recorder.items if row[5:7] == ("drillState", HALTED)]
    for halted_s, vehicle, *_ in events(done, "halted"):
        assert (vehicle, halted_s + 1.0) in read


def test_charge_is_recorded_at_steps_of_a_tenth_and_at_both_ends() -> None:
    """Of 90 kJ in 1000 steps down to nothing: at the start, where it passes a tenth, and at the end."""
    drill = Store(90e3, BORING, "hole 1")
    world, sensor = Energies({(AUV.name, "corer"): drill}, bored={"hole 1": 0.0}), DRILL.make(AUV)
    told = []
    for step in range(1001):
        drill.left_j = 90e3 * (1000 - step) / 1000
        told += [
            fact[2] for one in sensor.sense(AT, world, float(step)) for fact in one.facts if fact[1] == "drillCharge"
        ]
    assert len(told) == 12  # full, ten steps, empty
    assert (told[0], told[-1]) == (1.0, 0.0)


def test_single_node_is_refused_for_missions_with_energy_transfer() -> None:
    plan = NodePlan.of(load("resupply-field"), "AUV03", 1, 100.0, 0.0)
    with pytest.raises(ConfigurationError, match="without physical transfer between vehicles") as refused:
        plan.setup()
    assert "\n" not in str(refused.value)


def ended_s(of: Run) -> float:
    """When it really ended: ``end_s`` is the whole duration where a mission is not complete."""
    return float(of.recorder.trajectories[-1][0])


@pytest.mark.slow
def test_no_helper_waits_at_a_hole_whose_vehicle_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The run ends once the others are home; a helper that does not see the loss stays there for 1000 s more."""
    done = sampled(1, lost("AUV03", 700.0))
    assert not done.completed
    assert "no vehicle left that is able to do hole 2, hole 3, hole 4" in done.reason
    monkeypatch.setattr(Bringing, "_is_awaited", lambda self, picture: True)
    assert ended_s(flown("resupply-field", lost("AUV03", 700.0))) > ended_s(done) + 500.0


def test_drill_is_helped_although_no_vehicle_assigned_its_job() -> None:
    """Each vehicle takes its jobs by itself."""
    assert sampled(1, 'strategy.name="status-broadcast"').completed


def test_run_without_communication_ends_and_names_holes_without_energy() -> None:
    """Under ``fixed-partition`` no call is received: both drills give up after ``wait_s``, and all return.

    The run ends ``meeting_deadline_s`` (900 s) after the rendezvous, since nobody works any more.
    """
    done = sampled(1, 'strategy.name="fixed-partition"', "mission.wait_s=600.0")
    assert not done.completed
    assert ended_s(done) < 3500.0
    halted = {hole for _, _, hole, _ in events(done, "halted")}
    assert len(halted) == 2
    assert "without energy: " in done.reason
    assert all(f"{hole} since" in done.reason for hole in halted)


def test_helper_waits_for_others_that_would_reduce_the_wait_more() -> None:
    """AUV01 would end 0.9 of it, AUV02 0.8: unless on its way, AUV02 sets out two frames later, half as strongly."""
    share = {"AUV01": 0.9, "AUV02": 0.8}
    work = SimpleNamespace(
        members=("AUV00", "AUV01", "AUV02"),
        group=SimpleNamespace(role=lambda role: SimpleNamespace(job="hole 1")),
        ended=lambda name, *rest: share[name],
        unfinished=(),
        held_by=lambda name: True,
    )
    picture = Picture(frame_s=10.0)
    picture.groups.works = {"Crew": work}
    for me, now_s, on, moved in (
        ("AUV01", 0.0, False, 0.9), ("AUV02", 0.0, False, 0.0), ("AUV02", 19.0, False, 0.0),
        ("AUV02", 20.0, False, 0.4), ("AUV02", 0.0, True, 0.8),
    ):  # fmt: skip
        help = Unlimited("hole 1", "Crew", ("AUV00",), me, 1, "helps", ("hole 1",))
        picture.body.now_s = 0.0
        help.is_of_use((0.0, 0.0), 50.0, picture, on)
        picture.body.now_s = now_s
        assert help.ends("AUV00", "Borer of hole 1") == moved


class Unlimited(HelpAtBerth):
    """Help of vehicles that all have energy to give."""

    def stay_away(self, work: Any, picture: Picture) -> tuple[str, ...]:
        return ()
