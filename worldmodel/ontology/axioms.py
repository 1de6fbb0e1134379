"""Axioms of an ontology and their compiled inference tables.

``Axioms`` are as declared: class definitions, and relations between links. ``CompiledAxioms`` are their consequences. A
condition such as "some part of it is a Sonar" is a further bit of the class mask, so that masks alone infer classes.
``superclasses`` completes the hierarchy in advance by the OWL 2 EL rules for subclasses, intersections and existential
restrictions (Baader, Brandt, Lutz, Pushing the EL envelope, 2005). OWL 2 RL rules do not suffice.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from worldmodel.ontology.fields import Value


@dataclass(frozen=True, slots=True)
class ValueCondition:
    """Condition on an attribute: a value is of class ``filler``, or equals ``value``."""

    attribute: int
    filler: int | None = None
    value: Value | None = None


@dataclass(frozen=True, slots=True)
class Definition:
    """Conditions met by all instances of a class; if ``is_sufficient``, only by these."""

    class_uid: int
    classes: tuple[int, ...]
    conditions: tuple[ValueCondition, ...]
    is_sufficient: bool


@dataclass(frozen=True, slots=True)
class Axioms:
    """Axioms beyond hierarchy and disjointness, as uids."""

    definitions: tuple[Definition, ...] = ()
    inverses: tuple[tuple[int, int], ...] = ()
    transitive: tuple[int, ...] = ()
    sub_attributes: tuple[tuple[int, int], ...] = ()


NO_AXIOMS = Axioms()


class CompiledAxioms:
    """Compiled axioms. Masks have bit c for class c, followed by one bit per condition.

    Attributes:
        superclasses: mask of all classes and conditions of the instances of each class, itself included.
        entailed: links that follow from a link of each attribute: (attribute, reversed), itself first.
        sources: inverse of ``entailed``: attributes whose links entail one of each attribute.
        derived: attributes that may have inferred links.
        heeded: attributes whose values may lead to a conclusion.
    """

    def __init__(self, superclass_masks: Sequence[int], ends: Sequence[tuple[int, int | None]], axioms: Axioms) -> None:
        """Compile axioms; ``superclass_masks`` as asserted, ``ends`` (domain, range) of attributes."""
        self.n_classes = len(superclass_masks)
        self.entailed = _entailments(len(ends), axioms)
        self.sources = tuple(
            tuple((a, flipped) for a, links in enumerate(self.entailed) for b, flipped in links if b == uid)
            for uid in range(len(ends))
        )
        # The inverse of a transitive link is transitive.
        inverse = {*axioms.inverses, *((b, a) for a, b in axioms.inverses)}
        self.transitive = frozenset({*axioms.transitive, *(b for a, b in inverse if a in axioms.transitive)})
        sufficient = [each for each in axioms.definitions if each.is_sufficient]
        self.conditions = tuple(dict.fromkeys(condition for each in sufficient for condition in each.conditions))
        self.of_links = tuple(condition for condition in self.conditions if condition.filler is not None)
        self._bits = {condition: 1 << self.n_classes + k for k, condition in enumerate(self.conditions)}
        self._sufficient = [
            (sum(1 << c for c in set(each.classes)) | sum(map(self.bit_of, each.conditions)), each.class_uid)
            for each in sufficient
        ]
        self._closed: dict[int, int] = {}
        self.superclasses = self._saturated(superclass_masks, ends, axioms.definitions)
        linked = {a for pair in (*axioms.inverses, *axioms.sub_attributes) for a in pair} | self.transitive
        self.derived = frozenset(a for a in linked if len(self.sources[a]) > 1 or a in self.transitive)
        conditional = linked.union(condition.attribute for condition in self.conditions)
        self.heeded = frozenset(source for a in conditional for source, _ in self.sources[a])
        self.is_needed = bool(sufficient or self.heeded)

    def bit_of(self, condition: ValueCondition) -> int:
        """Return the mask of a condition in ``conditions``."""
        return self._bits[condition]

    def closed(self, mask: int) -> int:
        """Return all classes and conditions that follow from a mask closed under superclasses."""
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
        self, asserted: Sequence[int], ends: Sequence[tuple[int, int | None]], definitions: Sequence[Definition]
    ) -> tuple[int, ...]:
        masks = list(asserted)
        asked: list[set[ValueCondition]] = [set() for _ in masks]
        for each in definitions:
            masks[each.class_uid] |= sum(1 << c for c in set(each.classes))
            asked[each.class_uid].update(each.conditions)
        before: list[tuple[int, int]] = []
        while before != (now := [(mask, len(conditions)) for mask, conditions in zip(masks, asked, strict=True)]):
            before = now
            # A class has the conditions of its superclasses and of the links that transitivity adds.
            for uid in range(len(masks)):
                for above in _bits_of(masks[uid], len(masks)):
                    masks[uid] |= masks[above]
                    asked[uid] |= asked[above]
                for condition in tuple(asked[uid]):
                    asked[uid] |= self._led_on(condition, asked)
                    # An instance with a value is of the domain, and meets the weaker conditions.
                    masks[uid] |= masks[ends[condition.attribute][0]] | self._met_by(condition, masks, ends)
                masks[uid] = self._close(masks[uid], masks)
        return tuple(masks)

    def _met_by(self, asked: ValueCondition, masks: Sequence[int], ends: Sequence[tuple[int, int | None]]) -> int:
        if asked.filler is None:
            return self._bits.get(asked, 0)
        range_class = ends[asked.attribute][1]
        filler = masks[asked.filler] | (0 if range_class is None else masks[range_class])
        met = [
            c
            for c in self.of_links
            if (c.attribute, False) in self.entailed[asked.attribute] and filler >> (c.filler or 0) & 1
        ]
        return sum(map(self.bit_of, met))

    def _led_on(self, asked: ValueCondition, all_asked: Sequence[set[ValueCondition]]) -> set[ValueCondition]:
        if asked.filler is None:
            return set()
        return {
            ValueCondition(a, condition.filler)
            for a, flipped in self.entailed[asked.attribute]
            if a in self.transitive and not flipped
            for condition in all_asked[asked.filler]
            if condition.filler is not None and (a, False) in self.entailed[condition.attribute]
        }


Entailed = tuple[tuple[int, bool], ...]  # attributes of the links that follow from a link, each with True if reversed


def _entailments(n_attributes: int, axioms: Axioms) -> tuple[Entailed, ...]:
    steps: list[set[tuple[int, bool]]] = [set() for _ in range(n_attributes)]
    for a, b in axioms.inverses:
        steps[a].add((b, True))
        steps[b].add((a, True))
    for below, above in axioms.sub_attributes:
        steps[below].add((above, False))
    entailed = []
    for uid in range(n_attributes):
        reached = [(uid, False)]
        for a, flipped in reached:  # grows during the iteration
            for b, turned in sorted(steps[a]):
                if (link := (b, flipped != turned)) not in reached:
                    reached.append(link)
        entailed.append(tuple(reached))
    return tuple(entailed)


def _bits_of(mask: int, n: int) -> list[int]:
    return [bit for bit in range(n) if mask >> bit & 1]
