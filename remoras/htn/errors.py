"""Error messages of the search."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from remoras.errors import PlanningError
from remoras.htn.domain import Domain, Method, Task

MAX_CHAIN = 8
"""Maximum number of tasks shown of a chain."""


def unknown_task(task: Task, domain: Domain) -> PlanningError:
    """Return the error for a task that is neither elementary nor abstract."""
    return PlanningError(f"task {task} is not in the domain, which has: {', '.join(domain.tasks())}")


def wrong_subtasks(method: Method, task: Task, subtasks: Any) -> PlanningError:
    """Return the error for ``subtasks`` that are no tasks, or undeclared."""
    if isinstance(subtasks, list | tuple) and all(isinstance(subtask, Task) for subtask in subtasks):
        undeclared = sorted({subtask.name for subtask in subtasks} - set(method.uses or ()))
        return PlanningError(
            f"method {method.name!r} of task {task} uses {', '.join(undeclared)}, and declares only: "
            f"{', '.join(method.uses or ()) or 'nothing'}"
        )
    return PlanningError(
        f"method {method.name!r} of task {task} must return a list of tasks, or an iterator over such lists, "
        f"not {subtasks!r}"
    )


def endless(tasks: Sequence[Task], max_expansions: int, loop: Sequence[Task], chain: Sequence[Task]) -> PlanningError:
    """Return the error for an exhausted limit, with the recursion found or the last chain."""
    again = next((i for i in range(len(chain) - 2, -1, -1) if chain[i].name == chain[-1].name), None) if chain else None
    if loop:
        hint = f"; endless recursion without any change: {_arrows(loop)}"
    elif again is not None:
        hint = f"; recursion: {_arrows(chain[again:])}, {len(chain)} levels deep"
    else:
        hint = f"; the search stood at {_arrows(chain)}" if chain else ""
    return PlanningError(f"no plan for {', '.join(map(str, tasks))} within {max_expansions} expansions{hint}")


def _arrows(chain: Sequence[Task]) -> str:
    names = [str(task) for task in chain]
    if len(names) > MAX_CHAIN:
        names[MAX_CHAIN // 2 : -MAX_CHAIN // 2] = ["..."]
    return " > ".join(names)
