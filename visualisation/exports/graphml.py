"""GraphML: who plays what at the end, who heard whom, and the plans at the end, a file each.

A graph whose table an older version did not write is left out.
"""

from __future__ import annotations

from pathlib import Path

from missions.graphs import heard_graph, organisation_graph, plan_graph, write_graphml
from visualisation.exports.formats import Counts
from visualisation.exports.voyage import Voyage


def write(voyage: Voyage, target: Path) -> Counts:
    """Make a folder with ``<graph>.graphml``; counts are nodes and edges. See ``formats.Writer``."""
    target.mkdir()
    has, results = voyage.results.has, voyage.results
    graphs = [organisation_graph(results)] if has("organisation") else []
    graphs += [heard_graph(results)] if has("packets") else []
    graphs += [plan_graph(results)] if has("plans") else []
    counts = {}
    for graph in graphs:
        name = graph.graph["name"]
        write_graphml(graph, target / f"{name}.graphml")
        counts[f"nodes of {name}"], counts[f"edges of {name}"] = len(graph), graph.size()
    return counts
