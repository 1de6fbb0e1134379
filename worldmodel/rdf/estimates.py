"""What was fused, as triples: one estimate for each slot of which somebody said something with an uncertainty.

They stand in the named graph ``run:fused`` alone, like facts that nobody told::

    run:instance-7 sit:hasPropertyValue run:estimate-7-15 .
    run:estimate-7-15 a sit:PropertyValue ; sit:ofAttribute rm:location ; sit:dataValue "POINT (3.52 4.01)" ;
        sit:standardUncertainty 0.31e0 ; sit:timestamp 12.3e0 ; sit:origin run:instance-2 , run:instance-4 .

7-15 is subject and attribute by uids. Of symbols, truth values, types and links there is one for each hypothesis, with
its sit:probability, the most probable as run:estimate-7-15, the next as run:estimate-7-15-1. Values are off the grid of
what is told; the time is that of the newest observation, and the origins are all whose observations count. Fusion is
that of ``worldmodel.fused`` with the drift that the ontology declares.
"""

from collections.abc import Iterator

from rdflib import RDF, XSD, Literal
from rdflib.term import Node

from worldmodel.fusion import Estimate, fused
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.tbox import MEASURED, ValueKind
from worldmodel.rdf.terms import RUN, RdfTerms
from worldmodel.store import Store

FUSED = RUN.fused
"""Name of the graph of all estimates."""
Triple = tuple[Node, Node, Node]


class Estimates:
    """What the facts of one world model come to, made anew when it has changed.

    Args:
        model: the world model.
        terms: of it.
    """

    def __init__(self, model: Store, terms: RdfTerms) -> None:
        self._model, self._terms = model, terms
        self._version = -1
        self._triples: list[Triple] = []

    def triples(self) -> list[Triple]:
        """Return all triples of estimates."""
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
        """The triples of the estimate of a slot: of each hypothesis, if there are several."""
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
