"""Execution: a plan is carried out as the tree that it is, and where a step fails, its branch is planned anew.

**Order.** Steps start in the order of the plan, and do not wait for each other's end: what a step needs of earlier ones
is said by its test. A step whose test does not hold waits while an earlier one is running, which may bring it about;
with none running it has failed. So a plan in another order fails, or its steps do not depend on each other.

**Test and effects** are asked of the facts of whoever carries the plan out, not of what the planner foresaw. A step has
ended when its effects hold. One whose effects hold before it starts is done without being carried out, so nothing is
done twice, however often a branch is planned.

**Repair.** A failure climbs to the lowest task above that can be achieved in another way, in the facts as they are now:
by another method, or by another decomposition of the same. Only that branch is planned anew. What is done stays done,
and no step outside the branch is looked at, so a repair costs as much as its branch, however long the plan is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from remoras.htn.domain import Domain, Expected, Operator, Task
from remoras.htn.facts import FactsLike, Key, is_met
from remoras.htn.plans import ROOT, NoPlan, Plan, Step
from remoras.htn.search import Way, plan


class Status(StrEnum):
    """How far a task is."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    DROPPED = "dropped"
    """The plan has it no longer."""


_Effects = tuple[tuple[Key, Any], ...]
FINAL = frozenset({Status.DONE, Status.FAILED, Status.DROPPED})


@dataclass(slots=True)
class Branch:
    """A task of a plan under way.

    Attributes:
        task: the task; method: by which it is achieved, None if it is elementary.
        parent: place of the task above, or ROOT.
        children: places of the tasks that it is decomposed into now; those of earlier ways are not among them.
        status: of an elementary task, and of one that has failed or that the plan has no longer; of others see
            ``Execution.statuses``.
        expected: what the task was expected to take when it started; None if it has not, or nobody can tell.
        tried: ways by which it was not achieved.
    """

    task: Task
    method: str | None
    parent: int
    children: list[int] = field(default_factory=list)
    status: Status = Status.WAITING
    expected: Expected | None = None
    tried: list[Way] = field(default_factory=list)


class Execution:
    """One plan under way.

    Attributes:
        branches: every task that the plan has had, each behind the task above it; a place does not change.
        rests_on: keys of the facts that planning has looked up.
        version: grows with every change.

    Args:
        domain: operators and methods.
        plan: to be carried out.

    >>> from remoras.htn.domain import Method, Operator
    >>> domain = Domain.of([Operator("dive", effects=lambda facts: {"deep": True})],
    ...                    {"go": [Method.fixed("down", "dive")]})
    >>> made = plan(domain, {}, Task("go"))
    >>> under_way, facts = Execution(domain, made), {}
    >>> [str(step.task) for step in under_way.advance(facts)]
    ['dive()']
    >>> [status.value for status in under_way.statuses()]
    ['running', 'running']
    >>> facts["deep"] = True
    >>> under_way.settle(facts)
    True
    >>> [status.value for status in under_way.statuses()]
    ['done', 'done']
    """

    def __init__(self, domain: Domain, plan: Plan) -> None:
        self.branches: list[Branch] = []
        self.rests_on: frozenset[Any] = frozenset()
        self.version = 0
        self._domain = domain
        self._roots: list[int] = []
        self._waiting: list[int] = []  # steps, the next one last
        self._running: dict[int, _Effects | None] = {}  # None: the step goes on
        self.renew(plan)

    # Plans ---------------------------------------------------------------------------------------

    def renew(self, plan: Plan) -> None:
        """Go over to a plan for the whole; tasks that it shares with the one before stay where they are.

        Every step has its turn once more; those whose effects hold are done without being carried out.
        """
        self._running, self._waiting, self._roots = {}, [], []
        self.rests_on = frozenset()
        self._take(plan, range(len(self.branches)), [])

    def _take(self, plan: Plan, former: Iterable[int], places: list[int]) -> None:
        """Put the nodes of a plan in the place of tasks; tasks in both stay where they are, but for failed steps.

        Args:
            plan: made anew, for the whole or for a branch.
            former: places of the tasks that it replaces.
            places: of its first node, if it has one: that of the branch which is mended.
        """
        branches, mended, former = self.branches, bool(places), list(former)
        shared: dict[Any, list[int]] = {}
        for place in reversed(former):
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
            if branch.status is not Status.DONE or not (mended and self._is_done_for_good(branch)):
                branch.status = Status.WAITING
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

    def _is_done_for_good(self, branch: Branch) -> bool:
        """True of an elementary task without effects: nobody could see that it has to be done again."""
        return branch.method is None and not self._operator(branch).has_effects

    def _last(self, place: int) -> Status:
        """What becomes of a task that the plan has no longer: an abstract one whose steps are done is done."""
        children = self.branches[place].children
        is_done = children and all(self.branches[child].status is Status.DONE for child in children)
        return Status.DONE if is_done else Status.DROPPED

    def abandon(self) -> None:
        """Leave undone whatever is not done."""
        for place in reversed(range(len(self.branches))):
            if self.branches[place].status not in FINAL:
                self.branches[place].status = self._last(place)
        self._waiting.clear()
        self._running.clear()
        self.version += 1

    # Carrying out --------------------------------------------------------------------------------

    @property
    def is_waiting(self) -> bool:
        """True while there are steps that have not started."""
        return bool(self._waiting)

    @property
    def has_failed(self) -> bool:
        """True if a task that was asked for has no other way."""
        return any(self.branches[root].status is Status.FAILED for root in self._roots)

    @property
    def running(self) -> list[Step]:
        """Steps that have started and not ended, in the order in which they started."""
        return [Step(self.branches[place].task, place) for place in self._running]

    @property
    def awaited(self) -> frozenset[Any]:
        """Keys of the effects of running steps."""
        return frozenset(key for effects in self._running.values() for key, _ in effects or ())

    def settle(self, facts: FactsLike) -> bool:
        """End all running steps whose effects hold; True if there were some."""
        ended = [place for place, effects in self._running.items() if effects is not None and is_met(facts, effects)]
        for place in self._running:
            self._expect(place, facts)
        for place in ended:
            self._end(place)
        return bool(ended)

    def _expect(self, place: int, facts: FactsLike) -> None:
        """Ask what a step is expected to take, until somebody can tell."""
        branch = self.branches[place]
        if branch.expected is None:
            branch.expected = self._operator(branch).expected(facts, *branch.task.args)
            self.version += branch.expected is not None

    def _end(self, place: int) -> None:
        del self._running[place]
        self.branches[place].status = Status.DONE
        self.version += 1

    def advance(self, facts: FactsLike) -> Iterator[Step]:
        """Start every step whose turn it is; each is to be carried out, or begun, before the next is asked for."""
        self.settle(facts)
        while self._waiting:
            place = self._waiting[-1]
            branch = self.branches[place]
            operator = self._operator(branch)
            if not operator.applicable(facts, *branch.task.args):
                if self._running or not self.fail(place, facts):
                    return
                continue
            self._waiting.pop()
            effects = None if operator.lasts else tuple(operator.effects(facts, *branch.task.args).items())
            self._running[place] = effects
            if effects and is_met(facts, effects):
                self._end(place)
                continue
            branch.status = Status.RUNNING
            self._expect(place, facts)
            self.version += 1
            yield Step(branch.task, place)
            if effects is not None and place in self._running and is_met(facts, effects):
                self._end(place)

    # Repair --------------------------------------------------------------------------------------

    def fail(self, place: int, facts: FactsLike) -> bool:
        """The step at ``place`` has failed: plan the lowest branch above it anew that has another way.

        Args:
            place: of a step.
            facts: as they are now.

        Returns:
            True if there is another way, which ``advance`` goes; False if the whole has failed.
        """
        self.branches[place].status, self.branches[place].expected = Status.FAILED, None
        self._running.pop(place, None)
        while (place := self.branches[place].parent) != ROOT:
            branch = self.branches[place]
            branch.tried.append((branch.method, tuple(self.branches[child].task for child in branch.children)))
            found = plan(self._domain, facts, branch.task, without=branch.tried)
            if isinstance(found, NoPlan):
                self.rests_on |= found.rests_on
                branch.status = Status.FAILED
                continue
            below = self._below(place)
            for one in below:
                self._running.pop(one, None)
            while self._waiting and self._waiting[-1] in below:
                self._waiting.pop()
            self._take(found, below, [place])
            return True
        self.abandon()
        return False

    def plan_anew(self, facts: FactsLike, task: Task) -> Plan | NoPlan:
        """A plan for ``task``, the whole, that goes none of the ways which have failed."""
        tried = [way for root in self._roots if self.branches[root].task == task for way in self.branches[root].tried]
        return plan(self._domain, facts, task, without=tried)

    def _below(self, place: int) -> dict[int, None]:
        """Places of all tasks below one, each behind the task above it."""
        found: dict[int, None] = {}
        left = self.branches[place].children[::-1]
        while left:
            found[left[-1]] = None
            left += self.branches[left.pop()].children[::-1]
        return found

    # Looking at it -------------------------------------------------------------------------------

    def statuses(self) -> list[Status]:
        """The status of every task: of an abstract one that of its steps."""
        found = [branch.status for branch in self.branches]
        for place in reversed(range(len(found))):
            branch = self.branches[place]
            if branch.method is None or branch.status in FINAL:
                continue
            below = {found[child] for child in branch.children}
            if below <= {Status.DONE}:
                found[place] = Status.DONE
            elif below - {Status.WAITING}:
                found[place] = Status.RUNNING
        return found


def _alike(shared: dict[Any, list[int]], parent: int, task: Task) -> list[int]:
    """Places, the first one last, of the tasks below ``parent`` that may equal ``task``.

    Those are of the same name where an argument cannot be compared by hash.
    """
    try:
        return shared.setdefault((parent, task), [])
    except TypeError:
        return shared.setdefault((parent, task.name), [])
