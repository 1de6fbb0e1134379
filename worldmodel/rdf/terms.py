"""RDF terms of a world model: IRIs, and literals of values."""

from decimal import Decimal
from typing import Any

from rdflib import XSD, Literal, Namespace, URIRef
from rdflib.term import Node

from worldmodel.facts import Block, Observation
from worldmodel.ontology.compiler import SIT
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import TYPE_UID, Attribute, TBox, ValueKind

RUN = Namespace("https://w3id.org/remoras/run/")
_INSTANCE = str(RUN) + "instance-"
_FACT = str(RUN) + "fact-"


def instance_iri(uid: int) -> URIRef:
    """Return the IRI of an instance."""
    return URIRef(f"{_INSTANCE}{uid}")


def attribute_iri(attribute: Attribute) -> URIRef:
    """Return the IRI of an attribute in facts; sit:type replaces rdf:type, which OWL reserves."""
    return SIT.type if attribute.uid == TYPE_UID else URIRef(attribute.iri)


def term_of(tbox: TBox, attribute: Attribute, value: Value) -> Node:
    """Return a stored value: IRI for a uid, else a literal of the attribute's datatype."""
    stored: Any = value
    match attribute.kind:
        case ValueKind.TYPE:
            return URIRef(tbox.classes[stored].iri)
        case ValueKind.LINK:
            return instance_iri(stored)
        case ValueKind.NUMBER:
            return _number_literal(stored, attribute.datatype)
        case ValueKind.BOOLEAN:
            return Literal(stored)
    return Literal(attribute.text_of(stored))


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


def instance_uid(iri: Node) -> int | None:
    """Return the uid of an instance IRI; None for another term."""
    digits = iri[len(_INSTANCE) :] if isinstance(iri, URIRef) and str.startswith(iri, _INSTANCE) else ""
    return int(digits) if digits.isdecimal() else None
