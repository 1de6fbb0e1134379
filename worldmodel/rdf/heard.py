"""The triples of receptions: when and from whom a vehicle received what it knows of others."""

from collections.abc import Callable, Iterable, Iterator, Mapping

from rdflib import RDF
from rdflib.term import Node

from worldmodel.facts import Observation
from worldmodel.knowledge import Knowledge, Reception
from worldmodel.ontology.compiler import SIT
from worldmodel.rdf.terms import RdfTerms, block_name, fact_iri, is_fact, reception_iri

RECEPTION, RECEIVED = SIT.Reception, SIT.received


class Receptions:
    """The receptions of one vehicle, by their IRIs and by what was received.

    Args:
        known: what the vehicle knows.
        terms: of its world model.
        is_seen: tells whether a fact of that IRI is in the view.
    """

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
        """Predicates that receptions alone have."""

    def get(self, iri: Node) -> Reception | None:
        """Return the reception of that IRI, if it is one."""
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
        """Return the triple that leads to a fact."""
        reception = None if observation is None else self._of_block.get(block_name(observation.block))
        return () if reception is None else ((reception_iri(self._owner, reception.block), RECEIVED, fact),)

    def all_triples(self, predicate: Node | None, target: Node | None) -> Iterator[tuple[Node, Node, Node]]:
        """Yield the matching triples of all receptions; ``target`` is no fact."""
        if target is None or not is_fact(target):
            for iri, reception in self._by_iri.items():
                yield from self.triples(iri, reception, predicate, target)
