"""The triples of instances that stand without time: types, names, the current state, and what follows."""

from collections.abc import Iterable, Iterator

from rdflib import RDF, RDFS, Literal, URIRef
from rdflib.term import Node

from worldmodel.store import Store
from worldmodel.tbox import TYPE_UID, Value, ValueKind
from worldmodel.terms import Terms

TYPE, LABEL = RDF.type, RDFS.label


class States:
    """What instances are, are called, and have now.

    Args:
        model: the world model.
        terms: of it.
    """

    def __init__(self, model: Store, terms: Terms) -> None:
        self._model = model
        self._terms = terms
        self._uids: dict[Node, int] = {iri: uid for uid, iri in enumerate(terms.attributes) if uid != TYPE_UID}
        self._labels = tuple(Literal(instance.name) for instance in model.common_instances)
        self._has_rules = model.tbox.rules.is_needed
        links = {one.uid for one in model.tbox.attributes if one.kind is ValueKind.LINK}
        self._inferred = model.inference.linked_attributes() & links
        self._common: dict[tuple[int, int], tuple[Value, ...]] = {}
        for subject, attribute, value, _ in model.common_facts:
            self._common[subject, attribute] = (*self._common.get((subject, attribute), ()), value)

    def triples(
        self, uid: int, subject: Node, predicate: Node | None, target: Node | None
    ) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the matching triples of one instance."""
        if predicate is None or predicate == TYPE:
            for term in self.types(uid):
                if target is None or target == term:
                    yield (subject, TYPE, term)
        if predicate is None or predicate == LABEL:
            for label in self._labels[uid : uid + 1]:
                if target is None or target == label:
                    yield (subject, LABEL, label)
        for iri in self._uids if predicate is None else (predicate,) if predicate in self._uids else ():
            attribute = self._uids[iri]
            for value in self._current(uid, attribute):
                state = self._terms.value(attribute, value)
                if target is None or target == state:
                    yield (subject, iri, state)

    def types(self, uid: int, items_only: bool = False) -> Iterator[URIRef]:
        """Yield the classes that an instance was created with and given since, and those concluded.

        Args:
            uid: the instance.
            items_only: only what it was created with, and given by items.
        """
        model = self._model
        found = {one.fact.target for one in model.history(uid, TYPE_UID) if not items_only or one.block.is_item}
        if uid < len(model.common_instances):
            found.add(model.common_instances[uid].class_uid)
        if self._has_rules and not items_only:
            mask = model.inference.concluded_classes(uid)
            found.update(class_uid for class_uid in range(len(self._terms.classes)) if mask >> class_uid & 1)
        for class_uid in sorted(found):
            yield self._terms.classes[class_uid]

    def _current(self, uid: int, attribute: int) -> Iterable[Value]:
        """Return the latest value of a slot, what all know of it, and the links that follow."""
        if attribute in self._inferred:
            return self._model.inference.links(uid, attribute)
        latest = self._model.latest(uid, attribute)
        known = self._common.get((uid, attribute), ())
        return known if latest is None else dict.fromkeys((latest.value, *known))
