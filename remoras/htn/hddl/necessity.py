"""What must hold before a task for any way of doing it to succeed: methods are tried only for bindings that meet this.

A literal that a subtask needs must hold already when the method is chosen, unless something that comes before that
subtask can bring it about. What every method of a task needs, the task needs. Both are found together, from above: a
task needs everything until one of its methods is known to end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from remoras.htn.hddl.language import EQUAL, Action, Atom, DomainSpec, Formula, MethodSpec, Not, conjuncts


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
    for one in conjuncts(formula):
        atom = one.formula if isinstance(one, Not) else one
        if isinstance(atom, Atom) and atom.predicate != EQUAL:
            yield Literal(atom.predicate, atom.terms, isinstance(one, Atom))


class _Change(NamedTuple):
    """What an action may make true, or false: a predicate of any of these objects."""

    predicate: str
    objects: tuple[frozenset[str], ...]
    is_true: bool


def _changes(action: Action, objects: Objects) -> Iterable[_Change]:
    for effect in action.effects:
        kinds = {one.name: objects(one.types) for one in (*action.parameters, *effect.parameters)}
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
    tasks: dict[str, Needs | None] = dict.fromkeys(domain.tasks)
    for name, action in domain.actions.items():
        places: dict[str, str | int] = {one.name: place for place, one in enumerate(action.parameters)}
        tasks[name] = _over(literals(action.precondition), places)
    methods: dict[str, Needs | None] = {}
    changes = True
    while changes:
        changes = False
        for method in domain.methods:
            found = _needs(method, tasks, reach, objects)
            if found is None or found == methods.get(method.name):
                continue
            methods[method.name] = found
            changes = True
        for name in domain.tasks:
            known = [
                _over(needs, _places(method))
                for method in domain.methods
                if method.task.name == name and (needs := methods.get(method.name)) is not None
            ]
            tasks[name] = frozenset.intersection(*known) if known else None
    return {method.name: methods.get(method.name) or frozenset() for method in domain.methods}


def _needs(
    method: MethodSpec,
    tasks: Mapping[str, Needs | None],
    reach: Mapping[str, frozenset[_Change]],
    objects: Objects,
) -> Needs | None:
    """What a method needs; None if it has a subtask of which no way to end it is known yet."""
    kinds = {one.name: objects(one.types) for one in method.parameters}
    found = set(literals(method.precondition))
    before: set[_Change] = set()
    for subtask in method.subtasks:
        needs = tasks[subtask.name]
        if needs is None:
            return None
        for need in needs:
            terms = tuple(subtask.terms[term] if isinstance(term, int) else term for term in need.terms)
            which = [kinds.get(term, frozenset({term})) for term in terms]
            if not any(_brings_about(change, need, which) for change in before):
                found.add(Literal(need.predicate, terms, need.is_true))
        before |= reach[subtask.name]
    return frozenset(found)


def _brings_about(change: _Change, need: Literal, which: Iterable[frozenset[str]]) -> bool:
    return (
        change.predicate == need.predicate
        and change.is_true == need.is_true
        and all(not one.isdisjoint(other) for one, other in zip(change.objects, which, strict=True))
    )


def _places(method: MethodSpec) -> dict[str, str | int]:
    return {term: place for place, term in enumerate(method.task.terms) if term.startswith("?")}


def _over(found: Iterable[Literal], places: Mapping[str, str | int]) -> Needs:
    """Those literals that speak only of objects and of arguments of the task."""
    return frozenset(
        Literal(one.predicate, tuple(places.get(str(term), term) for term in one.terms), one.is_true)
        for one in found
        if all(term in places or not str(term).startswith("?") for term in one.terms)
    )
