"""What must hold before a task for any way of doing it to succeed: methods are tried only for bindings that meet this.

A literal that a subtask needs must hold already when the method is chosen, unless something that comes before that
subtask can bring it about. What every method of a task needs, the task needs; left aside are methods that cannot be
taken where the subtask stands, since what comes before it certainly makes their precondition false. Both are found
together, from above: a task needs everything until one of its methods is known to end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from remoras.htn.hddl.language import (
    EQUAL,
    TRUE,
    Action,
    Atom,
    DomainSpec,
    Formula,
    MethodSpec,
    Not,
    Subtask,
    conjuncts,
)


class Literal(NamedTuple):
    """An atom that must be true, or false; in needs of tasks a term is an object or the place of an argument."""

    predicate: str
    terms: tuple[str | int, ...]
    is_true: bool


Needs = frozenset[Literal]
Objects = Callable[[tuple[str, ...]], frozenset[str]]
"""Objects of one of several types."""


def literals(formula: Formula) -> Iterable[Literal]:
    """The literals among the conjuncts of ``formula``, without equalities."""
    for conjunct in conjuncts(formula):
        atom = conjunct.formula if isinstance(conjunct, Not) else conjunct
        if isinstance(atom, Atom) and atom.predicate != EQUAL:
            yield Literal(atom.predicate, atom.terms, isinstance(conjunct, Atom))


class _Change(NamedTuple):
    """What an action may make true, or false: a predicate of any of these objects."""

    predicate: str
    objects: tuple[frozenset[str], ...]
    is_true: bool


def _changes(action: Action, objects: Objects) -> Iterable[_Change]:
    for effect in action.effects:
        kinds = {parameter.name: objects(parameter.types) for parameter in (*action.parameters, *effect.parameters)}
        which = tuple(kinds.get(term, frozenset({term})) for term in effect.atom.terms)
        yield _Change(effect.atom.predicate, which, effect.is_added)


def _reach(domain: DomainSpec, objects: Objects) -> dict[str, frozenset[_Change]]:
    """For every task what the actions that it may lead to change."""
    reach = {name: frozenset(_changes(action, objects)) for name, action in domain.actions.items()}
    reach |= {name: frozenset() for name in domain.tasks}
    grows = True
    while grows:
        grows = False
        for method in domain.methods:
            found = reach[method.task.name].union(*(reach[subtask.name] for subtask in method.subtasks))
            if found != reach[method.task.name]:
                reach[method.task.name] = found
                grows = True
    return reach


def needs_of_methods(domain: DomainSpec, objects: Objects) -> dict[str, Needs]:
    """For every method, by name, the literals over its variables that must hold when it is chosen."""
    reach = _reach(domain, objects)
    actions = {}
    for name, action in domain.actions.items():
        places: dict[str, str | int] = {parameter.name: place for place, parameter in enumerate(action.parameters)}
        actions[name] = over_arguments(literals(action.precondition), places)
    possible = {method.name: tuple(_possible(method, domain, reach, objects)) for method in domain.methods}
    methods: dict[str, Needs] = {}
    changes = True
    while changes:
        changes = False
        tasks = {
            method.name: over_arguments(methods[method.name], argument_places(method))
            for method in domain.methods
            if method.name in methods
        }
        for method in domain.methods:
            subtasks = []
            for subtask, ways in zip(method.subtasks, possible[method.name], strict=True):
                known = [tasks[way] for way in ways if way in tasks]
                needs = frozenset.intersection(*known) if known else None
                subtasks.append(actions.get(subtask.name, needs))
            found = _needs(method, subtasks, reach, objects)
            if found is not None and found != methods.get(method.name):
                methods[method.name] = found
                changes = True
    return {method.name: methods.get(method.name, frozenset()) for method in domain.methods}


def _needs(
    method: MethodSpec,
    subtasks: Sequence[Needs | None],
    reach: Mapping[str, frozenset[_Change]],
    objects: Objects,
) -> Needs | None:
    """What a method needs, by what its subtasks need; None if no way to end one of them is known yet."""
    kinds = {parameter.name: objects(parameter.types) for parameter in method.parameters}
    found = set(literals(method.precondition))
    before: set[_Change] = set()
    for subtask, needs in zip(method.subtasks, subtasks, strict=True):
        if needs is None:
            return None
        for need in needs:
            one = of_method(need, subtask)
            if not any(_brings_about(change, one, _which(one, kinds)) for change in before):
                found.add(one)
        before |= reach[subtask.name]
    return frozenset(found)


def _possible(
    method: MethodSpec, domain: DomainSpec, reach: Mapping[str, frozenset[_Change]], objects: Objects
) -> Iterator[tuple[str, ...]]:
    """For every subtask the names of its methods that may be taken where it stands; none of an action."""
    kinds = {parameter.name: objects(parameter.types) for parameter in method.parameters}
    certain = set(literals(method.precondition))
    for subtask in method.subtasks:
        yield tuple(
            way.name
            for way in domain.methods
            if way.task.name == subtask.name
            and not any(
                _opposite(of_method(one, subtask)) in certain
                for one in over_arguments(literals(way.precondition), argument_places(way))
            )
        )
        changes = reach[subtask.name]
        certain = {
            one
            for one in certain
            if not any(_brings_about(each, _opposite(one), _which(one, kinds)) for each in changes)
        }
        if subtask.name in domain.actions:
            certain |= {of_method(one, subtask) for one in _certain(domain.actions[subtask.name], objects)}


def _certain(action: Action, objects: Objects) -> Needs:
    """What holds after an action whatever its arguments; where it may add and delete one atom, the atom is added."""
    places: dict[str, str | int] = {parameter.name: place for place, parameter in enumerate(action.parameters)}
    kinds = {parameter.name: objects(parameter.types) for parameter in action.parameters}
    added = [change for change in _changes(action, objects) if change.is_true]
    found = []
    for effect in action.effects:
        one = Literal(effect.atom.predicate, effect.atom.terms, effect.is_added)
        is_undone = any(_brings_about(change, _opposite(one), _which(one, kinds)) for change in added)
        if not effect.parameters and effect.condition == TRUE and (effect.is_added or not is_undone):
            found.append(one)
    return over_arguments(found, places)


def _opposite(one: Literal) -> Literal:
    return one._replace(is_true=not one.is_true)


def of_method(need: Literal, subtask: Subtask) -> Literal:
    """What a subtask needs, over the terms that the method gives it."""
    return need._replace(terms=tuple(subtask.terms[term] if isinstance(term, int) else term for term in need.terms))


def _which(one: Literal, kinds: Mapping[str, frozenset[str]]) -> list[frozenset[str]]:
    """What the terms of a literal may be."""
    return [kinds.get(str(term), frozenset({str(term)})) for term in one.terms]


def _brings_about(change: _Change, need: Literal, which: Iterable[frozenset[str]]) -> bool:
    return (
        change.predicate == need.predicate
        and change.is_true == need.is_true
        and all(not one.isdisjoint(other) for one, other in zip(change.objects, which, strict=True))
    )


def argument_places(method: MethodSpec) -> dict[str, str | int]:
    """The places of its task's arguments, by variable."""
    return {term: place for place, term in enumerate(method.task.terms) if term.startswith("?")}


def over_arguments(found: Iterable[Literal], places: Mapping[str, str | int]) -> Needs:
    """Those literals that speak only of objects and of arguments of the task."""
    return frozenset(
        Literal(one.predicate, tuple(places.get(str(term), term) for term in one.terms), one.is_true)
        for one in found
        if all(term in places or not str(term).startswith("?") for term in one.terms)
    )
