"""Reading individuals: what an ontology says of single things, as instances with links and values.

An individual is whatever is of a declared class, or an owl:NamedIndividual. It has one class and those above it, links
to others, and at most one value of each other attribute, which all know from the start: it holds until somebody says
another one. No thing has two names, so owl:differentFrom and owl:AllDifferent say nothing new, and owl:sameAs is
refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence, Set

from rdflib import OWL, RDF, RDFS, Graph, URIRef
from rdflib.term import Node

from worldmodel.definitions import HARMLESS
from worldmodel.expressions import OntologyReader, datatype_of, stored
from worldmodel.fields import Value
from worldmodel.tbox import Attribute, Individual, OntologyClass, ValueKind, closure

SITUATION = "https://w3id.org/remoras/situation#"
NAME = re.compile(r"[A-Za-z][\w-]*", re.ASCII)
_TERMS = {
    *(OWL.Class, RDFS.Class, RDFS.Datatype, OWL.Ontology, OWL.Restriction, OWL.AnnotationProperty, RDF.Property),
    *(OWL.DatatypeProperty, OWL.ObjectProperty, OWL.AllDisjointClasses, OWL.AllDifferent, RDF.List),
}
_ALLOWED = {RDF.type, OWL.differentFrom}


def stated_subjects(graph: Graph, classes: Set[Node]) -> Iterator[Node]:
    """Yield whatever is said to be of one of these classes, or an individual, or the same as another thing."""
    for subject in set(graph.subjects(unique=True)):
        kinds = set(graph.objects(subject, RDF.type))
        if str(subject).startswith(SITUATION) or kinds & _TERMS or subject in classes:
            continue
        is_told = (subject, OWL.sameAs, None) in graph or (subject, OWL.differentFrom, None) in graph
        if is_told or OWL.NamedIndividual in kinds or kinds & classes:
            yield subject


class StatedIndividuals:
    """Reads the individuals of ``graph``; ``reader`` takes the faults."""

    def __init__(
        self,
        graph: Graph,
        class_uid: Mapping[Node, int],
        attributes: Sequence[Attribute],
        reader: OntologyReader,
    ) -> None:
        self.graph, self.reader, self.class_uid = graph, reader, class_uid
        self.superclasses: tuple[int, ...] = ()
        self.names = {uid: local_name(str(iri)) for iri, uid in class_uid.items()}
        self.attributes: dict[Node, Attribute] = {URIRef(attribute.iri): attribute for attribute in attributes[1:]}
        self.found: dict[URIRef, int] = {}

    def named(self) -> dict[Node, tuple[str, int]]:
        """Return the name of each individual, with the class 0, where classes have faults."""
        return {each: (local_name(str(each)), 0) for each in stated_subjects(self.graph, self.class_uid.keys())}

    def find(self, classes: Sequence[OntologyClass]) -> dict[Node, tuple[str, int]]:
        """Return the name and class of each individual, or note what is wrong with it."""
        self.superclasses = closure(classes)
        for subject in sorted(stated_subjects(self.graph, self.class_uid.keys()), key=str):
            if (of_class := self._class_of(subject)) is not None and isinstance(subject, URIRef):
                self.found[subject] = of_class
        names: dict[str, URIRef] = {}
        for iri in self.found:
            name = local_name(iri)
            if not NAME.fullmatch(name):
                self.reader.fault(iri, f"its name {name!r} is no name", "a letter, then letters, digits, - and _")
            elif names.setdefault(name, iri) != iri:
                self.reader.fault(iri, f"its name {name!r} is that of <{names[name]}> too", "one IRI for each name")
        return {iri: (local_name(iri), uid) for iri, uid in self.found.items()}

    def read(self, classes: Sequence[OntologyClass]) -> tuple[Individual, ...]:
        """Return the individuals that were found, by name, or note what is wrong with what is said of them."""
        self.superclasses = closure(classes)
        made = [
            Individual(local_name(iri), uid, tuple(self._links(iri)), tuple(self._values(iri)))
            for iri, uid in self.found.items()
        ]
        return tuple(sorted(made, key=lambda individual: individual.name))

    def _class_of(self, subject: Node) -> int | None:
        kinds = sorted(set(self.graph.objects(subject, RDF.type)) - {OWL.NamedIndividual}, key=str)
        shown = self.reader.shown
        if not isinstance(subject, URIRef):
            self.reader.fault(subject, "it is an individual without a name", "individuals with an IRI")
            return None
        for kind in kinds:
            if kind not in self.class_uid:
                hint = self.reader.hint(kind, self.class_uid)
                self.reader.fault(subject, f"its class {shown(kind)} is not declared", f"one declared class{hint}")
                return None
        uids = {self.class_uid[kind] for kind in kinds}
        lowest = [c for c in uids if all(self.superclasses[c] >> d & 1 for d in uids)]
        if not lowest:
            wrong = f"it is of {len(kinds)} classes, none below the others" if kinds else "it is of no class"
            self.reader.fault(subject, wrong, "one declared class, of which others follow")
            return None
        return lowest[0]

    def _links(self, iri: URIRef) -> Iterator[tuple[int, str]]:
        shown = self.reader.shown
        for predicate, term in sorted(self.graph.predicate_objects(iri), key=str):
            if predicate in self.attributes:
                attribute = self.attributes[predicate]
                if self._fits(iri, attribute) and attribute.kind is ValueKind.LINK:
                    target = self._target(iri, attribute, term)
                    if target is not None:
                        yield attribute.uid, target
            elif predicate == OWL.differentFrom and term not in self.found:
                self.reader.fault(iri, f"it differs from {shown(term)}, which is no individual", "an individual")
            elif predicate not in _ALLOWED | HARMLESS and str(predicate).startswith((str(OWL), str(RDFS))):
                allowed = "owl:differentFrom, links, values and annotations"
                self.reader.fault(iri, f"{shown(predicate)} is not compiled", allowed)

    def _fits(self, iri: URIRef, attribute: Attribute) -> bool:
        """True if an individual is of the class that has an attribute; else note that it is not."""
        if self.superclasses[self.found[iri]] >> attribute.domain & 1:
            return True
        wrong = f"it is a {self.names[self.found[iri]]}, and {attribute.name} is of {self.names[attribute.domain]}"
        self.reader.fault(iri, wrong, "attributes of its class and of those above it")
        return False

    def _values(self, iri: URIRef) -> Iterator[tuple[int, Value]]:
        for predicate, attribute in self.attributes.items():
            terms = sorted(self.graph.objects(iri, predicate), key=str)
            if attribute.kind is ValueKind.LINK or not terms:
                continue
            value = stored(attribute, terms[0])
            if len(terms) == 1 and value is not None:
                yield attribute.uid, value
            else:
                given = " and ".join(map(self.reader.shown, terms))
                allowed = f"one literal of {self.reader.shown(datatype_of(attribute))} in its range and on its grid"
                self.reader.fault(iri, f"its {attribute.name} is {given}", allowed)

    def _target(self, iri: URIRef, attribute: Attribute, term: Node) -> str | None:
        """The name of what a link leads to, or None and a fault."""
        fault, shown = self.reader.fault, self.reader.shown
        if not isinstance(term, URIRef) or term not in self.found:
            fault(iri, f"its {attribute.name} is {shown(term)}", "an individual of these files")
            return None
        if attribute.range_class is None or not self.superclasses[self.found[term]] >> attribute.range_class & 1:
            wrong = f"its {attribute.name} {shown(term)} is a {self.names[self.found[term]]}"
            fault(iri, wrong, f"a {self.names[attribute.range_class or 0]}")
            return None
        return local_name(term)


def local_name(iri: str) -> str:
    """Return the part of an IRI that is the name of what it stands for."""
    return re.split(r"[#/:]", iri)[-1]
