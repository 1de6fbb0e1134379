"""Two engines in turns: what one of them does at once may be lost to the other.

The depth-first search is quick where methods say what they need, and wanders where an early choice goes wrong; the
best-first search is slower at every step and comes back. In every turn the first plans anew with four times the
expansions that it had before, the second goes on for as many. Turns are counted in expansions, not in seconds, so the
same problem gets the same plan everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from remoras.htn.best_first import BestFirst, Foresees
from remoras.htn.domain import GOAL, Domain, Task
from remoras.htn.errors import UnfinishedError
from remoras.htn.facts import Facts, FactsLike, Key
from remoras.htn.plans import NoPlan, Plan
from remoras.htn.search import plan

FIRST_TURN = 20_000
"""Expansions of each engine in the first turn."""
GROWTH = 4


def plan_in_turns(
    domain: Domain,
    facts: FactsLike,
    tasks: Task | Sequence[Task] = (),
    *,
    goal: Mapping[Key, Any] | None = None,
    foresight: Foresees | None = None,
    max_expansions: int = 10_000_000,
) -> Plan | NoPlan:
    """Decompose tasks into elementary tasks, by whichever engine is there first; answers are those of ``plan``.

    Args:
        domain, facts, tasks, goal: as of ``plan``.
        foresight: what is known of tasks before they are planned; a problem of HDDL has it.
        max_expansions: of both engines together.

    Raises:
        PlanningError: a task is not in the domain, or the bound on the expansions of both together is reached.

    >>> from remoras.htn import Method, Operator
    >>> domain = Domain.of([Operator("dive")], {"survey": [Method.fixed("at once", "dive")]})
    >>> [str(task) for task in plan_in_turns(domain, {}, Task("survey")).tasks]
    ['dive()']
    """
    wanted = [tasks] if isinstance(tasks, Task) else list(tasks)
    if goal is not None:
        wanted.append(Task(GOAL, (tuple(goal.items()),)))
    view = Facts(facts)
    best_first = BestFirst(domain, view, wanted, foresight)
    left = max_expansions
    turn = FIRST_TURN
    while True:
        given = min(turn, left)
        try:
            return plan(domain, facts, wanted, max_expansions=given)
        except UnfinishedError as error:
            left -= given
            left -= best_first.run(min(turn, left))
            if not left and not best_first.has_ended:
                raise UnfinishedError(error.tasks, max_expansions, error.hint) from None
        if best_first.has_ended:
            rests_on, patterns = frozenset(view.read | view.compared), frozenset(view.patterns)
            if best_first.nodes is None:
                return NoPlan(wanted[0], rests_on, tuple(best_first.dead_ends), patterns)
            return Plan(best_first.nodes, rests_on, patterns, best_first.cost)
        turn *= GROWTH
