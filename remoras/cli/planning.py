"""The command of the planner: plan."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from remoras.cli.app import FAILED, Json, command, fail, show_json


@command("plan", "remoras plan domain.hddl problem.hddl")
def plan_problem(
    domain: Annotated[Path, typer.Argument(metavar="DOMAIN", help="HDDL file of the domain.")],
    problem: Annotated[Path, typer.Argument(metavar="PROBLEM", help="HDDL file of the problem.")],
    check: Annotated[
        Path | None, typer.Option(metavar="PLAN", help="Do not plan: check the plan in this file, of any planner.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="File for the plan, in place of the screen.")] = None,
    expansions: Annotated[
        int, typer.Option(min=1, max=10**12, metavar="N", help="Tasks to look at before giving up.")
    ] = 10_000_000,
    as_json: Json = False,
) -> None:
    """Plan a problem of the planning competition, or check a plan of it; its format is that of IPC 2020."""
    from remoras.htn import NoPlan, check_plan, plan_in_turns
    from remoras.htn.hddl import load
    from remoras.htn.hddl.plan_file import plan_text, read_plan

    for file in (domain, problem, *([check] if check else [])):
        if not file.is_file():
            fail(f"{file}: no such file")
    if check and out:
        fail("--out: a plan that is checked is not written; leave out --check or --out")
    began = time.process_time()
    read = load(domain, problem)
    if check:
        made = read_plan(read, check)
    else:
        answer = plan_in_turns(
            read.domain,
            read.facts,
            read.tasks,
            goal=read.goal,
            foresight=read.foresight,
            max_expansions=expansions,
        )
        if isinstance(answer, NoPlan):
            which = "with unordered subtasks in the order of the files" if read.is_linearised else "exists"
            fail(f"{problem}: no plan {which}; the search turned back at {answer.dead_ends[0]}", FAILED)
        made = answer
    took_s = time.process_time() - began
    verdict = check_plan(read.domain, read.facts, read.tasks, made, goal=read.goal)
    n_steps, text = len(made.steps), plan_text(made)
    if out:
        out.write_text(text, encoding="utf-8")
    if as_json:
        faults = [*verdict.execution, *verdict.decomposition]
        show_json({"steps": n_steps, "valid": verdict.is_valid, "faults": faults, "plan": text})
    else:
        if not check and not out:
            print(text, end="")
        print(f"{check or problem}: {n_steps} actions in {took_s:.2f} s, {verdict}")
    if not verdict.is_valid:
        raise typer.Exit(FAILED)
