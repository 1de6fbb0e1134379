"""Reader of the rm: annotations of attributes: units, grids, uncertainty, lengths, statuses."""

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
"""Number of standard deviations of a value: multiples of ``rm:sigma`` in six bits."""

QUDT_UNITS = "http://qudt.org/vocab/unit/"
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
"""Fault handler: subject, fault, allowed values."""


def symbol_of(iri: str) -> str | None:
    """Return the symbol of a QUDT unit, or its name if not listed; None for other IRIs.

    >>> symbol_of("http://qudt.org/vocab/unit/M"), symbol_of("http://qudt.org/vocab/unit/NanoFARAD"), symbol_of("m")
    ('m', 'NanoFARAD', None)
    """
    name = iri.removeprefix(QUDT_UNITS)
    return None if not name or name == iri else _SYMBOLS.get(name, name)


class Annotations:
    """Annotations of one attribute, read on request."""

    def __init__(self, graph: Graph, iri: URIRef, kind: ValueKind, fault: Fault) -> None:
        """Refuse annotations of another kind of values; ``fault`` receives all faults."""
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
        """True if older values are obsolete (rm:latestOnly)."""
        return self._one(RM.latestOnly, (bool,), "true or false, once") or False

    def fields(self, datatype: Node) -> tuple[Field, ...]:
        """Return the grid of a number, twice for a point; empty for other kinds or after a fault."""
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
        """Return the grid of uncertainties: 64 sigmas, or probabilities between 0 and 1."""
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
        """Random walk of a number or point per square root of a second; 0 by default."""
        drift = self._number(RM.drift, "one number of 0 or more")
        if drift is not None and not 0.0 <= drift < math.inf:
            self._wrong(f"rm:drift is {drift}", "one number of 0 or more")
        return drift or 0.0

    @property
    def most_bytes(self) -> int:
        """Maximum length of a text in bytes of UTF-8; 0 for other kinds."""
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
        """Return the single value of an annotation; else record a fault, if needed or wrong."""
        terms = self._graph.objects(self._iri, predicate)
        values = [term.toPython() if isinstance(term, Literal) else term for term in terms]
        if len(values) == 1 and type(values[0]) in types:
            return values[0]
        if values or is_needed:
            self._wrong(f"{self._shown(predicate)} is {' and '.join(map(repr, values)) or 'missing'}", allowed)
        return None

    def _wrong(self, stated: str, allowed: str) -> None:
        self._fault(self._iri, stated, allowed)

    def _shown(self, term: Node) -> str:
        return term.n3(self._graph.namespace_manager)
