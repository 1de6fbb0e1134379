"""Facts asked for by pattern: what answers, what a plan rests on, and what it costs."""

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.errors import PlanningError
from remoras.htn import ANY, Domain, FactIndex, Facts, Method, NoPlan, Operator, Plan, Task, plan
from remoras.htn.facts import fits

ROADS = {("road", "A", "B"): True, ("road", "B", "C"): True, ("road", "C", "A"): False, ("at", "AUV00"): "A"}


def test_a_pattern_is_answered_by_the_facts_that_hold_and_fit() -> None:
    index = FactIndex(ROADS)
    assert index.match(("road", ANY, ANY)) == (("road", "A", "B"), ("road", "B", "C"))
    assert index.match(("road", ANY, "C")) == (("road", "B", "C"),)
    assert index.match(("at", ANY)) == (("at", "AUV00"),)
    assert index.match(("at", ANY, ANY)) == ()
    assert dict(index) == ROADS


atoms = st.tuples(st.sampled_from("pq"), st.sampled_from("ab"), st.sampled_from("ab"))
values = st.sampled_from([True, False, None])
changes = st.lists(st.dictionaries(atoms, values, max_size=3), max_size=4)
patterns = st.tuples(*(st.sampled_from([*letters, ANY]) for letters in ("pq", "ab", "ab")))


@given(st.dictionaries(atoms, values), changes, st.lists(patterns, max_size=3), st.integers(0, 4), patterns)
def test_a_pattern_sees_what_was_made_true_and_what_was_undone(
    given_facts: dict[Any, Any], made: list[dict[Any, Any]], asked_before: list[Any], n_kept: int, pattern: Any
) -> None:
    """Against a plain dictionary; buckets that were made before a change must follow it."""
    facts = Facts(given_facts)
    expected = dict(given_facts)
    lengths = []
    for number, effects in enumerate(made):
        for early in asked_before[number : number + 1]:
            facts.match(early)
        lengths.append(len(facts.trail))
        facts.make_true(effects)
        if number < n_kept:
            expected.update(effects)
    if n_kept < len(made):
        facts.undo(lengths[n_kept])
    held = {key for key, value in expected.items() if value and fits(pattern, key)}
    assert set(facts.match(pattern)) == held
    assert all(facts.get(key) == value for key, value in expected.items())


@given(st.dictionaries(atoms, values), changes, changes)
def test_two_states_have_one_word_if_and_only_if_they_are_equal(
    given_facts: dict[Any, Any], one: list[dict[Any, Any]], other: list[dict[Any, Any]]
) -> None:
    facts = Facts(given_facts)
    for effects in one:
        facts.make_true(effects)
    middle = len(facts.trail)
    before = {key: facts.get(key) for key in [("p", a, b) for a in "ab" for b in "ab"]}
    before |= {key: facts.get(key) for key in [("q", a, b) for a in "ab" for b in "ab"]}
    for effects in other:
        facts.make_true(effects)
    after = {key: facts.get(key) for key in before}
    assert (facts.word(middle) == facts.word(len(facts.trail))) == (before == after)


def drive(facts: Facts, goal: str) -> Iterator[list[Task]]:
    for _, origin, _ in facts.match(("road", ANY, goal)):
        yield [Task("go", (origin,)), Task("drive", (origin, goal))]


ROUTES = Domain.of(
    [
        Operator(
            "drive",
            lambda facts, origin, goal: facts.get(("at", "AUV00")) == origin,
            lambda facts, origin, goal: {("at", "AUV00"): goal},
        )
    ],
    {
        "go": [
            Method("be there", lambda facts, goal: [], lambda facts, goal: facts.get(("at", "AUV00")) == goal, ()),
            Method("by road", drive, uses=("go", "drive")),
        ]
    },
)


def test_one_method_gives_one_decomposition_per_binding_and_circles_of_roads_do_not_matter() -> None:
    """From A to D; of the two roads into D the first comes from C, and C is reached only from D: a circle."""
    roads = [("C", "D"), ("B", "D"), ("D", "C"), ("A", "B")]
    facts = {("at", "AUV00"): "A", **{("road", *road): True for road in roads}}
    found = plan(ROUTES, facts, Task("go", ("D",)))
    assert isinstance(found, Plan)
    assert [str(task) for task in found.tasks] == ["drive(A, B)", "drive(B, D)"]


def test_a_plan_rests_on_the_patterns_that_were_asked_for() -> None:
    facts = {("at", "AUV00"): "A", ("road", "A", "B"): True}
    found = plan(ROUTES, facts, Task("go", ("B",)))
    assert isinstance(found, Plan)
    assert found.is_touched([("road", "C", "B")])  # a new road may lead to another plan
    assert found.is_touched([("at", "AUV00")])
    assert not found.is_touched([("road", "B", "C"), ("at", "AUV01")])


def test_where_there_is_no_plan_a_new_fact_that_fits_a_pattern_may_bring_one() -> None:
    facts = {("at", "AUV00"): "A", ("road", "A", "B"): True}
    found = plan(ROUTES, facts, Task("go", ("C",)))
    assert isinstance(found, NoPlan)
    assert found.is_touched([("road", "B", "C")])
    assert found.is_touched([("at", "AUV00")])
    assert not found.is_touched([("road", "B", "D"), ("at", "AUV01")])


def test_decompositions_are_asked_for_one_by_one() -> None:
    asked: list[int] = []

    def count(facts: Facts) -> Iterator[list[Task]]:
        for number in range(1000):
            asked.append(number)
            yield [Task("take", (number,))]

    domain = Domain.of([Operator("take", lambda facts, number: number == 3)], {"choose": [Method("count", count)]})
    assert isinstance(plan(domain, {}, Task("choose")), Plan)
    assert asked == [0, 1, 2, 3]


def test_a_method_goes_on_with_its_bindings_in_the_world_in_which_it_began() -> None:
    """The first binding takes the only key away, and fails behind it; the second one must find the key again."""

    def pick(facts: Facts) -> Iterator[list[Task]]:
        for door in ("left", "right"):
            keys = facts.match(("key", ANY))
            yield [Task("unlock", (*keys[0], door)), Task("enter", (door,))]

    domain = Domain.of(
        [
            Operator("unlock", effects=lambda facts, kind, key, door: {(kind, key): False, ("open", door): True}),
            Operator("enter", lambda facts, door: door == "right" and facts.get(("open", door))),
        ],
        {"get in": [Method("pick", pick)]},
    )
    found = plan(domain, {("key", "K"): True}, Task("get in"))
    assert isinstance(found, Plan)
    assert [str(task) for task in found.tasks] == ["unlock(key, K, right)", "enter(right)"]


def test_facts_that_cannot_be_listed_are_refused_with_a_remedy() -> None:
    class OneByOne:
        def get(self, key: Any, default: Any = None, /) -> Any:
            return default

    with pytest.raises(PlanningError, match="OneByOne can be asked one by one, and not by pattern; give a mapping"):
        plan(ROUTES, OneByOne(), Task("go", ("B",)))


def test_a_pattern_costs_as_much_as_its_answer_is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """With an index, nothing goes through the other facts: they are sorted once, before."""
    asked = []
    for n_other in (0, 10_000):
        index = FactIndex({**{("cell", number): True for number in range(n_other)}, **ROADS})
        index.match(("road", ANY, "C"))
        index.match(("road", ANY, "B"))
        calls = 0
        bucket = index.bucket

        def counted(*arguments: Any, bucket: Any = bucket) -> Any:
            nonlocal calls
            calls += 1
            return bucket(*arguments)

        monkeypatch.setattr(index, "bucket", counted)
        monkeypatch.setattr(index, "_sorted", None)  # sorting once more would be an error
        assert isinstance(plan(ROUTES, index, Task("go", ("C",))), Plan)
        asked.append(calls)
    assert asked[0] == asked[1] > 0


def test_no_way_says_so_though_roads_go_in_circles() -> None:
    """B and C lie on a circle that A does not reach; the loop check alone cannot tell, so depth is tried as well."""
    roads = {("road", "B", "C"): True, ("road", "C", "B"): True, ("at", "AUV00"): "A"}
    with pytest.raises(PlanningError, match=r"endless recursion without any change: go\(C\) > go\(B\) > go\(C\)"):
        plan(ROUTES, roads, Task("go", ("C",)), max_expansions=2000)
    assert isinstance(plan(ROUTES, {("at", "AUV00"): "A"}, Task("go", ("C",))), NoPlan)
