"""The best-first engine and the portfolio: against brute force and the other engine, and what each part is good for."""

from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st
from random_domains import Raw, brute_force, domain_of, goals, methods, operators, worlds
from test_hddl_needs import domains, facts

from benchmarks.ipc.problems import KINDS, problem
from remoras.errors import PlanningError
from remoras.htn import (
    ANY,
    Domain,
    Facts,
    FactsLike,
    Method,
    NoPlan,
    Operator,
    Plan,
    Task,
    best_first,
    check_plan,
    plan,
    plan_in_turns,
)
from remoras.htn.best_first import BestFirst, Sight
from remoras.htn.domain import GOAL
from remoras.htn.hddl import Problem, parse
from remoras.htn.hddl.foresight import Foresight

BUDGET = 6_000
few = settings(max_examples=80, deadline=None)
WIRING = """(define (domain wiring) (:types socket)
  (:predicates (fits ?a ?b - socket) (through ?a ?b - socket) (joined ?a ?b - socket) (used ?a - socket) (closed))
  (:task join :parameters (?a ?b - socket))
  (:task trace :parameters (?a ?b - socket))
  (:method plug :parameters (?a ?b ?x ?y - socket) :task (join ?a ?b) :precondition (fits ?x ?y)
    :ordered-subtasks (and (connect ?x ?y) (join ?a ?b)))
  (:method pull :parameters (?a ?b ?x ?y - socket) :task (join ?a ?b)
    :ordered-subtasks (and (disconnect ?x ?y) (join ?a ?b)))
  (:method check :parameters (?a ?b - socket) :task (join ?a ?b) :ordered-subtasks (and (close) (trace ?a ?b)))
  (:method there :parameters (?a ?b - socket) :task (trace ?a ?b) :precondition (joined ?a ?b))
  (:method on :parameters (?a ?b ?x ?y - socket) :task (trace ?a ?b)
    :precondition (and (joined ?a ?x) (through ?x ?y)) :ordered-subtasks (and (trace ?y ?b)))
  (:action connect :parameters (?x ?y - socket)
    :precondition (and (not (closed)) (not (used ?x)) (not (used ?y)) (fits ?x ?y))
    :effect (and (joined ?x ?y) (used ?x) (used ?y)))
  (:action disconnect :parameters (?x ?y - socket) :precondition (and (not (closed)) (joined ?x ?y))
    :effect (and (not (joined ?x ?y)) (not (used ?x)) (not (used ?y))))
  (:action close :precondition () :effect (closed)))"""
"""After AssemblyHierarchical of the competition: whether cables and adapters lead through is seen when all is done."""


def wiring(n_cables: int, *, leads_through: bool = True) -> Problem:
    """So many cables between two devices, each of a kind of its own; what has one end fits every other end."""
    cables = [(f"c{number}a", f"c{number}b") for number in range(n_cables)]
    outs = ["here", *(b for _, b in cables)]
    ins = [*(a for a, _ in cables), "there"]
    fits = [f"(fits {one} {other})" for one in outs for other in ins if one[:2] != other[:2] and other != "there"]
    fits += [f"(fits {cables[-1][1]} there)"] if leads_through else []
    facts = [*fits, *(f"(through {a} {b})" for a, b in cables)]
    return parse(
        WIRING,
        f"(define (problem p) (:domain wiring) (:objects {' '.join([*outs, *ins])} - socket)"
        f" (:htn :ordered-subtasks (and (join here there))) (:init {' '.join(facts)}))",
    )


def by_best_first(domain: Domain, facts: FactsLike, *tasks: Task, budget: int, goal: Raw | None = None) -> BestFirst:
    wanted = [*tasks, Task(GOAL, (tuple(goal.items()),))] if goal else list(tasks)
    search = BestFirst(domain, Facts(facts), wanted)
    search.run(budget)
    return search


def depth_first(domain: Domain, world: Raw, goal: Raw) -> Plan | NoPlan | None:
    """The answer of the other engine; None if the expansions do not suffice."""
    try:
        return plan(domain, world, Task("X"), goal=goal or None, max_expansions=BUDGET)
    except PlanningError:
        return None


def as_plan(search: BestFirst) -> Plan:
    assert search.nodes is not None
    return Plan(search.nodes, frozenset(), cost=search.cost)


@few
@given(operators, methods, worlds, goals, st.booleans())
def test_it_finds_a_plan_where_brute_force_and_the_other_engine_do(
    elementary: Raw, abstract: Raw, world: Raw, goal: Raw, lazily: bool
) -> None:
    domain = domain_of(elementary, abstract, lazily=lazily)
    expected = brute_force(elementary, abstract, world, ["X"], goal)
    found = by_best_first(domain, world, Task("X"), budget=BUDGET, goal=goal)
    event(f"brute force finds {'one' if expected.cost is not None else 'none'}, ended {found.has_ended}")
    if expected.cost is not None:
        assert found.nodes is not None
        assert isinstance(depth_first(domain, world, goal), Plan)
    elif expected.is_complete:
        assert found.nodes is None
    if found.nodes is not None:
        verdict = check_plan(domain, world, Task("X"), as_plan(found), goal=goal or None)
        assert verdict.is_valid, str(verdict)
        assert found.cost >= (expected.cost or 0.0)
    elif found.has_ended:
        assert not isinstance(depth_first(domain, world, goal), Plan)


@few
@given(operators, methods, worlds, goals, st.integers(1, 300))
def test_a_search_that_was_stopped_goes_on_to_the_same_answer(
    elementary: Raw, abstract: Raw, world: Raw, goal: Raw, part: int
) -> None:
    domain = domain_of(elementary, abstract, lazily=True)
    whole = by_best_first(domain, world, Task("X"), budget=1_200, goal=goal)
    parts = by_best_first(domain, world, Task("X"), budget=0, goal=goal)
    left = 1_200
    while left and not parts.has_ended:
        left -= parts.run(min(part, left))
    assert (parts.nodes, parts.has_ended) == (whole.nodes, whole.has_ended)


@pytest.mark.parametrize("kind", KINDS)
def test_both_engines_plan_all_kinds(kind: str) -> None:
    read = problem(kind, 1)
    for found in (
        plan(read.domain, read.facts, read.tasks, goal=read.goal),
        plan_in_turns(read.domain, read.facts, read.tasks, goal=read.goal, foresight=read.foresight),
        as_plan(by_best_first(read.domain, read.facts, *read.tasks, budget=200_000, goal=read.goal)),
    ):
        assert isinstance(found, Plan)
        assert check_plan(read.domain, read.facts, read.tasks, found, goal=read.goal).is_valid


def test_what_is_seen_only_in_the_end_is_for_the_second_engine() -> None:
    """Depth first, an early cable in the wrong place is thought of last."""
    read = wiring(4)
    with pytest.raises(PlanningError, match="within 100000 expansions"):
        plan(read.domain, read.facts, read.tasks, max_expansions=100_000)
    found = plan_in_turns(read.domain, read.facts, read.tasks, max_expansions=100_000)
    assert isinstance(found, Plan)
    assert check_plan(read.domain, read.facts, read.tasks, found).is_valid
    assert [str(task) for task in found.tasks][-1] == "close()"


def test_that_there_is_no_plan_is_shown_where_the_other_engine_goes_round_for_ever() -> None:
    read = wiring(2, leads_through=False)
    with pytest.raises(PlanningError, match="within 100000 expansions"):
        plan(read.domain, read.facts, read.tasks, max_expansions=100_000)
    found = plan_in_turns(read.domain, read.facts, read.tasks, max_expansions=100_000)
    assert isinstance(found, NoPlan)
    assert found.rests_on


SWITCHES = """(define (domain switches) (:types switch) (:predicates (on ?s - switch))
  (:task arrange :parameters ())
  (:method press :parameters (?s - switch) :task (arrange) :ordered-subtasks (and (press ?s) (arrange)))
  (:method release :parameters (?s - switch) :task (arrange) :ordered-subtasks (and (release ?s) (arrange)))
  (:method ready :parameters () :task (arrange) :precondition (forall (?s - switch) (on ?s)))
  (:action press :parameters (?s - switch) :precondition (not (on ?s)) :effect (on ?s))
  (:action release :parameters (?s - switch) :precondition (on ?s) :effect (not (on ?s))))"""


def switches(n: int) -> BestFirst:
    """All must be on, which the task says only in the method that ends it; there is a state for every subset."""
    names = " ".join(f"s{number}" for number in range(n))
    read = parse(SWITCHES, f"(define (problem p) (:domain switches) (:objects {names} - switch)"
                           " (:htn :ordered-subtasks (and (arrange))) (:init))")  # fmt: skip
    assert len(read.foresight.landmarks(Task("arrange"))) == n
    return BestFirst(read.domain, Facts(read.facts), read.tasks, read.foresight)


def a_long_walk() -> BestFirst:
    """Whoever has few tasks left may walk on and on; the way out has one task more."""
    domain = Domain.of(
        [
            Operator("step", effects=lambda facts: {"at": (facts.get("at") or 0) + 1}),
            Operator("pack"),
        ],
        {"go": [Method.fixed("on", "step", "go"), Method.fixed("leave", "pack", "pack", "pack")]},
    )
    return BestFirst(domain, Facts({}), [Task("go")])


def a_trap() -> BestFirst:
    """The way is straight. Beside it is half of the goal, and then a thicket with a state for every subset."""

    def flip(facts: FactsLike, bit: int) -> dict[object, bool]:
        return {("bit", bit): not facts.get(("bit", bit))}

    def turns(facts: FactsLike) -> Iterator[list[Task]]:
        for bit in range(20):
            yield [Task("flip", (bit,)), Task("thicket")]

    def at(facts: FactsLike) -> int:
        return int(facts.get("at") or 0)

    domain = Domain.of(
        [
            Operator("step", effects=lambda facts: {"at": at(facts) + 1}),
            Operator("flip", effects=flip),
            Operator("bite", effects=lambda facts: {"bait": True}),
            Operator("fail", lambda facts: False),
            Operator("rest", effects=lambda facts: {"bait": True, "prize": True}),
        ],
        {
            "go": [
                Method.fixed("there", "rest", applicable=lambda facts: at(facts) == 100),
                Method.fixed("aside", "bite", "tempted", applicable=lambda facts: at(facts) < 100),
                Method.fixed("on", "step", "go", applicable=lambda facts: at(facts) < 100),
            ],
            "tempted": [Method.fixed("on", "thicket", *["fail"] * 5, "go")],
            "thicket": [Method("turn", turns, uses=("flip", "thicket")), Method.fixed("out")],
        },
    )
    goal = Task(GOAL, ((("bait", True), ("prize", True)),))
    return BestFirst(domain, Facts({}), [Task("go"), goal])


@pytest.mark.parametrize(
    ("world", "without"),
    [
        (lambda: switches(20), (Sight(0.05, 0.0), Sight(0.05, 0.0))),
        (a_trap, (Sight(0.05, 3.0), Sight(0.05, 3.0))),
        (a_long_walk, (Sight(0.0, 3.0), Sight(0.0, 0.0))),
    ],
    ids=["landmarks", "without landmarks", "depth"],
)
def test_without_a_sight_a_problem_is_lost(
    world: Callable[[], BestFirst], without: tuple[Sight, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    seeing, blind = world(), world()
    seeing.run(3_000)
    assert seeing.nodes
    monkeypatch.setattr(best_first, "SIGHTS", without)
    blind.run(3_000)
    assert not blind.nodes


@few
@given(domains(), facts)
def test_landmarks_become_true_on_every_way(domain: str, holding: set[str]) -> None:
    problem = f"(define (problem p) (:domain d) (:htn :ordered-tasks (t0 one two)) (:init {' '.join(sorted(holding))}))"
    read = parse(domain, problem)
    for found in (
        plan(read.domain, read.facts, read.tasks),
        plan_in_turns(read.domain, read.facts, read.tasks, foresight=read.foresight),
    ):
        if isinstance(found, NoPlan):
            continue
        state = Facts(read.facts)
        left = set(read.foresight.landmarks(read.tasks[0]))
        event(f"{min(len(left), 3)} landmarks")
        left -= {one for one in left if state.get(one[0])}
        for name, args in found.tasks:
            state.make_true(read.domain.operators[name].effects(state, *args))
            left -= {one for one in left if state.get(one[0])}
        assert not left


GOALS = st.sets(st.builds("({} {})".format, st.sampled_from(["p", "q", "r"]), st.sampled_from(["one", "two"])))


@few
@given(domains(), facts, GOALS)
def test_what_tasks_may_make_loses_no_plan(domain: str, holding: set[str], wanted: set[str]) -> None:
    given_facts, goal = " ".join(sorted(holding)), " ".join(sorted(wanted))
    read = parse(
        domain,
        f"(define (problem p) (:domain d) (:htn :ordered-tasks (and (t0 one two) (t1 two one))) (:init {given_facts})"
        f" (:goal (and {goal})))",
    )
    tasks = [*read.tasks, Task(GOAL, (tuple(read.goal.items()),))]
    found, unaided = (
        BestFirst(read.domain, Facts(read.facts), tasks, read.foresight),
        BestFirst(read.domain, Facts(read.facts), tasks),
    )
    for search in (found, unaided):
        search.run(20_000)
        assert search.has_ended
    event("a plan" if found.nodes else "none")
    assert (found.nodes is None) == (unaided.nodes is None)
    if found.nodes:
        assert check_plan(read.domain, read.facts, read.tasks, as_plan(found), goal=read.goal).is_valid


SPOILING = """(define (domain spoiling) (:types place) (:predicates (a ?p - place) (b ?p - place))
  (:task first :parameters (?p ?q - place))
  (:task second :parameters (?p - place))
  (:method badly :parameters (?p ?q - place) :task (first ?p ?q) :ordered-subtasks (and (both ?p ?q)))
  (:method well :parameters (?p ?q - place) :task (first ?p ?q) :ordered-subtasks (and (one ?p)))
  (:method only :parameters (?p - place) :task (second ?p) :ordered-subtasks (and (other ?p)))
  (:action both :parameters (?p ?q - place) :effect (and (a ?p) (b ?p) (not (a ?q))))
  (:action one :parameters (?p - place) :effect (a ?p))
  (:action other :parameters (?p - place) :effect (b ?p)))"""


def test_what_nothing_left_can_make_is_not_waited_for() -> None:
    """Each first task may spoil what the one before it has made; by what is left to be made the two ways are equal."""
    places = [f"p{number}" for number in range(14)]
    firsts = " ".join(f"(first {one} {before})" for before, one in pairwise(["start", *places]))
    problem = (
        f"(define (problem p) (:domain spoiling) (:objects start {' '.join(places)} - place)"
        f" (:htn :ordered-subtasks (and {firsts} {' '.join(f'(second {one})' for one in places)}))"
        f" (:init (a start)) (:goal (and (a start) {' '.join(f'(a {one}) (b {one})' for one in places)})))"
    )
    read = parse(SPOILING, problem)
    tasks = [*read.tasks, Task(GOAL, (tuple(read.goal.items()),))]
    seeing = BestFirst(read.domain, Facts(read.facts), tasks, read.foresight)
    seeing.run(3_000)
    assert seeing.nodes
    blind = BestFirst(read.domain, Facts(read.facts), tasks, Credulous(read.foresight))
    blind.run(3_000)
    assert not blind.nodes


class Credulous:
    """It knows landmarks, and takes every task for able to make everything."""

    def __init__(self, foresight: Foresight) -> None:
        self.landmarks = foresight.landmarks
        self.before = foresight.before

    def may_make(self, task: Task) -> frozenset[tuple[object, ...]]:
        return frozenset({("a", ANY), ("b", ANY)})


def test_who_comes_to_the_same_agenda_in_the_same_state_turns_back(monkeypatch: pytest.MonkeyPatch) -> None:
    read = wiring(3, leads_through=False)
    assert by_best_first(read.domain, read.facts, *read.tasks, budget=1_000).has_ended
    monkeypatch.setattr(best_first, "_Agenda", Forgetful)
    assert not by_best_first(read.domain, read.facts, *read.tasks, budget=30_000).has_ended


class Forgetful(best_first._Agenda):
    """An agenda that does not keep the states in which it was met."""

    __slots__ = ()

    @property
    def met(self) -> set[int]:  # type: ignore[override]
        return set()

    @met.setter
    def met(self, states: set[int]) -> None:
        pass


def test_a_method_is_asked_for_its_next_binding_only_when_it_is_due() -> None:
    asked = []

    def ways(facts: FactsLike) -> Iterator[list[Task]]:
        for number in range(1000):
            asked.append(number)
            yield [Task("try", (number,))]

    domain = Domain.of([Operator("try", lambda facts, number: number == 3)], {"find": [Method("any", ways)]})
    found = by_best_first(domain, {}, Task("find"), budget=1000)
    assert [str(task) for task in as_plan(found).tasks] == ["try(3)"]
    assert len(asked) <= 6


def test_bindings_are_asked_for_in_the_state_in_which_they_began() -> None:
    """The second binding matches facts that the first one's step has changed, had it been asked there."""

    def ways(facts: Facts) -> Iterator[list[Task]]:
        for key in facts.match(("at", ANY)):
            yield [Task("sink", key[1:]), Task("check", (len(facts.match(("at", ANY))),))]

    domain = Domain.of(
        [
            Operator("sink", effects=lambda facts, where: {("at", where): None}),
            Operator("check", lambda facts, n: n == 3 and not facts.get(("at", "c"))),
        ],
        {"find": [Method("any", ways)]},
    )
    facts = {("at", where): True for where in "abc"}
    assert [str(task) for task in as_plan(by_best_first(domain, facts, Task("find"), budget=100)).tasks] == [
        "sink(c)",
        "check(3)",
    ]


def test_arguments_that_have_no_hash_are_planned_with() -> None:
    domain = Domain.of([Operator("go")], {"way": [Method("by", lambda facts, stops: [Task("go", (stops,))] * 2)]})
    found = by_best_first(domain, {}, Task("way", (["a", "b"],)), budget=100)
    assert len(as_plan(found).steps) == 2


@pytest.mark.parametrize("wrong", [Task("nowhere"), Task("way")])
def test_a_domain_that_is_wrong_is_told_and_not_waited_for(wrong: Task) -> None:
    domain = Domain.of([], {"way": [Method("by", lambda facts: ["a"])]})
    with pytest.raises(PlanningError, match=r"not in the domain|must return a list of tasks"):
        by_best_first(domain, {}, wrong, budget=100)
    with pytest.raises(PlanningError, match=r"not in the domain|must return a list of tasks"):
        plan_in_turns(domain, {}, wrong)


def test_the_bound_of_the_portfolio_is_for_both_together() -> None:
    endless = Domain.of([Operator("up", effects=lambda facts: {"n": (facts.get("n") or 0) + 1})],
                        {"a": [Method.fixed("again", "up", "a"), Method.fixed("no", "b")],
                         "b": [Method.fixed("never", applicable=lambda facts: False)]})  # fmt: skip
    with pytest.raises(PlanningError, match=r"no plan for a\(\) within 50000 expansions"):
        plan_in_turns(endless, {}, Task("a"), max_expansions=50_000)
