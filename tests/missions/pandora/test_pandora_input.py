"""Refused tables of the structure, sequential tests, and the speed to hold position."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from servicing import raw, written

from missions.errors import ConfigurationError
from missions.meeting.sequential_tests import Cusum, readings_between_alarms, threshold
from missions.pandora.assessment import SPARE_MPS, ActionMonitor
from missions.scenarios import load
from remoras.database import VehicleData


def refusal(folder: Path, tables: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(folder, tables)))
    return str(refused.value)


@pytest.mark.parametrize(
    ("table", "entry", "change", "says"),
    [
        ("valve", 1, {"position_m": [-43.0, 1.0]}, "valve A2.position_m.*: 1 m from valve A1; allowed: 2.5 m or more"),
        ("valve", 0, {"panel": "panel Z"}, 'valve.valve A1.panel = "panel Z": allowed: panel A'),
        ("valve", 0, {"name": "any"}, "valve.any.name = .*stands for a valve that is drawn"),
    ],
)  # fmt: skip
def test_faulty_part_is_refused_with_its_line(
    tmp_path: Path, table: str, entry: int, change: dict[str, Any], says: str
) -> None:
    tables = raw()
    tables[table][entry] |= change
    found = refusal(tmp_path, tables)
    assert re.search(says, found), found
    assert re.match(rf"{re.escape(str(tmp_path))}/little.toml:\d+: ", found)


@pytest.mark.parametrize(
    ("upsets", "says"),
    [
        ([{"kind": "moved"}], "upset.1.distance_m: missing: how far the valve is from its place"),
        ([{"kind": "stuck", "distance_m": 2.0}], "upset.1.distance_m = 2.0: not used by kind stuck, only by moved"),
        ([{"kind": "stuck", "part": "valve A1"}] * 2, 'upset.2.part = "valve A1": is upset already'),
        ([{"kind": "stuck"}] * 4, "upset = 4 tables: each affects another valve, and there are 3"),
    ],
)  # fmt: skip
def test_faulty_upset_is_refused(tmp_path: Path, upsets: list[dict[str, Any]], says: str) -> None:
    assert says in refusal(tmp_path, {**raw(), "upset": upsets})


SURGE = {"between_s": [0.0, 10.0], "lasts_s": 5.0, "east_mps": 0.7}


@pytest.mark.parametrize(("table", "change", "says"), [
    ("current", {"surge": [{**SURGE, "between_s": [20.0, 10.0]}]}, "the earliest start may not be later than the lat"),
    ("current", {"surge": [SURGE]}, "could not stay where it is"),
])  # fmt: skip
def test_contradictory_settings_are_refused(tmp_path: Path, table: str, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables[table] |= change
    assert says in refusal(tmp_path, tables)


def between_alarms(stated: float, n_readings: int) -> float:
    """Readings for each alarm of one test that sees nothing but noise."""
    draws = np.random.Generator(np.random.Philox(7)).standard_normal(n_readings)
    test = Cusum(threshold(stated))
    return n_readings / sum(test.add(float(z)) is not None for z in draws)


def test_false_alarms_occur_at_the_stated_rate() -> None:
    """400,000 readings bring about 1,000 alarms: their number has a standard deviation of about 3 %."""
    assert between_alarms(400.0, 400_000) == pytest.approx(400.0, rel=0.12)


def test_threshold_equals_published_tables() -> None:
    """Exactly, both sides together alarm once in 168 readings at h = 4 and in 465 at h = 5 (Montgomery, Table 9.3)."""
    assert readings_between_alarms(4.0) == pytest.approx(168.0, rel=0.02)
    assert readings_between_alarms(5.0) == pytest.approx(465.0, rel=0.02)


@pytest.mark.parametrize("shift", [2.0, 3.0, -4.0])
def test_shift_is_detected_and_estimated(shift: float) -> None:
    draws = np.random.Generator(np.random.Philox(8))
    taken, estimates = [], []
    for _ in range(200):
        test = Cusum(threshold(18_000.0))
        for number in range(1, 1_000):
            if (off := test.add(float(draws.standard_normal()) + shift)) is not None:
                taken.append(number)
                estimates.append(off)
                break
    assert len(estimates) == 200
    # a sum that grows by |shift| - 1/2 a reading, from 0 to h = 8.5 and over it
    assert np.mean(taken) == pytest.approx((threshold(18_000.0) + 1.0) / (abs(shift) - 0.5), rel=0.15)
    assert np.mean(estimates) == pytest.approx(shift, rel=0.15)


def monitor() -> ActionMonitor:
    data = SimpleNamespace(name="AUV01", transit_speed_mps=2.0, depth_m=5.0, sensor=lambda kind: None)
    return ActionMonitor(cast(VehicleData, data), cast(Any, None), cast(Any, None), None)


@pytest.mark.parametrize(("known", "asked_mps"), [
    ({}, 0.4), ({("thrustShare", "AUV01"): 0.5}, 0.8), ({("flow", "AUV01"): (0.3, 0.4)}, 0.5 + SPARE_MPS),
    ({("flow", "AUV01"): (0.3, 0.4), ("thrustShare", "AUV01"): 0.5}, 2.0 * (0.5 + SPARE_MPS)),
    ({("flow", "AUV01"): (3.0, 4.0)}, 2.0),
])  # fmt: skip
def test_hold_speed_allows_for_weak_thrusters_and_current(known: dict[Any, Any], asked_mps: float) -> None:
    assert monitor().hold_speed_mps(known, 0.0, 0.4, 1.0) == pytest.approx(asked_mps)


@pytest.mark.parametrize(("thrust_share", "is_overpowered"), [(1.0, False), (0.2, True)])
def test_a_current_is_too_strong_for_weak_thrusters(thrust_share: float, is_overpowered: bool) -> None:
    known = {("flow", "AUV01"): (0.3, 0.4), ("thrustShare", "AUV01"): thrust_share}
    assert monitor().is_overpowered(known, 0.0) is is_overpowered
