"""Measures of a run's tables: consistency of what the fleet knows, the energy of the modems."""

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_mission import SMALL

from missions.runs.metrics import consistency, metrics_of
from missions.runs.run import run as run_scenario
from missions.runs.summary import summary
from missions.scenarios import load
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
    """The s2c-18-34 sends 976 bit/s (its profile says so), at the given power."""
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    settings = ("scenario.duration_s=60", f"communication.transmit_power_w={power_w}")
    run = run_scenario(load(str(file), [("--set", setting) for setting in settings]), 1)
    silent = run_scenario(load(str(file), [("--set", "scenario.duration_s=60"), ("--set", SILENT)]), 1)
    found = summary(run)
    assert found["modem_energy_j"] == pytest.approx(found["energy_j"] - summary(silent)["energy_j"], abs=0.02)
    assert (found["modem_energy_j"] > 0.0) == (power_w > 0.0)


SILENT = "communication.transmit_power_w=0"


def test_every_measure_can_be_compared() -> None:
    """In the first minute nothing is lost or given up, and nobody has finds or obligations: those say nothing."""
    measures = {"consistency_time_s", "consistent_fraction", "least_mapped_fraction", "modem_energy_j"}
    scenario = load("mapping-rendezvous", [("--set", "scenario.duration_s=60")])
    silent = {"recovery_time_s", "finds_inspected_fraction", "given_up_s", "left_when_given_up"}
    silent |= {"n_violated_obligations", "settling_s", "settled"}
    declared = set(metrics_of(scenario))
    assert measures | silent <= declared
    assert declared - silent == declared & set(summary(run_scenario(scenario, 1)))
