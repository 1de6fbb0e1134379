"""The command ``plan``, and the plans of the competition's format that it writes and checks."""

import json
import random
from pathlib import Path

import pytest
from invoked import refused, remoras

from benchmarks.ipc.problems import FOLDER, towers, transport
from remoras.htn import NoPlan, plan
from remoras.htn.hddl import load
from remoras.htn.hddl.plan_file import plan_text, read_plan


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A domain and a problem of it."""
    problem = tmp_path / "problem.hddl"
    problem.write_text(towers(1), encoding="utf-8")
    return FOLDER / "towers.hddl", problem


WITH_VARIABLES = """(define (problem p) (:domain sea) (:objects auv glider - vehicle bay reef - place)
  (:htn :parameters (?v - vehicle) :ordered-subtasks (and (visit ?v reef) (visit ?v bay)))
  (:init (at glider bay)))"""
SEA = """(define (domain sea) (:types vehicle place) (:predicates (at ?v - vehicle ?p - place))
  (:task visit :parameters (?v - vehicle ?p - place))
  (:method send :parameters (?v - vehicle ?p ?q - place) :task (visit ?v ?p) :precondition (at ?v ?q)
    :ordered-subtasks (and (sail ?v ?q ?p)))
  (:method stay :parameters (?v - vehicle ?p - place) :task (visit ?v ?p) :precondition (at ?v ?p))
  (:action sail :parameters (?v - vehicle ?p ?q - place) :precondition (and (at ?v ?p) (not (at ?v ?q)))
    :effect (and (not (at ?v ?p)) (at ?v ?q))))"""


def test_a_plan_is_written_in_the_format_of_the_competition(tmp_path: Path) -> None:
    domain, problem = tmp_path / "sea.hddl", tmp_path / "p.hddl"
    domain.write_text(SEA, encoding="utf-8")
    problem.write_text(WITH_VARIABLES, encoding="utf-8")
    done = remoras("plan", domain, problem)
    assert done.exit_code == 0, done.output
    *lines, last = done.stdout.splitlines()
    assert lines == [
        "==>",
        "0 sail glider bay reef",
        "1 sail glider reef bay",
        "root 2 3",
        "2 visit glider reef -> send 0",
        "3 visit glider bay -> send 1",
        "<==",
    ]
    assert last.endswith(" s, valid")


def renumbered(text: str, seed: int) -> str:
    """The same plan under other numbers, its decompositions in another order."""
    lines = text.splitlines()
    numbers = [line.split()[0] for line in lines if line[0].isdigit()]
    others = random.Random(seed).sample(range(1000), len(numbers))
    number = {old: str(new) for old, new in zip(numbers, others, strict=True)}

    def anew(line: str) -> str:
        words, arrow, below = line.partition(" -> ")
        if not words[0].isdigit():
            return " ".join(number.get(word, word) for word in line.split())
        head, _, rest = words.partition(" ")
        method, *children = below.split() or [""]
        return f"{number[head]} {rest}{arrow}{' '.join([method, *map(number.__getitem__, children)])}"

    actions = [anew(line) for line in lines if line[0].isdigit() and "->" not in line]
    decompositions = [anew(line) for line in lines if "->" in line]
    random.Random(seed).shuffle(decompositions)
    root = next(anew(line) for line in lines if line.startswith("root"))
    return "\n".join(["noise", "==>", *actions, root, *decompositions, "<==", "noise"])


@pytest.mark.parametrize(("domain", "problem"), [("towers", towers(2)), ("transport", transport(2))])
def test_what_is_written_is_read_again_under_any_numbers(domain: str, problem: str, tmp_path: Path) -> None:
    file, written = tmp_path / "p.hddl", tmp_path / "plan.txt"
    file.write_text(problem, encoding="utf-8")
    read = load(FOLDER / f"{domain}.hddl", file)
    made = plan(read.domain, read.facts, read.tasks, goal=read.goal)
    assert not isinstance(made, NoPlan)
    for seed in range(5):
        written.write_text(renumbered(plan_text(made), seed), encoding="utf-8")
        assert read_plan(read, written).nodes == made.nodes
        assert remoras("plan", FOLDER / f"{domain}.hddl", file, "--check", written).exit_code == 0


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("0 move r1", "0 move r2", "is not possible where it stands"),
        ("-> from_the_top", "-> lowest", "has no method 'lowest'"),
        ("0 move r1", "0 lift r1", "is no elementary task of the domain"),
        ("shift a b c", "shift b a c", "asked for was"),
    ],
)
def test_a_plan_of_others_that_is_none_is_named(
    before: str, after: str, says: str, files: tuple[Path, Path], tmp_path: Path
) -> None:
    made = tmp_path / "plan.txt"
    assert remoras("plan", *files, "--out", made).exit_code == 0
    text = made.read_text(encoding="utf-8")
    assert before in text
    made.write_text(text.replace(before, after, 1), encoding="utf-8")
    done = remoras("plan", *files, "--check", made, "--json")
    told = json.loads(done.stdout)
    assert done.exit_code == 1
    assert not told["valid"]
    assert says in " ".join(told["faults"])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "==> is missing"),
        ("==>\n0 move r1\n<==", "the line 'root NUMBER ...' is missing"),
        ("==>\nx move r1\nroot 0\n<==", ":2: expected the number of a task, not 'x'"),
        ("==>\n0 move r1\n0 move r1\nroot 0\n<==", ":3: number 0 is given twice"),
        ("==>\n0\nroot 0\n<==", ":2: expected NUMBER TASK"),
        ("==>\n0 move r1\nroot 1\n1 shift a b c ->\n<==", ":4: expected NUMBER TASK"),
        ("==>\nroot 7\n<==", "task 7 is named, but has no line of its own"),
        ("==>\nroot 1\n1 shift a b c -> from_the_top 1\n<==", "task 1 is named twice as a subtask"),
        ("==>\n0 move r1\nroot 1\n1 shift a b c -> from_the_top\n<==", "no way leads from root to 0"),
        ("==>\n0 move a\n1 move b\nroot 2\n2 shift a b c -> x 1 0\n<==", "comes where 0 stands"),
    ],
)
def test_a_file_that_is_no_plan_is_one_line(text: str, says: str, files: tuple[Path, Path], tmp_path: Path) -> None:
    made = tmp_path / "plan.txt"
    made.write_text(text, encoding="utf-8")
    message = refused("plan", *files, "--check", made)
    assert says in message
    assert message.count("\n") == 1


def test_what_cannot_be_planned_is_said(files: tuple[Path, Path], tmp_path: Path) -> None:
    assert "no such file" in refused("plan", files[0], tmp_path / "none.hddl")
    assert "leave out --check or --out" in refused("plan", *files, "--check", files[0], "--out", tmp_path / "p")
    assert "within 2 expansions" in refused("plan", *files, "--expansions", "2")
    stuck = tmp_path / "stuck.hddl"
    stuck.write_text(files[1].read_text(encoding="utf-8").replace("(top r1 a)", ""), encoding="utf-8")
    done = remoras("plan", files[0], stuck)
    assert done.exit_code == 1
    assert "no plan exists; the search turned back at" in done.stderr
    partly = tmp_path / "partly.hddl"
    partly.write_text(stuck.read_text(encoding="utf-8").replace("(shift a b c)", "(shift a b c) (shift c b a)")
                      .replace(":ordered-tasks", ":tasks"), encoding="utf-8")  # fmt: skip
    assert "no plan with unordered subtasks in the order of the files" in remoras("plan", files[0], partly).stderr
