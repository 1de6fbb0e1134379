"""Plan and check problems of the International Planning Competition 2020, from a copy of its domains.

    python tests/tools/ipc.py FOLDER [--first 3 | --sample 40 --seed 1] [--seconds 20] [--engine portfolio] [DOMAIN ...]

FOLDER is ``total-order`` or ``partial-order`` of github.com/panda-planner-dev/ipc2020-domains; it states no licence for
these domains, so they are not part of this repository. ``--seconds`` is the CPU time of each problem, reading and
planning. Exits with 1 if an answer is missing or a plan is not valid, or if Towers with n discs takes other than
2^n - 1 moves.
"""

from __future__ import annotations

import argparse
import random
import re
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from remoras.errors import PlanningError
from remoras.htn import NoPlan, Plan, check_plan, plan, plan_in_turns
from remoras.htn.best_first import BestFirst
from remoras.htn.domain import GOAL, Task
from remoras.htn.facts import Facts
from remoras.htn.hddl import Problem, load

UNBOUNDED = 10**12


class OutOfTimeError(BaseException):
    """The CPU time of a problem is used; no error that a planner could catch."""


class Result(NamedTuple):
    """What became of one problem: solved, none (shown to have no plan), open or wrong."""

    outcome: str
    seconds: float
    steps: int
    text: str


def by_best_first(read: Problem) -> Plan | NoPlan:
    """The answer of the best-first search alone."""
    search = BestFirst(
        read.domain, Facts(read.facts), [*read.tasks, Task(GOAL, (tuple(read.goal.items()),))], read.foresight
    )
    search.run(UNBOUNDED)
    if search.nodes is None:
        return NoPlan(read.tasks[0], frozenset(), tuple(search.dead_ends))
    return Plan(search.nodes, frozenset(), cost=search.cost)


ENGINES: dict[str, Any] = {
    "portfolio": lambda read: plan_in_turns(
        read.domain, read.facts, read.tasks, goal=read.goal, foresight=read.foresight, max_expansions=UNBOUNDED
    ),
    "depth-first": lambda read: plan(read.domain, read.facts, read.tasks, goal=read.goal, max_expansions=UNBOUNDED),
    "best-first": by_best_first,
    "cheapest": lambda read: plan(
        read.domain, read.facts, read.tasks, goal=read.goal, max_expansions=1_000_000, cheapest=True
    ),
}


def solved(domain: Path, problem: Path, engine: str, limit_s: float) -> Result:
    """What an engine makes of one problem in ``limit_s`` seconds of CPU."""

    def out_of_time(*_: Any) -> None:
        raise OutOfTimeError

    signal.signal(signal.SIGPROF, out_of_time)
    began = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, limit_s)
    try:
        read = load(domain, problem)
        found = ENGINES[engine](read)
    except OutOfTimeError:
        return Result("open", limit_s, 0, "")
    except (PlanningError, MemoryError) as error:
        return Result("open", time.process_time() - began, 0, str(error).splitlines()[0][:120])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    took_s = time.process_time() - began
    if isinstance(found, NoPlan):
        if read.is_linearised:
            return Result("open", took_s, 0, "no plan with unordered subtasks in the order of the files")
        return Result("none", took_s, 0, f"turned back at {found.dead_ends[0]}")
    verdict = check_plan(read.domain, read.facts, read.tasks, found, goal=read.goal)
    n_moves = sum(task.name == "move" for task in found.tasks)
    is_short = domain.parent.name != "Towers" or n_moves == 2 ** sum(key[0] == "on" for key in read.facts) - 1
    text = "cheapest" if found.is_cheapest else ""
    return Result(
        "solved" if verdict.is_valid and is_short else "wrong", took_s, len(found.steps), f"{verdict} {text}".strip()
    )


def problems(folder: Path, names: list[str]) -> Iterator[tuple[Path, Path]]:
    """Domain and problem files, by domain, in the order of their names."""
    for name in names or sorted(path.name for path in folder.iterdir() if path.is_dir()):
        for problem in sorted((folder / name).glob("*.hddl")):
            if re.search("domain", problem.name):
                continue
            own = problem.with_name(f"{problem.stem}-domain.hddl")
            yield own if own.exists() else folder / name / "domain.hddl", problem


def main() -> int:
    """Plan the first problems of each domain, or some that are drawn; print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("domain", nargs="*", help="default: all")
    parser.add_argument("--first", type=int, default=3, help="so many of each domain")
    parser.add_argument("--nth", type=int, help="of each domain only this one")
    parser.add_argument("--sample", type=int, help="so many, drawn of all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--engine", choices=list(ENGINES), default="portfolio")
    arguments = parser.parse_args()
    found = list(problems(arguments.folder, arguments.domain))
    if arguments.sample:
        chosen = sorted(random.Random(arguments.seed).sample(found, arguments.sample))
    else:
        by_domain: dict[str, list[tuple[Path, Path]]] = {}
        for domain, problem in found:
            by_domain.setdefault(problem.parent.name, []).append((domain, problem))
        which = slice(arguments.nth - 1, arguments.nth) if arguments.nth else slice(arguments.first)
        chosen = [pair for pairs in by_domain.values() for pair in pairs[which]]
    outcomes: list[str] = []
    for domain, problem in chosen:
        result = solved(domain, problem, arguments.engine, arguments.seconds)
        outcomes.append(result.outcome)
        name = f"{problem.parent.name:<27} {problem.stem[:32]:<32}"
        print(f"{name} {result.outcome:<6} {result.seconds:6.2f} s {result.steps:6}  {result.text}", flush=True)
    counts = {kind: outcomes.count(kind) for kind in ("solved", "none", "open", "wrong")}
    print(f"{len(outcomes)} problems: {', '.join(f'{count} {kind}' for kind, count in counts.items())}")
    return 0 if counts["open"] == counts["wrong"] == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
