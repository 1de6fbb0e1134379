"""An HDDL domain as a ``Domain``: methods bind their variables lazily, from facts that are asked for by pattern."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from remoras.htn.domain import Decomposition, Domain, Method, Operator, Task
from remoras.htn.facts import ANY, Facts
from remoras.htn.hddl.conditions import Env, Keys, Slots, Test
from remoras.htn.hddl.language import (
    EQUAL,
    OBJECT,
    Action,
    Atom,
    DomainSpec,
    Formula,
    MethodSpec,
    Not,
    Parameter,
    Several,
    above,
    conjuncts,
)
from remoras.htn.hddl.necessity import Needs, needs_of_methods


class ObjectsByType:
    """The objects of a problem by their types, in the order of the files."""

    def __init__(self, domain: DomainSpec, objects: Sequence[Parameter]) -> None:
        self._found: dict[str, dict[str, None]] = {}
        for one in objects:
            for name in {OBJECT, *(up for kind in one.types for up in above(domain.types, kind))}:
                self._found.setdefault(name, {})[one.name] = None

    def __call__(self, types: tuple[str, ...]) -> tuple[str, ...]:
        """Objects of one of these types."""
        if len(types) == 1:
            return tuple(self._found.get(types[0], ()))
        return tuple(dict.fromkeys(one for kind in types for one in self._found.get(kind, ())))

    def frozen(self, types: tuple[str, ...]) -> frozenset[str]:
        """The same as a set."""
        return frozenset(self(types))


def ground(spec: DomainSpec, objects: ObjectsByType) -> Domain:
    """The domain, for the objects of one problem."""
    needs = needs_of_methods(spec, objects.frozen)
    methods: dict[str, list[Method]] = {name: [] for name in spec.tasks}
    for one in spec.methods:
        methods[one.task.name].append(_Binding(one, needs[one.name], objects).method())
    return Domain.of([_operator(action, objects) for action in spec.actions.values()], methods)


def _operator(action: Action, objects: ObjectsByType) -> Operator:
    slots = Slots(action.parameters, objects)
    kinds = [objects.frozen(one.types) for one in action.parameters]
    test = slots.test(action.precondition)
    effects = []
    for one in sorted(action.effects, key=lambda one: one.is_added):  # what is added stays, where both is said
        with slots.scope(one.parameters) as every:
            condition = slots.test(one.condition) if conjuncts(one.condition) else None
            value = True if one.is_added else None
            effects.append((every if one.parameters else None, condition, slots.key(one.atom), value))

    def applicable(facts: Facts, *args: str) -> bool:
        for arg, kind in zip(args, kinds, strict=True):
            if arg not in kind:
                return False
        return test(facts, slots.env(args))

    def changes(facts: Facts, *args: str) -> dict[Any, Any]:
        env = slots.env(args)
        found: dict[Any, Any] = {}
        for every, condition, key, value in effects:
            for bound in (env,) if every is None else every(env):
                if condition is None or condition(facts, bound):
                    found[key(bound)] = value
        return found

    return Operator(action.name, applicable, changes)


class _Match:
    """Binds the variables of an atom to each fact that fits."""

    def __init__(self, key: Keys, bound: Sequence[tuple[int, int, frozenset[str]]]) -> None:
        self._key, self._bound = key, bound

    def __call__(self, facts: Facts, env: Env) -> Iterator[Env]:
        for found in facts.match(self._key(env)):
            now = env.copy()
            for place, slot, kind in self._bound:
                value = found[place]
                if value not in kind or (now[slot] is not ANY and now[slot] != value):
                    break
                now[slot] = value
            else:
                yield now


class _Enumerate:
    """Binds a variable to each object of its type."""

    def __init__(self, slot: int, values: Sequence[str]) -> None:
        self._slot, self._values = slot, values

    def __call__(self, facts: Facts, env: Env) -> Iterator[Env]:
        for value in self._values:
            now = env.copy()
            now[self._slot] = value
            yield now


Source = Callable[[Facts, Env], Iterable[Env]]
_Stage = tuple[Source, tuple[Test, ...]]
"""Binds one variable or several; and what can be tested then."""


class _Binding:
    """Binds the variables of one method.

    Conditions are put in order once: those that are bound first, then the atom with the fewest free variables, then
    the objects of a type. A variable that no subtask has is bound once only.
    """

    def __init__(self, spec: MethodSpec, needs: Needs, objects: ObjectsByType) -> None:
        self._spec = spec
        self._objects = objects
        self._slots = Slots(spec.parameters, objects)
        self._kinds = {one.name: objects.frozen(one.types) for one in spec.parameters}
        self._head = [self._slots.slot(term) for term in spec.task.terms]
        self._head_kinds = [self._kinds.get(term, frozenset({term})) for term in spec.task.terms]
        found = dict.fromkeys(conjuncts(spec.precondition))
        for predicate, terms, is_true in sorted(needs):
            atom = Atom(predicate, tuple(map(str, terms)))
            found.setdefault(atom if is_true else Not(atom))
        self._stages = self._in_order(list(found))
        self._subtasks = [(one.name, [self._slots.slot(term) for term in one.terms]) for one in spec.subtasks]
        free = {term for one in spec.subtasks for term in one.terms if term.startswith("?")}
        self._is_witnessed_once = free.issuperset(self._kinds.keys() - set(spec.task.terms))

    def method(self) -> Method:
        """The method, lazy in its bindings."""
        return Method(self._spec.name, self._decompositions, uses=tuple(dict.fromkeys(n for n, _ in self._subtasks)))

    def _decompositions(self, facts: Facts, *args: str) -> Iterator[Decomposition]:
        env = self._slots.env(())
        for slot, kind, value in zip(self._head, self._head_kinds, args, strict=True):
            if value not in kind or (env[slot] is not ANY and env[slot] != value):
                return
            env[slot] = value
        seen: set[tuple[Task, ...]] = set()
        for bound in self._bound(facts, env, 0):
            tasks = [Task(name, tuple([bound[slot] for slot in slots])) for name, slots in self._subtasks]
            if not self._is_witnessed_once:
                if tuple(tasks) in seen:
                    continue
                seen.add(tuple(tasks))
            yield tasks

    def _bound(self, facts: Facts, env: Env, stage: int) -> Iterator[Env]:
        source, tests = self._stages[stage]
        is_last = stage + 1 == len(self._stages)
        for now in source(facts, env):
            for test in tests:
                if not test(facts, now):
                    break
            else:
                if is_last:
                    yield now
                else:
                    yield from self._bound(facts, now, stage + 1)

    def _in_order(self, conditions: list[Formula]) -> list[_Stage]:
        bound = {term for term in self._spec.task.terms if term.startswith("?")}
        stages: list[_Stage] = []
        source: Source = lambda facts, env: (env,)  # noqa: E731
        left = conditions
        while True:
            stages.append((source, tuple(self._slots.test(one) for one in left if self._free(one) <= bound)))
            left = [one for one in left if not self._free(one) <= bound]
            atoms = [one for one in left if isinstance(one, Atom) and one.predicate != EQUAL]
            if atoms:
                atom = min(atoms, key=lambda one: len(self._free(one) - bound))
                source = self._match(atom, bound)
                left = [one for one in left if one is not atom]
                bound |= self._free(atom)
            elif (missing := next((one for one in self._spec.parameters if one.name not in bound), None)) is not None:
                source = _Enumerate(self._slots.slot(missing.name), self._objects(missing.types))
                bound.add(missing.name)
            else:
                return stages

    def _match(self, atom: Atom, bound: set[str]) -> _Match:
        places = [(place + 1, self._slots.slot(term), self._kinds[term])
                  for place, term in enumerate(atom.terms) if term.startswith("?") and term not in bound]  # fmt: skip
        return _Match(self._slots.key(atom), places)

    def _free(self, formula: Formula) -> set[str]:
        """The method's variables in a condition."""
        return {name for name in self._kinds if name in _terms(formula)}


def _terms(formula: Formula) -> set[str]:
    match formula:
        case Atom(_, terms):
            return set(terms)
        case Not(inner):
            return _terms(inner)
        case Several(formulas, _):
            return {term for one in formulas for term in _terms(one)}
        case _:
            return _terms(formula.formula) - {one.name for one in formula.parameters}
