"""The search: depth first, left to right, with backtracking; where that loses plans, again with bounded depth.

**One loop in place of recursion**, since a plan may be deeper than Python's stack. Tasks still to be done are a linked
list, the agenda. Every task that is taken from it becomes a node of the plan, so the list of nodes is the tree in
preorder, and going back cuts it. A trail holds what was there before each change, as in a Prolog machine.

**Loops.** A task that has itself among its ancestors, in the same state, can go round for ever, so it is given up
there. Entered tasks are found by task and state; one that is found is an ancestor if the way up from here meets it.
This loses plans in which a task must repeat in one state. So if it has given something up and found nothing, or has
used half of the expansions, the search starts again without this rule and with bounded depth: 8, 16, 32 levels, ...

**No work twice.** Which plans complete an agenda depends on the state alone, as its ancestors do not change. Whoever
comes to the same agenda in the same state a second time has failed there before, and turns back.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from functools import partial
from types import GeneratorType
from typing import Any

from remoras.collecting import rare_collections
from remoras.htn.domain import Decomposition, Domain, Operator, Task, always, nothing
from remoras.htn.errors import endless, unknown_task, wrong_subtasks
from remoras.htn.facts import Facts, FactsLike
from remoras.htn.plans import ROOT, Node, NoPlan, Plan

FIRST_DEPTH = 8
SEQUENCE = (list, tuple)
NO_OTHERS: Iterator[Decomposition] = iter(())

_node = partial(tuple.__new__, Node)
Agenda = list[Any]
"""A task to be done: [task, place of the task above, depth, agenda behind it, states in which it was met]."""
DEAD_END: Agenda = []
Way = tuple[str | None, tuple[Task, ...]]
"""How a task is decomposed: the name of a method, and the subtasks that it gave."""
_Open = tuple[int, int, Any]
"""A task that was entered: its place, the length of the trail, and an earlier one of the same name and arguments."""
_Choice = tuple[Agenda, int, Iterator[Decomposition], int, int, int]
"""Another way after a dead end: agenda, next method, other decompositions of the last one; lengths of nodes, trail and
entered tasks, as they were."""


class _Search:
    """One search.

    Attributes:
        nodes: the plan that was found.
        loop: the first chain of tasks that was given up because it came round to its first task.

    Args:
        domain: operators and methods.
        facts: that hold at first, and again when the search has ended without a plan.
        tasks: to be done.
        depth_limit: tasks that lie deeper are given up; None: loops are given up.
        without: ways that are not to be gone by the tasks asked for.
    """

    def __init__(
        self,
        domain: Domain,
        facts: Facts,
        tasks: Sequence[Task],
        depth_limit: int | None,
        without: Collection[Way],
    ) -> None:
        self.has_ended = False
        self.has_given_up = False
        self.nodes: tuple[Node, ...] | None = None
        self.loop: tuple[Task, ...] = ()
        self._has_turned_back = depth_limit is not None
        self._domain = domain
        self._methods = domain.methods
        self._facts = facts
        self._depth_limit = depth_limit
        self._without = without
        # Nodes and entered tasks lie flat: the fewer objects, the less Python's collector goes through.
        self._tasks: list[Task] = []
        self._taken: list[str | None] = []
        self._parents: list[int] = []
        self._open: dict[Task, _Open] = {}
        self._open_in: dict[tuple[Task, int], int] = {}
        self._entered: list[Any] = []
        self._choices: list[_Choice] = []
        self._agenda = _agenda(tasks, ROOT, 0, None)

    def run(self, max_expansions: int) -> int:
        """Search for the first plan; returns the expansions that it took."""
        operator_of, recursive = self._domain.operators.get, self._domain.recursive
        perform, enter, decompose = self._perform, self._enter, self._decompose
        agenda = self._agenda
        for n_expansions in range(max_expansions):
            if agenda is None:
                self.nodes = tuple(map(_node, zip(self._tasks, self._taken, self._parents, strict=True)))
                self.has_ended = True
                return n_expansions
            if (operator := operator_of(agenda[0][0])) is not None:
                agenda = perform(agenda, operator)
            elif self._depth_limit is not None or agenda[0][0] in recursive:
                agenda = enter(agenda)
            else:
                agenda = decompose(agenda, 0, NO_OTHERS)
            if agenda is DEAD_END:
                agenda = self._turn_back()
                if agenda is DEAD_END:
                    self.has_ended = True
                    return n_expansions + 1
        self._agenda = agenda
        return max_expansions

    def chain(self) -> tuple[Task, ...]:
        """The task at which the search stands, below the abstract tasks that it came from."""
        if not self._agenda:
            return ()
        return (*reversed([task for task, _ in self._above(self._agenda[1])]), self._agenda[0])

    def may_have_missed(self) -> bool:
        """True unless it went through everything."""
        return self.has_given_up or not self.has_ended

    def _perform(self, agenda: Agenda, operator: Operator) -> Agenda | None:
        task, parent, _, behind, _ = agenda
        facts, args = self._facts, task[1]
        if operator.applicable is not always and not operator.applicable(facts, *args):
            return self._dead_end()
        if operator.effects is not nothing:
            facts.make_true(operator.effects(facts, *args))
        self._tasks.append(task)
        self._taken.append(None)
        self._parents.append(parent)
        return behind if not self._has_turned_back or self._is_new(behind) else DEAD_END

    def _enter(self, agenda: Agenda) -> Agenda | None:
        """Decompose a task that is met for the first time, unless that is a loop, or lies too deep."""
        task, parent, depth, _, _ = agenda
        if self._depth_limit is not None:
            if depth >= self._depth_limit:
                self.has_given_up = True
                return self._dead_end()
            return self._decompose(agenda, 0, NO_OTHERS)
        place, n_trail = len(self._tasks), len(self._facts.trail)
        entered = self._open
        try:
            above = before = entered.get(task)
        except TypeError:  # an argument that cannot be compared by hash
            return self._decompose(agenda, 0, NO_OTHERS)
        while above is not None and not self._is_above(above[0], parent):
            above = above[2]  # it is done
        if above is not None:
            loop = above[0] if above[1] == n_trail else self._loop(task, parent, place, above)
            if loop is not None:
                return self._give_up(loop, parent, task)
        self._entered += (entered, task, before)
        entered[task] = (place, n_trail, above)
        return self._decompose(agenda, 0, NO_OTHERS)

    def _loop(self, task: Task, parent: int, place: int, above: _Open) -> int | None:
        """Where the same task was entered in the same state; asked if it is an ancestor and something has changed."""
        if above[2] is None:
            self._note((task, self._facts.word(above[1])), above[0])
        key = task, self._facts.word(len(self._facts.trail))
        before = self._open_in.get(key)
        if before is not None and self._is_above(before, parent):
            return before
        self._note(key, place)
        return None

    def _note(self, key: Any, place: int) -> None:
        """Enter a task with its state, until the search turns back behind this."""
        self._entered += (self._open_in, key, self._open_in.get(key))
        self._open_in[key] = place

    def _give_up(self, before: int, parent: int, task: Task) -> Agenda:
        """``task`` is that at place ``before``, in the same state."""
        self.has_given_up = True
        if not self.loop:
            self.loop = (*reversed([above for above, _ in self._above(parent, before)]), task)
        return self._dead_end()

    def _is_above(self, place: int, parent: int) -> bool:
        """True if the way up from ``parent`` meets ``place``."""
        while parent > place:
            parent = self._parents[parent]
        return parent == place

    def _decompose(self, agenda: Agenda, next_method: int, others: Iterator[Decomposition]) -> Agenda | None:
        """Take the next decomposition of a task: another of the same method, or one of the methods after it."""
        task, parent, depth, behind, _ = agenda
        name, args = task
        facts = self._facts
        methods = self._methods.get(name)
        if methods is None:
            raise unknown_task(task, self._domain)
        barred = self._without if parent == ROOT else ()
        while True:
            subtasks: Any = None if others is NO_OTHERS else next(others, None)
            if subtasks is None:
                if next_method == len(methods):
                    return self._dead_end()
                method = methods[next_method]
                next_method += 1
                others = NO_OTHERS
                if method.applicable is not always and not method.applicable(facts, *args):
                    continue
                found: Any = method.subtasks(facts, *args)
                if found.__class__ is GeneratorType or (found.__class__ is not list and isinstance(found, Iterator)):
                    others = found
                    continue
                subtasks = found
            else:
                method = methods[next_method - 1]
            if subtasks.__class__ is not list and not isinstance(subtasks, SEQUENCE):
                raise wrong_subtasks(method, task, subtasks)
            if not barred or (method.name, tuple(subtasks)) not in barred:
                break
        place = len(self._tasks)
        if others is not NO_OTHERS or next_method < len(methods):
            n_trail, n_entered = len(facts.trail), len(self._entered)
            self._choices.append((agenda, next_method, others, place, n_trail, n_entered))
        self._tasks.append(task)
        self._taken.append(method.name)
        self._parents.append(parent)
        if not subtasks:
            return behind if not self._has_turned_back or self._is_new(behind) else DEAD_END
        depth += 1
        uses = method.uses
        for subtask in reversed(subtasks):
            if subtask.__class__ is not Task or (uses is not None and subtask[0] not in uses):
                raise wrong_subtasks(method, task, subtasks)
            behind = [subtask, place, depth, behind, None]
        return behind  # type: ignore[no-any-return]

    def _turn_back(self) -> Agenda | None:
        """Go on with the last choice that has another way; DEAD_END if there is none."""
        choices, entered = self._choices, self._entered
        while choices:
            agenda, next_method, others, n_nodes, n_trail, n_entered = choices.pop()
            del self._tasks[n_nodes:], self._taken[n_nodes:], self._parents[n_nodes:]
            self._facts.undo(n_trail)
            while len(entered) > n_entered:
                where, key, before = entered[-3:]
                del entered[-3:]
                if before is None:
                    del where[key]
                else:
                    where[key] = before
            found = self._decompose(agenda, next_method, others)
            if found is not DEAD_END:
                return found
        return DEAD_END

    def _is_new(self, agenda: Agenda | None) -> bool:
        """True unless the search came to this agenda in this state before."""
        # It comes here again only by a choice below the task of which this is the rest: that one finds it noted.
        if agenda is None or (agenda[4] is None and not (self._choices and self._choices[-1][3] > agenda[1])):
            return True
        word = self._facts.word(len(self._facts.trail))
        if agenda[4] is None:
            agenda[4] = {word}
        elif word in agenda[4]:
            return False
        else:
            agenda[4].add(word)
        return True

    def _above(self, place: int, highest: int = 0) -> Iterator[tuple[Task, int]]:
        """The task at ``place`` and the abstract tasks above it, with their places, as far up as ``highest``."""
        while place >= highest:
            yield self._tasks[place], place
            place = self._parents[place]

    def _dead_end(self) -> Agenda:
        self._has_turned_back = True
        return DEAD_END


def _agenda(tasks: Sequence[Task], place: int, depth: int, behind: Agenda | None) -> Agenda | None:
    for task in reversed(tasks):
        behind = [task, place, depth, behind, None]
    return behind


@rare_collections()
def plan(
    domain: Domain,
    facts: FactsLike,
    tasks: Task | Sequence[Task],
    *,
    max_expansions: int = 200_000,
    without: Collection[Way] = (),
) -> Plan | NoPlan:
    """Decompose tasks into elementary tasks.

    Args:
        domain: operators and methods.
        facts: what is known; only looked up, never changed.
        tasks: to be done, one or several in order.
        max_expansions: bound on the tasks looked at; if it is reached without a plan, that is a PlanningError.
        without: ways, each a method's name and the subtasks that it gave, by which the tasks asked for are not to be
            decomposed, though tasks below them may be.

    Returns:
        The first plan found, methods and decompositions in their order; or NoPlan.

    Raises:
        PlanningError: a task is not in the domain, or the bound is reached; with the chain of an endless recursion.

    >>> from remoras.htn.domain import Method
    >>> domain = Domain.of([Operator("dive"), Operator("map")], {"survey": [
    ...     Method("deep", lambda facts: [Task("dive"), Task("map")], lambda facts: facts.get("deep"))]})
    >>> [str(task) for task in plan(domain, {"deep": True}, Task("survey")).tasks]
    ['dive()', 'map()']
    >>> plan(domain, {}, Task("survey")).rests_on
    frozenset({'deep'})
    """
    wanted = (tasks,) if isinstance(tasks, Task) else tuple(tasks)
    view = Facts(facts)
    first = search = _Search(domain, view, wanted, None, without)
    left = max_expansions - search.run(max_expansions - max_expansions // 2)
    depth_limit = FIRST_DEPTH
    while search.nodes is None and search.may_have_missed() and left > 0:
        view.undo(0)
        search = _Search(domain, view, wanted, depth_limit, without)
        left -= search.run(left)
        depth_limit *= 2
    if search.nodes is None and search.may_have_missed():
        raise endless(wanted, max_expansions, first.loop, first.chain())
    rests_on = frozenset(view.read | view.compared)
    return NoPlan(wanted[0], rests_on) if search.nodes is None else Plan(search.nodes, rests_on)
