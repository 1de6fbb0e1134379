"""Measures of a run's tables: consistency of what the fleet knows, the energy of the modems."""

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_mission import SMALL

from exchange.acoustics.modems import modems
from missions.errors import ConfigurationError
from missions.mapping.mission import MappingMission
from missions.runs.metrics import consistency, metrics_of
from missions.runs.run import run as run_scenario
from missions.runs.summary import summary
from missions.scenarios import load
from missions.scenarios.abilities import endurance_s
from missions.scenarios.equipment import gear_of
from remoras.recorder import Recorder


def recorded(**tables: list[tuple[object, ...]]) -> Recorder:
    recorder = Recorder()
    for name, rows in tables.items():
        recorder.rows(name).extend(rows)
    return recorder


def knowledge(*rows: tuple[float, str, str, str]) -> Recorder:
    """Rows of (time, vehicle, item, event); the origin of item "A:0" is A."""
    return recorded(knowledge=[(time_s, vehicle, item, item[0], event) for time_s, vehicle, item, event in rows])


# Consistency --------------------------------------------------------------------------------------


def test_an_item_is_consistent_when_its_last_vehicle_holds_it() -> None:
    recorder = knowledge(
        (1.0, "A", "A:0", "observed"),
        (2.0, "B", "A:0", "received"),
        (3.0, "B", "B:0", "observed"),
        (4.0, "A", "A:0", "acknowledged"),  # a belief of the sender changes nothing
        (6.0, "C", "A:0", "received"),  # 5 s after its observation
        (7.0, "C", "B:0", "received"),  # A never gets it
        (8.0, "C", "C:0", "observed"),
        (9.0, "A", "C:0", "received"),
        (9.0, "B", "C:0", "received"),  # 1 s
        (10.0, "A", "A:1", "observed"),
    )
    assert consistency(recorder, 3) == ((5.0 + 1.0) / 2, 2 / 4)


def test_what_a_vehicle_receives_again_counts_once() -> None:
    """B begins anew, A gives a block of its own up: C is still to hear it, at 9 s."""
    again = knowledge(
        (1.0, "A", "A:0", "observed"), (2.0, "B", "A:0", "received"), (4.0, "B", "A:0", "received"),
        (5.0, "A", "A:0", "received"), (9.0, "C", "A:0", "received"),
    )  # fmt: skip
    assert consistency(again, 3) == (8.0, 1.0)


def test_without_items_and_without_consistent_items_there_is_no_time() -> None:
    assert consistency(knowledge(), 2) == (None, None)
    assert consistency(knowledge((1.0, "A", "A:0", "observed")), 2) == (None, 0.0)


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


@pytest.mark.parametrize("power_w", [0.0, 10.0, 20.0])
def test_modem_energy_is_what_the_vehicles_account_for(tmp_path: Path, power_w: float) -> None:
    """The s2c-18-34 sends 749 bit/s (its profile says so), at the given power."""
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    settings = ("scenario.duration_s=60", f"communication.transmit_power_w={power_w}")
    run = run_scenario(load(str(file), [("--set", setting) for setting in settings]), 1)
    silent = run_scenario(load(str(file), [("--set", "scenario.duration_s=60"), ("--set", SILENT)]), 1)
    found = summary(run)
    assert found["modem_energy_j"] == pytest.approx(found["energy_j"] - summary(silent)["energy_j"], abs=0.02)
    assert (found["modem_energy_j"] > 0.0) == (power_w > 0.0)


SILENT = "communication.transmit_power_w=0"


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


def test_a_profile_without_receive_power_cannot_be_counted() -> None:
    with pytest.raises(ConfigurationError, match=r"profile atm-900 has no receive_w; set communication"):
        load("mapping-rendezvous", [("", "communication.count_listening=true"), ("", "communication.modem=atm-900")])


def test_listening_shortens_what_a_battery_lasts() -> None:
    """1 MJ at 40 W last 25,000 s, at 50 W 20,000 s."""
    vehicle = {"energy_j": 1e6, "hotel_w": 40.0, "drag_w_per_mps3": 0.0, "survey_speed_mps": 1.0}
    assert (endurance_s(vehicle), endurance_s(vehicle, listening_w=10.0)) == (25_000.0, 20_000.0)
    gear = {one: gear_of({"communication": one_of}, MappingMission).listening_w for one, one_of in COUNTED.items()}
    assert gear == {"given": 3.0, "of the profile": 2.0, "not counted": 0.0}


COUNTED = {
    "given": {"modem": "whoi-psk-1", "receive_power_w": 3},
    "of the profile": {"modem": "whoi-psk-1", "count_listening": True},
    "not counted": {"modem": "whoi-psk-1"},
}


def test_observations_per_minute_are_those_received(tmp_path: Path) -> None:
    run = run_scenario(load("mapping-rendezvous", [("--set", "scenario.duration_s=120")]), 1)
    n_received = sum(row[4] == "received" for row in run.recorder.knowledge)
    assert n_received > 0
    assert summary(run)["observations_per_min"] == pytest.approx(n_received / 4 / 2.0, abs=1e-4)


def test_every_measure_can_be_compared() -> None:
    """In the first minute nothing is lost or given up; nobody has finds or drift: these say nothing."""
    measures = {"consistency_time_s", "consistent_fraction", "least_mapped_fraction", "modem_energy_j"}
    scenario = load("mapping-rendezvous", [("--set", "scenario.duration_s=60")])
    silent = {"recovery_time_s", "finds_inspected_fraction", "given_up_s", "left_when_given_up"}
    silent |= {"n_expired", "settling_s", "settled"}
    silent |= {"n_fixes", "fixing_s", "believed_fraction", "n_silenced"}
    declared = set(metrics_of(scenario))
    assert measures | silent <= declared
    assert declared - silent == declared & set(summary(run_scenario(scenario, 1)))
