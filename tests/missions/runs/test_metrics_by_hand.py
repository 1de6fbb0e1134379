"""Figures of the summary worked out by hand, from a few rows."""

from types import SimpleNamespace
from typing import Any

import pytest

from missions.runs import metrics
from missions.scenarios import load


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


def test_a_run_without_time_has_no_observations() -> None:
    assert metrics.observations_per_min(run_of(0.0, 2, [])) == 0.0


def test_latencies_of_1_to_101_seconds() -> None:
    """Their mean is 51 s. Between 101 values there are 100 steps, so 95 of 100 lead to 96 s; 90 would lead to 91 s."""
    rows = [row for number in range(1, 102) for row in heard(float(number), str(number))]
    run = run_of(200.0, 2, rows)
    assert metrics.mean_latency_s(run) == pytest.approx(51.0)
    assert metrics.p95_latency_s(run) == pytest.approx(96.0)
    assert metrics.p95_latency_s(run_of(200.0, 2, [])) is None


@pytest.mark.parametrize("name", ["goal_fraction", "reachable_fraction"])
def test_shares_of_the_goal_are_given_to_a_millionth(name: str) -> None:
    metric = next(declared for declared in metrics.CORE_METRICS if declared.name == name)
    assert metric.of(SimpleNamespace(**{name: 2.0 / 3.0})) == 0.666667
