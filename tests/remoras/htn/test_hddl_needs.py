"""What HDDL methods need is worked out before: that loses no plan, whatever actions add, delete and ask for."""

from typing import Any
from unittest.mock import patch

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.htn import NoPlan, check_plan, plan
from remoras.htn.hddl import grounding, parse

ATOMS = st.builds("({} {})".format, st.sampled_from(["p", "q", "r"]), st.sampled_from(["?x", "?y", "one"]))
LITERALS = st.one_of(ATOMS, ATOMS.map("(not {})".format))
CONDITIONS = st.lists(LITERALS, max_size=2).map(lambda found: f"(and {' '.join(found)})")
N_ACTIONS, N_TASKS = 3, 3


@st.composite
def domains(draw: st.DrawFn) -> str:
    """Three actions, and three tasks of which each has up to two methods; a subtask is an action or a later task."""
    parts = []
    for action in range(N_ACTIONS):
        parts.append(
            f"(:action a{action} :parameters (?x ?y) :precondition {draw(CONDITIONS)} :effect {draw(CONDITIONS)})"
        )
    for task in range(N_TASKS):
        parts.append(f"(:task t{task} :parameters (?x ?y))")
        below = [f"a{action}" for action in range(N_ACTIONS)] + [f"t{later}" for later in range(task + 1, N_TASKS)]
        for number in range(draw(st.integers(1, 2))):
            subtasks = draw(
                st.lists(
                    st.builds(
                        "({} {} {})".format, st.sampled_from(below), *[st.sampled_from(["?x", "?y", "?z", "two"])] * 2
                    ),
                    max_size=3,
                )
            )
            parts.append(
                f"(:method m{task}{number} :parameters (?x ?y ?z) :task (t{task} ?x ?y) "
                f":precondition {draw(CONDITIONS)} :ordered-subtasks (and {' '.join(subtasks)}))"
            )
    return f"(define (domain d) (:constants one two) (:predicates (p ?x) (q ?x) (r ?x)) {' '.join(parts)})"


facts = st.sets(st.builds("({} {})".format, st.sampled_from(["p", "q", "r"]), st.sampled_from(["one", "two"])))


@given(domains(), facts)
def test_working_out_what_methods_need_loses_no_plan(domain: str, holding: set[str]) -> None:
    problem = f"(define (problem p) (:domain d) (:htn :ordered-tasks (t0 one two)) (:init {' '.join(sorted(holding))}))"

    def nothing(spec: Any, objects: Any) -> dict[str, frozenset[Any]]:
        return {method.name: frozenset() for method in spec.methods}

    with patch.object(grounding, "needs_of_methods", nothing):
        unaided = parse(domain, problem)
    read = parse(domain, problem)
    found = plan(read.domain, read.facts, read.tasks)
    expected = plan(unaided.domain, unaided.facts, unaided.tasks)
    assert isinstance(found, NoPlan) is isinstance(expected, NoPlan)
    if not isinstance(found, NoPlan):
        assert str(check_plan(unaided.domain, unaided.facts, unaided.tasks, found)) == "valid"


MOVES = """(define (domain d) (:constants one two) (:predicates (at ?x) (never ?x))
  (:action move :parameters (?x ?y) :precondition (and) :effect (and (not (at ?x)) (at ?y)))
  (:action look :parameters (?x) :precondition (and) :effect (and))
  (:action wish :parameters (?x) :precondition (never ?x) :effect (and))
  (:task see :parameters (?x))
  (:method is_there :parameters (?x) :task (see ?x) :precondition (at ?x) :ordered-subtasks (look ?x))
  (:method is_not :parameters (?x) :task (see ?x) :precondition (not (at ?x)) :ordered-subtasks (wish ?x))
  (:task go :parameters (?x ?y))
  (:method gone :parameters (?x ?y) :task (go ?x ?y) :precondition (not (at ?y)) :ordered-subtasks (and SUBTASKS)))"""


@pytest.mark.parametrize(
    ("subtasks", "task", "steps"),
    [
        ("(move ?x ?y) (see ?y)", "(go one two)", ["move(one, two)", "look(two)"]),  # what was false becomes true
        ("(move ?x ?y) (see ?x)", "(go one one)", ["move(one, one)", "look(one)"]),  # what is added too is not deleted
        ("(move one ?x) (see ?y)", "(go one one)", ["move(one, one)", "look(one)"]),  # two variables, one object
        ("(move ?y ?x) (see ?x)", "(go one two)", ["move(two, one)", "look(one)"]),
        ("(look ?y) (see ?y)", "(go one two)", None),
        ("(see ?y)", "(go one two)", None),
        ("(move ?y ?x) (see ?y)", "(go one two)", None),
    ],
)
def test_what_is_certain_ends_with_what_may_change_it(subtasks: str, task: str, steps: list[str] | None) -> None:
    problem = f"(define (problem p) (:domain d) (:htn :ordered-tasks {task}) (:init))"
    read = parse(MOVES.replace("SUBTASKS", subtasks), problem)
    found = plan(read.domain, read.facts, read.tasks)
    assert (None if isinstance(found, NoPlan) else [str(one) for one in found.tasks]) == steps


def test_names_are_names_whatever_stands_in_them() -> None:
    """They are literals in the functions that are made of a domain, and no part of their code."""
    domain = """(define (domain it's) (:predicates (p'q"\\ ?x') (done))
      (:task do :parameters ()) (:method m"' :parameters (?x') :task (do) :precondition (p'q"\\ ?x')
        :ordered-subtasks (go'+] ?x'))
      (:action go'+] :parameters (?x') :precondition (p'q"\\ ?x') :effect (and (not (p'q"\\ ?x')) (done))))"""
    problem = """(define (problem p) (:domain it's) (:objects o'"\\n{0}) (:htn :ordered-tasks (do))
      (:init (p'q"\\ o'"\\n{0})) (:goal (done)))"""
    read = parse(domain, problem)
    found = plan(read.domain, read.facts, read.tasks, goal=read.goal)
    assert not isinstance(found, NoPlan)
    assert [(task.name, task.args) for task in found.tasks] == [("go'+]", ("o'\"\\n{0}",))]
