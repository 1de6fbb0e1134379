"""What must become true while a task is carried out, whatever way is taken: landmarks, found without grounding.

After Höller and Bercher (Landmark generation in HTN planning, AAAI 2021): of an action its precondition and effects; of
a method its precondition and the landmarks of its subtasks; of a task what all its methods have in common. All are
found together, from above: a task has every landmark until one of its methods is known to end. Literals speak of
arguments and objects; what a method leaves open is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

from remoras.htn.best_first import Landmark
from remoras.htn.domain import Task
from remoras.htn.hddl.conditions import simplified
from remoras.htn.hddl.grounding import ObjectsByType
from remoras.htn.hddl.language import TRUE, Action, DomainSpec, Formula, conjuncts
from remoras.htn.hddl.necessity import Literal, Needs, argument_places, of_method, over_arguments


class TaskLandmarks:
    """The landmarks of a task: facts that some action can make true, and that every way of doing it has true once.

    Args:
        domain: as it was read.
        objects: by type.
    """

    def __init__(self, domain: DomainSpec, objects: ObjectsByType) -> None:
        self._domain = domain
        self._objects = objects

    def __call__(self, task: Task) -> frozenset[Landmark]:
        args = task.args
        return frozenset(
            ((one.predicate, *(args[term] if isinstance(term, int) else term for term in one.terms)), True)
            for one in self._of_tasks.get(task.name, ())
        )

    @cached_property
    def _of_tasks(self) -> dict[str, Needs]:
        """For every task, by name, atoms over its arguments."""
        made = {effect.atom.predicate for action in self._domain.actions.values() for effect in action.effects}

        def some(formula: Formula) -> Iterator[Literal]:
            return (one for one in self._literals(formula) if one.is_true and one.predicate in made)

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
