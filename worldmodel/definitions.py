"""Reading what OWL says of classes and attributes beyond hierarchy, disjointness, domain and range.

Compiled are, of a class: rdfs:subClassOf and owl:equivalentClass of a named class or of a class expression, which is

    [ owl:intersectionOf ( ... ) ]                                       named classes, restrictions
    [ a owl:Restriction ; owl:onProperty p ; owl:someValuesFrom C ]      p a link, C a named class
    [ a owl:Restriction ; owl:onProperty p ; owl:hasValue v ]            v a literal, p no link

of a link: owl:inverseOf, owl:TransitiveProperty, owl:SymmetricProperty and rdfs:subPropertyOf of links.

``HARMLESS`` are annotations, which change no answer. Whatever else OWL or RDFS says of a class or an attribute would
change answers, so it is refused; a file for reasoners alone may say it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Protocol

from rdflib import OWL, RDF, RDFS, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from worldmodel.axioms import Axioms, CompiledAxioms, Definition, ValueCondition
from worldmodel.fields import Value
from worldmodel.tbox import Attribute, OntologyClass, ValueKind, closure

DEFINING = {RDFS.subClassOf, RDFS.subPropertyOf, OWL.equivalentClass, OWL.inverseOf}
"""Predicates that define the class or attribute that is their subject."""
HARMLESS = {
    *(RDFS.label, RDFS.comment, RDFS.seeAlso, RDFS.isDefinedBy, OWL.versionInfo, OWL.deprecated),
    *(OWL.priorVersion, OWL.backwardCompatibleWith, OWL.incompatibleWith),
}
_OF_CLASSES = {RDF.type, RDFS.subClassOf, OWL.equivalentClass, OWL.disjointWith}
_OF_LINKS = {RDF.type, RDFS.domain, RDFS.range, RDFS.subPropertyOf, OWL.inverseOf}
_OF_DATA = {RDF.type, RDFS.domain, RDFS.range}
_CLASS_TYPES = {OWL.Class, RDFS.Class, OWL.NamedIndividual}
_DATA_TYPES = {OWL.DatatypeProperty, RDF.Property, OWL.NamedIndividual}
_LINK_TYPES = {OWL.ObjectProperty, RDF.Property, OWL.TransitiveProperty, OWL.SymmetricProperty, OWL.NamedIndividual}
_REFUSED_AXIOMS = (OWL.AllDisjointProperties, OWL.NegativePropertyAssertion)
_ELSEWHERE = "; a file for reasoners that no scenario reads may say more"
_EXPRESSIONS = (
    "a declared class, owl:intersectionOf of such, a restriction with owl:someValuesFrom a declared class, or with "
    f"owl:hasValue a literal{_ELSEWHERE}"
)


class OntologyReader(Protocol):
    """What reads the rest of the ontology: it shows terms and collects faults."""

    def fault(self, subject: Node, wrong: str, allowed: str) -> None:
        """Note one fault of ``subject``."""

    def shown(self, term: Node) -> str:
        """Return a term as a Turtle file would write it."""

    def hint(self, term: Node, known: Iterable[Node]) -> str:
        """Propose the known term most like an unknown one."""


@dataclass(frozen=True)
class _Expression:
    """A class expression as it was read: named classes, and (property, restriction predicate, object)."""

    classes: tuple[int, ...]
    restrictions: tuple[tuple[Node, URIRef, Node], ...]


class Definitions:
    """Reads the definitions out of ``graph``; ``reader`` takes the faults."""

    def __init__(self, graph: Graph, class_uid: Mapping[Node, int], reader: OntologyReader) -> None:
        self.graph = graph
        self.class_uid = class_uid
        self.reader = reader
        self._read: list[tuple[Node, _Expression, bool]] = []

    def parents_of(self, iri: Node) -> set[int]:
        """Return the named classes right above a class, also those that its definitions name."""
        self._refuse_others(iri, _OF_CLASSES, _CLASS_TYPES)
        parents: set[int] = set()
        for predicate in (RDFS.subClassOf, OWL.equivalentClass):
            for target in sorted(self.graph.objects(iri, predicate), key=str):
                if predicate == RDFS.subClassOf and target in self.class_uid:
                    parents.add(self.class_uid[target])
                elif not isinstance(target, BNode):
                    self._refuse_name(iri, predicate, target)
                elif (expression := self._expression(iri, target)) is not None:
                    parents.update(expression.classes)
                    self._read.append((iri, expression, predicate == OWL.equivalentClass))
        return parents

    def _refuse_name(self, iri: Node, predicate: URIRef, target: Node) -> None:
        shown = self.reader.shown
        if target in self.class_uid:
            self.reader.fault(iri, f"it is the same class as {shown(target)}", "one name for a class")
        elif (target, RDF.type, OWL.Class) not in self.graph:  # those of the situation vocabulary stay in the graph
            what = "superclass" if predicate == RDFS.subClassOf else "equivalent class"
            wrong = f"its {what} {shown(target)} is not declared"
            self.reader.fault(iri, wrong, f"a declared owl:Class{self.reader.hint(target, self.class_uid)}")

    def _expression(self, iri: Node, node: Node) -> _Expression | None:
        """Return a class expression; None, and a fault, if it is none of those that are compiled."""
        if node in self.class_uid:
            return _Expression((self.class_uid[node],), ())
        says = {p: o for p, o in self.graph.predicate_objects(node) if p != RDF.type}
        if set(says) == {OWL.intersectionOf}:
            parts = [self._expression(iri, part) for part in Collection(self.graph, says[OWL.intersectionOf])]
            whole = [part for part in parts if part is not None]
            return _Expression(
                tuple(dict.fromkeys(c for part in whole for c in part.classes)),
                tuple(dict.fromkeys(r for part in whole for r in part.restrictions)),
            )
        for predicate in (OWL.someValuesFrom, OWL.hasValue):
            if set(says) == {OWL.onProperty, predicate}:
                return _Expression((), ((says[OWL.onProperty], predicate, says[predicate]),))
        if isinstance(node, URIRef):
            wrong = f"its definition names {self.reader.shown(node)}, which is not declared"
            self.reader.fault(iri, wrong, f"a declared owl:Class{self.reader.hint(node, self.class_uid)}")
        else:
            predicates = ", ".join(sorted(self.reader.shown(p) for p in says)) or "nothing"
            self.reader.fault(iri, f"its definition says {predicates}", _EXPRESSIONS)
        return None

    def axioms(self, attributes: Sequence[Attribute]) -> Axioms:
        """Return the axioms; the classes must have been asked for before."""
        named: dict[Node, Attribute] = {URIRef(attribute.iri): attribute for attribute in attributes[1:]}
        definitions = []
        for iri, expression, is_sufficient in self._read:
            made = [self._condition(iri, named, *restriction) for restriction in expression.restrictions]
            conditions = tuple(condition for condition in made if condition is not None)
            definitions.append(Definition(self.class_uid[iri], expression.classes, conditions, is_sufficient))
        self._refuse_circular(definitions)
        self._refuse_anonymous()
        for term, attribute in named.items():
            is_link = attribute.kind is ValueKind.LINK
            self._refuse_others(term, _OF_LINKS if is_link else _OF_DATA, _LINK_TYPES if is_link else _DATA_TYPES)
        inverses = {(min(pair), max(pair)) for pair in self._pairs(OWL.inverseOf, named)}
        symmetric = [named[iri].uid for iri in self.graph.subjects(RDF.type, OWL.SymmetricProperty) if iri in named]
        transitive = [named[iri].uid for iri in self.graph.subjects(RDF.type, OWL.TransitiveProperty) if iri in named]
        below = set(self._pairs(RDFS.subPropertyOf, named))
        self._refuse_cycles(below, attributes)
        return Axioms(
            tuple(sorted(definitions, key=repr)),
            tuple(sorted({*inverses, *((uid, uid) for uid in symmetric)})),
            tuple(sorted(transitive)),
            tuple(sorted(below)),
        )

    def _condition(
        self, iri: Node, named: Mapping[Node, Attribute], on: Node, predicate: URIRef, target: Node
    ) -> ValueCondition | None:
        fault, shown = self.reader.fault, self.reader.shown
        if on not in named:
            wrong = f"its definition is about {shown(on)}, which is no attribute"
            fault(iri, wrong, f"a declared owl:ObjectProperty or owl:DatatypeProperty{self.reader.hint(on, named)}")
            return None
        attribute = named[on]
        if predicate == OWL.someValuesFrom:
            if attribute.kind is ValueKind.LINK and target in self.class_uid:
                return ValueCondition(attribute.uid, filler=self.class_uid[target])
            wrong = f"owl:someValuesFrom of {shown(on)} is {shown(target)}"
            fault(iri, wrong, f"a declared class, of a link{self.reader.hint(target, self.class_uid)}")
            return None
        value = _stored(attribute, target)
        if value is None:
            allowed = f"a literal in its range that is stored as it is, of an attribute that is no link{_ELSEWHERE}"
            fault(iri, f"owl:hasValue of {shown(on)} is {shown(target)}", allowed)
            return None
        return ValueCondition(attribute.uid, value=value)

    def _pairs(self, predicate: URIRef, named: Mapping[Node, Attribute]) -> Iterator[tuple[int, int]]:
        """Yield what ``predicate`` says between two links; anything else is a fault."""
        links = {iri for iri, attribute in named.items() if attribute.kind is ValueKind.LINK}
        for iri in sorted(links, key=str):
            for target in sorted(self.graph.objects(iri, predicate), key=str):
                if target in links:
                    yield named[iri].uid, named[target].uid
                else:
                    wrong = f"its {self.reader.shown(predicate)} {self.reader.shown(target)} is no link"
                    self.reader.fault(iri, wrong, f"a declared owl:ObjectProperty{self.reader.hint(target, links)}")

    def classified(
        self, classes: Sequence[OntologyClass], attributes: Sequence[Attribute], axioms: Axioms
    ) -> list[OntologyClass]:
        """Return the classes with every superclass that follows from the axioms, or note what is wrong with these."""
        rules = CompiledAxioms(classes, attributes, axioms)
        self._refuse_unlike_ends(rules, attributes)
        classified, told = [], closure(classes)
        for c in classes:
            new = [d.uid for d in classes if (rules.superclasses[c.uid] & ~told[c.uid]) >> d.uid & 1]
            for other in new:
                if rules.superclasses[other] >> c.uid & 1:
                    wrong = f"the definitions make it the same class as {classes[other].name}"
                    self.reader.fault(URIRef(c.iri), wrong, "one name for a class")
            classified.append(replace(c, parents=tuple(sorted({*c.parents, *new}))))
        return classified

    def _refuse_unlike_ends(self, rules: CompiledAxioms, attributes: Sequence[Attribute]) -> None:
        """Refuse links that say another link of things that are not known to be of its domain and range."""
        for attribute in attributes:
            for uid, flipped in rules.entailed[attribute.uid]:
                entailed = attributes[uid]
                ends = (attribute.domain, attribute.range_class)
                own_ends = ends[::-1] if flipped else ends
                for what, end, asked in zip(
                    ("domain", "range"), own_ends, (entailed.domain, entailed.range_class), strict=True
                ):
                    if end is not None and asked is not None and not rules.superclasses[end] >> asked & 1:
                        turned = ", the other way round," if flipped else ""
                        wrong = f"it says {entailed.name}{turned} of what need not be of the {what} of {entailed.name}"
                        self.reader.fault(URIRef(attribute.iri), wrong, "ends that are of the classes it asks for")

    def _refuse_circular(self, definitions: Sequence[Definition]) -> None:
        """Refuse classes that are defined by themselves."""
        mentions: dict[int, set[int]] = {}
        for each in definitions:
            if each.is_sufficient:
                fillers = {condition.filler for condition in each.conditions if condition.filler is not None}
                mentions.setdefault(each.class_uid, set()).update(each.classes, fillers)
        self._refuse_circles(
            mentions, dict(enumerate(self.class_uid)), "it is defined by itself", "definitions by other classes"
        )

    def _refuse_cycles(self, below: Iterable[tuple[int, int]], attributes: Sequence[Attribute]) -> None:
        above: dict[int, set[int]] = {}
        for a, b in below:
            above.setdefault(a, set()).add(b)
        iris = {attribute.uid: URIRef(attribute.iri) for attribute in attributes}
        self._refuse_circles(above, iris, "it is below itself (rdfs:subPropertyOf)", "a hierarchy")

    def _refuse_circles(
        self, arrows: Mapping[int, set[int]], iris: Mapping[int, Node], wrong: str, allowed: str
    ) -> None:
        """Note one fault for each circle, at its first term."""
        reported: set[int] = set()
        for start in sorted(arrows):
            reached = _reach(arrows, start)
            if start in reached and start not in reported:
                circle = [uid for uid in sorted(reached) if uid == start or start in _reach(arrows, uid)]
                reported.update(circle)
                names = ", ".join(self.reader.shown(iris[uid]) for uid in circle)
                self.reader.fault(iris[start], f"{wrong}: {names}", allowed)

    def _refuse_others(self, iri: Node, predicates: set[URIRef], types: set[URIRef]) -> None:
        """Refuse what OWL or RDFS says of a term and is not compiled."""
        for predicate in sorted(set(self.graph.predicates(iri)) - predicates - HARMLESS, key=str):
            if str(predicate).startswith((str(OWL), str(RDFS))):
                allowed = ", ".join(sorted(map(self.reader.shown, predicates))) + f" and annotations{_ELSEWHERE}"
                self.reader.fault(iri, f"{self.reader.shown(predicate)} is not compiled", allowed)
        for kind in sorted(set(self.graph.objects(iri, RDF.type)) - types, key=str):
            if str(kind).startswith((str(OWL), str(RDFS))):
                allowed = ", ".join(sorted(map(self.reader.shown, types))) + _ELSEWHERE
                self.reader.fault(iri, f"the type {self.reader.shown(kind)} is not compiled", allowed)

    def _refuse_anonymous(self) -> None:
        """Refuse axioms that have no class or attribute as their subject."""
        for predicate in (RDFS.subClassOf, OWL.equivalentClass):
            for subject in self.graph.subjects(predicate, None, unique=True):
                if isinstance(subject, BNode):
                    wrong = f"{self.reader.shown(predicate)} of a class without a name"
                    self.reader.fault(subject, wrong, "a declared class that is equivalent to it")
        for kind in _REFUSED_AXIOMS:
            for subject in self.graph.subjects(RDF.type, kind):
                self.reader.fault(subject, f"{self.reader.shown(kind)} is not compiled", f"none{_ELSEWHERE}")


def _stored(attribute: Attribute, term: Node) -> Value | None:
    """Return the value that a literal stands for, if the attribute stores it as it is."""
    value = term.toPython() if isinstance(term, Literal) else None
    if attribute.kind is ValueKind.SYMBOL and value in attribute.symbols:
        return attribute.symbols.index(value)
    if attribute.kind is ValueKind.TEXT and type(value) is str:
        return value
    if attribute.kind is ValueKind.BOOLEAN and isinstance(value, bool):
        return value
    if attribute.kind is ValueKind.NUMBER and isinstance(value, (int, float, Decimal)) and not isinstance(value, bool):
        try:
            stored = attribute.quantise(float(value))
        except ValueError:
            return None
        return stored if stored == float(value) else None
    return None


def _reach(arrows: Mapping[int, set[int]], start: int) -> set[int]:
    reached: set[int] = set()
    front = [start]
    while front:
        new = arrows.get(front.pop(), set()) - reached
        reached |= new
        front += new
    return reached
