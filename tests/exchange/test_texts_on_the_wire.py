"""Texts in packets: as they are, refused where they are none, told by one vehicle and known by all."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.errors import ConfigurationError
from exchange.packets import Fragment
from exchange.policies import POLICIES
from exchange.wire.codec import Codec
from worldmodel import PropertyValue, TBox, core_ontology_paths, read_tbox
from worldmodel.ontology.fields import bytes_of

MOST_BYTES = 24
NOTES = f"""
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
rm:note a owl:DatatypeProperty ; rdfs:label "note"@en ; rdfs:comment "What somebody noted."@en ;
    rdfs:domain rm:Vehicle ; rdfs:range xsd:string ; rm:maxBytes {MOST_BYTES} .
"""


@pytest.fixture(scope="module")
def notes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("notes") / "notes.ttl"
    path.write_text(NOTES, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def tbox(notes: Path) -> TBox:
    return read_tbox(*core_ontology_paths(), notes)


def codec_of(tbox: TBox) -> Codec:
    return Codec(tbox, 8, 4, POLICIES["ack"], 4096, 3600.0)


@given(text=st.text().filter(lambda text: len(text) <= MOST_BYTES))
def test_a_text_arrives_as_it_was_or_is_refused(tbox: TBox, text: str) -> None:
    codec, note = codec_of(tbox), tbox.attribute_named("note").uid
    facts = PropertyValue(1, note, text), PropertyValue(2, note, "")
    fragment = Fragment(1, 0, 3.0, facts)
    try:
        bytes_of(text, MOST_BYTES)
    except ValueError:
        with pytest.raises(ConfigurationError, match="note"):
            codec.encode(1, (0, 0, 0, 0), [fragment])
        return
    assert codec.decode(codec.encode(1, (0, 0, 0, 0), [fragment])).fragments == (fragment,)
