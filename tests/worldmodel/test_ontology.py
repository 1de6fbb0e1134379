"""Shipped ontology: definitions and alignment of its terms; imports resolve to its files."""

import re
from functools import cache
from itertools import chain
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rdflib import OWL, RDF, RDFS, Graph, Literal, URIRef
from rdflib.namespace import DCTERMS, SKOS
from rdflib.term import Node

import remoras
from exchange.channel import modems
from worldmodel import ValueKind, core_ontology_paths, read_tbox
from worldmodel.ontology import ONTOLOGY_FOLDER
from worldmodel.ontology.compiler import QUDT_UNITS, RM, symbol_of

MISSIONS = Path(__file__).parents[2] / "missions"
FILES = sorted(chain(ONTOLOGY_FOLDER.glob("*.ttl"), MISSIONS.rglob("*.ttl")))
CORE = read_tbox(*core_ontology_paths())
ALIGNMENTS = ONTOLOGY_FOLDER / "alignments.ttl"
OURS = "https://w3id.org/remoras/"


@cache
def graph(path: Path) -> Graph:
    return Graph().parse(path)


@cache
def everything() -> Graph:
    """All files together."""
    found = Graph()
    for path in FILES:
        found += graph(path)
    return found


def own_terms() -> set[Node]:
    """Terms of our namespace described in any shipped file."""
    return {term for term in everything().subjects() if isinstance(term, URIRef) and term.startswith(OURS)}


def unexplained(term: Node) -> str:
    """Missing English label or definition of a term; empty if none is."""
    for property_ in (RDFS.label, RDFS.comment):
        texts = list(everything().objects(term, property_))
        if len(texts) != 1 or not isinstance(texts[0], Literal) or texts[0].language != "en":
            return f"{term}: {property_} is {texts}"
    label, comment = (str(everything().value(term, property_)) for property_ in (RDFS.label, RDFS.comment))
    return f"{term}: {comment!r} says nothing" if len(comment) < 15 or comment == label else ""


def test_every_term_has_one_label_and_one_definition() -> None:
    found = [text for term in sorted(own_terms()) if (text := unexplained(term))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_file_has_a_version_and_the_licence_of_the_program(path: Path) -> None:
    (ontology,) = graph(path).subjects(RDF.type, OWL.Ontology)
    name = str(ontology).removeprefix(OURS)
    assert graph(path).value(ontology, OWL.versionIRI) == URIRef(f"{OURS}{remoras.__version__}/{name}")
    licence = str(graph(path).value(ontology, DCTERMS.license))
    assert licence.removeprefix("https://www.apache.org/licenses/") == "LICENSE-2.0"
    text = (MISSIONS.parent / "LICENSE").read_text(encoding="utf-8")
    assert re.search(r"Apache License\s+Version 2\.0", text)


def test_core_imports_every_ontology_that_vehicles_load() -> None:
    read = {next(graph(path).subjects(RDF.type, OWL.Ontology)) for path in core_ontology_paths()}
    core = URIRef(f"{OURS}core")
    assert {core, *everything().transitive_objects(core, OWL.imports)} == {core, *read}


def test_numbers_have_units_of_qudt_or_none() -> None:
    units = set(everything().objects(None, RM.unit))
    assert URIRef(f"{QUDT_UNITS}M") in units
    for unit in units:
        symbol = symbol_of(str(unit))
        assert symbol is not None
        assert symbol != str(unit).removeprefix(QUDT_UNITS), f"{unit} has no symbol of its own"
    assert {f.unit for a in CORE.attributes if a.kind is ValueKind.POINT for f in a.fields} == {"m"}


def test_every_class_or_a_superclass_is_aligned() -> None:
    for c in core_classes():
        above = {c, *everything().transitive_objects(c, RDFS.subClassOf)}
        ours = [one for one in above if isinstance(one, URIRef) and one.startswith(OURS)]
        targets = [
            target
            for one in ours
            for how in (RDFS.subClassOf, SKOS.closeMatch, SKOS.note)
            for target in graph(ALIGNMENTS).objects(one, how)
        ]
        assert targets, c
        assert not any(str(target).startswith(OURS) for target in targets)


def core_classes() -> list[Node]:
    return [
        c for path in core_ontology_paths() for c in graph(path).subjects(RDF.type, OWL.Class) if isinstance(c, URIRef)
    ]


def test_alignments_are_about_our_terms_and_do_not_clash() -> None:
    ours = {term for path in FILES for term in graph(path).subjects() if path.stem != "alignments"}
    declared = set(graph(ALIGNMENTS).subjects(RDF.type, None))
    for subject in graph(ALIGNMENTS).subjects(unique=True):
        assert subject in ours or subject in declared, subject
    for target in graph(ALIGNMENTS).objects(None, RDFS.subClassOf):
        assert (target, RDF.type, OWL.Class) in graph(ALIGNMENTS), target
    # PROV-O: Entity and Activity are disjoint; Agent is disjoint with neither
    prov = "http://www.w3.org/ns/prov#"
    for c in core_classes():
        above = set(everything().transitive_objects(c, RDFS.subClassOf))
        assert not above >= {URIRef(f"{prov}Entity"), URIRef(f"{prov}Activity")}, c
    namespaces = {re.split(r"[^/#]*$", str(o))[0] for o in graph(ALIGNMENTS).objects() if isinstance(o, URIRef)}
    for asked in ("ns/sosa/", "ns/ssn/", "2006/time#", "schema/qudt/", "ns/prov#", "geosparql#", "cora-bare#"):
        assert any(namespace.endswith(asked) for namespace in namespaces), asked


@pytest.mark.parametrize("folder", sorted({path.parent for path in FILES}), ids=lambda path: path.name)
def test_the_catalogue_leads_imports_to_the_files(folder: Path) -> None:
    catalogue = ElementTree.parse(folder / "catalog-v001.xml").getroot()
    entries = {each.get("name"): folder / str(each.get("uri")) for each in catalogue if each.tag.endswith("uri")}
    expected = {}
    for path in (path for path in FILES if path.parent == folder):
        (ontology,) = graph(path).subjects(RDF.type, OWL.Ontology)
        expected |= {str(name): path for name in (ontology, graph(path).value(ontology, OWL.versionIRI))}
    assert entries == expected
    following = [(folder / str(each.get("catalog"))).resolve() for each in catalogue if each.tag.endswith("Catalog")]
    assert following == ([] if folder == ONTOLOGY_FOLDER else [ONTOLOGY_FOLDER / "catalog-v001.xml"])


def test_shipped_modems_and_sensors_have_classes() -> None:
    # what a profile's title says of its modulation, and the class that has it
    known = dict.fromkeys(("FSK", "ATM-900", "JANUS"), "FSKModem") | {"PSK": "PSKModem"}
    known |= dict.fromkeys(("S2C", "SeaTrac", "nanomodem"), "SpreadSpectrumModem")
    for name, modem in modems.modems().items():
        (found,) = {kind for word, kind in known.items() if word in modem.title}
        assert CORE.is_a(CORE.class_named(found).uid, CORE.class_named("AcousticModem").uid), name
    sonar = CORE.class_named("MappingSonar").uid
    assert CORE.is_a(sonar, CORE.class_named("Sensor").uid)
    assert {CORE.classes[uid].name for uid in CORE.subclasses(sonar)} > {"MappingSonar", "SideScanSonar"}


def test_capabilities_follow_from_parts() -> None:
    capable = CORE.class_named("CapablePlatform").uid
    names = {CORE.classes[uid].name for uid in CORE.subclasses(capable)} - {"CapablePlatform"}
    assert names > {"SurveyPlatform", "CommunicationGateway", "NavigationAid"}
    for name in names:
        assert list(everything().objects(RM[name], OWL.equivalentClass)), name
    # what can turn a valve has a camera, so it can inspect: it follows from the definitions, nobody wrote it
    intervention, inspection = (CORE.class_named(f"{kind}Platform").uid for kind in ("Intervention", "Inspection"))
    assert CORE.is_a(intervention, inspection)
