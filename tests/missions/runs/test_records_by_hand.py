"""Metrics of records that are written by hand, whose values are worked out beside them."""

from types import SimpleNamespace
from typing import Any

from missions.runs.metrics import _powered_s, mean_latency_s, p95_latency_s


def run_of(**tables: Any) -> Any:
    """As much of a run as these metrics read: ticks of half a second."""
    scenario = SimpleNamespace(scenario=SimpleNamespace(tick_s=0.5))
    return SimpleNamespace(recorder=SimpleNamespace(rows=tables.__getitem__), scenario=scenario)


def test_the_95_percent_latency_is_that_of_95_percent() -> None:
    """Latencies of 0, 1, ..., 20 s: position 0.95 * 20 = 19 of the 21; a 90 % latency would be 18 s."""
    observed = [(0.0, "A", f"A/{n}", "A", "observed") for n in range(21)]
    received = [(float(n), "B", f"A/{n}", "A", "received") for n in range(21)]
    run = run_of(knowledge=[*observed, *received])
    assert p95_latency_s(run) == 19.0
    assert mean_latency_s(run) == 10.0


def test_a_95_percent_latency_between_two_is_taken_in_proportion() -> None:
    """Two latencies, 1 and 3 s: position 0.95, so 1 + 0.95 * 2; a reception of what nobody observed does not count."""
    rows = [
        (0.0, "A", "A/1", "A", "observed"), (1.0, "B", "A/1", "A", "received"), (3.0, "C", "A/1", "A", "received"),
        (9.0, "C", "A/9", "A", "received"),
    ]  # fmt: skip
    assert p95_latency_s(run_of(knowledge=rows)) == 2.9


def test_time_with_power_is_that_in_which_energy_was_used() -> None:
    """A uses energy in two ticks and then none, since it has none left; B in one. Its first row is no tick."""

    def row(time_s: float, vehicle: str, used_j: float) -> tuple[Any, ...]:
        return time_s, vehicle, 0.0, 0.0, 0.0, 0.0, used_j, 0.0

    rows = [
        row(0.0, "A", 5.0), row(0.0, "B", 0.0), row(0.5, "A", 6.0), row(0.5, "B", 0.0), row(1.0, "A", 7.0),
        row(1.0, "B", 2.0), row(1.5, "A", 7.0), row(1.5, "B", 2.0),
    ]  # fmt: skip
    assert _powered_s(run_of(trajectories=rows)) == 3 * 0.5
