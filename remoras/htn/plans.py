"""Plans: the tree of a decomposition, written flat, and the facts that it rests on."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from remoras.htn.domain import Task
from remoras.htn.facts import Key, Pattern, fits

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
        patterns: all patterns that the search asked for.
    """

    nodes: tuple[Node, ...]
    rests_on: frozenset[Any]
    patterns: frozenset[Pattern] = frozenset()

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The elementary tasks in order."""
        return tuple(Step(node.task, place) for place, node in enumerate(self.nodes) if node.method is None)

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """The elementary tasks in order, without their places."""
        return tuple(node.task for node in self.nodes if node.method is None)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """For every node the places of its subtasks."""
        found: list[list[int]] = [[] for _ in self.nodes]
        for place, node in enumerate(self.nodes):
            if node.parent != ROOT:
                found[node.parent].append(place)
        return tuple(map(tuple, found))

    def ancestors(self, place: int) -> Iterator[Node]:
        """The abstract tasks above a node, innermost first."""
        parent = self.nodes[place].parent
        while parent != ROOT:
            node = self.nodes[parent]
            yield node
            parent = node.parent

    def is_touched(self, keys: Collection[Key]) -> bool:
        """True if another plan may come out, now that the facts with these keys have changed."""
        return is_touched(self.rests_on, self.patterns, keys)

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
        rests_on, patterns: as of a plan.
        dead_ends: tasks at which the search turned back, each once, the first hundred.
    """

    task: Task
    rests_on: frozenset[Any]
    dead_ends: tuple[Task, ...]
    patterns: frozenset[Pattern] = frozenset()

    def is_touched(self, keys: Collection[Key]) -> bool:
        """True if there may be a plan, now that the facts with these keys have changed."""
        return is_touched(self.rests_on, self.patterns, keys)


def is_touched(rests_on: frozenset[Any], patterns: frozenset[Pattern], keys: Collection[Key]) -> bool:
    """True if one of ``keys`` is rested on or fits a pattern."""
    return not rests_on.isdisjoint(keys) or any(fits(pattern, key) for pattern in patterns for key in keys)
