"""Inference: conclusions are independent of the order of facts and withdrawn with their premises."""

import random
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rdflib import Dataset, Graph
from test_compiler import PREFIXES

from worldmodel import (
    TYPE_UID,
    Block,
    FactError,
    Instance,
    Keeping,
    Knowledge,
    PropertyValue,
    Source,
    TBox,
    ValueKind,
    WorldModel,
    merge,
    read_tbox,
)
from worldmodel.rdf.sparql import query
from worldmodel.rdf.triples import CONCLUSIONS, as_dataset
from worldmodel.rdf.writing import RdfFormat, written

ONTOLOGY = (
    PREFIXES.replace("bad#", "gear#")
    + """
ex:Vehicle a owl:Class .
ex:Gear a owl:Class .
ex:Sonar a owl:Class ; rdfs:subClassOf ex:Gear .
ex:SideScan a owl:Class ; rdfs:subClassOf ex:Sonar .
ex:partOf a owl:ObjectProperty , owl:TransitiveProperty ; rdfs:domain owl:Thing ; rdfs:range owl:Thing .
ex:hasPart a owl:ObjectProperty ; rdfs:domain owl:Thing ; rdfs:range owl:Thing ; owl:inverseOf ex:partOf .
ex:carriedBy a owl:ObjectProperty ; rdfs:domain ex:Gear ; rdfs:range ex:Vehicle ; rdfs:subPropertyOf ex:partOf .
ex:meets a owl:ObjectProperty ; owl:inverseOf ex:meets ; rdfs:domain ex:Vehicle ; rdfs:range ex:Vehicle .
ex:available a owl:DatatypeProperty ; rdfs:domain ex:Vehicle ; rdfs:range xsd:boolean .
ex:bannedFrom a owl:DatatypeProperty ; rdfs:domain ex:Vehicle ; rdfs:range xsd:integer ;
    rm:minimum 0 ; rm:maximum 1048575 ; rm:resolution 1 .
ex:Platform a owl:Class ; owl:equivalentClass
    [ a owl:Restriction ; owl:onProperty ex:hasPart ; owl:someValuesFrom ex:Gear ] .
ex:Surveyor a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf (
    ex:Vehicle [ a owl:Restriction ; owl:onProperty ex:hasPart ; owl:someValuesFrom ex:Sonar ] ) ] .
ex:Ready a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf (
    ex:Surveyor [ a owl:Restriction ; owl:onProperty ex:available ; owl:hasValue true ] ) ] .
ex:Escort a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf (
    ex:Vehicle [ a owl:Restriction ; owl:onProperty ex:meets ; owl:someValuesFrom ex:Ready ] ) ] .
ex:Convoy a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf ( ex:Surveyor ex:Escort ) ] .
"""
)


@pytest.fixture(scope="module")
def tbox() -> TBox:
    return read_tbox(Source("gear.ttl", ONTOLOGY))


N_VEHICLES, N_GEAR, N_ORIGINS = 3, 3, 3
LINKS = ("partOf", "carriedBy", "meets")


def fleet(tbox: TBox, common_facts: Sequence[PropertyValue] = ()) -> WorldModel:
    vehicle, gear = (tbox.class_named(name).uid for name in ("Vehicle", "Gear"))
    instances = [Instance(uid, vehicle, f"v{uid}") for uid in range(N_VEHICLES)]
    instances += [Instance(uid, gear, f"g{uid}") for uid in range(N_VEHICLES, N_VEHICLES + N_GEAR)]
    return WorldModel(tbox, 0, instances, n_origins=N_ORIGINS, keeping=Keeping(common_facts=common_facts))


def blocks(drawn: Sequence[tuple[str, int, int, int]], tbox: TBox) -> list[Block]:
    """Blocks of one fact, from (attribute, subject, value, origin), with subject and value fitted to the attribute."""
    counts = dict.fromkeys(range(N_ORIGINS), 0)
    found = []
    for what, a, b, origin in drawn:
        vehicle, other, gear = a % N_VEHICLES, b % N_VEHICLES, N_VEHICLES + a % N_GEAR
        anything = b % (N_VEHICLES + N_GEAR)
        subject, value = {
            "type": (gear, tbox.class_named(("Sonar", "SideScan")[b % 2]).uid),
            "partOf": (a % (N_VEHICLES + N_GEAR), anything),
            "carriedBy": (gear, other),
            "meets": (vehicle, other),
            "available": (vehicle, b % 2 == 0),
        }[what]
        fact = PropertyValue(subject, tbox.attribute_named(what).uid, value)
        found.append(Block(origin, counts[origin], float(len(found) % 7), (fact,)))
        counts[origin] += 1
    return found


FACTS = st.lists(
    st.tuples(
        st.sampled_from(("type", *LINKS, "partOf", "carriedBy", "available")),
        st.integers(0, 11),
        st.integers(0, 11),
        st.integers(0, N_ORIGINS - 1),
    ),
    max_size=14,
)


def ban_of_1(tbox: TBox) -> Block:
    """Ban of origin 1 by origin 2 from the start on."""
    return Block(2, 999, 100.0, (PropertyValue(1, tbox.attribute_named("bannedFrom").uid, 0.0),))


def conclusions(model: WorldModel) -> tuple[dict[int, list[str]], dict[tuple[int, str], tuple[int, ...]]]:
    tbox, uids = model.tbox, sorted(model.instance_uids())
    classes = {uid: [c.name for c in tbox.classes if model.inference.classes(uid) >> c.uid & 1] for uid in uids}
    links = {
        (uid, a.name): model.inference.links(uid, a.uid)
        for uid in uids
        for a in tbox.attributes
        if a.kind is ValueKind.LINK
    }
    return classes, links


@settings(max_examples=60, deadline=None)
@given(facts=FACTS, seed=st.integers(0, 1000))
def test_conclusions_depend_on_visible_facts_and_not_on_their_order(tbox, facts, seed) -> None:
    """Asked after every block or at the end, in any order, with an origin banned before or after: the same."""
    told, rng = blocks(facts, tbox), random.Random(seed)
    often, once = fleet(tbox), fleet(tbox)
    shuffled = rng.sample(told, len(told))
    for n, block in enumerate(told):
        if n == len(told) // 2:
            merge(often, [ban_of_1(tbox)])
        merge(often, [block])
        conclusions(often)
    if not told:
        merge(often, [ban_of_1(tbox)])
    merge(once, shuffled)
    conclusions(once)
    merge(once, [ban_of_1(tbox)])
    assert 1 in often.banned
    assert conclusions(often) == conclusions(once)


def record(model: WorldModel, subject: int, attribute: str, value: int | bool, now_s: float) -> None:
    model.record([(subject, model.tbox.attribute_named(attribute).uid, value)], now_s)


def names_of(model: WorldModel, uid: int) -> set[str]:
    return set(conclusions(model)[0][uid]) - {"Thing"}


def test_conclusions_from_a_value_are_withdrawn_when_it_changes(tbox: TBox) -> None:
    model = fleet(tbox)
    record(model, 3, "type", tbox.class_named("SideScan").uid, 1.0)
    record(model, 3, "carriedBy", 0, 2.0)
    record(model, 0, "available", True, 3.0)
    record(model, 1, "meets", 0, 4.0)
    assert names_of(model, 0) == {"Vehicle", "Platform", "Surveyor", "Ready"}
    assert names_of(model, 1) == {"Vehicle", "Escort"}
    assert [i.name for i in model.instances_of(tbox.class_named("Escort").uid)] == ["v1"]
    record(model, 3, "carriedBy", 2, 5.0)  # the sonar changes hands
    assert [names_of(model, uid) for uid in range(3)] == [
        {"Vehicle"}, {"Vehicle"}, {"Vehicle", "Platform", "Surveyor"}
    ]  # fmt: skip
    assert model.instances_of(tbox.class_named("Escort").uid) == ()
    assert not model.class_mask(2) >> tbox.class_named("Surveyor").uid & 1  # the checks ask for what is told


def test_common_facts_of_one_attribute_hold_together_and_are_not_sent(tbox: TBox) -> None:
    has_part = tbox.attribute_named("hasPart").uid
    model = fleet(tbox, [PropertyValue(0, has_part, 3), PropertyValue(0, has_part, 4)])
    assert model.inference.links(0, has_part) == (3, 4)
    assert model.inference.links(4, tbox.attribute_named("partOf").uid) == (0,)
    assert names_of(model, 0) == {"Vehicle", "Platform"}
    record(model, 4, "type", tbox.class_named("Sonar").uid, 1.0)
    assert "Surveyor" in names_of(model, 0)
    record(model, 0, "hasPart", 5, 2.0)
    assert model.inference.links(0, has_part) == (3, 4, 5)
    assert len(list(model.blocks())) == 2
    assert model.latest(0, has_part).value == 5  # type: ignore[union-attr]


def test_conclusions_are_answered_and_written_in_a_graph_of_their_own(tbox: TBox) -> None:
    has_part = tbox.attribute_named("hasPart").uid
    model = fleet(tbox, [PropertyValue(0, has_part, 3), PropertyValue(0, has_part, 4)])
    record(model, 3, "type", tbox.class_named("Sonar").uid, 1.0)
    record(model, 1, "meets", 0, 2.0)
    prefix = "PREFIX ex: <https://example.org/gear#> "
    surveyors = "SELECT ?v { ?v a ex:Surveyor }"
    assert query(model, prefix + surveyors)[1] == [("v0",)]
    whole = query(model, prefix + "SELECT ?p { ?p ex:partOf ?v } ORDER BY ?p")[1]
    assert whole == [("g3",), ("g4",)]
    follows = query(model, prefix + "SELECT ?s ?o { GRAPH run:conclusions { ?s ex:meets ?o } }")[1]
    assert follows == [("v0", "v1")]  # that v1 met v0 was told
    told = query(model, prefix + "SELECT ?o { GRAPH run:conclusions { ?s ex:hasPart ?o } }")[1]
    assert told == []
    data = Dataset().parse(data=written({"v0": Knowledge(model)}, RdfFormat.TRIG), format="trig")
    assert set(data.graph(CONCLUSIONS)) == set(as_dataset(model).graph(CONCLUSIONS))
    assert not set(data.default_graph) & set(data.graph(CONCLUSIONS))
    turtle = Graph().parse(data=written({"v0": Knowledge(model)}, RdfFormat.TURTLE), format="turtle")
    assert set(data.graph(CONCLUSIONS)) <= set(turtle)
    assert CONCLUSIONS in {graph.identifier for graph in as_dataset(model).graphs()}


def test_common_value_holds_until_a_vehicle_records_another(tbox: TBox) -> None:
    available = tbox.attribute_named("available").uid
    facts = [PropertyValue(0, available, True), PropertyValue(3, tbox.attribute_named("carriedBy").uid, 0)]
    model = fleet(tbox, facts)
    merge(model, blocks([("type", 0, 1, 1)], tbox))
    assert "Ready" in names_of(model, 0)
    assert model.value(0, available) is True
    assert model.latest(0, available) is None  # nobody observed it
    asked = "SELECT ?v { ?v <https://example.org/gear#available> ?is }"
    assert len(query(model, asked)[1]) == 1
    record(model, 0, "available", False, 2.0)
    assert "Ready" not in names_of(model, 0)
    assert len(query(model, asked)[1]) == 1


def test_type_as_common_fact_is_refused(tbox: TBox) -> None:
    with pytest.raises(FactError, match="states a class; allowed: the class of a common instance"):
        fleet(tbox, [PropertyValue(0, TYPE_UID, 1)])
