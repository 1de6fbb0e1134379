"""Problems after the International Planning Competition 2020: solved, legal, and what is wrong with them is caught.

``benchmarks/ipc`` has the domains, written anew; ``tests/tools/ipc.py`` plans the competition's own files.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from benchmarks.ipc.problems import KINDS, NUMBERS, problem
from remoras.htn import Node, Plan, Task, check_plan, plan
from remoras.htn.hddl import Problem
from remoras.htn.validation import Verdict

PLACES = 6
"""Steps of a plan that are spoilt, each in turn."""


def solved(read: Problem, max_expansions: int = 200_000) -> Plan:
    found = plan(read.domain, read.facts, read.tasks, goal=read.goal, max_expansions=max_expansions)
    assert isinstance(found, Plan)
    return found


def verdict(read: Problem, found: Plan) -> Verdict:
    return check_plan(read.domain, read.facts, read.tasks, found, goal=read.goal)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("kind", KINDS)
def test_five_problems_of_five_kinds_are_solved_by_legal_plans(kind: str, number: int) -> None:
    read = problem(kind, number)
    found = solved(read)
    assert str(verdict(read, found)) == "valid"
    assert found.steps


@pytest.mark.parametrize("number", NUMBERS)
def test_a_tower_of_n_rings_takes_two_to_the_n_less_one_moves(number: int) -> None:
    """M(n) = 2 M(n - 1) + 1, M(1) = 1; ``number`` + 2 rings. The moves are replayed here without any planner."""
    found = solved(problem("towers", number))
    n_rings = number + 2
    assert len(found.steps) == 2**n_rings - 1
    pegs = {"a": list(range(n_rings, 0, -1)), "b": [], "c": []}
    for task in found.tasks:
        _, _, origin, _, target = task.args
        ring = pegs[origin].pop()
        assert task.args[0] == f"r{ring}"
        assert not pegs[target] or pegs[target][-1] > ring
        pegs[target].append(ring)
    assert pegs == {"a": [], "b": [], "c": list(range(n_rings, 0, -1))}


def without(found: Plan, place: int) -> Plan:
    """The plan without the elementary task at ``place``."""
    nodes = [
        node._replace(parent=node.parent - (node.parent > place))
        for other, node in enumerate(found.nodes)
        if other != place
    ]
    return Plan(tuple(nodes), found.rests_on, cost=found.cost - 1.0)


def with_task(found: Plan, place: int, task: Task) -> tuple[Node, ...]:
    return (*found.nodes[:place], found.nodes[place]._replace(task=task), *found.nodes[place + 1 :])


def swapped(found: Plan, place: int) -> Plan | None:
    """The plan with the step at ``place`` and the next different one in each other's place."""
    task = found.nodes[place].task
    other = next((step for step in found.steps if step.place > place and step.task != task), None)
    if other is None:
        return None
    first = replace(found, nodes=with_task(found, place, other.task))
    return replace(first, nodes=with_task(first, other.place, task))


def with_another_argument(found: Plan, place: int) -> Plan | None:
    """The plan in which the last argument of the step at ``place`` is one of another step."""
    name, args = found.nodes[place].task
    others = [task.args[-1] for task in found.tasks if task.name == name and args and task.args[-1] != args[-1]]
    return replace(found, nodes=with_task(found, place, Task(name, (*args[:-1], others[0])))) if others else None


def some_steps(found: Plan) -> Iterator[int]:
    return iter([step.place for step in found.steps[:: max(1, len(found.steps) // PLACES)]])


@pytest.mark.parametrize("spoilt", [without, swapped, with_another_argument])
@pytest.mark.parametrize("kind", KINDS)
def test_a_wrong_plan_is_caught(kind: str, spoilt: Callable[[Plan, int], Plan | None]) -> None:
    read = problem(kind, 2)
    found = solved(read)
    wrong = [one for place in some_steps(found) if (one := spoilt(found, place)) is not None]
    assert len(wrong) >= 3
    assert not any(verdict(read, one).is_valid for one in wrong)


@pytest.mark.parametrize("kind", ["towers", "satellite", "childsnack"])
def test_where_methods_say_what_they_need_no_way_is_tried_in_vain(kind: str) -> None:
    """Half of the expansions are the first search's: so many as the plan has nodes, and one for the goal, suffice.

    That a satellite turns to the target of its own instrument follows only if it is seen that this has just been
    switched on, so that it cannot be calibrated already.
    """
    for number in NUMBERS:
        read = problem(kind, number)
        found = solved(read)
        assert solved(read, max_expansions=2 * len(found.nodes) + 2).nodes == found.nodes
