"""The world model as RDF, for SPARQL: a read-only rdflib store that copies nothing.

Each fact is a sit:PropertyValue, after the situation-awareness TBox:

    run:instance-7 sit:hasPropertyValue run:fact-2-15-0 .
    run:fact-2-15-0 a sit:PropertyValue ; sit:ofAttribute rm:location ; sit:dataValue "POINT (3.5 4.0)" ;
        sit:timestamp 12.3e0 ; sit:origin run:instance-2 .

2-15-0 is origin, sequence and position in the block; 2.e1-15-0 is of epoch 1, 2-p1-0 of the first block that the
origin keeps to itself. A status is run:status-ORIGIN-SUBJECT-ATTRIBUTE, by uids. An origin is a vehicle, and the common
instance of its number. A link has sit:linkValue in place of sit:dataValue; the link of a fact of sit:type leads to a
class. Literals have the datatype that the ontology declares; a point is a string, which rm:Point restricts. That an
attribute is a sit:Attribute follows from the range of sit:ofAttribute and is not written: tools complain of properties
that are individuals too. Beside this history stands the current state, one triple for each slot: run:instance-7
rm:location "POINT (3.5 4.0)". The types of an instance stand without their times: rdf:type with the class that it was
created with and all that it was given since. A common instance has its name as rdfs:label. Banned origins are left out.
"""

import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

from rdflib import RDF, RDFS, XSD, Graph, Literal, Namespace, URIRef
from rdflib import store as rdflib_store
from rdflib.term import Node

from worldmodel.errors import QueryError
from worldmodel.facts import Observation
from worldmodel.owl import graph_of
from worldmodel.store import Store
from worldmodel.tbox import TYPE_UID, Attribute, TBox, Value, ValueKind
from worldmodel.turtle import RM, SIT

RUN = Namespace("https://w3id.org/remoras/run/")

Triple = tuple[Node, Node, Node]
QueryValue = str | float | bool | None
"""A value of a query's answer."""
Pattern = tuple[Node | None, Node | None, Node | None]

_INSTANCE = str(RUN) + "instance-"
_FACT = str(RUN) + "fact-"
_STATUS = str(RUN) + "status-"
_OF_FACTS = {RDF.type, SIT.ofAttribute, SIT.dataValue, SIT.linkValue, SIT.timestamp, SIT.origin}


def instance_iri(uid: int) -> URIRef:
    """Return the IRI of an instance."""
    return URIRef(f"{_INSTANCE}{uid}")


def attribute_iri(attribute: Attribute) -> URIRef:
    """Return the IRI of an attribute in facts; rdf:type, which OWL reserves, goes by the name of sit:type."""
    return SIT.type if attribute.uid == TYPE_UID else URIRef(attribute.iri)


def value_predicate(attribute: Attribute) -> URIRef:
    """Return the property that leads from a fact to its value."""
    return SIT.linkValue if attribute.kind in {ValueKind.TYPE, ValueKind.LINK} else SIT.dataValue


def term_of(tbox: TBox, attribute: Attribute, value: Value) -> Node:
    """Return a stored value as an RDF term: a uid as an IRI, all else as a literal of the attribute's own datatype."""
    stored: Any = attribute.quantise(value)
    match attribute.kind:
        case ValueKind.TYPE:
            return URIRef(tbox.classes[stored].iri)
        case ValueKind.LINK:
            return instance_iri(stored)
        case ValueKind.SYMBOL:
            return Literal(attribute.symbols[stored])
        case ValueKind.POINT:
            return Literal(f"POINT ({stored[0]} {stored[1]})")
        case ValueKind.BOOLEAN:
            return Literal(stored)
        case ValueKind.NUMBER:
            return _number_literal(stored, attribute.datatype)


def _number_literal(number: float, datatype: str) -> Literal:
    if datatype == str(XSD.integer):
        return Literal(int(number), datatype=XSD.integer)
    if datatype == str(XSD.decimal):
        return Literal(f"{Decimal(repr(number)):f}", datatype=XSD.decimal)
    return Literal(number, datatype=XSD.double)


class RdfView(rdflib_store.Store):
    """rdflib's way into one world model and its TBox; what is recorded later is seen at once."""

    def __init__(self, model: Store) -> None:
        super().__init__()
        self._model = model
        self._tbox_graph = graph_of(model.tbox)
        self._attributes: dict[Node, Attribute] = {attribute_iri(a): a for a in model.tbox.attributes}
        self._class_uids: dict[Node, int] = {URIRef(c.iri): c.uid for c in model.tbox.classes}
        for prefix, namespace in (("rm", RM), ("sit", SIT), ("run", RUN)):
            self._tbox_graph.bind(prefix, namespace)

    def triples(self, triple_pattern: Any, context: Any = None) -> Iterator[tuple[Triple, Iterator[None]]]:
        """Yield the triples that match a pattern, where None matches all."""
        for triple in self._tbox_graph.triples(triple_pattern):
            yield triple, iter(())
        for triple in self._abox_triples(triple_pattern):
            if all(asked is None or asked == term for asked, term in zip(triple_pattern, triple, strict=True)):
                yield triple, iter(())

    def __len__(self, context: Any = None) -> int:
        return sum(1 for _ in self.triples((None, None, None)))

    def bind(self, prefix: str, namespace: URIRef, override: bool = True) -> None:
        """Bind a prefix; the names are kept with the graph of the TBox."""
        self._tbox_graph.store.bind(prefix, namespace, override)

    def namespace(self, prefix: str) -> URIRef | None:
        """Return the namespace of a prefix."""
        return self._tbox_graph.store.namespace(prefix)

    def prefix(self, namespace: URIRef) -> str | None:
        """Return the prefix of a namespace."""
        return self._tbox_graph.store.prefix(namespace)

    def namespaces(self) -> Iterator[tuple[str, URIRef]]:
        """Yield the prefixes."""
        return self._tbox_graph.store.namespaces()

    def add(self, triple: Any, context: Any, quoted: bool = False) -> None:
        """Refuse: facts are recorded or merged, never written as triples."""
        raise TypeError("the RDF view is read-only; call WorldModel.record or merge")

    def remove(self, triple: Any, context: Any = None) -> None:
        """Refuse: nothing that is known is ever removed."""
        raise TypeError("the RDF view is read-only; nothing that is known is removed")

    def _abox_triples(self, pattern: Pattern) -> Iterator[Triple]:
        """Yield a superset of the matching ABox triples, as small as the bound terms make it without an index."""
        subject, predicate, target = pattern
        if predicate == SIT.hasPropertyValue and target is not None:
            if (observation := self._observation(target)) is not None:
                yield (instance_iri(observation.fact.subject), SIT.hasPropertyValue, target)
        elif subject is None:
            yield from self._triples_of_any_subject(predicate, target)
        elif (observation := self._observation(subject)) is not None:
            yield from self._fact_triples(observation, predicate)
        elif (uid := _number_after(_INSTANCE, subject)) is not None:
            yield from self._instance_triples(uid, predicate)

    def _triples_of_any_subject(self, predicate: Node | None, target: Node | None) -> Iterator[Triple]:
        model = self._model
        if predicate == RDF.type and target in self._class_uids:
            for instance in model.instances_of(self._class_uids[target]):
                yield from self._instance_triples(instance.uid, RDF.type)
            return
        if predicate is None or predicate in _OF_FACTS:
            asked = self._attributes.get(target) if target and predicate == SIT.ofAttribute else None
            for block in (*model.blocks(), *model.private_blocks(), *model.statuses()):
                if block.origin not in model.banned:
                    for position, fact in enumerate(block.facts):
                        if asked is None or fact.attribute == asked.uid:
                            yield from self._fact_triples(Observation(block, position), predicate)
        if predicate == RDF.type or predicate not in _OF_FACTS:
            for uid in model.instance_uids():
                yield from self._instance_triples(uid, predicate)

    def _instance_triples(self, uid: int, predicate: Node | None) -> Iterator[Triple]:
        """Yield the triples of one instance, at least those with ``predicate``."""
        model, iri = self._model, instance_iri(uid)
        common = model.common_instances[uid : uid + 1]
        for instance in common:
            yield (iri, RDFS.label, Literal(instance.name))
        if predicate is None or predicate == RDF.type:
            types = [o.fact.target for o in model.history(uid, TYPE_UID)]
            for class_uid in sorted({*types, *(instance.class_uid for instance in common)}):
                yield (iri, RDF.type, URIRef(model.tbox.classes[class_uid].iri))
        if predicate is None or predicate == SIT.hasPropertyValue:
            for attribute in model.tbox.attributes:
                for observation in model.history(uid, attribute.uid):
                    yield (iri, SIT.hasPropertyValue, _fact_iri(observation))
        current = self._attributes.values() if predicate is None else self._attributes_at(predicate)
        for attribute in current:
            latest = model.latest(uid, attribute.uid)
            if latest is not None and attribute.uid != TYPE_UID:
                yield (iri, URIRef(attribute.iri), term_of(model.tbox, attribute, latest.value))

    def _attributes_at(self, predicate: Node) -> tuple[Attribute, ...]:
        return (self._attributes[predicate],) if predicate in self._attributes else ()

    def _fact_triples(self, observation: Observation, predicate: Node | None) -> Iterator[Triple]:
        """Yield the triples of one fact with ``predicate``, or all of them."""
        tbox, fact, iri = self._model.tbox, observation.fact, _fact_iri(observation)
        attribute = tbox.attributes[fact.attribute]
        if predicate is None or predicate == RDF.type:
            yield (iri, RDF.type, SIT.PropertyValue)
        if predicate is None or predicate == SIT.ofAttribute:
            yield (iri, SIT.ofAttribute, attribute_iri(attribute))
        if predicate is None or predicate == value_predicate(attribute):
            yield (iri, value_predicate(attribute), term_of(tbox, attribute, fact.value))
        if predicate is None or predicate == SIT.timestamp:
            yield (iri, SIT.timestamp, Literal(observation.time_s, datatype=XSD.double))
        if predicate is None or predicate == SIT.origin:
            yield (iri, SIT.origin, instance_iri(observation.origin))

    def _observation(self, iri: Node) -> Observation | None:
        """Return the observation that the IRI of a fact stands for, unless its origin is banned."""
        if not isinstance(iri, URIRef):
            return None
        if iri.startswith(_STATUS):
            status = re.fullmatch(r"(\d+)-(\d+)-(\d+)", iri[len(_STATUS) :])
            slot = None if status is None else (int(status[2]), int(status[3]), int(status[1]))
            held = None if slot is None else self._model.index.statuses.get(slot)
            return None if held is None or held.origin in self._model.banned else Observation(held, 0)
        name = iri[len(_FACT) :] if iri.startswith(_FACT) else ""
        fact = re.fullmatch(r"(\d+)(?:\.e(\d+))?-(p?)(\d+)-(\d+)", name)
        if fact is None:
            return None
        origin, sequence, position = int(fact[1]), int(fact[4]), int(fact[5])
        block = self._model.block((origin, int(fact[2] or 0), -1 - sequence if fact[3] else sequence))
        if block is None or position >= len(block.facts) or origin in self._model.banned:
            return None
        return Observation(block, position)


def as_graph(model: Store) -> Graph:
    """Return the TBox and what ``model`` knows as one read-only graph, which follows the model."""
    return Graph(store=RdfView(model))


def query(models: Store | Mapping[str, Store], sparql: str) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    """Ask one world model, or each of several, in SPARQL.

    The prefixes of the ontology files are bound, and ``sit:``, ``rm:`` and ``run:`` in any case. Several world
    models are asked one after the other: an aggregate is over the knowledge of one vehicle. For example, the
    roles of all vehicles, each with the time and the vehicle that said so::

        SELECT ?player ?role ?time_s ?by WHERE {
            ?player sit:hasPropertyValue ?fact .
            ?fact sit:ofAttribute rm:playsRole ; sit:linkValue ?role ; sit:timestamp ?time_s ; sit:origin ?by }

    Args:
        models: a world model, or world models by the names of their vehicles.
        sparql: a SELECT or ASK query.

    Returns:
        The names of the columns, and the rows. For several models the first column is ``vehicle``. ASK gives the
        column ``answer``. Instances, vehicles among them, are given by their names, other IRIs as ``rm:Vehicle``,
        points as ``POINT (3.5 4.0)``; None stands for what is not bound.

    Raises:
        QueryError: the text is no such query, or it names a variable ``?vehicle`` for several models.
    """
    if isinstance(models, Store):
        return _answer(models, sparql)
    columns: tuple[str, ...] = ()
    rows: list[tuple[QueryValue, ...]] = []
    for vehicle, model in models.items():
        columns, found = _answer(model, sparql)
        if "vehicle" in columns:
            raise QueryError(
                "the variable ?vehicle is taken: the column 'vehicle' says whose world model a row is from; "
                "give the variable another name"
            )
        rows += [(vehicle, *row) for row in found]
    return ("vehicle", *columns), rows


def _answer(model: Store, sparql: str) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    graph = as_graph(model)
    try:
        result = graph.query(sparql)
        if result.type not in {"SELECT", "ASK"}:
            raise QueryError(f"the query is a {result.type}; allowed: SELECT or ASK")
        if result.type == "ASK":
            return ("answer",), [(bool(result.askAnswer),)]
        columns = tuple(str(variable) for variable in result.vars or ())
        bindings = [{str(name): term for name, term in found.items()} for found in result.bindings]
        return columns, [tuple(_answered(model, graph, binding.get(name)) for name in columns) for binding in bindings]
    except QueryError:
        raise
    except Exception as error:  # rdflib's parser and evaluator raise whatever a query leads them to
        reason = " ".join(str(error).split())
        raise QueryError(
            f"the query cannot be answered: {reason}; allowed: a SPARQL 1.1 SELECT or ASK; the prefixes rm:, sit:, "
            "run:, rdf:, rdfs:, owl:, xsd: and those of the ontology files are known"
        ) from error


def _answered(model: Store, graph: Graph, term: Node | None) -> QueryValue:
    if isinstance(term, URIRef):
        uid = _number_after(_INSTANCE, term)
        instance = None if uid is None else model.instance(uid)
        return instance.name if instance is not None else str(term.n3(graph.namespace_manager))
    value = term.toPython() if isinstance(term, Literal) else term
    if isinstance(value, Decimal):  # averages of whole numbers
        return float(value)
    return value if value is None or isinstance(value, (bool, int, float)) else str(value)


def _fact_iri(observation: Observation) -> URIRef:
    block, fact = observation.block, observation.fact
    if block.is_status:
        return URIRef(f"{_STATUS}{block.origin}-{fact.subject}-{fact.attribute}")
    epoch = f".e{block.epoch}" if block.epoch else ""
    sequence = f"{block.sequence}" if block.is_item else f"p{-1 - block.sequence}"
    return URIRef(f"{_FACT}{block.origin}{epoch}-{sequence}-{observation.position}")


def _number_after(prefix: str, iri: Node) -> int | None:
    digits = iri[len(prefix) :] if isinstance(iri, URIRef) and iri.startswith(prefix) else ""
    return int(digits) if digits.isdecimal() else None
