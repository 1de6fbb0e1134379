"""What an HDDL domain and problem say (Höller et al., AAAI 2020), as values: total order, conditions of first order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

OBJECT = "object"
"""The type of everything."""
EQUAL = "="


@dataclass(frozen=True, slots=True)
class TypedParameter:
    """A variable or object, and the types of which it is one."""

    name: str
    types: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Atom:
    """A predicate, or ``=``, and its terms; variables begin with a question mark."""

    predicate: str
    terms: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Not:
    """True if ``formula`` is false."""

    formula: Formula


@dataclass(frozen=True, slots=True)
class Several:
    """True if all of ``formulas`` are true (``is_all``), or one of them."""

    formulas: tuple[Formula, ...]
    is_all: bool


@dataclass(frozen=True, slots=True)
class Quantified:
    """True if ``formula`` is true for all objects (``is_all``), or for one."""

    parameters: tuple[TypedParameter, ...]
    formula: Formula
    is_all: bool


Formula = Atom | Not | Several | Quantified
TRUE: Formula = Several((), True)


@dataclass(frozen=True, slots=True)
class Effect:
    """An atom that becomes true, or false, for all objects in ``parameters`` that meet ``condition``."""

    parameters: tuple[TypedParameter, ...]
    condition: Formula
    atom: Atom
    is_added: bool


@dataclass(frozen=True, slots=True)
class Action:
    """An elementary task."""

    name: str
    parameters: tuple[TypedParameter, ...]
    precondition: Formula
    effects: tuple[Effect, ...]


@dataclass(frozen=True, slots=True)
class Subtask:
    """A task with terms, as it stands in a method or a problem."""

    name: str
    terms: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class MethodSpec:
    """A way to decompose ``task``."""

    name: str
    parameters: tuple[TypedParameter, ...]
    task: Subtask
    precondition: Formula
    subtasks: tuple[Subtask, ...]


@dataclass
class DomainSpec:
    """A domain file; tables by name. ``is_linearised``: subtasks that it leaves unordered were put in order."""

    types: dict[str, tuple[str, ...]] = field(default_factory=dict)
    constants: dict[str, TypedParameter] = field(default_factory=dict)
    predicates: dict[str, tuple[TypedParameter, ...]] = field(default_factory=dict)
    tasks: dict[str, tuple[TypedParameter, ...]] = field(default_factory=dict)
    actions: dict[str, Action] = field(default_factory=dict)
    methods: list[MethodSpec] = field(default_factory=list)
    is_linearised: bool = False


@dataclass
class ProblemSpec:
    """A problem file; ``is_linearised`` as of a domain."""

    objects: dict[str, TypedParameter] = field(default_factory=dict)
    facts: list[Atom] = field(default_factory=list)
    parameters: tuple[TypedParameter, ...] = ()
    tasks: tuple[Subtask, ...] = ()
    constraints: Formula = TRUE
    goal: Formula = TRUE
    is_linearised: bool = False


def conjuncts(formula: Formula) -> tuple[Formula, ...]:
    """The formulas that must all be true."""
    if isinstance(formula, Several) and formula.is_all:
        return tuple(inner for part in formula.formulas for inner in conjuncts(part))
    return (formula,)


def above(types: Mapping[str, tuple[str, ...]], name: str) -> set[str]:
    """The type ``name`` and all types above it."""
    found: set[str] = set()
    due = [name]
    while due:
        one = due.pop()
        if one not in found:
            found.add(one)
            due += types.get(one, ())
    return found | {OBJECT}
