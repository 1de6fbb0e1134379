"""What an ontology lets one conclude, and the tables by which it is concluded.

``Axioms`` are what was read: definitions of classes, and how attributes that link instances hang together.
``CompiledAxioms`` are what follows from them for every world model of that ontology. A condition such as "some part of
it is a Sonar" becomes a class without a name, one more bit of a mask, so that classes follow from classes by masks
alone. What holds of all instances of a class (each Towfish has some part that is a Sonar) follows from the classes
too; ``superclasses`` has it, so that a hierarchy is complete before the first fact comes.

The rules are those of OWL 2 EL for subclasses, intersections and existential restrictions, with inverses of
attributes for facts. What follows for a class alone from an inverse of its own restriction is not concluded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from worldmodel.fields import Value


class Classified(Protocol):
    """What rules need of a class: ``worldmodel.OntologyClass``."""

    @property
    def uid(self) -> int:
        """Its place among the classes."""

    @property
    def parents(self) -> tuple[int, ...]:
        """Uids of its direct superclasses."""


class Linking(Protocol):
    """What rules need of an attribute: ``worldmodel.Attribute``."""

    @property
    def domain(self) -> int:
        """The class that has it."""

    @property
    def range_class(self) -> int | None:
        """The class that a link points to; None if it is no link."""


@dataclass(frozen=True, slots=True)
class ValueCondition:
    """A condition on the values of one attribute: one is an instance of class ``filler``, or is ``value``."""

    attribute: int
    filler: int | None = None
    value: Value | None = None


@dataclass(frozen=True, slots=True)
class Definition:
    """What the instances of a class have in common: they are of ``classes``, and meet ``conditions``.

    ``is_sufficient``: whatever is so is an instance of the class.
    """

    class_uid: int
    classes: tuple[int, ...]
    conditions: tuple[ValueCondition, ...]
    is_sufficient: bool


@dataclass(frozen=True, slots=True)
class Axioms:
    """The axioms of an ontology beyond hierarchy and disjointness, all uids.

    Attributes:
        definitions: of classes, by equivalence or by what is necessary.
        inverses: pairs of attributes, each the other way round; an attribute with itself is symmetric.
        transitive: attributes that lead on.
        sub_attributes: pairs of an attribute and one above it.
    """

    definitions: tuple[Definition, ...] = ()
    inverses: tuple[tuple[int, int], ...] = ()
    transitive: tuple[int, ...] = ()
    sub_attributes: tuple[tuple[int, int], ...] = ()


NO_AXIOMS = Axioms()


class CompiledAxioms:
    """The axioms compiled. All masks have bit c for class c, and behind these a bit for each condition.

    Attributes:
        conditions: those that suffice for something; the bit of the k-th is ``n_classes + k``.
        superclasses: for each class all that its instances are known to be, itself included.
        entailed: for each attribute what a link of it says: (attribute, whether the other way round), itself first.
        sources: for each attribute that has any, the attributes whose links say it, in the same form.
        transitive: attributes that lead on, inverses included.
        heeded: attributes of which a value may lead to a conclusion.
    """

    def __init__(self, classes: Sequence[Classified], attributes: Sequence[Linking], axioms: Axioms) -> None:
        self.n_classes = len(classes)
        self.entailed, self.sources, self.transitive = _links(len(attributes), axioms)
        sufficient = [each for each in axioms.definitions if each.is_sufficient]
        self.conditions = tuple(dict.fromkeys(condition for each in sufficient for condition in each.conditions))
        self._bits = {condition: 1 << self.n_classes + k for k, condition in enumerate(self.conditions)}
        self._sufficient = [
            (
                sum({*(1 << c for c in each.classes), *(self._bits[condition] for condition in each.conditions)}),
                each.class_uid,
            )
            for each in sufficient
        ]
        self._closed: dict[int, int] = {}
        self.superclasses = self._saturated(classes, attributes, axioms)
        conditional = {source for condition in self.conditions for source, _ in self.sources[condition.attribute]}
        linked = {a for pair in (*axioms.inverses, *axioms.sub_attributes) for a in pair} | self.transitive
        self.heeded = frozenset(conditional | {source for a in linked for source, _ in self.sources[a]})

    @property
    def is_needed(self) -> bool:
        """True if facts may lead to conclusions."""
        return bool(self._sufficient or self.heeded)

    def bit_of(self, condition: ValueCondition) -> int:
        """Return the mask of a condition that suffices for something."""
        return self._bits[condition]

    def closed(self, mask: int) -> int:
        """Return all classes and conditions of an instance that is known to be of those in ``mask``."""
        closure = self._closed.get(mask)
        if closure is None:
            closure = self._closed[mask] = self._close(mask, self.superclasses)
        return closure

    def _close(self, mask: int, superclasses: Sequence[int]) -> int:
        before = -1
        while before != mask:
            before = mask
            for needed, class_uid in self._sufficient:
                if not needed & ~mask:
                    mask |= superclasses[class_uid]
        return mask

    def _saturated(
        self, classes: Sequence[Classified], attributes: Sequence[Linking], axioms: Axioms
    ) -> tuple[int, ...]:
        """Return ``superclasses``: what is told, and what follows from what is necessary, until nothing new does."""
        masks = [1 << c.uid | sum(1 << parent for parent in c.parents) for c in classes]
        asked: list[set[ValueCondition]] = [set() for _ in classes]
        for each in axioms.definitions:
            masks[each.class_uid] |= sum(1 << c for c in set(each.classes))
            asked[each.class_uid].update(each.conditions)
        before: list[tuple[int, int]] = []
        while before != (now := [(mask, len(asked_mask)) for mask, asked_mask in zip(masks, asked, strict=True)]):
            before = now
            for uid in range(self.n_classes):
                for above in _bits_of(masks[uid], self.n_classes):
                    masks[uid] |= masks[above]
                    asked[uid] |= asked[above]
                for condition in tuple(asked[uid]):
                    asked[uid] |= self._led_on(condition, asked)
                    domain = attributes[condition.attribute].domain
                    masks[uid] |= masks[domain] | self._met_by(condition, masks, attributes)
                masks[uid] = self._close(masks[uid], masks)
        return tuple(masks)

    def _met_by(self, asked: ValueCondition, masks: Sequence[int], attributes: Sequence[Linking]) -> int:
        """Return the conditions that are met wherever ``asked`` is."""
        if asked.filler is None:
            return self._bits.get(asked, 0)
        entailed = {attribute for attribute, flipped in self.entailed[asked.attribute] if not flipped}
        range_class = attributes[asked.attribute].range_class
        filler = masks[asked.filler] | (0 if range_class is None else masks[range_class])
        met = [
            o for o in self.conditions if o.attribute in entailed and o.filler is not None and filler >> o.filler & 1
        ]
        return sum(self._bits[condition] for condition in met)

    def _led_on(self, asked: ValueCondition, all_asked: Sequence[set[ValueCondition]]) -> set[ValueCondition]:
        """Return what an attribute that leads on asks of whatever meets ``asked``."""
        if asked.filler is None:
            return set()
        leading = {a for a, flipped in self.entailed[asked.attribute] if not flipped and a in self.transitive}
        return {
            ValueCondition(a, condition.filler)
            for a in leading
            for condition in all_asked[asked.filler]
            if condition.filler is not None and (a, False) in self.entailed[condition.attribute]
        }


Said = tuple[tuple[int, bool], ...]
"""Attributes that a link says, each with whether it says them the other way round."""


def _links(n_attributes: int, axioms: Axioms) -> tuple[tuple[Said, ...], tuple[Said, ...], frozenset[int]]:
    """Return ``entailed``, ``sources`` and ``transitive`` of the rules."""
    steps: list[set[tuple[int, bool]]] = [set() for _ in range(n_attributes)]
    for a, b in axioms.inverses:
        steps[a].add((b, True))
        steps[b].add((a, True))
    for below, above in axioms.sub_attributes:
        steps[below].add((above, False))
    entailed = []
    for uid in range(n_attributes):
        reached = [(uid, False)]
        for a, flipped in reached:  # grows while it is read
            for b, turned in sorted(steps[a]):
                if (link := (b, flipped != turned)) not in reached:
                    reached.append(link)
        entailed.append(tuple(reached))
    sources = [
        tuple((a, flipped) for a, links in enumerate(entailed) for b, flipped in links if b == uid)
        for uid in range(n_attributes)
    ]
    inverse = {*axioms.inverses, *((b, a) for a, b in axioms.inverses)}
    transitive = {*axioms.transitive, *(b for a, b in inverse if a in axioms.transitive)}
    return tuple(entailed), tuple(sources), frozenset(transitive)


def _bits_of(mask: int, n: int) -> list[int]:
    return [bit for bit in range(n) if mask >> bit & 1]
