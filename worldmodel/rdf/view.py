"""World model as RDF: a read-only rdflib store without copies.

Each fact is a sit:PropertyValue of the situation-awareness TBox:

    run:instance-7 sit:hasPropertyValue run:fact-2-15-0 .
    run:fact-2-15-0 a sit:PropertyValue ; sit:ofAttribute rm:location ; sit:dataValue "POINT (3.5 4.0)" ;
        sit:timestamp 12.3e0 ; sit:origin run:instance-2 .

2-15-0 is origin, sequence and position in the block; 2.e1-15-0 is of epoch 1, 2-p1-0 of the first private block. A
status is run:status-2-7-4-12.3: origin, uids of subject and attribute, time. An origin is the common instance of its
number. A link has sit:linkValue in place of sit:dataValue; for sit:type its object is a class. Literals have the
datatype of the ontology; a point is a string, which rm:Point restricts. Attributes are not written as sit:Attribute,
which follows from the range of sit:ofAttribute, since tools warn about properties that are also individuals.

Beside this history is the current state, one triple per property: run:instance-7 rm:location "POINT (3.5 4.0)". Types
appear without time, as rdf:type, asserted and inferred; so do inferred links. A common instance has its name as
rdfs:label. Excluded origins are left out.

The default graph is the union of asserted and inferred triples. Named graphs are run:conclusions with the inferred
ones, the facts of each origin under its IRI (``GRAPH ?by { ... }``), and run:fused with estimates, which neither ?by
nor the default graph includes. A graph of another name is empty.
"""

from collections.abc import Generator, Iterator
from functools import lru_cache
from typing import Any

from rdflib import Dataset, Graph, URIRef
from rdflib import store as rdflib_store
from rdflib.graph import DATASET_DEFAULT_GRAPH_ID
from rdflib.term import Node

from worldmodel.ontology import graph_of
from worldmodel.ontology.annotations import RM
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.tbox import TBox
from worldmodel.rdf.patterns import Abox, Triple
from worldmodel.rdf.terms import RUN, instance_uid
from worldmodel.rdf.triples import CONCLUSIONS, FUSED, Estimates
from worldmodel.store import Store
from worldmodel.world_model import Knowledge

_NO_CONTEXTS: Iterator[None] = iter(())


class RdfView(rdflib_store.Store):
    """rdflib store of one world model and its TBox; later records are visible at once."""

    context_aware = True
    graph_aware = True

    def __init__(self, known: Store | Knowledge) -> None:
        super().__init__()
        self.abox = Abox(known if isinstance(known, Knowledge) else Knowledge(known))
        self._estimates = Estimates(self.abox.model, self.abox.terms)
        tbox = self.abox.model.tbox
        self._tbox_graph = graph_of(tbox)
        self._of_tbox = _terms_of(tbox)
        for prefix, namespace in (("rm", RM), ("sit", SIT), ("run", RUN)):
            self._tbox_graph.bind(prefix, namespace)

    def triples(self, triple_pattern: Any, context: Any = None) -> Iterator[tuple[Triple, Iterator[None]]]:
        """Yield the matching triples, of one named graph if ``context`` names it; None matches all."""
        abox, none = self.abox, _NO_CONTEXTS
        if (origin := self._origin_asked(context)) is not None:
            for triple in abox.triples_of(origin, triple_pattern):
                yield triple, none
            return
        if (name := getattr(context, "identifier", None)) in (CONCLUSIONS, FUSED):
            for triple in abox.conclusions.triples() if name == CONCLUSIONS else self._estimates.triples():
                if _matches(triple, triple_pattern):
                    yield triple, none
            return
        if self._is_named(context):
            return
        subject, predicate, target = triple_pattern
        subjects, predicates, targets = self._of_tbox
        if (
            (predicate is None or predicate in predicates)
            and (subject is None or subject in subjects)
            and (target is None or target in targets)
        ):
            known = self._tbox_graph
            for triple in known.triples(triple_pattern):
                yield triple, none
            for triple in abox.triples(triple_pattern):
                if triple not in known:
                    yield triple, none
            return
        for triple in abox.triples(triple_pattern):
            yield triple, none

    def _origin_asked(self, context: Any) -> int | None:
        """Return the origin whose graph is queried; None for other graphs."""
        identifier = getattr(context, "identifier", None)
        return instance_uid(identifier) if isinstance(identifier, URIRef) else None

    @staticmethod
    def _is_named(context: Any) -> bool:
        """True for a named graph, False for the default union."""
        identifier = getattr(context, "identifier", None)
        return isinstance(identifier, URIRef) and identifier != DATASET_DEFAULT_GRAPH_ID

    def contexts(self, triple: Any = None) -> Generator[Graph, None, None]:
        """Yield the named graphs with ``triple``, or all: origins with facts, and conclusions."""
        for origin in range(self.abox.model.n_origins):
            pattern = triple or (None, None, None)
            if next(self.abox.triples_of(origin, pattern), None) is not None:
                yield Graph(self, self.abox.terms.instance(origin))
        if any(_matches(concluded, triple or (None, None, None)) for concluded in self.abox.conclusions.triples()):
            yield Graph(self, CONCLUSIONS)

    def __len__(self, context: Any = None) -> int:
        return sum(1 for _ in self.triples((None, None, None), context))

    def bind(self, prefix: str, namespace: URIRef, override: bool = True) -> None:
        """Bind a prefix in the TBox graph, which all views of the TBox share."""
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

    def add_graph(self, graph: Graph) -> None:
        """Do nothing: the graphs of a view are fixed."""

    def add(self, triple: Any, context: Any, quoted: bool = False) -> None:
        """Refuse: callers record or merge facts instead."""
        raise TypeError("the RDF view is read-only; call WorldModel.record or merge")

    def remove(self, triple: Any, context: Any = None) -> None:
        """Refuse: known facts are never removed."""
        raise TypeError("the RDF view is read-only; nothing that is known is removed")


def _matches(triple: Triple, pattern: Any) -> bool:
    return all(asked is None or asked == term for asked, term in zip(pattern, triple, strict=True))


@lru_cache(maxsize=8)
def _terms_of(tbox: TBox) -> tuple[frozenset[Node], frozenset[Node], frozenset[Node]]:
    """Return the subjects, predicates and objects of the ontology files, to skip other patterns."""
    triples = list(graph_of(tbox))
    subjects, predicates, targets = (frozenset(triple[place] for triple in triples) for place in range(3))
    return subjects, predicates, targets


def as_graph(known: Store | Knowledge) -> Graph:
    """Return TBox and knowledge of a vehicle as one live read-only graph."""
    return Graph(store=RdfView(known))


def as_dataset(known: Store | Knowledge) -> Dataset:
    """Return ``as_graph`` with the facts of each origin as named graphs."""
    return Dataset(store=RdfView(known), default_union=True)
