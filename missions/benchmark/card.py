"""Card: what a benchmark says in a file, so that others can cite it, check it and repeat it.

It has the digests of suite and code, and every run. The same runs give the same bytes, however often they were
interrupted; what depends on the machine is not in it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from missions.benchmark.running import Contest
from missions.benchmark.scoring import DIGITS, CellRun, Scored
from missions.benchmark.suite import Cell, Suite
from missions.errors import OutputError
from missions.files import text_of
from missions.sweeps.code import fingerprint, short
from missions.sweeps.plan import SweepPlan, version
from missions.sweeps.worker import run_task

CARD = "card.json"
COLUMNS = ("repeat", "seed", "bound_s", "time_s", "completed", "n_bytes", "wrong_belief_fraction", "failed", "silenced")
"""What a card says of each run, in this order."""


def card_of(contest: Contest, scored: Sequence[Scored]) -> dict[str, Any]:
    """The card of strategies that were run."""
    suite = contest.suite
    return {
        "suite": suite.about.name,
        "digest": suite.digest,
        "split": suite.split,
        "version": version(),
        "repeats": contest.repeats,
        "limit_s": suite.about.limit_s,
        "cells": [list(cell) for cell in suite.cells],
        "columns": list(COLUMNS),
        "strategies": [
            {
                "name": strategy.name,
                "reference": strategy.reference,
                "code": code_of(contest, place),
                **figures(strategy, suite),
                "runs": [
                    [[getattr(run, column) for column in COLUMNS] for run in strategy.cells[cell]]
                    for cell in suite.cells
                ],
            }
            for place, strategy in enumerate(scored)
        ],
    }


def figures(strategy: Scored, suite: Suite) -> dict[str, Any]:
    """All that follows from the runs of a strategy."""
    alike, *others = (network.name for network in suite.file.network)
    shapes = {other: strategy.difference(other, alike) for other in others}
    return {
        "score": round(strategy.score, DIGITS),
        "interval": strategy.interval and list(strategy.interval),
        "completed": round(strategy.completed_share, DIGITS),
        "worst_cell": strategy.worst.label,
        "worst": round(strategy.by_cell[strategy.worst], DIGITS),
        "bytes": _rounded(strategy.mean_bytes),
        "wrong_beliefs": _rounded(strategy.mean_wrong),
        "runs_silenced": sum(run.silenced > 0 for run in strategy.runs),
        f"minus_{alike}": {
            other: [round(mean, DIGITS), interval and list(interval)] for other, (mean, interval) in shapes.items()
        },
        "by_cell": [round(strategy.by_cell[cell], DIGITS) for cell in suite.cells],
    }


def code_of(contest: Contest, place: int) -> str:
    """Digest of what makes the runs of a strategy: this program, and the strategy's own sources."""
    number, _ = contest.suite.place(0, 0, place, len(contest.strategies))
    return short(fingerprint([contest.study.configurations[number].scenario.model_dump(mode="json")]))


def card_text(card: Mapping[str, Any]) -> str:
    """A card as its file has it: a line for the runs of each cell."""
    head, between = json.dumps({**card, "strategies": None}, indent=1, allow_nan=False), ",\n"
    entries = []
    for strategy in card["strategies"]:
        text = json.dumps({**strategy, "runs": None}, indent=1, allow_nan=False)
        runs = between.join(json.dumps(runs, allow_nan=False) for runs in strategy["runs"])
        entries.append(text.replace('"runs": null', f'"runs": [\n{runs}\n]'))
    return head.replace('"strategies": null', f'"strategies": [\n{between.join(entries)}\n]') + "\n"


def read_card(path: Path, suite: Suite) -> dict[str, Any]:
    """A card of a suite.

    Raises:
        OutputError: there is none, it is damaged or altered, or it is of another suite.
    """
    try:
        card = json.loads(text_of(path))
        known = card["suite"], card["digest"]
        strategies = read_strategies(card) if known == (suite.about.name, suite.digest) else []
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise OutputError(f"{path}: no card of a benchmark ({type(error).__name__}: {error})") from None
    if known != (suite.about.name, suite.digest):
        here = f"{suite.about.name} with digest {suite.digest[:12]}"
        raise OutputError(f"{path}: suite = {known[0]} with digest {str(known[1])[:12]}; allowed: {here}")
    if [Cell(*cell) for cell in card["cells"]] != list(suite.cells):
        raise OutputError(f"{path}: cells: other ones than {suite.about.name} has; the card was altered")
    for entry, strategy in zip(card["strategies"], strategies, strict=True):
        for key, value in figures(strategy, suite).items():
            if entry.get(key) != value:
                now = f"allowed: {value}, which its runs give; the card was altered"
                raise OutputError(f"{path}: {strategy.name}.{key} = {entry.get(key)}: {now}")
    result: dict[str, Any] = card
    return result


def read_strategies(card: Mapping[str, Any]) -> list[Scored]:
    """The strategies of a card with their runs.

    Raises:
        ValueError, KeyError, TypeError: something is missing.
    """
    cells = [Cell(*cell) for cell in card["cells"]]
    return [
        Scored(
            entry["name"],
            entry["reference"],
            {
                cell: [CellRun(**dict(zip(card["columns"], run, strict=True))) for run in runs]
                for cell, runs in zip(cells, entry["runs"], strict=True)
            },
        )
        for entry in card["strategies"]
    ]


def verify_card(path: Path, suite: Suite, count: int) -> Iterator[tuple[str, str]]:
    """Make drawn runs of a card again: for each its name, and what is other now; empty if nothing is.

    Which are drawn follows from what the card says, so nobody can choose them.

    Args:
        path: of the card.
        suite: that it has to be of.
        count: of runs.

    Raises:
        OutputError: it is no card of the suite, was altered, or other code made its runs.
        PluginError: a strategy cannot be had.
    """
    card = read_card(path, suite)
    strategies = read_strategies(card)
    contest = Contest.of(suite, [strategy.reference for strategy in strategies], card["repeats"])
    for place, entry in enumerate(card["strategies"]):
        if entry["code"] != (here := code_of(contest, place)):
            raise OutputError(f"{path}: {entry['name']}.code = {entry['code']}; allowed: {here}, the code that is here")
    plan = SweepPlan(contest.study)
    known = [
        (place, at, run)
        for place, strategy in enumerate(strategies)
        for at, cell in enumerate(suite.cells)
        for run in strategy.cells[cell]
    ]
    text = card_text(card)
    order = sorted(range(len(known)), key=lambda number: hashlib.sha256(f"{number} {text}".encode()).digest())
    for place, at, run in [known[number] for number in order[:count]]:
        name = f"{strategies[place].name}, {suite.cells[at].label}, repeat {run.repeat}"
        if run.seed != suite.seed(run.repeat):
            yield name, f"seed: was {run.seed}, now {suite.seed(run.repeat)}"
            continue
        number, repeat = suite.place(at, run.repeat, place, len(strategies))
        line = run_task(plan.task(number, repeat)).line
        again = contest.run_of(line, run.repeat, number)
        other = [
            f"{column}: was {getattr(run, column)}, now {getattr(again, column)}"
            for column in COLUMNS
            if getattr(run, column) != getattr(again, column)
        ]
        yield name, "; ".join(other)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)
