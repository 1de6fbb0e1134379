"""Reading what OWL says of classes and attributes beyond hierarchy, disjointness, domain and range.

Compiled are, of a class: rdfs:subClassOf and owl:equivalentClass of a named class or of a class expression, which
``worldmodel.expressions`` reads, and owl:disjointUnionOf; of a link: owl:inverseOf, owl:TransitiveProperty,
owl:SymmetricProperty, rdfs:subPropertyOf of links, owl:FunctionalProperty, owl:InverseFunctionalProperty and
owl:propertyChainAxiom; of any other attribute: owl:FunctionalProperty.

``HARMLESS`` are annotations, which change no answer. Whatever else OWL or RDFS says of a class or an attribute would
change answers, so it is refused; a file for reasoners alone may say it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from rdflib import OWL, RDF, RDFS, BNode, Graph, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from worldmodel.axioms import Axioms, CompiledAxioms, Definition
from worldmodel.expressions import ELSEWHERE, Expressions, OntologyReader
from worldmodel.tbox import Attribute, OntologyClass, ValueKind, closure
from worldmodel.unnamed import Unnamed

DEFINING = {
    *(RDFS.subClassOf, RDFS.subPropertyOf, OWL.equivalentClass, OWL.inverseOf, OWL.disjointUnionOf),
    OWL.propertyChainAxiom,
}
"""Predicates that define the class or attribute that is their subject."""
HARMLESS = {
    *(RDFS.label, RDFS.comment, RDFS.seeAlso, RDFS.isDefinedBy, OWL.versionInfo, OWL.deprecated),
    *(OWL.priorVersion, OWL.backwardCompatibleWith, OWL.incompatibleWith),
}
_OF_CLASSES = {RDF.type, RDFS.subClassOf, OWL.equivalentClass, OWL.disjointWith, OWL.disjointUnionOf}
_OF_LINKS = {RDF.type, RDFS.domain, RDFS.range, RDFS.subPropertyOf, OWL.inverseOf, OWL.propertyChainAxiom}
_OF_DATA = {RDF.type, RDFS.domain, RDFS.range}
_CLASS_TYPES = {OWL.Class, RDFS.Class, OWL.NamedIndividual}
_DATA_TYPES = {OWL.DatatypeProperty, RDF.Property, OWL.FunctionalProperty, OWL.NamedIndividual}
_LINK_TYPES = {
    *(OWL.ObjectProperty, RDF.Property, OWL.TransitiveProperty, OWL.SymmetricProperty, OWL.NamedIndividual),
    *(OWL.FunctionalProperty, OWL.InverseFunctionalProperty),
}
_REFUSED_AXIOMS = (OWL.AllDisjointProperties, OWL.NegativePropertyAssertion)


class Definitions:
    """Reads the definitions out of ``graph``; ``reader`` takes the faults."""

    def __init__(self, graph: Graph, class_uid: Mapping[Node, int], reader: OntologyReader) -> None:
        self.graph = graph
        self.class_uid = class_uid
        self.reader = reader
        self._read: list[tuple[Node, Node, bool]] = []

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
                else:
                    parents.update(self._named_in(target))
                    self._read.append((iri, target, predicate == OWL.equivalentClass))
        parents.update(
            self.class_uid[whole]
            for whole in self.graph.subjects(OWL.disjointUnionOf, None)
            if whole in self.class_uid and iri in self._parts_of(whole)
        )
        return parents

    def _named_in(self, node: Node) -> Iterator[int]:
        """Yield the named classes that an expression is an intersection of."""
        if node in self.class_uid:
            yield self.class_uid[node]
        for listed in self.graph.objects(node, OWL.intersectionOf):
            for part in Collection(self.graph, listed):
                yield from self._named_in(part)

    def _parts_of(self, whole: Node) -> list[Node]:
        """Return the parts of a class that is their disjoint union."""
        return [
            part for listed in self.graph.objects(whole, OWL.disjointUnionOf) for part in Collection(self.graph, listed)
        ]

    def disjoint_parts(self) -> Iterator[tuple[Node, list[Node]]]:
        """Yield the classes that are disjoint unions, each with its parts."""
        for whole in sorted(self.graph.subjects(OWL.disjointUnionOf, None), key=str):
            yield whole, self._parts_of(whole)

    def _refuse_name(self, iri: Node, predicate: URIRef, target: Node) -> None:
        shown = self.reader.shown
        if target in self.class_uid:
            self.reader.fault(iri, f"it is the same class as {shown(target)}", "one name for a class")
        elif (target, RDF.type, OWL.Class) not in self.graph:  # those of the situation vocabulary stay in the graph
            what = "superclass" if predicate == RDFS.subClassOf else "equivalent class"
            wrong = f"its {what} {shown(target)} is not declared"
            self.reader.fault(iri, wrong, f"a declared owl:Class{self.reader.hint(target, self.class_uid)}")

    def axioms(
        self,
        classes: Sequence[OntologyClass],
        attributes: Sequence[Attribute],
        individuals: Mapping[Node, tuple[str, int]],
    ) -> Axioms:
        """Return the axioms; the classes must have been asked for before.

        Args:
            classes: of the ontology.
            attributes: of it.
            individuals: of each individual its name and class.
        """
        named: dict[Node, Attribute] = {URIRef(attribute.iri): attribute for attribute in attributes[1:]}
        links = {attribute.uid for attribute in attributes if attribute.kind is ValueKind.LINK}
        expressions = Expressions(self.graph, self.class_uid, named, individuals, self.reader)
        read = [(self.class_uid[iri], expressions.read(iri, node), is_same) for iri, node, is_same in self._read]
        self._refuse_anonymous()
        for term, attribute in named.items():
            is_link = attribute.kind is ValueKind.LINK
            self._refuse_others(term, _OF_LINKS if is_link else _OF_DATA, _LINK_TYPES if is_link else _DATA_TYPES)
        inverses = {(min(pair), max(pair)) for pair in self._pairs(OWL.inverseOf, named)}
        symmetric = self._of_type(OWL.SymmetricProperty, named)
        below = set(self._pairs(RDFS.subPropertyOf, named))
        self._refuse_cycles(below, attributes)
        chains = self._chains(named)
        simple = Axioms(
            (),
            tuple(sorted({*inverses, *((uid, uid) for uid in symmetric)})),
            tuple(
                sorted({*self._of_type(OWL.TransitiveProperty, named), *(a for a, parts in chains if parts == (a, a))})
            ),
            tuple(sorted(below)),
            chains=tuple(sorted((a, parts) for a, parts in chains if parts != (a, a))),
        )
        stated = {
            name: sorted(
                (named[predicate].uid, individuals[target][0])
                for predicate, target in self.graph.predicate_objects(iri)
                if predicate in named and target in individuals
            )
            for iri, (name, _) in individuals.items()
        }
        unnamed = Unnamed(classes, attributes, self.class_uid[OWL.Thing], dict(individuals.values()), stated, simple)
        for uid in self._of_type(OWL.FunctionalProperty, named):
            unnamed.functional(uid)
        for uid in self._of_type(OWL.InverseFunctionalProperty, named):
            if uid in links:
                unnamed.inverse_functional(uid)
        for whole, parts in self.disjoint_parts():
            uids = tuple(sorted(self.class_uid[part] for part in parts if part in self.class_uid))
            if whole in self.class_uid and uids:
                unnamed.cover(self.class_uid[whole], uids)
        for uid, expression, is_same in sorted(((u, e, s) for u, e, s in read if e is not None), key=repr):
            unnamed.define(uid, expression, is_same)
        axioms = unnamed.axioms()
        self._refuse_circular(axioms.definitions)
        return axioms

    def _of_type(self, kind: URIRef, named: Mapping[Node, Attribute]) -> list[int]:
        return sorted(named[iri].uid for iri in self.graph.subjects(RDF.type, kind) if iri in named)

    def _chains(self, named: Mapping[Node, Attribute]) -> list[tuple[int, tuple[int, ...]]]:
        """Return the chains of links, each as what they come to and its parts; or note what is wrong with them."""
        found = []
        for iri in sorted(self.graph.subjects(OWL.propertyChainAxiom, None, unique=True), key=str):
            for listed in self.graph.objects(iri, OWL.propertyChainAxiom):
                parts = list(Collection(self.graph, listed))
                links = [named[part] for part in (iri, *parts) if part in named]
                if len(links) != len(parts) + 1 or len(parts) < 2 or any(a.kind is not ValueKind.LINK for a in links):
                    shown = " ".join(map(self.reader.shown, parts))
                    wrong = f"its owl:propertyChainAxiom is ({shown})"
                    self.reader.fault(iri, wrong, "two or more declared owl:ObjectProperty")
                    continue
                found.append((links[0].uid, tuple(part.uid for part in links[1:])))
        return found

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
        self,
        classes: Sequence[OntologyClass],
        attributes: Sequence[Attribute],
        axioms: Axioms,
        disjoint: Sequence[tuple[int, int]],
    ) -> list[OntologyClass]:
        """Return the classes with every superclass that follows from the axioms, or note what is wrong with these."""
        rules = CompiledAxioms(classes, attributes, axioms, disjoint)
        self._refuse_unlike_ends(rules, attributes)
        self._refuse_chains(rules, attributes)
        self._refuse_counts(rules, attributes)
        for uid in sorted(rules.empty):
            is_told = any(rules.superclasses[uid] >> a & rules.superclasses[uid] >> b & 1 for a, b in disjoint)
            if uid < len(classes) and not is_told:
                self.reader.fault(
                    URIRef(classes[uid].iri),
                    "nothing can be of it, by its definition",
                    "classes that may have instances",
                )
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

    def _refuse_chains(self, rules: CompiledAxioms, attributes: Sequence[Attribute]) -> None:
        """Refuse chains of which the outcome is a part, and those with ends that are not known to be those of it."""
        for head, parts in ((head, parts) for head, chains in rules.chains.items() for parts in chains):
            of, first, last = attributes[head], attributes[parts[0]], attributes[parts[-1]]
            shown = f"its owl:propertyChainAxiom ({' '.join(attributes[part].name for part in parts)})"
            if not rules.says(head).isdisjoint(parts):
                allowed = "owl:TransitiveProperty, or a chain of other links"
                self.reader.fault(URIRef(of.iri), f"{shown} leads back to itself", allowed)
            for what, end, asked in (("domain", first.domain, of.domain), ("range", last.range_class, of.range_class)):
                if end is not None and asked is not None and not rules.superclasses[end] >> asked & 1:
                    wrong = f"{shown} says it of what need not be of its {what}"
                    self.reader.fault(URIRef(of.iri), wrong, "ends that are of the classes it asks for")

    def _refuse_counts(self, rules: CompiledAxioms, attributes: Sequence[Attribute]) -> None:
        """Refuse to count links that follow from others: OWL 2 DL has no such restrictions."""
        far = rules.transitive | rules.chains.keys()
        for uid in sorted({uid for _, uid, _ in rules.single}):
            if any(uid in rules.says(other) for other in far):
                wrong = "one link is allowed, and links follow by transitivity or a chain"
                self.reader.fault(URIRef(attributes[uid].iri), wrong, "to count links that do not")

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
                names = ", ".join(self.reader.shown(iris[uid]) for uid in circle if uid in iris)
                self.reader.fault(iris[start], f"{wrong}: {names}", allowed)

    def _refuse_others(self, iri: Node, predicates: set[URIRef], types: set[URIRef]) -> None:
        """Refuse what OWL or RDFS says of a term and is not compiled."""
        for predicate in sorted(set(self.graph.predicates(iri)) - predicates - HARMLESS, key=str):
            if str(predicate).startswith((str(OWL), str(RDFS))):
                allowed = ", ".join(sorted(map(self.reader.shown, predicates))) + f" and annotations{ELSEWHERE}"
                self.reader.fault(iri, f"{self.reader.shown(predicate)} is not compiled", allowed)
        for kind in sorted(set(self.graph.objects(iri, RDF.type)) - types, key=str):
            if str(kind).startswith((str(OWL), str(RDFS))):
                allowed = ", ".join(sorted(map(self.reader.shown, types))) + ELSEWHERE
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
                self.reader.fault(subject, f"{self.reader.shown(kind)} is not compiled", f"none{ELSEWHERE}")


def _reach(arrows: Mapping[int, set[int]], start: int) -> set[int]:
    reached: set[int] = set()
    front = [start]
    while front:
        new = arrows.get(front.pop(), set()) - reached
        reached |= new
        front += new
    return reached
