"""Plans: the decomposition tree in flat form, with the facts that it depends on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from remoras.htn.domain import Task

ROOT = -1
"""Parent index of a root task."""


class Node(NamedTuple):
    """Task of a plan, its method (None if elementary), and the index of its parent."""

    task: Task
    method: str | None
    parent: int


class Step(NamedTuple):
    """Elementary task of a plan, and its node index."""

    task: Task
    place: int


@dataclass(frozen=True)
class Plan:
    """Decomposition of the root tasks.

    Attributes:
        nodes: all tasks in preorder, so elementary tasks are in order of execution; tasks with an empty decomposition
            included.
        rests_on: keys of all facts read by the search.
    """

    nodes: tuple[Node, ...]
    rests_on: frozenset[Any]

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """Elementary tasks in order."""
        return tuple(node.task for node in self.nodes if node.method is None)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the subtasks, per node."""
        found: list[list[int]] = [[] for _ in self.nodes]
        for place, node in enumerate(self.nodes):
            if node.parent != ROOT:
                found[node.parent].append(place)
        return tuple(map(tuple, found))

    def __str__(self) -> str:
        depths: list[int] = []
        lines = []
        for node in self.nodes:
            depths.append(0 if node.parent == ROOT else depths[node.parent] + 1)
            lines.append(f"{'  ' * depths[-1]}{node.task}{'' if node.method is None else f' by {node.method}'}")
        return "\n".join(lines)


@dataclass(frozen=True)
class NoPlan:
    """Result of a search without a decomposition.

    Attributes:
        task: first root task.
        rests_on: keys of all facts read by the search.
    """

    task: Task
    rests_on: frozenset[Any]
