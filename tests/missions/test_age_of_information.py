"""Age of information, on receptions small enough to count by hand, and against the formula."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recorded import flown

from missions.age_of_information import expected_s, mean_age_s, of_run, peak_age_s


def run_of(*packets: tuple[float, float]) -> Any:
    """A run in which B receives packets of A, by the times at which they are sent and received."""
    rows = [(0, sent_s, "A", 64, 0, 0, ["B"], [], sent_s, [at_s]) for sent_s, at_s in packets]
    return SimpleNamespace(recorder=SimpleNamespace(rows=lambda table: rows))


def test_age_of_three_receptions() -> None:
    """From 1 to 11 s the age grows from 1 to 11 s, mean 6; from 11 to 31 s from 1 to 21 s, mean 11."""
    run = run_of((0.0, 1.0), (10.0, 11.0), (30.0, 31.0))
    assert mean_age_s(run) == pytest.approx((10.0 * 6.0 + 20.0 * 11.0) / 30.0, abs=1e-4)
    assert peak_age_s(run) == (11.0 + 21.0) / 2.0


def test_one_reception_has_no_age() -> None:
    assert mean_age_s(run_of((0.0, 1.0))) is None
    assert peak_age_s(run_of()) is None


@given(st.lists(st.floats(0.1, 100.0), min_size=2, max_size=20), st.floats(0.0, 0.1))
def test_mean_age_lies_between_delay_and_greatest_peak(gaps_s: list[float], delay_s: float) -> None:
    sent_s = [math.fsum(gaps_s[:n]) for n in range(len(gaps_s) + 1)]
    run = run_of(*((time_s, time_s + delay_s) for time_s in sent_s))
    mean_s = mean_age_s(run)
    assert mean_s is not None
    assert delay_s - 1e-4 <= mean_s <= max(one.peak_s for one in of_run(run)) + 1e-4


@pytest.mark.parametrize(("per", "mean_s", "peak_s"), [(0.2, 5.86, 9.40), (0.5, 11.26, 14.80), (0.8, 32.88, 36.43)])
def test_formula_gives_the_published_check_values(per: float, mean_s: float, peak_s: float) -> None:
    """Frame of 7.09 s; the delay is that of the packets, longer at higher loss."""
    delay_s = peak_s - 7.09 / (1.0 - per)
    assert expected_s(7.09, per, delay_s) == (pytest.approx(mean_s, abs=0.02), pytest.approx(peak_s, abs=0.01))


def test_loss_makes_information_older() -> None:
    ages = [
        mean_age_s(flown("mapping-rendezvous", f"channel.per={per}", "scenario.duration_s=400")) for per in (0, 0.8)
    ]
    assert ages[0] is not None
    assert ages[1] is not None
    assert 2.0 * ages[0] < ages[1]
