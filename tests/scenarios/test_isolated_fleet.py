"""All vehicles isolated at work: each does its own jobs, they meet, and only then take over others."""

import math
from functools import cache

import pytest
from recorded import flown
from sampling import sampled

from missions.runs.results import summary
from missions.runs.run import Run
from remoras.organisation.membership import Patience
from remoras.social import layer

ROWS = (f'{{from_s=200.0, until_s=7200.0, vehicle="{name}"}}' for name in ("ASV00", "AUV00", "AUV01", "AUV02"))
ISOLATED = f"channel.blackout=[{', '.join(ROWS)}]"


def finished(strategy: str, *settings: str) -> Run:
    return flown("mapping-patches", f"strategy.name={strategy}", "channel.per=0", *settings)


@cache
def silent_s() -> float:
    return float(summary(finished("fixed-partition"))["mission_time_s"])


@pytest.mark.slow
@pytest.mark.parametrize("strategy", sampled(("remoras", "central", "cbba"), "cbba"))
def test_a_permanently_isolated_fleet_is_about_as_fast_as_a_silent_one(strategy: str) -> None:
    figures = summary(finished(strategy, ISOLATED))
    assert figures["mission_time_s"] <= 1.3 * silent_s()
    assert figures["duplicate_fraction"] <= 0.1


@pytest.mark.slow
def test_without_a_grace_period_isolated_vehicles_duplicate_all_jobs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layer, "patience_with", lambda *asked: Patience(-math.inf, -math.inf, frozenset()))
    figures = summary(finished("remoras", ISOLATED))
    assert figures["mission_time_s"] > 2.0 * silent_s()
    assert figures["duplicate_fraction"] > 0.5


@pytest.mark.slow
def test_the_only_survivor_waits_and_then_does_all_jobs() -> None:
    lost = ", ".join(f'{{kind="lost", vehicle="{name}", at_s=600.0}}' for name in ("ASV00", "AUV01", "AUV02"))
    done = finished("remoras", f"fault=[{lost}]")
    assert done.completed, done.reason
    met = [one.time_s for one in done.milestones if one.name == "gathered"]
    assert min(met) < done.end_s - 1000.0, "it met before it took over"
