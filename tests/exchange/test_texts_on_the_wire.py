"""Texts in packets: unchanged, refused if invalid, sent by one vehicle and known by all."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.errors import ConfigurationError
from exchange.packets import Fragment
from exchange.policy.policies import POLICIES
from exchange.wire.codec import Codec
from tests.worldmodel.test_texts import MOST_BYTES, TBOX
from worldmodel import PropertyValue
from worldmodel.ontology.fields import bytes_of


@given(text=st.text().filter(lambda text: len(text) <= MOST_BYTES))
def test_a_text_survives_encoding_or_is_refused(text: str) -> None:
    codec, note = Codec(TBOX, 8, 4, POLICIES["ack"], 4096, 3600.0), TBOX.attribute_named("note").uid
    facts = PropertyValue(1, note, text), PropertyValue(2, note, "")
    fragment = Fragment(1, 0, 3.0, facts)
    try:
        bytes_of(text, MOST_BYTES)
    except ValueError:
        with pytest.raises(ConfigurationError, match="note"):
            codec.encode(1, 0, [fragment])
        return
    assert codec.decode(codec.encode(1, 0, [fragment])).packet.fragments == (fragment,)
