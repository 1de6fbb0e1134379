"""World model as triples: current state, conclusions, estimates, receptions.

Of the inferred classes of an instance, only the most specific appear. The graph ``run:conclusions`` holds inferred
triples that no origin asserted; the default graph holds asserted and inferred ones.

Estimates are in the named graph ``run:fused`` only, in the form of facts, one per property with uncertain values::

    run:instance-7 sit:hasPropertyValue run:estimate-7-15 .
    run:estimate-7-15 a sit:PropertyValue ; sit:ofAttribute rm:location ; sit:dataValue "POINT (3.52 4.01)" ;
        sit:standardUncertainty 0.31e0 ; sit:timestamp 12.3e0 ; sit:origin run:instance-2 , run:instance-4 .

7-15 are the uids of subject and attribute. Symbols, truth values, types and links have one estimate per hypothesis with
its sit:probability: run:estimate-7-15 for the most probable, then run:estimate-7-15-1. Values are off the grid, the
time is that of the newest observation, the origins are those that count. ``worldmodel.fused`` computes them with the
drift of the ontology.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping

from rdflib import RDF, RDFS, XSD, Literal, URIRef
from rdflib.term import Node

from worldmodel.facts import Observation
from worldmodel.fusion import Estimate, fused
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.tbox import MEASURED, TYPE_UID, ValueKind
from worldmodel.rdf.terms import RUN, RdfTerms, block_name, fact_iri, is_fact, reception_iri
from worldmodel.store import Store
from worldmodel.world_model import Knowledge, Reception

CONCLUSIONS = RUN.conclusions
"""Name of the graph of inferred triples."""
_TYPE = RDF.type


class Inferences:
    """Conclusions of one world model as RDF terms."""

    def __init__(self, model: Store, terms: RdfTerms) -> None:
        self._model = model
        self._terms = terms
        self.linked = model.inference.linked_attributes()
        """Attributes that may have links beyond the latest value."""

    def classes(self, uid: int) -> list[int]:
        """Return the most specific inferred classes of an instance."""
        mask, tbox = self._model.inference.concluded_classes(uid), self._model.tbox
        if not mask:
            return []
        each = [c.uid for c in tbox.classes if mask >> c.uid & 1]
        return [c for c in each if not any(d != c and tbox.is_a(d, c) for d in each)]

    def states(self, uid: int, attribute: int, concluded: bool = True) -> tuple[Node, ...]:
        """Return the current objects: latest value, common links, inferred ones if ``concluded``."""
        if attribute in self.linked:
            inference = self._model.inference
            known = inference.links(uid, attribute) if concluded else inference.told_links(uid, attribute)
            return tuple(map(self._terms.instance, known))
        value = self._model.value(uid, attribute)
        return () if value is None else (self._terms.value(attribute, value),)

    def triples(self) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the inferred triples that are not asserted."""
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


TYPE, LABEL = RDF.type, RDFS.label


class States:
    """Types, names and current values of instances."""

    def __init__(self, model: Store, terms: RdfTerms, conclusions: Inferences) -> None:
        self._model = model
        self._terms = terms
        self._conclusions = conclusions
        self._uids: dict[Node, int] = {iri: uid for uid, iri in enumerate(terms.attributes) if uid != TYPE_UID}
        self._labels = tuple(Literal(instance.name) for instance in model.common_instances)

    def triples(
        self, uid: int, subject: Node, predicate: Node | None, target: Node | None, concluded: bool = True
    ) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the matching triples of one instance; without ``concluded`` asserted ones only."""
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
        """Yield the asserted classes of an instance, and inferred ones if ``concluded``."""
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


FUSED = RUN.fused
"""Name of the graph of estimates."""
Triple = tuple[Node, Node, Node]


class Estimates:
    """Fused estimates of one world model, cached until it changes."""

    def __init__(self, model: Store, terms: RdfTerms) -> None:
        self._model, self._terms = model, terms
        self._version = -1
        self._triples: list[Triple] = []

    def triples(self) -> list[Triple]:
        """Return the triples of all estimates."""
        if self._version != self._model.version:
            self._triples = list(self._all())
            self._version = self._model.version
        return self._triples

    def _all(self) -> Iterator[Triple]:
        for uid in self._model.instance_uids():
            for attribute in self._model.tbox.attributes:
                observations = self._model.history(uid, attribute.uid)
                estimate = fused(attribute, observations) if observations else None
                if estimate is not None and estimate.uncertainty is not None:
                    yield from self._of(uid, attribute.uid, estimate)

    def _of(self, uid: int, attribute: int, estimate: Estimate) -> Iterator[Triple]:
        """Yield the triples of an estimate, per hypothesis if there are several."""
        terms, kind = self._terms, self._model.tbox.attributes[attribute].kind
        is_link = kind in (ValueKind.LINK, ValueKind.TYPE)
        how_sure = SIT.standardUncertainty if kind in MEASURED else SIT.probability
        for number, (value, sure) in enumerate(estimate.probabilities or ((estimate.value, estimate.uncertainty),)):
            iri = RUN[f"estimate-{uid}-{attribute}{f'-{number}' if number else ''}"]
            if kind is ValueKind.POINT:
                term: Node = Literal("POINT ({} {})".format(*value))  # type: ignore[misc]
            elif kind is ValueKind.NUMBER:
                term = Literal(value, datatype=XSD.double)
            else:
                term = terms.value(attribute, value)
            yield (terms.instance(uid), SIT.hasPropertyValue, iri)
            yield (iri, RDF.type, SIT.PropertyValue)
            yield (iri, SIT.ofAttribute, terms.attributes[attribute])
            yield (iri, SIT.linkValue if is_link else SIT.dataValue, term)
            yield (iri, how_sure, terms.number(sure or 0.0))
            yield (iri, SIT.timestamp, terms.number(estimate.time_s))
            for origin in estimate.origins:
                yield (iri, SIT.origin, terms.instance(origin))


RECEPTION, RECEIVED = SIT.Reception, SIT.received


class Receptions:
    """Receptions of one vehicle, by IRI and by block; ``is_seen`` checks the IRI of a fact."""

    def __init__(self, known: Knowledge, terms: RdfTerms, is_seen: Callable[[Node], bool]) -> None:
        owner = terms.instance(known.model.owner)
        self._is_seen = is_seen
        self._owner = known.model.owner
        self._of_block: Mapping[str, Reception] = {
            block_name(reception.block): reception for reception in known.receptions
        }
        self._by_iri: Mapping[Node, Reception] = {
            reception_iri(self._owner, reception.block): reception for reception in self._of_block.values()
        }
        self._parts: Mapping[Node, Callable[[Reception], Node | None]] = {
            RDF.type: lambda reception: RECEPTION,
            SIT.receivedBy: lambda reception: owner,
            SIT.receivedFrom: lambda reception: None if reception.sender is None else terms.instance(reception.sender),
            SIT.receivedAt: lambda reception: terms.number(reception.time_s),
        }
        self.predicates = frozenset({*self._parts, RECEIVED} - {RDF.type})
        """Predicates used by receptions only."""

    def get(self, iri: Node) -> Reception | None:
        """Return the reception with an IRI; None if there is none."""
        return self._by_iri.get(iri)

    def triples(
        self, subject: Node, reception: Reception, predicate: Node | None, target: Node | None
    ) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the matching triples of one reception."""
        for name, of in self._parts.items():
            if predicate is None or predicate == name:
                term = of(reception)
                if term is not None and target in (None, term):
                    yield (subject, name, term)
        if predicate is None or predicate == RECEIVED:
            for position in range(len(reception.block.facts)):
                iri = fact_iri(Observation(reception.block, position))
                if target in (None, iri) and self._is_seen(iri):
                    yield (subject, RECEIVED, iri)

    def of_fact(self, fact: Node, observation: Observation | None) -> Iterable[tuple[Node, Node, Node]]:
        """Return the triple from the reception of a fact to the fact."""
        reception = None if observation is None else self._of_block.get(block_name(observation.block))
        return () if reception is None else ((reception_iri(self._owner, reception.block), RECEIVED, fact),)

    def all_triples(self, predicate: Node | None, target: Node | None) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the matching triples of all receptions; none if ``target`` is a fact."""
        if target is None or not is_fact(target):
            for iri, reception in self._by_iri.items():
                yield from self.triples(iri, reception, predicate, target)
