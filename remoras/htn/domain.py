"""Domains: operators of elementary and methods of abstract tasks. Plans: trees of tasks."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, NamedTuple, Protocol

from remoras.errors import PlanningError

Key = Hashable


class _Mark(Enum):
    ANY = "ANY"
    MISSING = "MISSING"

    def __repr__(self) -> str:
        return self.value


ANY: Final = _Mark.ANY
"""Effect value that matches any known value."""
MISSING: Final = _Mark.MISSING


class FactsLike(Protocol):
    """Any object with ``get(key, default)``."""

    def get(self, key: Any, default: Any = None, /) -> Any:
        """Return the value of a fact, or ``default`` if unknown."""


class Task(NamedTuple):
    """Task name with arguments, for example ``Task("Exploring", ("left",))``."""

    name: str
    args: tuple[Any, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}({', '.join(str(argument) for argument in self.args)})"


Decomposition = Sequence[Task]


def always(facts: FactsLike, *args: Any) -> bool:
    """Precondition that always holds."""
    return True


def nothing(facts: FactsLike, *args: Any) -> Mapping[Key, Any]:
    """Effects of an operator that changes no fact."""
    return {}


@dataclass(frozen=True, slots=True)
class Method:
    """Decomposition of an abstract task, if ``applicable(facts, *args)``.

    ``subtasks(facts, *args)`` returns a list of tasks, or an iterator over lists, one per binding of free variables,
    evaluated lazily after a dead end. ``uses`` names all possible subtasks, to be checked with the domain; or None.
    """

    name: str
    subtasks: Callable[..., Decomposition | Iterator[Decomposition]]
    applicable: Callable[..., bool] = always
    uses: tuple[str, ...] | None = None

    @classmethod
    def fixed(cls, name: str, *subtasks: Task | str, applicable: Callable[..., bool] = always) -> Method:
        """Return a method with constant subtasks; a task without arguments may be given by name."""
        tasks = [Task(subtask) if isinstance(subtask, str) else subtask for subtask in subtasks]
        return cls(name, lambda facts, *args: tasks, applicable, tuple(task.name for task in tasks))


class Expected(NamedTuple):
    """Expected time (s) and energy (J) of an elementary task."""

    time_s: float = 0.0
    energy_j: float = 0.0


def at_once(facts: FactsLike, *args: Any) -> Expected:
    """Expectation of a task with negligible time and energy."""
    return Expected()


@dataclass(frozen=True, slots=True)
class Operator:
    """Elementary task, possible if ``applicable(facts, *args)``; adds ``effects(facts, *args)``.

    ``applicable`` is evaluated by the planner, and again at the start. ``effects`` are facts by key; None: unknown from
    then on, ANY: any known value. The task ends when they hold, without effects at once; if it ``lasts``, only when the
    plan drops it. ``expected(facts, *args)`` is evaluated from the start until it is not None, which means unknown.
    """

    name: str
    applicable: Callable[..., bool] = always
    effects: Callable[..., Mapping[Key, Any]] = nothing
    expected: Callable[..., Expected | None] | None = at_once
    lasts: bool = False

    @property
    def has_effects(self) -> bool:
        """True if the operator changes facts."""
        return self.effects is not nothing


@dataclass(frozen=True)
class Domain:
    """Operators and methods by task name; raises PlanningError with all faults in them."""

    operators: Mapping[str, Operator]
    methods: Mapping[str, tuple[Method, ...]]

    def __post_init__(self) -> None:
        if faults := list(_faults(self)):
            raise PlanningError("; ".join(faults))

    @classmethod
    def of(cls, operators: Sequence[Operator], methods: Mapping[str, Sequence[Method]]) -> Domain:
        """Return a domain; raise PlanningError if a task has two operators."""
        names = [operator.name for operator in operators]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise PlanningError(f"an elementary task has one operator, these have several: {', '.join(twice)}")
        return cls(
            {operator.name: operator for operator in operators},
            {name: tuple(alternatives) for name, alternatives in methods.items()},
        )

    def tasks(self) -> list[str]:
        """Return the names of all tasks, sorted."""
        return sorted(self.operators.keys() | self.methods.keys())


def _faults(domain: Domain) -> Iterator[str]:
    both = sorted(domain.operators.keys() & domain.methods.keys())
    if both:
        yield f"tasks are elementary or abstract, these are both: {', '.join(both)}"
    empty = sorted(name for name, methods in domain.methods.items() if not methods)
    if empty:
        yield f"abstract tasks need a method, these have none: {', '.join(empty)}"
    known = set(domain.tasks())
    for task, methods in domain.methods.items():
        for method in methods:
            unknown = sorted(set(method.uses or ()) - known)
            if unknown:
                yield (
                    f"method {method.name!r} of task {task} uses {', '.join(unknown)}, not in the domain, "
                    f"which has: {', '.join(sorted(known))}"
                )


# Plans -------------------------------------------------------------------------------------------

ROOT = -1
"""Parent index of a root task."""


class Node(NamedTuple):
    """Task of a plan; ``method`` is None if elementary, ``parent`` an index."""

    task: Task
    method: str | None
    parent: int


class Step(NamedTuple):
    """Elementary task of a plan, and its node index."""

    task: Task
    place: int


@dataclass(frozen=True)
class Plan:
    """Decomposition of the root tasks: ``nodes`` in preorder; ``rests_on``: all facts read."""

    nodes: tuple[Node, ...]
    rests_on: frozenset[Any]

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Elementary tasks in order."""
        return tuple(node.task for node in self.nodes if node.method is None)

    def __str__(self) -> str:
        depths: list[int] = []
        lines = []
        for node in self.nodes:
            depths.append(0 if node.parent == ROOT else depths[node.parent] + 1)
            lines.append(f"{'  ' * depths[-1]}{node.task}{'' if node.method is None else f' by {node.method}'}")
        return "\n".join(lines)


@dataclass(frozen=True)
class NoPlan:
    """Result of a search without plan: first root task, keys of all facts read by the search."""

    task: Task
    rests_on: frozenset[Any]


# Facts -------------------------------------------------------------------------------------------


class Facts:
    """State of the search, for methods and operators: initial facts, and effects on the way."""

    def __init__(self, initial: FactsLike) -> None:
        self.read: set[Any] = set()  # keys of the initial facts
        self.trail: list[tuple[Key, Any]] = []  # key, value before the change
        self._initial = initial
        self._values: dict[Any, Any] = {}

    def get(self, key: Key, default: Any = None) -> Any:
        """Return the value of a fact; record the key as read unless set by an effect."""
        value = self._values.get(key, MISSING)
        if value is MISSING:
            value = self._values[key] = self._initial.get(key)
            self.read.add(key)
        return default if value is None else value

    def make_true(self, effects: Mapping[Key, Any]) -> None:
        """Apply ``effects``."""
        values, note = self._values, self.trail.append
        for key, value in effects.items():
            note((key, values.get(key, MISSING)))
            values[key] = value

    def undo(self, length: int) -> None:
        """Undo all changes of the trail after ``length``, last first."""
        values, trail = self._values, self.trail
        while len(trail) > length:
            key, before = trail.pop()
            if before is MISSING:
                del values[key]
            else:
                values[key] = before

    def is_as_after(self, length: int) -> bool:
        """Return whether the state equals that after ``length`` changes."""
        first: dict[Key, Any] = {}
        for key, before in self.trail[length:]:
            # The oldest entry of a key holds its value at that time.
            first.setdefault(key, before)
        for key, before in first.items():
            if before is MISSING:
                # The result depends on the initial value: another one may need another plan.
                self.read.add(key)
            if self._values[key] != (self._initial.get(key) if before is MISSING else before):
                return False
        return True


def is_met(facts: FactsLike, wanted: Iterable[tuple[Key, Any]]) -> bool:
    """True if all facts have the wanted values; False matches None too, ANY any known value."""
    for key, value in wanted:
        known = facts.get(key)
        if (known is None) if value is ANY else known if value is False else known != value:
            return False
    return True
