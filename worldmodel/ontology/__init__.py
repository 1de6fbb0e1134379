"""Ontology: compilation of Turtle files to a ``TBox``, and description of its terms."""

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
    """Return the path of a shipped Turtle file; scenarios read it only if they use its terms."""
    return ONTOLOGY_FOLDER / f"{name}.ttl"


def core_ontology_paths() -> tuple[Path, ...]:
    """Return the core Turtle files, without alignments to other vocabularies."""
    return tuple(map(ontology_path, _CORE))


def read_tbox(*files: Path | Source) -> TBox:
    """Compile Turtle files, usually the core ontology and a mission's vocabulary; raises OntologyError with all faults.

    Uids follow the string order of the IRIs over all files, after ``type`` with uid 0. An added file can shift them, so
    all vehicles of a fleet must read the same files. Duplicates count once; equal texts return the same object.
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
    from worldmodel.ontology.compiler import compile_tbox

    return compile_tbox(tuple(dict.fromkeys(sources)))


def graph_of(tbox: TBox) -> "Graph":
    """Return the files of a TBox as one shared, read-only graph without individuals."""
    from worldmodel.ontology.compiler import terminology

    return terminology(tbox.sources)


class Term(NamedTuple):
    """Class or attribute; ``kind`` is such as ``class below Vehicle``, ``meaning`` the rdfs:comment."""

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
        made = []
        for entry, kind in kinds.items():
            meaning = str(parsed.graph.value(URIRef(entry.iri), RDFS.comment) or "")
            made.append(Term(entry.name, kind, meaning, Path(parsed.definitions[URIRef(entry.iri)][0]).stem))
        return sorted(made, key=lambda term: (order.index(term.file), term.name))

    parents = {c.uid: " and ".join(tbox.classes[uid].name for uid in c.parents) for c in tbox.classes}
    of_class: dict[OntologyClass | Attribute, str] = {
        c: "class" if parents[c.uid] == "Thing" else f"class below {parents[c.uid]}"
        for c in tbox.classes
        if c.iri != str(OWL.Thing)
    }
    of_attribute: dict[OntologyClass | Attribute, str] = {
        a: f"attribute of {tbox.classes[a.domain].name}: "
        f"{a.in_words if a.range_class is None else tbox.classes[a.range_class].name}"
        for a in tbox.attributes
        if a.uid != TYPE_UID
    }
    return (*terms(of_class), *terms(of_attribute))
