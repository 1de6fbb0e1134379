"""World models asked in SPARQL."""

from collections.abc import Mapping
from decimal import Decimal

from rdflib import Graph, Literal, URIRef
from rdflib.term import Node

from worldmodel.errors import QueryError
from worldmodel.store import Store
from worldmodel.terms import instance_uid
from worldmodel.view import as_graph

QueryValue = str | float | bool | None
"""A value of a query's answer."""


def query(models: Store | Mapping[str, Store], sparql: str) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    """Ask one world model, or each of several, in SPARQL.

    The prefixes of the ontology files are bound, and ``sit:``, ``rm:`` and ``run:`` in any case. Several world
    models are asked one after the other: an aggregate is over the knowledge of one vehicle. For example, the
    roles of all vehicles, each with the time and the vehicle that said so::

        SELECT ?player ?role ?time_s ?by WHERE {
            ?player sit:hasPropertyValue ?fact .
            ?fact sit:ofAttribute rm:playsRole ; sit:linkValue ?role ; sit:timestamp ?time_s ; sit:origin ?by }

    Args:
        models: a world model, or world models by the names of their vehicles.
        sparql: a SELECT or ASK query.

    Returns:
        The names of the columns, and the rows. For several models the first column is ``vehicle``. ASK gives the
        column ``answer``. Instances, vehicles among them, are given by their names, other IRIs as ``rm:Vehicle``,
        points as ``POINT (3.5 4.0)``; None stands for what is not bound.

    Raises:
        QueryError: the text is no such query, or it names a variable ``?vehicle`` for several models.
    """
    if isinstance(models, Store):
        return _answer(models, sparql)
    columns: tuple[str, ...] = ()
    rows: list[tuple[QueryValue, ...]] = []
    for vehicle, model in models.items():
        columns, found = _answer(model, sparql)
        if "vehicle" in columns:
            raise QueryError(
                "the variable ?vehicle is taken: the column 'vehicle' says whose world model a row is from; "
                "give the variable another name"
            )
        rows += [(vehicle, *row) for row in found]
    return ("vehicle", *columns), rows


def _answer(model: Store, sparql: str) -> tuple[tuple[str, ...], list[tuple[QueryValue, ...]]]:
    graph = as_graph(model)
    try:
        result = graph.query(sparql)
        if result.type not in {"SELECT", "ASK"}:
            raise QueryError(f"the query is a {result.type}; allowed: SELECT or ASK")
        if result.type == "ASK":
            return ("answer",), [(bool(result.askAnswer),)]
        columns = tuple(str(variable) for variable in result.vars or ())
        bindings = [{str(name): term for name, term in found.items()} for found in result.bindings]
        return columns, [tuple(_answered(model, graph, binding.get(name)) for name in columns) for binding in bindings]
    except QueryError:
        raise
    except Exception as error:  # rdflib's parser and evaluator raise whatever a query leads them to
        reason = " ".join(str(error).split())
        raise QueryError(
            f"the query cannot be answered: {reason}; allowed: a SPARQL 1.1 SELECT or ASK; the prefixes rm:, sit:, "
            "run:, rdf:, rdfs:, owl:, xsd: and those of the ontology files are known"
        ) from error


def _answered(model: Store, graph: Graph, term: Node | None) -> QueryValue:
    if isinstance(term, URIRef):
        uid = instance_uid(term)
        instance = None if uid is None else model.instance(uid)
        return instance.name if instance is not None else str(term.n3(graph.namespace_manager))
    value = term.toPython() if isinstance(term, Literal) else term
    if isinstance(value, Decimal):  # averages of whole numbers
        return float(value)
    return value if value is None or isinstance(value, (bool, int, float)) else str(value)
