"""What one vehicle knows as RDF: triples answered from the index of its world model, SPARQL over them, and files.

``query`` asks, ``as_graph`` and ``as_dataset`` give rdflib a view that copies nothing, ``written`` gives text.
Nothing in ``worldmodel`` itself imports this package, so a fleet runs without it.
"""

from worldmodel.rdf.sparql import query
from worldmodel.rdf.view import as_dataset, as_graph
from worldmodel.rdf.writing import RdfFormat, canonical_items, written

__all__ = ["RdfFormat", "as_dataset", "as_graph", "canonical_items", "query", "written"]
