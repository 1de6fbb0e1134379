"""Depth-first search with backtracking; if that loses plans, iterative deepening.

**Loop instead of recursion**, since a plan may exceed Python's stack. The agenda is a linked list of open tasks. Each
task taken becomes a node, so the node list is the tree in preorder and backtracking truncates it. A trail restores the
state, as in a Prolog machine.

**Cycles.** A task with itself as ancestor in the same state is pruned. Open tasks are looked up by task and state, then
checked for ancestry. This loses plans that must repeat a task in one state. So if something was pruned without a plan,
or after half of the expansions, the search restarts without pruning and with depth limits 8, 16, 32 ...

**No repeated work.** The completions of an agenda depend on the state alone, as its ancestors are fixed. A second visit
of an agenda in the same state backtracks, since the first one failed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from types import GeneratorType
from typing import Any

from remoras.errors import PlanningError
from remoras.htn.domain import (
    ROOT,
    Decomposition,
    Domain,
    Facts,
    FactsLike,
    Method,
    Node,
    NoPlan,
    Operator,
    Plan,
    Task,
    always,
    nothing,
)  # fmt: skip

FIRST_DEPTH = 8
SEQUENCE = (list, tuple)
NO_OTHERS: Iterator[Decomposition] = iter(())

Agenda = list[Any]
"""Open task: [task, parent index, depth, rest of the agenda, states visited with it]."""
DEAD_END: Agenda = []
Way = tuple[str | None, tuple[Task, ...]]
"""Decomposition: method name and its subtasks."""
_Choice = tuple[Agenda, int, Iterator[Decomposition], int, int, int]
"""Choice point: agenda, next method, decompositions left; lengths of nodes, trail, entered."""


class _Search:
    """Depth-first search for one plan, with backtracking.

    Attributes:
        loop: first pruned cycle.

    Args:
        facts: initial state, restored after a search without a plan.
        depth_limit: prunes deeper tasks; None: prunes cycles.
        without: decompositions excluded for root tasks.
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
        # Flat lists: fewer objects mean less work for Python's garbage collector.
        self._tasks: list[Task] = []
        self._taken: list[str | None] = []
        self._parents: list[int] = []
        self._open: dict[tuple[Task, int], int] = {}  # last entered, by task and state
        self._entered: list[tuple[tuple[Task, int], int | None]] = []  # changes of ``_open``: key, index before
        self._choices: list[_Choice] = []
        self._agenda = _agenda(tasks, ROOT, 0, None)

    def run(self, max_expansions: int) -> int:
        operator_of, recursive = self._domain.operators.get, self._domain.recursive
        perform, enter, decompose = self._perform, self._enter, self._decompose
        agenda = self._agenda
        for n_expansions in range(max_expansions):
            if agenda is None:
                self.nodes = tuple(map(Node._make, zip(self._tasks, self._taken, self._parents, strict=True)))
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
        """Current task below its ancestors."""
        if not self._agenda:
            return ()
        return (*reversed([task for task, _ in self._above(self._agenda[1])]), self._agenda[0])

    def may_have_missed(self) -> bool:
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
        """Decompose a task, unless it closes a cycle or is too deep."""
        task, parent, depth, _, _ = agenda
        if self._depth_limit is not None:
            if depth >= self._depth_limit:
                self.has_given_up = True
                return self._dead_end()
            return self._decompose(agenda, 0, NO_OTHERS)
        key = task, self._facts.word(len(self._facts.trail))
        try:
            before = self._open.get(key)
        except TypeError:  # unhashable argument
            return self._decompose(agenda, 0, NO_OTHERS)
        if before is not None and self._is_above(before, parent):  # else it is finished
            return self._give_up(before, parent, task)
        self._entered.append((key, before))
        self._open[key] = len(self._tasks)
        return self._decompose(agenda, 0, NO_OTHERS)

    def _give_up(self, before: int, parent: int, task: Task) -> Agenda:
        self.has_given_up = True
        if not self.loop:
            self.loop = (*reversed([above for above, _ in self._above(parent, before)]), task)
        return self._dead_end()

    def _is_above(self, place: int, parent: int) -> bool:
        """True if ``place`` is an ancestor of, or equals, ``parent``."""
        while parent > place:
            parent = self._parents[parent]
        return parent == place

    def _decompose(self, agenda: Agenda, next_method: int, others: Iterator[Decomposition]) -> Agenda | None:
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
                tasks: Any = method.subtasks(facts, *args)
                if tasks.__class__ is GeneratorType or (tasks.__class__ is not list and isinstance(tasks, Iterator)):
                    others = tasks
                    continue
                subtasks = tasks
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
        choices, entered = self._choices, self._entered
        while choices:
            agenda, next_method, others, n_nodes, n_trail, n_entered = choices.pop()
            del self._tasks[n_nodes:], self._taken[n_nodes:], self._parents[n_nodes:]
            self._facts.undo(n_trail)
            while len(entered) > n_entered:
                key, before = entered.pop()
                if before is None:
                    del self._open[key]
                else:
                    self._open[key] = before
            next_agenda = self._decompose(agenda, next_method, others)
            if next_agenda is not DEAD_END:
                return next_agenda
        return DEAD_END

    def _is_new(self, agenda: Agenda | None) -> bool:
        """True on the first visit of this agenda in this state."""
        # Only a choice point below the preceding task can lead here again, and it finds this record.
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
        """Yield the task at ``place`` and its ancestors with their indices, up to ``highest``."""
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


def plan(
    domain: Domain,
    facts: FactsLike,
    tasks: Task | Sequence[Task],
    *,
    max_expansions: int = 200_000,
    without: Collection[Way] = (),
) -> Plan | NoPlan:
    """Decompose tasks into elementary tasks: first plan in order of methods and decompositions.

    ``max_expansions`` limits the decomposed tasks. ``without`` excludes decompositions of the root tasks only.

    Raises:
        PlanningError: unknown task, or limit exceeded; with the chain of an endless recursion.

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


MAX_CHAIN = 8
"""Maximum number of tasks shown of a chain."""


def unknown_task(task: Task, domain: Domain) -> PlanningError:
    """Return the error for a task that is neither elementary nor abstract."""
    return PlanningError(f"task {task} is not in the domain, which has: {', '.join(domain.tasks())}")


def wrong_subtasks(method: Method, task: Task, subtasks: Any) -> PlanningError:
    """Return the error for ``subtasks`` that are no tasks, or undeclared."""
    if isinstance(subtasks, list | tuple) and all(isinstance(subtask, Task) for subtask in subtasks):
        undeclared = sorted({subtask.name for subtask in subtasks} - set(method.uses or ()))
        return PlanningError(
            f"method {method.name!r} of task {task} uses {', '.join(undeclared)}, and declares only: "
            f"{', '.join(method.uses or ()) or 'nothing'}"
        )
    return PlanningError(
        f"method {method.name!r} of task {task} must return a list of tasks, or an iterator over such lists, "
        f"not {subtasks!r}"
    )


def endless(tasks: Sequence[Task], max_expansions: int, loop: Sequence[Task], chain: Sequence[Task]) -> PlanningError:
    """Return the error for an exhausted limit, with the recursion found or the last chain."""
    again = next((i for i in range(len(chain) - 2, -1, -1) if chain[i].name == chain[-1].name), None) if chain else None
    if loop:
        hint = f"; endless recursion without any change: {_arrows(loop)}"
    elif again is not None:
        hint = f"; recursion: {_arrows(chain[again:])}, {len(chain)} levels deep"
    else:
        hint = f"; the search stood at {_arrows(chain)}" if chain else ""
    return PlanningError(f"no plan for {', '.join(map(str, tasks))} within {max_expansions} expansions{hint}")


def _arrows(chain: Sequence[Task]) -> str:
    names = [str(task) for task in chain]
    if len(names) > MAX_CHAIN:
        names[MAX_CHAIN // 2 : -MAX_CHAIN // 2] = ["..."]
    return " > ".join(names)
