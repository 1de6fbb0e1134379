"""World models asked in SPARQL.

rdflib answers over the world model itself and copies nothing.
"""

import re
from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache
from itertools import islice
from typing import Any

from rdflib import Literal, URIRef
from rdflib.plugins.sparql import prepareQuery
from rdflib.plugins.sparql.evaluate import evalQuery
from rdflib.plugins.sparql.sparql import Query
from rdflib.term import Node

from worldmodel.errors import QueryError, suggestion
from worldmodel.knowledge import Knowledge
from worldmodel.ontology import graph_of
from worldmodel.ontology.tbox import TBox
from worldmodel.rdf.terms import instance_uid
from worldmodel.rdf.view import as_dataset, as_graph
from worldmodel.rdf.writing import prefixes_of
from worldmodel.store import Store

QueryValue = str | float | bool | None
"""A value of a query's answer."""
Row = dict[str, Node]
_GRAPH = re.compile(r"\bGRAPH\b", re.IGNORECASE)
_GROUP_BY = re.compile(r"\bGROUP\s+BY\b", re.IGNORECASE)
_UNKNOWN_PREFIX = re.compile(r"Unknown namespace prefix : (\S*)")


def query(
    known: Store | Knowledge | Mapping[str, Store | Knowledge],
    sparql: str,
    most_rows: int | None = None,
) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    """Ask what one vehicle knows, or each of several, in SPARQL.

    The prefixes of the ontology files are bound, and ``sit:``, ``rm:`` and ``run:`` in any case. Several are asked one
    after the other: an aggregate is over the knowledge of one vehicle. For example, the roles of all vehicles, each
    with the time and the vehicle that said so::

        SELECT ?player ?role ?time_s ?by WHERE {
            ?player sit:hasPropertyValue ?fact .
            ?fact sit:ofAttribute rm:playsRole ; sit:linkValue ?role ; sit:timestamp ?time_s ; sit:origin ?by }

    Args:
        known: a world model, with or without receptions, or several by the names of their vehicles.
        sparql: a SELECT or ASK query.
        most_rows: at which it stops; None for all.

    Returns:
        The names of the columns, and the rows. For several models the first column is ``vehicle``. ASK gives the
        column ``answer``. Instances, vehicles among them, are given by their names, other IRIs as ``rm:Vehicle``,
        points as ``POINT (3.5 4.0)``; None stands for what is not bound.

    Raises:
        QueryError: the text is no such query, or it names a variable ``?vehicle`` for several models.
    """
    if not isinstance(known, Mapping):
        return _answer(_knowledge(known), sparql, most_rows)
    columns: tuple[str, ...] = ()
    rows: list[tuple[QueryValue, ...]] = []
    for vehicle, knowledge in known.items():
        left = None if most_rows is None else most_rows - len(rows)
        columns, answer = _answer(_knowledge(knowledge), sparql, left)
        if "vehicle" in columns:
            raise QueryError(
                "the variable ?vehicle is taken: the column 'vehicle' says whose world model a row is from; "
                "give the variable another name"
            )
        rows += [(vehicle, *row) for row in answer]
    return ("vehicle", *columns), rows


def _knowledge(known: Store | Knowledge) -> Knowledge:
    return known if isinstance(known, Knowledge) else Knowledge(known)


def _answer(
    known: Knowledge, sparql: str, most_rows: int | None
) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    tbox = known.model.tbox
    prepared = _prepared(tbox, sparql)
    columns, rows = _rows(known, prepared, sparql, most_rows)
    shown = _Shown(known.model)
    return columns, [tuple(shown.value(row.get(name)) for name in columns) for row in rows]


@lru_cache(maxsize=64)
def _prepared(tbox: TBox, sparql: str) -> Query:
    """A query, parsed; raises QueryError if it is none."""
    prefixes = prefixes_of(tbox)
    try:
        prepared = prepareQuery(sparql, initNs=prefixes)
    except Exception as error:  # rdflib's parser raises whatever a query leads it to
        raise _fault(error, prefixes) from error
    kind = prepared.algebra.name.removesuffix("Query").upper()
    if kind not in {"SELECT", "ASK"}:
        raise QueryError(f"the query is a {kind}; allowed: SELECT or ASK")
    if prepared.algebra.get("datasetClause") or _asks_others(prepared.algebra):
        raise QueryError(
            "the query has FROM or SERVICE; allowed: what asks the world models alone, and fetches nothing"
        )
    return prepared


def _asks_others(part: Any) -> bool:
    """True if a part of a query asks another server."""
    if isinstance(part, Mapping):
        return getattr(part, "name", "") == "ServiceGraphPattern" or any(map(_asks_others, part.values()))
    return isinstance(part, list | tuple) and any(map(_asks_others, part))


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


def _rows(known: Knowledge, prepared: Query, sparql: str, most_rows: int | None) -> tuple[tuple[str, ...], list[Row]]:
    try:
        # rdflib's data set costs a little more than its graph
        result = evalQuery(as_dataset(known) if _GRAPH.search(sparql) else as_graph(known), prepared, {})
        if result["type_"] == "ASK":
            return ("answer",), [{"answer": Literal(bool(result["askAnswer"]))}]
        columns = tuple(str(variable) for variable in result.get("vars_") or ())
        bindings = islice(result["bindings"], most_rows)
        rows: list[Row] = [{str(name): term for name, term in binding.items()} for binding in bindings]
        # of nothing rdflib makes one empty group; SPARQL 1.1 has none then (section 11.2)
        return columns, [] if rows == [{}] and _GROUP_BY.search(sparql) else rows
    except Exception as error:  # rdflib's evaluator raises whatever a query leads it to
        raise _fault(error, prefixes_of(known.model.tbox)) from error


class _Shown:
    """Terms as values of an answer."""

    def __init__(self, model: Store) -> None:
        self._model = model
        self._names = graph_of(model.tbox).namespace_manager
        for prefix, namespace in prefixes_of(model.tbox).items():
            self._names.bind(prefix, namespace)

    def value(self, term: Node | None) -> QueryValue:
        """A plain value: a name, a number, a truth value, a text; None for nothing."""
        if isinstance(term, URIRef):
            uid = instance_uid(term)
            instance = None if uid is None else self._model.instance(uid)
            return instance.name if instance is not None else str(term.n3(self._names))
        value = term.toPython() if isinstance(term, Literal) else term
        if isinstance(value, Decimal):  # averages of whole numbers
            return float(value)
        return value if value is None or isinstance(value, (bool, int, float)) else str(value)
