"""Individuals of an ontology: instances with links that all vehicles know from the start, or refused."""

from pathlib import Path

import pytest

import remoras
from missions.errors import ConfigurationError
from remoras.beliefs import Beliefs
from worldmodel import OntologyError, core_ontology_paths, read_tbox

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
my:W1 a my:Wellhead ; my:inField my:north ; owl:differentFrom my:W2 .
my:W2 a my:Wellhead .
[] a owl:AllDifferent ; owl:distinctMembers ( my:W1 my:W2 ) .
"""


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "wells.ttl"
    file.write_text(BEGINNING + text, encoding="utf-8")
    return file


def settings(file: Path) -> dict[str, object]:
    return {"scenario.duration_s": 30.0, "worldmodel.ontology": [str(file)]}


def test_all_know_them_from_the_start_with_what_follows(tmp_path: Path) -> None:
    """W1 is a FieldWell by its link; without the link nobody concludes it."""
    for text, concluded in ((WELLS, ("W1",)), (WELLS.replace("my:inField my:north ;", ""), ())):
        run = remoras.run("mapping-objects", per=0.4, seed=3, set=settings(written(tmp_path, text)))
        run.save(tmp_path / "run", force=True)
        for vehicle in ("ASV00", "AUV02"):
            for of_run in (run, remoras.open(tmp_path / "run")):
                assert isinstance(of_run, remoras.Run)
                beliefs = Beliefs(of_run.known(vehicle, 0.0).model)
                assert beliefs.instances("Wellhead") == ("W1", "W2")
                assert beliefs.instances("FieldWell") == concluded
        told = run.query("SELECT ?w WHERE { ?w a <https://example.org/wells#Wellhead> }", vehicle="AUV01")
        assert sorted(told.w) == ["W1", "W2"]  # once each


def test_their_values_are_known_to_all_until_a_vehicle_says_another_one(tmp_path: Path) -> None:
    leaking = """my:Leaky a owl:Class ; rdfs:subClassOf rm:ObjectOfInterest ; owl:equivalentClass
        [ a owl:Restriction ; owl:onProperty my:leaks ; owl:hasValue true ] .
        my:W1 a my:Wellhead ; my:leaks true . my:W2 a my:Wellhead ; my:leaks false ."""
    run = remoras.run("mapping-objects", per=0.4, seed=3, set=settings(written(tmp_path, leaking)))
    run.save(tmp_path / "run", force=True)
    for vehicle in ("ASV00", "AUV02"):
        for of_run in (run, remoras.open(tmp_path / "run")):
            assert isinstance(of_run, remoras.Run)
            beliefs = Beliefs(of_run.known(vehicle, 0.0).model)
            assert (beliefs.get(("leaks", "W1")), beliefs.get(("leaks", "W2"))) == (True, False)
            assert beliefs.values(("leaks", "W1")) == {True}
            assert beliefs.instances("Leaky") == ("W1",)
    beliefs.record([beliefs.fact("W1", "leaks", False)], 1.0, private=False)
    assert beliefs.get(("leaks", "W1")) is False
    assert beliefs.instances("Leaky") == ()


def test_they_make_other_definitions_on_the_wire(tmp_path: Path) -> None:
    core = core_ontology_paths()
    plain, wells = read_tbox(*core, written(tmp_path, "")), read_tbox(*core, written(tmp_path, WELLS))
    assert not plain.individuals
    assert [individual.name for individual in wells.individuals] == ["W1", "W2", "north"]
    assert plain.hash != wells.hash
    again = read_tbox(*core, written(tmp_path, WELLS + "# the same\n"))
    assert again.individuals == wells.individuals


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "my:W1 a my:Wellhead ; my:leaks 1 .",
            r"my:W1: its leaks is .*1.*; allowed: one literal of xsd:boolean in its range and on its grid",
        ),
        ("my:W1 a my:Wellhead ; my:inField my:east .", r"its inField is my:east; allowed: an individual"),
        ("my:W1 a my:Wellhead ; my:inField my:W1 .", r"its inField my:W1 is a Wellhead; allowed: a Field"),
        ("my:N a my:Field ; my:inField my:N .", r"it is a Field, and inField is of Wellhead; allowed"),
        ("my:W1 a my:Welhead, owl:NamedIndividual .", r"its class my:Welhead is not declared.*'Wellhead'"),
        ("my:W1 a my:Wellhead, my:Field .", r"it is of 2 classes, none below the others; allowed: one declared class"),
        ("my:W1 a owl:NamedIndividual .", r"it is of no class"),
        ("my:W1 a my:Wellhead . my:W2 a my:Wellhead ; owl:sameAs my:W1 .", r"my:W2: owl:sameAs is not compiled"),
        ("my:W3 owl:sameAs my:W4 .", r"my:W3: it is of no class"),
        ("my:W1 a my:Wellhead ; owl:differentFrom my:W9 .", r"differs from my:W9, which is no individual"),
        ("[] a my:Wellhead .", r"an individual without a name"),
        ("my:W1 a my:Wellhead . rm:W1 a my:Wellhead .", r"its name 'W1' is that of .* too"),
    ],
)
def test_what_is_not_compiled_is_refused_in_a_line(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(OntologyError, match=told) as raised:
        read_tbox(*core_ontology_paths(), written(tmp_path, text))
    assert len(raised.value.faults) == 1


def test_names_of_the_fleet_are_not_theirs(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r'worldmodel\.ontology\) = "AUV00": is the name of a vehicle'):
        remoras.load("mapping-objects", set=settings(written(tmp_path, "my:AUV00 a my:Wellhead .")))


def test_the_core_may_be_imported_and_what_nobody_has_may_not(tmp_path: Path) -> None:
    assert read_tbox(*core_ontology_paths(), written(tmp_path, "")).class_named("Wellhead")
    strange = "<https://example.org/wells> owl:imports <https://example.org/other> ."
    with pytest.raises(OntologyError, match=r"imports <https://example\.org/other>"):
        read_tbox(*core_ontology_paths(), written(tmp_path, strange))
