"""The shipped ontology itself: its terms are defined and aligned, and its other forms say the same."""

import re
import runpy
import sys
from itertools import chain
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rdflib import OWL, RDF, RDFS, Graph, Literal, URIRef
from rdflib.compare import isomorphic
from rdflib.namespace import DCTERMS, SKOS
from rdflib.term import Node

import remoras
from exchange.acoustics import modems
from worldmodel import OntologyError, ValueKind, core_ontology_paths, rdfxml, read_tbox
from worldmodel.annotations import RM
from worldmodel.owl import ONTOLOGY_FOLDER
from worldmodel.rdfxml import CATALOGUE, main, rdf_xml, write_rdfxml
from worldmodel.turtle import SIT
from worldmodel.units import QUDT_UNITS, symbol_of

MISSIONS = Path(__file__).parents[2] / "missions"
FILES = sorted(chain(ONTOLOGY_FOLDER.glob("*.ttl"), MISSIONS.rglob("*.ttl")))
GRAPHS = {path: Graph().parse(path) for path in FILES}
CORE = read_tbox(*core_ontology_paths())
ALIGNMENTS = GRAPHS[ONTOLOGY_FOLDER / "alignments.ttl"]
OURS = "https://w3id.org/remoras/"
EVERYTHING = Graph()
for _graph in GRAPHS.values():
    EVERYTHING += _graph


def own_terms() -> set[Node]:
    """Everything of ours that any shipped file says something of."""
    return {term for term in EVERYTHING.subjects() if isinstance(term, URIRef) and term.startswith(OURS)}


def unexplained(term: Node) -> str:
    """What a term lacks of one English label and one English definition that says more; empty if nothing."""
    for property_ in (RDFS.label, RDFS.comment):
        texts = list(EVERYTHING.objects(term, property_))
        if len(texts) != 1 or not isinstance(texts[0], Literal) or texts[0].language != "en":
            return f"{term}: {property_} is {texts}"
    label, comment = (str(EVERYTHING.value(term, property_)) for property_ in (RDFS.label, RDFS.comment))
    return f"{term}: {comment!r} says nothing" if len(comment) < 15 or comment == label else ""


def test_every_term_has_one_label_and_one_definition() -> None:
    found = [text for term in sorted(own_terms()) if (text := unexplained(term))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_file_has_a_version_and_the_licence_of_the_program(path: Path) -> None:
    (ontology,) = GRAPHS[path].subjects(RDF.type, OWL.Ontology)
    name = str(ontology).removeprefix(OURS)
    assert GRAPHS[path].value(ontology, OWL.versionIRI) == URIRef(f"{OURS}{remoras.__version__}/{name}")
    licence = str(GRAPHS[path].value(ontology, DCTERMS.license))
    assert licence.removeprefix("https://www.apache.org/licenses/") == "LICENSE-2.0"
    text = (MISSIONS.parent / "LICENSE").read_text(encoding="utf-8")
    assert re.search(r"Apache License\s+Version 2\.0", text)


def test_core_opens_all_that_vehicles_read() -> None:
    read = {next(GRAPHS[path].subjects(RDF.type, OWL.Ontology)) for path in core_ontology_paths()}
    reached: set[Node] = set()
    front: list[Node] = [URIRef(f"{OURS}core")]
    while front:
        new = set(EVERYTHING.objects(front.pop(), OWL.imports)) - reached
        reached |= new
        front += new
    assert reached == read


def test_terms_are_of_the_kinds_of_owl_2_dl() -> None:
    kinds = (OWL.Class, OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty, RDFS.Datatype)
    declared = {kind: set(EVERYTHING.subjects(RDF.type, kind)) for kind in kinds}
    assert not list(EVERYTHING.subjects(RDF.type, RDF.Property))
    properties = declared[OWL.ObjectProperty], declared[OWL.DatatypeProperty], declared[OWL.AnnotationProperty]
    for one in properties:
        assert not any(one & other for other in properties if other is not one)
    assert not declared[OWL.Class] & declared[RDFS.Datatype]
    built_in = (str(OWL), str(RDF), str(RDFS), "http://www.w3.org/2001/XMLSchema#")
    used = {p for p in EVERYTHING.predicates() if not str(p).startswith(built_in)}
    assert used <= set().union(*properties)
    individuals = set(EVERYTHING.subjects(RDF.type, OWL.NamedIndividual))
    assert not individuals & set().union(*declared.values())


def test_numbers_have_units_of_qudt_or_none() -> None:
    units = set(EVERYTHING.objects(None, RM.unit))
    assert URIRef(f"{QUDT_UNITS}M") in units
    for unit in units:
        symbol = symbol_of(str(unit))
        assert symbol is not None
        assert symbol != str(unit).removeprefix(QUDT_UNITS), f"{unit} has no symbol of its own"
    assert CORE.attribute_named("ratedSpeed").fields[0].unit == "m/s"
    assert CORE.attribute_named("bid").fields[0].unit == ""
    assert {f.unit for a in CORE.attributes if a.kind is ValueKind.POINT for f in a.fields} == {"m"}


def test_every_class_is_aligned_or_below_one_that_is() -> None:
    for c in core_classes():
        above = {c, *EVERYTHING.transitive_objects(c, RDFS.subClassOf)}
        ours = [one for one in above if isinstance(one, URIRef) and one.startswith(OURS)]
        targets = [
            target
            for one in ours
            for how in (RDFS.subClassOf, SKOS.closeMatch, SKOS.note)
            for target in ALIGNMENTS.objects(one, how)
        ]
        assert targets, c
        assert not any(str(target).startswith(OURS) for target in targets)


def core_classes() -> list[Node]:
    return [
        c for path in core_ontology_paths() for c in GRAPHS[path].subjects(RDF.type, OWL.Class) if isinstance(c, URIRef)
    ]


def test_alignments_are_about_our_terms_and_do_not_clash() -> None:
    ours = {term for path, graph in GRAPHS.items() for term in graph.subjects() if path.stem != "alignments"}
    declared = set(ALIGNMENTS.subjects(RDF.type, None))
    for subject in ALIGNMENTS.subjects(unique=True):
        assert subject in ours or subject in declared, subject
    for target in ALIGNMENTS.objects(None, RDFS.subClassOf):
        assert (target, RDF.type, OWL.Class) in ALIGNMENTS, target
    # PROV-O: Entity and Activity are disjoint; Agent is disjoint with neither
    prov = "http://www.w3.org/ns/prov#"
    for c in core_classes():
        above = set(EVERYTHING.transitive_objects(c, RDFS.subClassOf))
        assert not above >= {URIRef(f"{prov}Entity"), URIRef(f"{prov}Activity")}, c
    namespaces = {re.split(r"[^/#]*$", str(o))[0] for o in ALIGNMENTS.objects() if isinstance(o, URIRef)}
    for asked in ("ns/sosa/", "ns/ssn/", "2006/time#", "schema/qudt/", "ns/prov#", "geosparql#", "cora-bare#"):
        assert any(namespace.endswith(asked) for namespace in namespaces), asked


WITH_WORDS = sorted({path.parent for path in FILES} - {ONTOLOGY_FOLDER})
"""Folders of missions that have a vocabulary."""


@pytest.mark.parametrize("folder", [ONTOLOGY_FOLDER, *WITH_WORDS], ids=lambda path: path.name)
def test_rdf_xml_and_catalogue_are_those_of_the_turtle(folder: Path, tmp_path: Path) -> None:
    sources = [path for path in FILES if path.parent == folder]
    for path in sources:
        (ontology,) = GRAPHS[path].subjects(RDF.type, OWL.Ontology)
        shipped = folder / f"{str(ontology).rsplit('/', 1)[-1]}.rdf"
        assert shipped.read_text(encoding="utf-8") == rdf_xml(Graph().parse(path)), REMEDY
        assert isomorphic(Graph().parse(shipped, format="xml"), GRAPHS[path])
    assert len(list(folder.glob("*.rdf"))) == len(sources)
    catalogue = ElementTree.parse(folder / CATALOGUE).getroot()
    entries = {each.get("name"): folder / str(each.get("uri")) for each in catalogue if each.tag.endswith("uri")}
    for path in sources:
        (ontology,) = GRAPHS[path].subjects(RDF.type, OWL.Ontology)
        assert entries[str(ontology)] == entries[str(GRAPHS[path].value(ontology, OWL.versionIRI))] == path, REMEDY
    following = [each.get("catalog") for each in catalogue if each.tag.endswith("nextCatalog")]
    core = ONTOLOGY_FOLDER / CATALOGUE
    assert [(folder / str(each)).resolve() for each in following] == ([] if folder == ONTOLOGY_FOLDER else [core])


REMEDY = "run python -m worldmodel.rdfxml worldmodel/ontology and the folders in missions that have a vocabulary"


def test_a_users_own_ontology_is_written_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "own.ttl").write_text((MISSIONS / "mapping" / "finds.ttl").read_text())
    assert main([str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [CATALOGUE, "finds.rdf", "own.ttl"]
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / "finds.rdf"), str(tmp_path / CATALOGUE)]
    (tmp_path / "bad.ttl").write_text("no Turtle")
    assert main([str(tmp_path)]) == 2
    assert re.search(r"bad\.ttl: cannot be written as RDF/XML: .*; allowed: Turtle with one", capsys.readouterr().err)


def test_every_folder_that_a_command_names_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = [tmp_path / name for name in ("first", "second")]
    for folder in folders:
        folder.mkdir()
        (folder / "own.ttl").write_text((MISSIONS / "mapping" / "finds.ttl").read_text())
    monkeypatch.setattr(sys, "argv", ["rdfxml", *map(str, folders)])
    with pytest.raises(SystemExit, match="0"):
        runpy.run_path(rdfxml.__file__, run_name="__main__")
    assert all((folder / CATALOGUE).exists() for folder in folders)


def test_a_node_that_is_used_twice_has_no_place_in_rdf_xml(tmp_path: Path) -> None:
    (tmp_path / "twice.ttl").write_text("<x:a> a <http://www.w3.org/2002/07/owl#Ontology> ; <x:/b> _:c ; <x:/d> _:c .")
    with pytest.raises(OntologyError, match="a node without a name is used twice"):
        write_rdfxml(tmp_path)


def test_modems_and_sensors_that_are_shipped_have_classes() -> None:
    # what a profile's title says of its modulation, and the class that has it
    known = {
        "FSK": "FSKModem",
        "PSK": "PSKModem",
        "S2C": "SpreadSpectrumModem",
        "ATM-900": "FSKModem",
        "JANUS": "FSKModem",
    }
    known |= {"SeaTrac": "SpreadSpectrumModem", "nanomodem": "SpreadSpectrumModem"}
    for name, modem in modems.modems().items():
        (found,) = {kind for word, kind in known.items() if word in modem.title}
        assert CORE.is_a(CORE.class_named(found).uid, CORE.class_named("AcousticModem").uid), name
    sonar = CORE.class_named("MappingSonar").uid
    assert CORE.is_a(sonar, CORE.class_named("Sensor").uid)
    assert {CORE.classes[uid].name for uid in CORE.subclasses(sonar)} == {
        "MappingSonar",
        "MultibeamSonar",
        "SideScanSonar",
    }


def test_capabilities_follow_from_parts() -> None:
    capable = CORE.class_named("CapablePlatform").uid
    names = {CORE.classes[uid].name for uid in CORE.subclasses(capable)} - {"CapablePlatform"}
    assert names == {
        "SurveyPlatform",
        "InspectionPlatform",
        "InterventionPlatform",
        "SamplingPlatform",
        "CommunicationGateway",
        "NavigationAid",
    }
    for name in names:
        assert list(EVERYTHING.objects(RM[name], OWL.equivalentClass)), name
    # what can turn a valve has a camera, so it can inspect: it follows from the definitions, nobody wrote it
    intervention, inspection = (CORE.class_named(f"{kind}Platform").uid for kind in ("Intervention", "Inspection"))
    assert CORE.is_a(intervention, inspection)


def test_the_page_of_terms_has_a_section_for_every_file_with_terms() -> None:
    page = (MISSIONS.parent / "docs" / "ontology.md").read_text()
    listed = re.findall(r"^```\{terms\} ([\w/]+)$", page, re.MULTILINE)
    names = {path.stem if path.parent == ONTOLOGY_FOLDER else f"{path.parent.name}/{path.stem}" for path in FILES}
    declaring = names - {"core", "alignments", "situation"}
    assert sorted(listed) == sorted(declaring)


def test_no_term_of_the_situation_vocabulary_is_an_attribute() -> None:
    assert not any(a.iri.startswith(str(SIT)) for a in CORE.attributes)
    assert not any(c.iri.startswith(str(SIT)) for c in CORE.classes)
