"""World models as RDF text: N-Triples, Turtle, TriG and JSON-LD.

The ontology is not written; a header imports it. In formats with named graphs, the default graph of a single vehicle
holds instances, types, names, current state and receptions, and ``run:conclusions`` the inferred triples.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from enum import StrEnum
from functools import lru_cache
from typing import Any, NamedTuple

from rdflib import OWL, RDF, RDFS, XSD, Literal, URIRef
from rdflib.term import Node

from worldmodel.ontology import graph_of
from worldmodel.ontology.compiler import RM, SIT
from worldmodel.ontology.tbox import TBox
from worldmodel.rdf.terms import RUN, instance_iri
from worldmodel.rdf.triples import CONCLUSIONS, Triple, Triples
from worldmodel.world_model import Knowledge

ESCAPED = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})
LOCAL = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_.-]*[A-Za-z0-9_-])?", re.ASCII)
"""Local names that need no escapes in Turtle."""


class RdfFormat(StrEnum):
    """RDF formats of a written world model."""

    TURTLE = "ttl"
    TRIG = "trig"
    JSON_LD = "jsonld"
    N_TRIPLES = "nt"

    @property
    def has_graphs(self) -> bool:
        """True if the format supports named graphs."""
        return self in (RdfFormat.TRIG, RdfFormat.JSON_LD)


class Graph(NamedTuple):
    """Triples to write, grouped by subject; ``name`` is None for the default graph."""

    name: URIRef | None
    triples: Iterable[Triple]


def written(known: Mapping[str, Knowledge], form: RdfFormat, header: bool = True) -> str:
    """Return the knowledge of vehicles as text; ``header`` adds the imported ontologies and the vehicle names.

    Named graphs, if any, are one per origin for a single vehicle, else one per vehicle; other formats write the union.
    """
    tbox = next(iter(known.values())).model.tbox
    graphs = list(_graphs(known) if form.has_graphs else _union(known))
    if header:
        graphs = [Graph(None, _header(tbox, known if form.has_graphs and len(known) > 1 else {})), *graphs]
    if form is RdfFormat.N_TRIPLES:
        names = _Names({})
        return "".join(line for graph in graphs for line in _lines(graph.triples, names))
    return (_json_ld if form is RdfFormat.JSON_LD else _turtle)(graphs, prefixes_of(tbox))


def iris_of(tbox: TBox) -> set[str]:
    """Return all IRIs in the ontology files."""
    return {str(term) for triple in graph_of(tbox) for term in triple if isinstance(term, URIRef)}


@lru_cache(maxsize=8)  # reads all triples of the ontology
def prefixes_of(tbox: TBox) -> Mapping[str, str]:
    """Return namespaces by prefix: of runs, RDF, OWL and the terms in the ontology files."""
    terms = iris_of(tbox)
    bound = {str(prefix): str(iri) for prefix, iri in graph_of(tbox).namespaces() if prefix}
    used = {prefix: iri for prefix, iri in bound.items() if any(term.startswith(iri) for term in terms)}
    own = {"run": str(RUN), "sit": str(SIT), "rm": str(RM)}
    return own | {"rdf": str(RDF), "rdfs": str(RDFS), "owl": str(OWL), "xsd": str(XSD)} | used


def _header(tbox: TBox, known: Mapping[str, Knowledge]) -> Iterator[Triple]:
    whole = URIRef(str(RUN).rstrip("/"))
    yield (whole, RDF.type, OWL.Ontology)
    ontologies = (iri for iri in graph_of(tbox).subjects(RDF.type, OWL.Ontology) if isinstance(iri, URIRef))
    for iri in sorted(ontologies):
        yield (whole, OWL.imports, iri)
    for vehicle, knowledge in known.items():
        yield (knowledge_iri(knowledge.model.owner), RDFS.label, Literal(vehicle))


def knowledge_iri(node: int) -> URIRef:
    """Return the graph name of the knowledge of a vehicle."""
    return RUN[f"knowledge-{node}"]


def _graphs(known: Mapping[str, Knowledge]) -> Iterator[Graph]:
    all_triples = list(map(Triples, known.values()))
    if len(all_triples) > 1:
        for triples in all_triples:
            yield Graph(knowledge_iri(triples.model.owner), triples.all())
        return
    yield Graph(None, all_triples[0].all(concluded=False))
    for origin in range(all_triples[0].model.n_origins):
        yield Graph(instance_iri(origin), all_triples[0].said_by(origin))
    yield Graph(CONCLUSIONS, all_triples[0].conclusions())


def _union(known: Mapping[str, Knowledge]) -> Iterator[Graph]:
    merged: dict[Node, dict[Triple, None]] = {}
    for knowledge in known.values():
        for triple in Triples(knowledge).all():
            merged.setdefault(triple[0], {})[triple] = None
    yield Graph(None, (triple for triples in merged.values() for triple in triples))


# Text --------------------------------------------------------------------------------------------


class _Names(dict[Node, str]):
    def __init__(self, prefixes: Mapping[str, str]) -> None:
        super().__init__()
        self._prefixes = tuple((namespace, prefix) for prefix, namespace in prefixes.items())
        self.used: dict[str, str] = {}

    def __missing__(self, term: Node) -> str:
        name = self[term] = self._literal(term) if isinstance(term, Literal) else self._iri(str(term))
        return name

    def _literal(self, literal: Literal) -> str:
        text = f'"{str(literal).translate(ESCAPED)}"'
        if literal.language:
            return f"{text}@{literal.language}"
        datatype = literal.datatype
        return text if datatype is None or datatype == XSD.string else f"{text}^^{self[datatype]}"

    def _iri(self, iri: str) -> str:
        for namespace, prefix in self._prefixes:
            if iri.startswith(namespace) and LOCAL.fullmatch(iri, len(namespace)):
                self.used[prefix] = namespace
                return f"{prefix}:{iri[len(namespace) :]}"
        return f"<{iri}>"


def _lines(triples: Iterable[Triple], names: _Names) -> Iterator[str]:
    for subject, predicate, target in triples:
        yield f"{names[subject]} {names[predicate]} {names[target]} .\n"


def _turtle(graphs: Iterable[Graph], prefixes: Mapping[str, str]) -> str:
    names = _Names(prefixes)
    text: list[str] = []
    for graph in graphs:
        sentences = list(_sentences(graph.triples, names))
        if graph.name is not None and sentences:
            sentences = [f"\n{names[graph.name]} {{", *sentences, "}\n"]
        text += sentences
    return "".join([*(f"@prefix {prefix}: <{names.used[prefix]}> .\n" for prefix in sorted(names.used)), *text])


def _sentences(triples: Iterable[Triple], names: _Names) -> Iterator[str]:
    before: Node | None = None
    for subject, predicate, target in triples:
        verb = "a" if predicate == RDF.type else names[predicate]
        if subject == before:
            yield f" ;\n    {verb} {names[target]}"
        else:
            yield f"{'' if before is None else ' .'}\n{names[subject]} {verb} {names[target]}"
        before = subject
    if before is not None:
        yield " .\n"


def _json_ld(graphs: Iterable[Graph], prefixes: Mapping[str, str]) -> str:
    names = _Names(prefixes)

    def named(iri: Node) -> str:
        return names[iri].removeprefix("<").removesuffix(">")

    def value(term: Node) -> dict[str, str]:
        if not isinstance(term, Literal):
            return {"@id": named(term)}
        kinds = {"@type": named(term.datatype)} if term.datatype else {}
        return {"@value": str(term), **kinds, **({"@language": term.language} if term.language else {})}

    whole: list[dict[str, Any]] = []
    for graph in graphs:
        nodes: dict[Node, dict[str, Any]] = {}
        for subject, predicate, target in graph.triples:
            node = nodes.setdefault(subject, {"@id": named(subject)})
            if predicate == RDF.type:
                node.setdefault("@type", []).append(named(target))
            else:
                node.setdefault(named(predicate), []).append(value(target))
        if graph.name is None:
            whole += nodes.values()
        elif nodes:
            whole.append({"@id": named(graph.name), "@graph": list(nodes.values())})
    return (
        json.dumps({"@context": dict(sorted(names.used.items())), "@graph": whole}, indent=1, ensure_ascii=False) + "\n"
    )
