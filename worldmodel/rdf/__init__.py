"""World model as RDF: triples from its index, SPARQL, and files.

``as_graph`` and ``as_dataset`` are rdflib views without copies, ``query`` evaluates SPARQL, ``written`` returns text.
``worldmodel`` itself does not import this package, so a fleet runs without it.
"""

from worldmodel.rdf.sparql import query
from worldmodel.rdf.view import as_dataset, as_graph
from worldmodel.rdf.writing import RdfFormat, canonical_items, written

__all__ = ["RdfFormat", "as_dataset", "as_graph", "canonical_items", "query", "written"]
