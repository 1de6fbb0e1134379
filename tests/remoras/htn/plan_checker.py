"""Is a plan legal? It is carried out on a copy of the facts, and its tree is held against the methods.

Nothing here is shared with the search: states are plain dictionaries.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from remoras.htn.domain import ROOT, Domain, Method, Node, Plan, Task
from remoras.htn.facts import FactsLike, Key


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is wrong with a plan.

    Attributes:
        execution: why its elementary tasks cannot be carried out; empty if they are legal.
        decomposition: why its tree is no decomposition of the tasks asked for; empty if it is one.
    """

    execution: tuple[str, ...]
    decomposition: tuple[str, ...]

    @property
    def is_valid(self) -> bool:
        """True if nothing is wrong."""
        return not self.execution and not self.decomposition

    def __str__(self) -> str:
        return "; ".join((*self.execution, *self.decomposition)) or "valid"


class _State:
    """The facts at one moment."""

    def __init__(self, given: FactsLike) -> None:
        self._given = given
        self._made: dict[Key, Any] = {}

    def get(self, key: Key, default: Any = None) -> Any:
        value = self._made[key] if key in self._made else self._given.get(key)
        return default if value is None else value

    def update(self, effects: Mapping[Key, Any]) -> None:
        self._made.update(effects)


def check_plan(domain: Domain, facts: FactsLike, tasks: Task | Sequence[Task], plan: Plan) -> Verdict:
    """Whether ``plan`` is a legal execution, and its tree a legal decomposition.

    Args:
        domain: operators and methods.
        facts: that hold at first.
        tasks: that were to be done.
        plan: to be checked; nothing but its nodes is looked at.

    >>> domain = Domain.of([], {"wait": [Method.fixed("do nothing")]})
    >>> check_plan(domain, {}, Task("wait"), Plan((Node(Task("wait"), "do nothing", ROOT),), frozenset())).is_valid
    True
    """
    wanted = [tasks] if isinstance(tasks, Task) else list(tasks)
    state = _State(facts)
    execution: list[str] = []
    decomposition = list(_misplaced(plan.nodes))
    below = _below(plan.nodes) if not decomposition else {}
    if not decomposition and (roots := below[ROOT]) != wanted:
        decomposition.append(f"the plan is for {_named(roots)}, asked for was {_named(wanted)}")
    for place, (task, method, _) in enumerate(plan.nodes):
        if method is not None:
            if below and (fault := _unlike(domain.methods.get(task.name, ()), method, task, below[place], state)):
                decomposition.append(f"node {place}: {fault}")
            continue
        operator = domain.operators.get(task.name)
        if operator is None:
            execution.append(f"node {place}: {task} is no elementary task of the domain")
        elif not operator.applicable(state, *task.args):
            execution.append(f"node {place}: {task} is not possible where it stands")
        else:
            state.update(operator.effects(state, *task.args))
    return Verdict(tuple(execution), tuple(decomposition))


def _misplaced(nodes: Sequence[Node]) -> Iterator[str]:
    """Nodes that do not stand behind the task above them and its subtasks, or below an elementary one."""
    way: list[int] = []
    for place, node in enumerate(nodes):
        while way and way[-1] != node.parent:
            way.pop()
        if node.parent != ROOT and not way:
            yield f"node {place}: {node.task} does not follow the task above it, node {node.parent}"
            return
        if node.parent != ROOT and nodes[node.parent].method is None:
            yield f"node {place}: {node.task} stands below the elementary task {nodes[node.parent].task}"
            return
        way.append(place)


def _below(nodes: Sequence[Node]) -> dict[int, list[Task]]:
    found: dict[int, list[Task]] = {place: [] for place in range(ROOT, len(nodes))}
    for node in nodes:
        found[node.parent].append(node.task)
    return found


def _unlike(methods: Sequence[Method], name: str, task: Task, below: Sequence[Task], state: _State) -> str:
    """Why the tasks ``below`` are no decomposition of ``task`` by method ``name``; empty if they are one."""
    named = [method for method in methods if method.name == name]
    if not named:
        return f"{task} has no method {name!r}, it has: {', '.join(repr(method.name) for method in methods) or 'none'}"
    possible = [method for method in named if method.applicable(state, *task.args)]
    if not possible:
        return f"method {name!r} of {task} is not possible where it stands"
    for method in possible:
        found = method.subtasks(state, *task.args)
        for tasks in [found] if isinstance(found, list | tuple) else found:
            if list(tasks) == below:
                return ""
    return f"method {name!r} does not turn {task} into {_named(below)}"


def _named(tasks: Sequence[Task]) -> str:
    return ", ".join(map(str, tasks)) or "nothing"
