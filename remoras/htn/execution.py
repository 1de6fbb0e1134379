"""Execution of a plan as a tree, with replanning of the branch of a failed step.

Steps start in plan order without waiting for each other's end: preconditions express dependencies. A step whose
precondition does not hold waits while an earlier step runs, else it has failed; it ends when its effects hold. Both are
evaluated on the facts of the executing vehicle, not on the planner's forecast.

A failure ascends to the lowest ancestor with another method or decomposition, given the current facts. Only that branch
is replanned, so the cost depends on the branch, not on the length of the plan.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from remoras.htn.domain import ROOT, Domain, Expected, FactsLike, Key, NoPlan, Operator, Plan, Step, Task, is_met
from remoras.htn.search import Way, plan


class Status(StrEnum):
    """Status of a task."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    DROPPED = "dropped"
    """No longer part of the plan."""


_Effects = tuple[tuple[Key, Any], ...]
FINAL = frozenset({Status.DONE, Status.FAILED, Status.DROPPED})


@dataclass(slots=True)
class Branch:
    """Task of a plan in execution; ``method`` is None if elementary.

    ``children`` are the current subtasks, ``tried`` the failed decompositions. ``status`` is valid for elementary,
    failed and dropped tasks, see ``Execution.statuses``. ``expected`` effort is set at the start.
    """

    task: Task
    method: str | None
    parent: int
    children: list[int] = field(default_factory=list)
    status: Status = Status.WAITING
    expected: Expected | None = None
    tried: list[Way] = field(default_factory=list)


class Execution:
    """One plan in execution; ``version`` counts its changes.

    ``branches`` are all tasks ever planned, parents first; ``rests_on`` the keys of the facts read by planning.

    >>> from remoras.htn.domain import Method, Operator
    >>> domain = Domain.of([Operator("dive", effects=lambda facts: {"deep": True})],
    ...                    {"go": [Method.fixed("down", "dive")]})
    >>> under_way, facts = Execution(domain, plan(domain, {}, Task("go"))), {}
    >>> [str(step.task) for step in under_way.advance(facts)]
    ['dive()']
    >>> facts["deep"] = True
    >>> under_way.settle(facts), [status.value for status in under_way.statuses()]
    (True, ['done', 'done'])
    """

    def __init__(self, domain: Domain, plan: Plan) -> None:
        self.branches: list[Branch] = []
        self.rests_on: frozenset[Any] = frozenset()
        self.version = 0
        self._domain = domain
        self._roots: list[int] = []
        self._waiting: list[int] = []  # steps, the next one last
        self._running: dict[int, _Effects | None] = {}  # None: until dropped
        self.renew(plan)

    # Plans ---------------------------------------------------------------------------------------

    def renew(self, plan: Plan) -> None:
        """Switch to a new plan; common tasks keep their indices, all steps are re-evaluated."""
        self._running, self._waiting, self._roots = {}, [], []
        self.rests_on = frozenset()
        self._take(plan, range(len(self.branches)), [])

    def _take(self, plan: Plan, former: Iterable[int], places: list[int]) -> None:
        branches, mended, former = self.branches, bool(places), list(former)
        shared: dict[Any, list[int]] = {}
        for place in reversed(former):
            # A failed step keeps its index, so that its retry is a step of its own in the record.
            if branches[place].method is not None or branches[place].status is not Status.FAILED:
                _alike(shared, branches[place].parent, branches[place].task).append(place)
        for number, (task, method, above) in enumerate(plan.nodes):
            if number == len(places):
                parent = ROOT if above == ROOT else places[above]
                alike = _alike(shared, parent, task) if shared else []
                places.append(alike.pop() if alike and branches[alike[-1]].task == task else self._add(task, parent))
                (self._roots if parent == ROOT else branches[parent].children).append(places[-1])
            branch = branches[places[number]]
            branch.method, branch.children = method, []
            # Facts show whether steps with effects are done. One without effects leaves no trace: a repair must not
            # repeat it.
            is_done_for_good = mended and method is None and not self._operator(branch).has_effects
            if branch.status is not Status.DONE or not is_done_for_good:
                branch.status = Status.WAITING
        # Children before parents: the last status of a parent depends on theirs.
        kept = set(places)
        for place in reversed(former):
            if place not in kept and branches[place].status not in FINAL:
                branches[place].status = self._last(place)
        self._waiting += [
            place
            for place in reversed(places)
            if branches[place].method is None and branches[place].status is Status.WAITING
        ]
        if not plan.rests_on <= self.rests_on:
            self.rests_on |= plan.rests_on
        self.version += 1

    def _add(self, task: Task, parent: int) -> int:
        self.branches.append(Branch(task, None, parent))
        return len(self.branches) - 1

    def _operator(self, branch: Branch) -> Operator:
        return self._domain.operators[branch.task.name]

    def _last(self, place: int) -> Status:
        children = self.branches[place].children
        is_done = children and all(self.branches[child].status is Status.DONE for child in children)
        return Status.DONE if is_done else Status.DROPPED

    def abandon(self) -> None:
        """Drop all unfinished tasks."""
        for place in reversed(range(len(self.branches))):
            if self.branches[place].status not in FINAL:
                self.branches[place].status = self._last(place)
        self._waiting.clear()
        self._running.clear()
        self.version += 1

    # Execution -----------------------------------------------------------------------------------

    @property
    def is_waiting(self) -> bool:
        """True while some steps have not started."""
        return bool(self._waiting)

    @property
    def has_failed(self) -> bool:
        """True if a root task has no alternative left."""
        return any(self.branches[root].status is Status.FAILED for root in self._roots)

    @property
    def running(self) -> list[Step]:
        """Running steps, in order of their start."""
        return [Step(self.branches[place].task, place) for place in self._running]

    @property
    def awaited(self) -> frozenset[Any]:
        """Keys of the effects of running steps."""
        return frozenset(key for effects in self._running.values() for key, _ in effects or ())

    def settle(self, facts: FactsLike) -> bool:
        """End all running steps with effects that hold; True if any ended."""
        ended = [place for place, effects in self._running.items() if effects is not None and is_met(facts, effects)]
        for place in self._running:
            self._expect(place, facts)
        for place in ended:
            self._end(place)
        return bool(ended)

    def _expect(self, place: int, facts: FactsLike) -> None:
        branch = self.branches[place]
        if branch.expected is None and (expected := self._operator(branch).expected) is not None:
            branch.expected = expected(facts, *branch.task.args)
            self.version += branch.expected is not None

    def _end(self, place: int) -> None:
        del self._running[place]
        self.branches[place].status = Status.DONE
        self.version += 1

    def advance(self, facts: FactsLike) -> Iterator[Step]:
        """Start all ready steps; the caller executes or begins each before requesting the next."""
        self.settle(facts)
        while self._waiting:
            place = self._waiting[-1]
            branch = self.branches[place]
            operator = self._operator(branch)
            if not operator.applicable(facts, *branch.task.args):
                # A running step may still make the precondition true; without one it stays false.
                if self._running or not self.fail(place, facts):
                    return
                continue
            self._waiting.pop()
            effects = None if operator.lasts else tuple(operator.effects(facts, *branch.task.args).items())
            self._running[place] = effects
            # Effects that hold already: after replanning, this step was done before.
            if effects and is_met(facts, effects):
                self._end(place)
                continue
            branch.status = Status.RUNNING
            self._expect(place, facts)
            self.version += 1
            yield Step(branch.task, place)
            # The caller may have performed, failed or dropped the step meanwhile.
            if effects is not None and place in self._running and is_met(facts, effects):
                self._end(place)

    # Repair --------------------------------------------------------------------------------------

    def fail(self, place: int, facts: FactsLike) -> bool:
        """Fail a step and replan the lowest ancestor with an alternative; False if none has one."""
        self.branches[place].status, self.branches[place].expected = Status.FAILED, None
        self._running.pop(place, None)
        while (place := self.branches[place].parent) != ROOT:
            branch = self.branches[place]
            # The subtasks identify the decomposition, since one method may yield several.
            branch.tried.append((branch.method, tuple(self.branches[child].task for child in branch.children)))
            repair = plan(self._domain, facts, branch.task, without=branch.tried)
            if isinstance(repair, NoPlan):
                self.rests_on |= repair.rests_on
                branch.status = Status.FAILED
                continue
            below = self._below(place)
            for descendant in below:
                self._running.pop(descendant, None)
            # Steps start in plan order, so the waiting ones of this branch come next.
            while self._waiting and self._waiting[-1] in below:
                self._waiting.pop()
            self._take(repair, below, [place])
            return True
        self.abandon()
        return False

    def plan_anew(self, facts: FactsLike, task: Task) -> Plan | NoPlan:
        """Plan the root ``task`` without its failed decompositions."""
        tried = [way for root in self._roots if self.branches[root].task == task for way in self.branches[root].tried]
        return plan(self._domain, facts, task, without=tried)

    def _below(self, place: int) -> dict[int, None]:
        below: dict[int, None] = {}
        left = self.branches[place].children[::-1]
        while left:
            below[left[-1]] = None
            left += self.branches[left.pop()].children[::-1]
        return below

    # Inspection ---------------------------------------------------------------------------------

    def statuses(self) -> list[Status]:
        """Return the status of every task, derived from its steps if abstract."""
        statuses = [branch.status for branch in self.branches]
        for place in reversed(range(len(statuses))):
            branch = self.branches[place]
            if branch.method is None or branch.status in FINAL:
                continue
            below = {statuses[child] for child in branch.children}
            if below <= {Status.DONE}:
                statuses[place] = Status.DONE
            elif below - {Status.WAITING}:
                statuses[place] = Status.RUNNING
        return statuses


def _alike(shared: dict[Any, list[int]], parent: int, task: Task) -> list[int]:
    """Candidate indices below ``parent``, first one last; by name if an argument is unhashable."""
    try:
        return shared.setdefault((parent, task), [])
    except TypeError:
        return shared.setdefault((parent, task.name), [])
