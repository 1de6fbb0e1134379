"""Conditions as Python expressions: an HDDL domain is compiled, as interpreting its conditions took most of the time.

In an expression ``facts`` are the facts, and every variable has a name of its own. Objects and predicates are literals
in it, so nothing that a file says becomes a name. In the key of an atom a variable that is not bound is ``ANY``, so the
key is at the same time a pattern.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from remoras.htn.facts import ANY
from remoras.htn.hddl.language import EQUAL, Atom, Formula, Not, Quantified, Several, TypedParameter

Objects = Callable[[tuple[str, ...]], Sequence[str]]
"""Objects of one of several types, in the order of the files."""


class Code:
    """The code of one function, of an action or a method.

    Args:
        parameters: its variables.
        objects: by type.

    Attributes:
        names: of the variables in the code.
    """

    def __init__(self, parameters: Sequence[TypedParameter], objects: Objects) -> None:
        self.names = {parameter.name: f"v{number}" for number, parameter in enumerate(parameters)}
        self._objects = objects
        self._values: dict[str, Any] = {"ANY": ANY}

    def constant(self, value: Any) -> str:
        """The name of a value in the code."""
        name = f"c{len(self._values)}"
        self._values[name] = value
        return name

    def fresh(self) -> str:
        """A name that stands for nothing yet."""
        return self.constant(None)

    def compiled(self, arguments: Sequence[str], lines: Sequence[str]) -> Callable[..., Any]:
        """The function of facts and ``arguments`` with these lines."""
        head = f"def function({', '.join(('facts', *arguments))}):"
        exec("\n    ".join((head, *lines)), self._values)
        function: Callable[..., Any] = self._values["function"]
        return function

    def key(self, atom: Atom, free: frozenset[str] = frozenset()) -> str:
        """The key of an atom; the pattern, if some of its variables are ``free``."""
        terms = ["ANY" if term in free else self.term(term) for term in atom.terms]
        return f"({', '.join((repr(atom.predicate), *terms))},)"

    def term(self, term: str) -> str:
        """A variable by its name, an object as a literal."""
        return self.names.get(term) or repr(term)

    def test(self, formula: Formula) -> str:
        """True if ``formula`` is."""
        match formula:
            case Atom(predicate, terms) if predicate == EQUAL:
                return f"{self.term(terms[0])} == {self.term(terms[1])}"
            case Atom():
                return f"facts.get({self.key(formula)}) is True"
            case Not(inner):
                return f"not ({self.test(inner)})"
            case Several(formulas, is_all):
                tests = [self.test(inner) for inner in formulas]
                return f"({(' and ' if is_all else ' or ').join(tests)})" if tests else str(is_all)
            case Quantified(parameters, inner, is_all):
                outer = dict(self.names)
                every = self.every(parameters)
                test = self.test(inner)
                self.names = outer
                return f"{'all' if is_all else 'any'}({test} {every})"

    def every(self, parameters: Sequence[TypedParameter]) -> str:
        """The clause that goes through the values of quantified variables; from now on their names hide outer ones."""
        clauses = []
        for parameter in parameters:
            self.names[parameter.name] = self.fresh()
            clauses.append(f"for {self.names[parameter.name]} in {self.constant(self._objects(parameter.types))}")
        return " ".join(clauses)


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
