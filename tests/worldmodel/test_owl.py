"""Bad TBox files: every fault is named, with its file, its subject and what is allowed, all in one error."""

from pathlib import Path

import pytest
from rdflib import OWL, RDF

from worldmodel import OntologyError, core_ontology_paths, read_tbox
from worldmodel.owl import graph_of

PREFIXES = """
@prefix ex: <https://example.org/bad#> .
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix unit: <http://qudt.org/vocab/unit/> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
"""
ATTRIBUTE = "a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ;"
BOUNDS = "rm:minimum 0 ; rm:maximum 1 ; rm:resolution 0.1"

CASES = [
    (
        "ex:A a owl:Class ; rdfs:subClassOf rm:Vehicel .",
        "ex:A: its superclass rm:Vehicel is not declared; allowed: a declared owl:Class; did you mean 'Vehicle'?",
    ),
    (
        "ex:A a owl:Class ; rdfs:subClassOf ex:B . ex:B a owl:Class ; rdfs:subClassOf ex:A .",
        "ex:B: it is, or descends from, a superclass of itself",
    ),
    ("ex:A a owl:Class ; rdfs:subClassOf rm:AUV , rm:ASV .", "ex:A: it is disjoint with itself"),
    ("ex:A a owl:Class ; owl:disjointWith ex:B .", "the disjoint class ex:B is not declared"),
    (
        "ex:Vehicle a owl:Class .",
        "bad.ttl: ex:Vehicle: its name 'Vehicle' is that of <https://w3id.org/remoras/marine#Vehicle> in ",
    ),
    ("ex:Thing a owl:Class .", "ex:Thing: its name 'Thing' is that of"),
    ("<https://example.org/bad#9-lives> a owl:Class .", "its name '9-lives' is not an identifier"),
    (
        "ex:type a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:boolean .",
        "ex:type: its name 'type' is that of",
    ),
    (
        "ex:p a owl:DatatypeProperty ; rdfs:range xsd:boolean .",
        "ex:p: 0 rdfs:domain; allowed: one declared class",
    ),
    (
        "ex:p a owl:DatatypeProperty ; rdfs:domain ex:Boat ; rdfs:range xsd:boolean .",
        "ex:p: its domain ex:Boat is not declared",
    ),
    (f"ex:p {ATTRIBUTE} rm:latestOnly true .", "ex:p: 0 rdfs:range; allowed: xsd:double"),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:anyURI .",
        "ex:p: its range xsd:anyURI cannot be stored",
    ),
    (f"ex:p {ATTRIBUTE} rdfs:range xsd:double .", "ex:p: rm:minimum is missing; allowed: one number"),
    (f"ex:p {ATTRIBUTE} rdfs:range xsd:double ; {BOUNDS} , 0.2 .", "ex:p: rm:resolution is "),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:double ; {BOUNDS} ; rm:unit unit:M , unit:SEC .",
        "ex:p: rm:unit is unit:M and unit:SEC; allowed: none, or one unit of QUDT such as "
        "<http://qudt.org/vocab/unit/M>",
    ),
    (f'ex:p {ATTRIBUTE} rdfs:range xsd:double ; {BOUNDS} ; rm:unit "m" .', 'ex:p: rm:unit is "m"; allowed: none, or'),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:integer ; {BOUNDS} .",
        "ex:p: its bounds and resolution are [0.0, 1.0, 0.1]; allowed: whole numbers for xsd:integer",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:double ; rm:minimum 0 ; rm:maximum 1 ; rm:resolution 0.3 .",
        "ex:p: maximum 1.0 must be a whole number of resolutions 0.3 above minimum 0.0",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:double ; rm:minimum true ; rm:maximum 2 ; rm:resolution 1 .",
        "ex:p: rm:minimum is True; allowed: one number",
    ),
    (f"ex:p {ATTRIBUTE} rdfs:range xsd:boolean ; {BOUNDS} .", "ex:p: rm:minimum on a boolean"),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:double ; {BOUNDS} ; rm:drift -1 .",
        "ex:p: rm:drift is -1; allowed: one number of 0 or more",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:boolean ; rm:drift 1 .",
        "ex:p: rm:drift on a boolean; allowed: bounds of numbers",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:double ; {BOUNDS} ; rm:drift -1 .",
        "ex:p: rm:drift is -1; allowed: one number of 0 or more",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:boolean ; rm:drift 1 .",
        "ex:p: rm:drift on a boolean; allowed: bounds of numbers",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:boolean ; rm:latestOnly 1 .",
        "ex:p: rm:latestOnly is 1; allowed: true or false",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range xsd:boolean ; rm:latestonly true .",
        "ex:p: unknown annotation rm:latestonly; allowed: rm:drift, rm:latestOnly, rm:maxBytes, "
        "rm:maximum, rm:minimum, rm:probability, rm:resolution, rm:sigma, rm:unit; did you mean 'latestOnly'?",
    ),
    (
        f"ex:p {ATTRIBUTE} rdfs:range rm:Role .",
        "ex:p: its range makes it a link; allowed: owl:ObjectProperty",
    ),
    (f'ex:p {ATTRIBUTE} rdfs:range [ owl:oneOf ( "a" "a" ) ] .', "ex:p: its symbols are"),
    (f"ex:p {ATTRIBUTE} rdfs:range xsd:string .", "ex:p: rm:maxBytes is missing; allowed: one whole number for a text"),
    (f"ex:p {ATTRIBUTE} rdfs:range xsd:string ; rm:maxBytes 256 .", "ex:p: rm:maxBytes is 256; allowed: one whole"),
    (f"ex:p {ATTRIBUTE} rdfs:range xsd:boolean ; rm:maxBytes 8 .", "ex:p: rm:maxBytes on a boolean; allowed: texts"),
    ("ex:p rm:minimum 0 .", "ex:p: rm:minimum on what is not a declared property"),
]


def faults_of(tmp_path: Path, text: str) -> tuple[str, ...]:
    path = tmp_path / "bad.ttl"
    path.write_text(PREFIXES + text)
    with pytest.raises(OntologyError) as caught:
        read_tbox(*core_ontology_paths(), path)
    return caught.value.faults


@pytest.mark.parametrize(("text", "expected"), CASES)
def test_each_fault(tmp_path: Path, text: str, expected: str) -> None:
    faults = faults_of(tmp_path, text)
    assert any(expected in fault for fault in faults), faults
    assert all("; allowed: " in fault for fault in faults)


def test_all_faults_at_once(tmp_path: Path) -> None:
    text = """
    ex:A a owl:Class ; rdfs:subClassOf ex:None .
    ex:p a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:string .
    ex:q a owl:DatatypeProperty ; rdfs:domain ex:None ; rdfs:range xsd:integer ; rm:minimum 0 ; rm:step 2 .
    """
    faults = faults_of(tmp_path, text)
    # A: superclass. p: range. q: domain, maximum, resolution, annotation.
    assert [fault.split(": ")[1] for fault in faults] == ["ex:A", "ex:p", *["ex:q"] * 4]
    assert all(fault.startswith(str(tmp_path / "bad.ttl")) for fault in faults)


def test_files_that_are_not_turtle(tmp_path: Path) -> None:
    faults = faults_of(tmp_path, "ex:A a owl:Class ;;; nonsense")
    assert len(faults) == 1
    # an empty line and six prefixes stand before
    why = "expected '.' or '}' or ']' at end of statement"
    expected = f'bad.ttl: is not Turtle: line 8: {why}, at "nonsense"; allowed: '
    assert expected in faults[0]


REDEFINITIONS = {
    "rm:Role": "rm:Role a owl:Class .",
    "rm:AUV": "rm:AUV rdfs:subClassOf rm:Role .",
    "rm:Sensor": "rm:Sensor owl:disjointWith ex:Kite . ex:Kite a owl:Class .",
    "rm:position": "rm:position rm:resolution 0.1 .",
    "rm:bid": f"rm:bid a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:double ; {BOUNDS} .",
    "rm:Point": "rm:Point a owl:Class .",
}


@pytest.mark.parametrize(("term", "text"), REDEFINITIONS.items())
@pytest.mark.parametrize("core_first", [True, False])
def test_a_file_that_redefines_a_term_of_another_is_refused(
    tmp_path: Path, term: str, text: str, core_first: bool
) -> None:
    path = tmp_path / "buoys.ttl"
    path.write_text(PREFIXES + text)
    marine = core_ontology_paths()[1]
    paths = [*core_ontology_paths(), path]
    with pytest.raises(OntologyError) as caught:
        read_tbox(*(paths if core_first else reversed(paths)))
    (fault,) = caught.value.faults
    first, second = (marine, path) if core_first else (path, marine)
    assert fault.startswith(f"{second}: {term}: it redefines a term of {first}; allowed: one file that defines a term")
    assert "add a class below it (rdfs:subClassOf)" in fault


def test_a_file_that_makes_classes_of_another_disjoint_is_refused(tmp_path: Path) -> None:
    (fault,) = faults_of(tmp_path, "[] a owl:AllDisjointClasses ; owl:members ( rm:AUV rm:Sensor ) .")
    assert f"bad.ttl: rm:AUV, rm:Sensor: it makes classes of {core_ontology_paths()[1]} disjoint" in fault


@pytest.mark.slow
def test_a_vocabulary_adds_classes_attributes_and_individuals(tmp_path: Path) -> None:
    path = tmp_path / "buoys.ttl"
    path.write_text(
        PREFIXES
        + f"""
        ex:Kite a owl:Class ; rdfs:subClassOf rm:Vehicle ; owl:disjointWith rm:AUV .
        [] a owl:AllDisjointClasses ; owl:members ( ex:Kite rm:ASV rm:AUV ) .
        ex:charge {ATTRIBUTE} rdfs:range xsd:double ; {BOUNDS} .
        ex:north a ex:Kite ; rm:playsRole ex:Marker .
        ex:Marker a rm:Role .
        rm:Role rdfs:label "papel"@es .
        """
    )
    tbox = read_tbox(*core_ontology_paths(), path)
    core = read_tbox(*core_ontology_paths())
    assert {c.name for c in tbox.classes} - {c.name for c in core.classes} == {"Kite"}
    assert {a.name for a in tbox.attributes} - {a.name for a in core.attributes} == {"charge"}
    assert [individual.name for individual in tbox.individuals] == ["Marker", "north"]
    assert tbox.are_disjoint(tbox.class_named("Kite").uid, tbox.class_named("ASV").uid)
    assert read_tbox(path, *core_ontology_paths(), path) == tbox  # whatever the order; twice is once
    assert [c.iri for c in tbox.classes] == sorted(c.iri for c in tbox.classes)
    assert [a.iri for a in tbox.attributes[1:]] == sorted(a.iri for a in tbox.attributes[1:])


def test_other_axioms_stay_in_the_graph(tmp_path: Path) -> None:
    path = tmp_path / "rich.ttl"
    path.write_text(
        PREFIXES
        + "ex:Towed a owl:Class ; rdfs:subClassOf rm:AUV , "
        + "[ a owl:Restriction ; owl:onProperty rm:playsRole ; owl:someValuesFrom rm:Role ] ."
    )
    tbox = read_tbox(*core_ontology_paths(), path)
    assert tbox.class_named("Towed").parents == (tbox.class_named("AUV").uid,)
    assert (None, RDF.type, OWL.Restriction) in graph_of(tbox)


def test_an_import_that_is_none_of_the_files_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "importing.ttl"
    header = "<https://example.org/own> a owl:Ontology ; owl:imports <https://w3id.org/remoras/{}> ."
    path.write_text(PREFIXES + header.format("seabedd"))
    with pytest.raises(OntologyError) as caught:
        read_tbox(*core_ontology_paths(), path)
    (fault,) = caught.value.faults
    assert fault.startswith(f"{path}: it imports <https://w3id.org/remoras/seabedd>, which is none of the files that")
    assert "; allowed: https://example.org/own, https://w3id.org/remoras/equipment, " in fault
    assert "did you mean 'https://w3id.org/remoras/seabed'" in fault
    for known in ("seabed", "0.1.0/seabed"):
        path.write_text(PREFIXES + header.format(known))
        assert (None, OWL.imports, None) not in graph_of(read_tbox(*core_ontology_paths(), path))
