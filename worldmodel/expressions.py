"""Reading class expressions of OWL. These are compiled, p a link, d any other attribute, C an expression or a class:

    [ owl:intersectionOf ( ... ) ]   [ owl:unionOf ( ... ) ]   [ owl:complementOf C ]   [ owl:oneOf ( individuals ) ]
    [ owl:onProperty p ; owl:someValuesFrom C ]     owl:allValuesFrom C; owl:hasValue an individual
    [ owl:onProperty d ; owl:someValuesFrom D ]     owl:allValuesFrom D; owl:hasValue a literal
    [ owl:onProperty p ; owl:minCardinality n ]     owl:maxCardinality, owl:cardinality: n is 0 or 1; qualified too

D is the datatype of the range of d, a restriction of it by xsd:minInclusive and the like, or owl:oneOf of literals. A
literal has the datatype of the range, and a value that is stored as it is: OWL takes 5 (xsd:integer) for no xsd:double.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Protocol

from rdflib import OWL, RDF, XSD, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from worldmodel.axioms import ValueCondition
from worldmodel.fields import Field, Value
from worldmodel.tbox import Attribute, ValueKind
from worldmodel.unnamed import Expression, ExpressionKind, no, only, some_of

ELSEWHERE = "; a file for reasoners that no scenario reads may say more"
_EXPRESSIONS = (
    "a declared class, owl:intersectionOf, owl:unionOf, owl:complementOf, owl:oneOf (individuals), or a restriction "
    f"with owl:someValuesFrom, owl:allValuesFrom, owl:hasValue or a cardinality of 0 or 1{ELSEWHERE}"
)
_POINT = re.compile(r"POINT \((\S+) (\S+)\)")
_CARDINALITIES = {
    **dict.fromkeys((OWL.minCardinality, OWL.minQualifiedCardinality), (True, False)),
    **dict.fromkeys((OWL.maxCardinality, OWL.maxQualifiedCardinality), (False, True)),
    **dict.fromkeys((OWL.cardinality, OWL.qualifiedCardinality), (True, True)),
}
"""Predicates of restrictions: whether they bound from below, and from above."""
_FACETS = (XSD.minInclusive, XSD.minExclusive, XSD.maxInclusive, XSD.maxExclusive)
_DATATYPES: dict[ValueKind, URIRef] = {
    **dict.fromkeys((ValueKind.SYMBOL, ValueKind.TEXT, ValueKind.POINT), XSD.string),
    ValueKind.BOOLEAN: XSD.boolean,
}


class OntologyReader(Protocol):
    """What reads the rest of the ontology: it shows terms and collects faults."""

    def fault(self, subject: Node, wrong: str, allowed: str) -> None:
        """Note one fault of ``subject``."""

    def shown(self, term: Node) -> str:
        """Return a term as a Turtle file would write it."""

    def hint(self, term: Node, known: Iterable[Node]) -> str:
        """Propose the known term most like an unknown one."""


class Expressions:
    """Reads class expressions out of ``graph``; ``reader`` takes the faults.

    Args:
        graph: the ontology.
        class_uid: of each declared class its uid.
        attributes: those that are declared.
        individuals: of each individual its name and class.
        reader: takes the faults.
    """

    def __init__(
        self,
        graph: Graph,
        class_uid: Mapping[Node, int],
        attributes: Mapping[Node, Attribute],
        individuals: Mapping[Node, tuple[str, int]],
        reader: OntologyReader,
    ) -> None:
        self.graph, self.class_uid, self.attributes = graph, class_uid, attributes
        self.individuals, self.reader = individuals, reader

    def read(self, iri: Node, node: Node) -> Expression | None:
        """Return a class expression; None, and a fault of the class ``iri``, if it is none that is compiled."""
        if node in self.class_uid:
            return Expression(ExpressionKind.CLASS, uid=self.class_uid[node])
        if isinstance(node, URIRef):
            wrong = f"its definition names {self.reader.shown(node)}, which is not declared"
            self.reader.fault(iri, wrong, f"a declared owl:Class{self.reader.hint(node, self.class_uid)}")
            return None
        pairs = [(p, o) for p, o in self.graph.predicate_objects(node) if p != RDF.type]
        says = dict(pairs)
        if len(says) == len(pairs):
            if OWL.onProperty in says:
                return self._restriction(iri, says)
            for predicate, read in (
                (OWL.intersectionOf, self._intersection),
                (OWL.unionOf, self._union),
                (OWL.complementOf, self._complement),
                (OWL.oneOf, self._one_of),
            ):
                if set(says) == {predicate}:
                    return read(iri, says[predicate])
        self._refused(iri, says)
        return None

    def _refused(self, iri: Node, says: Iterable[Node]) -> None:
        predicates = ", ".join(sorted(self.reader.shown(p) for p in says)) or "nothing"
        self.reader.fault(iri, f"its definition says {predicates}", _EXPRESSIONS)

    def _parts(self, iri: Node, listed: Node) -> tuple[Expression, ...] | None:
        parts = [self.read(iri, part) for part in Collection(self.graph, listed)]
        whole = tuple(part for part in parts if part is not None)
        return whole if whole and len(whole) == len(parts) else None

    def _intersection(self, iri: Node, listed: Node) -> Expression | None:
        parts = self._parts(iri, listed)
        return None if parts is None else Expression(ExpressionKind.AND, parts)

    def _union(self, iri: Node, listed: Node) -> Expression | None:
        parts = self._parts(iri, listed)
        if parts is None:
            return None
        return parts[0] if len(parts) == 1 else Expression(ExpressionKind.OR, tuple(sorted(set(parts), key=repr)))

    def _complement(self, iri: Node, node: Node) -> Expression | None:
        of = self.read(iri, node)
        return None if of is None else no(of)

    def _one_of(self, iri: Node, listed: Node) -> Expression | None:
        parts = [self._individual(iri, "owl:oneOf", term) for term in Collection(self.graph, listed)]
        whole = tuple(sorted({part for part in parts if part is not None}, key=repr))
        if not whole or None in parts:
            return None
        return whole[0] if len(whole) == 1 else Expression(ExpressionKind.OR, whole)

    def _individual(self, iri: Node, where: str, term: Node) -> Expression | None:
        if term in self.individuals:
            return Expression(ExpressionKind.INDIVIDUAL, name=self.individuals[term][0])
        wrong = f"{where} names {self.reader.shown(term)}, which is no individual"
        self.reader.fault(iri, wrong, f"individuals of these files{self.reader.hint(term, self.individuals)}")
        return None

    # Restrictions --------------------------------------------------------------------------------

    def _restriction(self, iri: Node, says: Mapping[Node, Node]) -> Expression | None:
        on = says[OWL.onProperty]
        if on not in self.attributes:
            wrong = f"its definition is about {self.reader.shown(on)}, which is no attribute"
            allowed = f"a declared owl:ObjectProperty or owl:DatatypeProperty{self.reader.hint(on, self.attributes)}"
            self.reader.fault(iri, wrong, allowed)
            return None
        attribute = self.attributes[on]
        more = set(says) - {OWL.onProperty}
        if len(more) == 1 and (predicate := next(iter(more))) in (
            OWL.someValuesFrom,
            OWL.allValuesFrom,
            OWL.hasValue,
        ):
            return self._values(iri, attribute, predicate, says[predicate])
        counts = more & _CARDINALITIES.keys()
        if len(counts) == 1 and more - counts <= {OWL.onClass, OWL.onDataRange} and len(more) <= 2:
            predicate = counts.pop()
            return self._cardinality(iri, attribute, predicate, says[predicate], says)
        self._refused(iri, says)
        return None

    def _values(self, iri: Node, attribute: Attribute, predicate: Node, target: Node) -> Expression | None:
        where = f"{self.reader.shown(predicate)} of {attribute.name}"
        if attribute.kind is ValueKind.LINK:
            if predicate == OWL.hasValue:
                individual = self._individual(iri, where, target)
                return None if individual is None else some_of(attribute.uid, individual)
            of = self._filler(iri, where, target)
            if of is None:
                return None
            return some_of(attribute.uid, of) if predicate == OWL.someValuesFrom else self._only(attribute, of)
        if predicate == OWL.hasValue:
            value = stored(attribute, target)
            if value is None:
                allowed = f"a literal in its range that is stored as it is, of its datatype {datatype_of(attribute)}"
                self.reader.fault(iri, f"{where} is {self.reader.shown(target)}", allowed)
                return None
            return Expression(ExpressionKind.VALUES, values=ValueCondition(attribute.uid, value=value))
        values = self._data_range(iri, where, attribute, target)
        if values is None:
            return None
        return (
            Expression(ExpressionKind.VALUES, values=values)
            if predicate == OWL.someValuesFrom
            else _only_values(values)
        )

    def _filler(self, iri: Node, where: str, target: Node) -> Expression | None:
        """Return a class or an expression that a restriction is about."""
        if target in self.class_uid or isinstance(target, BNode):
            return self.read(iri, target)
        wrong = f"{where} is {self.reader.shown(target)}"
        self.reader.fault(iri, wrong, f"a declared class, of a link{self.reader.hint(target, self.class_uid)}")
        return None

    def _only(self, attribute: Attribute, of: Expression) -> Expression:
        if of == self._thing():
            return of
        if of == no(self._thing()):
            return no(some_of(attribute.uid, self._thing()))
        return only(attribute.uid, of)

    def _thing(self) -> Expression:
        return Expression(ExpressionKind.CLASS, uid=self.class_uid[OWL.Thing])

    def _cardinality(
        self, iri: Node, attribute: Attribute, predicate: Node, count: Node, says: Mapping[Node, Node]
    ) -> Expression | None:
        shown, n = self.reader.shown, count.toPython() if isinstance(count, Literal) else None
        where = f"{shown(predicate)} of {attribute.name}"
        is_link = attribute.kind is ValueKind.LINK
        if type(n) is not int or n not in (0, 1):
            self.reader.fault(iri, f"{where} is {shown(count)}", f"0 or 1{ELSEWHERE}")
            return None
        on_class, on_data = says.get(OWL.onClass), says.get(OWL.onDataRange)
        if (on_data if is_link else on_class) is not None:
            self.reader.fault(
                iri, f"{where} is of another kind of values", "owl:onClass of links, owl:onDataRange else"
            )
            return None
        target = on_class if is_link else on_data
        if is_link:
            of = self._thing() if target is None else self._filler(iri, where, target)
            present = None if of is None else some_of(attribute.uid, of)
            absent = None if of is None else self._only(attribute, no(of))
        else:
            of = None
            values = (
                ValueCondition(attribute.uid) if target is None else self._data_range(iri, where, attribute, target)
            )
            present = None if values is None else Expression(ExpressionKind.VALUES, values=values)
            absent = None if present is None else no(present)
        if present is None or absent is None:
            return None
        at_least, at_most = _CARDINALITIES[predicate]  # type: ignore[index]
        if n == 0:
            return absent if at_most else self._thing()
        if at_most and target is not None and (not is_link or of not in self._whole_range(attribute)):
            self.reader.fault(iri, f"{where} counts some of its values alone", "owl:onClass of the range, or none")
            return None
        single = Expression(ExpressionKind.SINGLE, uid=attribute.uid)
        if at_least:
            return Expression(ExpressionKind.AND, (present, single)) if at_most else present
        return single

    def _whole_range(self, attribute: Attribute) -> tuple[Expression, ...]:
        return self._thing(), Expression(ExpressionKind.CLASS, uid=attribute.range_class or 0)

    # Values --------------------------------------------------------------------------------------

    def _data_range(self, iri: Node, where: str, attribute: Attribute, node: Node) -> ValueCondition | None:
        """Return a condition on the values of an attribute that is no link."""
        if node == datatype_of(attribute):
            return ValueCondition(attribute.uid)
        pairs = [(p, o) for p, o in self.graph.predicate_objects(node) if p != RDF.type]
        says = dict(pairs)
        if len(says) == len(pairs) and set(says) == {OWL.oneOf}:
            terms = list(Collection(self.graph, says[OWL.oneOf]))
            values = [stored(attribute, term) for term in terms]
            if values and None not in values:
                return ValueCondition(attribute.uid, among=tuple(sorted(v for v in set(values) if v is not None)))
        elif attribute.kind is ValueKind.NUMBER and says.get(OWL.onDatatype) == datatype_of(attribute):
            bounds = facets_of(self.graph, node, attribute.datatype)
            if bounds is not None:
                low, high = on_grid(attribute.fields[0], bounds)
                return ValueCondition(attribute.uid, low=low, high=high)
        allowed = (
            f"{self.reader.shown(URIRef(datatype_of(attribute)))}, owl:oneOf of such literals that are stored as they "
            f"are, or of a number owl:withRestrictions of {', '.join(map(self.reader.shown, _FACETS))}"
        )
        self.reader.fault(iri, f"{where} is {self.reader.shown(node)}", allowed)
        return None


def _only_values(values: ValueCondition) -> Expression:
    """Return what has no other values than those."""
    return no(Expression(ExpressionKind.VALUES, values=values.negated()))


def datatype_of(attribute: Attribute) -> URIRef:
    """Return the datatype of the literals of an attribute that is no link."""
    return _DATATYPES.get(attribute.kind) or URIRef(attribute.datatype)


def facets_of(graph: Graph, node: Node, datatype: str) -> dict[Node, float] | None:
    """Return the facets of a restricted datatype of numbers, by IRI; None if there are any others."""
    bounds: dict[Node, float] = {}
    listed = graph.value(node, OWL.withRestrictions)
    for facet in [] if listed is None else Collection(graph, listed):
        for predicate, literal in graph.predicate_objects(facet):
            if predicate not in _FACETS or predicate in bounds or not _is_of(literal, datatype):
                return None
            bounds[predicate] = float(literal.toPython())  # type: ignore[attr-defined]
    return bounds or None


def on_grid(field: Field, bounds: Mapping[Node, float]) -> tuple[float, float]:
    """Return the least and the greatest value of a grid within bounds; the greatest is below if there is none."""
    low = max(bounds.get(XSD.minInclusive, -math.inf), bounds.get(XSD.minExclusive, -math.inf))
    high = min(bounds.get(XSD.maxInclusive, math.inf), bounds.get(XSD.maxExclusive, math.inf))
    first, last = 0, field.n_values - 1
    minimum, step = Fraction(repr(float(field.minimum))), Fraction(repr(float(field.resolution)))
    if low > field.minimum or bounds.get(XSD.minExclusive) == low:
        steps = (Fraction(repr(low)) - minimum) / step
        first = max(0, math.floor(steps) + 1 if bounds.get(XSD.minExclusive) == low else math.ceil(steps))
    if high < field.maximum or bounds.get(XSD.maxExclusive) == high:
        steps = (Fraction(repr(high)) - minimum) / step
        last = min(last, math.ceil(steps) - 1 if bounds.get(XSD.maxExclusive) == high else math.floor(steps))
    if first > last:
        return field.maximum + field.resolution, field.minimum - field.resolution
    return field.decode(first), field.decode(last)


def _is_of(term: Node, datatype: str) -> bool:
    """True if a term is a literal with a value of that datatype."""
    if not isinstance(term, Literal) or term.language is not None or term.value is None:
        return False
    own, asked = term.datatype or XSD.string, URIRef(datatype)
    if {own, asked} == {XSD.integer, XSD.decimal}:
        return own == XSD.integer or Decimal(term.value) % 1 == 0
    return own == asked


def stored(attribute: Attribute, term: Node) -> Value | None:
    """Return the value that a literal stands for, if it is of the datatype of the attribute and stored as it is."""
    if not _is_of(term, datatype_of(attribute)) or not isinstance(term, Literal):
        return None
    value = term.toPython()
    try:
        if attribute.kind is ValueKind.SYMBOL:
            return attribute.symbols.index(value)
        if attribute.kind is ValueKind.BOOLEAN:
            return bool(value)
        if attribute.kind is ValueKind.TEXT:
            return attribute.quantise(str(value))
        if attribute.kind is ValueKind.POINT:
            found = _POINT.fullmatch(str(value))
            point = None if found is None else (float(found[1]), float(found[2]))
            return point if point is not None and attribute.quantise(point) == point else None
        number = float(value)
        return number if attribute.quantise(number) == number else None
    except (TypeError, ValueError):
        return None
