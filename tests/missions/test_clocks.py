"""Clocks of vehicles: readings, effect on slots, discipline of a fleet."""

import pytest

from missions.features.clocks import OwnClock, RecorderByClock
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet.fleet import Fleet
from remoras.recorder import TIME, Column, Recorder, Table


def run(*options: str, until_s: float = 400.0) -> Fleet:
    """`mapping-rendezvous` without losses, for that long."""
    settings = [("--channel", "channel.name=perfect"), *(("--set", one) for one in options)]
    fleet = assemble(resolved(load("mapping-rendezvous", settings)), seed=1)
    while fleet.now_s < until_s:
        fleet.step()
    return fleet


def heard(fleet: Fleet) -> int:
    """Packets that arrived."""
    return sum(len(row[6]) for row in fleet.recorder.packets)


def collided(fleet: Fleet) -> int:
    """Packets that were lost to others."""
    return sum(len(row[-1]) for row in fleet.recorder.packets)


def test_clock_has_offset_and_drift_and_is_never_negative() -> None:
    clock = OwnClock(-0.5, 100.0)
    assert clock.reads(0.0) == 0.0
    assert clock.reads(1000.0) == pytest.approx(1000.0 - 0.5 + 0.1)
    assert clock.true_time_s(clock.reads(1000.0)) == pytest.approx(1000.0)
    exact = OwnClock()
    assert all(exact.reads(t) == t == exact.true_time_s(t) for t in (0.1, 1 / 3, 12345.678))


def test_rows_of_a_vehicle_have_the_true_time() -> None:
    table = Table("looks", (Column("depth_m", "float", "m"), TIME))
    whole, clock = Recorder([table]), OwnClock(2.0)
    own = RecorderByClock(whole, clock)
    own.rows("looks").append((5.0, clock.reads(1 / 3)))
    own.items.append(("u", "A", clock.reads(7.0), clock.reads(7.0), "s", "a", "v", "kept", ""))
    assert whole.rows("looks") == [(5.0, 1 / 3)]
    assert whole.items == [("u", "A", 9.0, 7.0, "s", "a", "v", "kept", "")]  # what it observed, it observed at 9 s


def test_clock_offset_causes_collisions_unless_guards_allow_for_it() -> None:
    # 1 s is more than the guard of 0.67 s, so packets of AUV01 run into those of the slot before
    fleet = run("vehicle.AUV01.clock.offset_s=1.0")
    assert collided(fleet) > 0
    assert fleet.n_false_beliefs == 0
    guarded = run("vehicle.AUV01.clock.offset_s=1.0", "communication.clocks.apart_s=1.0")
    assert collided(guarded) == 0
    assert heard(guarded) == 3 * len(guarded.recorder.packets) > 0


def test_discipline_limits_the_spread_of_drifting_clocks() -> None:
    drifting = "communication.clocks.drift_ppm=2000"  # 0.8 s each in 400 s
    apart, kept = run(drifting), run(drifting, "communication.clocks.discipline=true")
    clocks = [[one for one in fleet.clocks.values() if isinstance(one, OwnClock)] for fleet in (apart, kept)]
    spread_s = [max(ahead) - min(ahead) for ahead in ([one.ahead_s(400.0) for one in of] for of in clocks)]
    assert spread_s[0] > 0.3
    # in the 7 s of a frame clocks part by 4000 ppm, 28 ms; the median looks back 5 frames and half is taken at once
    assert spread_s[1] < 0.2
    assert kept.n_false_beliefs == 0
