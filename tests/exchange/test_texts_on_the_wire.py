"""Texts in packets: as they are, refused where they are none, told by one vehicle and known by all."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.errors import ConfigurationError
from exchange.packets import Fragment
from exchange.policies import POLICIES
from exchange.wire.codec import Codec
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras import Observation, SensorSettings
from worldmodel import PropertyValue, TBox, core_ontology_paths, read_tbox
from worldmodel.texts import bytes_of

MOST_BYTES = 24
NOTES = f"""
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
rm:note a owl:DatatypeProperty ; rdfs:label "note"@en ; rdfs:comment "What somebody noted."@en ;
    rdfs:domain rm:Vehicle ; rdfs:range xsd:string ; rm:maxBytes {MOST_BYTES} .
"""
SAID = "Rümpfe & <wrecks>, 10 m"


class NoteSettings(SensorSettings):
    """A crew that looks out, and notes what it has seen."""

    def make(self, data):
        return Crew(data.name)


class Crew:
    table = None

    def __init__(self, vehicle: str) -> None:
        self._vehicle, self._has_said = vehicle, False

    def sense(self, pose, world, now_s):
        if self._has_said:
            return []
        self._has_said = True
        return [Observation(facts=((self._vehicle, "note", SAID),))]


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


def settings_of(notes: Path, *more: str) -> list[tuple[str, str]]:
    sensors = '[{swath_m=25.0, speed_limit_mps=2.0}, {type="test_texts_on_the_wire:NoteSettings"}]'
    given = (f'worldmodel.ontology=["{notes}"]', "communication.needs.note=5", f"vehicle.AUV01.sensor={sensors}")
    return [("--set", one) for one in (*given, "scenario.duration_s=400", "channel.per=0.4", *more)]


def test_what_one_vehicle_notes_all_come_to_know(notes: Path) -> None:
    fleet = assemble(resolved(load("mapping-rendezvous", settings_of(notes))), seed=2)
    fleet.run()
    models = [vehicle.beliefs.model for vehicle in fleet.vehicles]
    note = models[0].tbox.attribute_named("note").uid
    (noted,) = [uid for uid in models[0].instance_uids() if models[0].history(uid, note)]
    assert [model.latest(noted, note).value for model in models] == [SAID] * 4
