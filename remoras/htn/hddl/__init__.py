"""HDDL, the language of the International Planning Competition for hierarchical problems, as input.

Plans are in total order. Subtasks that a file leaves unordered are put in the order of the file, as far as its ordering
allows: what is planned so is a plan of the problem too, but plans that need another order, or take turns, are lost.

Read are types, constants, predicates, tasks, methods, actions, and of a problem objects, facts, tasks and goal.
Conditions may say and, or, not, imply, forall, exists and =; effects and, not, forall and when.

>>> from remoras.htn import plan
>>> domain = '''(define (domain sea) (:types vehicle place) (:predicates (at ?v - vehicle ?p - place))
...   (:task visit :parameters (?p - place))
...   (:method send :parameters (?v - vehicle ?p ?q - place) :task (visit ?p) :precondition (at ?v ?q)
...     :ordered-subtasks (and (sail ?v ?q ?p)))
...   (:action sail :parameters (?v - vehicle ?p ?q - place) :precondition (at ?v ?p)
...     :effect (and (not (at ?v ?p)) (at ?v ?q))))'''
>>> problem = '''(define (problem one) (:domain sea) (:objects auv - vehicle bay reef - place)
...   (:htn :ordered-subtasks (and (visit reef))) (:init (at auv bay)) (:goal (at auv reef)))'''
>>> read = parse(domain, problem)
>>> [str(task) for task in plan(read.domain, read.facts, read.tasks, goal=read.goal).tasks]
['sail(auv, bay, reef)']
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from remoras.errors import PlanningError
from remoras.htn.domain import Domain, Task
from remoras.htn.facts import FactIndex
from remoras.htn.hddl.conditions import simplified
from remoras.htn.hddl.foresight import Foresight
from remoras.htn.hddl.grounding import ObjectsByType, ground
from remoras.htn.hddl.language import EQUAL, MethodSpec, Subtask
from remoras.htn.hddl.reading import read_domain, read_problem

__all__ = ["Problem", "load", "parse"]
WHOLE = "(problem)"
"""Name of the task, and of its method, that stands for a problem with variables; no file can have such a name."""


@dataclass(frozen=True)
class Problem:
    """A problem to be planned: ``plan(domain, facts, tasks, goal=goal)``, or in turns, with its foresight.

    Attributes:
        foresight: what is known of its tasks before they are planned.
        is_linearised: subtasks that the files leave unordered were put in order; there may be plans in another order.
    """

    domain: Domain
    facts: FactIndex
    tasks: tuple[Task, ...]
    goal: Mapping[Any, Any]
    foresight: Foresight
    is_linearised: bool


def load(domain: Path, problem: Path) -> Problem:
    """The problem in two files.

    Raises:
        PlanningError: every fault, with file, line and what is allowed.
    """
    texts = [path.read_text(encoding="utf-8") for path in (domain, problem)]
    return parse(*texts, domain_file=str(domain), problem_file=str(problem))


def parse(domain: str, problem: str, *, domain_file: str = "domain", problem_file: str = "problem") -> Problem:
    """The problem in two texts.

    Args:
        domain, problem: text of the files.
        domain_file, problem_file: their names, for messages.

    Raises:
        PlanningError: every fault, with file, line and what is allowed.
    """
    spec = read_domain(domain, domain_file)
    given = read_problem(problem, problem_file, spec)
    objects = ObjectsByType(spec, list(given.objects.values()))
    tasks = tuple(Task(task.name, task.terms) for task in given.tasks)
    if given.parameters:
        whole = MethodSpec(WHOLE, given.parameters, Subtask(WHOLE, ()), given.constraints, given.tasks)
        spec = replace(spec, tasks={**spec.tasks, WHOLE: ()}, methods=[*spec.methods, whole])
        tasks = (Task(WHOLE),)
    try:
        literals = list(simplified(given.goal, objects, {}))
    except ValueError as error:
        raise PlanningError(f"{problem_file}: :goal: {error}") from None
    if any(atom.predicate == EQUAL for atom, _ in literals):
        raise PlanningError(f"{problem_file}: :goal: an equality between objects is no goal")
    goal = {(atom.predicate, *atom.terms): is_true for atom, is_true in literals}
    facts = FactIndex({(atom.predicate, *atom.terms): True for atom in given.facts})
    is_linearised = spec.is_linearised or given.is_linearised
    return Problem(ground(spec, objects), facts, tasks, goal, Foresight(spec, objects), is_linearised)
