"""Nothing that a file states is passed over: what no reader has taken is refused, and so is what cannot be true.

Annotations alone change no answer: labels, comments, properties declared as owl:AnnotationProperty, and vocabularies
other than OWL and RDFS that share no namespace with what the files declare.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rdflib import OWL, RDF, RDFS, BNode, Graph, URIRef
from rdflib.term import Node

from worldmodel.abox import WorldModel
from worldmodel.annotations import ANNOTATIONS
from worldmodel.definitions import HARMLESS
from worldmodel.expressions import OntologyReader
from worldmodel.facts import Instance, PropertyValue
from worldmodel.stated import SITUATION
from worldmodel.store import Keeping
from worldmodel.tbox import Attribute, TBox

_SWRL = "http://www.w3.org/2003/11/swrl#"
_OTHER_TERMS = {OWL.AnnotationProperty, OWL.Ontology, OWL.Axiom, OWL.Annotation, RDFS.Datatype}
_ALLOWED = "classes, attributes and individuals that are declared, and annotations"


class Unread:
    """Refuses what is stated and was not read.

    Args:
        graph: the files.
        file_of: the file of each subject.
        class_uid: the classes that were read.
        attributes: the attributes that were read.
        individuals: the individuals that were read.
        reader: takes the faults.
    """

    def __init__(
        self,
        graph: Graph,
        file_of: Mapping[Node, str],
        class_uid: Mapping[Node, int],
        attributes: Mapping[Node, Attribute],
        individuals: Mapping[Node, object],
        reader: OntologyReader,
    ) -> None:
        self.graph, self.file_of, self.reader = graph, file_of, reader
        self.attributes, self.individuals = attributes, individuals
        self.terms = {*class_uid, *attributes}
        self._namespaces = {_namespace(term) for term in self.terms if isinstance(term, URIRef)} - {str(OWL)}
        self._annotations = {*graph.subjects(RDF.type, OWL.AnnotationProperty), *ANNOTATIONS}
        self._situation = file_of.get(URIRef(SITUATION.rstrip("#")))

    def refuse(self) -> None:
        """Note a fault for each subject of which something was not read."""
        for subject in sorted(self.graph.subjects(unique=True), key=str):
            if isinstance(subject, URIRef) and subject.startswith(SITUATION):
                if self.file_of[subject] != self._situation:
                    self.reader.fault(subject, "it is in the namespace of the situation vocabulary", "one of your own")
            elif (wrong := next(self._wrong(subject), None)) is not None:
                self.reader.fault(subject, wrong, _ALLOWED)

    def _wrong(self, subject: Node) -> Iterator[str]:
        shown, hint = self.reader.shown, self.reader.hint
        kinds = set(self.graph.objects(subject, RDF.type))
        is_known = subject in self.terms or subject in self.individuals
        for kind in sorted(kinds, key=str):
            if str(kind).startswith(_SWRL):
                yield f"{shown(kind)} is not compiled"
            elif isinstance(kind, BNode):
                yield "it is of a class without a name"
            elif not is_known and self._is_of_these(kind) and kind not in self.terms:
                yield f"its class {shown(kind)} is not declared{hint(kind, self.terms)}"
        is_other = bool(kinds & _OTHER_TERMS)
        for predicate in sorted(self.graph.predicates(subject, unique=True), key=str):
            if predicate in self.attributes:
                if subject not in self.individuals:
                    yield f"it has a value of {shown(predicate)}, and is no individual"
            elif self._is_of_these(predicate) and predicate not in self._annotations:
                yield f"{shown(predicate)} is not declared{hint(predicate, self.attributes)}"
            elif not (is_known or is_other or isinstance(subject, BNode) or predicate in HARMLESS) and str(
                predicate
            ).startswith((str(OWL), str(RDFS))):
                yield f"it has {shown(predicate)}, and is not declared{hint(subject, self.terms)}"

    def _is_of_these(self, term: Node) -> bool:
        return isinstance(term, URIRef) and _namespace(term) in self._namespaces


def _namespace(iri: URIRef) -> str:
    return str(iri)[: max(iri.rfind("#"), iri.rfind("/")) + 1]


def refuse_contradictions(tbox: TBox, individuals: Mapping[str, URIRef], reader: OntologyReader) -> None:
    """Note a fault for each individual that cannot be as the files say, by name."""
    uids = {individual.name: uid for uid, individual in enumerate(tbox.individuals)}
    if not uids:
        return
    facts = [
        *(PropertyValue(uids[i.name], attribute, uids[name]) for i in tbox.individuals for attribute, name in i.links),
        *(PropertyValue(uids[i.name], attribute, value) for i in tbox.individuals for attribute, value in i.values),
    ]
    instances = [Instance(uid, each.class_uid, each.name) for uid, each in enumerate(tbox.individuals)]
    model = WorldModel(tbox, 0, instances, n_origins=1, keeping=Keeping(common_facts=facts))
    for contradiction in model.inference.contradictions():
        name = tbox.individuals[contradiction.instance].name
        reader.fault(individuals[name], contradiction.what, "what the axioms leave; two names are two things")
