"""Hierarchical task networks: missions, objectives and activities as tasks (Erol, Hendler, Nau 1994).

An *abstract* task has methods, tried in the order in which the domain lists them; a method turns it into a
sequence of tasks. An *elementary* task has an operator: a test and the facts that it makes true. ``plan``
searches depth first, left to right, and backtracks; it returns a ``Plan`` or a ``NoPlan``.

Facts are a read-only mapping from keys to values (``facts.get(key)``). The planner notes every key that the
search looked up: those are the facts the plan *rests on*. If one of them changes, another plan may come
out; if none does, the same plan does. Facts made true by operators live in a layer above with an undo
log, so a step costs the same whatever the number of facts.

There is no global domain and no state between calls: any number of planners may run side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from remoras.errors import PlanningError

Key = Hashable
MISSING = object()


class Task(NamedTuple):
    """A task: its name and its arguments, for example ``Task("Exploring", ("left",))``."""

    name: str
    args: tuple[Any, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}({', '.join(str(argument) for argument in self.args)})"


class FactsLike(Protocol):
    """Anything that answers ``get(key, default)``."""

    def get(self, key: Any, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it is not known."""
        ...


class Facts:
    """Facts as the search sees them: those given, those made true on the way, and a note of what was read."""

    def __init__(self, given: FactsLike) -> None:
        self._given = given
        self._made: dict[Key, Any] = {}
        self.read: set[Any] = set()

    def get(self, key: Key, default: Any = None) -> Any:
        """The value of a fact; a key that is not made true on the way is noted as read."""
        value = self._made.get(key, MISSING)
        if value is not MISSING:
            return value
        self.read.add(key)
        return self._given.get(key, default)

    def make_true(self, effects: Mapping[Key, Any]) -> list[tuple[Key, Any]]:
        """Apply ``effects``; returns the log that ``undo`` takes."""
        undo = [(key, self._made.get(key, MISSING)) for key in effects]
        self._made.update(effects)
        return undo

    def undo(self, log: Sequence[tuple[Key, Any]]) -> None:
        """Take back what ``make_true`` applied; the last effects first."""
        for key, value in reversed(log):
            if value is MISSING:
                del self._made[key]
            else:
                self._made[key] = value


@dataclass(frozen=True, slots=True)
class Method:
    """One way to achieve an abstract task: ``subtasks(facts, *args)`` if ``applicable(facts, *args)``."""

    name: str
    subtasks: Callable[..., Sequence[Task]]
    applicable: Callable[..., bool] = field(default=lambda facts, *args: True)


@dataclass(frozen=True, slots=True)
class Operator:
    """An elementary task: possible if ``applicable(facts, *args)``, makes ``effects(facts, *args)`` true."""

    name: str
    applicable: Callable[..., bool] = field(default=lambda facts, *args: True)
    effects: Callable[..., Mapping[Key, Any]] = field(default=lambda facts, *args: {})


@dataclass(frozen=True)
class Domain:
    """Operators and methods by task name; raises PlanningError if a task has both, or no method."""

    operators: Mapping[str, Operator]
    methods: Mapping[str, tuple[Method, ...]]

    def __post_init__(self) -> None:
        both = sorted(self.operators.keys() & self.methods.keys())
        if both:
            raise PlanningError(f"tasks are elementary or abstract, these are both: {', '.join(both)}")
        empty = sorted(name for name, methods in self.methods.items() if not methods)
        if empty:
            raise PlanningError(f"abstract tasks need a method, these have none: {', '.join(empty)}")

    @classmethod
    def of(cls, operators: Sequence[Operator], methods: Mapping[str, Sequence[Method]]) -> Domain:
        """A domain of operators and of methods by task; raises PlanningError if a task has two operators."""
        names = [operator.name for operator in operators]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise PlanningError(f"an elementary task has one operator, these have several: {', '.join(twice)}")
        return cls(
            {operator.name: operator for operator in operators},
            {name: tuple(alternatives) for name, alternatives in methods.items()},
        )


@dataclass(frozen=True, slots=True)
class Step:
    """An elementary task of a plan and the abstract tasks it came from, outermost first."""

    task: Task
    ancestors: tuple[Task, ...]
    methods: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """Elementary tasks in order, and the keys of all facts that the search looked up."""

    steps: tuple[Step, ...]
    rests_on: frozenset[Any]

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The elementary tasks in order."""
        return tuple(step.task for step in self.steps)


@dataclass(frozen=True, slots=True)
class NoPlan:
    """No decomposition of ``task`` exists; ``dead_ends`` are the tasks at which the search turned back."""

    task: Task
    rests_on: frozenset[Any]
    dead_ends: tuple[Task, ...]


class _Origin(NamedTuple):
    """Where a task comes from: the abstract task above it and the method that was taken, as a linked list."""

    task: Task
    method: str
    above: _Origin | None


class _Open(NamedTuple):
    """Tasks still to be done, as a linked list."""

    task: Task
    origin: _Origin | None
    rest: _Open | None


class _Choice(NamedTuple):
    """Where to go on after a dead end: another method of ``agenda.task``, with the world as it was."""

    agenda: _Open
    next_method: int
    n_steps: int
    n_undo: int


def _step(task: Task, origin: _Origin | None) -> Step:
    ancestors: list[Task] = []
    methods: list[str] = []
    while origin is not None:
        ancestors.append(origin.task)
        methods.append(origin.method)
        origin = origin.above
    return Step(task, tuple(reversed(ancestors)), tuple(reversed(methods)))


def _subtasks(method: Method, facts: Facts, task: Task) -> Sequence[Task]:
    subtasks = method.subtasks(facts, *task.args)
    if not isinstance(subtasks, list | tuple) or not all(isinstance(subtask, Task) for subtask in subtasks):
        raise PlanningError(f"method {method.name!r} of task {task} must return a list of tasks, not {subtasks!r}")
    return subtasks


def plan(domain: Domain, facts: FactsLike, task: Task, max_expansions: int = 100_000) -> Plan | NoPlan:
    """Decompose ``task`` into elementary tasks.

    Args:
        domain: operators and methods.
        facts: what is known; only looked up, never changed.
        task: the mission or objective to plan.
        max_expansions: bound on the tasks looked at; reaching it is a PlanningError, not a NoPlan.

    Returns:
        The first plan found, methods in the domain's order; or NoPlan.

    Raises:
        PlanningError: a task is not in the domain, or the bound is reached.

    >>> domain = Domain.of([Operator("dive"), Operator("map")], {"survey": [
    ...     Method("deep", lambda facts: [Task("dive"), Task("map")], lambda facts: facts.get("deep"))]})
    >>> [str(task) for task in plan(domain, {"deep": True}, Task("survey")).tasks]
    ['dive()', 'map()']
    >>> plan(domain, {}, Task("survey")).rests_on
    frozenset({'deep'})
    """
    view = Facts(facts)
    steps: list[tuple[Task, _Origin | None]] = []
    undo_logs: list[Sequence[tuple[Key, Any]]] = []
    choices: list[_Choice] = []
    dead_ends: list[Task] = []
    agenda: _Open | None = _Open(task, None, None)
    next_method = 0
    # One loop in place of recursion: a plan may be deeper than Python's stack, and after a dead end steps and effects
    # are undone together. The cases stand side by side since they share agenda, steps, logs and choices.
    for _ in range(max_expansions):
        if agenda is None:
            return Plan(tuple(_step(*step) for step in steps), frozenset(view.read))
        current, origin, rest = agenda
        if (operator := domain.operators.get(current.name)) is not None:
            if operator.applicable(view, *current.args):
                undo_logs.append(view.make_true(operator.effects(view, *current.args)))
                steps.append((current, origin))
                agenda = rest
                continue
        elif (alternatives := domain.methods.get(current.name)) is not None:
            chosen = next(
                (
                    index
                    for index in range(next_method, len(alternatives))
                    if alternatives[index].applicable(view, *current.args)
                ),
                None,
            )
            if chosen is not None:
                choices.append(_Choice(agenda, chosen + 1, len(steps), len(undo_logs)))
                method = alternatives[chosen]
                below = _Origin(current, method.name, origin)
                for subtask in reversed(_subtasks(method, view, current)):
                    rest = _Open(subtask, below, rest)
                agenda, next_method = rest, 0
                continue
        else:
            known = sorted(domain.operators.keys() | domain.methods.keys())
            raise PlanningError(f"task {current} is not in the domain, which has: {', '.join(known)}")
        dead_ends.append(current)
        if not choices:
            return NoPlan(task, frozenset(view.read), tuple(dead_ends))
        agenda, next_method, n_steps, n_undo = choices.pop()
        del steps[n_steps:]
        while len(undo_logs) > n_undo:
            view.undo(undo_logs.pop())
    raise PlanningError(f"no plan for {task} within {max_expansions} expansions")
