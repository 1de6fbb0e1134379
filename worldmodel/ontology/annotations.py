"""Units, grids, uncertainty, lengths and statuses that the rm: annotations of an attribute state of its values."""

import math
from collections.abc import Callable, Sequence
from decimal import Decimal
from typing import Any

from rdflib import XSD, Graph, Literal, Namespace, URIRef
from rdflib.term import Node

from worldmodel.ontology.fields import LONGEST_BYTES, Field
from worldmodel.ontology.tbox import MEASURED, ValueKind

RM = Namespace("https://w3id.org/remoras/marine#")
BOUNDS = (RM.minimum, RM.maximum, RM.resolution)
ANNOTATIONS = frozenset({*BOUNDS, RM.unit, RM.latestOnly, RM.sigma, RM.probability, RM.drift, RM.maxBytes})
SIGMAS = 64
"""Standard deviations that a value may carry: as many steps of ``rm:sigma``, six bits."""

QUDT_UNITS = "http://qudt.org/vocab/unit/"
"""Namespace of the units of QUDT, http://qudt.org."""
_SYMBOLS = {
    "M": "m",
    "SEC": "s",
    "M-PER-SEC": "m/s",
    "HZ": "Hz",
    "KiloHZ": "kHz",
    "BIT-PER-SEC": "bit/s",
    "DEG": "deg",
    "DEG_C": "degC",
    "PPM": "ppm",
    "L": "L",
    "J": "J",
    "W": "W",
    "DeciB": "dB",
    "PERCENT": "%",
}

Fault = Callable[[Node, str, str], None]
"""Takes a fault: its subject, what is wrong, and what is allowed."""


def symbol_of(iri: str) -> str | None:
    """Return the symbol of a unit of QUDT, or its name where none is listed; None for other IRIs.

    >>> symbol_of("http://qudt.org/vocab/unit/M"), symbol_of("http://qudt.org/vocab/unit/NanoFARAD"), symbol_of("m")
    ('m', 'NanoFARAD', None)
    """
    name = iri.removeprefix(QUDT_UNITS)
    return None if not name or name == iri else _SYMBOLS.get(name, name)


class Annotations:
    """The annotations of one attribute, which are read on request."""

    def __init__(self, graph: Graph, iri: URIRef, kind: ValueKind, fault: Fault) -> None:
        """Read annotations.

        Args:
            graph: the ontology.
            iri: the attribute.
            kind: of its values.
            fault: takes the faults.
        """
        self._graph, self._iri, self._kind, self._fault = graph, iri, kind, fault
        of_numbers = (*BOUNDS, RM.unit, RM.drift)
        refused = {
            **({} if kind in MEASURED else dict.fromkeys(of_numbers, "numbers and points")),
            RM.probability if kind in MEASURED else RM.sigma: f"{'rm:sigma' if kind in MEASURED else 'rm:probability'}",
            **({} if kind is ValueKind.TEXT else {RM.maxBytes: "texts"}),
        }
        for predicate, allowed in refused.items():
            if (iri, predicate, None) in graph:
                self._wrong(f"{self._shown(predicate)} on a {kind.value}", allowed)

    @property
    def latest_only(self) -> bool:
        """Whether older values are obsolete."""
        return self._one(RM.latestOnly, (bool,), "true or false, once") or False

    def fields(self, datatype: Node) -> tuple[Field, ...]:
        """Return the grid of a number, or of both numbers of a point; empty for others and where there is a fault."""
        if self._kind not in MEASURED:
            return ()
        bounds = [self._number(predicate, "one number", is_needed=True) for predicate in BOUNDS]
        units = sorted(self._graph.objects(self._iri, RM.unit), key=str)
        symbols = [symbol_of(unit) if isinstance(unit, URIRef) else None for unit in units]
        if len(units) > 1 or None in symbols:
            got = " and ".join(map(self._shown, units))
            self._wrong(f"rm:unit is {got}", f"none, or one unit of QUDT such as <{QUDT_UNITS}M>")
        numbers = [bound for bound in bounds if bound is not None]
        if datatype == XSD.integer and any(number % 1 for number in numbers):
            self._wrong(f"its bounds and resolution are {numbers}", "whole numbers for xsd:integer")
        if len(numbers) < len(BOUNDS):
            return ()
        minimum, maximum, resolution = numbers
        try:
            field = Field(minimum, maximum, resolution, next(iter(symbols), None) or "")
        except ValueError as error:
            self._wrong(str(error), "minimum < maximum, a whole number of resolutions apart")
            return ()
        return (field,) * (2 if self._kind is ValueKind.POINT else 1)

    def uncertainty(self, fields: Sequence[Field]) -> Field | None:
        """Return the grid of uncertainties: 64 steps of a standard deviation, all of a probability from 0 to 1."""
        own = RM.sigma if self._kind in MEASURED else RM.probability
        step = self._number(own, "one number, the step")
        if step is None:
            return None
        try:
            if self._kind in MEASURED:
                return Field(step, SIGMAS * step, step, fields[0].unit if fields else "")
            return Field(step, float(1 - Decimal(str(step))), step, "")
        except (ValueError, ArithmeticError) as error:
            allowed = "a step above 0; of a probability, a part of 1 below 0.5"
            self._wrong(f"{self._shown(own)} {step}: {error}", allowed)
            return None

    @property
    def drift(self) -> float:
        """Random walk of a number or point per square root of a second; 0 where nothing is stated."""
        drift = self._number(RM.drift, "one number of 0 or more")
        if drift is not None and not 0.0 <= drift < math.inf:
            self._wrong(f"rm:drift is {drift}", "one number of 0 or more")
        return drift or 0.0

    @property
    def most_bytes(self) -> int:
        """The greatest length of a text in UTF-8; 0 for another kind."""
        if self._kind is not ValueKind.TEXT:
            return 0
        allowed = f"one whole number for a text, 1 to {LONGEST_BYTES}"
        length = self._one(RM.maxBytes, (int,), allowed, is_needed=True)
        if length is not None and not 1 <= length <= LONGEST_BYTES:
            self._wrong(f"rm:maxBytes is {length}", allowed)
        return length or 0

    def _number(self, predicate: URIRef, allowed: str, is_needed: bool = False) -> float | None:
        number = self._one(predicate, (int, float, Decimal), allowed, is_needed)
        return None if number is None else float(number)

    def _one(self, predicate: URIRef, types: tuple[type, ...], allowed: str, is_needed: bool = False) -> Any:
        """Return the one value of an annotation; None, with a fault, where it has not one of such a type."""
        terms = self._graph.objects(self._iri, predicate)
        values = [term.toPython() if isinstance(term, Literal) else term for term in terms]
        if len(values) == 1 and type(values[0]) in types:
            return values[0]
        if values or is_needed:
            self._wrong(f"{self._shown(predicate)} is {' and '.join(map(repr, values)) or 'missing'}", allowed)
        return None

    def _wrong(self, what: str, allowed: str) -> None:
        self._fault(self._iri, what, allowed)

    def _shown(self, term: Node) -> str:
        return term.n3(self._graph.namespace_manager)
