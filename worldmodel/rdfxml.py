"""Ontologies as RDF/XML, for tools that read no Turtle, and the catalogue by which tools find imports on disk.

    python -m worldmodel.rdfxml FOLDER ...

writes beside each Turtle file of the folders the same ontology as RDF/XML, named by the end of its IRI, where owlready2
looks for it (``owlready2.onto_path``), and ``catalog-v001.xml``, which Protege reads. Without a folder it is that of
the core ontology. The text is a function of the triples alone: a file changes if, and only if, its ontology does.
"""

import os
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from rdflib import OWL, RDF, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.compare import isomorphic
from rdflib.term import Node

from worldmodel.errors import OntologyError
from worldmodel.owl import ONTOLOGY_FOLDER

CATALOGUE = "catalog-v001.xml"
_CATALOGUE_NAMESPACE = "urn:oasis:names:tc:entity:xmlns:xml:catalog"
_RDF = f"{{{RDF}}}"
_LANGUAGE = "{http://www.w3.org/XML/1998/namespace}lang"


def rdf_xml(graph: Graph) -> str:
    """Return a graph as RDF/XML, the ontology first, then by IRI; nodes without a name stand where they are used.

    Raises ValueError if such a node is used twice, or within itself: then it cannot stand where it is used.
    """
    for prefix, namespace in graph.namespaces():
        if not re.fullmatch(r"ns\d+", prefix):
            ElementTree.register_namespace(prefix, str(namespace))
    root = Element(f"{_RDF}RDF")
    for subject in sorted(graph.subjects(unique=True), key=lambda term: _rank(graph, term)):
        if isinstance(subject, URIRef) or (None, None, subject) not in graph:
            root.append(_described(graph, subject))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode", xml_declaration=False)
    text = f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'
    if not isomorphic(Graph().parse(data=text, format="xml"), graph):
        raise ValueError("a node without a name is used twice, or within itself; allowed: once")
    return text


def write_rdfxml(folder: Path) -> list[Path]:
    """Write every ontology of a folder as RDF/XML, and its catalogue.

    Args:
        folder: with Turtle files, each with one owl:Ontology.

    Returns:
        The files that were written.

    Raises:
        OntologyError: a file is no Turtle, has not one owl:Ontology, or cannot be written as RDF/XML.
    """
    entries: list[tuple[str, str]] = []
    texts: dict[Path, str] = {}
    faults = []
    for path in sorted(folder.glob("*.ttl")):
        try:
            graph = Graph().parse(path, format="turtle")
            (iri,) = graph.subjects(RDF.type, OWL.Ontology)
            texts[folder / f"{str(iri).rsplit('/', 1)[-1]}.rdf"] = rdf_xml(graph)
        except Exception as error:  # rdflib's parsers raise whatever a broken text leads them to
            reason = " ".join(str(error).split())
            faults.append(f"{path}: cannot be written as RDF/XML: {reason}; allowed: Turtle with one owl:Ontology")
            continue
        entries += [(str(name), path.name) for name in (iri, graph.value(iri, OWL.versionIRI)) if name is not None]
    if faults:
        raise OntologyError(faults)
    texts[folder / CATALOGUE] = _catalogue(folder, entries)
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
    return list(texts)


def main(arguments: Sequence[str]) -> int:
    """Write the ontologies of the folders that are named; returns the exit code."""
    try:
        for folder in [Path(name) for name in arguments] or [ONTOLOGY_FOLDER]:
            for path in write_rdfxml(folder):
                print(path)
    except OntologyError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _tag(iri: Node) -> str:
    namespace, name = re.fullmatch(r"(.*[#/])([^#/]+)", str(iri)).groups()  # type: ignore[union-attr]
    return f"{{{namespace}}}{name}"


def _rank(graph: Graph, term: Node) -> tuple[int, str]:
    """Order ontologies before named terms, and those before nodes without a name, which their content orders."""
    if isinstance(term, (URIRef, Literal)):
        return (0 if (term, RDF.type, OWL.Ontology) in graph else 1, term.n3())
    ranked = sorted((str(predicate), _rank(graph, target)) for predicate, target in graph.predicate_objects(term))
    return 2, repr(ranked)


def _described(graph: Graph, subject: Node) -> Element:
    """Return the element of a node with all that is said of it."""
    kinds = sorted(graph.objects(subject, RDF.type), key=str)
    element = Element(_tag(kinds[0]) if kinds else f"{_RDF}Description")
    if isinstance(subject, URIRef):
        element.set(f"{_RDF}about", str(subject))
    for kind in kinds[1:]:
        SubElement(element, f"{_RDF}type", {f"{_RDF}resource": str(kind)})
    statements = ((p, _rank(graph, o), o) for p, o in graph.predicate_objects(subject) if p != RDF.type)
    for predicate, _, target in sorted(statements, key=lambda each: (str(each[0]), each[1])):
        _state(graph, SubElement(element, _tag(predicate)), target)
    return element


def _state(graph: Graph, element: Element, target: Node) -> None:
    """Fill the element of a property with its value."""
    if isinstance(target, Literal):
        element.text = str(target)
        if target.language:
            element.set(_LANGUAGE, target.language)
        if target.datatype is not None:
            element.set(f"{_RDF}datatype", str(target.datatype))
    elif isinstance(target, URIRef):
        element.set(f"{_RDF}resource", str(target))
    elif (members := list(_members(graph, target))) and not any(isinstance(each, Literal) for each in members):
        element.set(f"{_RDF}parseType", "Collection")
        for member in members:
            named = isinstance(member, URIRef)
            element.append(
                Element(f"{_RDF}Description", {f"{_RDF}about": str(member)}) if named else _described(graph, member)
            )
    else:
        element.append(_described(graph, target))


def _members(graph: Graph, node: Node) -> Iterator[Node]:
    """Yield the members of a list; nothing if the node is none."""
    if (node, RDF.first, None) in graph:
        yield from Collection(graph, node)


def _catalogue(folder: Path, entries: Sequence[tuple[str, str]]) -> str:
    lines = [f'  <uri name="{name}" uri="{file}"/>' for name, file in entries]
    if folder.resolve() != ONTOLOGY_FOLDER.resolve():
        core = Path(os.path.relpath(ONTOLOGY_FOLDER / CATALOGUE, folder)).as_posix()
        lines.append(f'  <nextCatalog catalog="{core}"/>')
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<catalog prefer="public" xmlns="{_CATALOGUE_NAMESPACE}">',
            *lines,
            "</catalog>",
            "",
        ]
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
