"""The sequential test keeps to the error rates that it states, in as few looks as theory has it."""

import math
import random

import pytest

from missions.meeting.sequential_test import sequential_verdict

N = 4000


def played(draw: random.Random, is_true: bool, p_right: float, rate: float) -> tuple[bool, int]:
    """What is decided, and after how many looks."""
    odds, n = 1.0, 0
    while (verdict := sequential_verdict(odds / (1.0 + odds), rate, rate)) is None:
        looks_true = is_true == (draw.random() < p_right)
        odds *= p_right / (1.0 - p_right) if looks_true else (1.0 - p_right) / p_right
        n += 1
    return verdict, n


@pytest.mark.parametrize("rate", [0.01, 0.1])
@pytest.mark.parametrize("p_right", [0.7, 0.85, 0.95])
@pytest.mark.parametrize("is_true", [True, False])
def test_errors_are_as_rare_as_stated_and_looks_few(is_true: bool, p_right: float, rate: float) -> None:
    """Wald: at most rate / (1 - rate) err; a walk that ends n steps off ends after (1 - 2 err) n / (2 p - 1) looks."""
    draw = random.Random(5)
    verdicts, looks = zip(*(played(draw, is_true, p_right, rate) for _ in range(N)), strict=True)
    most = rate / (1.0 - rate)
    errors = sum(verdict is not is_true for verdict in verdicts) / N
    assert errors <= most + 4.0 * math.sqrt(most / N)
    steps = math.ceil(math.log((1.0 - rate) / rate) / math.log(p_right / (1.0 - p_right)) - 1e-9)
    err = 1.0 / (1.0 + (p_right / (1.0 - p_right)) ** steps)
    assert sum(looks) / N == pytest.approx((1.0 - 2.0 * err) * steps / (2.0 * p_right - 1.0), rel=0.05)


def test_a_stricter_rate_takes_more_looks_and_certainty_needs_no_more() -> None:
    assert sequential_verdict(0.99, 0.02, 0.02) is True
    assert sequential_verdict(0.99, 0.005, 0.005) is None
    assert sequential_verdict(1.0, 0.001, 0.001) is True
    assert sequential_verdict(0.0, 0.001, 0.001) is False
