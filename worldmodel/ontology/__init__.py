"""The ontology: from Turtle files to a ``TBox``, and its terms in words."""

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from worldmodel.errors import OntologyError
from worldmodel.ontology.tbox import TYPE_UID, Attribute, OntologyClass, Source, TBox

if TYPE_CHECKING:
    from rdflib import Graph

ONTOLOGY_FOLDER = Path(__file__).parent
__all__ = [
    "ONTOLOGY_FOLDER",
    "Term",
    "core_ontology_paths",
    "graph_of",
    "ontology_path",
    "read_tbox",
    "terms_of",
]
_CORE = ("situation", "marine", "platforms", "equipment", "seabed", "work", "faults")


def ontology_path(name: str) -> Path:
    """Return a shipped Turtle file, which is read only where a scenario uses the subject of its words.

    Args:
        name: of the file.
    """
    return ONTOLOGY_FOLDER / f"{name}.ttl"


def core_ontology_paths() -> tuple[Path, ...]:
    """Return the Turtle files that every vehicle reads, without the alignments to other vocabularies."""
    return tuple(map(ontology_path, _CORE))


def read_tbox(*files: Path | Source) -> TBox:
    """Compile Turtle files, usually those of the core ontology and a mission's own vocabulary.

    A vocabulary may add classes (subclasses of core classes, say), attributes and individuals. Each term is
    defined in one file: a file that redefines a class or an attribute of another is refused.

    Class uids follow the order of the IRIs, compared as strings, over all files together; attribute uids do
    so too, after ``type``, which has uid 0. They depend neither on the order of the files nor on the order of
    the triples. A file whose IRIs sort before those of another therefore shifts the uids of the other; all
    vehicles of a fleet must read the same files.

    Args:
        files: Turtle files in UTF-8, or the text of such, in any order; a file given twice counts once.

    Returns:
        The tables; files with the same text give the same object.

    Raises:
        OntologyError: the faults, each with file, term, what is wrong and what is allowed.

    >>> tbox = read_tbox(*core_ontology_paths())
    >>> tbox.attribute_named("type").uid, tbox.class_named("ASV").uid < tbox.class_named("AUV").uid
    (0, True)
    """
    sources, faults = [], []
    for file in files:
        try:
            source = file if isinstance(file, Source) else Source(str(file), Path(file).read_text(encoding="utf-8"))
            sources.append(source)
        except (OSError, UnicodeDecodeError) as error:
            faults.append(f"{file}: cannot be read: {error}; allowed: a Turtle file in UTF-8")
    if faults:
        raise OntologyError(faults)
    return _compiled(tuple(dict.fromkeys(sources)))


def graph_of(tbox: TBox) -> "Graph":
    """Return the files of a TBox as one rdflib graph, without individuals; read it, do not write to it."""
    from worldmodel.ontology.compiler import terminology

    return terminology(tbox.sources)


@lru_cache(maxsize=8)
def _compiled(sources: tuple[Source, ...]) -> TBox:
    from worldmodel.ontology.compiler import compile_tbox

    return compile_tbox(sources)


class Term(NamedTuple):
    """A class or an attribute in words.

    Attributes:
        name: the local part of its IRI.
        kind: ``class below Vehicle``, or ``attribute of Vehicle: 0 to 20 m/s, steps of 0.05``.
        meaning: its definition, empty if no file has one.
        file: the name of the file that declares it, without folder and ending.
    """

    name: str
    kind: str
    meaning: str
    file: str


def terms_of(tbox: TBox) -> tuple[Term, ...]:
    """Return the terms of an ontology: classes by file and name, then attributes."""
    from rdflib import OWL, RDFS, URIRef

    from worldmodel.ontology.compiler import parse_turtle

    parsed = parse_turtle(tbox.sources)
    order = list(dict.fromkeys(Path(source.path).stem for source in tbox.sources))

    def terms(kinds: dict[OntologyClass | Attribute, str]) -> list[Term]:
        found = []
        for of, kind in kinds.items():
            meaning = str(parsed.graph.value(URIRef(of.iri), RDFS.comment) or "")
            found.append(Term(of.name, kind, meaning, Path(parsed.definitions[URIRef(of.iri)][0]).stem))
        return sorted(found, key=lambda term: (order.index(term.file), term.name))

    parents = {c.uid: " and ".join(tbox.classes[uid].name for uid in c.parents) for c in tbox.classes}
    of_class: dict[OntologyClass | Attribute, str] = {
        c: "class" if parents[c.uid] == "Thing" else f"class below {parents[c.uid]}"
        for c in tbox.classes
        if c.iri != str(OWL.Thing)
    }
    of_attribute: dict[OntologyClass | Attribute, str] = {
        a: f"attribute of {tbox.classes[a.domain].name}: {_values(tbox, a)}"
        for a in tbox.attributes
        if a.uid != TYPE_UID
    }
    return (*terms(of_class), *terms(of_attribute))


def _values(tbox: TBox, attribute: Attribute) -> str:
    """Return the values of an attribute in words."""
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
