"""RDF export of the knowledge of vehicles. Named graphs are the origins for one vehicle, else the vehicles."""

from __future__ import annotations

from pathlib import Path

from visualisation.exports import Counts
from visualisation.exports.voyage import Voyage
from worldmodel.rdf.writing import RdfFormat, written


def write(voyage: Voyage, target: Path) -> Counts:
    """Write one file, and count the facts known to each vehicle; see ``Writer``."""
    known = voyage.results.knowledge(*voyage.selection)
    text = written(known, RdfFormat(voyage.format))
    target.write_text(text, encoding="utf-8", newline="\n")
    return {name: sum(len(block.facts) for block in own.model.blocks()) for name, own in known.items()}
