"""What a world model costs, each row against rdflib's Memory store or a plain dict in the same process.

One vehicle of five knows 100 instances of 20 classes with 10 attributes each; values are drawn from 10,001 steps, so
that values which the checks remember do not flatter. An observation is six triples. What is compared is measured in
turn, and the best of a few counts; what takes long is measured less often. ``--json`` has the goal of each row, and
whether it is met.
"""

from __future__ import annotations

import gc
import random
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rdflib import RDF, XSD, Graph, Literal, URIRef
from rdflib.term import Node

from benchmarks.measuring import row
from worldmodel import Block, Instance, PropertyValue, TBox, WorldModel, core_ontology_paths, merge, read_tbox
from worldmodel.ontology import ontology_path
from worldmodel.ontology.compiler import SIT
from worldmodel.rdf.terms import RUN, instance_iri

FIRST = 5
"""Uid of the first station; the vehicles come before."""
N_INSTANCES, N_ATTRIBUTES, N_LEAVES, N_BRANCHES, N_ORIGINS = 100, 10, 20, 4, FIRST
N_STEPS = 10_001
STEP_S = 0.5
SIZES = (1_000, 10_000, 100_000)
REPEATS = 5
PATIENCE_S = 4.0
"""No comparison is repeated once it has taken this long."""
N_ASKED = 1_000
EX = "https://example.org/stations#"

Call = Callable[[], object]


class Heard(NamedTuple):
    """One observation that is to be recorded."""

    subject: int
    attribute: int
    value: float
    time_s: float
    origin: int


def ontology() -> str:
    """A vocabulary: stations in branches in leaves, and attributes of 10,001 steps."""
    prefixes = {"ex": EX, "rm": "https://w3id.org/remoras/marine#", "owl": "http://www.w3.org/2002/07/owl#"}
    prefixes |= {"rdfs": "http://www.w3.org/2000/01/rdf-schema#", "xsd": str(XSD)}
    lines = [f"@prefix {name}: <{iri}> ." for name, iri in prefixes.items()]
    lines += ["ex:Station a owl:Class ."]
    lines += [f"ex:Branch{n} a owl:Class ; rdfs:subClassOf ex:Station ." for n in range(N_BRANCHES)]
    lines += [f"ex:Leaf{n} a owl:Class ; rdfs:subClassOf ex:Branch{n % N_BRANCHES} ." for n in range(N_LEAVES)]
    lines += [
        f"ex:level{n} a owl:DatatypeProperty ; rdfs:domain ex:Station ; rdfs:range xsd:double ; "
        f"rm:minimum 0 ; rm:maximum {(N_STEPS - 1) / 100} ; rm:resolution 0.01 ."
        for n in range(N_ATTRIBUTES)
    ]
    return "\n".join(lines)


def tbox_of_stations() -> TBox:
    """The core ontology with the vocabulary."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stations.ttl"
        path.write_text(ontology(), encoding="utf-8")
        return read_tbox(*core_ontology_paths(), ontology_path("bans"), path)


class Bench:
    """What all rows share: ontology, instances and observations, the same in every process."""

    def __init__(self) -> None:
        self.tbox = tbox_of_stations()
        leaves = [self.tbox.class_named(f"Leaf{n}").uid for n in range(N_LEAVES)]
        auv = self.tbox.class_named("AUV").uid
        self.instances = [Instance(n, auv, f"AUV0{n}") for n in range(FIRST)]
        self.stations = range(FIRST, FIRST + N_INSTANCES)
        self.instances += [Instance(uid, leaves[uid % N_LEAVES], f"station {uid}") for uid in self.stations]
        self.attributes = [self.tbox.attribute_named(f"level{n}").uid for n in range(N_ATTRIBUTES)]
        self.predicates = {uid: URIRef(self.tbox.attributes[uid].iri) for uid in self.attributes}
        rng = random.Random(13)
        slots = [(uid, attribute) for uid in self.stations for attribute in self.attributes]
        self.heard = [
            Heard(*slots[n % len(slots)], round(rng.randrange(N_STEPS) * 0.01, 2), n * STEP_S, rng.randrange(N_ORIGINS))
            for n in range(SIZES[-1])
        ]
        self.slots = slots
        gc.collect()
        gc.freeze()  # what is there already is not looked through in each collection

    def model(self) -> WorldModel:
        """An empty world model of origin 0."""
        return WorldModel(self.tbox, 0, self.instances, n_origins=N_ORIGINS)

    def recorded(self, heard: Sequence[Heard]) -> WorldModel:
        """A world model that has recorded all of it itself."""
        model = self.model()
        self.record_all(model, heard)
        return model

    @staticmethod
    def record_all(model: WorldModel, heard: Sequence[Heard]) -> None:
        """Record all of it, one by one."""
        record = model.record
        for subject, attribute, value, time_s, _ in heard:
            record(((subject, attribute, value),), time_s)

    def blocks(self, heard: Sequence[Heard], origins: Sequence[int] = range(N_ORIGINS)) -> list[Block]:
        """The blocks of each of ``origins`` in turn."""
        counts = dict.fromkeys(origins, 0)
        made = []
        for n, (subject, attribute, value, time_s, _) in enumerate(heard):
            origin = origins[n * len(origins) // len(heard)] if len(origins) == 2 else origins[n % len(origins)]
            made.append(Block(origin, counts[origin], time_s, (PropertyValue(subject, attribute, value),)))
            counts[origin] += 1
        return made

    def ban(self) -> Block:
        """Origin 3 bans origin 2, from the start."""
        return Block(3, 0, 0.0, (PropertyValue(2, self.tbox.attribute_named("bannedFrom").uid, 0.0),))

    def merged(self, blocks: Sequence[Block]) -> WorldModel:
        """A world model that has merged the blocks."""
        model = self.model()
        merge(model, blocks)
        return model

    def triples(self, heard: Sequence[Heard]) -> Graph:
        """The observations as six triples each in rdflib's Memory store, as a user of rdflib would write them."""
        graph = Graph()
        instances = [instance_iri(instance.uid) for instance in self.instances]
        add = graph.add
        for n, (subject, attribute, value, time_s, origin) in enumerate(heard):
            fact = URIRef(f"{RUN}fact-{origin}-{n}-0")
            add((instances[subject], SIT.hasPropertyValue, fact))
            add((fact, RDF.type, SIT.PropertyValue))
            add((fact, SIT.ofAttribute, self.predicates[attribute]))
            add((fact, SIT.dataValue, Literal(value, datatype=XSD.double)))
            add((fact, SIT.timestamp, Literal(time_s, datatype=XSD.double)))
            add((fact, SIT.origin, instances[origin]))
        return graph

    def index(self, heard: Sequence[Heard]) -> object:
        """The observations in plain dicts: by name of the block, and by slot; nothing is checked."""
        blocks: dict[tuple[int, int], Heard] = {}
        slots: dict[tuple[int, int], list[tuple[float, int, float]]] = {}
        for n, fact in enumerate(heard):
            blocks[fact.origin, n] = fact
            slots.setdefault((fact.subject, fact.attribute), []).append((fact.time_s, fact.origin, fact.value))
        return blocks, slots


def best_of(*calls: Call, repeats: int = REPEATS, patience_s: float = PATIENCE_S) -> list[float]:
    """The least CPU seconds of each call, measured in turn."""
    best = [float("inf")] * len(calls)
    spent_s = 0.0
    for _ in range(repeats):
        for n, call in enumerate(calls):
            gc.collect()
            began = time.process_time()
            kept = call()
            taken_s = time.process_time() - began
            del kept
            best[n] = min(best[n], taken_s)
            spent_s += taken_s
        if spent_s > patience_s:
            break
    return best


def recording(bench: Bench) -> list[dict[str, Any]]:
    """Checked recording against rdflib's Memory store and against plain dicts."""
    rows = []
    for size in SIZES:
        heard = bench.heard[:size]
        record_s, index_s = best_of(lambda h=heard: bench.recorded(h), lambda h=heard: bench.index(h))  # type: ignore[misc]
        (graph_s,) = best_of(lambda h=heard: bench.triples(h))  # type: ignore[misc]
        rate, graph_rate, index_rate = size / record_s, size / graph_s, size / index_s
        rows += [
            row(f"record, {size}", rate, "1/s", "rdflib Memory", graph_rate, rate / graph_rate, ">= 20"),
            row(f"plain dict over record, {size}", rate, "1/s", "plain dict", index_rate, index_rate / rate, "<= 6"),
        ]
    return rows


def _latest_in(graph: Graph, instance: Node, predicate: Node) -> tuple[float, Node] | None:
    """The newest value of a slot in a Memory store."""
    newest: tuple[float, Node] | None = None
    for fact in graph.objects(instance, SIT.hasPropertyValue):
        if (fact, SIT.ofAttribute, predicate) in graph:
            time_s = graph.value(fact, SIT.timestamp).toPython()  # type: ignore[union-attr]
            if newest is None or time_s > newest[0]:
                newest = (time_s, fact)
    return newest


def _latest_in_memory_s(bench: Bench, asked: Sequence[tuple[int, int]]) -> float:
    """CPU seconds for the newest value of a slot in a Memory store of all observations."""
    graph = bench.triples(bench.heard)
    terms = [(instance_iri(subject), bench.predicates[attribute]) for subject, attribute in asked]
    (taken_s,) = best_of(lambda: [_latest_in(graph, *term) for term in terms], repeats=3)
    return taken_s / len(terms)


def latest(bench: Bench) -> list[dict[str, Any]]:
    """The newest value of a slot, with the newest half of all values banned too."""
    rng = random.Random(14)
    asked = [rng.choice(bench.slots) for _ in range(N_ASKED)]

    def asking(model: WorldModel) -> Call:
        def ask() -> None:
            answer = model.latest
            for _ in range(20):
                for subject, attribute in asked:
                    answer(subject, attribute)

        return ask

    small, large = (bench.recorded(bench.heard[:size]) for size in (SIZES[0], SIZES[-1]))
    small_s, large_s = (total_s / (20 * N_ASKED) for total_s in best_of(asking(small), asking(large), repeats=9))
    graph_s = _latest_in_memory_s(bench, asked[:100])
    rows = [
        row("latest, 100000", large_s * 1e6, "us", "rdflib Memory", graph_s * 1e6, graph_s / large_s, ">= 300"),
        row("latest, growth", large_s * 1e6, "us", "at 1000", small_s * 1e6, large_s / small_s, "<= 1.3"),
    ]
    models = []
    for size in (SIZES[0] * 2, SIZES[-1]):
        model = bench.merged([*bench.blocks(bench.heard[:size], (1, 2)), bench.ban()])
        models.append(model)
    for subject, attribute in asked:
        newest = models[1].latest(subject, attribute)
        if newest is None or newest.origin != 1:
            raise AssertionError(f"latest of {subject}, {attribute} is {newest}: origin 2 is banned")
    small_s, large_s = (total_s / (20 * N_ASKED) for total_s in best_of(*map(asking, models), repeats=9))
    rows.append(
        row("latest with a ban, growth", large_s * 1e6, "us", "at 2000", small_s * 1e6, large_s / small_s, "<= 1.3")
    )
    return rows


def memory(bench: Bench) -> list[dict[str, Any]]:
    """Bytes that an observation takes once it is recorded, without what an empty world model takes."""
    rows = []
    for size in SIZES:
        model = bench.model()
        gc.collect()
        tracemalloc.start()
        bench.record_all(model, bench.heard[:size])
        gc.collect()
        per_one = tracemalloc.get_traced_memory()[0] / size
        tracemalloc.stop()
        del model
        rows.append(row(f"size of an observation, {size}", per_one, "B", "limit", 400.0, per_one / 400.0, "<= 1"))
    return rows


def merging(bench: Bench) -> list[dict[str, Any]]:
    """Merging what others recorded, against recording it."""
    heard = bench.heard[:10_000]
    blocks = bench.blocks(heard, (1, 2, 3, 4))
    merge_s, record_s = best_of(lambda: bench.merged(blocks), lambda: bench.recorded(heard))
    per_s = len(heard) / merge_s, len(heard) / record_s
    return [row("merge, 10000", per_s[0], "1/s", "record", per_s[1], merge_s / record_s, "<= 1")]


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    bench = Bench()
    parts = (recording, latest, memory, merging)
    return [entry for part in parts for entry in part(bench)]
