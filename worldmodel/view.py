"""The world model as RDF, for SPARQL and export: a read-only rdflib store that copies nothing.

Each fact is a sit:PropertyValue, after the situation-awareness TBox:

    <instance/7> sit:hasPropertyValue <fact/2-15-0> .
    <fact/2-15-0> a sit:PropertyValue ; sit:ofAttribute rm:location ; sit:value "POINT (3.5 4.0)"^^rm:Point ;
        sit:timestamp 12.3e0 ; sit:origin <origin/2> .

2-15-0 is origin, sequence and position in the block. Beside this history stands the current state, one triple
for each slot: <instance/7> rm:location "POINT (3.5 4.0)"^^rm:Point. The types of an instance are given
without regard to time: rdf:type with the class it was created with and all it was given since. Banned origins
are left out.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rdflib import RDF, RDFS, XSD, Graph, Literal, Namespace, URIRef
from rdflib.store import Store
from rdflib.term import Node

from worldmodel.facts import Observation
from worldmodel.owl import RM, SIT
from worldmodel.tbox import TYPE_UID, Attribute, TBox, Value, ValueKind

if TYPE_CHECKING:
    from worldmodel.abox import WorldModel

RUN = Namespace("https://w3id.org/remoras/run/")

Triple = tuple[Node, Node, Node]
Pattern = tuple[Node | None, Node | None, Node | None]

_INSTANCE = str(RUN) + "instance/"
_FACT = str(RUN) + "fact/"
_OF_FACTS = {RDF.type, SIT.ofAttribute, SIT.value, SIT.timestamp, SIT.origin}


def instance_iri(uid: int) -> URIRef:
    """Return the IRI of an instance."""
    return URIRef(f"{_INSTANCE}{uid}")


def origin_iri(origin: int) -> URIRef:
    """Return the IRI of an origin."""
    return RUN[f"origin/{origin}"]


def term_of(tbox: TBox, attribute: Attribute, value: Value) -> Node:
    """Return a stored value as an RDF term."""
    stored: Any = attribute.quantise(value)
    match attribute.kind:
        case ValueKind.TYPE:
            return URIRef(tbox.classes[stored].iri)
        case ValueKind.LINK:
            return instance_iri(stored)
        case ValueKind.SYMBOL:
            return Literal(attribute.symbols[stored])
        case ValueKind.POINT:
            return Literal(f"POINT ({stored[0]} {stored[1]})", datatype=RM.Point)
        case ValueKind.BOOLEAN:
            return Literal(stored)
        case ValueKind.NUMBER:
            return Literal(stored, datatype=XSD.double)


class WorldModelStore(Store):
    """rdflib's way into one world model; what is recorded later is seen at once.

    With ``with_tbox`` the triples of the TBox are there too.
    """

    def __init__(self, model: "WorldModel", with_tbox: bool = True) -> None:
        super().__init__()
        self._model = model
        self._tbox_graph = model.tbox.graph if with_tbox else Graph()
        self._attributes: dict[Node, Attribute] = {URIRef(a.iri): a for a in model.tbox.attributes}
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

    # A superset of the matching ABox triples, as small as the bound terms make it without an index of its own

    def _abox_triples(self, pattern: Pattern) -> Iterator[Triple]:
        subject, predicate, target = pattern
        if subject is None:
            yield from self._triples_of_any_subject(predicate, target)
        elif (observation := self._observation(subject)) is not None:
            yield from self._fact_triples(observation)
        elif (uid := _number_after(_INSTANCE, subject)) is not None:
            yield from self._instance_triples(uid, predicate)
        elif subject in self._attributes:
            yield (subject, RDF.type, SIT.Attribute)

    def _triples_of_any_subject(self, predicate: Node | None, target: Node | None) -> Iterator[Triple]:
        model = self._model
        if predicate == SIT.hasPropertyValue and target is not None:
            observation = self._observation(target)
            if observation is not None:
                yield (instance_iri(observation.fact.subject), SIT.hasPropertyValue, target)
            return
        if predicate is None or predicate == RDF.type:
            for iri in self._attributes:
                yield (iri, RDF.type, SIT.Attribute)
        if predicate is None or predicate in _OF_FACTS:
            for block in model.blocks():
                if block.origin not in model.banned:
                    for position in range(len(block.facts)):
                        yield from self._fact_triples(Observation(block, position))
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

    def _fact_triples(self, observation: Observation) -> Iterator[Triple]:
        tbox, fact, iri = self._model.tbox, observation.fact, _fact_iri(observation)
        attribute = tbox.attributes[fact.attribute]
        yield (iri, RDF.type, SIT.PropertyValue)
        yield (iri, SIT.ofAttribute, URIRef(attribute.iri))
        yield (iri, SIT.value, term_of(tbox, attribute, fact.value))
        yield (iri, SIT.timestamp, Literal(observation.time_s, datatype=XSD.double))
        yield (iri, SIT.origin, origin_iri(observation.origin))

    def _observation(self, iri: Node) -> Observation | None:
        """Return what the IRI of a fact stands for."""
        numbers = iri[len(_FACT) :].split("-") if isinstance(iri, URIRef) and iri.startswith(_FACT) else []
        if len(numbers) != 3 or not all(number.isdecimal() for number in numbers):
            return None
        origin, sequence, position = map(int, numbers)
        block = self._model.block((origin, sequence))
        if block is None or position >= len(block.facts) or origin in self._model.banned:
            return None
        return Observation(block, position)


def as_graph(model: "WorldModel") -> Graph:
    """Return the TBox and what ``model`` knows as one read-only graph, for SPARQL; it follows the model."""
    return Graph(store=WorldModelStore(model))


def canonical_ntriples(model: "WorldModel") -> str:
    """Return what ``model`` knows, without the TBox, as sorted N-Triples.

    Models with equal ``state_hash`` and bans give equal text.
    """
    triples = WorldModelStore(model, with_tbox=False).triples((None, None, None))
    return "".join(sorted(f"{s.n3()} {p.n3()} {o.n3()} .\n" for (s, p, o), _ in triples))


def export(model: "WorldModel", path: Path, format: str = "turtle") -> None:
    """Write what ``model`` knows, without the TBox, to ``path``.

    ``format`` is any that rdflib can write; "nt" gives ``canonical_ntriples``.
    """
    if format == "nt":
        path.write_text(canonical_ntriples(model), encoding="utf-8")
        return
    graph = Graph(store=WorldModelStore(model, with_tbox=False))
    graph.serialize(destination=str(path), format=format, encoding="utf-8")


def _fact_iri(observation: Observation) -> URIRef:
    block = observation.block
    return URIRef(f"{_FACT}{block.origin}-{block.sequence}-{observation.position}")


def _number_after(prefix: str, iri: Node) -> int | None:
    digits = iri[len(prefix) :] if isinstance(iri, URIRef) and iri.startswith(prefix) else ""
    return int(digits) if digits.isdecimal() else None
