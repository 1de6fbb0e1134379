"""Metrics of runs from rows written by hand, and estimates before a run."""

from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recorded import flown, with_energy
from small_mission import SMALL

from exchange.channel.modems import modems
from missions.files import shipped
from missions.metric import NOT_APPLICABLE
from missions.runs import metrics
from missions.runs.estimates import cautions
from missions.runs.fleet_metrics import (
    closest_approach_m,
    conflicts,
    idle_s,
    recovery_time_s,
)
from missions.runs.metrics import consistency
from missions.runs.organisation_metrics import (
    holder_conflict_fraction,
    malformed_s,
    missed,
    n_refused_acts,
    view_divergence,
)
from missions.runs.results import summary
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.recorder import Recorder
from remoras.truth import HolderCount

SCENARIO = load("mapping-rendezvous")
G = "Operational"


def finished(completed: bool = True, end_s: float = 1000.0, **rows: list[tuple[Any, ...]]) -> Run:
    """A run of the shipped scenario with these rows."""
    recorder = Recorder()
    for name, own in rows.items():
        recorder.rows(name).extend(own)
    made: Any = SimpleNamespace(recorder=recorder, scenario=SCENARIO, completed=completed, end_s=end_s)
    return made  # type: ignore[no-any-return]


def test_idle_is_the_time_in_which_no_role_with_a_job_is_served() -> None:
    """AUV00 works 100..400 and 600..end: idle 300 s. AUV01 has two roles, 0..500: 500 s. AUV02 never: 1000 s."""
    roles = [
        (0.0, "AUV01", G, "LeftWinger", "active"), (50.0, "AUV01", G, "Midfield", "active"),
        (90.0, "AUV00", G, "Coordinator", "active"), (100.0, "AUV00", G, "Midfield", "active"),
        (300.0, "AUV01", G, "LeftWinger", "inactive"), (400.0, "AUV00", G, "Midfield", "inactive"),
        (500.0, "AUV01", G, "Midfield", "inactive"), (600.0, "AUV00", G, "Midfield", "active"),
    ]  # fmt: skip
    assert idle_s(finished(roles=roles)) == pytest.approx((300 + 500 + 1000) / 3)
    lost = [(200.0, "AUV02", "lost", ""), (700.0, "AUV01", "mute", "")]
    assert idle_s(finished(roles=roles, faults=lost)) == pytest.approx((300 + 500 + 200) / 3, abs=1e-4)


DEPTH_M = {vehicle.name: vehicle.depth_m for vehicle in SCENARIO.vehicle}
APART_M = {"AUV00": (900.0, 0.0), "AUV01": (0.0, 0.0), "AUV02": (0.0, 0.0), "ASV00": (0.0, 0.0)}
"""AUV02 stands on AUV01; ASV00 is at the surface."""


def places(time_s: float, at_m: dict[str, tuple[float, float]]) -> list[tuple[Any, ...]]:
    """Rows of the trajectories at a time."""
    return [(time_s, name, *at_m[name], 0.0, 0.0, 0.0, depth_m) for name, depth_m in DEPTH_M.items()]


def test_who_joins_late_is_neither_idle_nor_close_before() -> None:
    """AUV02 joins at 400 s, so of 1000 s it is idle for 600 s; it stands on AUV01 until then and 50 m off after."""
    joins = [(0.0, "AUV02", "joins", "away until 400 s"), (400.0, "AUV02", "joins", "over")]
    assert idle_s(finished(faults=joins)) == pytest.approx((1000 + 1000 + 600) / 3, abs=1e-4)
    rows = [*places(60.0, APART_M), *places(400.0, APART_M | {"AUV02": (50.0, 0.0)})]
    assert closest_approach_m(finished(faults=joins, trajectories=rows)) == 50.0
    assert closest_approach_m(finished(trajectories=rows)) == 0.0


@pytest.mark.parametrize("over_s", [60.0, 400.0])
def test_who_is_lost_stays_away_when_another_fault_ends(over_s: float) -> None:
    """AUV02 is lost for good during a restart that ends at 60 s: it stands on AUV01, but is not there any more."""
    faults = [
        (0.0, "AUV02", "restarts", "until 60 s"), (30.0, "AUV02", "lost", "for good"),
        (over_s, "AUV02", "restarts", "over"),
    ]  # fmt: skip
    run = finished(faults=faults, trajectories=places(60.0, APART_M))
    assert (closest_approach_m(run), conflicts(run)) == (900.0, 0)


def test_only_vehicles_in_one_layer_come_close() -> None:
    """AUV00 and AUV01 are 2.5 m apart (1.5, 2) at 60 s, ASV00 nearer, but at the surface; at first all are far off."""
    first = places(0.0, {name: (40.0 * number, 0.0) for number, name in enumerate(DEPTH_M)})
    near = places(60.0, {"AUV00": (0.0, 0.0), "AUV01": (1.5, 2.0), "AUV02": (900.0, 0.0), "ASV00": (0.0, 1.0)})
    assert abs(DEPTH_M["AUV00"] - DEPTH_M["AUV01"]) <= 3.0 < abs(DEPTH_M["AUV00"] - DEPTH_M["ASV00"])
    for rows, expected in (([*first, *near], (2.5, 1)), (first, (40.0, 0)), ([], (None, 0))):
        run = finished(trajectories=rows)
        assert (closest_approach_m(run), conflicts(run)) == expected


HELD = [(0.0, "AUV01", G, "LeftWinger", "assigned"), (0.0, "AUV02", G, "RightWinger", "assigned")]
LOST = [(300.0, "AUV01", "lost", "")]


@pytest.mark.parametrize(
    ("faults", "roles", "completed", "expected"),
    [
        ([], HELD, True, NOT_APPLICABLE),
        ([(300.0, "AUV01", "slow", "")], HELD, True, NOT_APPLICABLE),
        (LOST, [*HELD, (340.0, "AUV02", G, "LeftWinger", "assigned")], True, 40.0),
        (LOST, [*HELD, (340.0, "AUV01", G, "LeftWinger", "assigned")], False, None),  # by itself: nobody took over
        (LOST, HELD, False, None),
        (LOST, HELD, True, NOT_APPLICABLE),  # it had done its work
        (LOST, [*HELD, (200.0, "AUV01", G, "LeftWinger", "left")], False, NOT_APPLICABLE),
        ([(9.0, "AUV02", "refused assignment", ""), *LOST], [*HELD, (340.0, "AUV00", G, "LeftWinger", "assigned")],
         True, 40.0),
    ],
)  # fmt: skip
def test_recovery_lasts_until_others_hold_the_work(
    faults: list[tuple[Any, ...]], roles: list[tuple[Any, ...]], completed: bool, expected: object
) -> None:
    assert recovery_time_s(finished(completed, faults=faults, roles=roles)) == expected


def test_a_wrong_belief_names_somebody_who_does_not_hold_the_job() -> None:
    """A and B hold jobs. A names B rightly; B names C for A's job, wrongly; C names nobody, which is not wrong."""
    group = Group(
        "g", (RoleSpecification("one", job="j1"), RoleSpecification("two", job="j2"), RoleSpecification("no"))
    )

    def sees(*held: tuple[str, str]) -> Organisation:
        return Organisation.of([group], [RoleAssignment("g", role, vehicle) for vehicle, role in held])

    count = HolderCount()
    assert count.wrong_fraction is None
    a = sees(("A", "one"), ("B", "two"), ("C", "no"))
    count.compare([("A", a), ("B", sees(("C", "one"), ("B", "two"))), ("C", sees(("A", "no")))])
    assert (count.n_believed, count.n_wrong) == (2, 1)  # own jobs and roles without a job are not asked about
    assert count.wrong_fraction == 0.5


TEAM = Group(
    "Team", (RoleSpecification("Head", 1, 1, head=True, founding=True), RoleSpecification("Digger", 0, 1, job="pit"))
)
NAMES = ("A", "B", "C")
Change = tuple[float, str, str, str, str]
"""Time, viewer, peer, role and event."""


def of_views(*changes: Change, faults: list[tuple[Any, ...]] | None = None, private_jobs: bool = False) -> Run:
    """A run of 100 s in which views changed so."""
    recorder = Recorder()
    for at_s, viewer, peer, role, event in changes:
        recorder.organisation.append((at_s, viewer, peer, "Team", role, event, "A", "assign", "", "", "success"))
    recorder.faults.extend(faults or [])
    setup = SimpleNamespace(
        strategy=SimpleNamespace(declaration=SimpleNamespace(private_jobs=private_jobs)),
        agreement=SimpleNamespace(organisation=Organisation.of([TEAM]), groups=(TEAM,)),
        subjects=None,
        database=dict.fromkeys(NAMES),
    )
    made: Any = SimpleNamespace(recorder=recorder, setup=setup, end_s=100.0, scenario=load("mapping-rendezvous"))
    return made  # type: ignore[no-any-return]


AGREED = [(0.0, viewer, "A", "Head", "assigned") for viewer in NAMES]
DIGS: Change = (20.0, "B", "B", "Digger", "assigned")


def test_views_that_agree_do_not_diverge() -> None:
    assert view_divergence(of_views()) == view_divergence(of_views(*AGREED)) == 0.0


def test_a_view_is_wrong_until_it_is_as_the_peer_sees_itself() -> None:
    """B digs from 20 s; C hears of it at 50 s, A never: of 6 pairs two err for 30 s, one for 50 s."""
    heard: Change = (50.0, "C", "B", "Digger", "assigned")
    expected = (2 / 6 * 30.0 + 1 / 6 * 50.0) / 100.0
    assert view_divergence(of_views(*AGREED, DIGS, heard)) == pytest.approx(expected, abs=1e-6)
    # who believes in a job that another never heard of errs too, until the end
    believed = (60.0, "A", "C", "Digger", "assigned")
    assert view_divergence(of_views(*AGREED, believed)) == pytest.approx(1 / 6 * 0.4, abs=1e-6)


def test_jobs_that_everybody_notes_for_itself_are_nobodys_error() -> None:
    """Roles without a job are compared all the same."""
    assert view_divergence(of_views(*AGREED, DIGS, private_jobs=True)) == 0.0
    leads: Change = (50.0, "B", "B", "Head", "assigned")
    assert view_divergence(of_views(*AGREED, DIGS, leads, private_jobs=True)) == pytest.approx(2 / 6 * 0.5, abs=1e-6)


def test_who_is_out_of_the_mission_does_not_count() -> None:
    """A is away from 40 s to 70 s: then C alone errs, in one of 2 pairs. C is lost for good at 90 s: A errs, of 2."""
    faults = [(40.0, "A", "lost", ""), (70.0, "A", "lost", "over"), (90.0, "C", "energy", "battery exhausted")]
    expected = (2 / 6 * 20.0 + 1 / 2 * 30.0 + 2 / 6 * 20.0 + 1 / 2 * 10.0) / 100.0
    assert view_divergence(of_views(DIGS, faults=faults)) == pytest.approx(expected, abs=1e-6)
    alone = [(0.0, name, "lost", "") for name in ("A", "C")]
    assert view_divergence(of_views(DIGS, faults=alone)) is None


def test_holders_are_in_conflict_while_a_role_has_more_of_them_than_room() -> None:
    """B and C both dig from 30 s to 45 s, each by its own view; what A believes of them is no conflict."""
    both: list[Change] = [DIGS, (30.0, "C", "C", "Digger", "assigned"), (45.0, "B", "B", "Digger", "left")]
    believed = [(0.0, "A", name, "Digger", "assigned") for name in NAMES]
    assert holder_conflict_fraction(of_views(*both)) == 0.15
    assert holder_conflict_fraction(of_views(*believed)) == 0.0
    assert holder_conflict_fraction(of_views(*both, faults=[(40.0, "B", "lost", "")])) == 0.1
    assert holder_conflict_fraction(of_views(*both, private_jobs=True)) == 0.15  # who keeps it private does it too


def test_refusals_are_counted_at_every_vehicle() -> None:
    run = of_views(*AGREED)
    assert n_refused_acts(run) == 0
    refused = ("A", "Team", "Head", "refused", "B", "release", "", "", "issuer without authority")
    run.recorder.organisation.extend([(5.0, "A", *refused), (6.0, "C", *refused)])
    assert n_refused_acts(run) == 2


def test_the_organisation_is_malformed_while_a_role_has_too_few_or_too_many() -> None:
    """Nobody leads before 10 s and after A is lost at 60 s; B and C both dig from 30 s to 45 s."""
    led: Change = (10.0, "A", "A", "Head", "assigned")
    both: list[Change] = [DIGS, (30.0, "C", "C", "Digger", "assigned"), (45.0, "B", "B", "Digger", "left")]
    believed: Change = (0.0, "B", "A", "Head", "assigned")  # it does not make A the head
    run = of_views(believed, led, *both, faults=[(60.0, "A", "lost", "")])
    assert malformed_s(run) == 10.0 + 15.0 + 40.0
    assert missed(run) == {"group.Team.role.Head.minimum": 50.0, "group.Team.role.Digger.maximum": 15.0}


def run_of(end_s: float, n_vehicles: int, rows: list[tuple[float, str, str, str, str]]) -> Any:
    """A run as far as these figures look at it; rows are of the table ``knowledge``."""
    known = load("mapping-rendezvous")
    scenario = known.model_copy(update={"vehicle": known.vehicle[:1] * n_vehicles})
    return SimpleNamespace(
        end_s=end_s, scenario=scenario, recorder=SimpleNamespace(rows={"knowledge": rows}.__getitem__)
    )


def heard(latency_s: float, item: str) -> list[tuple[float, str, str, str, str]]:
    return [(5.0, "A", item, "A", "observed"), (5.0 + latency_s, "B", item, "A", "received")]


@pytest.mark.parametrize(("end_s", "n_vehicles", "expected"), [(120.0, 3, 1.0), (60.0, 2, 3.0), (90.0, 4, 1.0)])
def test_observations_per_minute(end_s: float, n_vehicles: int, expected: float) -> None:
    """6 receptions: by 3 vehicles in 2 minutes, 1 each a minute; by 2 in 1, 3; by 4 in 1.5, 1. Others do not count."""
    rows = [row for number in range(6) for row in heard(1.0, str(number))]
    rows += [(9.0, "A", "0", "A", "acknowledged")]
    assert metrics.observations_per_min(run_of(end_s, n_vehicles, rows)) == pytest.approx(expected)


def test_latencies_of_1_to_101_seconds() -> None:
    """Their mean is 51 s. Between 101 values there are 100 steps, so 95 of 100 lead to 96 s; 90 would lead to 91 s."""
    rows = [row for number in range(1, 102) for row in heard(float(number), str(number))]
    run = run_of(200.0, 2, rows)
    assert metrics.mean_latency_s(run) == pytest.approx(51.0)
    assert metrics.p95_latency_s(run) == pytest.approx(96.0)
    assert metrics.p95_latency_s(run_of(200.0, 2, [])) is None


def warned(scenario: str, *settings: str) -> list[str]:
    return [str(one) for one in cautions(resolved(load(scenario, [("--set", one) for one in settings])))]


@pytest.mark.parametrize("scenario", shipped())
def test_shipped_scenarios_give_no_warning(scenario: str) -> None:
    assert warned(scenario) == []


@pytest.mark.parametrize("scenario", ["mapping-rendezvous", "mapping-patches", "pandora-inspection"])
@pytest.mark.parametrize("energy_j", [1.0, 30e3])
def test_every_vehicle_with_too_little_energy_is_named_with_figures(scenario: str, energy_j: float) -> None:
    found = warned(scenario, *with_energy(scenario, energy_j))
    assert [one.split(":")[0] for one in found] == [f"vehicle.{v.name}.energy_j" for v in load(scenario).vehicle]
    assert all(f"is {energy_j:g}, for " in one and " J: " in one for one in found)


def test_a_job_or_all_jobs_that_take_too_long_are_named_with_figures() -> None:
    """Each area of the rendezvous takes 1600 to 1800 s alone; the 13 patches together take three vehicles 2171 s."""
    alone, together = (warned(one, "scenario.duration_s=900.0") for one in ("mapping-rendezvous", "mapping-patches"))
    assert [one.split(":")[0] for one in alone] == ["job middle", "job left", "job right"]
    assert all("scenario.duration_s is 900" in one for one in alone)
    assert [one.split(" take ")[0] for one in together] == ["scenario.duration_s: is 900; all 13 jobs"]


def test_what_is_estimated_is_near_to_what_is_used() -> None:
    """Where all goes as planned, who has a part of the work uses what it is said to need, within a fifth."""
    told = warned("mapping-rendezvous", *with_energy("mapping-rendezvous", 1.0))
    finished = flown("mapping-rendezvous", "strategy.name=fixed-partition")
    used_j: dict[str, Any] = {row[1]: row[6] for row in finished.recorder.trajectories}
    for name in ("AUV00", "AUV01", "AUV02"):
        (text,) = (one for one in told if one.startswith(f"vehicle.{name}.energy_j"))
        needed_j = float(text.split("about ")[1].split(" J")[0])
        assert used_j[name] == pytest.approx(needed_j, rel=0.2), name


def knowledge(*rows: tuple[float, str, str, str]) -> Recorder:
    """Rows of (time, vehicle, item, event); the origin of item "A:0" is A."""
    own = [(time_s, vehicle, item, item[0], event) for time_s, vehicle, item, event in rows]
    return finished(knowledge=own).recorder


# Consistency --------------------------------------------------------------------------------------


def test_what_a_vehicle_receives_again_counts_once() -> None:
    """B begins anew, A gives a block of its own up: C is still to hear it, at 9 s."""
    again = knowledge(
        (1.0, "A", "A:0", "observed"), (2.0, "B", "A:0", "received"), (4.0, "B", "A:0", "received"),
        (5.0, "A", "A:0", "received"), (9.0, "C", "A:0", "received"),
    )  # fmt: skip
    assert consistency(again, 3) == (8.0, 1.0)


@given(
    st.integers(2, 5).flatmap(
        lambda n: st.tuples(
            st.just(n),
            st.lists(
                st.tuples(
                    st.integers(0, n - 1), st.integers(0, 50), st.lists(st.none() | st.integers(0, 50), min_size=n)
                ),
                max_size=6,
            ),
        )
    )
)
def test_consistency_is_the_mean_of_the_last_receptions(
    case: tuple[int, list[tuple[int, int, list[int | None]]]],
) -> None:
    """By its definition: every item on its own, in exact arithmetic."""
    n, items = case
    rows: list[tuple[float, str, str, str]] = []
    waits: list[int] = []
    for number, (origin, observed_s, delays) in enumerate(items):
        item = f"{origin}:{number}"
        others = {v: delays[v] for v in range(n) if v != origin}
        rows.append((observed_s, str(origin), item, "observed"))
        rows += [(observed_s + d, str(v), item, "received") for v, d in others.items() if d is not None]
        if all(delay is not None for delay in others.values()):
            waits.append(max(delay for delay in others.values() if delay is not None))
    rows.sort(key=lambda row: (row[0], row[3]))  # in time order, an observation before its reception
    time_s, fraction = consistency(knowledge(*rows), n)
    assert fraction == (len(waits) / len(items) if items else None)
    assert time_s == (float(Fraction(sum(waits), len(waits))) if waits else None)


# A run --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("modem", "settings", "listening_w", "head_s"),
    [
        ("s2c-18-34", ["communication.receive_power_w=3"], 3.0, 0.1576),
        ("whoi-psk-1", ["communication.count_listening=true"], 2.0, 0.0),
        ("whoi-psk-1", ["communication.count_listening=true", "communication.receive_power_w=0.5"], 0.5, 0.0),
        ("whoi-psk-1", [], 0.0, 0.0),
    ],
)
def test_a_modem_takes_energy_before_its_bits_and_while_it_listens(
    tmp_path: Path, modem: str, settings: list[str], listening_w: float, head_s: float
) -> None:
    """Heads and receive powers are those of ``modems.toml``; 2 vehicles listen for 60 s."""
    file = tmp_path / "pond.toml"
    file.write_text(SMALL.replace("s2c-18-34", modem), encoding="utf-8")
    deaf = ["scenario.duration_s=60", "communication.transmit_power_w=7"]
    runs = [run_scenario(load(str(file), [("--set", one) for one in [*deaf, *more]]), 1) for more in (settings, [])]
    found, without = map(summary, runs)
    n_vehicles, rate_bps = len(runs[0].scenario.vehicle), modems()[modem].rate_bps
    bits = sum(row[3] for row in runs[0].recorder.packets)
    sent_j = 7.0 * (bits / rate_bps + found["n_packets"] * head_s)
    assert found["modem_energy_j"] == pytest.approx(sent_j + n_vehicles * 60.0 * listening_w, abs=0.02)
    assert found["energy_j"] - without["energy_j"] == pytest.approx(n_vehicles * 60.0 * listening_w, abs=0.02)
