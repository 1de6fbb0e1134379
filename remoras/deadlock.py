"""Deadlock: vehicles in a cycle each wait for the next, and no other vehicle will release one of them.

A wait ends once ``n_peers`` of its ``peers`` are free (k-of-n requests: Bracha, Toueg, Distributed Computing 2, 1987).
A vehicle so released is free itself. A vehicle that is never released is blocked: in a cycle, behind one, or because
too few able peers remain; the latter two are endless waits, but no deadlock.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple


class PeerWait(NamedTuple):
    """Wait for ``n_peers`` of ``peers`` since ``since_s``."""

    since_s: float
    peers: frozenset[str]
    n_peers: int


def deadlocks(waits: Mapping[str, PeerWait], free: Collection[str]) -> list[tuple[float, list[str]]]:
    """Return the cycles of waiting vehicles: time (s) since which all of them wait, and sorted names.

    ``free``: vehicles that wait for none and are able to help; the times are in order.

    >>> a, b = PeerWait(10.0, frozenset("BC"), 1), PeerWait(30.0, frozenset("AC"), 1)
    >>> deadlocks({"A": a, "B": b}, ""), deadlocks({"A": a, "B": b}, "C"), deadlocks({"A": a}, "")
    ([(30.0, ['A', 'B'])], [], [])
    """
    blocked, free = dict(waits), set(free)
    while released := {name for name, wait in blocked.items() if len(free & wait.peers) >= wait.n_peers}:
        free |= released
        blocked = {name: wait for name, wait in blocked.items() if name not in released}
    if len(blocked) < 2:
        return []
    import networkx as nx  # slow to load, and few runs have blocked vehicles

    graph = nx.DiGraph((name, peer) for name, wait in blocked.items() for peer in wait.peers & blocked.keys())
    cycles = [sorted(cycle) for cycle in nx.strongly_connected_components(graph) if len(cycle) > 1]
    return sorted((max(waits[name].since_s for name in cycle), cycle) for cycle in cycles)
