"""The decision: the best combination of activities (REMORAS, section V.B, "decisional module").

Activities that must be performed simultaneously come as an ``ActivitySet``. A combination holds at most one
activity of each type, holds sets whole, and is *maximal*: nothing that is motivated could still be added.
(Were it not, the single most motivated activity would have the best mean and nothing would ever be done at
its side.) The combination with the best mean motivation over its activities is the decision.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import networkx as nx

from remoras.activities import ActivitySet


def combinations(sets: Sequence[ActivitySet], motivated: int) -> tuple[tuple[int, ...], ...]:
    """All maximal combinations of the motivated sets, in ascending order of their indices.

    They are the maximal cliques of the graph whose edges join sets that can go together. A set that needs
    another one goes only with those that leave room for it, and falls out of a combination without it.

    Args:
        sets: what the vehicle could do.
        motivated: bit word over ``sets``: those with a motivation above zero.
    """
    indices = [index for index in range(len(sets)) if motivated >> index & 1]
    providers = _providers(sets, indices)
    graph = _compatible(sets, indices, providers)
    found = {
        tuple(sorted(one for one in clique if one not in providers or not providers[one].isdisjoint(clique)))
        for clique in nx.find_cliques(graph)
    }
    return tuple(sorted(one for one in found if not any(set(one) < set(other) for other in found)))


def _providers(sets: Sequence[ActivitySet], indices: Sequence[int]) -> dict[int, frozenset[int]]:
    """For each set that needs an activity of another one, the sets that have it."""
    return {
        needy: frozenset(one for one in indices if any(a.name == sets[needy].needs for a in sets[one].activities))
        for needy in indices
        if sets[needy].needs is not None
    }


def _compatible(sets: Sequence[ActivitySet], indices: Sequence[int], providers: Mapping[int, frozenset[int]]) -> Any:
    """The graph whose edges join sets that can go together; sets whose need nobody meets are left out."""
    types = {index: sets[index].types for index in indices}

    def leaves_room(needy: int, other: int) -> bool:
        """True unless ``other`` takes the place of every set that ``needy`` needs."""
        if needy not in providers or other in providers[needy]:
            return True
        return any(not types[other] & types[provider] for provider in providers[needy])

    graph: Any = nx.Graph()
    graph.add_nodes_from(index for index in indices if providers.get(index, True))
    graph.add_edges_from(
        (one, other)
        for one in graph
        for other in graph
        if one < other and not types[one] & types[other] and leaves_room(one, other) and leaves_room(other, one)
    )
    return graph


def best(candidates: Sequence[tuple[int, ...]], sizes: Sequence[int], motivations: Sequence[float]) -> tuple[int, ...]:
    """The combination with the best mean motivation over its activities; of equals the first.

    Args:
        candidates: combinations of set indices.
        sizes: number of activities in each set.
        motivations: motivation of each set; its activities share it.

    >>> best([(0,), (1, 2)], [2, 1, 1], [0.6, 0.9, 0.1])
    (0,)
    """
    winner: tuple[int, ...] = ()
    highest = 0.0
    for candidate in candidates:
        total = 0.0
        n = 0
        for index in candidate:
            total += sizes[index] * motivations[index]
            n += sizes[index]
        if n and total / n > highest:
            highest = total / n
            winner = candidate
    return winner
