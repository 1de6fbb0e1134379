"""The terms of an ontology in words, for the pages and commands that list them."""

from pathlib import Path
from typing import NamedTuple

from worldmodel.owl import graph_of
from worldmodel.tbox import TYPE_UID, Attribute, TBox


class Term(NamedTuple):
    """A class or an attribute in words.

    Attributes:
        name: the local part of its IRI.
        kind: what it is: ``class below Vehicle``, or ``attribute of Vehicle: 0 to 20 m/s, steps of 0.05``.
        meaning: its definition, empty if no file has one.
        file: the name of the file that declares it, without folder and ending.
    """

    name: str
    kind: str
    meaning: str
    file: str


def terms_of(tbox: TBox) -> tuple[Term, ...]:
    """Return the terms of an ontology: classes by file and name, then attributes."""
    from rdflib import OWL, RDF, RDFS, Graph, URIRef

    graph = graph_of(tbox)
    file_of: dict[str, str] = {}
    for source in tbox.sources:
        declared = Graph().parse(data=source.text, format="turtle")
        for subject in declared.subjects(RDF.type, None):
            file_of[str(subject)] = Path(source.path).stem

    def term(name: str, iri: str, kind: str) -> Term:
        return Term(name, kind, str(graph.value(URIRef(iri), RDFS.comment) or ""), file_of[iri])

    parents = {c.uid: " and ".join(tbox.classes[uid].name for uid in c.parents) for c in tbox.classes}
    classes = [
        term(c.name, c.iri, "class" if parents[c.uid] == "Thing" else f"class below {parents[c.uid]}")
        for c in tbox.classes
        if c.iri != str(OWL.Thing)
    ]
    attributes = [
        term(a.name, a.iri, f"attribute of {tbox.classes[a.domain].name}: {_values(tbox, a)}")
        for a in tbox.attributes
        if a.uid != TYPE_UID
    ]
    files = list(dict.fromkeys(Path(source.path).stem for source in tbox.sources))
    order = {name: place for place, name in enumerate(files)}
    return (
        *sorted(classes, key=lambda term: (order[term.file], term.name)),
        *sorted(attributes, key=lambda attribute: (order[attribute.file], attribute.name)),
    )


def _values(tbox: TBox, attribute: Attribute) -> str:
    """What an attribute may be."""
    if attribute.range_class is not None:
        return tbox.classes[attribute.range_class].name
    if attribute.symbols:
        return " or ".join(attribute.symbols)
    if attribute.most_bytes:
        return f"text of at most {attribute.most_bytes} bytes"
    ranges = [
        f"{field.minimum:g} to {field.maximum:g} {field.unit}".rstrip() + f", steps of {field.resolution:g}"
        for field in attribute.fields
    ]
    both = " east and north" if len(attribute.fields) > 1 else ""
    return "; ".join(dict.fromkeys(ranges)) + both if ranges else "true or false"
