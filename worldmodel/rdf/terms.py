"""RDF terms of a world model and their inverse: IRIs, and literals of values.

A bounded cache holds the literals of values and times.
"""

import re
from decimal import Decimal
from typing import Any

from rdflib import XSD, Literal, Namespace, URIRef
from rdflib.term import Node

from worldmodel.facts import Block, Observation
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, Attribute, TBox, ValueKind
from worldmodel.store import Store

RUN = Namespace("https://w3id.org/remoras/run/")
MOST_REMEMBERED = 1 << 16
"""Maximum number of cached literals; the cache is then cleared."""

_INSTANCE = str(RUN) + "instance-"
_FACT = str(RUN) + "fact-"
_FACT_NAME = re.compile(r"(\d+)(?:\.e(\d+))?-(p?)(\d+)-(\d+)", re.ASCII)
_STATUS = str(RUN) + "status-"
_STATUS_NAME = re.compile(r"(\d+)-(\d+)-(\d+)-(\d[\d.e+-]*)", re.ASCII)
_RECEPTION = str(RUN) + "reception-"


def instance_iri(uid: int) -> URIRef:
    """Return the IRI of an instance."""
    return URIRef(f"{_INSTANCE}{uid}")


def attribute_iri(attribute: Attribute) -> URIRef:
    """Return the IRI of an attribute in facts; sit:type replaces rdf:type, which OWL reserves."""
    return SIT.type if attribute.uid == TYPE_UID else URIRef(attribute.iri)


def term_of(tbox: TBox, attribute: Attribute, value: Value) -> Node:
    """Return a stored value: IRI for a uid, else a literal of the attribute's datatype."""
    stored: Any = attribute.quantise(value)
    match attribute.kind:
        case ValueKind.TYPE:
            return URIRef(tbox.classes[stored].iri)
        case ValueKind.LINK:
            return instance_iri(stored)
        case ValueKind.SYMBOL:
            return Literal(attribute.symbols[stored])
        case ValueKind.TEXT:
            return Literal(stored)
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


def block_name(block: Block) -> str:
    """Return the name of a block in IRIs; a status must have one fact."""
    if block.is_status:
        fact = block.facts[0]
        return f"status-{block.origin}-{fact.subject}-{fact.attribute}-{block.time_s!r}"
    epoch = f".e{block.epoch}" if block.epoch else ""
    return (
        f"{block.origin}{epoch}-{block.sequence}" if block.is_item else f"{block.origin}{epoch}-p{-1 - block.sequence}"
    )


def fact_iri(observation: Observation) -> URIRef:
    """Return the IRI of a fact."""
    block = observation.block
    # URIRef(...) would check the characters, which is slow; these are all valid
    if block.sequence >= 0 and not block.epoch:
        return str.__new__(URIRef, f"{_FACT}{block.origin}-{block.sequence}-{observation.position}")
    name = block_name(block)
    return str.__new__(URIRef, f"{RUN}{name}" if block.is_status else f"{_FACT}{name}-{observation.position}")


def reception_iri(receiver: int, block: Block) -> URIRef:
    """Return the IRI of the reception of a block by a vehicle."""
    return str.__new__(URIRef, f"{_RECEPTION}{receiver}-{block_name(block)}")


def instance_uid(iri: Node) -> int | None:
    """Return the uid of an instance IRI; None for another term."""
    return _number_after(_INSTANCE, iri)


def is_fact(iri: Node) -> bool:
    """True if an IRI has the form of a fact IRI."""
    return isinstance(iri, URIRef) and str.startswith(iri, (_FACT, _STATUS))  # rdflib's own startswith takes no tuple


def fact_of(model: Store, iri: Node) -> Observation | None:
    """Return the fact of an IRI, excluded origins included; None if it is not stored."""
    if not isinstance(iri, URIRef):
        return None
    if str.startswith(iri, _STATUS):
        return _status_of(model, iri)
    match = _FACT_NAME.fullmatch(iri, len(_FACT)) if str.startswith(iri, _FACT) else None
    if match is None:
        return None
    sequence, position = int(match[4]), int(match[5])
    block = model.block((int(match[1]), int(match[2] or 0), -1 - sequence if match[3] else sequence))
    return None if block is None or position >= len(block.facts) else Observation(block, position)


def _status_of(model: Store, iri: URIRef) -> Observation | None:
    match = _STATUS_NAME.fullmatch(iri, len(_STATUS))
    if match is None:
        return None
    origin, subject, attribute = int(match[1]), int(match[2]), int(match[3])
    for observation in model.history(subject, attribute):
        if (
            observation.block.is_status
            and observation.block.origin == origin
            and repr(observation.block.time_s) == match[4]
        ):
            return observation
    return None


def _number_after(prefix: str, iri: Node) -> int | None:
    digits = iri[len(prefix) :] if isinstance(iri, URIRef) and str.startswith(iri, prefix) else ""
    return int(digits) if digits.isdecimal() else None


class RdfTerms:
    """Cached terms of one world model."""

    def __init__(self, tbox: TBox) -> None:
        self._tbox = tbox
        self.attributes = tuple(map(attribute_iri, tbox.attributes))
        self.classes = tuple(URIRef(class_.iri) for class_ in tbox.classes)
        self._instances: dict[int, URIRef] = {}
        self._values: dict[tuple[int, Value], Node] = {}
        self._numbers: dict[float, Literal] = {}

    def instance(self, uid: int) -> URIRef:
        """Return the IRI of an instance."""
        iri = self._instances.get(uid)
        if iri is None:
            iri = self._instances[uid] = instance_iri(uid)
        return iri

    def value(self, attribute: int, value: Value) -> Node:
        """Return the term of a stored value."""
        key = (attribute, value)
        term = self._values.get(key)
        if term is None:
            if len(self._values) >= MOST_REMEMBERED:
                self._values.clear()
            term = self._values[key] = term_of(self._tbox, self._tbox.attributes[attribute], value)
        return term

    def number(self, number: float) -> Literal:
        """Return the literal of a time (s), standard deviation or probability."""
        literal = self._numbers.get(number)
        if literal is None:
            if len(self._numbers) >= MOST_REMEMBERED:
                self._numbers.clear()
            literal = self._numbers[number] = Literal(number, datatype=XSD.double)
        return literal
