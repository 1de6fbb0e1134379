"""Knowledge of a vehicle as triples and rdflib graphs.

Each fact is a sit:PropertyValue of the situation-awareness TBox:

    run:instance-7 sit:hasPropertyValue run:fact-2-15-0 .
    run:fact-2-15-0 a sit:PropertyValue ; sit:ofAttribute rm:location ; sit:dataValue "POINT (3.5 4.0)" ;
        sit:timestamp 12.3e0 ; sit:origin run:instance-2 .

2-15-0 is origin, sequence and position in the block; 2.e1-15-0 is of epoch 1, 2-p1-0 of the first private block. A
status is run:status-2-7-4-12.3: origin, uids of subject and attribute, time. An origin is the common instance of its
number. A link has sit:linkValue in place of sit:dataValue; for sit:type its object is a class. Literals have the
datatype of the ontology; a point is a string, which rm:Point restricts.

Beside this history is the current state, one triple per property: run:instance-7 rm:location "POINT (3.5 4.0)". Types
appear without time, as rdf:type, asserted and inferred; so do inferred links. Of the inferred classes of an instance,
only the most specific appear. A common instance has its name as rdfs:label. Excluded origins are left out.

The default graph is the union of asserted and inferred triples. Named graphs are run:conclusions with the inferred ones
that no origin asserted, the facts of each origin under its IRI (``GRAPH ?by { ... }``), and run:fused with estimates,
which neither ?by nor the default graph includes. Estimates have the form of facts, with a sit:standardUncertainty and
all origins that count: run:estimate-7-15 of subject and attribute. Symbols, truth values, types and links have one
estimate per hypothesis with its sit:probability: run:estimate-7-15 for the most probable, then run:estimate-7-15-1.
"""

from collections.abc import Generator, Iterable, Iterator
from functools import cached_property
from itertools import chain
from typing import Any

from rdflib import RDF, RDFS, XSD, Dataset, Graph, Literal, URIRef
from rdflib.graph import DATASET_DEFAULT_GRAPH_ID
from rdflib.term import Node

from worldmodel.facts import Observation
from worldmodel.fusion import Estimate, fused
from worldmodel.ontology import graph_of
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.tbox import MEASURED, TYPE_UID, ValueKind
from worldmodel.rdf.terms import RUN, attribute_iri, block_name, fact_iri, instance_iri, term_of
from worldmodel.store import Store
from worldmodel.world_model import Knowledge

Triple = tuple[Node, Node, Node]
CONCLUSIONS, FUSED = RUN.conclusions, RUN.fused


class Triples:
    """Triples of the knowledge of one vehicle, at the time of the call."""

    def __init__(self, known: Store | Knowledge) -> None:
        self._known = known if isinstance(known, Knowledge) else Knowledge(known)
        self.model = model = self._known.model
        self._attributes = tuple(map(attribute_iri, model.tbox.attributes))
        self._classes = tuple(URIRef(class_.iri) for class_ in model.tbox.classes)
        self._linked = model.inference.linked_attributes()

    @cached_property  # the whole history, read for each part
    def facts(self) -> list[Observation]:
        """All facts that count, by attribute."""
        uids = list(self.model.instance_uids())
        attributes = range(len(self._attributes))
        return [each for attribute in attributes for uid in uids for each in self.model.history(uid, attribute)]

    def all(self, concluded: bool = True) -> Iterator[Triple]:
        """Yield all triples by subject; without ``concluded`` only instances, state and receptions."""
        for uid in self.model.instance_uids():
            yield from self.state(uid, concluded)
            for attribute in range(len(self._attributes)) if concluded else ():
                for observation in self.model.history(uid, attribute):
                    yield (instance_iri(uid), SIT.hasPropertyValue, fact_iri(observation))
        yield from self.receptions()
        for observation in self.facts if concluded else ():
            yield from self.of_fact(observation)

    def said_by(self, origin: int) -> Iterator[Triple]:
        """Yield the facts of an origin and the links to them."""
        for observation in self.facts:
            if observation.origin == origin:
                yield (instance_iri(observation.fact.subject), SIT.hasPropertyValue, fact_iri(observation))
                yield from self.of_fact(observation)

    def of_fact(self, observation: Observation) -> Iterator[Triple]:
        """Yield the triples of one fact."""
        iri, fact = fact_iri(observation), observation.fact
        attribute = self.model.tbox.attributes[fact.attribute]
        yield (iri, RDF.type, SIT.PropertyValue)
        yield (iri, SIT.ofAttribute, self._attributes[fact.attribute])
        is_link = attribute.kind in (ValueKind.LINK, ValueKind.TYPE)
        yield (iri, SIT.linkValue if is_link else SIT.dataValue, term_of(self.model.tbox, attribute, fact.value))
        if fact.uncertainty is not None:
            yield (iri, _how_sure(attribute.kind), _number(fact.uncertainty))
        yield (iri, SIT.timestamp, _number(observation.time_s))
        yield (iri, SIT.origin, instance_iri(observation.origin))

    # Instances -----------------------------------------------------------------------------------

    def state(self, uid: int, concluded: bool = True) -> Iterator[Triple]:
        """Yield types, name and current values of an instance; only asserted ones without ``concluded``."""
        model, iri = self.model, instance_iri(uid)
        classes = {entry.fact.target for entry in model.history(uid, TYPE_UID)}
        common = model.common_instances[uid : uid + 1]
        classes |= {instance.class_uid for instance in common}
        classes.update(self._concluded_classes(uid) if concluded else ())
        for class_uid in sorted(classes):
            yield (iri, RDF.type, self._classes[class_uid])
        for instance in common:
            yield (iri, RDFS.label, Literal(instance.name))
        for attribute in model.tbox.attributes:
            if attribute.uid in self._linked:
                links = model.inference.links if concluded else model.inference.told_links
                for target in links(uid, attribute.uid):
                    yield (iri, self._attributes[attribute.uid], instance_iri(target))
            elif attribute.uid != TYPE_UID and (value := model.value(uid, attribute.uid)) is not None:
                yield (iri, self._attributes[attribute.uid], term_of(model.tbox, attribute, value))

    def conclusions(self) -> Iterator[Triple]:
        """Yield the inferred triples that are not asserted."""
        inference = self.model.inference
        for uid in self.model.instance_uids():
            for class_uid in self._concluded_classes(uid):
                yield (instance_iri(uid), RDF.type, self._classes[class_uid])
            for attribute in sorted(self._linked):
                asserted = inference.told_links(uid, attribute)
                for target in inference.links(uid, attribute):
                    if target not in asserted:
                        yield (instance_iri(uid), self._attributes[attribute], instance_iri(target))

    def _concluded_classes(self, uid: int) -> list[int]:
        mask, tbox = self.model.inference.concluded_classes(uid), self.model.tbox
        each = [c.uid for c in tbox.classes if mask >> c.uid & 1]
        # The most specific ones imply the others.
        return [c for c in each if not any(d != c and tbox.is_a(d, c) for d in each)]

    # Receptions and estimates --------------------------------------------------------------------

    def receptions(self) -> Iterator[Triple]:
        """Yield the receptions of the vehicle, one per block, with the received facts that count."""
        # Facts of excluded origins, and statuses replaced since, are in no triple: do not point to them.
        counting = {fact_iri(observation) for observation in self.facts} if self._known.receptions else frozenset()
        owner = self.model.owner
        for name, reception in {block_name(each.block): each for each in self._known.receptions}.items():
            iri = RUN[f"reception-{owner}-{name}"]
            yield (iri, RDF.type, SIT.Reception)
            yield (iri, SIT.receivedBy, instance_iri(owner))
            if reception.sender is not None:
                yield (iri, SIT.receivedFrom, instance_iri(reception.sender))
            yield (iri, SIT.receivedAt, _number(reception.time_s))
            for position in range(len(reception.block.facts)):
                fact = fact_iri(Observation(reception.block, position))
                if fact in counting:
                    yield (iri, SIT.received, fact)

    def estimates(self) -> Iterator[Triple]:
        """Yield the fused estimates of all properties with uncertain values."""
        for uid in self.model.instance_uids():
            for attribute in self.model.tbox.attributes:
                observations = self.model.history(uid, attribute.uid)
                estimate = fused(attribute, observations) if observations else None
                if estimate is not None and estimate.uncertainty is not None:
                    yield from self._estimate(uid, attribute.uid, estimate)

    def _estimate(self, uid: int, uid_of_attribute: int, estimate: Estimate) -> Iterator[Triple]:
        attribute = self.model.tbox.attributes[uid_of_attribute]
        is_link = attribute.kind in (ValueKind.LINK, ValueKind.TYPE)
        for number, (value, sure) in enumerate(estimate.probabilities or ((estimate.value, estimate.uncertainty),)):
            iri = RUN[f"estimate-{uid}-{attribute.uid}{f'-{number}' if number else ''}"]
            if attribute.kind is ValueKind.POINT:
                term: Node = Literal("POINT ({} {})".format(*value))  # type: ignore[misc]
            elif attribute.kind is ValueKind.NUMBER:
                term = _number(value)
            else:
                term = term_of(self.model.tbox, attribute, value)
            yield (instance_iri(uid), SIT.hasPropertyValue, iri)
            yield (iri, RDF.type, SIT.PropertyValue)
            yield (iri, SIT.ofAttribute, self._attributes[attribute.uid])
            yield (iri, SIT.linkValue if is_link else SIT.dataValue, term)
            yield (iri, _how_sure(attribute.kind), _number(sure or 0.0))
            yield (iri, SIT.timestamp, _number(estimate.time_s))
            for origin in estimate.origins:
                yield (iri, SIT.origin, instance_iri(origin))


def _how_sure(kind: ValueKind) -> URIRef:
    return SIT.standardUncertainty if kind in MEASURED else SIT.probability


def _number(number: Any) -> Literal:
    return Literal(number, datatype=XSD.double)


class NamedGraphs(Dataset):
    """Data set whose named graphs are listed without the estimates."""

    def graphs(self, triple: Any = None) -> Generator[Graph, None, None]:
        """Yield the graphs with ``triple``, or all."""
        yield from (graph for graph in super().graphs(triple) if graph.identifier != FUSED)

    # rdflib evaluates GRAPH by either name.
    contexts = graphs


def as_graph(known: Store | Knowledge) -> Graph:
    """Return TBox and knowledge of a vehicle as a new graph."""
    graph = Graph() + graph_of((triples := Triples(known)).model.tbox)
    for triple in triples.all():
        graph.add(triple)
    return graph


def as_dataset(known: Store | Knowledge) -> Dataset:
    """Return ``as_graph`` with named graphs: conclusions, estimates and the facts of each origin."""
    triples, data = Triples(known), NamedGraphs()
    whole = chain(graph_of(triples.model.tbox), triples.all())
    parts: dict[URIRef, Iterable[Triple]] = {
        DATASET_DEFAULT_GRAPH_ID: whole,
        CONCLUSIONS: triples.conclusions(),
        FUSED: triples.estimates(),
    }
    parts |= {instance_iri(origin): triples.said_by(origin) for origin in range(triples.model.n_origins)}
    for name, part in parts.items():
        data.addN((*triple, data.graph(name)) for triple in part)
    return data
