"""Hierarchical task networks: missions, objectives and activities as tasks (Erol, Hendler, Nau 1994).

An *abstract* task has methods, tried in the order in which the domain lists them; a method turns it into a sequence of
tasks, or into one sequence after another if it leaves something open. An *elementary* task has an operator: a test,
and the facts that it makes true. ``plan`` searches depth first, left to right, and backtracks; it returns a
``Plan``, which is the tree of its tasks, or a ``NoPlan``. An ``Execution`` carries a plan out, and plans the branch
anew in which a step fails.

Facts are a read-only mapping from keys to values (``facts.get(key)``). The planner notes every key that the search
looked up: those are the facts the plan *rests on*. If one of them changes, another plan may come out; if none does, the
same plan does.

There is no global domain and no state between calls: any number of planners may run side by side.
"""

from remoras.htn.domain import Domain, Expected, Method, Operator, Task
from remoras.htn.execution import Branch, Execution, Status
from remoras.htn.facts import ANY, FactsLike
from remoras.htn.plans import Node, NoPlan, Plan, Step
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
