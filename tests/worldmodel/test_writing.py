import pyoxigraph
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oxigraph import term_of
from rdflib import OWL, RDFS, Dataset, Literal, URIRef
from rdflib.graph import DATASET_DEFAULT_GRAPH_ID
from rdflib.term import Node
from small_fleet import (
    AREA_DONE,
    ASV_0,
    AUV_0,
    AUV_1,
    BATTERY,
    BAY,
    CLASSIFICATION,
    ECHO,
    INSTANCES,
    LOCATION,
    N_ORIGINS,
    TBOX,
    ban,
    block,
    fleet_model,
    sound_blocks,
)

from worldmodel import STATUS, Block, Instance, Knowledge, PropertyValue, Reception, WorldModel, merge
from worldmodel.ontology import graph_of
from worldmodel.ontology.compiler import SIT
from worldmodel.rdf.terms import RUN, instance_iri
from worldmodel.rdf.triples import as_dataset, as_graph
from worldmodel.rdf.writing import RdfFormat, knowledge_iri, written

OF_RDFLIB = {"jsonld": "json-ld"}
OF_OXIGRAPH = {
    "ttl": pyoxigraph.RdfFormat.TURTLE,
    "trig": pyoxigraph.RdfFormat.TRIG,
    "jsonld": pyoxigraph.RdfFormat.JSON_LD,
    "nt": pyoxigraph.RdfFormat.N_TRIPLES,
}


def received(model: WorldModel, sender: int = 2) -> Knowledge:
    """The model, as if its vehicle had received each foreign block 1.5 s after it was observed."""
    foreign = (one for one in (*model.blocks(), *model.statuses()) if one.origin != model.owner)
    return Knowledge(model, tuple(Reception(one, sender, one.time_s + 1.5) for one in foreign))


Quad = tuple[Node, Node, Node, Node | None]


def quads_by_rdflib(text: str, form: RdfFormat) -> set[Quad]:
    data = Dataset()
    data.parse(data=text, format=OF_RDFLIB.get(form.value, form.value))
    return {(s, p, o, None if c == DATASET_DEFAULT_GRAPH_ID else c) for s, p, o, c in data.quads()}


def quads_by_oxigraph(text: str, form: RdfFormat) -> set[Quad]:
    quads = pyoxigraph.parse(text.encode(), format=OF_OXIGRAPH[form.value])
    return {(term_of(q.subject), term_of(q.predicate), term_of(q.object), graph_name(q.graph_name)) for q in quads}


def graph_name(term: object) -> Node | None:
    return None if isinstance(term, pyoxigraph.DefaultGraph) else term_of(term)


def own_triples(known: Knowledge) -> set[tuple[Node, ...]]:
    return set(as_graph(known)) - set(graph_of(TBOX))


def odd_fleet() -> WorldModel:
    """A fleet whose names need every kind of escape."""
    names = ['auv "0"', "back\\slash", "new\nline\ttab\r", "Ärger 海 \U0001f41f", "bay .", "", "a:b/c#d"]
    instances = [Instance(one.uid, one.class_uid, name) for one, name in zip(INSTANCES, names, strict=True)]
    return WorldModel(TBOX, 0, instances, n_origins=N_ORIGINS, run_time_instances_per_origin=2)


@pytest.mark.parametrize("form", RdfFormat)
@pytest.mark.parametrize("make", [fleet_model, odd_fleet])
def test_rdflib_and_oxigraph_read_the_same_quads_back(form: RdfFormat, make: type) -> None:
    model = make()
    merge(model, [block(2, 0, 123, (BAY, AREA_DONE, ASV_0), (ECHO, LOCATION, (3.5, 4.0)))])
    merge(model, [block(1, 0, 5, (ECHO, CLASSIFICATION, 3)), block(1, STATUS, 7, (AUV_1, BATTERY, 0.5))])
    known = received(model)
    text = written({"auv-0": known}, form)
    by_rdflib = quads_by_rdflib(text, form)
    assert by_rdflib == quads_by_oxigraph(text, form)
    whole = URIRef(str(RUN).rstrip("/"))
    header = {quad for quad in by_rdflib if quad[0] == whole}
    assert {quad[:3] for quad in by_rdflib - header} == own_triples(known)
    assert {quad[2] for quad in header} >= {OWL.Ontology, URIRef("https://w3id.org/remoras/marine")}
    origins = {instance_iri(1), instance_iri(2)} if form.has_graphs else set()
    assert {quad[3] for quad in by_rdflib} == {None, *origins}


@pytest.mark.parametrize("form", RdfFormat)
def test_of_several_vehicles_each_is_a_graph_or_all_are_their_union(form: RdfFormat) -> None:
    models = {f"auv-{n}": fleet_model(n) for n in range(2)}
    for n, model in enumerate(models.values()):
        model.record([(AUV_0, BATTERY, 0.5 + n / 10)], 1.0)
        merge(model, [block(2, 0, 123, (BAY, AREA_DONE, ASV_0))])
    known = {name: received(model) for name, model in models.items()}
    quads = quads_by_rdflib(written(known, form), form)
    assert quads == quads_by_oxigraph(written(known, form), form)
    own = [own_triples(one) for one in known.values()]
    if form.has_graphs:
        for n, triples in enumerate(own):
            assert {quad[:3] for quad in quads if quad[3] == knowledge_iri(n)} == triples
            assert (knowledge_iri(n), RDFS.label, Literal(f"auv-{n}"), None) in quads
    else:
        assert own[0] | own[1] <= {quad[:3] for quad in quads}


@settings(max_examples=8, deadline=None)
@given(sound_blocks(), st.sets(st.integers(0, 2), max_size=1))
def test_graph_of_an_origin_has_exactly_its_facts(blocks: list[Block], banned: set[int]) -> None:
    """With receptions, statuses and private facts."""
    model = fleet_model()
    merge(model, blocks)
    model.record([(AUV_0, BATTERY, 0.5)], 700.0, private=True)
    merge(model, [Block(2, STATUS, 701.0, (PropertyValue(ASV_0, BATTERY, 0.75),))])
    ban(model, banned)
    data = as_dataset(received(model))
    everything = set(data.default_graph)
    for origin in range(N_ORIGINS):
        iri = instance_iri(origin)
        facts = set(data.default_graph.subjects(SIT.origin, iri))
        assert bool(facts) <= (origin not in banned)
        about = {t for t in everything if t[0] in facts or (t[1] == SIT.hasPropertyValue and t[2] in facts)}
        assert set(data.graph(iri)) == about
