"""Depth-first search with backtracking; in an endless recursion, iterative deepening.

The search is a loop, since a plan may exceed Python's stack. The agenda is a linked list of open tasks. Each task taken
becomes a node, so the node list is the tree in preorder; backtracking truncates it and restores the state by a trail.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from types import GeneratorType
from typing import Any

from remoras.errors import PlanningError
from remoras.htn.domain import (
    ROOT,
    Decomposition,
    Domain,
    Facts,
    FactsLike,
    Method,
    Node,
    NoPlan,
    Operator,
    Plan,
    Task,
    always,
    nothing,
)  # fmt: skip

FIRST_DEPTH = 8
SEQUENCE = (list, tuple)
NO_OTHERS: Iterator[Decomposition] = iter(())

Agenda = tuple[Any, ...]
"""Open task: task, parent index, depth, rest of the agenda, which is None at the end."""
DEAD_END: Agenda = ()
Way = tuple[str | None, tuple[Task, ...]]
"""Decomposition: method name and its subtasks."""
_Choice = tuple[Agenda, int, Iterator[Decomposition], int, int]
"""Choice point: agenda, next method, decompositions left; lengths of nodes and trail."""


class _Search:
    """Search for one plan; it ``may_have_missed`` one if expansions or depth did not suffice."""

    def __init__(
        self,
        domain: Domain,
        facts: Facts,
        tasks: Sequence[Task],
        depth_limit: int | None,
        without: Collection[Way],
    ) -> None:
        self.nodes: tuple[Node, ...] | None = None
        self.may_have_missed = False
        self._domain = domain
        self._facts = facts
        self._depth_limit = depth_limit
        self._without = without
        # Flat lists: fewer objects mean less work for Python's garbage collector.
        self._tasks: list[Task] = []
        self._taken: list[str | None] = []
        self._parents: list[int] = []
        self._changed: list[int] = []  # lengths of the trail
        self._choices: list[_Choice] = []
        self._agenda: Agenda | None = None
        for task in reversed(tasks):
            self._agenda = task, ROOT, 0, self._agenda

    def run(self, max_expansions: int) -> int:
        """Return the number of tasks taken."""
        operator_of, agenda = self._domain.operators.get, self._agenda
        for n_expansions in range(max_expansions):
            if agenda is None:
                self.nodes = tuple(map(Node._make, zip(self._tasks, self._taken, self._parents, strict=True)))
                return n_expansions
            if (operator := operator_of(agenda[0][0])) is not None:
                agenda = self._perform(agenda, operator)
            else:
                agenda = DEAD_END if self._is_pruned(agenda) else self._decompose(agenda, 0, NO_OTHERS)
            if agenda is DEAD_END and (agenda := self._turn_back()) is DEAD_END:
                return n_expansions + 1
        self._agenda, self.may_have_missed = agenda, True
        return max_expansions

    def chain(self) -> tuple[Task, ...]:
        if not self._agenda:
            return ()
        chain, place = [self._agenda[0]], self._agenda[1]
        while place != ROOT:
            chain.append(self._tasks[place])
            place = self._parents[place]
        return tuple(reversed(chain))

    def _perform(self, agenda: Agenda, operator: Operator) -> Agenda | None:
        task, parent, _, behind = agenda
        facts, args = self._facts, task[1]
        if operator.applicable is not always and not operator.applicable(facts, *args):
            return DEAD_END
        if operator.effects is not nothing:
            facts.make_true(operator.effects(facts, *args))
        self._take(task, None, parent)
        return behind  # type: ignore[no-any-return]

    def _take(self, task: Task, method: str | None, parent: int) -> None:
        self._tasks.append(task)
        self._taken.append(method)
        self._parents.append(parent)
        self._changed.append(len(self._facts.trail))

    def _is_pruned(self, agenda: Agenda) -> bool:
        task, above, depth, _ = agenda
        if self._depth_limit is None:
            # Below an equal task in the same state, the recursion makes no progress.
            while above != ROOT and not (self._tasks[above] == task and self._facts.is_as_after(self._changed[above])):
                above = self._parents[above]
        is_pruned: bool = above != ROOT if self._depth_limit is None else depth >= self._depth_limit
        self.may_have_missed |= is_pruned
        return is_pruned

    def _decompose(self, agenda: Agenda, next_method: int, others: Iterator[Decomposition]) -> Agenda | None:
        task, parent, depth, behind = agenda
        name, args = task
        facts = self._facts
        methods = self._domain.methods.get(name)
        if methods is None:
            raise unknown_task(task, self._domain)
        # Decompositions failed as children of this task only; the same ones deeper remain allowed.
        barred = self._without if parent == ROOT else ()
        while True:
            subtasks: Any = None if others is NO_OTHERS else next(others, None)
            if subtasks is None:
                if next_method == len(methods):
                    return DEAD_END
                method = methods[next_method]
                next_method += 1
                others = NO_OTHERS
                if method.applicable is not always and not method.applicable(facts, *args):
                    continue
                tasks: Any = method.subtasks(facts, *args)
                # Exact classes first: ``isinstance`` with an abstract class is slow, and this loop runs for each task.
                if tasks.__class__ is GeneratorType or (tasks.__class__ is not list and isinstance(tasks, Iterator)):
                    others = tasks
                    continue
                subtasks = tasks
            else:
                method = methods[next_method - 1]
            if subtasks.__class__ is not list and not isinstance(subtasks, SEQUENCE):
                raise wrong_subtasks(method, task, subtasks)
            if not barred or (method.name, tuple(subtasks)) not in barred:
                break
        place = len(self._tasks)
        # Without alternatives, backtracking passes this task by: fewer choice points.
        if others is not NO_OTHERS or next_method < len(methods):
            self._choices.append((agenda, next_method, others, place, len(facts.trail)))
        self._take(task, method.name, parent)
        uses = method.uses
        for subtask in reversed(subtasks):
            if subtask.__class__ is not Task or (uses is not None and subtask[0] not in uses):
                raise wrong_subtasks(method, task, subtasks)
            behind = subtask, place, depth + 1, behind
        return behind  # type: ignore[no-any-return]

    def _turn_back(self) -> Agenda | None:
        while self._choices:
            agenda, next_method, others, n_nodes, n_trail = self._choices.pop()
            del self._tasks[n_nodes:], self._taken[n_nodes:], self._parents[n_nodes:], self._changed[n_nodes:]
            self._facts.undo(n_trail)
            next_agenda = self._decompose(agenda, next_method, others)
            if next_agenda is not DEAD_END:
                return next_agenda
        return DEAD_END


def plan(
    domain: Domain,
    facts: FactsLike,
    tasks: Task | Sequence[Task],
    *,
    max_expansions: int = 200_000,
    without: Collection[Way] = (),
) -> Plan | NoPlan:
    """Decompose tasks into elementary tasks: first plan in order of methods and decompositions.

    ``max_expansions`` limits the decomposed tasks. ``without`` excludes decompositions of the root tasks only. Raises
    PlanningError for an unknown task, or beyond the limit, with the chain of an endless recursion.

    >>> from remoras.htn.domain import Method
    >>> domain = Domain.of([Operator("dive"), Operator("map")], {"survey": [
    ...     Method("deep", lambda facts: [Task("dive"), Task("map")], lambda facts: facts.get("deep"))]})
    >>> [str(task) for task in plan(domain, {"deep": True}, Task("survey")).tasks]
    ['dive()', 'map()']
    >>> plan(domain, {}, Task("survey")).rests_on
    frozenset({'deep'})
    """
    wanted = (tasks,) if isinstance(tasks, Task) else tuple(tasks)
    view = Facts(facts)
    search = _Search(domain, view, wanted, None, without)
    # Pruning of cycles loses plans that must repeat a task in one state. So if tasks were pruned without a plan, or
    # after half of the expansions, the search restarts with depth limits 8, 16, 32 ... instead.
    left = max_expansions - search.run(max_expansions - max_expansions // 2)
    depth_limit = FIRST_DEPTH
    while search.nodes is None and search.may_have_missed and left > 0:
        view.undo(0)
        search = _Search(domain, view, wanted, depth_limit, without)
        left -= search.run(left)
        depth_limit *= 2
    rests_on = frozenset(view.read)
    if search.nodes is not None:
        return Plan(search.nodes, rests_on)
    if search.may_have_missed:
        raise endless(wanted, max_expansions, search.chain())
    return NoPlan(wanted[0], rests_on)


MAX_CHAIN = 8
"""Maximum number of tasks shown of a chain."""


def unknown_task(task: Task, domain: Domain) -> PlanningError:
    """Return the error for a task that is neither elementary nor abstract."""
    return PlanningError(f"task {task} is not in the domain, which has: {', '.join(domain.tasks())}")


def wrong_subtasks(method: Method, task: Task, subtasks: Any) -> PlanningError:
    """Return the error for ``subtasks`` that are no tasks, or undeclared."""
    if isinstance(subtasks, list | tuple) and all(isinstance(subtask, Task) for subtask in subtasks):
        undeclared = sorted({subtask.name for subtask in subtasks} - set(method.uses or ()))
        return PlanningError(
            f"method {method.name!r} of task {task} uses {', '.join(undeclared)}, and declares only: "
            f"{', '.join(method.uses or ()) or 'nothing'}"
        )
    return PlanningError(
        f"method {method.name!r} of task {task} must return a list of tasks, or an iterator over such lists, "
        f"not {subtasks!r}"
    )


def endless(tasks: Sequence[Task], max_expansions: int, chain: Sequence[Task]) -> PlanningError:
    """Return the error for an exhausted limit, with the recursion of the last chain, if any."""
    named = [number for number, task in enumerate(chain[:-1]) if task.name == chain[-1].name]
    equal = [number for number in named if chain[number] == chain[-1]]
    if named:
        hint = f"; recursion: {_arrows(chain[(equal or named)[-1] :])}, {len(chain)} levels deep"
    else:
        hint = f"; the search stood at {_arrows(chain)}" if chain else ""
    return PlanningError(f"no plan for {', '.join(map(str, tasks))} within {max_expansions} expansions{hint}")


def _arrows(chain: Sequence[Task]) -> str:
    names = [str(task) for task in chain]
    if len(names) > MAX_CHAIN:
        names[MAX_CHAIN // 2 : -MAX_CHAIN // 2] = ["..."]
    return " > ".join(names)
