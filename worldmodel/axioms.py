"""What an ontology lets one conclude, and the tables by which it is concluded.

``Axioms`` are what was read: definitions of classes, and how attributes that link instances hang together.
``CompiledAxioms`` are what follows from them for every world model of that ontology. A condition such as "some part of
it is a Sonar" becomes a class without a name, one more bit of a mask, so that classes follow from classes by masks
alone. What holds of all instances of a class (each Towfish has some part that is a Sonar) follows from the classes
too; ``superclasses`` has it, so that a hierarchy is complete before the first fact comes.

The rules are those of OWL 2 EL for subclasses, intersections and existential restrictions, and its way with whatever
else a definition says: each expression is a class without a name (Baader, Brandt, Lutz, Pushing the EL envelope, 2005).
What is not a rule of one conclusion, such as a union, is a *covering*: who is of the whole is of one of the parts. Of
the parts that do not clash with what else is known, what all of them come to follows. Of things that a definition asks
for and nobody named, conclusions are drawn one step from those that are named.
"""

from __future__ import annotations

import dataclasses
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


def _shown(each: object, first: str, always: int) -> str:
    """Return a value as the digest of tables has it: its first ``always`` fields, and those that say something."""
    parts = dataclasses.fields(each)  # type: ignore[arg-type]
    said = [f for k, f in enumerate(parts) if k < always or getattr(each, f.name) != f.default]
    return f"{first}({', '.join(f'{f.name}={getattr(each, f.name)!r}' for f in said)})"


@dataclass(frozen=True, slots=True, repr=False)
class ValueCondition:
    """A condition on the values of one attribute: one is an instance of class ``filler``, or is ``value``.

    ``is_backward``: it is an instance of ``filler`` that links to it. Without a filler and a value, one is from ``low``
    to ``high``, or ``among`` some, or is there at all; ``is_not``: one is there that is none of those.
    """

    attribute: int
    filler: int | None = None
    value: Value | None = None
    is_backward: bool = False
    low: float | None = None
    high: float | None = None
    among: tuple[Value, ...] = ()
    is_not: bool = False

    def holds(self, value: Value) -> bool:
        """True if a value is one of those."""
        if self.value is not None:
            return (value == self.value) is not self.is_not
        if self.low is not None and self.high is not None:
            return (isinstance(value, (int, float)) and self.low <= value <= self.high) is not self.is_not
        return (not self.among or value in self.among) is not self.is_not

    def negated(self) -> ValueCondition:
        """Return the condition that a value is none of those."""
        return dataclasses.replace(self, is_not=not self.is_not)

    def implies(self, other: ValueCondition) -> bool:
        """True if whatever meets this condition on values meets the other one."""
        if self.attribute != other.attribute or self.filler is not None or other.filler is not None:
            return False
        if self == other or other == ValueCondition(self.attribute):
            return True
        if self.is_not:
            return other.is_not and other.negated().implies(self.negated())
        if self.value is not None or self.among:
            return all(other.holds(value) for value in self.among or (self.value,) if value is not None)
        if self.low is None or self.high is None or ((other.low is None or other.high is None) and not other.is_not):
            return False
        if other.low is not None and other.high is not None:
            if other.is_not:
                return self.high < other.low or other.high < self.low
            return other.low <= self.low and self.high <= other.high
        return all(
            other.holds(value) for value in other.among or (other.value,) if value is not None and self.holds(value)
        )

    def in_words(self) -> str:
        """Return which values these are, as a message says it."""
        if self.value is not None or self.among:
            words = " or ".join(map(str, self.among or (self.value,)))
        else:
            words = "of any value" if self.low is None else f"{self.low:g} to {self.high:g}"
        return f"other than {words}" if self.is_not else words

    def __repr__(self) -> str:
        return _shown(self, "ValueCondition", always=3)


@dataclass(frozen=True, slots=True)
class Definition:
    """What the instances of a class have in common: they are of ``classes``, and meet ``conditions``.

    ``is_sufficient``: whatever is so is an instance of the class.
    """

    class_uid: int
    classes: tuple[int, ...]
    conditions: tuple[ValueCondition, ...]
    is_sufficient: bool


@dataclass(frozen=True, slots=True, repr=False)
class Axioms:
    """The axioms of an ontology beyond hierarchy and disjointness, all uids.

    Attributes:
        definitions: of classes, by equivalence or by what is necessary.
        inverses: pairs of attributes, each the other way round; an attribute with itself is symmetric.
        transitive: attributes that lead on.
        sub_attributes: pairs of an attribute and one above it.
        unnamed: what the classes without a name are, in words; their uids follow those of the named classes.
        nominals: (class, name) where a class has that individual alone; the class that follows it has all others.
        coverings: (class, parts): each instance is of one of the parts.
        excluded: pairs of classes that have no instance in common, one of them without a name.
        single: (class, attribute, whether backward): an instance has at most one such link.
        chains: (attribute, parts): links that lead one into the next are a link of the attribute.
    """

    definitions: tuple[Definition, ...] = ()
    inverses: tuple[tuple[int, int], ...] = ()
    transitive: tuple[int, ...] = ()
    sub_attributes: tuple[tuple[int, int], ...] = ()
    unnamed: tuple[str, ...] = ()
    nominals: tuple[tuple[int, str], ...] = ()
    coverings: tuple[tuple[int, tuple[int, ...]], ...] = ()
    excluded: tuple[tuple[int, int], ...] = ()
    single: tuple[tuple[int, int, bool], ...] = ()
    chains: tuple[tuple[int, tuple[int, ...]], ...] = ()

    def __repr__(self) -> str:
        return _shown(self, "Axioms", always=4)


NO_AXIOMS = Axioms()


_DEPTH = 2
"""How many choices between the parts of coverings are made one within the other."""


class CompiledAxioms:
    """The axioms compiled. All masks have bit c for class c, and behind these a bit for each condition.

    Attributes:
        n_classes: the number of classes with a name; those without one follow them.
        conditions: those that suffice for something; ``bit_of`` has their bits.
        superclasses: for each class all that its instances are known to be, itself included.
        empty: classes that can have no instance.
        entailed: for each attribute what a link of it says: (attribute, whether the other way round), itself first.
        sources: for each attribute that has any, the attributes whose links say it, in the same form.
        transitive: attributes that lead on, inverses included.
        chains: by attribute, the links that come to one of it.
        single: as of ``Axioms``.
        bound: (bit, attribute, individual): who is of the condition of that bit has this link.
        derived: attributes that may have links which nobody told.
        far: attributes whose links may lead to conclusions about instances at neither end, or backward.
        heeded: attributes of which a value may lead to a conclusion.
    """

    def __init__(
        self,
        classes: Sequence[Classified],
        attributes: Sequence[Linking],
        axioms: Axioms,
        disjoint: Sequence[tuple[int, int]] = (),
    ) -> None:
        self.n_classes = len(classes)
        n_all = self.n_classes + len(axioms.unnamed)
        self.unnamed = axioms.unnamed
        self.entailed = entailments(len(attributes), axioms)
        self.sources = tuple(
            tuple((a, flipped) for a, links in enumerate(self.entailed) for b, flipped in links if b == uid)
            for uid in range(len(attributes))
        )
        inverse = {*axioms.inverses, *((b, a) for a, b in axioms.inverses)}
        self.transitive = frozenset({*axioms.transitive, *(b for a, b in inverse if a in axioms.transitive)})
        self.chains = {head: [parts for a, parts in axioms.chains if a == head] for head, _ in axioms.chains}
        self.single = axioms.single
        sufficient = [each for each in axioms.definitions if each.is_sufficient]
        self.conditions = tuple(dict.fromkeys(condition for each in sufficient for condition in each.conditions))
        self._of_links = [condition for condition in self.conditions if condition.filler is not None]
        self._bits = {condition: 1 << n_all + k for k, condition in enumerate(self.conditions)}
        self._nothing = 1 << n_all + len(self.conditions)
        self._sufficient = [
            (
                sum({*(1 << c for c in each.classes), *(self._bits[condition] for condition in each.conditions)}),
                each.class_uid,
            )
            for each in sufficient
        ]
        self._excluded = [*disjoint, *axioms.excluded]
        self._coverings = [(whole, parts, sum(1 << part for part in parts)) for whole, parts in axioms.coverings]
        self._nominals = {name: uid for uid, name in axioms.nominals}
        self._closed: dict[int, int] = {}
        self.empty: set[int] = set()
        self.superclasses = self._saturated(classes, attributes, axioms)
        names = dict(axioms.nominals)
        self.bound = tuple(
            (self._bits[c], c.attribute, names[c.filler])
            for c in self.conditions
            if c.filler in names and not c.is_backward
        )
        told_beyond = {*self.chains, *(attribute for _, attribute, _ in self.bound)}
        linked = {a for pair in (*axioms.inverses, *axioms.sub_attributes) for a in pair} | self.transitive
        linked |= {a for head, parts in axioms.chains for a in (head, *parts)} | told_beyond
        self.derived = frozenset(
            a for a in linked if len(self.sources[a]) > 1 or a in self.transitive or self._rests_on(a, told_beyond)
        )
        conditional = {
            *(source for condition in self.conditions for source, _ in self.sources[condition.attribute]),
            *(source for _, attribute, _ in axioms.single for source, _ in self.sources[attribute]),
        }
        self.heeded = frozenset(conditional | {source for a in linked for source, _ in self.sources[a]})
        backward = {c.attribute for c in self.conditions if c.is_backward}
        self.far = (
            frozenset(a for a in range(len(attributes)) if self.says(a) & (backward | self.chains.keys()))
            if backward or self.chains
            else frozenset()
        )

    @property
    def is_needed(self) -> bool:
        """True if facts may lead to conclusions."""
        return bool(self._sufficient or self.heeded)

    def says(self, attribute: int) -> set[int]:
        """Return the attributes of which a link may be, or be a part, where there is one of ``attribute``."""
        front = [attribute]
        for a in front:  # grows while it is read
            above = [b for b, _ in self.entailed[a]]
            above += [head for head, chains in self.chains.items() if any(a in parts for parts in chains)]
            front += [b for b in above if b not in front]
        return set(front)

    def _rests_on(self, attribute: int, others: set[int]) -> bool:
        return any(attribute in self.says(other) for other in others)

    def bit_of(self, condition: ValueCondition) -> int:
        """Return the mask of a condition that suffices for something."""
        return self._bits[condition]

    def own(self, name: str | None) -> int:
        """Return what a thing is by its name alone, bit c for class c; None for one that no file names."""
        nominal = None if name is None else self._nominals.get(name)
        return sum(1 << uid + (uid != nominal) for uid in self._nominals.values())

    def closed(self, mask: int) -> int:
        """Return all classes and conditions of an instance that is known to be of those in ``mask``."""
        closure = self._closed.get(mask)
        if closure is None:
            told = mask
            for uid in _bits_of(mask, len(self.superclasses)) if self.unnamed else ():
                told |= self.superclasses[uid]
            closure = self._closed[mask] = self._close(told, self.superclasses)
        return closure

    def clashes(self, mask: int) -> list[tuple[int, int]]:
        """Return the pairs of classes in a mask that have no instance in common; the first twice if there is none."""
        pairs = [(a, b) for a, b in self._excluded if mask >> a & mask >> b & 1]
        return pairs or ([(0, 0)] if mask & self._nothing else [])

    def _close(self, mask: int, superclasses: Sequence[int], depth: int = _DEPTH) -> int:
        before = -1
        while before != mask:
            before = mask
            for needed, class_uid in self._sufficient:
                if not needed & ~mask:
                    mask |= superclasses[class_uid]
            if before == mask and depth and self._coverings:
                mask |= self._of_any_part(mask, superclasses, depth)
        return mask

    def _of_any_part(self, mask: int, superclasses: Sequence[int], depth: int) -> int:
        """Return what each part comes to of the coverings of which none is known to hold."""
        found = 0
        for whole, parts, of_parts in self._coverings:
            if mask >> whole & 1 and not mask & of_parts and not mask & self._nothing:
                cases = [self._close(mask | superclasses[part], superclasses, depth - 1) for part in parts]
                possible = [case for case in cases if not self.clashes(case)]
                common = possible[0] if possible else self._nothing
                for case in possible:
                    common &= case
                found |= common
        return found

    def _saturated(
        self, classes: Sequence[Classified], attributes: Sequence[Linking], axioms: Axioms
    ) -> tuple[int, ...]:
        """Return ``superclasses``: what is told, and what follows from what is necessary, until nothing new does."""
        thing = next((c.uid for c in classes if not c.parents), 0)
        masks = [1 << c.uid | sum(1 << parent for parent in c.parents) for c in classes]
        masks += [1 << self.n_classes + k | 1 << thing for k in range(len(axioms.unnamed))]
        asked: list[set[ValueCondition]] = [set() for _ in masks]
        for each in axioms.definitions:
            masks[each.class_uid] |= sum(1 << c for c in set(each.classes))
            asked[each.class_uid].update(each.conditions)
        before: list[tuple[int, int]] = []
        while before != (now := [(mask, len(asked_mask)) for mask, asked_mask in zip(masks, asked, strict=True)]):
            before = now
            for uid in range(len(masks)):
                for above in _bits_of(masks[uid], len(masks)):
                    masks[uid] |= masks[above]
                    asked[uid] |= asked[above]
                for condition in tuple(asked[uid]):
                    asked[uid] |= self._led_on(condition, asked)
                    of = attributes[condition.attribute]
                    end = of.range_class if condition.is_backward else of.domain
                    masks[uid] |= (0 if end is None else masks[end]) | self._met_by(condition, uid, masks, attributes)
                masks[uid] = self._close(masks[uid], masks)
        self.empty |= {uid for uid, mask in enumerate(masks) if self.clashes(mask)}
        n_empty = -1
        while n_empty != len(self.empty):
            n_empty = len(self.empty)
            for uid, mask in enumerate(masks):
                if any(mask >> c & 1 for c in self.empty) or any(c.filler in self.empty for c in asked[uid]):
                    self.empty.add(uid)
        return tuple(masks)

    def _met_by(self, asked: ValueCondition, uid: int, masks: Sequence[int], attributes: Sequence[Linking]) -> int:
        """Return the conditions that an instance of class ``uid`` meets since it meets ``asked``."""
        if asked.filler is None:
            return sum(self._bits[c] for c in self.conditions if c == asked or asked.implies(c))
        entailed = {(attribute, flipped != asked.is_backward) for attribute, flipped in self.entailed[asked.attribute]}
        of = attributes[asked.attribute]
        range_class = of.domain if asked.is_backward else of.range_class
        filler = masks[asked.filler] | (0 if range_class is None else masks[range_class])
        back = sum(
            self._bits[c]
            for c in self._of_links
            if c.filler is not None and (c.attribute, not c.is_backward) in entailed and masks[uid] >> c.filler & 1
        )
        if back:
            filler = self._close(filler | back, masks)
            if self.clashes(filler):
                self.empty.add(uid)
        met = [
            c
            for c in self._of_links
            if c.filler is not None and (c.attribute, c.is_backward) in entailed and filler >> c.filler & 1
        ]
        return sum(self._bits[condition] for condition in met)

    def _led_on(self, asked: ValueCondition, all_asked: Sequence[set[ValueCondition]]) -> set[ValueCondition]:
        """Return what an attribute that leads on, or a chain, asks of whatever meets ``asked``."""
        if asked.filler is None or asked.is_backward:
            return set()
        said = {a for a, flipped in self.entailed[asked.attribute] if not flipped}
        found = {
            ValueCondition(a, condition.filler)
            for a in said & self.transitive
            for condition in all_asked[asked.filler]
            if condition.filler is not None
            and not condition.is_backward
            and (a, False) in self.entailed[condition.attribute]
        }
        for head, chains in self.chains.items():
            for first, *others in chains:
                if first in said:
                    found |= {ValueCondition(head, end) for end in self._ends(asked.filler, others, all_asked)}
        return found

    def _ends(self, start: int, parts: Sequence[int], all_asked: Sequence[set[ValueCondition]]) -> set[int]:
        """Return the classes of what a chain leads to from an instance of a class, by what is asked of each."""
        fillers = {start}
        for part in parts:
            fillers = {
                c.filler
                for filler in fillers
                for c in all_asked[filler]
                if c.filler is not None and not c.is_backward and (part, False) in self.entailed[c.attribute]
            }
        return fillers


Said = tuple[tuple[int, bool], ...]
"""Attributes that a link says, each with whether it says them the other way round."""


def entailments(n_attributes: int, axioms: Axioms) -> tuple[Said, ...]:
    """Return what a link of each attribute says by inverses and attributes above it, itself first."""
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
    return tuple(entailed)


def _bits_of(mask: int, n: int) -> list[int]:
    return [bit for bit in range(n) if mask >> bit & 1]
