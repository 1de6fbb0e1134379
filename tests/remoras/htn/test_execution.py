"""Execution of plans: order, tests and effects on the current facts, and repair of one branch.

The trip: pack, go from A to B by one of three ways, then report. ``go`` has a sailing method with two boats (two
decompositions of one method) and a walking method.
"""

import random
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from remoras.htn import (
    ANY,
    Domain,
    Execution,
    Expected,
    Method,
    Operator,
    Plan,
    Status,
    Task,
    plan,
)

TRIP = Task("trip")


def trip(asked: Counter[str]) -> Domain:
    """The domain; ``asked`` counts which methods are asked for subtasks."""

    def by_boat(facts: Any) -> Iterator[list[Task]]:
        for boat in ("Ada", "Bea"):
            asked["by boat"] += 1
            yield [Task("board", (boat,)), Task("sail", (boat,))]

    def whole(facts: Any) -> list[Task]:
        asked["whole"] += 1
        return [Task("pack"), Task("go"), Task("report")]

    def on_foot(facts: Any) -> list[Task]:
        asked["on foot"] += 1
        return [Task("walk")]

    return Domain.of(
        [
            Operator("pack", effects=lambda facts: {"packed": True}),
            Operator("board", lambda facts, boat: bool(facts.get("packed")), lambda facts, boat: {("on", boat): True}),
            Operator("sail", lambda facts, boat: bool(facts.get(("on", boat))), lambda facts, boat: {"at": "B"}),
            Operator("walk", lambda facts: bool(facts.get("packed")), lambda facts: {"at": "B"}),
            Operator("report", lambda facts: facts.get("at") == "B", lambda facts: {"heard by": ANY}),
        ],
        {
            "trip": [Method("whole", whole, uses=("pack", "go", "report"))],
            "go": [
                Method("by boat", by_boat, uses=("board", "sail")),
                Method("on foot", on_foot, lambda facts: not facts.get("storm"), ("walk",)),
            ],
        },
    )


def begun(domain: Domain, facts: dict[Any, Any], task: Task = TRIP) -> Execution:
    found = plan(domain, facts, task)
    assert isinstance(found, Plan)
    return Execution(domain, found)


def texts(execution: Execution) -> dict[str, str]:
    """Status by task."""
    pairs = zip(execution.branches, execution.statuses(), strict=True)
    return {str(branch.task): status.value for branch, status in pairs}


def carry_on(execution: Execution, facts: dict[Any, Any], does: dict[str, dict[Any, Any]]) -> list[str]:
    """Let every step do what ``does`` says at once; returns the steps that started."""
    started = []
    for step in execution.advance(facts):
        started.append(str(step.task))
        facts.update(does.get(step.task.name, {}))
    return started


def test_steps_start_in_order_after_their_preconditions() -> None:
    """Packing takes a while: what needs it waits, and ends when the facts say so, not when the planner foresaw it."""
    facts: dict[Any, Any] = {}
    execution = begun(trip(Counter()), facts)
    assert carry_on(execution, facts, {}) == ["pack()"]
    assert execution.is_waiting
    assert execution.awaited == {"packed"}
    assert texts(execution) == {
        "trip()": "running", "pack()": "running", "go()": "waiting", "board(Ada)": "waiting", "sail(Ada)": "waiting",
        "report()": "waiting",
    }  # fmt: skip
    facts["packed"] = True
    assert carry_on(execution, facts, {"board": {("on", "Ada"): True}, "sail": {"at": "B"}}) == [
        "board(Ada)", "sail(Ada)", "report()",
    ]  # fmt: skip
    assert texts(execution)["go()"] == "done"
    assert texts(execution)["trip()"] == "running"
    facts["heard by"] = "shore"  # ANY: it has some value
    assert execution.settle(facts)
    assert set(texts(execution).values()) == {"done"}


def test_a_step_whose_effect_already_holds_is_skipped() -> None:
    facts: dict[Any, Any] = {}
    execution = begun(trip(Counter()), facts)
    facts |= {"packed": True, ("on", "Ada"): True}
    assert carry_on(execution, facts, {"sail": {"at": "B"}}) == ["sail(Ada)", "report()"]


def test_only_the_failed_branch_is_replanned() -> None:
    """The boat Ada sinks under way: Bea is taken, by the same method; packing is not looked at, nor the trip."""
    asked: Counter[str] = Counter()
    facts: dict[Any, Any] = {}
    execution = begun(trip(asked), facts)
    carry_on(execution, facts, {"pack": {"packed": True}, "board": {("on", "Ada"): True}})
    [sailing] = execution.running
    asked.clear()
    assert execution.fail(sailing.place, facts)
    assert asked == {"by boat": 2}  # Ada is barred, Bea found
    assert texts(execution) == {
        "trip()": "running", "pack()": "done", "go()": "waiting", "board(Ada)": "done", "sail(Ada)": "failed",
        "report()": "waiting", "board(Bea)": "waiting", "sail(Bea)": "waiting",
    }  # fmt: skip
    assert carry_on(execution, facts, {"board": {("on", "Bea"): True}, "sail": {"at": "B"}}) == [
        "board(Bea)", "sail(Bea)", "report()",
    ]  # fmt: skip


def test_a_failure_propagates_up_to_the_first_alternative() -> None:
    """Both boats sink: on foot, another method. In a storm there is none, and above ``go`` none either."""
    for storm, ends in ((False, "done"), (True, "failed")):
        facts: dict[Any, Any] = {"storm": storm}
        execution = begun(trip(Counter()), facts)
        does: dict[str, dict[Any, Any]] = {"pack": {"packed": True}, "walk": {"at": "B"}, "report": {"heard by": 1}}
        for boat in ("Ada", "Bea"):
            carry_on(execution, facts, {**does, "board": {("on", boat): True}})
            found = execution.fail(execution.running[0].place, facts)
            assert found is (boat == "Ada" or not storm)
        carry_on(execution, facts, does)
        assert texts(execution)["trip()"] == ends
        assert execution.has_failed is storm
        assert texts(execution)["pack()"] == "done"
        assert texts(execution)["report()"] == ("dropped" if storm else "done")


def test_a_new_plan_keeps_steps_shared_with_the_previous_one() -> None:
    facts: dict[Any, Any] = {}
    domain = trip(Counter())
    execution = begun(domain, facts)
    carry_on(execution, facts, {"pack": {"packed": True}})
    before = [branch.task for branch in execution.branches]
    again = plan(domain, facts, TRIP)
    assert isinstance(again, Plan)
    execution.renew(again)
    assert [branch.task for branch in execution.branches] == before
    assert carry_on(execution, facts, {}) == ["board(Ada)"]  # packed it is
    facts["at"] = "B"
    execution.abandon()
    assert Counter(texts(execution).values()) == {"done": 1, "dropped": 5}


def test_the_expected_duration_of_a_step_is_queried_from_start_until_known() -> None:
    facts: dict[Any, Any] = {"length_m": None}

    def expected(facts: Any) -> Expected | None:
        return None if facts.get("length_m") is None else Expected(facts.get("length_m") / 2.0, 5.0)

    operator = Operator("tow", effects=lambda facts: {"towed": True}, expected=expected)
    domain = Domain.of([operator], {"job": [Method.fixed("tow", "tow")]})
    execution = begun(domain, facts, Task("job"))
    carry_on(execution, facts, {})
    assert execution.branches[1].expected is None
    facts["length_m"] = 40.0
    execution.settle(facts)
    assert execution.branches[1].expected == Expected(20.0, 5.0)  # 40 m at 2 m/s


def test_a_lasting_step_continues_until_the_plan_drops_it() -> None:
    domain = Domain.of([Operator("watch", lasts=True)], {"guard": [Method.fixed("watch", "watch")]})
    execution = begun(domain, {}, Task("guard"))
    assert carry_on(execution, {}, {}) == ["watch()"]
    assert not execution.settle({})
    execution.abandon()
    assert execution.statuses()[1] is Status.DROPPED


def ladder(n_legs: int, n_ways: int) -> Domain:
    """Legs in order, each by one of several ways; a leg needs the one before it."""

    def legs(facts: Any) -> list[Task]:
        return [Task("leg", (number,)) for number in range(n_legs)]

    def ways(facts: Any, number: int) -> Iterator[list[Task]]:
        for way in range(n_ways):
            yield [Task("begin", (number, way)), Task("end", (number, way))]

    def follows(facts: Any, number: int, way: int) -> bool:
        return number == 0 or bool(facts.get(("leg", number - 1)))

    return Domain.of(
        [
            Operator("begin", follows, lambda facts, number, way: {("begun", number, way): True}),
            Operator("end", lambda facts, number, way: bool(facts.get(("begun", number, way))),
                     lambda facts, number, way: {("leg", number): True}),
        ],
        {"way": [Method("legs", legs)], "leg": [Method("some way", ways)]},
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(8))
def test_after_random_failures_each_leg_uses_the_first_working_method(seed: int) -> None:
    """8 legs of 3 ways, each of which works with 0.75, drawn before: 0.98 per leg, 0.88 in all."""
    draw = random.Random(seed)
    works = {(leg, way): draw.random() < 0.75 for leg in range(8) for way in range(3)}
    facts: dict[Any, Any] = {}
    execution = begun(ladder(8, 3), facts, Task("way"))
    n_begun: Counter[tuple[int, int]] = Counter()
    for _ in range(100):
        for step in execution.advance(facts):
            leg, way = step.task.args
            if step.task.name == "begin":
                n_begun[leg, way] += 1
                facts["begun", leg, way] = True
            elif works[leg, way]:
                facts["leg", leg] = True
        if not execution.running:
            break
        execution.fail(execution.running[0].place, facts)
    possible = all(any(works[leg, way] for way in range(3)) for leg in range(8))
    assert (execution.statuses()[0] is Status.DONE) is possible
    assert execution.has_failed is not possible
    assert set(n_begun.values()) == {1}  # nothing is done twice
    if possible:
        taken = [min(way for way in range(3) if works[leg, way]) for leg in range(8)]
        assert set(n_begun) == {(leg, way) for leg in range(8) for way in range(taken[leg] + 1)}
