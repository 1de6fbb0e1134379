"""SPARQL over world models."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from functools import lru_cache
from itertools import islice
from typing import Any

from rdflib import Literal, URIRef
from rdflib.paths import Path
from rdflib.plugins.sparql import prepareQuery
from rdflib.plugins.sparql.evaluate import evalQuery
from rdflib.plugins.sparql.sparql import Query
from rdflib.term import Node

from worldmodel.errors import QueryError, suggestion
from worldmodel.ontology import graph_of
from worldmodel.ontology.tbox import TBox
from worldmodel.rdf.terms import instance_uid
from worldmodel.rdf.triples import as_dataset, as_graph
from worldmodel.rdf.writing import iris_of, prefixes_of
from worldmodel.store import Store
from worldmodel.world_model import Knowledge

QueryValue = str | float | bool | None
_GRAPH = re.compile(r"\bGRAPH\b", re.IGNORECASE)
_GROUP_BY = re.compile(r"\bGROUP\s+BY\b", re.IGNORECASE)
_UNKNOWN_PREFIX = re.compile(r"Unknown namespace prefix : (\S*)")


def query(
    known: Store | Knowledge | Mapping[str, Store | Knowledge],
    sparql: str,
    most_rows: int | None = None,
) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    """Evaluate a SPARQL query on the knowledge of one vehicle, or of each of several; return column names and rows.

    The prefixes of the ontology files, ``sit:``, ``rm:`` and ``run:`` are bound. Several models, by vehicle name, are
    queried one by one and add the first column ``vehicle``; ASK gives the column ``answer``. Instances appear by name,
    other IRIs as ``rm:Vehicle``, points as ``POINT (3.5 4.0)``, unbound variables as None. Raises QueryError for any
    other text, or for a variable ``?vehicle`` with several models.
    """
    if not isinstance(known, Mapping):
        return _answer(known, sparql, most_rows)
    columns: tuple[str, ...] = ()
    rows: list[tuple[QueryValue, ...]] = []
    for vehicle, knowledge in known.items():
        left = None if most_rows is None else most_rows - len(rows)
        columns, answer = _answer(knowledge, sparql, left)
        if "vehicle" in columns:
            raise QueryError(
                "the variable ?vehicle is taken: the column 'vehicle' names the world model of a row; "
                "give the variable another name"
            )
        rows += [(vehicle, *row) for row in answer]
    return ("vehicle", *columns), rows


def _answer(
    known: Store | Knowledge, sparql: str, most_rows: int | None
) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    model = known.model if isinstance(known, Knowledge) else known
    prepared = _prepared(model.tbox, sparql)
    try:
        # A data set takes more time, and only GRAPH needs it.
        result = evalQuery(as_dataset(known) if _GRAPH.search(sparql) else as_graph(known), prepared, {})
        if result["type_"] == "ASK":
            return ("answer",), [(bool(result["askAnswer"]),)]
        columns = tuple(str(variable) for variable in result.get("vars_") or ())
        rows = [{str(name): term for name, term in row.items()} for row in islice(result["bindings"], most_rows)]
    except Exception as error:  # rdflib's evaluator raises many kinds of errors
        raise _fault(error, dict(prepared.prologue.namespace_manager.namespaces())) from error
    if rows == [{}] and _GROUP_BY.search(sparql):
        rows = []  # without solutions rdflib returns one empty group; SPARQL 1.1 has none (section 11.2)
    shown = _Shown(model)
    return columns, [tuple(shown.value(row.get(name)) for name in columns) for row in rows]


@lru_cache(maxsize=64)  # parsed once for all vehicles
def _prepared(tbox: TBox, sparql: str) -> Query:
    prefixes = prefixes_of(tbox)
    try:
        prepared = prepareQuery(sparql, initNs=prefixes)
    except Exception as error:  # rdflib's parser raises many kinds of errors
        raise _fault(error, prefixes) from error
    kind = prepared.algebra.name.removesuffix("Query").upper()
    if kind not in {"SELECT", "ASK"}:
        raise QueryError(f"the query is a {kind}; allowed: SELECT or ASK")
    parts = list(_parts(prepared.algebra))
    if prepared.algebra.get("datasetClause") or any(
        getattr(part, "name", "") == "ServiceGraphPattern" for part in parts
    ):
        raise QueryError(
            "the query has FROM or SERVICE; allowed: queries of the world models only, which load no other data"
        )
    asked = {str(part) for part in parts if isinstance(part, URIRef)}
    for prefix in ("rm", "sit"):
        known = {iri.removeprefix(prefixes[prefix]) for iri in iris_of(tbox)}
        for term in sorted(iri.removeprefix(prefixes[prefix]) for iri in asked if iri.startswith(prefixes[prefix])):
            if term not in known:
                raise QueryError(f"{prefix}:{term} is no term of the vocabulary{suggestion(term, known)}")
    return prepared


def _parts(part: Any) -> Iterator[Any]:
    yield part
    inner = part.values() if isinstance(part, Mapping) else vars(part).values() if isinstance(part, Path) else part
    for other in inner if not isinstance(inner, str) and isinstance(inner, Iterable) else ():
        yield from _parts(other)


def _fault(error: Exception, prefixes: Mapping[str, str]) -> QueryError:
    reason = " ".join(str(error).split())
    known = ", ".join(f"{prefix}:" for prefix in sorted(prefixes))
    if unknown := _UNKNOWN_PREFIX.search(reason):
        return QueryError(
            f"the prefix '{unknown[1]}:' is unknown; known: {known}{suggestion(unknown[1], prefixes)}; "
            "or declare it: PREFIX name: <IRI>"
        )
    return QueryError(
        f"the query cannot be answered: {reason}; allowed: a SPARQL 1.1 SELECT or ASK; prefixes known: {known}"
    )


class _Shown:
    def __init__(self, model: Store) -> None:
        self._model = model
        self._names = graph_of(model.tbox).namespace_manager
        for prefix, namespace in prefixes_of(model.tbox).items():
            self._names.bind(prefix, namespace)

    def value(self, term: Node | None) -> QueryValue:
        if isinstance(term, URIRef):
            uid = instance_uid(term)
            instance = None if uid is None else self._model.instance(uid)
            return instance.name if instance is not None else str(term.n3(self._names))
        value = term.toPython() if isinstance(term, Literal) else term
        if isinstance(value, Decimal):  # averages of whole numbers
            return float(value)
        return value if value is None or isinstance(value, (bool, int, float)) else str(value)
