"""World model as RDF: graphs, SPARQL, and files.

``as_graph`` and ``as_dataset`` return new rdflib graphs, ``query`` evaluates SPARQL, ``written`` returns text.
``worldmodel`` itself does not import this package, so a fleet runs without it.
"""

from worldmodel.rdf.sparql import query
from worldmodel.rdf.triples import as_dataset, as_graph
from worldmodel.rdf.writing import RdfFormat, canonical_items, written

__all__ = ["RdfFormat", "as_dataset", "as_graph", "canonical_items", "query", "written"]
