"""Plans in the format of the International Planning Competition 2020, as text to write and to read.

Between ``==>`` and ``<==`` stand the actions in the order of execution, each with a number; then ``root`` and the
numbers of the tasks asked for; then every abstract task with its method and the numbers of its subtasks:

    ==>
    0 sail auv bay reef
    root 1
    1 visit reef -> send 0
    <==

(https://ipc2020.hierarchical-task.net/benchmarks/output-format). What is read is only brought into the form of a
``Plan``; whether it is one of the problem, ``check_plan`` says.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from remoras.errors import PlanningError
from remoras.htn.domain import GOAL, Task
from remoras.htn.hddl import WHOLE, Problem
from remoras.htn.plans import ROOT, Node, Plan

__all__ = ["plan_text", "read_plan"]
BEGIN, END, ARROW = "==>", "<==", "->"
OWN = GOAL, WHOLE
"""Tasks that stand for the goal, and for a problem with variables; the format has no line for them."""


def plan_text(plan: Plan) -> str:
    """A plan as the competition's validators take it: actions, root, decompositions.

    Args:
        plan: of a problem that was read from HDDL.
    """
    shown = [place for place, node in enumerate(plan.nodes) if node.task.name not in OWN]
    elementary = [place for place in shown if plan.nodes[place].method is None]
    abstract = [place for place in shown if plan.nodes[place].method is not None]
    number = {place: n for n, place in enumerate([*elementary, *abstract])}
    roots = [number[place] for place in shown if plan.nodes[place].parent not in number]
    lines = [BEGIN, *(f"{number[place]} {_words(plan.nodes[place].task)}" for place in elementary)]
    lines.append(" ".join(["root", *map(str, roots)]))
    for place in abstract:
        below = " ".join(str(number[child]) for child in plan.children[place])
        line = f"{number[place]} {_words(plan.nodes[place].task)} {ARROW} {plan.nodes[place].method} {below}"
        lines.append(line.rstrip())
    return "\n".join([*lines, END, ""])


def _words(task: Task) -> str:
    return " ".join([task.name, *map(str, task.args)])


class _Lines:
    """The numbered lines of a file, as far as they can be taken one by one.

    Attributes:
        file: its name.
        tasks: by number, in the order of the file.
        methods: of abstract tasks, by number: the method and the numbers of the subtasks.
        roots: numbers of the tasks asked for; None until that line is read.
    """

    def __init__(self, file: str) -> None:
        self.file = file
        self.tasks: dict[int, Task] = {}
        self.methods: dict[int, tuple[str, list[int]]] = {}
        self.roots: list[int] | None = None

    def fault(self, line: int, text: str) -> PlanningError:
        """What is wrong in a line."""
        return PlanningError(f"{self.file}:{line}: {text}")

    def take(self, line: int, words: list[str]) -> None:
        """Take one line."""
        if words[0] == "root":
            self.roots = self._numbers(line, words[1:])
            return
        (number,) = self._numbers(line, words[:1])
        if number in self.tasks:
            raise self.fault(line, f"number {number} is given twice; each task has a number of its own")
        before, arrow, behind = _split(words[1:])
        if not before or (arrow and not behind):
            raise self.fault(line, f"expected NUMBER TASK ARGUMENT ... [{ARROW} METHOD NUMBER ...]")
        self.tasks[number] = Task(before[0], tuple(before[1:]))
        if arrow:
            self.methods[number] = behind[0], self._numbers(line, behind[1:])

    def _numbers(self, line: int, words: list[str]) -> list[int]:
        wrong = [word for word in words if not (word.isascii() and word.isdigit())]
        if wrong:
            raise self.fault(line, f"expected the number of a task, not {wrong[0]!r}")
        return [int(word) for word in words]


def _split(words: list[str]) -> tuple[list[str], bool, list[str]]:
    if ARROW not in words:
        return words, False, []
    place = words.index(ARROW)
    return words[:place], True, words[place + 1 :]


def read_plan(problem: Problem, file: Path) -> Plan:
    """The plan in a file, of whoever made it, to be checked by ``check_plan``.

    Args:
        problem: that it is for.
        file: in the format of the competition; what stands before ``==>`` and behind ``<==`` is not looked at.

    Raises:
        PlanningError: it is not in the format, or its actions are not in the order of its decomposition.
    """
    lines = _Lines(str(file))
    within = False
    for number, text in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        words = text.lower().split()
        if words == [BEGIN]:
            within = True
        elif words == [END]:
            break
        elif within and words:
            lines.take(number, words)
    if not within or lines.roots is None:
        lacking = BEGIN if not within else "the line 'root NUMBER ...'"
        raise PlanningError(f"{file}: {lacking} is missing; a plan stands between {BEGIN} and {END}")
    nodes = list(_own_nodes(problem))
    top = ROOT if not nodes else 0
    order = list(_below(lines, top, len(nodes)))
    nodes += [node for _, node in order]
    reached = {number for number, _ in order}
    left_out = [str(number) for number in lines.tasks if number not in reached]
    if left_out:
        raise PlanningError(f"{file}: no way leads from root to {', '.join(left_out[:10])}")
    steps = [number for number, node in order if node.method is None]
    stated = [number for number in lines.tasks if number not in lines.methods]
    if steps != stated:
        early, late = next((a, b) for a, b in zip(steps, stated, strict=True) if a != b)
        raise PlanningError(
            f"{file}: by its decomposition {early} comes where {late} stands; "
            "list the actions in the order of the tree: order is total"
        )
    nodes.append(Node(Task(GOAL, (tuple(problem.goal.items()),)), "met", ROOT))
    # an action of HDDL costs 1
    return Plan(tuple(nodes), frozenset(), cost=float(len(steps)))


def _own_nodes(problem: Problem) -> Iterator[Node]:
    """The task that stands for a problem with variables, if it has some."""
    if problem.tasks == (Task(WHOLE),):
        yield Node(Task(WHOLE), WHOLE, ROOT)


def _below(lines: _Lines, top: int, n_before: int) -> Iterator[tuple[int, Node]]:
    """Numbers and nodes of all that is below the root, each before its subtasks."""
    waiting = [(number, top) for number in reversed(lines.roots or [])]
    taken: set[int] = set()
    while waiting:
        number, parent = waiting.pop()
        if number not in lines.tasks:
            raise PlanningError(f"{lines.file}: task {number} is named, but has no line of its own")
        if number in taken:
            raise PlanningError(f"{lines.file}: task {number} is named twice as a subtask")
        place = n_before + len(taken)
        taken.add(number)
        method, below = lines.methods.get(number, (None, []))
        yield number, Node(lines.tasks[number], method, parent)
        waiting += [(child, place) for child in reversed(below)]
