"""Plan and check problems of the International Planning Competition 2020, total order, from a copy of its domains.

    python tests/tools/ipc.py FOLDER [--first 5] [--expansions 1000000] [--cheapest] [DOMAIN ...]

FOLDER is ``total-order`` of github.com/panda-planner-dev/ipc2020-domains; it states no licence for these domains, so
they are not part of this repository. Exits with 1 if a plan is missing or not valid, or if Towers with n discs takes
other than 2^n - 1 moves.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from pathlib import Path

from remoras.errors import PlanningError
from remoras.htn import NoPlan, check_plan, plan
from remoras.htn.hddl import load

DOMAINS = ("Towers", "Transport", "Satellite-GTOHP", "Rover-GTOHP", "Childsnack")


def solved(domain: Path, problem: Path, max_expansions: int, *, cheapest: bool) -> tuple[bool, str]:
    """Whether one problem is solved with a valid plan, and a line that says how."""
    began = time.process_time()
    read = load(domain, problem)
    loaded = time.process_time()
    try:
        found = plan(
            read.domain, read.facts, read.tasks, goal=read.goal, max_expansions=max_expansions, cheapest=cheapest
        )
    except PlanningError as error:
        return False, f"{time.process_time() - loaded:6.2f} s  {error}"
    planned = time.process_time()
    if isinstance(found, NoPlan):
        return False, f"{planned - loaded:6.2f} s  no plan"
    verdict = check_plan(read.domain, read.facts, read.tasks, found, goal=read.goal)
    n_moves = sum(task.name == "move" for task in found.tasks)
    n_rings = sum(key[0] == "on" for key in read.facts)
    is_short = domain.parent.name != "Towers" or n_moves == 2**n_rings - 1
    words = [f"{loaded - began:6.2f} + {planned - loaded:6.2f} s", f"{len(found.steps):5} steps"]
    if cheapest:
        words.append("cheapest" if found.is_cheapest else "best found")
    return verdict.is_valid and is_short, "  ".join([*words, str(verdict)])


def main() -> int:
    """Plan the first problems of each domain; print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("domain", nargs="*", help=f"default: {' '.join(DOMAINS)}")
    parser.add_argument("--first", type=int, default=5)
    parser.add_argument("--expansions", type=int, default=1_000_000)
    parser.add_argument("--cheapest", action="store_true")
    arguments = parser.parse_args()
    all_valid = True
    for name in arguments.domain or DOMAINS:
        folder = arguments.folder / name
        problems = sorted(path for path in folder.glob("*.hddl") if re.match(r"p(file)?_?\d+\.hddl", path.name))
        for problem in problems[: arguments.first]:
            is_valid, text = solved(folder / "domain.hddl", problem, arguments.expansions, cheapest=arguments.cheapest)
            all_valid &= is_valid
            print(f"{name:<16} {problem.stem:<10} {text}", flush=True)
    return 0 if all_valid else 1


if __name__ == "__main__":
    sys.exit(main())
