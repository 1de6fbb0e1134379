"""The triples of instances that stand without time: types, names, and the current state."""

from collections.abc import Iterator

from rdflib import RDF, RDFS, Literal, URIRef
from rdflib.term import Node

from worldmodel.ontology.tbox import TYPE_UID
from worldmodel.rdf.conclusions import Inferences
from worldmodel.rdf.terms import RdfTerms
from worldmodel.store import Store

TYPE, LABEL = RDF.type, RDFS.label


class States:
    """What instances are, are called, and have now.

    Args:
        model: the world model.
        terms: of it.
        conclusions: what follows in it.
    """

    def __init__(self, model: Store, terms: RdfTerms, conclusions: Inferences) -> None:
        self._model = model
        self._terms = terms
        self._conclusions = conclusions
        self._uids: dict[Node, int] = {iri: uid for uid, iri in enumerate(terms.attributes) if uid != TYPE_UID}
        self._labels = tuple(Literal(instance.name) for instance in model.common_instances)

    def triples(
        self, uid: int, subject: Node, predicate: Node | None, target: Node | None, concluded: bool = True
    ) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the matching triples of one instance; without ``concluded`` only what was told."""
        if predicate is None or predicate == TYPE:
            for term in self.types(uid, concluded=concluded):
                if target is None or target == term:
                    yield (subject, TYPE, term)
        if predicate is None or predicate == LABEL:
            for label in self._labels[uid : uid + 1]:
                if target is None or target == label:
                    yield (subject, LABEL, label)
        for iri in self._uids if predicate is None else (predicate,) if predicate in self._uids else ():
            for state in self._conclusions.states(uid, self._uids[iri], concluded):
                if target is None or target == state:
                    yield (subject, iri, state)

    def types(self, uid: int, items_only: bool = False, concluded: bool = False) -> Iterator[URIRef]:
        """Yield the classes that an instance was created with and given since.

        Args:
            uid: the instance.
            items_only: only what it was created with, and given by items.
            concluded: those that follow too.
        """
        model = self._model
        classes = {
            observation.fact.target
            for observation in model.history(uid, TYPE_UID)
            if not items_only or observation.block.is_item
        }
        if uid < len(model.common_instances):
            classes.add(model.common_instances[uid].class_uid)
        if concluded:
            classes.update(self._conclusions.classes(uid))
        for class_uid in sorted(classes):
            yield self._terms.classes[class_uid]
