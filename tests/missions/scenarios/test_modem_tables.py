"""Modems, sensors and ontologies of users: checked, and stored with the results."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from faulty_missions import SounderSettings
from small_mission import SMALL, faults_of, line_of, pond

from exchange.channel.modems import modems
from missions.document import Document
from missions.errors import ConfigurationError
from missions.files import shipped
from missions.mapping.sensors import SwathSettings
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.communication import ModemTable, modem_named
from missions.scenarios.loading import scenario_from

OWN = """
[modem.quay]
payload_bytes = 48
rate_bps = 300.0
head_s = 0.2
range_m = 1500.0
"""
SCENARIO = shipped()["mapping-rendezvous"].read_text(encoding="utf-8").replace('"nanomodem-v3"', '"quay"')
CURVE = 'modulation = "table"\nper_at_snr = '


def refused(text: str, path: str = "mine.toml") -> str:
    with pytest.raises(ConfigurationError) as error:
        scenario_from(Document.of_text(text, path))
    return str(error.value)


def test_modem_table_sets_timing_and_energy() -> None:
    """48 B at 300 bit/s behind 0.2 s are 1.48 s; a slot has a guard of 1000 m at 1500 m/s on top."""
    setup = resolved(scenario_from(Document.of_text(SCENARIO + OWN + "receive_w = 0.5", "mine.toml")))
    assert setup.modem.packet_s(8 * 48) == pytest.approx(1.48)
    assert setup.schedule.slot_s == pytest.approx(1.48 + 1000.0 / 1500.0)
    data = setup.database["AUV00"]
    assert data.transmit_j_per_bit == pytest.approx(10.0 / 300.0)
    assert data.transmit_j_per_packet == pytest.approx(2.0)
    counted = SCENARIO.replace('modem = "quay"', 'modem = "quay"\ncount_listening = true') + OWN + "receive_w = 0.5"
    listening = resolved(scenario_from(Document.of_text(counted, "mine.toml")))
    assert listening.database["AUV00"].hotel_w - data.hotel_w == pytest.approx(0.5)


@pytest.mark.parametrize("name", sorted(modems()))
@pytest.mark.parametrize("key", ["payload_bytes", "rate_bps", "range_m"])
def test_a_shipped_profile_can_be_written_as_a_table(name: str, key: str) -> None:
    """The very keys of the shipped file, so that one of its profiles can be copied and changed."""
    path = Path(__file__).parents[3] / "exchange/channel/modems.toml"
    profile = tomllib.loads(path.read_text(encoding="utf-8"))[name]
    table = ModemTable.model_validate_json(json.dumps(profile), strict=True)
    assert modem_named(name, {name: table}) == modems()[name]
    del profile[key]
    with pytest.raises(ValueError, match=key):
        ModemTable.model_validate_json(json.dumps(profile), strict=True)


def test_modem_file_gives_the_same_scenario_as_its_table(tmp_path: Path) -> None:
    (tmp_path / "quay.toml").write_text(OWN, encoding="utf-8")
    by_file = SCENARIO.replace('modem = "quay"', 'modem = "quay.toml"')
    beside = scenario_from(Document.of_text(by_file, str(tmp_path / "mine.toml")))
    assert beside == scenario_from(Document.of_text(SCENARIO + OWN, "mine.toml"))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("rate_bps = 300.0\n", "", r"mine\.toml:\d+: modem\.quay\.rate_bps: missing"),
        ("rate_bps", "rate_bs", r"modem\.quay\.rate_bs = 300\.0: unknown key, allowed here: .*did you mean 'rate_bps'"),
        ("= 48", "= 16", r"communication\.policy = \"ack\": its acknowledgements .*take ack or another modem"),
        ("= 48", "= 48\nframe_bytes = 49", r"modem\.quay\.frame_bytes = 49: allowed: up to payload_bytes = 48"),
        ("= 48", '= 48\nequipment = "Sonar"', r"modem\.quay\.equipment = \"Sonar\": allowed: AcousticModem, FSKModem"),
        ("= 48", '= 48\nmodulation = "table"', r"modem\.quay\.per_at_snr: 0 points; modulation = \"table\" needs 2"),
        ("= 48", f"= 48\n{CURVE}[[1.0, 0.5], [0.0, 0.7]]", r"mine\.toml:\d+: .*0 dB comes behind 1 dB; sort its"),
        ('"quay"', '"quai"', r"communication\.modem = \"quai\": allowed: quay, nanomodem-v3, .*did you mean 'quay'"),
        ('"quay"', '"no.toml"', r"communication\.modem = \"no\.toml\": there is no file no\.toml; allowed: a TOML"),
    ],
)  # fmt: skip
def test_invalid_modem_table_is_refused_in_one_line(old: str, new: str, says: str) -> None:
    said = refused((SCENARIO + OWN).replace(old, new, 1))
    matching = [line for line in said.splitlines() if "missing" not in line or "missing" in says]
    assert len(matching) == 1
    assert re.search(says, matching[0]), said


def test_name_of_a_shipped_profile_is_refused() -> None:
    text = (SCENARIO + OWN).replace("quay", "atm-900")
    assert "modem.atm-900: is the name of a shipped profile; give it another" in refused(text)


@pytest.mark.parametrize(("content", "says"), [
    (OWN.replace("rate_bps = 300.0\n", ""), "quay.toml:2: modem.quay.rate_bps: missing"),
    (OWN + "[modem.other]\n", "must hold one table [modem.NAME] and nothing else"),
])  # fmt: skip
def test_fault_in_a_modem_file_has_the_line_of_that_file(tmp_path: Path, content: str, says: str) -> None:
    (tmp_path / "quay.toml").write_text(content, encoding="utf-8")
    said = refused(SCENARIO.replace('"quay"', '"quay.toml"'), str(tmp_path / "mine.toml"))
    assert len(said.splitlines()) == 1
    assert says in said


def test_equal_names_of_a_modem_table_and_a_modem_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "quay.toml").write_text(OWN, encoding="utf-8")
    said = refused(SCENARIO.replace('"quay"', '"quay.toml"') + OWN, str(tmp_path / "mine.toml"))
    assert "quay.toml has one of this name, too; rename one of them" in said


WORDS = """
@prefix m: <https://w3id.org/x/mine#> .
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
<https://w3id.org/x/mine> a owl:Ontology .
m:SurveyAUV a owl:Class ; rdfs:subClassOf rm:AUV .
m:inspected a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:boolean .
"""


def scenario_in(folder: Path, ontology: str) -> Path:
    """Shipped scenario in its own folder, with a line for ontology files."""
    path = folder / "mine.toml"
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    path.write_text(f"{text}\n[worldmodel]\nontology = {ontology}\n", encoding="utf-8")
    return path


def test_terms_of_an_own_ontology_are_stored_with_the_run(tmp_path: Path) -> None:
    (tmp_path / "mine.ttl").write_text(WORDS, encoding="utf-8")
    settings = [("--set", "scenario.duration_s=30"), ("--set", "communication.needs.inspected=5")]
    path = scenario_in(tmp_path, '["mine.ttl"]')
    finished = run(load(str(path), settings), 1)
    assert finished.setup.tbox.class_named("SurveyAUV").iri == "https://w3id.org/x/mine#SurveyAUV"
    write_results(finished, tmp_path / "out")
    (tmp_path / "mine.ttl").write_text("changed since", encoding="utf-8")  # the run is as it was
    read = Results.read(tmp_path / "out")
    assert read.query("SELECT ?x { m:SurveyAUV rdfs:subClassOf ?x }", "AUV01") == (("x",), [("rm:AUV",)])
    again = tmp_path / "again.toml"
    again.write_text(json.loads((tmp_path / "out" / "manifest.json").read_text())["scenario"], encoding="utf-8")
    assert load(str(again)).worldmodel.ontology_text == {"mine.ttl": WORDS}
    assert load(str(again)).model_dump_json() == finished.scenario.model_dump_json()
    plain = load("mapping-rendezvous").model_dump(mode="json", exclude_none=True)
    assert "worldmodel" not in plain  # runs without such files keep their ids


def test_paths_are_relative_to_the_scenario_or_for_options_to_the_cwd(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "mine.ttl").write_text(WORDS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load(str(scenario_in(tmp_path / "files", '["mine.ttl"]'))).worldmodel.ontology_text == {"mine.ttl": WORDS}
    given = [("--set", 'worldmodel.ontology=["files/mine.ttl"]')]
    assert load("mapping-rendezvous", given).worldmodel.ontology_text == {"files/mine.ttl": WORDS}


@pytest.mark.parametrize(("ontology", "content", "says"), [
    ('["none.ttl"]', "", r'= "none.ttl": there is no file .*none.ttl; allowed: names of Turtle files'),
    ('["mine.ttl"]', "m:A a owl:Class", r'= "mine.ttl": is not Turtle: .*; allowed: what Turtle 1.1 allows'),
    ('["mine.ttl"]', WORDS.replace("m:SurveyAUV a", "rm:AUV a"), r'= "mine.ttl": rm:AUV: it redefines a term'),
])  # fmt: skip
def test_fault_of_an_ontology_is_one_line_with_file_and_key(
    tmp_path: Path, ontology: str, content: str, says: str
) -> None:
    if content:
        (tmp_path / "mine.ttl").write_text(content, encoding="utf-8")
    path = scenario_in(tmp_path, ontology)
    with pytest.raises(ConfigurationError, match=says) as caught:
        load(str(path))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:")


LISTED = SMALL.replace("[vehicle.sensor]", "[[vehicle.sensor]]")
SECOND = '\n  [[vehicle.sensor]]\n  name = "deep"\n  type = "faulty_missions:SounderSettings"\n  interval_s = 5.0\n'


def test_single_table_and_list_of_one_give_the_same_sensor(tmp_path: Path) -> None:
    one, listed = pond(tmp_path, SMALL), pond(tmp_path, LISTED)
    assert one == listed
    (sensor,) = resolved(one).database["Diver"].sensors
    assert sensor == SwathSettings(name="mapping", swath_m=10.0, speed_limit_mps=2.0)


def test_sensors_of_one_vehicle_are_found_by_name(tmp_path: Path) -> None:
    data = resolved(pond(tmp_path, LISTED + SECOND)).database["Diver"]
    assert [(type(sensor), sensor.name) for sensor in data.sensors] == [
        (SwathSettings, "mapping"),
        (SounderSettings, "deep"),
    ]
    found = data.sensor(SounderSettings)
    assert found is not None
    assert found.interval_s == 5.0


@pytest.mark.parametrize("text", [SMALL, LISTED], ids=["table", "list"])
@pytest.mark.parametrize(("old", "new", "key", "given", "says"), [
    ("  swath_m = 10.0\n", "", "swath_m", "", "missing"),
    ("swath_m = 10.0", 'type = "maping"\n  swath_m = 10.0', "type", '"maping"', "mean 'mapping'"),
    ("swath_m = 10.0", 'type = "os:getcwd"\n  swath_m = 10.0', "type", '"os:getcwd"', "a subclass of remoras.Sensor"),
    ("swath_m = 10.0", 'type = "faulty_missions:Bare"\n  swath_m = 1', "type", '"faulty_missions:Bare"', "make"),
])  # fmt: skip
def test_fault_in_a_sensor_table_has_its_line(
    tmp_path: Path, text: str, old: str, new: str, key: str, given: str, says: str
) -> None:
    assert old in text
    wrong = text.replace(old, new, 1)
    (found,) = faults_of(tmp_path, wrong)
    assert found.key.startswith("vehicle.Diver.sensor")
    assert found.key.endswith(f".{key}")
    assert found.given == given
    assert says in found.allowed
    where = f"{key} =" if given else "[[vehicle.sensor]]" if text is LISTED else "[vehicle.sensor]"
    assert found.line == line_of(wrong, where)


def test_fault_in_the_second_sensor_table_has_its_line(tmp_path: Path) -> None:
    wrong = LISTED + SECOND.replace("interval_s = 5.0", "interval = 5.0")
    (found,) = faults_of(tmp_path, wrong)
    assert found.key == "vehicle.Diver.sensor.deep.interval"
    assert "did you mean 'interval_s'" in found.allowed
    assert found.line == line_of(wrong, "interval =")
