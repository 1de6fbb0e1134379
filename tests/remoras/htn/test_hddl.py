"""HDDL as input: what is read, what is planned, and what is refused with file and line.

The domains are written for these tests, after kinds of the International Planning Competition 2020 (which states no
licence for its files; ``tests/tools/ipc.py`` plans those).
"""

import textwrap
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from remoras.errors import PlanningError
from remoras.htn import Domain, Method, NoPlan, Operator, Plan, Task, check_plan, plan
from remoras.htn.hddl import Problem, parse

TOWERS = """
(define (domain towers)
  (:requirements :typing :hierarchy :negative-preconditions)
  (:types disc peg - thing)
  (:predicates (on ?d - disc ?t - thing) (smaller ?d - disc ?t - thing) (next ?big ?small - disc) (least ?d - disc))
  (:task tower :parameters (?d - disc ?from ?to ?by - peg))
  (:method one :parameters (?d - disc ?from ?to ?by - peg) :task (tower ?d ?from ?to ?by) :precondition (least ?d)
    :ordered-subtasks (and (move ?d ?from ?to)))
  (:method many :parameters (?d ?above - disc ?from ?to ?by - peg) :task (tower ?d ?from ?to ?by)
    :precondition (next ?d ?above)
    :subtasks (and (t3 (tower ?above ?by ?to ?from)) (t1 (tower ?above ?from ?by ?to)) (t2 (move ?d ?from ?to)))
    :ordering (and (< t1 t2) (< t2 t3)))
  ; a disc may be moved if no smaller one lies on its peg or on the other
  (:action move :parameters (?d - disc ?from ?to - peg)
    :precondition (and (on ?d ?from) (not (= ?from ?to))
      (forall (?s - disc) (or (not (smaller ?s ?d)) (and (not (on ?s ?from)) (not (on ?s ?to))))))
    :effect (and (not (on ?d ?from)) (on ?d ?to)))
)
"""


def towers(n: int) -> Problem:
    discs = [f"d{number}" for number in range(1, n + 1)]
    facts = [f"(on {disc} a)" for disc in discs]
    facts += [f"(smaller {low} {high})" for place, high in enumerate(discs) for low in discs[:place]]
    facts += [f"(next {high} {low})" for low, high in pairwise(discs)]
    problem = f"""(define (problem p) (:domain towers) (:objects a b c - peg {" ".join(discs)} - disc)
      (:htn :ordered-tasks (tower {discs[-1]} a c b)) (:init (least d1) {" ".join(facts)})
      (:goal (forall (?d - disc) (on ?d c))))"""
    return parse(TOWERS, problem)


def solved(problem: Problem, *, cheapest: bool = False) -> Plan:
    found = plan(problem.domain, problem.facts, problem.tasks, goal=problem.goal, cheapest=cheapest)
    assert isinstance(found, Plan)
    verdict = check_plan(problem.domain, problem.facts, problem.tasks, found, goal=problem.goal)
    assert verdict.is_valid, str(verdict)
    return found


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 8])
def test_towers_take_two_to_the_n_less_one_moves(n: int) -> None:
    """M(n) = 2 M(n - 1) + 1, M(1) = 1; the discs are replayed here without any planner."""
    found = solved(towers(n))
    assert len(found.steps) == 2**n - 1
    pegs = {f"d{number}": "a" for number in range(1, n + 1)}
    for task in found.tasks:
        disc, origin, target = task.args
        assert pegs[disc] == origin
        assert not any(pegs[less] in (origin, target) for less in pegs if int(less[1:]) < int(disc[1:]))
        pegs[disc] = target
    assert set(pegs.values()) == {"c"}


@pytest.mark.parametrize("name", ["'+evil+'", '"+evil+"', "\\'+evil+'", '"""+evil', "\\", "x]for", "{evil}"])
def test_what_a_file_says_never_becomes_code(name: str) -> None:
    """Conditions are compiled; predicates, objects, tasks and actions of such a name stand there as texts."""
    domain = TOWERS.replace("least", f"least{name}").replace("(tower ", f"(tower{name} ").replace("move", f"move{name}")
    domain = domain.replace(":task tower ", f":task tower{name} ")
    problem = f"""(define (problem p) (:domain towers) (:objects a b c - peg d1{name} - disc)
      (:htn :ordered-tasks (tower{name} d1{name} a c b)) (:init (on d1{name} a) (least{name} d1{name}))
      (:goal (forall (?d - disc) (on ?d c))))"""
    found = solved(parse(domain, problem))
    assert found.tasks == (Task(f"move{name}", (f"d1{name}", "a", "c")),)


TRANSPORT = """
(define (domain transport)
  (:types vehicle parcel - item number place - object)
  (:predicates (lane ?p ?q - place) (at ?i - item ?p - place) (in ?i - parcel ?v - vehicle)
    (room ?v - vehicle ?n - number) (succ ?n ?m - number))
  (:task deliver :parameters (?i - parcel ?p - place))
  (:task be :parameters (?v - vehicle ?p - place))
  (:method deliver :parameters (?i - parcel ?p ?q - place ?v - vehicle) :task (deliver ?i ?p)
    :ordered-subtasks (and (be ?v ?q) (load ?v ?i ?q) (be ?v ?p) (unload ?v ?i ?p)))
  (:task load :parameters (?v - vehicle ?i - parcel ?p - place))
  (:method load :parameters (?v - vehicle ?i - parcel ?p - place ?n ?m - number) :task (load ?v ?i ?p)
    :ordered-subtasks (pick ?v ?i ?p ?n ?m))
  (:task unload :parameters (?v - vehicle ?i - parcel ?p - place))
  (:method unload :parameters (?v - vehicle ?i - parcel ?p - place ?n ?m - number) :task (unload ?v ?i ?p)
    :ordered-subtasks (drop ?v ?i ?p ?n ?m))
  (:method one :parameters (?v - vehicle ?p ?q - place) :task (be ?v ?p) :ordered-subtasks (sail ?v ?q ?p))
  (:method by :parameters (?v - vehicle ?p ?q - place) :task (be ?v ?p)
    :ordered-subtasks (and (be ?v ?q) (sail ?v ?q ?p)))
  (:method there :parameters (?v - vehicle ?p - place) :task (be ?v ?p) :precondition (at ?v ?p) :ordered-subtasks ())
  (:action sail :parameters (?v - vehicle ?p ?q - place) :precondition (and (at ?v ?p) (lane ?p ?q))
    :effect (and (not (at ?v ?p)) (at ?v ?q)))
  (:action pick :parameters (?v - vehicle ?i - parcel ?p - place ?n ?m - number)
    :precondition (and (at ?v ?p) (at ?i ?p) (succ ?n ?m) (room ?v ?m))
    :effect (and (not (at ?i ?p)) (in ?i ?v) (room ?v ?n) (not (room ?v ?m))))
  (:action drop :parameters (?v - vehicle ?i - parcel ?p - place ?n ?m - number)
    :precondition (and (at ?v ?p) (in ?i ?v) (succ ?n ?m) (room ?v ?n))
    :effect (and (not (in ?i ?v)) (at ?i ?p) (room ?v ?m) (not (room ?v ?n))))
)
"""
DELIVERY = """
(define (problem two) (:domain transport)
  (:objects AUV00 - vehicle P1 P2 - parcel n0 n1 - number base reef wreck bay - place)
  (:htn :parameters () :subtasks (and (t1 (deliver P1 base)) (t2 (deliver P2 wreck))) :ordering (< t1 t2))
  (:init (succ n0 n1) (room AUV00 n1) (at AUV00 bay) (at P1 reef) (at P2 reef)
    (lane base reef) (lane reef base) (lane reef wreck) (lane wreck reef) (lane reef bay) (lane bay reef)
    (lane wreck bay) (lane bay wreck)))
"""


def test_a_recursion_to_the_left_ends_and_the_cheapest_delivery_is_found() -> None:
    """By hand: bay-reef, pick, reef-base, drop, base-reef, pick, reef-wreck, drop: none of the 8 can be left out."""
    problem = parse(TRANSPORT, DELIVERY)
    assert len(solved(problem).steps) >= 8
    cheapest = solved(problem, cheapest=True)
    assert [task.name for task in cheapest.tasks] == ["sail", "pick", "sail", "drop"] * 2
    assert cheapest.tasks[0].args == ("auv00", "bay", "reef")  # HDDL does not tell upper case from lower


def test_only_bindings_are_tried_for_which_the_subtasks_can_succeed() -> None:
    """``deliver`` leaves the vehicle and the place of the parcel open; where the parcel is follows from ``pick``."""
    problem = parse(TRANSPORT, DELIVERY)
    (deliver,) = problem.domain.methods["deliver"]
    found = list(deliver.subtasks(_Facts(problem.facts), "p1", "base"))
    assert [tasks[0].args for tasks in found] == [("auv00", "reef")]


class _Facts(dict[Any, Any]):
    def match(self, pattern: Any) -> Any:
        from remoras.htn import FactIndex

        return FactIndex(self).match(pattern)


def test_everything_that_conditions_and_effects_may_say() -> None:
    """exists, imply, or, a constant, (either), when, and variables of a problem."""
    domain = """
    (define (domain d) (:types auv asv - vehicle lamp) (:constants base - lamp)
      (:predicates (lit ?l - lamp) (near ?v - (either auv asv) ?l - lamp) (seen ?v - vehicle) (old ?l - lamp))
      (:task show :parameters (?v - vehicle))
      (:method show :parameters (?v - vehicle) :task (show ?v)
        :precondition (and (exists (?l - lamp) (near ?v ?l)) (imply (seen ?v) (lit base))
          (or (lit base) (not (seen ?v))))
        :ordered-subtasks (and (light ?v)))
      (:action light :parameters (?v - vehicle)
        :effect (and (seen ?v) (forall (?l - lamp) (when (and (near ?v ?l) (not (old ?l))) (lit ?l))))))
    """
    problem = """(define (problem p) (:domain d) (:objects a - auv s - asv red green - lamp)
      (:htn :parameters (?v - asv) :ordered-subtasks (and (show ?v)))
      (:init (near a red) (near s green) (near s base) (old base)) (:goal (and (lit green) (not (lit base)))))"""
    read = parse(domain, problem)
    found = solved(read)
    assert [str(task) for task in found.tasks] == ["light(s)"]
    assert read.goal == {("lit", "green"): True, ("lit", "base"): False}
    unmet = {**read.goal, ("lit", "base"): True}
    assert isinstance(plan(read.domain, read.facts, read.tasks, goal=unmet), NoPlan)


def test_a_wrong_plan_for_hddl_is_caught() -> None:
    problem = towers(2)
    found = solved(problem)
    nodes = [
        node._replace(task=Task("move", ("d2", "a", "b"))) if node.method is None else node for node in found.nodes
    ]
    verdict = check_plan(
        problem.domain, problem.facts, problem.tasks, Plan(tuple(nodes), found.rests_on, cost=found.cost)
    )
    assert "move(d2, a, b) is not possible where it stands" in str(verdict)
    assert "method 'one' does not turn tower(d1, a, b, c) into move(d2, a, b)" in str(verdict)


# Against the same domain by hand ----------------------------------------------------------------

edges = st.sets(st.tuples(st.sampled_from("abcd"), st.sampled_from("abcd")), max_size=8)


def _routes(roads: set[tuple[str, str]]) -> Domain:
    """``be`` of the transport domain, written as Python functions that know the roads."""

    def applicable(facts: Any, origin: str, target: str) -> bool:
        return (origin, target) in roads and facts.get("at") == origin

    def last_leg(facts: Any, target: str) -> Any:
        return ([Task("sail", (origin, target))] for origin in "abcd")

    def legs(facts: Any, target: str) -> Any:
        return ([Task("be", (origin,)), Task("sail", (origin, target))] for origin in "abcd")

    return Domain.of(
        [Operator("sail", applicable, lambda facts, origin, target: {"at": target})],
        {"be": [
            Method("one", last_leg), Method("by", legs),
            Method("there", lambda facts, target: [], lambda facts, target: facts.get("at") == target),
        ]},
    )  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(edges, st.sampled_from("abcd"))
def test_the_cheapest_route_is_that_of_a_domain_written_by_hand(roads: set[tuple[str, str]], target: str) -> None:
    """What the needs of subtasks leave out is nothing that a plan could use."""
    lanes = " ".join(f"(lane {origin} {end})" for origin, end in sorted(roads))
    text = f"""(define (problem p) (:domain transport) (:objects v - vehicle a b c d - place)
      (:htn :ordered-subtasks (and (be v {target}))) (:init (at v a) {lanes}))"""
    problem = parse(TRANSPORT, text)
    costs = []
    for domain, facts, tasks in (
        (problem.domain, problem.facts, problem.tasks),
        (_routes(roads), {"at": "a"}, (Task("be", (target,)),)),
    ):
        costs.append(_cost(domain, facts, tasks))
    assert costs[0] == costs[1]


def _cost(domain: Domain, facts: Mapping[Any, Any], tasks: Any) -> float | None:
    try:
        found = plan(domain, facts, tasks, cheapest=True, max_expansions=3000)
    except PlanningError:
        return None
    return found.cost if isinstance(found, Plan) else None


# Faults -----------------------------------------------------------------------------------------

SMALL = """(define (domain d) (:types place) (:predicates (at ?p - place))
(:task go :parameters (?p - place))
(:action sail :parameters (?p - place)
  :precondition (at ?p) :effect (not (at ?p)))
(:method m :parameters (?p - place) :task (go ?p)
  :ordered-subtasks (and (sail ?p))))"""
ONE = """(define (problem p) (:domain d) (:objects x - place)
(:htn :ordered-subtasks (and (go x)))
(:init (at x)))"""


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("(sail ?p))))", "(sial ?p))))", r"domain:6: task sial is not declared; declared: go, sail"),
        ("(sail ?p))))", "(sail ?p ?p))))", r"domain:6: task sail takes 1 terms, not 2"),
        ("(sail ?p))))", "(sail ?q))))", r"domain:6: variable \?q is not declared; declared: \?p"),
        ("(sail ?p))))", "(sail ?p)))", r"domain:1: this parenthesis is never closed"),
        ("(sail ?p))))", "(sail ?p)))))", r"domain:6: '\)' stands behind the end"),
        (":precondition (at ?p)", ":precondition (in ?p)", r"domain:4: predicate in is not declared; declared: at"),
        (":precondition (at ?p)", ":precondition (at)", r"domain:4: at takes 1 terms, not 0"),
        (":precondition", ":preconditon", r"domain:4: :preconditon is not known here; allowed: :parameters, :prec"),
        ("(?p - place)\n  :precondition", "(?p - plaice)\n  :precondition",
         r"domain:3: type plaice is not declared; declared: object, place"),
        (":ordered-subtasks (and (sail ?p))",
         ":subtasks (and (t1 (sail ?p)) (t2 (sail ?p))) :ordering (and (< t1 t2) (< t2 t1))",
         r"domain:6: subtasks t1, t2 go round in a circle"),
        (":effect (not (at ?p))", ":effect (increase (total-cost) 1)",
         r"domain:4: \(increase .* is no effect; allowed: and"),
        ("(and (sail ?p))", "(and (go ?p))", r"endless recursion: every method of go leads to go > go"),
        ("(at x)", "(at y)", r"problem:3: object y is not declared; declared: x"),
        ("(and (go x))", "(and (go))", r"problem:2: task go takes 1 terms, not 0"),
        ("(:init (at x)))", "(:init (at x)) (:goal (or (at x) (at x))))", r"problem: :goal: a goal is made of atoms"),
        ("(problem p)", "(domain p)", r"problem:1: this defines a domain, expected was a problem"),
        ("(:init", "(:inti", r"problem:3: :inti is not known; allowed: :domain, :requirements, :objects, :htn"),
    ],
)  # fmt: skip
def test_faults_are_told_with_file_and_line(before: str, after: str, message: str) -> None:
    assert solved(parse(SMALL, ONE)).steps
    assert before in SMALL + ONE
    with pytest.raises(PlanningError, match=message):
        parse(SMALL.replace(before, after), ONE.replace(before, after))


PARTLY = """(define (domain d) (:predicates (up) (down))
(:task go :parameters ())
(:action rise :parameters () :precondition (down) :effect (and (not (down)) (up)))
(:action sink :parameters () :precondition (up) :effect (and (not (up)) (down)))
(:action wait :parameters ())
(:method m :parameters () :task (go) :subtasks (and (c (wait)) (b (rise)) (a (sink))) :ordering (ORDERING)))"""


@pytest.mark.parametrize(
    ("ordering", "steps"),
    [
        ("and (< a b) (< a c)", ["sink", "wait", "rise"]),
        ("< a b", ["wait", "sink", "rise"]),
        ("and (< b c) (< a b)", ["sink", "rise", "wait"]),
        ("", []),
    ],
)
def test_what_is_not_ordered_is_put_in_the_order_of_the_file(ordering: str, steps: list[str]) -> None:
    """Without any ordering the file has the steps in an order that cannot be carried out, though another can."""
    read = parse(PARTLY.replace("ORDERING", ordering), "(define (problem p) (:htn :tasks (and (go))) (:init (up)))")
    found = plan(read.domain, read.facts, read.tasks)
    assert [task.name for task in getattr(found, "tasks", ())] == steps
    assert read.is_linearised == (ordering != "and (< b c) (< a b)")


def test_all_faults_of_a_file_are_told_at_once() -> None:
    faulty = SMALL.replace("(at ?p) :effect", "(in ?p) :effect").replace("(sail ?p))))", "(sial ?p))))")
    with pytest.raises(PlanningError) as caught:
        parse(faulty, ONE, domain_file="sea.hddl")
    assert [line.split(" ")[0] for line in str(caught.value).splitlines()] == ["sea.hddl:4:", "sea.hddl:6:"]


def test_comments_and_line_breaks_do_not_matter() -> None:
    spread = "\n".join(f"{word} ; and a comment (" for word in SMALL.split(" "))
    assert solved(parse(textwrap.dedent(spread), ONE)).tasks == (Task("sail", ("x",)),)
