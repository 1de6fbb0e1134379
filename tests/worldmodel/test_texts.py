"""Text values: storage, RDF output and input, inference, fusion, refusal of invalid texts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from worldmodel import (
    Block,
    FactError,
    Instance,
    PropertyValue,
    Source,
    WorldModel,
    core_ontology_paths,
    merge,
    read_tbox,
)
from worldmodel.facts import FaultCode
from worldmodel.ontology.fields import bytes_of
from worldmodel.rdf.terms import term_of

MOST_BYTES = 24
NOTES = f"""
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
rm:note a owl:DatatypeProperty ; rdfs:label "note"@en ; rdfs:comment "What somebody noted."@en ;
    rdfs:domain rm:Vehicle ; rdfs:range xsd:string ; rm:maxBytes {MOST_BYTES} ; rm:probability 0.05 .
rm:Towed a owl:Class ; rdfs:label "towed"@en ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf (
    rm:Vehicle [ a owl:Restriction ; owl:onProperty rm:note ; owl:hasValue "in tow" ] ) ] .
"""
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["Cc"], exclude_characters="￾￿")).filter(
    lambda text: len(text.encode()) <= MOST_BYTES
)


TBOX = read_tbox(*core_ontology_paths(), Source("notes.ttl", NOTES))


def model_of(owner: int = 0) -> WorldModel:
    auv = TBOX.class_named("AUV").uid
    instances = [Instance(uid, auv, f"AUV0{uid}") for uid in range(3)]
    return WorldModel(TBOX, owner, instances, n_origins=3)


@given(text=TEXTS)
def test_text_is_unchanged_by_recording_encoding_and_merging(text: str) -> None:
    note, model = TBOX.attribute_named("note"), model_of()
    change = model.record([(0, note.uid, text)], now_s=1.0)
    assert model.latest(0, note.uid).value == text
    assert note.decode(note.encode(text)) == text
    assert TBOX.value_of(note, TBOX.text_of(note, text)) == text
    assert str(term_of(TBOX, note, text)) == text
    other = model_of(1)
    assert merge(other, [change.block]).faults == ()
    assert other.latest(0, note.uid).value == text
    assert other.digest() == model.digest()


@given(data=st.binary(max_size=MOST_BYTES + 4))
def test_bytes_decode_to_one_text_or_are_refused(data: bytes) -> None:
    try:
        text = TBOX.attribute_named("note").decode((int.from_bytes(b"\x01" + data, "big"),))
    except ValueError:
        return
    assert bytes_of(text, MOST_BYTES) == data


@pytest.mark.parametrize(
    ("value", "code", "says"),
    [
        ("ä" * 13, FaultCode.VALUE_RANGE, "26 bytes of UTF-8; allowed: at most 24"),
        ("two\nlines", FaultCode.VALUE_RANGE, "control characters; allowed: none"),
        ("\ud800", FaultCode.VALUE_RANGE, "surrogates not allowed"),
        (3.0, FaultCode.VALUE_KIND, "3.0 is not a string"),
    ],
)
def test_invalid_text_is_refused_with_attribute_and_reason(value: object, code: FaultCode, says: str) -> None:
    """Both when recorded and when received."""
    note = TBOX.attribute_named("note").uid
    with pytest.raises(FactError, match=r"note of instance 0"):
        model_of().record([(0, note, value)], now_s=1.0)  # type: ignore[list-item]
    block = Block(0, 0, 1.0, (PropertyValue(0, note, value),))  # type: ignore[arg-type]
    (fault,) = merge(model_of(1), [block]).faults
    assert fault.code is code
    assert says in fault.detail
