"""Conclusions of a world model as triples: types and links that follow, and the links that all know from the start.

Of the classes that follow, the most specific ones stand with an instance, as of the types that it was given. The graph
``run:conclusions`` has what follows and was told by nobody; the default graph has it beside what was told.
"""

from collections.abc import Iterator

from rdflib import RDF
from rdflib.term import Node

from worldmodel.rdf.terms import RUN, RdfTerms
from worldmodel.store import Store

CONCLUSIONS = RUN.conclusions
"""Name of the graph of all that follows."""
_TYPE = RDF.type


class Inferences:
    """What follows in one world model, in terms of RDF."""

    def __init__(self, model: Store, terms: RdfTerms) -> None:
        """Follow the world model."""
        self._model = model
        self._terms = terms
        self.linked = model.inference.linked_attributes()
        """Attributes of which an instance may have links beside its latest value."""

    def classes(self, uid: int) -> list[int]:
        """Return the classes that follow for an instance, without those above another one."""
        mask, tbox = self._model.inference.concluded_classes(uid), self._model.tbox
        if not mask:
            return []
        each = [c.uid for c in tbox.classes if mask >> c.uid & 1]
        return [c for c in each if not any(d != c and tbox.is_a(d, c) for d in each)]

    def states(self, uid: int, attribute: int, concluded: bool = True) -> tuple[Node, ...]:
        """Return what an attribute is now: the latest value, links that all know, if ``concluded`` what follows."""
        if attribute in self.linked:
            inference = self._model.inference
            known = inference.links(uid, attribute) if concluded else inference.told_links(uid, attribute)
            return tuple(map(self._terms.instance, known))
        value = self._model.value(uid, attribute)
        return () if value is None else (self._terms.value(attribute, value),)

    def triples(self) -> Iterator[tuple[Node, Node, Node]]:
        """Yield what follows and was told by nobody."""
        inference, terms = self._model.inference, self._terms
        for uid in self._model.instance_uids():
            iri = terms.instance(uid)
            for class_uid in self.classes(uid):
                yield (iri, _TYPE, terms.classes[class_uid])
            for attribute in sorted(self.linked):
                told = inference.told_links(uid, attribute)
                for target in inference.links(uid, attribute):
                    if target not in told:
                        yield (iri, terms.attributes[attribute], terms.instance(target))
