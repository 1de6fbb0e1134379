"""Plans: the tree of a decomposition, written flat, and the facts that it rests on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from remoras.htn.domain import Task

ROOT = -1
"""The parent of a task that was asked for."""


class Node(NamedTuple):
    """A task of a plan, the method that was taken (None: the task is elementary), and the place of the task above."""

    task: Task
    method: str | None
    parent: int


class Step(NamedTuple):
    """An elementary task of a plan, and its place among the nodes."""

    task: Task
    place: int


@dataclass(frozen=True)
class Plan:
    """A decomposition of the tasks asked for.

    Attributes:
        nodes: every task, each before its subtasks and these in order, so that the elementary ones stand in the order
            of execution. A task whose method has no subtasks is here too. Ancestors are shared, not copied.
        rests_on: keys of all facts that the search looked up.
    """

    nodes: tuple[Node, ...]
    rests_on: frozenset[Any]

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """The elementary tasks in order."""
        return tuple(node.task for node in self.nodes if node.method is None)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """For every node the places of its subtasks."""
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
    """No decomposition of the tasks exists.

    Attributes:
        task: the first of the tasks asked for.
        rests_on: as of a plan.
    """

    task: Task
    rests_on: frozenset[Any]
