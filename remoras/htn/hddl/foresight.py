"""What tasks will have true, and what they may make true, whatever way is taken: found without grounding.

*Landmarks* become true while a task is carried out, after Höller and Bercher (Landmark generation in HTN planning,
AAAI 2021): of an action its precondition and effects; of a method its precondition and the landmarks of its subtasks;
of a task what all its methods have in common. They are found from above: a task has every landmark until one of
its methods is known to end. Literals speak of arguments and objects; what a method leaves open is left out.

What a task *may make* true is found from below: what its actions add. A method that asks that an argument equals an
object makes nothing where it does not. What a method leaves open may be any object.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple

from remoras.htn.best_first import Landmark
from remoras.htn.domain import Task
from remoras.htn.facts import ANY, Pattern
from remoras.htn.hddl.conditions import simplified
from remoras.htn.hddl.grounding import ObjectsByType
from remoras.htn.hddl.language import EQUAL, TRUE, Action, Atom, DomainSpec, Formula, MethodSpec, conjuncts
from remoras.htn.hddl.necessity import Literal, Needs, argument_places, of_method, over_arguments


class _Making(NamedTuple):
    """An atom that may be made true: terms are objects, places of arguments, or anything (None); guards are equalities
    that arguments must keep to."""

    predicate: str
    terms: tuple[str | int | None, ...]
    guards: frozenset[tuple[int, str]]


class Foresight:
    """What is known of the tasks of a domain before any is planned.

    Args:
        domain: as it was read.
        objects: by type.
    """

    def __init__(self, domain: DomainSpec, objects: ObjectsByType) -> None:
        self._domain = domain
        self._objects = objects

    def landmarks(self, task: Task) -> frozenset[Landmark]:
        """Facts that some action can make true, and that every way of doing the task has true once."""
        args = task.args
        return frozenset(
            ((one.predicate, *(args[term] if isinstance(term, int) else term for term in one.terms)), True)
            for one in self._of_tasks.get(task.name, ())
        )

    def may_make(self, task: Task) -> frozenset[Pattern]:
        """Patterns of the facts that some way of doing the task may make true."""
        args = task.args
        return frozenset(
            (
                making.predicate,
                *(ANY if term is None else args[term] if isinstance(term, int) else term for term in making.terms),
            )
            for making in self._makings.get(task.name, ())
            if all(args[place] == name for place, name in making.guards)
        )

    def before(self, key: Any) -> frozenset[Any]:
        """Facts that hold before any action that makes this one true."""
        found: frozenset[Any] | None = None
        for action in self._domain.actions.values():
            for effect in action.effects:
                if not effect.is_added or effect.atom.predicate != key[0]:
                    continue
                bound = dict(zip(effect.atom.terms, key[1:], strict=True))
                if any(not term.startswith("?") and term != given for term, given in bound.items()):
                    continue
                free = {parameter.name for parameter in effect.parameters}
                names = {term: given for term, given in bound.items() if term.startswith("?") and term not in free}
                needs = frozenset(
                    (one.predicate, *(names.get(str(term), term) for term in one.terms))
                    for one in self._literals(action.precondition)
                    if one.is_true
                    and one.predicate in self._made
                    and all(not str(term).startswith("?") or term in names for term in one.terms)
                )
                found = needs if found is None else found & needs
        return found or frozenset()

    @cached_property
    def _made(self) -> frozenset[str]:
        """Predicates of which actions make some true."""
        actions = self._domain.actions.values()
        return frozenset(effect.atom.predicate for action in actions for effect in action.effects if effect.is_added)

    @cached_property
    def _makings(self) -> dict[str, frozenset[_Making]]:
        """For every task, by name, what it may make true."""
        found = {name: frozenset(_added(action)) for name, action in self._domain.actions.items()}
        changes = True
        while changes:
            changes = False
            for method in self._domain.methods:
                name = method.task.name
                here = found.get(name, frozenset()).union(_passed_on(method, found))
                if here != found.get(name):
                    found[name] = here
                    changes = True
        return found

    @cached_property
    def _of_tasks(self) -> dict[str, Needs]:
        """For every task, by name, atoms over its arguments."""

        def some(formula: Formula) -> Iterator[Literal]:
            return (one for one in self._literals(formula) if one.is_true and one.predicate in self._made)

        found = {name: _of_action(action, some(action.precondition)) for name, action in self._domain.actions.items()}
        own = {method.name: frozenset(some(method.precondition)) for method in self._domain.methods}
        changes = True
        while changes:
            common: dict[str, Needs] = {}
            for method in self._domain.methods:
                if all(subtask.name in found for subtask in method.subtasks):
                    below = [of_method(one, subtask) for subtask in method.subtasks for one in found[subtask.name]]
                    here = over_arguments([*own[method.name], *below], argument_places(method))
                    common[method.task.name] = common.get(method.task.name, here) & here
            changes = any(found.get(name) != atoms for name, atoms in common.items())
            found |= common
        return found

    def _literals(self, formula: Formula) -> Iterator[Literal]:
        """The literals among the conjuncts; of what holds for all objects, that of each."""
        for conjunct in conjuncts(formula):
            try:
                found = list(simplified(conjunct, self._objects, {}))
            except ValueError:  # another condition
                continue
            yield from (Literal(atom.predicate, atom.terms, is_true) for atom, is_true in found)


def _of_action(action: Action, needed: Iterator[Literal]) -> Needs:
    places: dict[str, str | int] = {parameter.name: place for place, parameter in enumerate(action.parameters)}
    made = [
        Literal(effect.atom.predicate, effect.atom.terms, True)
        for effect in action.effects
        if effect.is_added and not effect.parameters and effect.condition == TRUE
    ]
    return over_arguments([*needed, *made], places)


def _equalities(formula: Formula) -> Iterator[tuple[str, str]]:
    """Variables that must equal an object, with it."""
    for one in conjuncts(formula):
        if isinstance(one, Atom) and one.predicate == EQUAL:
            for variable, name in (one.terms, one.terms[::-1]):
                if variable.startswith("?") and not name.startswith("?"):
                    yield variable, name


def _guards(formula: Formula, places: Mapping[str, str | int]) -> frozenset[tuple[int, str]]:
    return frozenset((int(places[variable]), name) for variable, name in _equalities(formula) if variable in places)


def _added(action: Action) -> Iterator[_Making]:
    places: dict[str, str | int] = {parameter.name: place for place, parameter in enumerate(action.parameters)}
    for effect in action.effects:
        if effect.is_added:
            inner = {parameter.name for parameter in effect.parameters}
            terms = tuple(None if term in inner else places.get(term, term) for term in effect.atom.terms)
            yield _Making(effect.atom.predicate, terms, _guards(action.precondition, places))


def _passed_on(method: MethodSpec, found: Mapping[str, Iterable[_Making]]) -> Iterator[_Making]:
    """What a method may make true by its subtasks, over the arguments of its task."""
    places = argument_places(method)
    own = _guards(method.precondition, places)
    known = dict(_equalities(method.precondition))
    for subtask in method.subtasks:
        given = [known.get(term, term) if term not in places else term for term in subtask.terms]
        for making in found.get(subtask.name, ()):
            guards = [(given[place], name) for place, name in making.guards]
            if any(not term.startswith("?") and term != name for term, name in guards):
                continue
            kept = frozenset((int(places[term]), name) for term, name in guards if term in places)
            outer = (given[term] if isinstance(term, int) else term for term in making.terms)
            terms = tuple(
                None if term is None else places.get(term, None if term.startswith("?") else term) for term in outer
            )
            yield _Making(making.predicate, terms, own | kept)
