"""Hierarchical task networks: what comes out of the search, and what its answer rests on."""

from typing import Any

import pytest

from remoras.errors import PlanningError
from remoras.htn import Domain, Method, NoPlan, Operator, Plan, Task, plan


def fixed(name: str, *subtasks: str, when: str | None = None) -> Method:
    """A method of a fixed sequence of tasks, applicable if the fact ``when`` is true."""
    return Method(
        name, lambda facts: [Task(subtask) for subtask in subtasks], lambda facts: when is None or bool(facts.get(when))
    )


def making(name: str, *, when: str | None = None, unless: str | None = None, **effects: Any) -> Operator:
    """An elementary task that makes ``effects`` true, possible if ``when`` holds and ``unless`` does not."""
    return Operator(
        name,
        lambda facts: (when is None or bool(facts.get(when))) and (unless is None or not facts.get(unless)),
        lambda facts: effects,
    )


def names(found: Plan | NoPlan) -> list[str]:
    return [task.name for task in found.tasks]


SURVEY = Domain.of(
    [making("dive", deep=True), making("map", when="deep"), making("surface", deep=False), making("report")],
    {
        "survey": [
            fixed("dive for it", "descend", "map", "surface", "report", when="charged"),
            fixed("stay up", "report"),
        ],
        "descend": [fixed("be there already", when="deep"), fixed("dive", "dive")],
    },
)


@pytest.mark.parametrize(
    ("facts", "task", "steps"),
    [
        ({"charged": True}, "survey", ["dive", "map", "surface", "report"]),
        ({"charged": True, "deep": True}, "survey", ["map", "surface", "report"]),
        ({"deep": True}, "descend", []),
        ({}, "survey", ["report"]),
    ],
)
def test_a_mission_is_decomposed_by_its_first_applicable_method(facts, task, steps) -> None:
    given = dict(facts)
    assert names(plan(SURVEY, given, Task(task))) == steps
    assert given == facts


def test_every_step_records_its_parent_tasks() -> None:
    found = plan(SURVEY, {"charged": True}, Task("survey"))
    dive, mapping = [node for node in found.nodes if node.method is None][:2]
    descend = found.nodes[dive.parent]
    assert (descend.task.name, descend.method) == ("descend", "dive")
    for place in (descend.parent, mapping.parent):
        assert (found.nodes[place].task.name, found.nodes[place].method) == ("survey", "dive for it")


def test_the_absence_of_a_plan_depends_on_the_facts_read() -> None:
    domain = Domain.of(
        [making("dive", when="charged"), making("sail", when="wind")],
        {"move": [fixed("below", "dive"), fixed("above", "sail")]},
    )
    found = plan(domain, {"charged": False}, Task("move"))
    assert isinstance(found, NoPlan)
    assert found.task == Task("move")
    assert found.rests_on == {"charged", "wind"}


# Faults -----------------------------------------------------------------------------------------


def test_an_unknown_task_is_named() -> None:
    with pytest.raises(PlanningError, match=r"task fly\(\) is not in the domain, which has: dive, map"):
        plan(Domain.of([Operator("map"), Operator("dive")], {}), {}, Task("fly"))


# What a plan costs, and what it rests on --------------------------------------------------------


# Planners side by side --------------------------------------------------------------------------


def test_planners_may_be_nested() -> None:
    """A condition of the fleet's plan is that the vehicle's own planner finds a plan, with facts of its own."""
    own = Domain.of([making("dive", when="charged", deep=True)], {})
    fleet = Domain.of(
        [Operator("send", lambda facts, name: isinstance(plan(own, {"charged": name == "AUV01"}, Task("dive")), Plan))],
        {"choose": [Method(name, lambda facts, name=name: [Task("send", (name,))]) for name in ("AUV00", "AUV01")]},
    )
    found = plan(fleet, {}, Task("choose"))
    assert [task.args for task in found.tasks] == [("AUV01",)]
    assert found.rests_on == frozenset()


def test_endless_recursion_is_an_error_in_bounded_memory() -> None:
    endless = Domain.of([], {"a": [Method("again", lambda facts: [Task("a")])]})
    with pytest.raises(PlanningError, match="within 200000 expansions"):
        plan(endless, {}, Task("a"))


@pytest.mark.parametrize("wrong", [None, "map", ["map"], iter(["map"]), iter([Task("map")])])
def test_a_method_that_returns_no_list_of_tasks_is_an_error(wrong: object) -> None:
    broken = Domain.of([], {"a": [Method("broken", lambda facts: wrong)]})
    with pytest.raises(PlanningError, match="'broken' of task a"):
        plan(broken, {}, Task("a"))


def test_an_elementary_task_has_one_operator() -> None:
    with pytest.raises(PlanningError, match="dive"):
        Domain.of([Operator("dive"), Operator("dive")], {})
