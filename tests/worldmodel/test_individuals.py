"""Individuals of an ontology: instances with links and values known to all vehicles from the start."""

from pathlib import Path

import pytest

import remoras
from missions.errors import ConfigurationError
from remoras.beliefs import Beliefs
from worldmodel import core_ontology_paths, read_tbox

BEGINNING = """
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix my: <https://example.org/wells#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
<https://example.org/wells> a owl:Ontology ; owl:imports <https://w3id.org/remoras/core> .
my:Field a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest .
my:Wellhead a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest .
my:inField a owl:ObjectProperty ; rdfs:domain my:Wellhead ; rdfs:range my:Field .
my:leaks a owl:DatatypeProperty ; rdfs:domain my:Wellhead ; rdfs:range xsd:boolean .
my:FieldWell a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest ; owl:equivalentClass [ a owl:Class ;
    owl:intersectionOf ( my:Wellhead
        [ a owl:Restriction ; owl:onProperty my:inField ; owl:someValuesFrom my:Field ] ) ] .
"""
WELLS = """
my:north a owl:NamedIndividual, my:Field ; rdfs:label "north" .
my:Leaky a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest ; owl:equivalentClass
    [ a owl:Restriction ; owl:onProperty my:leaks ; owl:hasValue true ] .
my:W1 a my:Wellhead ; my:inField my:north ; my:leaks true .
my:W2 a my:Wellhead ; my:leaks false .
"""


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "wells.ttl"
    file.write_text(BEGINNING + text, encoding="utf-8")
    return file


def settings(file: Path) -> dict[str, object]:
    return {"scenario.duration_s": 30.0, "worldmodel.ontology": [str(file)]}


def test_individuals_and_their_conclusions_are_known_from_the_start(tmp_path: Path) -> None:
    """W1 is a FieldWell by its link and Leaky by its value; W2 has another value and no link."""
    run = remoras.run("mapping-objects", per=0.4, seed=3, set=settings(written(tmp_path, WELLS)))
    run.save(tmp_path / "run", force=True)
    for vehicle in ("ASV00", "AUV02"):
        for of_run in (run, remoras.open(tmp_path / "run")):
            beliefs = Beliefs(of_run.known(vehicle, 0.0).model)
            assert beliefs.instances("Wellhead") == ("W1", "W2")
            assert beliefs.instances("FieldWell") == beliefs.instances("Leaky") == ("W1",)
            assert (beliefs.get(("leaks", "W1")), beliefs.get(("leaks", "W2"))) == (True, False)
            assert beliefs.values(("leaks", "W1")) == {True}
    told = run.query("SELECT ?w WHERE { ?w a <https://example.org/wells#Wellhead> }", vehicle="AUV01")
    assert sorted(told.w) == ["W1", "W2"]  # once each
    beliefs.model.record([beliefs.fact("W1", "leaks", False)], 1.0, private=False)
    assert beliefs.get(("leaks", "W1")) is False
    assert beliefs.instances("Leaky") == ()


def test_individuals_change_the_hash_of_the_definitions(tmp_path: Path) -> None:
    core = core_ontology_paths()
    plain, wells = read_tbox(*core, written(tmp_path, "")), read_tbox(*core, written(tmp_path, WELLS))
    assert not plain.individuals
    assert [individual.name for individual in wells.individuals] == ["W1", "W2", "north"]
    assert plain.hash != wells.hash
    again = read_tbox(*core, written(tmp_path, WELLS + "# the same\n"))
    assert again.individuals == wells.individuals


def test_individuals_may_not_take_names_of_the_fleet(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r'worldmodel\.ontology\) = "AUV00": is the name of a vehicle'):
        remoras.load("mapping-objects", set=settings(written(tmp_path, "my:AUV00 a my:Wellhead .")))
