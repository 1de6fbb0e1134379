"""Oxigraph as an independent RDF reader: terms as those of rdflib, and query results over written world models."""

from typing import Any

import pyoxigraph
from rdflib import BNode, Literal, URIRef
from rdflib.term import Node

from worldmodel import Knowledge
from worldmodel.ontology import graph_of
from worldmodel.rdf.writing import RdfFormat, prefixes_of, written


def term_of(term: Any) -> Node:
    if isinstance(term, pyoxigraph.NamedNode):
        return URIRef(term.value)
    if isinstance(term, pyoxigraph.BlankNode):
        return BNode(term.value)
    if term.language:
        return Literal(term.value, lang=term.language)
    datatype = term.datatype.value
    return Literal(term.value, datatype=None if datatype.endswith("#string") else datatype)


def n_rows(known: Knowledge, sparql: str) -> int:
    """Rows of a SELECT, or 1 if an ASK holds."""
    store, tbox = pyoxigraph.Store(), known.model.tbox
    ontology = graph_of(tbox).serialize(format="nt", encoding="utf-8")
    store.bulk_load(ontology, format=pyoxigraph.RdfFormat.N_TRIPLES)
    text = written({"": known}, RdfFormat.TRIG, header=False).encode()
    store.bulk_load(text, format=pyoxigraph.RdfFormat.TRIG)
    result = store.query(sparql, prefixes=prefixes_of(tbox), use_default_graph_as_union=True)
    return int(bool(result)) if isinstance(result, pyoxigraph.QueryBoolean) else len(list(result))
