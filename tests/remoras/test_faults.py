"""Faults of vehicles: their random draws, their effect on a vehicle, and their rows in a run."""

import math
from dataclasses import replace
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import LEADER, WORKER, auv, database

from missions.fault import kinds
from missions.runs.assembly import assemble
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.faults import DeclaredFault, drawn, kind_named
from remoras.condition import SOUND, Condition
from remoras.database import AUVDatabase
from remoras.faults import ANY, Fault, condition_under, hears_throughout
from remoras.organisation import Organisation, RoleAssignment
from remoras.testing.sample_worlds import GROUPS

BOAT = auv("ASV03", sensors=(), playable_roles=("MissionAdministrator",))
FLEET = database(
    auv("AUV00", playable_roles=LEADER),
    auv("AUV01", playable_roles=WORKER),
    auv("AUV02", playable_roles=WORKER, sensors=()),
    BOAT,
)
AGREED = Organisation.of(GROUPS, [RoleAssignment("Operational", "Coordinator", "AUV00")])
DURATION_S = 3600.0
ABLE = {"AUV00", "AUV01", "AUV02"}
"""AUV02 has no sensor, but plays roles with a job; the boat has neither."""

KINDS = [kind for kind in kinds() if kind != "joins"]
NEEDED = {"drains": {"drain_w": 9.0}, "biased": {"attribute": "batteryFraction", "offset": 0.1}}
"""Keys that a kind cannot do without."""
TIMES = st.floats(0.0, 3000.0)


def declared(kind: str, vehicle: str, at_s: tuple[float, float] | None = None, **more: object) -> DeclaredFault:
    return kind_named(kind)(kind=kind, vehicle=vehicle, at_s=at_s, **NEEDED.get(kind, {}), **more)


def befalling(kind: str, vehicle: str, from_s: float, **more: object) -> Fault:
    """A fault of a vehicle that has the sensors of the fleet."""
    return declared(kind, vehicle, (from_s, from_s), **more).befalling(replace(auv(), name=vehicle), from_s)


declared_faults = st.builds(
    declared,
    st.sampled_from(["lost", "mute", "deaf", "slow"]),
    st.sampled_from(["AUV00", "AUV01", "head of Operational"]),
    st.tuples(TIMES, TIMES).map(lambda pair: (min(pair), max(pair))),
)


def draw(
    *faults: DeclaredFault, seed: int = 1, fleet: AUVDatabase = FLEET, agreed: Organisation = AGREED
) -> tuple[Fault, ...]:
    return drawn(faults, seed, fleet, agreed, DURATION_S)


def at(kind: str, vehicle: str, earliest_s: float, latest_s: float | None = None) -> DeclaredFault:
    return declared(kind, vehicle, (earliest_s, earliest_s if latest_s is None else latest_s))


def at_rate(rate_per_h: float, until_s: float = math.inf) -> DeclaredFault:
    return declared("lost", "AUV01", rate_per_h=rate_per_h, until_s=None if math.isinf(until_s) else until_s)


# What is drawn ------------------------------------------------------------------------------------


def test_a_fault_of_any_vehicle_strikes_operational_ones_evenly() -> None:
    """Of 600 draws each of three is expected 200 times; 5 standard deviations are 5 sqrt(600 * 2/9) = 58."""
    whom = [draw(at("lost", ANY, 900.0), seed=seed)[0].vehicle for seed in range(600)]
    assert set(whom) == ABLE
    assert all(abs(whom.count(name) - 200) <= 58 for name in ABLE)


@given(st.integers(0, 1000), st.sampled_from(KINDS[:4]))
def test_several_faults_of_any_vehicle_strike_different_vehicles(seed: int, kind: str) -> None:
    found = draw(*[at(kind, ANY, 100.0 * n) for n in range(3)], seed=seed)
    assert {fault.vehicle for fault in found} == ABLE


def test_a_fault_time_is_uniform_between_its_bounds() -> None:
    """Mean of 2000 draws from [300, 900]: 600 with a standard error of 600 / sqrt(12 * 2000) = 3.9 s; 5 of them."""
    times_s = [draw(at("mute", "AUV01", 300.0, 900.0), seed=seed)[0].from_s for seed in range(2000)]
    assert all(300.0 <= time_s <= 900.0 for time_s in times_s)
    assert abs(sum(times_s) / len(times_s) - 600.0) < 20.0


def test_a_fault_rate_gives_exponential_times_within_the_mission() -> None:
    """One fault per hour in a mission of an hour: 1 - 1/e = 63.2 % of runs have it; 5 standard errors are 5.4 %."""
    happened = sum(len(draw(at_rate(1.0), seed=seed)) for seed in range(2000))
    assert abs(happened / 2000 - (1.0 - 1.0 / math.e)) < 0.054


@given(st.lists(declared_faults, max_size=4), declared_faults, st.integers(0, 100))
def test_an_added_fault_shifts_no_draw_of_another(faults, added, seed) -> None:
    assert set(draw(*faults, seed=seed)) <= set(draw(*faults, added, seed=seed))


# What is left of a vehicle ------------------------------------------------------------------------


def test_faults_of_one_vehicle_add_up() -> None:
    faults = [
        befalling("mute", "A", 0.0),
        befalling("slow", "A", 0.0, factor=0.5),
        befalling("slow", "A", 0.0, factor=0.4),
        Fault("sensor", "A", 0.0, leaves=Condition(dead_sensors=frozenset({"swath"}))),
        Fault("sensor", "A", 0.0, leaves=Condition(dead_sensors=frozenset({"sonar"}))),
    ]
    found = condition_under(faults)
    assert (found.is_alive, found.is_mute, found.hears, found.is_in_contact) == (True, True, True, False)
    assert found.speed_factor == pytest.approx(0.2)
    assert found.dead_sensors == {"swath", "sonar"}
    assert condition_under([]) == SOUND


@pytest.mark.parametrize(
    ("from_s", "until_s", "hears"),
    [(90.0, 99.0, True), (90.0, 100.0, False), (150.0, 151.0, False), (199.0, 201.0, False), (200.0, 201.0, True)],
)
def test_a_packet_needs_a_working_receiver_from_start_to_end(from_s: float, until_s: float, hears: bool) -> None:
    """Deaf from 100 s on and until before 200 s; a mute vehicle hears."""
    faults = [befalling("deaf", "A", 100.0, until_s=200.0), befalling("mute", "A", 0.0), befalling("lost", "B", 0.0)]
    assert hears_throughout(faults, "A", from_s, until_s) is hears


# In a run -----------------------------------------------------------------------------------------

FROM_S, UNTIL_S, END_S = 300.0, 500.0, 700.0
"""AUV01 surveys from about 100 s on, well beyond 700 s."""


@cache
def run_with(*tables: str, seed: int = 1, settings: tuple[str, ...] = ()) -> Run:
    said = (f"fault=[{','.join('{' + table + '}' for table in tables)}]", f"scenario.duration_s={END_S}", *settings)
    last = {one.partition("=")[0]: one for one in said}
    return run(load("mapping-rendezvous", [("--set", one) for one in last.values()]), seed)


def during(kind: str, more: str = "") -> Run:
    return run_with(f'kind="{kind}",vehicle="AUV01",at_s={FROM_S},until_s={UNTIL_S}{more}')


def track(finished: Run, from_s: float, until_s: float, vehicle: str = "AUV01") -> list[tuple[float, ...]]:
    """x, y, heading, speed and energy in [from_s, until_s]."""
    rows = finished.recorder.trajectories
    return [row[2:7] for row in rows if row[1] == vehicle and from_s <= row[0] <= until_s]


def packets(finished: Run, from_s: float, until_s: float) -> list[tuple[str, list[str], list[str]]]:
    """(sender, receivers, lost by) of the packets that start in [from_s, until_s)."""
    return [(row[2], row[6], row[7]) for row in finished.recorder.packets if from_s <= row[1] < until_s]


def mapped(finished: Run, from_s: float, until_s: float) -> int:
    rows = finished.recorder.rows("coverage")
    return sum(row[1] == "AUV01" and from_s <= row[0] < until_s for row in rows)


def test_a_lost_vehicle_does_nothing_until_it_is_back() -> None:
    finished = during("lost")
    assert len(set(track(finished, FROM_S, UNTIL_S - 1.0))) == 1  # neither moves nor uses energy
    assert track(finished, FROM_S, FROM_S)[0][3] == 0.0
    assert len({row[:2] for row in track(finished, UNTIL_S, END_S)}) > 100
    meanwhile, after = packets(finished, FROM_S, UNTIL_S), packets(finished, UNTIL_S, END_S)
    assert all("AUV01" not in (sender, *receivers, *lost_by) for sender, receivers, lost_by in meanwhile[1:])
    assert any(sender == "AUV01" for sender, _, _ in after)
    assert any("AUV01" in receivers for _, receivers, _ in after)
    assert mapped(finished, FROM_S, UNTIL_S) == 0
    assert mapped(finished, UNTIL_S, END_S) > 0
    known = [row for row in finished.recorder.knowledge if row[1] == "AUV01" and row[4] != "acknowledged"]
    assert [row for row in known if FROM_S < row[0] < UNTIL_S] == []


def test_a_slowed_vehicle_computes_its_reserve_at_the_reduced_speed() -> None:
    """(40 + 15 v^3) / v J/m: 61.6 at 1.54 m/s, 105.9 at a quarter of it."""
    fleet = assemble(resolved(load("mapping-rendezvous")), seed=1)
    functional = fleet.vehicles[2].functional
    functional.motion.x_m = functional.data.start_m[0] + 400.0
    reserves = []
    for factor in (1.0, 0.25):
        functional.impair(Condition(speed_factor=factor))
        functional.perceive(())
        reserves.append(functional.picture.body.reserve)
    fleet.close()
    per_m = [(40.0 + 15.0 * speed**3) / speed for speed in (1.54, 0.385)]
    assert reserves == pytest.approx([1.25 * 400.0 * one / 5.0e6 for one in per_m])


def test_battery_drain_adds_to_the_power_of_the_vehicle() -> None:
    drained, usual = during("drains", ",drain_w=30.0"), run_with()
    used_j = [track(one, UNTIL_S + 100.0, UNTIL_S + 100.0)[0][4] for one in (drained, usual)]
    assert used_j[0] - used_j[1] == pytest.approx(30.0 * (UNTIL_S - FROM_S), abs=31.0)


def test_a_dead_sensor_yields_nothing_and_the_vehicle_does_not_notice() -> None:
    finished, usual = during("sensor"), run_with()
    assert mapped(finished, FROM_S, UNTIL_S) == 0
    assert mapped(finished, UNTIL_S, END_S) > 0
    assert mapped(finished, 0.0, FROM_S) == mapped(usual, 0.0, FROM_S) > 0
    assert len({row[:2] for row in track(finished, FROM_S, UNTIL_S)}) > 100


@pytest.mark.parametrize(("kind", "evades"), [("slow", True), ("lost", False), ("joins", False)])
def test_a_lost_vehicle_floats_up_and_one_that_has_not_joined_is_no_obstacle(kind: str, evades: bool) -> None:
    """AUV01 is on the way of AUV00, at its depth; AUV02 and the surface vehicle are elsewhere.

    If a lost vehicle stayed where it was, one that is to survey this place would keep clear of it for ever.
    """
    at_s = 89.0 if kind == "joins" else 0.0
    finished = run_with(
        f'kind="{kind}",vehicle="AUV01",at_s={at_s}' + (",factor=0.01" if kind == "slow" else ""),
        settings=("vehicle.AUV01.start_m=[60.0,60.0]", "vehicle.AUV02.start_m=[700.0,-50.0]", "scenario.duration_s=90"),
    )
    nearest_m = min(math.dist(row[2:4], (60.0, 60.0)) for row in finished.recorder.trajectories if row[1] == "AUV00")
    assert nearest_m >= 5.0 if evades else nearest_m < 2.0  # its way is across the very place, 2.57 m a tick


def test_a_run_lasts_while_a_lost_vehicle_may_return() -> None:
    names = ("ASV00", "AUV00", "AUV01", "AUV02")
    away = [f'kind="lost",vehicle="{name}",at_s=10,until_s=20' for name in names]
    assert run_with(*away).recorder.trajectories[-1][0] == END_S
    lost = [f'kind="lost",vehicle="{name}",at_s=10' for name in names]
    assert run_with(*lost).recorder.trajectories[-1][0] == 10.0
