"""Small random domains with recursion, and a brute-force planner as reference.

States are sets of propositions, tasks have no arguments. Brute force goes through (tasks to be done, state) breadth
first; nothing is shared with the planner.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from hypothesis import strategies as st

from remoras.htn import Domain, Method, Operator, Plan, Task

KEYS = ("a", "b", "c")
ELEMENTARY = ("p", "q", "r")
ABSTRACT = ("X", "Y", "Z")
MAX_TASKS = 7
MAX_CONFIGURATIONS = 4000
Raw = Mapping[str, Any]

condition = st.none() | st.tuples(st.sampled_from(KEYS), st.booleans())
effects = st.dictionaries(st.sampled_from(KEYS), st.booleans(), max_size=2)
operators = st.fixed_dictionaries({name: st.tuples(condition, effects) for name in ELEMENTARY})
alternative = st.tuples(condition, st.lists(st.sampled_from((*ELEMENTARY, *ABSTRACT)), max_size=3))
methods = st.fixed_dictionaries({name: st.lists(alternative, min_size=1, max_size=3) for name in ABSTRACT})
worlds = st.dictionaries(st.sampled_from(KEYS), st.booleans())


def holds(test: Any, facts: Any) -> bool:
    """True if the condition is met; what is not known is false."""
    return test is None or bool(facts.get(test[0], False)) == test[1]


def domain_of(elementary: Raw, abstract: Raw, *, lazily: bool) -> Domain:
    """The domain; ``lazily``: one method per task that gives all decompositions, instead of one method for each."""

    def operator(name: str) -> Operator:
        test, changes = elementary[name]
        return Operator(name, lambda facts: holds(test, facts), lambda facts: changes)

    def one(number: int, test: Any, tasks: Sequence[str]) -> Method:
        return Method(str(number), lambda facts: [Task(task) for task in tasks], lambda facts: holds(test, facts))

    def every(alternatives: Any) -> Method:
        return Method(
            "0", lambda facts: ([Task(task) for task in tasks] for test, tasks in alternatives if holds(test, facts))
        )

    return Domain.of(
        [operator(name) for name in elementary],
        {
            name: [every(found)] if lazily else [one(number, *each) for number, each in enumerate(found)]
            for name, found in abstract.items()
        },
    )


def is_executable(domain: Domain, facts: Raw, found: Plan) -> bool:
    """True if each elementary task is possible in the state that those before it leave."""
    state = dict(facts)
    for task in found.tasks:
        operator = domain.operators[task.name]
        if not operator.applicable(state, *task.args):
            return False
        state |= operator.effects(state, *task.args)
    return True


class Brute(NamedTuple):
    """Whether there is a plan; whether nothing was left out."""

    exists: bool
    is_complete: bool


def brute_force(elementary: Raw, abstract: Raw, world: Raw, tasks: Sequence[str]) -> Brute:
    """Go through all (tasks to be done, state) of at most MAX_TASKS tasks."""
    due = deque([(tuple(tasks), frozenset(key for key, value in world.items() if value))])
    seen = set()
    is_complete = True
    while due:
        left, state = due.popleft()
        if (left, state) in seen:
            continue
        if len(seen) == MAX_CONFIGURATIONS:
            return Brute(False, False)
        seen.add((left, state))
        if not left:
            return Brute(True, is_complete)
        first, rest = left[0], left[1:]
        facts = dict.fromkeys(state, True)
        following: list[tuple[tuple[str, ...], frozenset[str]]] = []
        if first in elementary:
            test, changes = elementary[first]
            if holds(test, facts):
                true = {key for key, value in changes.items() if value}
                following.append((rest, (state | true) - (changes.keys() - true)))
        else:
            following += [((*below, *rest), state) for test, below in abstract[first] if holds(test, facts)]
        short = [one for one in following if len(one[0]) <= MAX_TASKS]
        is_complete = is_complete and len(short) == len(following)
        due.extend(short)
    return Brute(False, is_complete)
