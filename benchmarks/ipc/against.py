"""Actions per second on problems after the International Planning Competition, against GTPyhop."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from benchmarks.ipc import rover_translation, translations
from benchmarks.ipc.problems import KINDS, NUMBERS, problem
from benchmarks.measuring import least_s, row
from remoras.htn import Plan, plan
from remoras.htn.hddl import Problem

REPEATS = 12
"""How often the two take turns."""
RECURSION = 50_000
IDLE = frozenset({"skip", "stay"})
"""Actions without effects, which GTPyhop leaves out of its plans; they are not counted for us either."""
TRANSLATIONS: dict[str, Callable[[Any, Problem], tuple[Any, translations.Todo]]] = {
    "towers": translations.towers,
    "transport": translations.transport,
    "satellite": translations.satellite,
    "rover": rover_translation.rover,
    "childsnack": translations.childsnack,
}


def our_plan(read: Problem) -> list[tuple[str, ...]]:
    """The actions of our plan that have effects.

    Raises:
        AssertionError: there is no plan.
    """
    found = plan(read.domain, read.facts, read.tasks, goal=read.goal)
    if not isinstance(found, Plan):
        raise AssertionError(f"no plan for {', '.join(map(str, read.tasks))}")
    return [(task.name, *task.args) for task in found.tasks if task.name not in IDLE]


def _one(gtpyhop: Any, kind: str, number: int) -> tuple[int, float, float]:
    """The actions of one problem, and CPU seconds of our plan and of theirs, in turn, the best of some repeats."""
    read = problem(kind, number)
    with contextlib.redirect_stdout(io.StringIO()):
        gtpyhop.Domain(kind)
    state, todo = TRANSLATIONS[kind](gtpyhop, read)
    actions = our_plan(read)
    theirs = gtpyhop.find_plan(state, todo)
    if list(getattr(theirs, "plan", theirs)) != actions:
        raise AssertionError(f"{kind} {number}: the plans differ")
    ours = partial(plan, read.domain, read.facts, read.tasks, goal=read.goal)
    ours_s, theirs_s = least_s(ours, lambda: gtpyhop.find_plan(state, todo), repeats=REPEATS)
    return len(actions), ours_s, theirs_s


def against(gtpyhop: Any) -> list[dict[str, Any]]:
    """A benchmark row for each kind, over its five problems; the plans are the same, action for action."""
    found = []
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(RECURSION)
    for kind in KINDS:
        n_actions, ours_s, theirs_s = map(sum, zip(*(_one(gtpyhop, kind, number) for number in NUMBERS), strict=True))
        found.append(row(f"htn, ipc {kind}", n_actions / ours_s, "1/s", "GTPyhop", n_actions / theirs_s))
    sys.setrecursionlimit(limit)
    return found
