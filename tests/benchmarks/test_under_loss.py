"""The tables of the study on strategies: means, differences by repeat, and what counts."""

import itertools
from typing import Any

import pytest

from benchmarks.under_loss import BASELINE, HORIZON_S, Runs, tables

CASES = "nothing", "one vehicle lost"
TIMES_S = {BASELINE: 1000.0, "cbba": 1100.0}


def line(strategy: str, case: str, per: float, repeat: int, **more: Any) -> dict[str, Any]:
    settings = {
        "strategy.name": strategy,
        "unforeseen": case,
        "channel.per": per,
        "communication.modem": "nanomodem-v3",
    }
    mission_s = TIMES_S[strategy] + 100.0 * repeat + (50.0 * repeat if strategy == "cbba" else 0.0)
    summary = {"scenario": "sea", "completed": True, "mission_time_s": mission_s, "time_to_95_s": 900.0, **more}
    return {"repeat": repeat, "settings": settings, "summary": summary}


@pytest.fixture
def made() -> list[dict[str, Any]]:
    return [line(*one) for one in itertools.product(TIMES_S, CASES, (0.0, 0.8), range(3))]


def test_differences_are_paired_by_repeat(made: list[dict[str, Any]]) -> None:
    """They are 100, 150 and 200 s: 150 -+ 4.303 * 50 / sqrt(3)."""
    mean, half = Runs(made).difference("cbba")
    assert (mean, half) == pytest.approx((150.0, 124.2), abs=0.1)


def test_a_repeat_counts_once_all_its_runs_are_made(made: list[dict[str, Any]]) -> None:
    assert Runs(made[:-1]).repeats == [0, 1]


def test_what_never_ends_counts_with_its_horizon(made: list[dict[str, Any]]) -> None:
    ended = [{**one, "summary": {**one["summary"], "completed": False}} for one in made[:1]]
    runs = Runs(ended + made[1:])
    assert runs.mean_s(runs.where(BASELINE, per=0.0, unforeseen="nothing")) == (HORIZON_S + 1100.0 + 1200.0) / 3
    assert "| `plan-and-dispatch` | 2133, 83% | 1100 |" in list(tables(runs, CASES))
