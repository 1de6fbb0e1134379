"""The HTN planner: actions per second against GTPyhop, and the cost of a repair.

The rows against GTPyhop are left out where it is not installed (``pip install gtpyhop``); its fastest strategy, the
recursive one, is taken, with the same tests and effects. Goals: 3 times its actions per second; at most 0.05 of
planning for the repair of one of 500 steps.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

from benchmarks.measuring import least_s, row
from remoras.htn import Domain, Execution, FactsLike, Method, Operator, Plan, Task, plan

REPEATS = 7
N_STEPS, STEPS_PER_LEG = 500, 4
DISTANCES = {
    ("home_a", "park"): 8, ("home_b", "park"): 2, ("station", "home_a"): 1, ("station", "home_b"): 7,
    ("home_a", "home_b"): 7, ("station", "park"): 9,
}  # fmt: skip
START: dict[str, dict[str, Any]] = {
    "loc": {"alice": "home_a", "bob": "home_b", "taxi1": "park", "taxi2": "station"},
    "cash": {"alice": 20, "bob": 15},
    "owe": {"alice": 0, "bob": 0},
}
FACTS = {(name, of): value for name, table in START.items() for of, value in table.items()}
TRIPS = (("alice", "park"), ("bob", "park"))
N_DISCS = 7


def distance(origin: str, target: str) -> int:
    """Between two places of Nau's travel domain."""
    return DISTANCES.get((origin, target)) or DISTANCES[target, origin]


def fare(length: float) -> float:
    """Of a taxi."""
    return 1.5 + 0.5 * length


def travel() -> Domain:
    """Nau's travel domain: walk if it is near, else take a taxi."""

    def ride(facts: FactsLike, who: str, target: str) -> dict[Any, Any]:
        taxi = facts.get(("loc", who))
        return {("loc", taxi): target, ("owe", who): fare(distance(facts.get(("loc", taxi)), target))}

    def pay(facts: FactsLike, who: str, target: str) -> dict[Any, Any]:
        left = facts.get(("cash", who)) - facts.get(("owe", who))
        return {("cash", who): left, ("owe", who): 0, ("loc", who): target}

    def walk(facts: FactsLike, who: str, target: str) -> list[Task]:
        return [Task("walk", (who, facts.get(("loc", who)), target))]

    def by_taxi(facts: FactsLike, who: str, target: str) -> list[Task]:
        at = facts.get(("loc", who))
        return [Task("call_taxi", (who, at)), Task("ride_taxi", (who, target)), Task("pay_driver", (who, target))]

    return Domain.of(
        [
            Operator("walk", lambda facts, who, origin, target: facts.get(("loc", who)) == origin,
                     lambda facts, who, origin, target: {("loc", who): target}),
            Operator("call_taxi", effects=lambda facts, who, at: {("loc", "taxi1"): at, ("loc", who): "taxi1"}),
            Operator("ride_taxi", lambda facts, who, to: facts.get(("loc", facts.get(("loc", who)))) != to, ride),
            Operator("pay_driver", lambda facts, who, target: facts.get(("cash", who)) >= facts.get(("owe", who)), pay),
        ],
        {
            "travel": [
                Method("stay", lambda facts, who, target: [],
                       lambda facts, who, target: facts.get(("loc", who)) == target),
                Method("on foot", walk, lambda facts, who, target: distance(facts.get(("loc", who)), target) <= 2),
                Method("by taxi", by_taxi, lambda facts, who, target:
                       facts.get(("cash", who)) >= fare(distance(facts.get(("loc", who)), target))),
            ]
        },
    )  # fmt: skip


def towers() -> Domain:
    """Towers of Hanoi: 2^n - 1 moves."""

    def carry(facts: FactsLike, n: int, origin: str, target: str, spare: str) -> list[Task]:
        return [
            Task("tower", (n - 1, origin, spare, target)),
            Task("move", (n, origin, target)),
            Task("tower", (n - 1, spare, target, origin)),
        ]

    return Domain.of(
        [
            Operator("move", lambda facts, disc, origin, target: facts.get(("on", disc)) == origin,
                     lambda facts, disc, origin, target: {("on", disc): target}),
        ],
        {
            "tower": [
                Method("none", lambda facts, *args: [], lambda facts, n, *pegs: n == 0),
                Method("carry", carry),
            ]
        },
    )  # fmt: skip


def _gtpyhop() -> Any:
    """GTPyhop, without what it says of itself; it speaks on the output that --json is to have alone."""
    with contextlib.redirect_stdout(io.StringIO()):
        module = importlib.import_module("gtpyhop")
        module.set_verbose_level(0)
        module.set_recursive_planning(True)
    return module


def _their_travel(gtpyhop: Any) -> Callable[[], Any]:
    with contextlib.redirect_stdout(io.StringIO()):
        gtpyhop.Domain("travel")

    def walk(state: Any, who: str, origin: str, target: str) -> Any:
        if state.loc[who] != origin:
            return None
        state.loc[who] = target
        return state

    def call_taxi(state: Any, who: str, at: str) -> Any:
        state.loc["taxi1"] = at
        state.loc[who] = "taxi1"
        return state

    def ride_taxi(state: Any, who: str, target: str) -> Any:
        taxi = state.loc[who]
        if state.loc[taxi] == target:
            return None
        state.owe[who] = fare(distance(state.loc[taxi], target))
        state.loc[taxi] = target
        return state

    def pay_driver(state: Any, who: str, target: str) -> Any:
        if state.cash[who] < state.owe[who]:
            return None
        state.cash[who] -= state.owe[who]
        state.owe[who] = 0
        state.loc[who] = target
        return state

    def stay(state: Any, who: str, target: str) -> Any:
        return [] if state.loc[who] == target else None

    def on_foot(state: Any, who: str, target: str) -> Any:
        at = state.loc[who]
        return [("walk", who, at, target)] if distance(at, target) <= 2 else None

    def by_taxi(state: Any, who: str, target: str) -> Any:
        if state.cash[who] < fare(distance(state.loc[who], target)):
            return None
        return [("call_taxi", who, state.loc[who]), ("ride_taxi", who, target), ("pay_driver", who, target)]

    gtpyhop.declare_actions(walk, call_taxi, ride_taxi, pay_driver)
    gtpyhop.declare_task_methods("travel", stay, on_foot, by_taxi)
    state = gtpyhop.State("start", **START)
    todo = [("travel", *trip) for trip in TRIPS]
    return lambda: gtpyhop.find_plan(state, todo)


def _their_towers(gtpyhop: Any) -> Callable[[], Any]:
    with contextlib.redirect_stdout(io.StringIO()):
        gtpyhop.Domain("towers")

    def move(state: Any, disc: int, origin: str, target: str) -> Any:
        if state.on[disc] != origin:
            return None
        state.on[disc] = target
        return state

    def none(state: Any, n: int, *pegs: str) -> Any:
        return [] if n == 0 else None

    def carry(state: Any, n: int, origin: str, target: str, spare: str) -> Any:
        return [("tower", n - 1, origin, spare, target), ("move", n, origin, target),
                ("tower", n - 1, spare, target, origin)]  # fmt: skip

    gtpyhop.declare_actions(move)
    gtpyhop.declare_task_methods("tower", none, carry)
    state = gtpyhop.State("start", on=dict.fromkeys(range(1, N_DISCS + 1), "a"))
    return lambda: gtpyhop.find_plan(state, [("tower", N_DISCS, "a", "c", "b")])


def _lengths(planned: Any) -> int:
    return len(planned.tasks) if isinstance(planned, Plan) else len(getattr(planned, "plan", planned))


def _against_gtpyhop() -> list[dict[str, Any]]:
    if find_spec("gtpyhop") is None:
        return []
    gtpyhop = _gtpyhop()
    by_travel, by_towers = travel(), towers()
    trips = [Task("travel", trip) for trip in TRIPS]
    pegs = {("on", disc): "a" for disc in range(1, N_DISCS + 1)}
    whole = Task("tower", (N_DISCS, "a", "c", "b"))
    table = []
    compared: tuple[tuple[str, Callable[[], Any], Callable[[Any], Callable[[], Any]], int], ...] = (
        ("travel", lambda: plan(by_travel, FACTS, trips), _their_travel, 200),
        (f"towers, {N_DISCS} discs", lambda: plan(by_towers, pegs, whole), _their_towers, 3),
    )
    for name, ours, their, calls in compared:
        theirs: Callable[[], Any] = their(gtpyhop)  # which makes its domain the one that is planned with
        n_actions = _lengths(ours())
        if _lengths(theirs()) != n_actions:
            raise AssertionError(f"{name}: the plans differ in length")
        ours_s, theirs_s = least_s(ours, theirs, repeats=REPEATS, calls=calls)
        table.append(row(f"htn, {name}", n_actions / ours_s, "1/s", "GTPyhop", n_actions / theirs_s))
    return table


def _repair() -> list[dict[str, Any]]:
    """One of 500 steps fails, in the middle of the plan: its branch anew, against the plan for the whole."""

    def legs(facts: FactsLike) -> list[Task]:
        return [Task("leg", (number,)) for number in range(N_STEPS // STEPS_PER_LEG)]

    def ways(facts: FactsLike, number: int) -> Iterator[list[Task]]:
        for way in range(2):
            yield [Task("go", (number, way, part)) for part in range(STEPS_PER_LEG)]

    def follows(facts: FactsLike, number: int, way: int, part: int) -> bool:
        return number == 0 or bool(facts.get(("gone", number - 1, STEPS_PER_LEG - 1)))

    domain = Domain.of(
        [Operator("go", follows, lambda facts, number, way, part: {("gone", number, part): True})],
        {"way": [Method("legs", legs)], "leg": [Method("some way", ways)]},
    )
    facts: dict[Any, Any] = {}
    planned = plan(domain, facts, Task("way"))
    if not isinstance(planned, Plan) or len(planned.tasks) != N_STEPS:
        raise AssertionError(f"the plan has not {N_STEPS} steps")
    planning_s, repair_s = float("inf"), float("inf")
    for _ in range(20 * REPEATS):
        began = time.process_time()
        plan(domain, {}, Task("way"))
        planning_s = min(planning_s, time.process_time() - began)
        under_way = Execution(domain, planned)
        facts.clear()
        for step in under_way.advance(facts):
            number, _, part = step.task.args
            if number == N_STEPS // STEPS_PER_LEG // 2:
                break
            facts["gone", number, part] = True
        began = time.process_time()
        is_mended = under_way.fail(step.place, facts)
        repair_s = min(repair_s, time.process_time() - began)
        if not is_mended:
            raise AssertionError("the leg has another way")
    return [row(f"htn, repair of one of {N_STEPS} steps", 1e6 * repair_s, "us", "planning", 1e6 * planning_s)]


def rows() -> list[dict[str, Any]]:
    """Benchmark rows; the two of one row are measured in turn in this process, GTPyhop last for its many objects."""
    return [*_repair(), *_against_gtpyhop()]
