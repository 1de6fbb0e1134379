"""Small random domains, recursion and all, and a planner that goes through everything to hold the real one against.

States are sets of propositions, tasks have no arguments. The brute force keeps (tasks to be done, state) in a heap by
cost, so the first plan that it completes is a cheapest one; nothing is shared with the planner.
"""

import heapq
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from hypothesis import strategies as st

from remoras.htn import Domain, Method, Operator, Task

KEYS = ("a", "b", "c")
ELEMENTARY = ("p", "q", "r")
ABSTRACT = ("X", "Y", "Z")
MAX_TASKS = 7
MAX_CONFIGURATIONS = 4000
Raw = Mapping[str, Any]

condition = st.none() | st.tuples(st.sampled_from(KEYS), st.booleans())
effects = st.dictionaries(st.sampled_from(KEYS), st.booleans(), max_size=2)
operators = st.fixed_dictionaries({name: st.tuples(condition, effects, st.integers(0, 3)) for name in ELEMENTARY})
alternative = st.tuples(condition, st.lists(st.sampled_from((*ELEMENTARY, *ABSTRACT)), max_size=3))
methods = st.fixed_dictionaries({name: st.lists(alternative, min_size=1, max_size=3) for name in ABSTRACT})
worlds = st.dictionaries(st.sampled_from(KEYS), st.booleans())
goals = st.dictionaries(st.sampled_from(KEYS), st.booleans(), max_size=1)


def holds(test: Any, facts: Any) -> bool:
    """True if the condition is met; what is not known is false."""
    return test is None or bool(facts.get(test[0], False)) == test[1]


def domain_of(elementary: Raw, abstract: Raw, *, lazily: bool) -> Domain:
    """The domain; ``lazily``: one method per task that gives all decompositions, instead of one method for each."""

    def operator(name: str) -> Operator:
        test, changes, cost = elementary[name]
        return Operator(name, lambda facts: holds(test, facts), lambda facts: changes, float(cost))

    def one(number: int, test: Any, tasks: Sequence[str]) -> Method:
        return Method(str(number), lambda facts: [Task(task) for task in tasks], lambda facts: holds(test, facts))

    def every(alternatives: Any) -> Method:
        return Method(
            "0",
            lambda facts: ([Task(task) for task in tasks] for test, tasks in alternatives if holds(test, facts)),
        )

    return Domain.of(
        [operator(name) for name in elementary],
        {
            name: [every(found)] if lazily else [one(number, *each) for number, each in enumerate(found)]
            for name, found in abstract.items()
        },
    )


class Brute(NamedTuple):
    """Cost of a cheapest plan, None if none was found; whether nothing was left out."""

    cost: float | None
    is_complete: bool


def brute_force(elementary: Raw, abstract: Raw, world: Raw, tasks: Sequence[str], goal: Raw) -> Brute:
    """Go through all (tasks to be done, state) of at most MAX_TASKS tasks, cheapest first."""
    start = tuple(tasks), frozenset(key for key, value in world.items() if value)
    heap: list[tuple[float, int, Any]] = [(0.0, 0, start)]
    seen = set()
    is_complete = True
    number = 0
    while heap:
        cost, _, (left, state) = heapq.heappop(heap)
        if (left, state) in seen:
            continue
        if len(seen) == MAX_CONFIGURATIONS:
            return Brute(None, False)
        seen.add((left, state))
        if not left:
            if all((key in state) == value for key, value in goal.items()):
                return Brute(cost, is_complete)
            continue
        first, rest = left[0], left[1:]
        facts = dict.fromkeys(state, True)
        following: list[tuple[float, Any]] = []
        if first in elementary:
            test, changes, price = elementary[first]
            if holds(test, facts):
                after = (state | {key for key in changes if changes[key]}) - {
                    key for key in changes if not changes[key]
                }
                following.append((cost + price, (rest, after)))
        else:
            following += [(cost, ((*below, *rest), state)) for test, below in abstract[first] if holds(test, facts)]
        for price, (remaining, after) in following:
            if len(remaining) > MAX_TASKS:
                is_complete = False
                continue
            number += 1
            heapq.heappush(heap, (price, number, (remaining, after)))
    return Brute(None, is_complete)
