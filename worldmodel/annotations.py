"""What the rm: annotations of an attribute say of its values: grids, uncertainty, length, whether old ones count."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import Any

from rdflib import XSD, Graph, Literal, Namespace, URIRef
from rdflib.term import Node

from worldmodel.expressions import OntologyReader
from worldmodel.fields import Field
from worldmodel.tbox import MEASURED, ValueKind
from worldmodel.texts import LONGEST_BYTES, most_bytes_of
from worldmodel.units import QUDT_UNITS, symbol_of

RM = Namespace("https://w3id.org/remoras/marine#")
BOUNDS = (RM.minimum, RM.maximum, RM.resolution)
ANNOTATIONS = {
    *BOUNDS, RM.unit, RM.latestOnly, RM.sigma, RM.probability, RM.drift, RM.maxBytes
}  # fmt: skip
SIGMAS = 64
"""Standard deviations that a value may carry: as many steps of ``rm:sigma``, six bits."""


def _python(term: Node) -> Any:
    return term.toPython() if isinstance(term, Literal) else term


class Annotations:
    """Reads the annotations out of ``graph``; ``reader`` takes the faults."""

    def __init__(self, graph: Graph, reader: OntologyReader) -> None:
        self._graph = graph
        self._reader = reader

    def boolean(self, iri: URIRef, predicate: URIRef) -> bool:
        """True if it is stated, once."""
        values = [_python(term) for term in self._graph.objects(iri, predicate)]
        if len(values) > 1 or any(not isinstance(each, bool) for each in values):
            got = " and ".join(map(repr, values))
            self._reader.fault(iri, f"{self._reader.shown(predicate)} is {got}", "true or false, once")
        return True in values

    def fields(self, iri: URIRef, n_axes: int, datatype: Node) -> tuple[Field, ...]:
        """Bounds and resolution of a number, or of both numbers of a point; empty where they are no grid."""
        numbers: list[float] = []
        for predicate in BOUNDS:
            values = [_python(term) for term in self._graph.objects(iri, predicate)]
            if len(values) == 1 and type(values[0]) in (int, float, Decimal):
                numbers.append(float(values[0]))
            else:
                got = " and ".join(map(repr, values)) or "missing"
                self._reader.fault(iri, f"{self._reader.shown(predicate)} is {got}", "one number")
        if datatype == XSD.integer and any(number % 1 for number in numbers):
            self._reader.fault(iri, f"its bounds and resolution are {numbers}", "whole numbers for xsd:integer")
        units = sorted(self._graph.objects(iri, RM.unit), key=str)
        symbols = [symbol_of(unit) if isinstance(unit, URIRef) else None for unit in units]
        if len(units) > 1 or None in symbols:
            got = " and ".join(map(self._reader.shown, units))
            self._reader.fault(iri, f"rm:unit is {got}", f"none, or one unit of QUDT such as <{QUDT_UNITS}M>")
        if len(numbers) < len(BOUNDS) or len(units) > 1:
            return ()
        try:
            minimum, maximum, resolution = numbers
            return (Field(minimum, maximum, resolution, next(iter(symbols), None) or ""),) * n_axes
        except ValueError as error:
            self._reader.fault(iri, str(error), "minimum < maximum, a whole number of resolutions apart")
            return ()

    def uncertainty(self, iri: URIRef, kind: ValueKind, fields: tuple[Field, ...]) -> Field | None:
        """The grid of what values may carry: 64 steps of a standard deviation, all of a probability between 0 and 1."""
        own, other = (RM.sigma, RM.probability) if kind in MEASURED else (RM.probability, RM.sigma)
        fault, shown = self._reader.fault, self._reader.shown
        if (iri, other, None) in self._graph:
            fault(iri, f"{shown(other)} on a {kind.value}", f"{shown(own)} for a {kind.value}")
        values = [_python(term) for term in self._graph.objects(iri, own)]
        if not values:
            return None
        if len(values) > 1 or type(values[0]) not in (int, float, Decimal):
            fault(iri, f"{shown(own)} is {' and '.join(map(repr, values))}", "one number, the step")
            return None
        step = float(values[0])
        try:
            if kind in MEASURED:
                return Field(step, SIGMAS * step, step, fields[0].unit if fields else "")
            return Field(step, float(1 - Decimal(str(step))), step, "")
        except (ValueError, ArithmeticError) as error:
            fault(iri, f"{shown(own)} {step}: {error}", "a step above 0; of a probability, a part of 1 below 0.5")
            return None

    def drift(self, iri: URIRef) -> float:
        """How far a number or point walks at random, per square root of a second; 0 where nothing is stated."""
        stated = [_python(term) for term in self._graph.objects(iri, RM.drift)]
        if not stated:
            return 0.0
        if len(stated) == 1 and type(stated[0]) in (int, float, Decimal) and 0.0 <= float(stated[0]) < math.inf:
            return float(stated[0])
        got = " and ".join(map(repr, stated))
        self._reader.fault(iri, f"rm:drift is {got}", "one number of 0 or more")
        return 0.0

    def most_bytes(self, iri: URIRef, kind: ValueKind) -> int:
        """How long a text may be; 0 for another kind."""
        stated = [_python(term) for term in self._graph.objects(iri, RM.maxBytes)]
        if kind is ValueKind.TEXT:
            try:
                return most_bytes_of(stated)
            except ValueError as error:
                self._reader.fault(iri, str(error), f"one whole number for a text, 1 to {LONGEST_BYTES}")
        elif stated:
            self._reader.fault(iri, f"rm:maxBytes on a {kind.value}", "texts")
        return 0
