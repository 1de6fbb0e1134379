"""Hierarchical task networks: missions and activities as tasks (Erol, Hendler, Nau 1994).

An *abstract* task has methods in order of preference; a method yields a sequence of subtasks, or several sequences if
it leaves variables free. An *elementary* task has an operator: a precondition and effects. ``plan`` searches depth
first, left to right, with backtracking, and returns a ``Plan`` (the task tree) or a ``NoPlan``. An ``Execution``
executes a plan and replans the branch of a failed step. The planner records the facts read, whose values determine the
plan.
"""

from remoras.htn.domain import ANY, Domain, Expected, FactsLike, Method, Node, NoPlan, Operator, Plan, Step, Task
from remoras.htn.execution import Branch, Execution, Status
from remoras.htn.search import plan

__all__ = [
    "ANY",
    "Branch",
    "Domain",
    "Execution",
    "Expected",
    "FactsLike",
    "Method",
    "NoPlan",
    "Node",
    "Operator",
    "Plan",
    "Status",
    "Step",
    "Task",
    "plan",
]
