"""A scenario names ontology files: they are read beside the others, and their text stays with the run."""

import json
import re
from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.files import shipped
from missions.runs.knowledge import query
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.scenarios import load

NUMBERS = re.compile(r"-?[0-9.]+")
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


def scenario_in(folder: Path, ontology: str, more: str = "") -> Path:
    """The shipped scenario in a folder of its own, with a line for ontology files."""
    path = folder / "mine.toml"
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    path.write_text(f"{text}\n[worldmodel]\nontology = {ontology}\n{more}", encoding="utf-8")
    return path


def test_its_words_are_known_and_stay_with_the_run(tmp_path: Path) -> None:
    (tmp_path / "mine.ttl").write_text(WORDS, encoding="utf-8")
    settings = [("--set", "scenario.duration_s=30"), ("--set", "communication.needs.inspected=5")]
    path = scenario_in(tmp_path, '["mine.ttl"]')
    finished = run(load(str(path), settings), 1)
    assert finished.setup.tbox.class_named("SurveyAUV").iri == "https://w3id.org/x/mine#SurveyAUV"
    write_results(finished, tmp_path / "out")
    (tmp_path / "mine.ttl").write_text("changed since", encoding="utf-8")  # the run is as it was
    read = Results.read(tmp_path / "out")
    assert query(read, "SELECT ?x { m:SurveyAUV rdfs:subClassOf ?x }", "AUV01") == (("x",), [("rm:AUV",)])
    again = tmp_path / "again.toml"
    again.write_text(json.loads((tmp_path / "out" / "manifest.json").read_text())["scenario"], encoding="utf-8")
    assert load(str(again)).worldmodel.ontology_text == {"mine.ttl": WORDS}
    assert load(str(again)).model_dump_json() == finished.scenario.model_dump_json()
    plain = load("mapping-rendezvous").model_dump(mode="json", exclude_none=True)
    assert "worldmodel" not in plain  # runs without such files keep their ids


def test_its_words_may_be_used_in_the_tables_of_the_scenario(tmp_path: Path) -> None:
    words = """
m:objectiveWatching a owl:ObjectProperty ; rdfs:domain rm:Role ; rdfs:range rm:RallyPoint .
m:turbidity a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:double ;
    rm:minimum 0 ; rm:maximum 10 ; rm:resolution 0.1 .
"""
    tables = """
[[fault]]
vehicle = "AUV01"
kind = "biased"
at_s = 10.0
attribute = "turbidity"
offset = 1.0
"""
    (tmp_path / "mine.ttl").write_text(WORDS + words, encoding="utf-8")
    path = scenario_in(tmp_path, '["mine.ttl"]', tables)
    assert load(str(path)).fault[0].attribute == "turbidity"


def test_names_are_relative_to_the_scenario_and_of_an_option_to_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "mine.ttl").write_text(WORDS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load(str(scenario_in(tmp_path / "files", '["mine.ttl"]'))).worldmodel.ontology_text == {"mine.ttl": WORDS}
    given = [("--set", 'worldmodel.ontology=["files/mine.ttl"]')]
    assert load("mapping-rendezvous", given).worldmodel.ontology_text == {"files/mine.ttl": WORDS}


@pytest.mark.parametrize(
    ("ontology", "content", "more", "says"),
    [
        ('["none.ttl"]', "", "", r'= "none.ttl": there is no file .*none.ttl; allowed: names of Turtle files'),
        ('["mine.ttl"]', "m:A a owl:Class", "", r'= "mine.ttl": is not Turtle: .*; allowed: what Turtle 1.1 allows'),
        ('["mine.ttl"]', WORDS.replace("m:SurveyAUV a", "rm:AUV a"), "", r'= "mine.ttl": rm:AUV: it redefines a term'),
        ('["mine.ttl"]', WORDS.replace("boolean", "date"), "", r'= "mine.ttl": m:inspected: .*; allowed: '),
        ("3", "", "", r"worldmodel.ontology = 3: .*"),
        (
            "[]",
            "",
            'ontology_text = {"x.ttl" = ""}',
            r'ontology_text = "x.ttl": the text of no file; allowed: names in',
        ),
    ],
)
def test_a_fault_is_one_line_with_file_and_key(
    tmp_path: Path, ontology: str, content: str, more: str, says: str
) -> None:
    if content:
        (tmp_path / "mine.ttl").write_text(content, encoding="utf-8")
    path = scenario_in(tmp_path, ontology, more)
    with pytest.raises(ConfigurationError, match=says) as caught:
        load(str(path))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:")


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.ttl").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match=r'"mine.ttl": cannot be read: it is UTF-16; save it as UTF-8'):
        load(str(scenario_in(tmp_path, '["mine.ttl"]')))
