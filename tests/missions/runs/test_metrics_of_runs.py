"""Metrics of runs from hand-written rows, and estimates before a run."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from recorded import flown, with_energy
from small_mission import SMALL

from exchange.channel.modems import modems
from missions.files import shipped, toml_value
from missions.metric import NOT_APPLICABLE
from missions.runs.estimates import cautions
from missions.runs.fleet_metrics import (
    recovery_time_s,
)
from missions.runs.organisation_metrics import (
    malformed_s,
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
    made: Any = SimpleNamespace(recorder=recorder, scenario=SCENARIO, completed=completed, ended_s=end_s)
    return made  # type: ignore[no-any-return]


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
def test_recovery_time_ends_when_others_hold_the_work(
    faults: list[tuple[Any, ...]], roles: list[tuple[Any, ...]], completed: bool, expected: object
) -> None:
    assert recovery_time_s(finished(completed, faults=faults, roles=roles)) == expected


def test_wrong_belief_is_a_named_holder_without_the_job() -> None:
    """A and B hold jobs. A names B correctly; B names C for A's job, wrongly; C names no holder, which is not wrong."""
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


def test_the_organisation_is_malformed_while_a_role_has_too_few_or_too_many() -> None:
    """Nobody leads before 10 s and after A is lost at 60 s; B and C both dig from 30 s to 45 s."""
    recorder = Recorder()
    recorder.faults.append((60.0, "A", "lost", ""))
    for at_s, viewer, peer, role, event in (
        (0.0, "B", "A", "Head", "assigned"),  # what B believes does not make A the head
        (10.0, "A", "A", "Head", "assigned"),
        (20.0, "B", "B", "Digger", "assigned"),
        (30.0, "C", "C", "Digger", "assigned"),
        (45.0, "B", "B", "Digger", "left"),
    ):
        recorder.organisation.append((at_s, viewer, peer, "Team", role, event, "A", "assign", "", "", "success"))
    setup = SimpleNamespace(
        strategy=SimpleNamespace(declaration=SimpleNamespace(private_jobs=False)),
        agreement=SimpleNamespace(organisation=Organisation.of([TEAM]), groups=(TEAM,)),
        subjects=None,
        database=dict.fromkeys("ABC"),
    )
    run: Any = SimpleNamespace(recorder=recorder, setup=setup, ended_s=100.0, scenario=SCENARIO)
    assert malformed_s(run) == 10.0 + 15.0 + 40.0


@pytest.mark.parametrize("kind", ["sensor", "lost"])
def test_later_time_limit_changes_no_metric_of_a_run_that_ended_before(kind: str) -> None:
    """No vehicle is able to map from 300 s on, so both runs end early without success, at the same time."""
    vehicles = ("AUV00", "AUV01", "AUV02") if kind == "sensor" else SCENARIO.vehicle_names
    fault = toml_value([{"kind": kind, "vehicle": name, "at_s": 300.0} for name in vehicles])
    lossy = [("--set", "channel.per=0.6"), ("--set", f"fault={fault}")]
    limits = ("scenario.duration_s=3000", "scenario.duration_s=9000")
    limited = [run_scenario(load("mapping-rendezvous", [*lossy, ("--set", limit)])) for limit in limits]
    first, other = (summary(run) for run in limited)
    assert limited[0].ended_s == limited[1].ended_s < 1000.0
    assert (first["mission_time_s"], other["mission_time_s"]) == (3000.0, 9000.0)
    for name in ("view_divergence", "holder_conflict_fraction", "malformed_s", "idle_s"):
        assert first[name] == other[name]
    assert 0.0 < first["idle_s"] < limited[0].ended_s
    assert first["view_divergence"] > 0.0


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


def test_range_that_may_be_in_kilometres_is_warned_of() -> None:
    (found,) = warned("mapping-rendezvous", "communication.range_m=1.0")
    assert found == "communication.range_m: is 1 m, of modem nanomodem-v3 2000 m"


def test_jobs_that_take_too_long_are_warned_of_with_figures() -> None:
    """Each area of the rendezvous takes 1600 to 1800 s alone; the 13 patches together take three vehicles 2171 s."""
    alone, together = (warned(one, "scenario.duration_s=900.0") for one in ("mapping-rendezvous", "mapping-patches"))
    assert [one.split(":")[0] for one in alone] == ["job middle", "job left", "job right"]
    assert all("scenario.duration_s is 900" in one for one in alone)
    assert [one.split(" take ")[0] for one in together] == ["scenario.duration_s: is 900; all 13 jobs"]


def test_estimated_energy_is_within_a_fifth_of_the_used() -> None:
    """In an undisturbed run each vehicle with work uses its estimated energy within a fifth."""
    told = warned("mapping-rendezvous", *with_energy("mapping-rendezvous", 1.0))
    finished = flown("mapping-rendezvous", "strategy.name=fixed-partition")
    used_j: dict[str, Any] = {row[1]: row[6] for row in finished.recorder.trajectories}
    for name in ("AUV00", "AUV01", "AUV02"):
        (text,) = (one for one in told if one.startswith(f"vehicle.{name}.energy_j"))
        needed_j = float(text.split("about ")[1].split(" J")[0])
        assert used_j[name] == pytest.approx(needed_j, rel=0.2), name


# A run --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("modem", "settings", "listening_w", "head_s"),
    [
        ("s2c-18-34", [], 0.0, 0.1576),
        ("whoi-psk-1", ["communication.count_listening=true"], 2.0, 0.0),
        ("whoi-psk-1", [], 0.0, 0.0),
    ],
)
def test_modem_uses_energy_for_packet_heads_and_listening(
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


def test_rate_of_a_failed_run_is_over_its_own_duration() -> None:
    """All vehicles are lost at 316 s, so the time limit changes nothing."""
    lost = [f"{{vehicle='{name}',kind='lost',at_s=316}}" for name in ("ASV00", "AUV00", "AUV01", "AUV02")]
    settings = [("--set", f"fault=[{','.join(lost)}]")]
    run = run_scenario(load("mapping-rendezvous", settings), 1)
    n_received = sum(row[-1] == "received" for row in run.recorder.knowledge)
    assert n_received > 0
    assert summary(run)["observations_per_min"] == pytest.approx(n_received / 4 / (316 / 60), abs=1e-4)


def all_lost(name: str, *keys: str) -> Run:
    """A run that ends at 250 s, when all vehicles are lost."""
    fault = toml_value([{"kind": "lost", "vehicle": vehicle, "at_s": 250.0} for vehicle in load(name).vehicle_names])
    return run_scenario(load(name, [("--set", key) for key in (f"fault={fault}", *keys)]))


@pytest.mark.parametrize(("name", "metric"), [("recovery-field", "mean_wait_s"), ("escort-lines", "mean_escort_s")])
def test_unended_waits_last_to_the_end_of_a_failed_run(name: str, metric: str) -> None:
    assert 0.0 < summary(all_lost(name))[metric] < 250.0


def test_share_of_time_out_of_contact_is_of_the_time_of_a_failed_run() -> None:
    """Contact ends after 60 s without reception; a frame, of less than 10 s, separates last packet and end."""
    lossy = "channel={name='bernoulli',per=0.999}"
    assert 180.0 / 250.0 < summary(all_lost("arrows-archaeology", lossy))["alone_fraction"] < 190.0 / 250.0
