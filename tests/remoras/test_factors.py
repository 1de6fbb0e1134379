"""Factors of strategies: named points of one table, switches that make one strategy of another, what is excluded."""

from functools import cache
from itertools import product
from pathlib import Path

import pytest
from sampling import sampled

from missions.errors import ConfigurationError
from missions.runs.run import run
from missions.scenarios import load
from remoras import face
from remoras.errors import StrategyError
from remoras.strategies import bounds, configured, factors_of, strategies
from remoras.strategies.factors import NO_HELP_S

POINTS = {
    "remoras": ("none", "head", "all", "plan", "yes", "calls"),
    "remoras-planned": ("jobs", "head", "all", "plan", "yes", "calls"),
    "plan-and-dispatch": ("jobs", "head", "all", "plan", "yes", "changes"),
    "central": ("missions", "head", "all", "next-jobs", "yes", "changes"),
    "contract-net": ("missions", "each", "all", "bids", "no", "changes"),
    "cbba": ("missions", "each", "all", "claims", "no", "changes"),
    "cbba-plain": ("missions", "each", "own", "claims", "no", "changes"),
    "status-broadcast": ("missions", "all", "all", "states", "yes", "changes"),
    "rendezvous-sync": ("jobs", "head", "all", "meetings", "no", "changes"),
    "fixed-partition": ("jobs", "nobody", "all", "nothing", "no", "never"),
}


def levels(name: str) -> tuple[str, ...]:
    found = factors_of(strategies()[name])
    assert found is not None
    return found.common_plan, found.decides, found.plan, found.announces, found.helps, found.repairs


def test_every_strategy_but_the_bound_is_a_point_and_no_two_are_the_same() -> None:
    assert {name: levels(name) for name in strategies() if name not in bounds()} == POINTS
    assert len(set(POINTS.values())) == len(POINTS)
    assert all(factors_of(strategies()[name]) is None for name in bounds())


def test_the_docs_have_the_table() -> None:
    text = (Path(__file__).parents[2] / "docs" / "strategies.md").read_text(encoding="utf-8")
    table = text.partition("## Factors")[2].partition("\n* ")[0].splitlines()
    rows_of = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in table if line.startswith("| `")]
    assert {name: tuple(of) for name, *of in rows_of} == POINTS


@cache
def rows(strategy: str, *settings: str) -> object:
    """All that moves, is said and is held in half of a mission with loss."""
    given = [f"strategy.name={strategy}", "channel.per=0.4", "scenario.duration_s=900", *settings]
    recorder = run(load("mapping-patches", [("--set", one) for one in given]), 3).recorder
    return recorder.trajectories, recorder.roles, recorder.packets


PARAMETERS = "strategy.parameters."
SAME = [
    ("remoras", "remoras-planned", ("common_plan=jobs",)),
    ("plan-and-dispatch", "central", ("common_plan=missions", "announces=next-jobs")),
    ("remoras", "plan-and-dispatch", ("common_plan=jobs", "repairs=changes")),
    ("cbba", "cbba-plain", ("plans_for_all=false",)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("one", "other", "factors"), SAME)
def test_factors_make_one_strategy_of_another(one: str, other: str, factors: tuple[str, ...]) -> None:
    """To the row; and every factor of the way is needed."""
    settings = [PARAMETERS + factor for factor in factors]
    assert rows(one, *settings) == rows(other)
    for count in range(len(settings)):
        assert rows(one, *settings[:count]) != rows(other)


def test_what_is_told_at_sea_is_declared() -> None:
    for name in ("central", "cbba", "contract-net", "status-broadcast"):
        before, at_sea = (configured(strategies()[name], {"common_plan": level}) for level in ("missions", "none"))
        assert before.declaration.planned_before
        assert not at_sea.declaration.planned_before
        assert {"hasMission", "playsRole"} <= set(at_sea.declaration.messages)
        assert before.declaration == strategies()[name].declaration


@pytest.mark.parametrize(
    ("strategy", "settings", "says"),
    [
        ("central", {"common_plan": "jobs"}, 'excludes announces = "next-jobs"; allowed: "plan", or common_p'),
        ("remoras-planned", {"announces": "next-jobs"}, 'excludes announces = "next-jobs"; allowed: "plan", or comm'),
        ("remoras", {"repairs": "never"}, "excludes help_s = 60; allowed: help_s = 1000000, or repairs"),
        ("cbba", {"common_plan": "jobs"}, "'none' or 'missions'"),
        ("cbba", {"decides": "head"}, 'cbba has "each" alone; "head" has central, plan-and-dispatch, '),
        ("cbba", {"helps": "yes"}, 'cbba has "no" alone; "yes" has central'),
        ("central", {"helps": "no"}, "central sets helps by help_s"),
        ("central", {"announces": "claims"}, "'plan' or 'next-jobs'"),
        ("fixed-partition", {"repairs": "calls"}, 'fixed-partition has "never" alone; "changes" has'),
    ],
)
def test_what_excludes_each_other_is_one_line_with_what_is_allowed(
    strategy: str, settings: dict[str, object], says: str
) -> None:
    with pytest.raises(StrategyError) as caught:
        configured(strategies()[strategy], settings)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    of_file = [("--set", f"{PARAMETERS}{key}={value}") for key, value in settings.items()]
    with pytest.raises(ConfigurationError) as refused:
        load("mapping-patches", [("--set", f"strategy.name={strategy}"), *of_file])
    assert [fault.key for fault in refused.value.faults] == [f"--set (strategy.parameters.{next(iter(settings))})"]
    assert says in str(refused.value)


def test_factors_that_fit_each_other_are_taken_together() -> None:
    """Each alone is excluded; one after the other they could not be set."""
    strategy = configured(strategies()["central"], {"common_plan": "jobs", "announces": "plan", "help_s": NO_HELP_S})
    assert factors_of(configured(strategy, {"repairs": "never"})) is not None
    fitting = 0
    for common_plan, announces, help_s, repairs in product(
        ("none", "missions", "jobs"), ("next-jobs", "plan"), (60.0, NO_HELP_S), ("changes", "calls", "never")
    ):
        settings = {"common_plan": common_plan, "announces": announces, "help_s": help_s, "repairs": repairs}
        try:
            configured(strategies()["remoras"], settings)
        except StrategyError:
            assert (common_plan == "jobs" and announces == "next-jobs") or (repairs == "never" and help_s == 60.0)
        else:
            fitting += 1
    assert fitting == 3 * 2 * 2 * 3 - 6 - 6 + 1


def goal_of(settings: list[str], seed: int) -> float:
    scenario = load("mapping-patches", [("--set", one) for one in settings])
    return float(face.run(scenario, seed=seed).summary["goal_fraction"])


LOST = 'fault=[{kind="lost", vehicle="AUV02", at_s=500.0}]'


@pytest.mark.slow
@pytest.mark.parametrize("common_plan", ["none", "missions", "jobs"])
def test_what_a_lost_vehicle_had_is_done_where_the_plan_is_mended(common_plan: str) -> None:
    """By the same head, with the same losses; the end of the run is long after the lease."""

    def goal(repairs: str) -> float:
        factors = [f"repairs={repairs}", f"common_plan={common_plan}", f"help_s={NO_HELP_S}"]
        given = ["strategy.name=remoras", "channel.per=0.2", "scenario.duration_s=3600", LOST]
        given += [PARAMETERS + factor for factor in factors]
        return goal_of(given, 1)

    assert goal("never") < 0.9
    assert goal("changes") > 0.98
    assert goal("calls") > 0.98


@pytest.mark.slow
@pytest.mark.parametrize(
    "strategy", sampled(["remoras", "central", "cbba", "contract-net", "status-broadcast"], "remoras", "cbba")
)
def test_where_missions_are_told_at_sea_work_begins_later(strategy: str) -> None:
    """Nine packets of ten are lost, and a mission that is known need not be heard."""

    def mapped(common_plan: str) -> float:
        given = [f"strategy.name={strategy}", "channel.per=0.9", "scenario.duration_s=900"]
        given += [f"{PARAMETERS}common_plan={common_plan}", "communication.modem=whoi-fsk-0"]
        return sum(goal_of(given, seed) for seed in (1, 2))

    assert mapped("missions") > mapped("none") + 0.05
