"""Loops, depth and task networks, and the faults of domains."""

import pickle
from collections.abc import Iterator

import pytest
from random_domains import is_executable

from remoras.errors import PlanningError
from remoras.htn import Domain, FactsLike, Method, NoPlan, Operator, Plan, Task, plan


def steps(found: Plan | NoPlan) -> list[str]:
    return [str(task) for task in found.tasks]


# Loops and depth --------------------------------------------------------------------------------

WAIT = Domain.of(
    [Operator("wait", effects=lambda facts: {"n": facts.get("n", 0) + 1}), Operator("go", lambda f: f.get("n") == 3)],
    {
        "idle": [Method("again", lambda facts: [Task("idle"), Task("wait")]), Method("enough", lambda facts: [])],
        "all": [Method("idle, then go", lambda facts: [Task("idle"), Task("go")])],
    },
)


def test_loops_are_pruned_first_and_explored_by_depth_afterwards() -> None:
    """``idle`` must be its own ancestor three times, each time in the first state, for three waits to follow."""
    found = plan(WAIT, {}, Task("all"))
    assert steps(found) == ["wait()", "wait()", "wait()", "go()"]
    assert is_executable(WAIT, {}, found)


def test_unhashable_arguments_are_planned_without_comparison() -> None:
    domain = Domain.of([Operator("go")], {"visit": [Method("go", lambda facts, places: [Task("go", (places,))])]})
    assert steps(plan(domain, {}, Task("visit", (["A", "B"],)))) == ["go(['A', 'B'])"]


def down(facts: FactsLike, n: int) -> list[Task]:
    return [Task("look"), Task("down", (n - 1,)), Task("up")]


DEEP = Domain.of(
    [Operator("up")],
    {
        "down": [Method("floor", lambda facts, n: [], lambda facts, n: n == 0), Method("down", down)],
        "look": [Method("look", lambda facts: [])],
    },
)


def test_a_deep_plan_is_compared_copied_and_shown_without_recursion() -> None:
    found = plan(DEEP, {}, Task("down", (5000,)))
    assert isinstance(found, Plan)
    assert pickle.loads(pickle.dumps(found)) == found
    assert str(plan(DEEP, {}, Task("down", (1,)))).splitlines() == [
        "down(1) by down", "  look() by look", "  down(0) by floor", "  up()",
    ]  # fmt: skip


# Cost -------------------------------------------------------------------------------------------

ROUTES = (("A", "B"), ("A", "C"), ("C", "B"), ("C", "D"), ("B", "D"))


def legs(facts: FactsLike, goal: str) -> Iterator[list[Task]]:
    for origin, target in ROUTES:
        if origin == facts.get("at"):
            yield [Task("sail", (origin, target)), Task("reach", (goal,))]


SEA = Domain.of(
    [Operator("sail", effects=lambda facts, origin, target: {"at": target})],
    {
        "reach": [
            Method("there", lambda facts, goal: [], lambda facts, goal: facts.get("at") == goal),
            Method("by sea", legs),
        ]
    },
)


def test_tasks_in_order_are_one_plan_with_several_roots() -> None:
    found = plan(SEA, {"at": "A"}, [Task("reach", ("C",)), Task("reach", ("B",))])
    assert [node.task.args for node in found.nodes if node.parent == -1] == [("C",), ("B",)]
    assert steps(plan(SEA, {}, [])) == []


# Faults of domains ------------------------------------------------------------------------------


def test_all_faults_of_a_domain_are_reported_together() -> None:
    with pytest.raises(PlanningError) as caught:
        Domain(
            {"dive": Operator("dive")},
            {
                "dive": (Method.fixed("itself"),),
                "survey": (),
                "explore": (Method.fixed("misspelt", "dvie"),),
                "a": (Method.fixed("on", "dive", "b"),),
                "b": (Method.fixed("back", "a"),),
            },
        )
    text = str(caught.value)
    for part in (
        "these are both: dive",
        "these have none: survey",
        "method 'misspelt' of task explore uses dvie, not in the domain, which has: a, b, dive",
    ):
        assert part in text


def test_a_method_with_undeclared_subtasks_is_an_error() -> None:
    domain = Domain.of(
        [Operator("dive"), Operator("climb")], {"move": [Method("down", lambda facts: [Task("climb")], uses=("dive",))]}
    )
    with pytest.raises(PlanningError, match=r"'down' of task move\(\) uses climb, and declares only: dive"):
        plan(domain, {}, Task("move"))
