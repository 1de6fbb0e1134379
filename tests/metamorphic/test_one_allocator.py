"""Without losses and faults, strategies that share one allocator give equal results apart from assistance."""

from __future__ import annotations

from statistics import fmean

import pytest
from recorded import flown

from missions.mapping.metrics import time_to_s

SEEDS = range(1, 4)
WITH_HELP = ("remoras", "remoras-planned", "central", "plan-and-dispatch", "status-broadcast")
WITHOUT_HELP = ("contract-net", "cbba", "rendezvous-sync", "fixed-partition")
NO_HELP = ("strategy.parameters.join_s=100000.0",)
"""No help at another's job saves as much time."""


def to_95_s(scenario: str, strategy: str, *settings: str) -> float:
    """Mean time to 95 % of the goal."""
    given = f"strategy.name={strategy}", "channel.per=0.0", *settings
    times_s = [time_to_s(0.95)(flown(scenario, *given, seed=seed)) for seed in SEEDS]
    return fmean(time_s for time_s in times_s if time_s is not None)


@pytest.mark.slow
@pytest.mark.thorough
def test_strategies_are_equal_where_each_job_takes_one_vehicle() -> None:
    means_s = [to_95_s("mapping-patches", strategy) for strategy in WITH_HELP + WITHOUT_HELP]
    assert max(means_s) <= 1.03 * min(means_s)


@pytest.mark.slow
@pytest.mark.thorough
def test_strategies_are_equal_without_assistance() -> None:
    """On the corridor two may share a job: whoever helps is ahead, and is no longer once help is taken away."""
    alone_s = {strategy: to_95_s("mapping-corridor", strategy) for strategy in WITHOUT_HELP}
    alone_s |= {strategy: to_95_s("mapping-corridor", strategy, *NO_HELP) for strategy in WITH_HELP}
    assert max(alone_s.values()) <= 1.03 * min(alone_s.values())
    for strategy in WITH_HELP:
        assert to_95_s("mapping-corridor", strategy) <= 0.995 * alone_s[strategy], strategy
