"""Factors of strategies: named values of one table, switches between strategies, exclusions."""

from functools import cache

import pytest

from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.scenarios import load
from remoras.errors import StrategyError
from remoras.strategies import configured, factors_of, strategies
from remoras.strategies.factors import NO_JOIN_S


@cache
def rows(strategy: str, *settings: str) -> object:
    """Rows of motion, packets and roles of half a mission with loss."""
    given = [f"strategy.name={strategy}", "channel.per=0.4", "scenario.duration_s=900", *settings]
    recorder = run(load("mapping-patches", [("--set", one) for one in given]), 3).recorder
    return recorder.trajectories, recorder.roles, recorder.packets


PARAMETERS = "strategy.parameters."
SAME = [
    ("remoras", "remoras-planned", ("common_plan=jobs",)),
    ("plan-and-dispatch", "central", ("common_plan=missions", "announces=next-jobs")),
    ("remoras", "plan-and-dispatch", ("common_plan=jobs", "repairs=changes", "help=none")),
    ("cbba", "cbba-plain", ("plans_for_all=false",)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("one", "other", "factors"), SAME)
def test_factors_turn_one_strategy_into_another(one: str, other: str, factors: tuple[str, ...]) -> None:
    """To the row; and every factor of the way is needed."""
    settings = [PARAMETERS + factor for factor in factors]
    assert rows(one, *settings) == rows(other)
    for count in range(len(settings)):
        assert rows(one, *settings[:count]) != rows(other)


@pytest.mark.parametrize(
    ("strategy", "settings", "says"),
    [
        ("central", {"common_plan": "jobs"}, '"next-jobs"; allowed: announces = "plan", or common_plan'),
        ("remoras-planned", {"announces": "next-jobs"}, '"next-jobs"; allowed: announces = "plan", or common_plan'),
        ("remoras", {"repairs": "never"}, "excludes join_s = 60; allowed: join_s = 1000000, or repairs"),
        ("cbba", {"common_plan": "jobs"}, "'none' or 'missions'"),
        ("cbba", {"decides": "head"}, 'cbba has "each" alone; "head" has central, plan-and-dispatch, '),
        ("cbba", {"joins": "yes"}, 'cbba has "no" alone; "yes" has central'),
        ("central", {"joins": "no"}, "central sets joins by join_s"),
        ("central", {"announces": "claims"}, "'plan' or 'next-jobs'"),
        ("fixed-partition", {"repairs": "calls"}, 'fixed-partition has "never" alone; "changes" has'),
        ("fixed-partition", {"help": "calls"}, 'fixed-partition has "none" alone; "calls" has remoras'),
        ("rendezvous-sync", {"help": "auction"}, 'rendezvous-sync has "none" alone; "calls" has remoras'),
        ("oracle", {"help": "calls"}, "oracle has no parameters"),
        ("cbba", {"help": "often"}, "'none', 'calls' or 'auction'"),
        ("remoras", {"help": "auction"}, 'excludes help = "auction"; allowed: help = "calls", or repairs'),
        ("central", {"repairs": "calls"}, 'excludes help = "none"; allowed: help = "calls", or repairs'),
    ],
)
def test_incompatible_factors_are_reported_in_one_line_with_the_allowed_values(strategy, settings, says) -> None:
    with pytest.raises(StrategyError) as caught:
        configured(strategies()[strategy], settings)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    of_file = [("--set", f"{PARAMETERS}{key}={value}") for key, value in settings.items()]
    with pytest.raises(ConfigurationError) as refused:
        load("mapping-patches", [("--set", f"strategy.name={strategy}"), *of_file])
    assert [fault.key for fault in refused.value.faults] == [f"--set (strategy.parameters.{next(iter(settings))})"]
    assert says in str(refused.value)


def test_compatible_factors_combine() -> None:
    """Each alone is excluded; one after the other they could not be set."""
    strategy = configured(strategies()["central"], {"common_plan": "jobs", "announces": "plan", "join_s": NO_JOIN_S})
    assert factors_of(configured(strategy, {"repairs": "never"})) is not None
