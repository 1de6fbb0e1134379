"""The planner against brute force, on random domains with recursion."""

from collections.abc import Sequence

from hypothesis import event, given, settings
from hypothesis import strategies as st
from random_domains import (
    ELEMENTARY,
    Raw,
    brute_force,
    condition,
    domain_of,
    holds,
    is_executable,
    methods,
    operators,
    worlds,
)

from remoras.errors import PlanningError
from remoras.htn import Domain, NoPlan, Plan, Task, plan

BUDGET = 6_000
few = settings(max_examples=80, deadline=None)
lower = st.fixed_dictionaries(
    {
        name: st.lists(st.tuples(condition, st.lists(st.sampled_from(below), max_size=3)), min_size=1, max_size=3)
        for name, below in (("Z", ELEMENTARY), ("Y", (*ELEMENTARY, "Z")), ("X", (*ELEMENTARY, "Y", "Z")))
    }
)
"""Methods whose tasks stand lower in the hierarchy, so that every search ends."""


def planned(domain: Domain, world: Raw) -> Plan | NoPlan | None:
    """The answer; None if the expansions do not suffice, which an endless domain without a plan cannot avoid."""
    try:
        return plan(domain, world, Task("X"), max_expansions=BUDGET)
    except PlanningError:
        return None


@few
@given(operators, methods, worlds, st.booleans())
def test_there_is_a_plan_where_brute_force_finds_one(elementary: Raw, abstract: Raw, world: Raw, lazily: bool) -> None:
    domain = domain_of(elementary, abstract, lazily=lazily)
    expected = brute_force(elementary, abstract, world, ["X"])
    found = planned(domain, world)
    event(f"{type(found).__name__}, brute force {'finds one' if expected.exists else 'finds none'}")
    if expected.exists:
        assert isinstance(found, Plan)
    elif expected.is_complete:
        assert not isinstance(found, Plan)
    if isinstance(found, Plan):
        assert is_executable(domain, world, found)


def seek(elementary: Raw, abstract: Raw, facts: Raw, tasks: Sequence[str]) -> list[str] | None:
    """The textbook search, copying the world at every step: steps of the first plan, or None."""
    if not tasks:
        return []
    first, rest = tasks[0], tasks[1:]
    if first in elementary:
        test, effects = elementary[first]
        later = seek(elementary, abstract, {**facts, **effects}, rest) if holds(test, facts) else None
        return None if later is None else [first, *later]
    found = (
        seek(elementary, abstract, facts, [*below, *rest]) for test, below in abstract[first] if holds(test, facts)
    )
    return next((one for one in found if one is not None), None)


@given(operators, lower, worlds)
def test_the_search_finds_the_plan_of_the_textbook_search(elementary: Raw, abstract: Raw, world: Raw) -> None:
    found = plan(domain_of(elementary, abstract, lazily=False), world, Task("X"))
    steps = [task.name for task in found.tasks] if isinstance(found, Plan) else None
    assert steps == seek(elementary, abstract, world, ["X"])


@few
@given(operators, methods, worlds, worlds)
def test_unread_facts_do_not_change_a_recursive_plan(elementary, abstract, world, other):
    domain = domain_of(elementary, abstract, lazily=False)
    found = planned(domain, world)
    if found is None:
        return
    changed = {key: value for key, value in other.items() if key not in found.rests_on}
    changed |= {key: value for key, value in world.items() if key in found.rests_on}
    assert planned(domain, changed) == found
