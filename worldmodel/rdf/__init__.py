"""World model as RDF: graphs, SPARQL and files; ``worldmodel`` does not import it."""

from worldmodel.rdf.sparql import query
from worldmodel.rdf.triples import as_dataset, as_graph
from worldmodel.rdf.writing import RdfFormat, written

__all__ = ["RdfFormat", "as_dataset", "as_graph", "query", "written"]
