"""Best-first search: of everything that is open, that is gone on with which leaves least to be done.

Where the depth-first search goes wrong early it comes back late. This engine is progression search (Höller, Bercher,
Behnke, Biundo: HTN planning as heuristic progression search, JAIR 67, 2020): a node is a state and an agenda, the tasks
still to be done, and every open node may be the next. No task is made before it is met, so nothing is grounded.

**Agendas once.** Equal agendas are one object, which keeps the states in which it was met: whoever comes to the same
agenda in the same state again turns back. So where only finitely many can be met the search ends, and where it ends
without a plan there is none. A recursion that changes nothing comes back to itself, and is turned back there.

**Two sights.** Open ways are in two queues, asked in turn (Röger, Helmert: The more, the merrier, ICAPS 2010). First is
which leaves the fewest tasks; every decomposition on the way there counts as a twentieth of a task more, so that long
recursions wait. In one queue, asked two times of three, every *landmark* that lacks counts as three tasks: a fact that
the tasks left, or the goal, will have true once, and that does not hold now. The other does without, as landmarks may
lead astray. What is equal is taken as it came.

**Dead ends.** A fact that the goal wants true and that does not hold must be made by a task that is left, and so must
what holds before whatever makes it. Where none of the tasks left may make it the search turns back.

**Lazy.** Of a method that has one sequence of tasks for each binding, only the next is made; it is asked for another
in the state in which it was tried first.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from types import GeneratorType
from typing import Any, NamedTuple, Protocol

from remoras.htn.domain import GOAL, Decomposition, Domain, Method, Operator, Task, always, goal_methods, nothing
from remoras.htn.errors import unknown_task, wrong_subtasks
from remoras.htn.facts import ANY, Facts, Key, Pattern, fits
from remoras.htn.plans import ROOT, Node

MAX_DEAD_ENDS = 100
MAX_CHAIN = 200
SEQUENCE = (list, tuple)
Landmark = tuple[Key, Any]
"""A fact that must be true at some time: its key and its value."""


class Foresees(Protocol):
    """What is known of tasks before they are planned."""

    def landmarks(self, task: Task) -> frozenset[Landmark]:
        """Facts that every way of doing the task has true at some time."""
        ...

    def may_make(self, task: Task) -> frozenset[Pattern]:
        """Patterns of all facts that some way of doing the task makes true."""
        ...

    def before(self, key: Key) -> frozenset[Key]:
        """Facts that hold before whatever makes this one true."""
        ...


class Sight(NamedTuple):
    """What counts in one queue, a task that is left being 1: one decomposition on the way, one landmark that lacks."""

    depth: float
    landmark: float


SIGHTS = (Sight(0.05, 3.0), Sight(0.05, 0.0))
TURNS = (0, 0, 1)
"""Which sight is asked, in turn."""
NO_OTHERS: Iterator[Decomposition] = iter(())
NO_LANDMARKS: frozenset[Landmark] = frozenset()
_Past = tuple[Task, str | None, int, Any] | None
"""What was done last: a task, its method, the number of its subtasks, and what was done before."""


class _Agenda:
    """A task, and what is to be done behind it.

    Attributes:
        length: of the agenda.
        met: words of the states in which it was met.
        wanted: landmarks of all its tasks.
        makes: of the facts that the goal needs, a bit for each that one of its tasks may make true.
    """

    __slots__ = ("behind", "length", "makes", "met", "number", "task", "wanted")

    def __init__(
        self, task: Task, behind: _Agenda | None, number: int, wanted: frozenset[Landmark], makes: int
    ) -> None:
        self.task = task
        self.behind = behind
        self.number = number
        self.length: int = 1 if behind is None else behind.length + 1
        self.met: set[int] = set()
        self.wanted = wanted
        self.makes: int = makes if behind is None else makes | behind.makes


class _Way:
    """A method tried for the first task of an agenda: the next subtasks it gives, and where it was tried."""

    __slots__ = ("agenda", "changes", "cost", "depth", "due", "method", "n_lacking", "others", "past", "subtasks")

    def __init__(self, agenda: _Agenda, method: Method, subtasks: Any, others: Iterator[Decomposition]) -> None:
        self.agenda = agenda
        self.method = method
        self.subtasks = subtasks
        self.others = others
        self.changes: dict[Key, Any] = {}
        self.past: _Past = None
        self.depth = 0
        self.due = 0
        self.n_lacking = 0
        self.cost = 0.0

    def seen_by(self, sight: Sight) -> float:
        """How far from the end this is: tasks that are left with these subtasks in the place of the task, and more."""
        n_left = self.agenda.length - 1 + len(self.subtasks)
        return n_left + sight.depth * self.depth + sight.landmark * self.n_lacking


class BestFirst:
    """One search; it can be stopped and resumed.

    Args:
        domain: operators and methods.
        facts: that hold at first.
        tasks: to be done.
        foresight: of the tasks; the goal's own facts are known without it.

    Attributes:
        has_ended: with a plan, or because there is none.
        nodes, cost: of the plan; None if there is none yet.
        dead_ends: tasks at which the search turned back, the first hundred.
    """

    def __init__(self, domain: Domain, facts: Facts, tasks: Sequence[Task], foresight: Foresees | None = None) -> None:
        self.has_ended = False
        self.nodes: tuple[Node, ...] | None = None
        self.cost = 0.0
        self.dead_ends: list[Task] = []
        self._domain = domain
        self._methods = {**domain.methods, GOAL: goal_methods(domain)}
        self._facts = facts
        self._agendas: dict[tuple[Task, int], _Agenda] = {}
        self._foresight = foresight
        self._known_landmarks: dict[Task, frozenset[Landmark]] = {}
        self._queues: tuple[list[tuple[float, int, _Way]], ...] = tuple([] for _ in SIGHTS)
        self._n_ways = 0
        self._turn = 0
        # Where the facts stand: the changes of the last way that was opened or taken, then those since.
        self._changes: dict[Key, Any] = {}
        self._n_changes = 0
        self._past: _Past = None
        self._depth = 0
        self._is_stuck = False
        self._goal = _true_of_goal(tasks)
        self._chain = _chain(self._goal, foresight)
        self._known_makes: dict[Task, int] = {}
        self._known_fitting: dict[Pattern, int] = {}
        self._agenda = self._with(tasks, None)

    def run(self, max_expansions: int) -> int:
        """Search to the first plan or to the end; returns the expansions that it took."""
        operators, facts = self._domain.operators, self._facts
        for n_expansions in range(max_expansions):
            if self._is_stuck and not self._take_next():
                self.has_ended = True
                return n_expansions
            agenda = self._agenda
            if agenda is None:
                self.nodes, self.has_ended = self._tree(), True
                return n_expansions
            word = facts.word(len(facts.trail))
            if word in agenda.met:
                self._is_stuck = True
                continue
            agenda.met.add(word)
            operator = operators.get(agenda.task[0])
            if operator is None:
                self._decompose(agenda)
            else:
                self._perform(agenda, operator)
        return max_expansions

    def _perform(self, agenda: _Agenda, operator: Operator) -> None:
        task, facts = agenda.task, self._facts
        if operator.applicable is not always and not operator.applicable(facts, *task[1]):
            self._turn_back(task)
            return
        self.cost += operator.cost_of(facts, task)
        if operator.effects is not nothing:
            facts.make_true(operator.effects(facts, *task[1]))
        self._past = task, None, 0, self._past
        self._agenda = agenda.behind

    def _decompose(self, agenda: _Agenda) -> None:
        """Open every way to decompose the first task; if there is but one, it is gone at once."""
        ways = list(self._ways(agenda))
        if not ways:
            self._turn_back(agenda.task)
            return
        self._depth += 1
        due, n_due = self._due() if self._chain else (0, 0)
        for way in ways:
            way.due = due
        if len(ways) == 1:
            (way,) = ways
            first = way.subtasks
            way.subtasks = next(way.others, None)
            if way.subtasks is None:
                self._go(way, first)
                return
            ways.insert(0, _Way(agenda, way.method, first, NO_OTHERS))
            ways[0].due = due
        facts = self._facts
        if len(facts.trail) > self._n_changes:
            self._changes = {key: value for key, _, value in facts.trail}
            self._n_changes = len(facts.trail)
        wanted = NO_LANDMARKS if agenda.behind is None else agenda.behind.wanted
        lacking = {one for one in wanted if facts.get(one[0]) != one[1]}
        for way in ways:
            way.changes, way.past, way.depth, way.cost = self._changes, self._past, self._depth, self.cost
            more = frozenset().union(*map(self._landmarks_of, way.subtasks)) - wanted
            way.n_lacking = n_due + len(lacking) + sum(facts.get(key) != value for key, value in more)
            self._n_ways += 1
            for queue, sight in zip(self._queues, SIGHTS, strict=True):
                heapq.heappush(queue, (way.seen_by(sight), self._n_ways, way))
        self._is_stuck = True

    def _landmarks_of(self, task: Task) -> frozenset[Landmark]:
        try:
            found = self._known_landmarks.get(task)
        except TypeError:  # an argument has no hash
            return NO_LANDMARKS
        if found is None:
            if task.name == GOAL:
                found = frozenset((key, True) for key in self._goal)
            else:
                found = self._foresight.landmarks(task) if self._foresight else NO_LANDMARKS
            self._known_landmarks[task] = found
        return found

    def _due(self) -> tuple[int, int]:
        """Facts that must still be made for the goal, a bit for each, and how many of them it does not name itself."""
        due = n_due = 0
        waiting = list(self._goal)
        while waiting:
            key = waiting.pop()
            bit, before = self._chain[key]
            if not due & bit and self._facts.get(key) is not True:
                due |= bit
                n_due += 1
                waiting += before
        return due, n_due - sum(self._facts.get(key) is not True for key in self._goal)

    def _makes(self, task: Task) -> int:
        """Of the facts that the goal needs, a bit for each that a task may make true."""
        try:
            found = self._known_makes.get(task)
        except TypeError:  # an argument has no hash
            return -1
        if found is None:
            found = 0 if self._foresight else -1
            if self._foresight and task.name != GOAL:
                for pattern in self._foresight.may_make(task):
                    found |= self._fitting(pattern)
            self._known_makes[task] = found
        return found

    def _fitting(self, pattern: Pattern) -> int:
        """Of the facts that the goal needs, a bit for each that fits a pattern."""
        found = self._known_fitting.get(pattern)
        if found is None:
            if ANY in pattern:
                found = sum(bit for key, (bit, _) in self._chain.items() if fits(pattern, key))
            else:
                found = self._chain[pattern][0] if pattern in self._chain else 0
            self._known_fitting[pattern] = found
        return found

    def _ways(self, agenda: _Agenda) -> Iterator[_Way]:
        task, facts = agenda.task, self._facts
        methods = self._methods.get(task[0])
        if methods is None:
            raise unknown_task(task, self._domain)
        for method in methods:
            if method.applicable is not always and not method.applicable(facts, *task[1]):
                continue
            found: Any = method.subtasks(facts, *task[1])
            if found.__class__ is GeneratorType or (found.__class__ is not list and isinstance(found, Iterator)):
                first = next(found, None)
                if first is not None:
                    yield _Way(agenda, method, first, found)
            elif isinstance(found, SEQUENCE):
                yield _Way(agenda, method, found, NO_OTHERS)
            else:
                raise wrong_subtasks(method, task, found)

    def _take_next(self) -> bool:
        """Go on with the best open way, by the sight whose turn it is; False if none is open."""
        for _ in TURNS:
            self._turn = (self._turn + 1) % len(TURNS)
            sight = TURNS[self._turn]
            queue = self._queues[sight]
            while queue:
                _, number, way = heapq.heappop(queue)
                if way.subtasks is None:  # taken from the other queue
                    continue
                if way.changes is self._changes:
                    self._facts.undo(self._n_changes)
                else:
                    self._facts.undo(0)
                    self._facts.make_true(way.changes)
                    self._changes, self._n_changes = way.changes, len(self._facts.trail)
                self._past, self._depth, self.cost = way.past, way.depth, way.cost
                subtasks = way.subtasks
                way.subtasks = next(way.others, None)
                if way.subtasks is not None:
                    heapq.heappush(queue, (way.seen_by(SIGHTS[sight]), number, way))
                self._is_stuck = False
                self._go(way, subtasks)
                return True
        return False

    def _go(self, way: _Way, subtasks: Any) -> None:
        """Put ``subtasks`` in the place of the task."""
        uses = way.method.uses
        task = way.agenda.task
        if not isinstance(subtasks, SEQUENCE) or any(
            subtask.__class__ is not Task or (uses is not None and subtask[0] not in uses) for subtask in subtasks
        ):
            raise wrong_subtasks(way.method, task, subtasks)
        self._past = task, way.method.name, len(subtasks), self._past
        self._agenda = self._with(subtasks, way.agenda.behind)
        if way.due and (self._agenda is None or way.due & ~self._agenda.makes):
            self._turn_back(task)

    def _with(self, tasks: Sequence[Task], behind: _Agenda | None) -> _Agenda | None:
        """The one agenda of these tasks, with ``behind`` behind them."""
        agendas = self._agendas
        for task in reversed(tasks):
            key = task, 0 if behind is None else behind.number
            wanted = NO_LANDMARKS if behind is None else behind.wanted
            try:
                found = agendas.get(key)
            except TypeError:  # an argument has no hash: this agenda equals no other
                found = agendas[task._replace(args=()), -len(agendas)] = _Agenda(
                    task, behind, len(agendas) + 1, wanted, -1
                )
            if found is None:
                own = self._landmarks_of(task)
                wanted = wanted if own <= wanted else wanted | own
                makes = self._makes(task) if self._chain else 0
                found = agendas[key] = _Agenda(task, behind, len(agendas) + 1, wanted, makes)
            behind = found
        return behind

    def _turn_back(self, task: Task) -> None:
        self._is_stuck = True
        if len(self.dead_ends) < MAX_DEAD_ENDS:
            self.dead_ends.append(task)

    def _tree(self) -> tuple[Node, ...]:
        """What was done, with the task above each: the first that still lacks a subtask."""
        done = []
        past = self._past
        while past is not None:
            *one, past = past
            done.append(one)
        nodes: list[Node] = []
        lacking: list[list[int]] = []
        for task, method, n_subtasks in reversed(done):
            while lacking and not lacking[-1][1]:
                lacking.pop()
            parent = ROOT
            if lacking:
                lacking[-1][1] -= 1
                parent = lacking[-1][0]
            if method is not None:
                lacking.append([len(nodes), n_subtasks])
            nodes.append(Node(task, method, parent))
        return tuple(nodes)


def _true_of_goal(tasks: Sequence[Task]) -> tuple[Key, ...]:
    """Keys of the facts that the goal at the end of ``tasks`` wants true."""
    if not tasks or tasks[-1].name != GOAL:
        return ()
    return tuple(key for key, value in tasks[-1].args[0] if value is True)


def _chain(goal: Sequence[Key], foresight: Foresees | None) -> dict[Key, tuple[int, frozenset[Key]]]:
    """The facts of the goal, and those that hold before them: a bit for each, and what holds before it.

    Where they are more than MAX_CHAIN only the goal counts, since all that are due are gone through at each step.
    """
    if foresight is None:
        return {}
    found: dict[Key, tuple[int, frozenset[Key]]] = {}
    waiting = list(goal)
    while waiting:
        key = waiting.pop()
        if key not in found:
            before = foresight.before(key)
            found[key] = 1 << len(found), before
            waiting += sorted(before, key=str)
            if len(found) > MAX_CHAIN:
                return {key: (1 << number, frozenset()) for number, key in enumerate(goal)}
    return found
