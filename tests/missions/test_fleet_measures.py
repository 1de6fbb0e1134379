"""Measures of a run's tables: consistency of what the fleet knows, the energy of the modems."""

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_mission import SMALL

from exchange.acoustics.modems import modems
from missions.runs.metrics import consistency
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
