from itertools import product
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rdflib import RDF, RDFS, XSD, Graph, Literal, URIRef
from rdflib.compare import isomorphic
from small_fleet import (
    AREA_DONE,
    ASV_0,
    AUV_0,
    BATTERY,
    BAY,
    CLASSIFICATION,
    ECHO,
    LOCATION,
    SURVEY,
    TBOX,
    WRECK,
    block,
    class_uid,
    first_uid_of,
    fleet_model,
    sound_blocks,
)

from worldmodel import TYPE_UID, Block, merge
from worldmodel.owl import RM, SIT
from worldmodel.view import (
    RUN,
    WorldModelStore,
    as_graph,
    canonical_ntriples,
    export,
    instance_iri,
    origin_iri,
    term_of,
)

LATEST = """
SELECT ?value WHERE {
  ?instance sit:hasPropertyValue ?fact . ?fact sit:ofAttribute ?attribute ; sit:value ?value ;
    sit:timestamp ?time ; sit:origin ?origin .
} ORDER BY DESC(?time) DESC(?origin) LIMIT 1
"""


def test_a_fact_after_the_situation_awareness_tbox() -> None:
    model = fleet_model()
    merge(model, [block(2, 15, 123, (BAY, AREA_DONE, ASV_0), (ECHO, LOCATION, (3.5, 4.0)))])
    graph, fact = as_graph(model), RUN["fact/2-15-1"]
    assert set(graph.predicate_objects(fact)) == {
        (RDF.type, SIT.PropertyValue),
        (SIT.ofAttribute, RM.location),
        (SIT.value, Literal("POINT (3.5 4.0)", datatype=RM.Point)),
        (SIT.timestamp, Literal("12.3", datatype=XSD.double)),
        (SIT.origin, origin_iri(2)),
    }
    assert set(graph.predicate_objects(instance_iri(BAY))) == {
        (RDF.type, RM.Area),
        (RDFS.label, Literal("bay")),
        (SIT.hasPropertyValue, RUN["fact/2-15-0"]),
        (RM.areaDone, instance_iri(ASV_0)),
    }
    assert list(graph.subjects(SIT.hasPropertyValue, fact)) == [instance_iri(ECHO)]
    assert (RM.location, RDF.type, SIT.Attribute) in graph
    assert (RM.AUV, RDFS.subClassOf, RM.Vehicle) in graph


def test_the_view_follows_the_model_and_cannot_be_written() -> None:
    model = fleet_model()
    graph = as_graph(model)
    assert list(graph.objects(instance_iri(AUV_0), RM.batteryFraction)) == []
    model.record([(AUV_0, BATTERY, 0.5)], 1.0)
    assert list(graph.objects(instance_iri(AUV_0), RM.batteryFraction)) == [Literal("0.5", datatype=XSD.double)]
    model.ban(0)
    assert list(graph.objects(instance_iri(AUV_0), RM.batteryFraction)) == []
    with pytest.raises(TypeError, match=r"call WorldModel\.record or merge"):
        graph.add((instance_iri(0), RDF.type, RM.AUV))
    with pytest.raises(TypeError, match="nothing that is known is removed"):
        graph.remove((None, None, None))


def test_sparql_over_classes_and_their_subclasses() -> None:
    model = fleet_model()
    uid = first_uid_of(1)
    merge(model, [block(1, 0, 0, (uid, TYPE_UID, WRECK)), block(0, 0, 0, (ECHO, CLASSIFICATION, 3))])
    rows = as_graph(model).query(
        "SELECT ?x WHERE { ?x a/rdfs:subClassOf* rm:ObjectOfInterest }", initNs={"rm": RM, "rdfs": RDFS}
    )
    assert {row[0] for row in rows} == {instance_iri(uid), instance_iri(ECHO)}
    symbols = as_graph(model).objects(instance_iri(ECHO), RM.classification)
    assert list(symbols) == [Literal("anomaly")]


@settings(max_examples=8, deadline=None)
@given(sound_blocks(), st.sets(st.integers(0, 2), max_size=1))
def test_index_view_and_sparql_answer_alike(blocks: list[Block], banned: set[int]) -> None:
    model = fleet_model()
    merge(model, blocks)
    for origin in banned:
        model.ban(origin)
    view = as_graph(model)
    copy = Graph()
    copy += view
    facts = Graph(store=WorldModelStore(model, with_tbox=False))
    patterns = {
        tuple(term if bound else None for term, bound in zip(triple, which, strict=True))
        for triple in facts
        for which in product((True, False), repeat=3)
    }
    for pattern in patterns:
        assert sorted(view.triples(pattern)) == sorted(copy.triples(pattern)), pattern
    assert len(view) == len(copy)
    for subject, attribute in [(AUV_0, BATTERY), (ECHO, LOCATION), (ECHO, CLASSIFICATION), (BAY, AREA_DONE)]:
        latest = model.latest(subject, attribute)
        iri = URIRef(TBOX.attributes[attribute].iri)
        current = list(view.objects(instance_iri(subject), iri))
        bindings = {"instance": instance_iri(subject), "attribute": iri}
        rows = [row[0] for row in view.query(LATEST, initNs={"sit": SIT}, initBindings=bindings)]
        if latest is None:
            assert current == rows == []
        else:
            assert current == [term_of(TBOX, TBOX.attributes[attribute], latest.value)]
            newest = [o for o in model.history(subject, attribute) if o.block.key[:2] == latest.block.key[:2]]
            assert rows[0] in [term_of(TBOX, TBOX.attributes[attribute], o.value) for o in newest]


@settings(max_examples=25, deadline=None)
@given(sound_blocks(), st.randoms(use_true_random=False))
def test_equal_hashes_give_equal_bytes(blocks: list[Block], rng: object) -> None:
    one, two = fleet_model(0), fleet_model(1)
    merge(one, blocks)
    rng.shuffle(blocks)  # type: ignore[attr-defined]
    merge(two, blocks)
    assert one.state_hash() == two.state_hash()
    assert canonical_ntriples(one) == canonical_ntriples(two)


def test_a_whole_number_and_its_double_are_one_value() -> None:
    one, two = fleet_model(), fleet_model()
    merge(one, [block(0, 0, 0, (AUV_0, BATTERY, 1))])
    merge(two, [block(0, 0, 0, (AUV_0, BATTERY, 1.0))])
    assert one.state_hash() == two.state_hash()
    assert canonical_ntriples(one) == canonical_ntriples(two)


@pytest.mark.parametrize("format", ["turtle", "xml", "nt"])
def test_exports_read_back(tmp_path: Path, format: str) -> None:
    model = fleet_model()
    model.record([(ECHO, LOCATION, (1.0, 2.0)), (SURVEY, TBOX.attribute_named("missionCompleted").uid, True)], 1.0)
    export(model, tmp_path / "model", format)
    read = Graph().parse(tmp_path / "model", format=format)
    expected = Graph().parse(data=canonical_ntriples(model), format="nt")
    assert {(s, p) for s, p, _ in read} == {(s, p) for s, p, _ in expected}
    assert {o.toPython() for o in read.objects()} == {o.toPython() for o in expected.objects()}
    if format == "nt":
        assert isomorphic(read, expected)
    assert (instance_iri(AUV_0), RDF.type, URIRef(TBOX.classes[class_uid("AUV")].iri)) in read
