"""SHACL shapes made from the ontology's own domains and ranges, as an independent oracle for checks and export.

Of the faults that a checker of such data should find, those that can be stated here: (a) member of disjoint
classes, (c) dangling link, (d, d3) value out of range, (d2) wrong datatype; and domain and range of
links. (b) and (b2), two values of a functional property, are no faults: an attribute may have many values.
"""

import pytest
from rdflib import OWL, RDF, RDFS, SH, XSD, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node
from small_fleet import (
    AREA_DONE,
    ASV,
    ASV_0,
    AUV,
    AUV_0,
    BATTERY,
    BAY,
    CELL,
    CLASSIFICATION,
    COMPLETED,
    ECHO,
    EXPLORER,
    LENGTH,
    LOCATION,
    NEAR,
    SURVEY,
    TBOX,
    WRECK,
    block,
    check,
    first_uid_of,
    fleet_model,
)

from worldmodel import TYPE_UID, Value, ValueKind, merge
from worldmodel.owl import graph_of
from worldmodel.rdf.terms import instance_iri, term_of
from worldmodel.rdf.view import as_graph

pyshacl = pytest.importorskip("pyshacl")
NEW = first_uid_of(0)


def shapes() -> Graph:
    """The rules of the ontology in SHACL: disjointness, and of each attribute its domain and its own range."""
    graph, ontology = Graph(), graph_of(TBOX)
    classes = [URIRef(c.iri) for c in TBOX.classes]
    for a in TBOX.classes:
        others = [b for b in TBOX.classes if b.uid > a.uid and TBOX.are_disjoint(a.uid, b.uid)]
        for b in others:
            shape, excluded = BNode(), BNode()
            graph.add((shape, RDF.type, SH.NodeShape))
            graph.add((shape, SH.targetClass, classes[a.uid]))
            graph.add((shape, SH["not"], excluded))
            graph.add((excluded, SH["class"], classes[b.uid]))
    for attribute in TBOX.attributes:
        if attribute.kind is ValueKind.TYPE:
            continue
        shape, rule = BNode(), BNode()
        declared = ontology.value(URIRef(attribute.iri), RDFS.range)
        graph.add((shape, RDF.type, SH.NodeShape))
        graph.add((shape, SH.targetSubjectsOf, URIRef(attribute.iri)))
        graph.add((shape, SH["class"], classes[attribute.domain]))
        graph.add((shape, SH.property, rule))
        graph.add((rule, SH.path, URIRef(attribute.iri)))
        if attribute.range_class is not None:
            graph.add((rule, SH["class"], classes[attribute.range_class]))
        if attribute.kind is ValueKind.BOOLEAN:
            graph.add((rule, SH.datatype, XSD.boolean))
        if attribute.kind is ValueKind.POINT:
            (pattern,) = ontology.objects(None, URIRef(f"{XSD}pattern"))
            graph.add((rule, SH.datatype, XSD.string))
            graph.add((rule, SH.pattern, Literal(f"^{pattern}$")))
        if attribute.kind is ValueKind.SYMBOL:
            symbols = BNode()
            Collection(graph, symbols, list(Collection(ontology, ontology.value(declared, OWL.oneOf))))
            graph.add((rule, SH["in"], symbols))
        if attribute.kind is ValueKind.NUMBER:
            graph.add((rule, SH.datatype, declared))
            graph.add((rule, SH.minInclusive, Literal(float(attribute.fields[0].minimum))))
            graph.add((rule, SH.maxInclusive, Literal(float(attribute.fields[0].maximum))))
    return graph


SHAPES = shapes()
CLASSES = [t for t in graph_of(TBOX) if t[1] == RDFS.subClassOf]


def _raw(attribute: int, value: Value) -> Node:
    """The value as RDF, whether the attribute may have it or not."""
    kind = TBOX.attributes[attribute].kind
    if kind in {ValueKind.POINT, ValueKind.SYMBOL}:
        return term_of(TBOX, TBOX.attributes[attribute], value)
    if kind is ValueKind.TYPE:
        return URIRef(TBOX.classes[int(value)].iri)  # type: ignore[arg-type]
    if kind is ValueKind.LINK:
        return instance_iri(int(value))  # type: ignore[arg-type]
    if kind is ValueKind.NUMBER and type(value) is float:
        declared = graph_of(TBOX).value(URIRef(TBOX.attributes[attribute].iri), RDFS.range)
        return Literal(f"{value:g}", datatype=declared)  # type: ignore[arg-type]
    return Literal(value)


def conforms(facts: list[tuple[int, int, Value]]) -> bool:
    """SHACL's verdict on what is known at first and ``facts``, put in unchecked."""
    graph = Graph()
    for triple in as_graph(fleet_model()):
        if triple not in graph_of(TBOX):
            graph.add(triple)
    for triple in CLASSES:
        graph.add(triple)
    for subject, attribute, value in facts:
        iri = URIRef(TBOX.attributes[attribute].iri)
        graph.add((instance_iri(subject), iri, _raw(attribute, value)))
    return bool(pyshacl.validate(graph, shacl_graph=SHAPES)[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    "facts",
    [
        pytest.param([(AUV_0, TYPE_UID, ASV)], id="a: member of disjoint classes"),
        pytest.param([(NEW, TYPE_UID, WRECK), (NEW, TYPE_UID, AUV)], id="a: within one block"),
        pytest.param([(BAY, AREA_DONE, NEW)], id="c: dangling link"),
        pytest.param([(NEW, LENGTH, 3.0)], id="c: unknown subject"),
        pytest.param([(AUV_0, BATTERY, 1.5)], id="d: above the range"),
        pytest.param([(BAY, CELL, -1.0)], id="d: below the range"),
        pytest.param([(AUV_0, BATTERY, True)], id="d2: wrong datatype"),
        pytest.param([(SURVEY, COMPLETED, 1.0)], id="d2: number for a truth value"),
        pytest.param([(BAY, BATTERY, 0.5)], id="domain"),
        pytest.param([(BAY, AREA_DONE, EXPLORER)], id="range of a link"),
        pytest.param([(ECHO, LENGTH, 3.0)], id="domain, not yet refined"),
    ],
)
def test_what_shacl_refuses_does_not_go_in(facts: list[tuple[int, int, Value]]) -> None:
    result = check(fleet_model(), block(0, 0, 0, *facts))
    assert result.faults or result.missing
    assert not conforms(facts)


@pytest.mark.slow
@pytest.mark.parametrize(
    "facts",
    [
        [(AUV_0, BATTERY, 0.5), (BAY, CELL, 4095.0), (SURVEY, COMPLETED, True)],
        [(BAY, AREA_DONE, ASV_0), (BAY, AREA_DONE, AUV_0)],
        [(NEW, TYPE_UID, WRECK), (NEW, LENGTH, 3.0), (ECHO, NEAR, NEW)],
        [(ECHO, TYPE_UID, WRECK), (ECHO, LENGTH, 3.0)],
        [(ECHO, LOCATION, (3.5, -4.0)), (ECHO, CLASSIFICATION, 1)],
    ],
)
def test_what_goes_in_conforms(facts: list[tuple[int, int, Value]]) -> None:
    result = check(fleet_model(), block(0, 0, 0, *facts))
    assert not result.faults
    assert not result.missing
    assert conforms(facts)
    model = fleet_model()
    merge(model, [block(0, 0, 0, *facts)])
    written = Graph()
    written += as_graph(model)
    ok, _, report = pyshacl.validate(written, shacl_graph=SHAPES)
    assert ok, report
