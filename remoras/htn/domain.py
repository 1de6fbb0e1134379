"""Domains: elementary tasks with an operator, abstract tasks with methods, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from remoras.errors import PlanningError
from remoras.htn.facts import FactsLike, Key


class Task(NamedTuple):
    """A task: its name and its arguments, for example ``Task("Exploring", ("left",))``."""

    name: str
    args: tuple[Any, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}({', '.join(str(argument) for argument in self.args)})"


Decomposition = Sequence[Task]


def always(facts: FactsLike, *args: Any) -> bool:
    """The test of what is always possible."""
    return True


def nothing(facts: FactsLike, *args: Any) -> Mapping[Key, Any]:
    """The effects of what changes no fact."""
    return {}


@dataclass(frozen=True, slots=True)
class Method:
    """Ways to achieve an abstract task, if ``applicable(facts, *args)``.

    Attributes:
        name: of the method, as it stands in plans.
        subtasks: ``subtasks(facts, *args)`` returns a list of tasks, or an iterator over such lists, one for each way
            to bind what the arguments leave open; the next is asked for only after a dead end.
        applicable: test on the facts.
        uses: names of all the tasks that it may return; None if they are not declared. What is declared is checked
            when the domain is made.
    """

    name: str
    subtasks: Callable[..., Decomposition | Iterator[Decomposition]]
    applicable: Callable[..., bool] = always
    uses: tuple[str, ...] | None = None

    @classmethod
    def fixed(cls, name: str, *subtasks: Task | str, applicable: Callable[..., bool] = always) -> Method:
        """A method whose tasks do not depend on facts or arguments; a task without arguments may be given by name."""
        tasks = [Task(subtask) if isinstance(subtask, str) else subtask for subtask in subtasks]
        return cls(name, lambda facts, *args: tasks, applicable, tuple(task.name for task in tasks))


class Expected(NamedTuple):
    """What carrying out an elementary task is expected to take: time (s) and energy (J)."""

    time_s: float = 0.0
    energy_j: float = 0.0


def at_once(facts: FactsLike, *args: Any) -> Expected:
    """The expectation of what takes neither time nor energy worth counting."""
    return Expected()


@dataclass(frozen=True, slots=True)
class Operator:
    """An elementary task: possible if ``applicable(facts, *args)``, makes ``effects(facts, *args)`` true.

    Attributes:
        name: of the task.
        applicable: test on the facts; asked by the planner, and again when the task starts.
        effects: facts by key; one that becomes None is not known any more, one that becomes ANY has some value. The
            task has ended when they hold; one without effects ends as it is carried out.
        handler: name of what carries it out; that of the task if left out.
        expected: ``expected(facts, *args)``, time and energy, asked when the task starts; None where nobody can tell.
        lasts: True if it goes on as long as the plan has it, whatever its effects.
    """

    name: str
    applicable: Callable[..., bool] = always
    effects: Callable[..., Mapping[Key, Any]] = nothing
    handler: str = ""
    expected: Callable[..., Expected | None] = at_once
    lasts: bool = False

    @property
    def handled_by(self) -> str:
        """Name of what carries it out."""
        return self.handler or self.name

    @property
    def has_effects(self) -> bool:
        """True unless it changes no fact."""
        return self.effects is not nothing


@dataclass(frozen=True)
class Domain:
    """Operators and methods by task name.

    Raises:
        PlanningError: names everything that is wrong: tasks that are both elementary and abstract, or without a
            method; methods that use a task which is not in the domain; tasks that go round in a circle for ever.
    """

    operators: Mapping[str, Operator]
    methods: Mapping[str, tuple[Method, ...]]

    def __post_init__(self) -> None:
        if faults := list(_faults(self)):
            raise PlanningError("; ".join(faults))

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

    @cached_property
    def recursive(self) -> frozenset[str]:
        """Names of the tasks that may come up below themselves; a method that declares nothing may lead to any task."""
        below = {
            name: self.methods.keys() if any(method.uses is None for method in methods) else {
                used for method in methods for used in method.uses or () if used in self.methods
            }
            for name, methods in self.methods.items()
        }  # fmt: skip
        found: set[str] = set()
        for name in below:
            met: set[str] = set()
            due = [name]
            while due and name not in met:
                for successor in below[due.pop()]:
                    if successor not in met:
                        met.add(successor)
                        due.append(successor)
            if name in met:
                found.add(name)
        return frozenset(found)

    def tasks(self) -> list[str]:
        """Names of all its tasks, sorted."""
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
    yield from (
        f"endless recursion: every method of {chain[0]} leads to {' > '.join(chain)}" for chain in _rings(domain)
    )


def _rings(domain: Domain) -> Iterator[tuple[str, ...]]:
    """For the tasks that no sequence of methods ends, a chain from each ring of them; of undeclared methods all end."""
    ends = {name for name, methods in domain.methods.items() if any(method.uses is None for method in methods)}
    ends |= domain.operators.keys()
    left = {name: methods for name, methods in domain.methods.items() if methods and name not in ends}
    while found := [
        name for name, methods in left.items() if any(ends.issuperset(method.uses or ()) for method in methods)
    ]:
        ends.update(found)
        for name in found:
            del left[name]
    told: set[str] = set()
    for start in left:
        chain: list[str] = []
        name = start
        while name in left and name not in chain and name not in told:
            chain.append(name)
            name = next((use for use in left[name][0].uses or () if use not in ends), "")
        if name in chain:
            yield (*chain[chain.index(name) :], name)
        told.update(chain)
