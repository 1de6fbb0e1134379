"""The way from Turtle files to a ``TBox``, and to their triples.

``worldmodel.turtle`` says which part of OWL is compiled. It loads rdflib, and is loaded for an ontology that
``worldmodel.kept`` does not have.
"""

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from worldmodel.errors import OntologyError
from worldmodel.tbox import Source, TBox

if TYPE_CHECKING:
    from rdflib import Graph


ONTOLOGY_FOLDER = Path(__file__).parent / "ontology"
_CORE = ("situation", "marine", "platforms", "equipment", "seabed", "work", "faults")


def core_ontology_paths() -> tuple[Path, ...]:
    """Return the Turtle files that every vehicle reads, without the alignments to other vocabularies."""
    return tuple(ONTOLOGY_FOLDER / f"{name}.ttl" for name in _CORE)


def formation_ontology_path() -> Path:
    """Return the Turtle file with the words for groups that are formed at sea; a mission that forms some lists it."""
    return ONTOLOGY_FOLDER / "formation.ttl"


def ontology_path(name: str) -> Path:
    """Return the Turtle file with words that are read only where a scenario uses what they are for.

    Args:
        name: of the file.
    """
    return ONTOLOGY_FOLDER / f"{name}.ttl"


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
        OntologyError: all faults at once, each with file, term, what is wrong and what is allowed.

    >>> tbox = read_tbox(*core_ontology_paths())
    >>> tbox.attribute_named("type").uid, tbox.class_named("ASV").uid < tbox.class_named("AUV").uid
    (0, True)
    """
    sources, faults = [], []
    for file in files:
        try:
            sources.append(_source(file))
        except (OSError, UnicodeDecodeError) as error:
            faults.append(f"{file}: cannot be read: {error}; allowed: a Turtle file in UTF-8")
    if faults:
        raise OntologyError(faults)
    return _compiled(tuple(dict.fromkeys(sources)))


def _source(file: Path | Source) -> Source:
    return file if isinstance(file, Source) else Source(str(file), Path(file).read_text(encoding="utf-8"))


def graph_of(tbox: TBox) -> "Graph":
    """Return the files of a TBox as one rdflib graph, without individuals; read it, do not write to it."""
    return _parsed(tbox.sources)


@lru_cache(maxsize=8)
def _compiled(sources: tuple[Source, ...]) -> TBox:
    from worldmodel.kept import keep, kept

    if (before := kept(sources)) is not None:
        return before
    from worldmodel.turtle import compile_tbox

    tbox = compile_tbox(sources)
    keep(tbox)
    return tbox


@lru_cache(maxsize=8)
def _parsed(sources: tuple[Source, ...]) -> "Graph":
    from rdflib import OWL, RDF

    from worldmodel.stated import stated_subjects
    from worldmodel.turtle import parse_turtle

    graph = parse_turtle(sources).graph
    for individual in list(stated_subjects(graph, set(graph.subjects(RDF.type, OWL.Class)))):
        graph.remove((individual, None, None))  # the world models have it, under the name of an instance
    return graph
