"""Best-first search: of everything that is open, that is gone on with which leaves least to be done.

Where the depth-first search goes wrong early it comes back late. This engine is progression search (Höller, Bercher,
Behnke, Biundo: HTN planning as heuristic progression search, JAIR 67, 2020): a node is a state and an agenda, the tasks
still to be done, and every open node may be the next. No task is made before it is met, so nothing is grounded.

**Agendas once.** Equal agendas are one object, which keeps the states in which it was met: whoever comes to the same
agenda in the same state again turns back. So where only finitely many can be met the search ends, and where it ends
without a plan there is none. A recursion that changes nothing comes back to itself, and is turned back there.

**Two sights.** Open ways are in two queues, asked in turn (Röger, Helmert: The more, the merrier, ICAPS 2010). First is
which leaves the fewest tasks; every decomposition on the way there counts as a twentieth of a task more, so that long
recursions wait. In one queue, asked three times of four, every *landmark* that lacks counts as three tasks: a fact that
the tasks left, or the goal, will have true once, and that does not hold now. The other does without, as landmarks may
lead astray. What is equal is taken as it came.

**Lazy.** Of a method that has one sequence of tasks for each binding, only the next is made; it is asked for another
in the state in which it was tried first.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from types import GeneratorType
from typing import Any, NamedTuple

from remoras.htn.domain import GOAL, Decomposition, Domain, Method, Operator, Task, always, goal_methods, nothing
from remoras.htn.errors import unknown_task, wrong_subtasks
from remoras.htn.facts import ANY, Facts, Key
from remoras.htn.plans import ROOT, Node

MAX_DEAD_ENDS = 100
SEQUENCE = (list, tuple)
Landmark = tuple[Key, Any]
"""A fact that must be true at some time: its key and its value."""
Landmarks = Callable[[Task], frozenset[Landmark]]


class Sight(NamedTuple):
    """What counts in one queue, a task that is left being 1: one decomposition on the way, one landmark that lacks."""

    depth: float
    landmark: float


SIGHTS = (Sight(0.05, 3.0), Sight(0.05, 0.0))
TURNS = (0, 0, 0, 1)
"""Which sight is asked, in turn."""
NO_OTHERS: Iterator[Decomposition] = iter(())
NO_LANDMARKS: frozenset[Landmark] = frozenset()
_Past = tuple[Task, str | None, int, Any] | None
"""What was done last: a task, its method, the number of its subtasks, and what was done before."""


def no_landmarks(task: Task) -> frozenset[Landmark]:
    """The landmarks of tasks of which none are known."""
    return NO_LANDMARKS


class _Agenda:
    """A task, and what is to be done behind it.

    Attributes:
        length: of the agenda.
        met: words of the states in which it was met.
        wanted: landmarks of all its tasks.
    """

    __slots__ = ("behind", "length", "met", "number", "task", "wanted")

    def __init__(self, task: Task, behind: _Agenda | None, number: int, wanted: frozenset[Landmark]) -> None:
        self.task = task
        self.behind = behind
        self.number = number
        self.length: int = 1 if behind is None else behind.length + 1
        self.met: set[int] = set()
        self.wanted = wanted


class _Way:
    """A method tried for the first task of an agenda: the next subtasks it gives, and where it was tried."""

    __slots__ = ("agenda", "changes", "cost", "depth", "method", "n_lacking", "others", "past", "subtasks")

    def __init__(self, agenda: _Agenda, method: Method, subtasks: Any, others: Iterator[Decomposition]) -> None:
        self.agenda = agenda
        self.method = method
        self.subtasks = subtasks
        self.others = others
        self.changes: dict[Key, Any] = {}
        self.past: _Past = None
        self.depth = 0
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
        landmarks: of each task; those of a goal are found here.

    Attributes:
        has_ended: with a plan, or because there is none.
        nodes, cost: of the plan; None if there is none yet.
        dead_ends: tasks at which the search turned back, the first hundred.
    """

    def __init__(
        self, domain: Domain, facts: Facts, tasks: Sequence[Task], landmarks: Landmarks = no_landmarks
    ) -> None:
        self.has_ended = False
        self.nodes: tuple[Node, ...] | None = None
        self.cost = 0.0
        self.dead_ends: list[Task] = []
        self._domain = domain
        self._methods = {**domain.methods, GOAL: goal_methods(domain)}
        self._facts = facts
        self._agendas: dict[tuple[Task, int], _Agenda] = {}
        self._landmarks = landmarks
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
        if len(ways) == 1:
            (way,) = ways
            first = way.subtasks
            way.subtasks = next(way.others, None)
            if way.subtasks is None:
                self._go(way, first)
                return
            ways.append(_Way(agenda, way.method, first, NO_OTHERS))
            ways.reverse()
        facts = self._facts
        if len(facts.trail) > self._n_changes:
            self._changes = {key: value for key, _, value in facts.trail}
            self._n_changes = len(facts.trail)
        wanted = NO_LANDMARKS if agenda.behind is None else agenda.behind.wanted
        lacking = {one for one in wanted if facts.get(one[0]) != one[1]}
        for way in ways:
            way.changes, way.past, way.depth, way.cost = self._changes, self._past, self._depth, self.cost
            more = frozenset().union(*map(self._landmarks_of, way.subtasks)) - wanted
            way.n_lacking = len(lacking) + sum(facts.get(key) != value for key, value in more)
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
            found = self._landmarks(task)
            if task.name == GOAL:
                found = frozenset(one for one in task.args[0] if one[1] is not ANY and one[1] is not False)
            self._known_landmarks[task] = found
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

    def _with(self, tasks: Sequence[Task], behind: _Agenda | None) -> _Agenda | None:
        """The one agenda of these tasks, with ``behind`` behind them."""
        agendas = self._agendas
        for task in reversed(tasks):
            key = task, 0 if behind is None else behind.number
            wanted = NO_LANDMARKS if behind is None else behind.wanted
            try:
                found = agendas.get(key)
            except TypeError:  # an argument has no hash: this agenda equals no other
                found = agendas[task._replace(args=()), -len(agendas)] = _Agenda(task, behind, len(agendas) + 1, wanted)
            if found is None:
                own = self._landmarks_of(task)
                found = agendas[key] = _Agenda(
                    task, behind, len(agendas) + 1, wanted if own <= wanted else wanted | own
                )
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
