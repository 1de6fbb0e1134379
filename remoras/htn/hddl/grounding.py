"""An HDDL domain as a ``Domain``: methods bind their variables lazily, from facts that are asked for by pattern."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from remoras.htn.domain import Decomposition, Domain, Method, Operator, Task, always, nothing
from remoras.htn.hddl.conditions import Code
from remoras.htn.hddl.language import (
    EQUAL,
    OBJECT,
    Action,
    Atom,
    DomainSpec,
    Formula,
    MethodSpec,
    Not,
    Several,
    Subtask,
    TypedParameter,
    above,
    conjuncts,
)
from remoras.htn.hddl.necessity import Needs, needs_of_methods


class ObjectsByType:
    """The objects of a problem by their types, in the order of the files."""

    def __init__(self, domain: DomainSpec, objects: Sequence[TypedParameter]) -> None:
        self._found: dict[str, dict[str, None]] = {}
        for parameter in objects:
            for name in {OBJECT, *(up for kind in parameter.types for up in above(domain.types, kind))}:
                self._found.setdefault(name, {})[parameter.name] = None

    def __call__(self, types: tuple[str, ...]) -> tuple[str, ...]:
        """Objects of one of these types."""
        if len(types) == 1:
            return tuple(self._found.get(types[0], ()))
        return tuple(dict.fromkeys(name for kind in types for name in self._found.get(kind, ())))

    def frozen(self, types: tuple[str, ...]) -> frozenset[str]:
        """The same as a set."""
        return frozenset(self(types))


def ground(spec: DomainSpec, objects: ObjectsByType) -> Domain:
    """The domain, for the objects of one problem."""
    needs = needs_of_methods(spec, objects.frozen)
    methods: dict[str, list[Method]] = {name: [] for name in spec.tasks}
    for method in spec.methods:
        methods[method.task.name].append(_Binding(method, needs[method.name], objects).method())
    return Domain.of([_operator(action, objects) for action in spec.actions.values()], methods)


def _operator(action: Action, objects: ObjectsByType) -> Operator:
    applicable, effects = Code(action.parameters, objects), Code(action.parameters, objects)
    arguments = list(applicable.names.values())
    tests = [f"{applicable.names[parameter.name]} in {applicable.constant(objects.frozen(parameter.types))}"
             for parameter in action.parameters]  # fmt: skip
    tests += [applicable.test(conjunct) for conjunct in conjuncts(action.precondition)]
    always_made: list[str] = []
    made: list[str] = []
    for effect in sorted(action.effects, key=lambda effect: effect.is_added):  # what is added stays, where both is said
        outer = dict(effects.names)
        every = effects.every(effect.parameters) if effect.parameters else "for _ in (0,)"
        fact = f"{effects.key(effect.atom)}: {True if effect.is_added else None}"
        tests_here = [effects.test(each) for each in conjuncts(effect.condition)]
        if not effect.parameters and not tests_here and not made:
            always_made.append(fact)
        else:
            made.append(f"found.update({{{fact} {every} {' '.join(f'if {test}' for test in tests_here)}}})")
        effects.names = outer
    lines = [f"found = {{{', '.join(always_made)}}}", *made, "return found"]
    return Operator(
        action.name,
        applicable.compiled(arguments, [f"return {' and '.join(tests)}"]) if tests else always,
        effects.compiled(arguments, lines) if action.effects else nothing,
    )


def _once(found: Iterable[Decomposition]) -> Iterator[Decomposition]:
    """Every decomposition once."""
    seen: set[tuple[Task, ...]] = set()
    for tasks in found:
        key = tuple(tasks)
        if key not in seen:
            seen.add(key)
            yield tasks


class _Binding:
    """Binds the variables of one method.

    Conditions are put in order once: those that are bound first, then the atom with the fewest free variables, then
    the objects of a type. A variable that no subtask has is bound once only.
    """

    def __init__(self, spec: MethodSpec, needs: Needs, objects: ObjectsByType) -> None:
        self._spec = spec
        self._objects = objects
        self._code = Code(spec.parameters, objects)
        self._kinds = {parameter.name: objects.frozen(parameter.types) for parameter in spec.parameters}
        found = dict.fromkeys(conjuncts(spec.precondition))
        for predicate, terms, is_true in sorted(needs):
            atom = Atom(predicate, tuple(map(str, terms)))
            found.setdefault(atom if is_true else Not(atom))
        self._conditions = list(found)

    def method(self) -> Method:
        """The method, lazy in its bindings."""
        spec, code = self._spec, self._code
        arguments = [f"a{place}" for place in range(len(spec.task.terms))]
        tests = []
        head: dict[str, str] = {}
        for term, name in zip(spec.task.terms, arguments, strict=True):
            if term in self._kinds and term not in head:
                head[term] = code.names[term] = name
                tests.append(f"{name} in {code.constant(self._kinds[term])}")
            else:
                tests.append(f"{name} == {code.term(term)}")
        now, *clauses = self._in_order(self._conditions, set(head))
        tests += now
        tasks = f"[{', '.join(map(self._task, spec.subtasks))}]"
        if clauses:
            free = {term for subtask in spec.subtasks for term in subtask.terms if term.startswith("?")}
            found = f"({tasks} {' '.join(clause_text for clause in clauses for clause_text in clause)})"
            is_witnessed_once = free.issuperset(self._kinds.keys() - head.keys())
            tasks = found if is_witnessed_once else f"{code.constant(_once)}{found}"
        applicable = code.compiled(arguments, [f"return {' and '.join(tests)}"]) if tests else always
        subtasks = code.compiled(arguments, [f"return {tasks}"])
        return Method(spec.name, subtasks, applicable, tuple(dict.fromkeys(subtask.name for subtask in spec.subtasks)))

    def _task(self, subtask: Subtask) -> str:
        """The code that makes a task."""
        code = self._code
        if not any(term in code.names for term in subtask.terms):
            return code.constant(Task(subtask.name, subtask.terms))
        terms = "".join(f"{code.term(term)}, " for term in subtask.terms)
        return f"{code.constant(tuple.__new__)}({code.constant(Task)}, ({subtask.name!r}, ({terms})))"

    def _in_order(self, conditions: list[Formula], bound: set[str]) -> Iterator[list[str]]:
        """The tests of what is bound at first; then, for each binding, its clause and the tests behind it."""
        code = self._code
        left = conditions
        clause: list[str] = []
        while True:
            tests = [code.test(formula) for formula in left if self._free(formula) <= bound]
            yield [*clause, *(f"if {test}" for test in tests)] if clause else tests
            left = [formula for formula in left if not self._free(formula) <= bound]
            atoms = [atom for atom in left if isinstance(atom, Atom) and atom.predicate != EQUAL]
            if atoms:
                atom = min(atoms, key=lambda atom: len(self._free(atom) - bound))
                clause = [self._match(atom, bound)]
                left = [formula for formula in left if formula is not atom]
                bound = bound | self._free(atom)
            elif (
                missing := next((parameter for parameter in self._spec.parameters if parameter.name not in bound), None)
            ) is not None:
                clause = [f"for {code.names[missing.name]} in {code.constant(self._objects(missing.types))}"]
                bound = bound | {missing.name}
            else:
                return

    def _match(self, atom: Atom, bound: set[str]) -> str:
        """The clause that binds the free variables of an atom to each fact that fits."""
        code = self._code
        free = frozenset(self._free(atom) - bound)
        found = code.fresh()
        clauses = [f"for {found} in facts.match({code.key(atom, free)})"]
        seen: set[str] = set()
        for place, term in enumerate(atom.terms, 1):
            if term in seen:
                clauses.append(f"if {found}[{place}] == {code.names[term]}")
            elif term in free:
                seen.add(term)
                clauses.append(f"for {code.names[term]} in ({found}[{place}],)")
                clauses.append(f"if {code.names[term]} in {code.constant(self._kinds[term])}")
        return " ".join(clauses)

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
            return {term for inner in formulas for term in _terms(inner)}
        case _:
            return _terms(formula.formula) - {parameter.name for parameter in formula.parameters}
