import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import RDF, RDFS, XSD, Graph, Literal, URIRef
from rdflib.term import Node
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
    ban,
    block,
    fleet_model,
)

from worldmodel import TYPE_UID, QueryError, merge
from worldmodel.ontology import graph_of
from worldmodel.ontology.compiler import RM, SIT
from worldmodel.ontology.fields import Field
from worldmodel.rdf.sparql import query
from worldmodel.rdf.terms import RUN, instance_iri, term_of
from worldmodel.rdf.triples import as_graph


def facts_in(graph: Graph) -> list[Node]:
    return list(graph.subjects(RDF.type, SIT.PropertyValue))


def test_fact_is_written_in_terms_of_the_situation_awareness_ontology() -> None:
    model = fleet_model()
    merge(model, [block(2, 15, 123, (BAY, AREA_DONE, ASV_0), (ECHO, LOCATION, (3.5, 4.0)))])
    graph, fact = as_graph(model), RUN["fact-2-15-1"]
    assert set(graph.predicate_objects(fact)) == {
        (RDF.type, SIT.PropertyValue),
        (SIT.ofAttribute, RM.location),
        (SIT.dataValue, Literal("POINT (3.5 4.0)")),
        (SIT.timestamp, Literal("12.3", datatype=XSD.double)),
        (SIT.origin, instance_iri(ASV_0)),
    }
    assert set(graph.predicate_objects(instance_iri(BAY))) == {
        (RDF.type, RM.Area),
        (RDFS.label, Literal("bay")),
        (SIT.hasPropertyValue, RUN["fact-2-15-0"]),
        (RM.areaDone, instance_iri(ASV_0)),
    }
    assert list(graph.subjects(SIT.hasPropertyValue, fact)) == [instance_iri(ECHO)]
    assert (RM.AUV, RDFS.subClassOf, RM.UnderwaterVehicle) in graph


def test_literals_have_the_declared_datatype() -> None:
    model = fleet_model()
    facts = [(BAY, CELL, 7), (AUV_0, BATTERY, 1), (SURVEY, COMPLETED, True), (ECHO, CLASSIFICATION, 1)]
    model.record([*facts, (ECHO, TYPE_UID, WRECK), (ECHO, LENGTH, 0.1)], 1.0)
    graph = as_graph(model)
    assert {graph.value(fact, SIT.ofAttribute): graph.value(fact, SIT.dataValue) for fact in facts_in(graph)} == {
        RM.mappedCell: Literal("7", datatype=XSD.integer),
        RM.batteryFraction: Literal("1.0", datatype=XSD.double),
        RM.missionCompleted: Literal("true", datatype=XSD.boolean),
        RM.classification: Literal("wreck"),
        URIRef(TBOX.attributes[LENGTH].iri): Literal("0.1", datatype=XSD.decimal),
        SIT.type: None,
    }
    # a class is a link, and rdf:type is no individual: both would leave OWL 2 DL
    typed = next(graph.subjects(SIT.ofAttribute, SIT.type))
    assert list(graph.objects(typed, SIT.linkValue)) == [URIRef(TBOX.classes[WRECK].iri)]
    assert (RDF.type, None, None) not in graph
    assert (None, SIT.ofAttribute, RDF.type) not in graph


@given(st.floats(-1e4, 1e4), st.sampled_from(["1e-6", "0.25", "1", "1e12"]))
def test_points_have_the_declared_datatype(value: float, step: str) -> None:
    declared = next(graph_of(TBOX).objects(None, URIRef(f"{XSD}pattern")))
    resolution = float(step)
    axis = Field(-1e4 * resolution, 1e4 * resolution, resolution, "m")
    spot = replace(TBOX.attributes[LOCATION], fields=(axis, axis))
    written = term_of(TBOX, spot, (value * resolution, -value * resolution))
    assert re.fullmatch(str(declared), str(written)), written


def test_a_query_gives_columns_and_plain_rows() -> None:
    model = fleet_model(owner=2)
    model.record([(BAY, AREA_DONE, ASV_0), (ECHO, LOCATION, (3.5, 4.0)), (AUV_0, BATTERY, 0.5)], 12.3)
    asked = """
        SELECT ?subject ?attribute ?value ?time ?missing WHERE {
            ?subject sit:hasPropertyValue ?fact .
            ?fact sit:ofAttribute ?attribute ; sit:dataValue|sit:linkValue ?value ; sit:timestamp ?time .
            OPTIONAL { ?fact rm:areaDone ?missing } } ORDER BY ?attribute"""
    assert query(model, asked) == (
        ("subject", "attribute", "value", "time", "missing"),
        [
            ("bay", "rm:areaDone", "asv-0", 12.3, None),
            ("auv-0", "rm:batteryFraction", 0.5, 12.3, None),
            ("echo", "rm:location", "POINT (3.5 4.0)", 12.3, None),
        ],
    )
    assert query(model, "SELECT (AVG(?n) AS ?mean) { VALUES ?n { 1 2 } }") == (("mean",), [(1.5,)])
    assert query(model, "ASK { ?x rm:areaDone ?y }") == (("answer",), [(True,)])
    assert query(fleet_model(), "ASK { ?x rm:areaDone ?y }") == (("answer",), [(False,)])


def test_rows_of_several_models_name_their_vehicle() -> None:
    models = {"auv-0": fleet_model(0), "auv-1": fleet_model(1)}
    for level, model in zip((0.5, 0.7), models.values(), strict=True):
        model.record([(AUV_0, BATTERY, level)], 1.0)
    asked = "SELECT ?level WHERE { ?v rm:batteryFraction ?level }"
    assert query(models, asked) == (("vehicle", "level"), [("auv-0", 0.5), ("auv-1", 0.7)])
    by = "SELECT ?by WHERE { ?fact sit:origin ?by }"
    assert query(models, by) == (("vehicle", "by"), [("auv-0", "auv-0"), ("auv-1", "auv-1")])
    assert query(models["auv-1"], by) == (("by",), [("auv-1",)])
    said_by_0 = "SELECT ?x WHERE { ?x sit:hasPropertyValue/sit:origin run:instance-0 }"
    assert query(models, said_by_0) == (("vehicle", "x"), [("auv-0", "auv-0")])
    ban(models["auv-1"], [1])
    assert query(models, asked) == (("vehicle", "level"), [("auv-0", 0.5)])
    with pytest.raises(QueryError, match=r"the variable \?vehicle is taken.*give the variable another name"):
        query(models, "SELECT ?vehicle WHERE { ?vehicle rm:batteryFraction ?level }")
