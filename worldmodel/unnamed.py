"""Class expressions as classes without a name, and the rules that say what each of them is.

An expression that is no intersection of named classes and conditions becomes a class of its own, with

    A or B        A and B below it; whoever is of it is of A or of B (a covering)
    not A         it and A have no instance in common; whatever there is, is of one of them
    p only D      of whoever is of it, p leads to instances of D; not (p some not D)
    {a}           the individual a alone; two names are two things
    at most one p links by p are counted; what one of them is known to lead to, all of them lead to

These are the usual equivalences of description logics (Baader and others, The Description Logic Handbook, chapter 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from worldmodel.axioms import Axioms, Definition, ValueCondition, entailments
from worldmodel.tbox import Attribute, OntologyClass, ValueKind


class ExpressionKind(Enum):
    """What an expression says of an instance."""

    CLASS = "is of a class"
    AND = "is of all"
    OR = "is of any"
    NOT = "is not of"
    SOME = "some"
    ONLY = "only"
    VALUES = "has a value"
    INDIVIDUAL = "is this thing"
    SINGLE = "at most one"


@dataclass(frozen=True, slots=True)
class Expression:
    """A class expression; ``uid`` is that of a class or an attribute."""

    kind: ExpressionKind
    parts: tuple[Expression, ...] = ()
    uid: int = 0
    name: str = ""
    values: ValueCondition | None = None


def some_of(attribute: int, of: Expression) -> Expression:
    """Return what has a link to an instance of an expression."""
    return Expression(ExpressionKind.SOME, (of,), attribute)


def no(of: Expression) -> Expression:
    """Return whatever is not of an expression."""
    if of.kind is ExpressionKind.NOT:
        return of.parts[0]
    return Expression(ExpressionKind.NOT, (of,))


def only(attribute: int, of: Expression) -> Expression:
    """Return what links by an attribute to instances of an expression alone."""
    return Expression(ExpressionKind.ONLY, (of,), attribute)


class Unnamed:
    """Collects the axioms of an ontology; classes without a name are numbered as they come.

    Args:
        classes: those with a name.
        attributes: of the ontology.
        thing: uid of the class of all instances.
        individuals: class of each individual, by name.
        stated: links of individuals, by name: (attribute, name).
        links: how attributes hang together.
    """

    def __init__(
        self,
        classes: Sequence[OntologyClass],
        attributes: Sequence[Attribute],
        thing: int,
        individuals: Mapping[str, int],
        stated: Mapping[str, Sequence[tuple[int, str]]],
        links: Axioms,
    ) -> None:
        self._classes, self._attributes, self._thing = classes, attributes, thing
        self._individuals, self._stated = individuals, stated
        self._links = links
        self._entailed = entailments(len(attributes), links)
        self._uids: dict[Expression, int] = {}
        self._words: list[str] = []
        self._definitions: list[Definition] = []
        self._nominals: list[tuple[int, str]] = []
        self._coverings: list[tuple[int, tuple[int, ...]]] = []
        self._excluded: list[tuple[int, int]] = []
        self._single: list[tuple[int, int, bool]] = []

    def define(self, class_uid: int, expression: Expression, is_sufficient: bool) -> None:
        """Let a class be below an expression, or be the same if ``is_sufficient``."""
        classes, conditions = self._flat(expression)
        self._definitions.append(Definition(class_uid, classes, conditions, is_sufficient))

    def cover(self, whole: int, parts: tuple[int, ...]) -> None:
        """Let each instance of a class be of one of its parts."""
        self._coverings.append((whole, parts))

    def functional(self, attribute: int) -> None:
        """Let nothing have two links or values of an attribute."""
        self._below(self._thing, self._uid(Expression(ExpressionKind.SINGLE, uid=attribute)))

    def inverse_functional(self, attribute: int) -> None:
        """Let no two things link to one by an attribute."""
        self._single.append((self._thing, attribute, True))

    def axioms(self) -> Axioms:
        """Return all that was collected, with what follows where at most one link is allowed."""
        for uid, name in self._nominals:  # grows while it is read
            for attribute, other in self._stated.get(name, ()):
                self._below(uid, self._uid(some_of(attribute, Expression(ExpressionKind.INDIVIDUAL, name=other))))
        self._of_single()
        return replace(
            self._links,
            definitions=tuple(sorted(self._definitions, key=repr)),
            unnamed=tuple(self._words),
            nominals=tuple(self._nominals),
            coverings=tuple(sorted(self._coverings)),
            excluded=tuple(sorted(self._excluded)),
            single=tuple(sorted(self._single)),
        )

    def _flat(self, expression: Expression) -> tuple[tuple[int, ...], tuple[ValueCondition, ...]]:
        """Return an expression as classes and conditions that hold together."""
        if expression.kind is ExpressionKind.AND:
            flat = [self._flat(part) for part in expression.parts]
            classes = dict.fromkeys(uid for uids, _ in flat for uid in uids)
            return tuple(classes), tuple(dict.fromkeys(c for _, conditions in flat for c in conditions))
        is_link_to_one = (
            expression.kind is ExpressionKind.SOME and expression.parts[0].kind is ExpressionKind.INDIVIDUAL
        )
        if expression.kind in (ExpressionKind.SOME, ExpressionKind.VALUES) and not is_link_to_one:
            return (), (self._condition(expression),)
        return (self._uid(expression),), ()

    def _condition(self, expression: Expression) -> ValueCondition:
        """Return what is asked of links, or of values."""
        if expression.values is not None:
            return expression.values
        return ValueCondition(expression.uid, filler=self._uid(expression.parts[0]))

    def _uid(self, expression: Expression) -> int:
        """Return the class that an expression is."""
        if expression.kind is ExpressionKind.CLASS:
            return expression.uid
        if expression not in self._uids:
            self._define(expression, self._new(expression))
        return self._uids[expression]

    def _new(self, expression: Expression) -> int:
        uid = self._uids[expression] = len(self._classes) + len(self._words)
        self._words.append(self._in_words(expression))
        return uid

    def _define(self, expression: Expression, uid: int) -> None:
        parts = expression.parts
        if expression.kind is ExpressionKind.AND:
            self._definitions.append(Definition(uid, *self._flat(expression), True))
        elif expression.kind in (ExpressionKind.SOME, ExpressionKind.VALUES):
            self._definitions.append(Definition(uid, (), (self._condition(expression),), True))
        elif expression.kind is ExpressionKind.OR:
            uids = tuple(sorted({self._uid(part) for part in parts}))
            for part in uids:
                self._below(part, uid)
            self._coverings.append((uid, uids))
        elif expression.kind is ExpressionKind.NOT:
            self._divide(uid, self._uid(parts[0]))
        elif expression.kind is ExpressionKind.ONLY:
            self._lead(uid, expression.uid, self._uid(parts[0]))
            self._divide(uid, self._uid(some_of(expression.uid, no(parts[0]))))
        elif expression.kind is ExpressionKind.INDIVIDUAL:
            others = self._new(no(expression))
            self._divide(uid, others)
            self._excluded += [(other, uid) for other, _ in self._nominals]
            self._nominals.append((uid, expression.name))
            self._below(uid, self._individuals[expression.name])
        elif self._attributes[expression.uid].kind is ValueKind.LINK:
            self._single.append((uid, expression.uid, False))

    def _below(self, below: int, above: int) -> None:
        self._definitions.append(Definition(below, (above,), (), False))

    def _divide(self, one: int, other: int) -> None:
        """Let everything be of exactly one of two classes."""
        self._excluded.append((one, other))
        self._coverings.append((self._thing, (one, other)))

    def _lead(self, of: int, attribute: int, to: int) -> None:
        """Let links of the instances of a class lead to instances of another one."""
        linked = len(self._classes) + len(self._words)
        self._words.append(f"what a {self._attributes[attribute].name} leads to")
        self._definitions.append(Definition(linked, (), (ValueCondition(attribute, of, is_backward=True),), True))
        self._below(linked, to)

    def _of_single(self) -> None:
        """Add what follows where at most one link, or value, is allowed."""
        singles = [e for e in self._uids if e.kind is ExpressionKind.SINGLE]
        for single in singles:
            of_class = Expression(ExpressionKind.CLASS, uid=self._uids[single])
            is_local = not any(d.class_uid == self._thing and of_class.uid in d.classes for d in self._definitions)
            below = {a for a, said in enumerate(self._entailed) if (single.uid, False) in said}
            for other in singles:
                if other.uid in below and other != single:
                    self._below(of_class.uid, self._uids[other])
            if self._attributes[single.uid].kind is not ValueKind.LINK:
                any_value = Expression(ExpressionKind.VALUES, values=ValueCondition(single.uid))
                if is_local:
                    self._below(self._uid(no(any_value)), of_class.uid)
                for condition in self._conditions():
                    if condition.attribute == single.uid and condition != any_value.values:
                        kept = Expression(
                            ExpressionKind.AND, (of_class, Expression(ExpressionKind.VALUES, values=condition))
                        )
                        others = replace(condition, is_not=not condition.is_not)
                        self._excluded.append(
                            (self._uid(kept), self._uid(Expression(ExpressionKind.VALUES, values=others)))
                        )
                continue
            if is_local:
                thing = Expression(ExpressionKind.CLASS, uid=self._thing)
                self._below(self._uid(no(some_of(single.uid, thing))), of_class.uid)
            for each in [e for e in self._uids if e.kind is ExpressionKind.ONLY and e.uid == single.uid]:
                kept = Expression(ExpressionKind.AND, (of_class, some_of(each.uid, each.parts[0])))
                self._below(self._uid(kept), self._uids[each])
            for condition in self._conditions():
                if condition.attribute in below and condition.filler not in (None, self._thing):
                    met = Expression(ExpressionKind.CLASS, uid=condition.filler or 0)
                    kept = Expression(ExpressionKind.AND, (of_class, some_of(condition.attribute, met)))
                    if kept not in self._uids:
                        self._lead(self._uid(kept), single.uid, met.uid)

    def _conditions(self) -> Iterable[ValueCondition]:
        """Return the conditions of all definitions so far, in an order that is that of the axioms."""
        found = {c for each in self._definitions for c in each.conditions if not c.is_backward}
        return sorted(found, key=repr)

    def _in_words(self, expression: Expression) -> str:
        """Return an expression as a message says it."""
        words = [self._in_words(part) for part in expression.parts]
        if expression.kind is ExpressionKind.CLASS:
            n = len(self._classes)
            return self._classes[expression.uid].name if expression.uid < n else self._words[expression.uid - n]
        if expression.kind is ExpressionKind.INDIVIDUAL:
            return expression.name
        if expression.kind in (ExpressionKind.AND, ExpressionKind.OR):
            return f"({(' and ' if expression.kind is ExpressionKind.AND else ' or ').join(words)})"
        if expression.kind is ExpressionKind.NOT:
            return f"not {words[0]}"
        if expression.values is not None:
            return f"{self._attributes[expression.values.attribute].name} {expression.values.in_words()}"
        attribute = self._attributes[expression.uid].name
        return (
            f"{expression.kind.value} {attribute}" if not words else f"{attribute} {expression.kind.value} {words[0]}"
        )
