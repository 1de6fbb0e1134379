"""Forms into values: names are resolved, and everything that is wrong is told at once, with file and line."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from remoras.htn.hddl.forms import Faults, Parenthesised, Token, item_text, keywords, read_forms, sections
from remoras.htn.hddl.language import (
    EQUAL,
    OBJECT,
    TRUE,
    Action,
    Atom,
    DomainSpec,
    Effect,
    Formula,
    MethodSpec,
    Not,
    ProblemSpec,
    Quantified,
    Several,
    Subtask,
    TypedParameter,
)

CONNECTIVES = ("and", "or", "not", "imply", "forall", "exists")
DOMAIN_SECTIONS = (":requirements", ":types", ":constants", ":predicates", ":task", ":method", ":action")
PROBLEM_SECTIONS = (":domain", ":requirements", ":objects", ":htn", ":init", ":goal")
ORDERED = (":ordered-subtasks", ":ordered-tasks")
UNORDERED = (":subtasks", ":tasks")
NETWORK = (*ORDERED, *UNORDERED, ":ordering", ":constraints")


@dataclass
class _Reader:
    """Reads the parts of one file; ``terms`` are the variables and objects that may stand there.

    Attributes:
        is_linearised: some subtasks were not ordered, and are now.
    """

    faults: Faults
    domain: DomainSpec
    objects: Mapping[str, TypedParameter]
    is_linearised: bool = False

    def known(self, kind: str, word: Token, names: Collection[str]) -> str:
        """The name in ``word``; a fault if it is none of ``names``."""
        if word.text not in names:
            allowed = ", ".join(sorted(names)) or "none"
            self.faults.add(word.line, f"{kind} {word.text} is not declared; declared: {allowed}")
        return word.text

    def word(self, item: Parenthesised | Token) -> Token:
        """The item, if it is a word; a fault otherwise."""
        if isinstance(item, Token):
            return item
        self.faults.add(item.line, f"expected a name, not {item_text(item)}")
        return Token("", item.line)

    def typed(self, items: Sequence[Parenthesised | Token], *, checks_types: bool = True) -> tuple[TypedParameter, ...]:
        """A typed list: ``a b - type c - (either type type) d``."""
        found: list[TypedParameter] = []
        names: list[Token] = []
        rest = list(items)
        while rest:
            item = rest.pop(0)
            if isinstance(item, Token) and item.text == "-" and rest:
                kind = rest.pop(0)
                words = [kind] if isinstance(kind, Token) else [self.word(item) for item in kind.items[1:]]
                if checks_types:
                    for word in words:
                        self.known("type", word, {*self.domain.types, OBJECT})
                found += [TypedParameter(name.text, tuple(word.text for word in words)) for name in names]
                names = []
            else:
                names.append(self.word(item))
        found += [TypedParameter(name.text, (OBJECT,)) for name in names]
        return tuple(found)

    def parameters(self, item: Parenthesised | Token | None) -> tuple[TypedParameter, ...]:
        """A list of variables."""
        return self.typed(item.items) if isinstance(item, Parenthesised) else ()

    def terms(self, items: Sequence[Parenthesised | Token], variables: Collection[str]) -> tuple[str, ...]:
        """Variables that are bound, and objects."""
        found = []
        for item in items:
            word = self.word(item)
            names = variables if word.text.startswith("?") else self.objects
            found.append(self.known("variable" if word.text.startswith("?") else "object", word, names))
        return tuple(found)

    def atom(self, form: Parenthesised, variables: Collection[str]) -> Atom:
        """A predicate with its terms."""
        if not form.items:
            self.faults.add(form.line, "expected an atom (PREDICATE TERM ...), not ()")
            return Atom(EQUAL, ())
        name = self.word(form.items[0])
        terms = self.terms(form.items[1:], variables)
        if name.text != EQUAL:
            self.known("predicate", name, self.domain.predicates)
        arity = 2 if name.text == EQUAL else len(self.domain.predicates.get(name.text, terms))
        if arity != len(terms):
            self.faults.add(form.line, f"{name.text} takes {arity} terms, not {len(terms)}")
        return Atom(name.text, terms)

    def formula(self, item: Parenthesised | Token | None, variables: Collection[str]) -> Formula:
        """A condition; none at all is always true."""
        if item is None or (isinstance(item, Parenthesised) and not item.items):
            return TRUE
        if isinstance(item, Token):
            self.faults.add(item.line, f"expected a condition in parentheses, not {item.text}")
            return TRUE
        if item.head not in CONNECTIVES:
            return self.atom(item, variables)
        inner = item.items[1:]
        if item.head in ("and", "or"):
            return Several(tuple(self.formula(element, variables) for element in inner), item.head == "and")
        if len(inner) != (1 if item.head == "not" else 2):
            self.faults.add(item.line, f"{item_text(item)} has {len(inner)} parts")
            return TRUE
        if item.head == "not":
            return Not(self.formula(inner[0], variables))
        if item.head == "imply":
            return Several((Not(self.formula(inner[0], variables)), self.formula(inner[1], variables)), False)
        parameters = self.parameters(inner[0])
        bound = {*variables, *(parameter.name for parameter in parameters)}
        return Quantified(parameters, self.formula(inner[1], bound), item.head == "forall")

    def effects(self, item: Parenthesised | Token | None, variables: Collection[str]) -> tuple[Effect, ...]:
        """Effects, those of forall and when too."""
        if item is None or (isinstance(item, Parenthesised) and not item.items):
            return ()
        if isinstance(item, Token):
            self.faults.add(item.line, f"expected an effect in parentheses, not {item.text}")
            return ()
        inner = item.items[1:]
        if item.head == "and":
            return tuple(effect for element in inner for effect in self.effects(element, variables))
        if item.head == "forall" and len(inner) == 2:
            parameters = self.parameters(inner[0])
            bound = {*variables, *(parameter.name for parameter in parameters)}
            return tuple(
                Effect((*parameters, *effect.parameters), effect.condition, effect.atom, effect.is_added)
                for effect in self.effects(inner[1], bound)
            )
        if item.head == "when" and len(inner) == 2:
            condition = self.formula(inner[0], variables)
            return tuple(
                Effect(effect.parameters, Several((condition, effect.condition), True), effect.atom, effect.is_added)
                for effect in self.effects(inner[1], variables)
            )
        is_added = item.head != "not"
        form = item if is_added else inner[0] if inner else item
        if not isinstance(form, Parenthesised) or form.head in (*CONNECTIVES, "when", EQUAL, "increase"):
            self.faults.add(item.line, f"{item_text(item)} is no effect; allowed: and, not, forall, when, and atoms")
            return ()
        return (Effect((), TRUE, self.atom(form, variables), is_added),)

    def subtask(
        self, form: Parenthesised | Token, variables: Collection[str], kinds: Mapping[str, Sequence[TypedParameter]]
    ) -> Subtask:
        """A task with its terms."""
        if not isinstance(form, Parenthesised) or not form.items:
            self.faults.add(form.line, f"expected a task (NAME TERM ...), not {item_text(form)}")
            return Subtask("", ())
        name = self.known("task", self.word(form.items[0]), kinds)
        terms = self.terms(form.items[1:], variables)
        if len(kinds.get(name, terms)) != len(terms):
            self.faults.add(form.line, f"task {name} takes {len(kinds[name])} terms, not {len(terms)}")
        return Subtask(name, terms)

    def network(self, given: Mapping[str, Parenthesised | Token], variables: Collection[str]) -> tuple[Subtask, ...]:
        """Subtasks in one order; what the file leaves unordered is put in that of the file."""
        kinds = {**self.domain.tasks, **{name: action.parameters for name, action in self.domain.actions.items()}}
        keyword = next((key for key in (*ORDERED, *UNORDERED) if key in given), None)
        if keyword is None:
            return ()
        whole = given[keyword]
        if not isinstance(whole, Parenthesised):
            self.faults.add(whole.line, f"expected tasks in parentheses, not {whole.text}")
            return ()
        forms = whole.items[1:] if whole.head == "and" else (whole,) if whole.items else ()
        labels: list[str] = []
        tasks: list[Subtask] = []
        for form in forms:
            is_labelled = (
                isinstance(form, Parenthesised) and len(form.items) == 2 and isinstance(form.items[1], Parenthesised)
            )
            labels.append(form.head if isinstance(form, Parenthesised) and is_labelled else f"{len(labels)}")
            tasks.append(
                self.subtask(
                    form.items[1] if isinstance(form, Parenthesised) and is_labelled else form, variables, kinds
                )
            )
        if keyword in ORDERED:
            return tuple(tasks)
        return tuple(tasks[place] for place in self.order(labels, given.get(":ordering"), whole.line))

    def order(self, labels: Sequence[str], ordering: Parenthesised | Token | None, line: int) -> list[int]:
        """Places of the labels in their order, the first of several that are free; a fault if it is a circle."""
        pairs: list[Parenthesised | Token] = []
        if isinstance(ordering, Parenthesised):
            pairs = list(ordering.items[1:]) if ordering.head == "and" else [ordering] if ordering.items else []
        before: dict[str, set[str]] = {label: set() for label in labels}
        for pair in pairs:
            words = [self.word(item) for item in pair.items] if isinstance(pair, Parenthesised) else []
            if len(words) != 3 or words[0].text != "<":
                self.faults.add(pair.line, f"expected (< LABEL LABEL), not {item_text(pair)}")
                continue
            first, second = (self.known("label", word, before) for word in words[1:])
            before.setdefault(second, set()).add(first)
        found: list[int] = []
        while len(found) < len(labels):
            done = {labels[place] for place in found}
            free = [place for place in range(len(labels)) if place not in found and before[labels[place]] <= done]
            if not free:
                left = [labels[place] for place in range(len(labels)) if place not in found]
                self.faults.add(line, f"subtasks {', '.join(left)} go round in a circle; an ordering must have a first")
                return list(range(len(labels)))
            self.is_linearised |= len(free) > 1
            found.append(free[0])
        return found


def read_domain(text: str, file: str) -> DomainSpec:
    """The domain in ``text``; raises PlanningError with all its faults."""
    faults = Faults(file)
    domain = DomainSpec()
    reader = _Reader(faults, domain, domain.constants)
    by_kind: dict[str, list[Parenthesised]] = {kind: [] for kind in DOMAIN_SECTIONS}
    for section in sections(read_forms(text, faults), "domain", faults):
        if section.head in by_kind:
            by_kind[section.head].append(section)
        else:
            faults.add(section.line, f"{section.head} is not known; allowed: {', '.join(DOMAIN_SECTIONS)}")
    for section in by_kind[":types"]:
        for typed in reader.typed(section.items[1:], checks_types=False):
            domain.types[typed.name] = (*domain.types.get(typed.name, ()), *typed.types)
    for name in [parent for parents in domain.types.values() for parent in parents]:
        domain.types.setdefault(name, (OBJECT,))
    for section in by_kind[":constants"]:
        domain.constants.update({parameter.name: parameter for parameter in reader.typed(section.items[1:])})
    for section in by_kind[":predicates"]:
        for form in section.items[1:]:
            if isinstance(form, Parenthesised) and form.head:
                domain.predicates[form.head] = reader.typed(form.items[1:])
            else:
                faults.add(form.line, f"expected (PREDICATE ?VARIABLE - TYPE ...), not {item_text(form)}")
    for section in by_kind[":task"]:
        given = keywords(section, 2, (":parameters", ":precondition", ":effect"), faults)
        domain.tasks[_name(reader, section, domain.tasks)] = reader.parameters(given.get(":parameters"))
    for section in by_kind[":action"]:
        given = keywords(section, 2, (":parameters", ":precondition", ":effect"), faults)
        parameters = reader.parameters(given.get(":parameters"))
        names = [parameter.name for parameter in parameters]
        name = _name(reader, section, {*domain.tasks, *domain.actions})
        domain.actions[name] = Action(
            name,
            parameters,
            reader.formula(given.get(":precondition"), names),
            reader.effects(given.get(":effect"), names),
        )
    for section in by_kind[":method"]:
        domain.methods.append(_method(reader, section, [method.name for method in domain.methods]))
    domain.is_linearised = reader.is_linearised
    faults.end()
    return domain


def _name(reader: _Reader, section: Parenthesised, taken: Collection[str]) -> str:
    name = reader.word(section.items[1]) if len(section.items) > 1 else Token("", section.line)
    if name.text in taken:
        reader.faults.add(name.line, f"{section.head[1:]} {name.text} is declared twice")
    return name.text


def _method(reader: _Reader, section: Parenthesised, taken: Collection[str]) -> MethodSpec:
    given = keywords(section, 2, (":parameters", ":task", ":precondition", *NETWORK), reader.faults)
    parameters = reader.parameters(given.get(":parameters"))
    names = [parameter.name for parameter in parameters]
    task = reader.subtask(given.get(":task", section), names, reader.domain.tasks)
    conditions = tuple(reader.formula(given.get(key), names) for key in (":precondition", ":constraints"))
    network = reader.network(given, names)
    return MethodSpec(_name(reader, section, taken), parameters, task, Several(conditions, True), network)


def read_problem(text: str, file: str, domain: DomainSpec) -> ProblemSpec:
    """The problem in ``text``, of ``domain``; raises PlanningError with all its faults."""
    faults = Faults(file)
    problem = ProblemSpec(objects=dict(domain.constants))
    reader = _Reader(faults, domain, problem.objects)
    found = list(sections(read_forms(text, faults), "problem", faults))
    for section in found:
        if section.head == ":objects":
            problem.objects.update({parameter.name: parameter for parameter in reader.typed(section.items[1:])})
        elif section.head not in PROBLEM_SECTIONS:
            faults.add(section.line, f"{section.head} is not known; allowed: {', '.join(PROBLEM_SECTIONS)}")
    for section in found:
        if section.head == ":init":
            problem.facts += [reader.atom(item, ()) for item in section.items[1:] if isinstance(item, Parenthesised)]
        elif section.head == ":goal" and len(section.items) > 1:
            problem.goal = reader.formula(section.items[1], ())
        elif section.head == ":htn":
            given = keywords(section, 1, (":parameters", *NETWORK), faults)
            problem.parameters = reader.parameters(given.get(":parameters"))
            names = [parameter.name for parameter in problem.parameters]
            problem.tasks = reader.network(given, names)
            problem.constraints = reader.formula(given.get(":constraints"), names)
    problem.is_linearised = reader.is_linearised
    faults.end()
    return problem
