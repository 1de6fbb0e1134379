"""Conditions as functions of the facts and of an environment: a list with a slot for every variable and object.

A slot of a variable that is not bound holds ``ANY``, so the key of an atom is at the same time a pattern.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from operator import itemgetter
from typing import Any

from remoras.htn.facts import ANY, Facts
from remoras.htn.hddl.language import EQUAL, Atom, Formula, Not, Parameter, Quantified, Several

Env = list[Any]
Test = Callable[[Facts, Env], bool]
Keys = Callable[[Env], tuple[Any, ...]]
Objects = Callable[[tuple[str, ...]], Sequence[str]]
"""Objects of one of several types, in the order of the files."""


class Slots:
    """Numbers the variables and objects of one action or method.

    Args:
        parameters: take the first slots.
        objects: by type, for variables that are quantified.
    """

    def __init__(self, parameters: Sequence[Parameter], objects: Objects) -> None:
        self.objects = objects
        self.of: dict[str, int] = {one.name: slot for slot, one in enumerate(parameters)}
        self._blank: Env = [ANY] * len(parameters)

    def env(self, args: Sequence[Any]) -> Env:
        """An environment in which the first variables have the values ``args``."""
        return [*args, *self._blank[len(args) :]]

    def slot(self, term: str) -> int:
        """The slot of a term; one that is new is an object, or a name of a predicate."""
        if term not in self.of:
            self.of[term] = len(self._blank)
            self._blank.append(term)
        return self.of[term]

    def key(self, atom: Atom) -> Keys:
        """The function that makes the key of an atom."""
        slots = [self.slot(f"({atom.predicate}"), *(self.slot(term) for term in atom.terms)]
        self._blank[slots[0]] = atom.predicate
        if len(slots) > 1:
            return itemgetter(*slots)
        only = (atom.predicate,)
        return lambda env: only

    def test(self, formula: Formula) -> Test:
        """The function that says whether ``formula`` is true, once its variables are bound."""
        match formula:
            case Atom(predicate, terms) if predicate == EQUAL:
                left, right = (self.slot(term) for term in terms)
                return lambda facts, env: env[left] == env[right]
            case Atom():
                key = self.key(formula)
                return lambda facts, env: facts.get(key(env)) is True
            case Not(inner):
                holds = self.test(inner)
                return lambda facts, env: not holds(facts, env)
            case Several(formulas, is_all):
                tests = tuple(self.test(one) for one in formulas)

                def several(facts: Facts, env: Env) -> bool:
                    for test in tests:
                        if test(facts, env) is not is_all:
                            return not is_all
                    return is_all

                return tests[0] if len(tests) == 1 else several
            case Quantified(parameters, inner, is_all):
                with self.scope(parameters) as every:
                    holds = self.test(inner)
                if is_all:
                    return lambda facts, env: all(holds(facts, bound) for bound in every(env))
                return lambda facts, env: any(holds(facts, bound) for bound in every(env))

    @contextmanager
    def scope(self, parameters: Sequence[Parameter]) -> Iterator[Callable[[Env], Iterator[Env]]]:
        """Where quantified variables are known, and hide outer ones; yields the way through their values."""
        outer = {one.name: self.of.get(one.name) for one in parameters}
        slots = []
        for one in parameters:
            self.of[one.name] = len(self._blank)
            self._blank.append(ANY)
            slots.append((self.of[one.name], self.objects(one.types)))

        def every(env: Env) -> Iterator[Env]:
            found = [env]
            for slot, values in slots:
                found = [[*one[:slot], value, *one[slot + 1 :]] for one in found for value in values]
            return iter(found)

        yield every
        for name, before in outer.items():
            if before is None:
                del self.of[name]
            else:
                self.of[name] = before


def simplified(formula: Formula, objects: Objects, names: Mapping[str, str]) -> Iterator[tuple[Atom, bool]]:
    """The ground literals of a formula of literals, and, and forall.

    Args:
        formula: for example a goal.
        objects: by type.
        names: values of the variables.

    Raises:
        ValueError: it has other parts.
    """
    match formula:
        case Atom(predicate, terms):
            yield Atom(predicate, tuple(names.get(term, term) for term in terms)), True
        case Not(Atom(predicate, terms)):
            yield Atom(predicate, tuple(names.get(term, term) for term in terms)), False
        case Several(formulas, True):
            for one in formulas:
                yield from simplified(one, objects, names)
        case Quantified(parameters, inner, True):
            if parameters:
                first, *rest = parameters
                for value in objects(first.types):
                    left = Quantified(tuple(rest), inner, True) if rest else inner
                    yield from simplified(left, objects, {**names, first.name: value})
        case _:
            raise ValueError("a goal is made of atoms, not, and, forall")
