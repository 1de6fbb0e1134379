"""Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009 (linear bottleneck and linear sum assignment), here as matchings and flows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def assignment(costs_ms: Sequence[Sequence[int | None]]) -> dict[int, int]:
    """Row -> column so that as many rows as possible are assigned, the dearest pair is as cheap as possible, and
    then the sum is least; None forbids a pair. Equals fall the same way in every run.

    >>> assignment([[5, 9], [9, 14]])
    {0: 1, 1: 0}
    >>> assignment([[1, 1], [1, 1]])
    {0: 0, 1: 1}
    """
    import networkx as nx  # a tenth of a second to load, and few strategies need it

    pairs = [(cost, r, c) for r, row in enumerate(costs_ms) for c, cost in enumerate(row) if cost is not None]
    if not pairs:
        return {}
    n_columns = 1 + max(c for _, _, c in pairs)

    def matched(limit: int) -> int:
        graph: Any = nx.Graph()
        rows = [("row", r) for r in dict.fromkeys(r for cost, r, _ in pairs if cost <= limit)]
        graph.add_nodes_from(rows)
        graph.add_edges_from((("row", r), ("column", c)) for cost, r, c in pairs if cost <= limit)
        return len(nx.bipartite.hopcroft_karp_matching(graph, rows)) // 2

    limits = sorted({cost for cost, _, _ in pairs})
    most = matched(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if matched(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    graph: Any = nx.DiGraph()
    for cost, r, c in pairs:
        if cost <= limits[low]:
            graph.add_edge("source", ("row", r), capacity=1, weight=0)
            graph.add_edge(("column", c), "sink", capacity=1, weight=0)
            tie_break = r * (n_columns - 1 - c)  # least where lower rows have lower columns
            graph.add_edge(("row", r), ("column", c), capacity=1, weight=cost * 100_000 + tie_break)
    flows = nx.max_flow_min_cost(graph, "source", "sink")
    chosen = {r: c for cost, r, c in pairs if cost <= limits[low] and flows[("row", r)].get(("column", c), 0) == 1}
    return dict(sorted(chosen.items()))
