"""Definitions: what is compiled of OWL, what follows for the hierarchy alone, and what is refused."""

from pathlib import Path

import pytest
from test_owl import PREFIXES, faults_of

from worldmodel import TBox, core_ontology_paths, read_tbox
from worldmodel.axioms import ValueCondition

GEAR = (
    PREFIXES.replace("bad#", "gear#")
    + """
ex:Gear a owl:Class .
ex:Sounder a owl:Class ; rdfs:subClassOf ex:Gear .
ex:Fanned a owl:Class ; rdfs:subClassOf ex:Sounder .
ex:within a owl:ObjectProperty , owl:TransitiveProperty ; rdfs:domain owl:Thing ; rdfs:range owl:Thing .
ex:holds a owl:ObjectProperty ; rdfs:domain owl:Thing ; rdfs:range owl:Thing ; owl:inverseOf ex:within .
ex:carries a owl:ObjectProperty ; rdfs:domain rm:Vehicle ; rdfs:range ex:Gear ; rdfs:subPropertyOf ex:holds .
ex:meets a owl:ObjectProperty , owl:SymmetricProperty ; rdfs:domain rm:Vehicle ; rdfs:range rm:Vehicle .
ex:Surveyor a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf (
    rm:Vehicle [ a owl:Restriction ; owl:onProperty ex:holds ; owl:someValuesFrom ex:Sounder ] ) ] .
ex:Ready a owl:Class ; owl:equivalentClass [ owl:intersectionOf (
    ex:Surveyor [ a owl:Restriction ; owl:onProperty rm:available ; owl:hasValue true ] ) ] .
ex:Towfish a owl:Class ; rdfs:subClassOf rm:AUV ,
    [ a owl:Restriction ; owl:onProperty ex:carries ; owl:someValuesFrom ex:Fanned ] .
"""
)


@pytest.fixture(scope="module")
def gear(tmp_path_factory: pytest.TempPathFactory) -> TBox:
    path = tmp_path_factory.mktemp("gear") / "gear.ttl"
    path.write_text(GEAR)
    return read_tbox(*core_ontology_paths(), path)


def test_axioms_are_compiled_to_uids(gear: TBox) -> None:
    within, holds, carries, meets = (gear.attribute_named(n).uid for n in ("within", "holds", "carries", "meets"))
    assert (min(within, holds), max(within, holds)) in gear.axioms.inverses
    assert (meets, meets) in gear.axioms.inverses
    assert within in gear.axioms.transitive
    assert gear.rules.transitive >= {within, holds}
    assert (carries, holds) in gear.axioms.sub_attributes
    # carrying says having as a part, and, the other way round, being a part
    assert set(gear.rules.entailed[carries]) == {(carries, False), (holds, False), (within, True)}
    assert ValueCondition(holds, filler=gear.class_named("Sounder").uid) in gear.rules.conditions
    assert ValueCondition(gear.attribute_named("available").uid, value=True) in gear.rules.conditions


def test_superclasses_follow_from_what_is_necessary(gear: TBox) -> None:
    # Each Towfish is a vehicle that carries a Fanned, which is a Sounder, and carrying is having as a part: a Surveyor.
    towfish, surveyor, ready = (gear.class_named(n).uid for n in ("Towfish", "Surveyor", "Ready"))
    assert gear.is_a(towfish, surveyor)
    assert gear.is_a(ready, surveyor)
    assert not gear.is_a(towfish, ready)
    assert not gear.is_a(gear.class_named("AUV").uid, surveyor)


def test_other_axioms_make_another_hash(gear: TBox, tmp_path: Path) -> None:
    path = tmp_path / "gear.ttl"
    path.write_text(
        GEAR.replace("ex:within a owl:ObjectProperty , owl:TransitiveProperty", "ex:within a owl:ObjectProperty")
    )
    assert read_tbox(*core_ontology_paths(), path).hash != gear.hash


SOME = "[ a owl:Restriction ; owl:onProperty rm:playsRole ; owl:someValuesFrom {} ]"
ON = "ex:A a owl:Class ; rdfs:subClassOf [ a owl:Restriction ; owl:onProperty"
BOOLEAN = "a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:boolean"
HAS = "[ a owl:Restriction ; owl:onProperty ex:has ; owl:someValuesFrom {} ]"
LINK = "a owl:ObjectProperty ; rdfs:domain rm:Vehicle ; rdfs:range rm:Vehicle"
CASES = [
    ("ex:A a owl:Class ; owl:equivalentClass rm:AUV .", "ex:A: it is the same class as rm:AUV; allowed: one name"),
    ("ex:A a owl:Class ; owl:equivalentClass ex:None .", "ex:A: its equivalent class ex:None is not declared"),
    (
        f"{ON} rm:playsRole ; owl:hasSelf true ] .",
        "ex:A: its definition says owl:hasSelf, owl:onProperty; allowed",
    ),
    (
        f"{ON} rm:playsRole ; owl:someValuesFrom rm:Role , rm:Mission ] .",
        "ex:A: its definition says owl:onProperty, owl:someValuesFrom; allowed",
    ),
    (
        f"{ON} ex:plays ; owl:someValuesFrom rm:Role ] .",
        "ex:A: its definition is about ex:plays, which is no attribute; allowed: a declared owl:ObjectProperty",
    ),
    (
        f"ex:A a owl:Class ; rdfs:subClassOf {SOME.format('rm:Rol')} .",
        "ex:A: owl:someValuesFrom of playsRole is rm:Rol; allowed: a declared class, of a link; did you mean",
    ),
    (
        f"{ON} rm:available ; owl:hasValue 3 ] .",
        "ex:A: owl:hasValue of available is ",
    ),
    (
        "ex:A a owl:Class ; owl:equivalentClass [ owl:intersectionOf ( rm:AUV ex:None ) ] .",
        "ex:A: its definition names ex:None, which is not declared",
    ),
    ("ex:A a owl:Class ; owl:unionOf ( rm:AUV rm:ASV ) .", "ex:A: owl:unionOf is not compiled; allowed: "),
    ("[ owl:intersectionOf ( rm:AUV ) ] rdfs:subClassOf rm:Vehicle .", "rdfs:subClassOf of a class without a name"),
    (f"ex:p {LINK} . ex:p a owl:ReflexiveProperty .", "ex:p: the type owl:ReflexiveProperty is not compiled"),
    (f"ex:p {LINK} ; owl:propertyChainAxiom ( ex:p ) .", "ex:p: its owl:propertyChainAxiom is (ex:p); allowed: two"),
    (f"ex:p {LINK} ; owl:inverseOf ex:q .", "ex:p: its owl:inverseOf ex:q is no link; allowed: a declared "),
    (f"ex:p {LINK} ; rdfs:subPropertyOf rm:available .", "ex:p: its rdfs:subPropertyOf rm:available is no link"),
    (
        f"ex:p {BOOLEAN} ; rdfs:subPropertyOf rm:available .",
        "ex:p: rdfs:subPropertyOf is not compiled; allowed: rdf:type, rdfs:domain, rdfs:range",
    ),
    (
        f"ex:p {LINK} ; rdfs:subPropertyOf rm:playsRole .",
        "ex:p: it says playsRole of what need not be of the range of playsRole; allowed: ends",
    ),
    (
        f"ex:p {LINK} ; owl:inverseOf rm:playsRole .",
        "ex:p: it says playsRole, the other way round, of what need not be of the range of",
    ),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("text", "expected"), CASES)
def test_what_would_change_answers_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    faults = faults_of(tmp_path, text)
    assert any(expected in fault for fault in faults), faults
    assert all("; allowed: " in fault for fault in faults)


CYCLES = [
    (
        "".join(f"ex:{a} {LINK} ; rdfs:subPropertyOf ex:{b} . " for a, b in ("pq", "qr", "rp")),
        "ex:p: it is below itself (rdfs:subPropertyOf): ex:p, ex:q, ex:r; allowed: a hierarchy",
    ),
    (
        f"ex:has {LINK} . ex:A a owl:Class ; owl:equivalentClass {HAS.format('ex:B')} . "
        f"ex:B a owl:Class ; owl:equivalentClass {HAS.format('ex:A')} .",
        "ex:A: it is defined by itself: ex:A, ex:B; allowed: definitions by other classes",
    ),
]


@pytest.mark.parametrize(("text", "expected"), CYCLES)
def test_a_cycle_is_one_fault(tmp_path: Path, text: str, expected: str) -> None:
    (fault,) = faults_of(tmp_path, text)
    assert expected in fault


def test_classes_that_definitions_make_the_same_are_refused(tmp_path: Path) -> None:
    both = f"owl:equivalentClass [ owl:intersectionOf ( rm:Vehicle {SOME.format('rm:Role')} ) ]"
    faults = faults_of(tmp_path, f"ex:A a owl:Class ; {both} . ex:B a owl:Class ; {both} .")
    assert any("ex:A: the definitions make it the same class as B; allowed: one name for a class" in f for f in faults)


def test_a_class_that_definitions_leave_empty_is_refused(tmp_path: Path) -> None:
    text = f"""ex:Busy a owl:Class ; owl:disjointWith rm:AUV ;
        owl:equivalentClass [ owl:intersectionOf ( rm:Vehicle {SOME.format("rm:Role")} ) ] .
        ex:Scout a owl:Class ; rdfs:subClassOf rm:AUV , {SOME.format("rm:Role")} ."""
    faults = faults_of(tmp_path, text)
    assert any("ex:Scout: it is disjoint with itself" in fault for fault in faults), faults


def test_annotations_are_harmless(tmp_path: Path) -> None:
    path = tmp_path / "words.ttl"
    path.write_text(
        PREFIXES
        + '@prefix skos: <http://www.w3.org/2004/02/skos/core#> .\nex:A a owl:Class ; rdfs:label "a" ; '
        + 'rdfs:seeAlso rm:AUV ; owl:versionInfo "1" ; skos:definition "An a." ; skos:closeMatch rm:AUV .'
    )
    assert read_tbox(*core_ontology_paths(), path).class_named("A")
