import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oxigraph import n_rows
from small_fleet import AREA_DONE, ASV_0, AUV_0, AUV_1, BATTERY, BAY, ban, block, fleet_model, sound_blocks
from test_writing import received

from worldmodel import STATUS, Block, QueryError, merge
from worldmodel.rdf.sparql import query

QUERIES = (
    "SELECT ?x ?a ?v ?t ?by { ?x sit:hasPropertyValue ?f . ?f sit:ofAttribute ?a ; sit:dataValue|sit:linkValue ?v ;"
    " sit:timestamp ?t ; sit:origin ?by }",
    "SELECT ?x { ?x a/rdfs:subClassOf* rm:Vehicle }",
    "SELECT ?x ?level { ?x rm:batteryFraction ?level FILTER(?level > 0.105) }",
    "SELECT ?a (COUNT(?f) AS ?n) (MAX(?t) AS ?last) { ?f sit:ofAttribute ?a ; sit:timestamp ?t } GROUP BY ?a",
    "SELECT ?by (COUNT(?f) AS ?n) { GRAPH ?by { ?f a sit:PropertyValue } } GROUP BY ?by",
    "SELECT ?f ?t ?from { ?r sit:received ?f ; sit:receivedAt ?t ; sit:receivedFrom ?from ; sit:receivedBy ?to }",
    "SELECT ?x ?name ?other { ?x rdfs:label ?name OPTIONAL { ?x rm:areaDone ?other } }",
    "ASK { ?f sit:origin run:instance-1 }",
)


@settings(max_examples=10, deadline=None)
@given(sound_blocks(), st.sets(st.integers(0, 2), max_size=1))
def test_oxigraph_returns_as_many_rows(blocks: list[Block], banned: set[int]) -> None:
    model = fleet_model()
    merge(model, [*blocks, block(1, STATUS, 7, (AUV_1, BATTERY, 0.5))])
    ban(model, banned)
    known = received(model)
    for text in QUERIES:
        rows = query(known, text)[1]
        assert n_rows(known, text) == (int(rows[0][0]) if text.startswith("ASK") else len(rows)), text


def test_receptions_have_time_and_sender_of_the_packet() -> None:
    model = fleet_model(owner=0)
    model.record([(AUV_0, BATTERY, 0.5)], 1.0, private=True)
    merge(model, [block(2, 0, 123, (BAY, AREA_DONE, ASV_0))])
    asked = """SELECT ?x ?by ?observed_s ?received_s ?sender ?receiver {
        ?x sit:hasPropertyValue ?f . ?f sit:origin ?by ; sit:timestamp ?observed_s .
        OPTIONAL { ?r sit:received ?f ; sit:receivedAt ?received_s ; sit:receivedBy ?receiver
                   OPTIONAL { ?r sit:receivedFrom ?sender } } } ORDER BY ?observed_s"""
    own = ("auv-0", "auv-0", 1.0, None, None, None)
    assert query(received(model, sender=1), asked)[1] == [own, ("bay", "asv-0", 12.3, 13.8, "auv-1", "auv-0")]
    assert query(received(model, sender=None), asked)[1][1] == ("bay", "asv-0", 12.3, 13.8, None, "auv-0")
    assert query(model, asked)[1] == [own, ("bay", "asv-0", 12.3, None, None, None)]


@pytest.mark.parametrize(
    ("sparql", "reason"),
    [
        ("SELECT ?x { ?x a rn:AUV }", r"the prefix 'rn:' is unknown; known: .*\brm:.*; did you mean '\w+'"),
        ("SELECT ?x { ?x a rm:AUV", "the query cannot be answered: .*; allowed: a SPARQL 1.1 SELECT or ASK"),
        ("DESCRIBE rm:AUV", "the query is a DESCRIBE; allowed: SELECT or ASK"),
        ("SELECT ?x { SERVICE <http://127.0.0.1:9/> { ?x a rm:AUV } }", "the query has FROM or SERVICE"),
        ("SELECT ?x FROM <http://127.0.0.1:9/> { ?x a rm:AUV }", "the query has FROM or SERVICE"),
        ("SELECT ?x { ?x a rm:AVU }", "rm:AVU is no term of the vocabulary; did you mean 'AUV'"),
        ("ASK { ?x ^sit:orign|(rm:hasPart+/rm:hasPart) ?y }", "sit:orign is no term .* did you mean 'origin'"),
        ("ASK { ?x a ?y FILTER NOT EXISTS { ?x rm:areaDun ?z } }", "rm:areaDun is no term .* did you mean 'areaDone'"),
        ("ASK { FILTER NOT EXISTS { SERVICE SILENT <http://a> { ?x a rm:AUV } } }", "the query has FROM or SERVICE"),
    ],
)
def test_query_error_is_one_line(sparql: str, reason: str) -> None:
    with pytest.raises(QueryError, match=reason) as caught:
        query(fleet_model(), sparql)
    assert "\n" not in str(caught.value)


def test_every_term_of_a_world_model_may_be_asked_for() -> None:
    known = received(fleet_model(owner=0))
    merge(known.model, [block(1, STATUS, 7, (AUV_1, BATTERY, 0.5))])
    terms = {term for row in query(known, "SELECT ?p ?c { ?x ?p ?y OPTIONAL { ?x a ?c } }")[1] for term in row if term}
    named = {str(term) for term in terms if str(term).startswith(("rm:", "sit:"))}
    assert len(named) > 5
    for term in sorted(named):
        query(known, f"ASK {{ ?x {term} ?y }}")


def test_unknown_graph_is_empty() -> None:
    model = fleet_model()
    model.record([(AUV_0, BATTERY, 0.5)], 1.0)
    for name in ("<http://no.where/x>", "run:nothing", "run:instance-99999"):
        assert query(model, f"SELECT * {{ GRAPH {name} {{ ?a ?b ?c }} }}")[1] == []
        assert query(model, f"ASK {{ GRAPH {name} {{ ?a ?b ?c }} }}")[1] == [(False,)]
    assert query(model, "ASK { ?a ?b ?c }")[1] == [(True,)]
    assert query(model, "SELECT ?f { GRAPH ?by { ?f a sit:PropertyValue } }")[1]
