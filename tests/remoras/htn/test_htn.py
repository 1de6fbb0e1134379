"""Hierarchical task networks: what comes out of the search, and what its answer rests on."""

import threading
from collections.abc import Callable, Hashable, Mapping
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.errors import PlanningError
from remoras.htn import Domain, Method, NoPlan, Operator, Plan, Task, plan


def fixed(name: str, *subtasks: str, when: str | None = None) -> Method:
    """A method of a fixed sequence of tasks, applicable if the fact ``when`` is true."""
    return Method(
        name,
        lambda facts: [Task(subtask) for subtask in subtasks],
        lambda facts: when is None or bool(facts.get(when)),
    )


def making(name: str, *, when: str | None = None, unless: str | None = None, **effects: Any) -> Operator:
    """An elementary task that makes ``effects`` true, possible if ``when`` holds and ``unless`` does not."""
    return Operator(
        name,
        lambda facts: (when is None or bool(facts.get(when))) and (unless is None or not facts.get(unless)),
        lambda facts: effects,
    )


def names(found: Plan | NoPlan) -> list[str]:
    assert isinstance(found, Plan)
    return [task.name for task in found.tasks]


SURVEY = Domain.of(
    [making("dive", deep=True), making("map", when="deep"), making("surface", deep=False), making("report")],
    {
        "survey": [
            fixed("dive for it", "descend", "map", "surface", "report", when="charged"),
            fixed("stay up", "report"),
        ],
        "descend": [fixed("be there already", when="deep"), fixed("dive", "dive")],
    },
)


def test_a_mission_becomes_elementary_tasks_in_order() -> None:
    assert names(plan(SURVEY, {"charged": True}, Task("survey"))) == ["dive", "map", "surface", "report"]


def test_an_empty_method_is_a_valid_answer() -> None:
    assert names(plan(SURVEY, {"charged": True, "deep": True}, Task("survey"))) == ["map", "surface", "report"]
    assert names(plan(SURVEY, {"deep": True}, Task("descend"))) == []


def test_methods_are_tried_in_the_order_of_the_domain() -> None:
    assert names(plan(SURVEY, {}, Task("survey"))) == ["report"]


def test_every_step_knows_where_it_came_from() -> None:
    found = plan(SURVEY, {"charged": True}, Task("survey"))
    assert isinstance(found, Plan)
    dive, mapping = [node for node in found.nodes if node.method is None][:2]
    descend = found.nodes[dive.parent]
    assert (descend.task.name, descend.method) == ("descend", "dive")
    for place in (descend.parent, mapping.parent):
        assert (found.nodes[place].task.name, found.nodes[place].method) == ("survey", "dive for it")


def test_arguments_reach_methods_and_operators() -> None:
    domain = Domain.of(
        [Operator("go", lambda facts, a, b: facts.get(("road", a, b), False))],
        {"tour": [Method("one by one", lambda facts, *stops: [Task("go", stops[:2]), Task("go", stops[1:])])]},
    )
    roads = {("road", "A", "B"): True, ("road", "B", "C"): True}
    found = plan(domain, roads, Task("tour", ("A", "B", "C")))
    assert [str(task) for task in found.tasks] == ["go(A, B)", "go(B, C)"]  # type: ignore[union-attr]


def test_what_was_made_true_in_a_dead_end_is_undone() -> None:
    """The first method dives and finds no way on; the second one must find the vehicle at the surface."""
    domain = Domain.of(
        [
            making("dive", deep=True, ballast=1),
            making("grip", when="arm"),
            making("photograph", unless="deep"),
        ],
        {"inspect": [fixed("by arm", "dive", "grip"), fixed("by camera", "photograph")]},
    )
    facts = {"ballast": 7}
    assert names(plan(domain, facts, Task("inspect"))) == ["photograph"]
    assert facts == {"ballast": 7}  # and the facts given are not touched at all


def test_search_turns_back_into_a_task_that_succeeded() -> None:
    """``move`` succeeds on foot, but then ``carry`` is impossible: its other method is tried."""
    domain = Domain.of(
        [making("swim", wet=True), making("sail", wet=False), making("carry", unless="wet")],
        {
            "move": [fixed("swim", "swim"), fixed("sail", "sail")],
            "bring": [fixed("move, then carry", "move", "carry")],
        },
    )
    assert names(plan(domain, {}, Task("bring"))) == ["sail", "carry"]


def test_an_effect_replaced_on_the_way_is_restored_by_undoing() -> None:
    """Two layers of one fact: undoing the upper one shows the lower one, not what was given."""
    domain = Domain.of(
        [
            Operator("one", effects=lambda facts: {"n": 1}),
            Operator("two", effects=lambda facts: {"n": 2}),
            Operator("fail", lambda facts: False),
            Operator("check", lambda facts: facts.get("n") == 1),
        ],
        {"all": [fixed("all", "one", "try", "check")], "try": [fixed("no", "two", "fail"), fixed("yes")]},
    )
    assert names(plan(domain, {"n": 0}, Task("all"))) == ["one", "check"]


def test_no_plan_rests_on_what_the_search_asked() -> None:
    domain = Domain.of(
        [making("dive", when="charged"), making("sail", when="wind")],
        {"move": [fixed("below", "dive"), fixed("above", "sail")]},
    )
    found = plan(domain, {"charged": False}, Task("move"))
    assert isinstance(found, NoPlan)
    assert found.task == Task("move")
    assert found.rests_on == {"charged", "wind"}


# Faults -----------------------------------------------------------------------------------------


def test_an_unknown_task_is_named() -> None:
    with pytest.raises(PlanningError, match=r"task fly\(\) is not in the domain, which has: dive, map"):
        plan(Domain.of([Operator("map"), Operator("dive")], {}), {}, Task("fly"))


def test_a_task_is_elementary_or_abstract() -> None:
    with pytest.raises(PlanningError, match="both: dive"):
        Domain.of([Operator("dive")], {"dive": [fixed("again", "dive")]})


def test_an_abstract_task_has_a_method() -> None:
    with pytest.raises(PlanningError, match="none: survey"):
        Domain.of([], {"survey": []})


def test_a_search_without_end_is_an_error_and_no_lack_of_a_plan() -> None:
    domain = Domain.of([], {"wait": [fixed("and wait", "wait")]})
    with pytest.raises(PlanningError, match=r"no plan for wait\(\) within 500 expansions"):
        plan(domain, {}, Task("wait"), max_expansions=500)


# Towers of Hanoi --------------------------------------------------------------------------------


def towers() -> Domain:
    def may_move(facts: Any, disc: int, origin: str, target: str) -> bool:
        smaller = [facts.get(("on", other)) for other in range(1, disc)]
        return facts.get(("on", disc)) == origin and origin not in smaller and target not in smaller

    def carry(facts: Any, n: int, origin: str, target: str, spare: str) -> list[Task]:
        return [
            Task("tower", (n - 1, origin, spare, target)),
            Task("move", (n, origin, target)),
            Task("tower", (n - 1, spare, target, origin)),
        ]

    return Domain.of(
        [Operator("move", may_move, lambda facts, disc, origin, target: {("on", disc): target})],
        {
            "tower": [
                Method("nothing to carry", lambda facts, *args: [], lambda facts, n, *pegs: n == 0),
                Method("carry", carry),
            ]
        },
    )


@pytest.mark.parametrize("n", [0, 1, 2, 3, 6, 9])
def test_towers_of_hanoi_take_two_to_the_n_less_one_moves(n: int) -> None:
    """M(n) = 2 M(n - 1) + 1, M(0) = 0; 1, 3, 7 are also what the planner Aries needs in the IPC 2020 instances."""
    pegs = {("on", disc): "A" for disc in range(1, n + 1)}
    found = plan(towers(), pegs, Task("tower", (n, "A", "C", "B")))
    assert len(names(found)) == 2**n - 1
    for task in found.tasks:  # type: ignore[union-attr]
        disc, origin, target = task.args
        assert pegs["on", disc] == origin
        assert all(pegs["on", smaller] not in (origin, target) for smaller in range(1, disc))
        pegs["on", disc] = target
    assert set(pegs.values()) <= {"C"}


# What a plan costs, and what it rests on --------------------------------------------------------


class Counting(dict[Hashable, Any]):
    """Facts that count how often they are asked."""

    n_asked = 0

    def get(self, key: Hashable, default: Any = None) -> Any:
        self.n_asked += 1
        return super().get(key, default)

    def _refuse(self, *arguments: Any) -> Any:
        raise AssertionError("the planner goes through all the facts")

    __iter__ = keys = items = values = copy = __deepcopy__ = __copy__ = _refuse


def test_a_plan_costs_the_same_whatever_the_number_of_facts() -> None:
    asked = []
    for n_facts in (10, 10_000):
        facts = Counting({("cell", number): True for number in range(n_facts)})
        facts.update({("on", disc): "A" for disc in range(1, 6)})
        assert len(names(plan(towers(), facts, Task("tower", (5, "A", "C", "B"))))) == 31
        asked.append(facts.n_asked)
    assert asked[0] == asked[1]


KEYS = ("a", "b", "c", "d")
OPERATORS = ("p", "q", "r")
ABSTRACT = ("X", "Y", "Z")
condition = st.none() | st.tuples(st.sampled_from(KEYS), st.booleans())
effects_drawn = st.dictionaries(st.sampled_from(KEYS), st.booleans(), max_size=2)
operators = st.fixed_dictionaries({name: st.tuples(condition, effects_drawn) for name in OPERATORS})


def _methods(below: tuple[str, ...]) -> st.SearchStrategy[list[tuple[Any, list[str]]]]:
    """Methods whose tasks stand lower in the hierarchy, so that every search ends."""
    return st.lists(st.tuples(condition, st.lists(st.sampled_from(below), max_size=3)), min_size=1, max_size=3)


hierarchies = st.fixed_dictionaries(
    {
        "Z": _methods(OPERATORS),
        "Y": _methods((*OPERATORS, "Z")),
        "X": _methods((*OPERATORS, "Y", "Z")),
    }
)
worlds = st.dictionaries(st.sampled_from(KEYS), st.booleans())
Raw = Mapping[str, Any]


def _holds(test: Any) -> Callable[..., bool]:
    return lambda facts: test is None or facts.get(test[0], False) == test[1]


def domain_of(elementary: Raw, abstract: Raw) -> Domain:
    return Domain.of(
        [
            Operator(name, _holds(test), lambda facts, effects=effects: effects)  # type: ignore[misc]
            for name, (test, effects) in elementary.items()
        ],
        {
            name: [
                Method(str(number), lambda facts, tasks=tasks: [Task(task) for task in tasks], _holds(test))  # type: ignore[misc]
                for number, (test, tasks) in enumerate(methods)
            ]
            for name, methods in abstract.items()
        },
    )


def seek(elementary: Raw, abstract: Raw, facts: dict[str, bool], tasks: list[str]) -> list[str] | None:
    """The textbook search, copying the world at every step: steps of the first plan, or None."""
    if not tasks:
        return []
    first, rest = tasks[0], tasks[1:]
    if first in elementary:
        test, effects = elementary[first]
        if not _holds(test)(facts):
            return None
        later = seek(elementary, abstract, {**facts, **effects}, rest)
        return None if later is None else [first, *later]
    for test, subtasks in abstract[first]:
        if _holds(test)(facts):
            found = seek(elementary, abstract, facts, [*subtasks, *rest])
            if found is not None:
                return found
    return None


@given(operators, hierarchies, worlds)
def test_the_search_finds_what_the_textbook_search_finds(elementary: Raw, abstract: Raw, world: Raw) -> None:
    expected = seek(elementary, abstract, dict(world), ["X"])
    found = plan(domain_of(elementary, abstract), world, Task("X"))
    if expected is None:
        assert isinstance(found, NoPlan)
    else:
        assert names(found) == expected


@given(operators, hierarchies, worlds, worlds)
def test_facts_that_a_plan_does_not_rest_on_do_not_matter(
    elementary: Raw, abstract: Raw, world: Raw, other: Raw
) -> None:
    domain = domain_of(elementary, abstract)
    found = plan(domain, world, Task("X"))
    changed = {key: value for key, value in other.items() if key not in found.rests_on}
    changed |= {key: value for key, value in world.items() if key in found.rests_on}
    assert plan(domain, changed, Task("X")) == found


# Planners side by side --------------------------------------------------------------------------


def test_a_planner_may_ask_another_one_while_it_plans() -> None:
    """A condition of the fleet's plan is that the vehicle's own planner finds a plan, with facts of its own."""
    own = Domain.of([making("dive", when="charged", deep=True)], {})
    fleet = Domain.of(
        [Operator("send", lambda facts, name: isinstance(plan(own, {"charged": name == "AUV01"}, Task("dive")), Plan))],
        {"choose": [Method(name, lambda facts, name=name: [Task("send", (name,))]) for name in ("AUV00", "AUV01")]},  # type: ignore[misc]
    )
    found = plan(fleet, {}, Task("choose"))
    assert isinstance(found, Plan)
    assert [task.args for task in found.tasks] == [("AUV01",)]
    assert found.rests_on == frozenset()


def test_planners_in_two_threads_do_not_disturb_each_other() -> None:
    """A planner with a global domain answers from the other thread's domain under these conditions."""
    wrong: list[list[str]] = []

    def work(domain: Domain, facts: Mapping[str, bool], task: str, expected: list[str]) -> None:
        for _ in range(300):
            got = names(plan(domain, facts, Task(task)))
            if got != expected:
                wrong.append(got)

    other = Domain.of([making("swim"), making("carry")], {"survey": [fixed("swim", *["swim", "carry"] * 5)]})
    threads = [
        threading.Thread(target=work, args=(SURVEY, {"charged": True}, "survey", ["dive", "map", "surface", "report"])),
        threading.Thread(target=work, args=(other, {}, "survey", ["swim", "carry"] * 5)),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_endless_recursion_is_an_error_that_takes_no_memory() -> None:
    endless = Domain.of([], {"a": [Method("again", lambda facts: [Task("a")])]})
    with pytest.raises(PlanningError, match="within 200000 expansions"):
        plan(endless, {}, Task("a"))


@pytest.mark.parametrize("wrong", [None, "map", ["map"], iter(["map"]), iter([Task("map")])])
def test_a_method_that_returns_no_list_of_tasks_is_an_error(wrong: object) -> None:
    broken = Domain.of([], {"a": [Method("broken", lambda facts: wrong)]})  # type: ignore[arg-type,return-value]
    with pytest.raises(PlanningError, match="'broken' of task a"):
        plan(broken, {}, Task("a"))


def test_an_elementary_task_has_one_operator() -> None:
    with pytest.raises(PlanningError, match="dive"):
        Domain.of([Operator("dive"), Operator("dive")], {})
