"""Result card: a citable, verifiable file of a benchmark.

It contains the digests of suite and code, and every run. Equal runs give equal bytes, interrupted or not; nothing in it
depends on the machine.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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
"""Columns of a run in a card, in this order."""
LEAST_DRAWN = 10
"""Minimum number of runs that a verifier repeats."""


def card_of(contest: Contest, scored: Sequence[Scored]) -> dict[str, Any]:
    """Return the card of completed strategies."""
    codes = [code_of(contest, place) for place in range(len(scored))]
    return _card(contest.suite, contest.repeats, version(), scored, codes)


def _card(suite: Suite, repeats: int, made_by: str, scored: Sequence[Scored], codes: Sequence[str]) -> dict[str, Any]:
    return {
        "suite": suite.about.name,
        "digest": suite.digest,
        "split": suite.split,
        "version": made_by,
        "repeats": repeats,
        "limit_s": suite.about.limit_s,
        "cells": [list(cell) for cell in suite.cells],
        "columns": list(COLUMNS),
        "strategies": [
            {
                "name": strategy.name,
                "reference": strategy.reference,
                "code": code,
                **figures(strategy, suite),
                "runs": [
                    [[getattr(run, column) for column in COLUMNS] for run in strategy.cells[cell]]
                    for cell in suite.cells
                ],
            }
            for strategy, code in zip(scored, codes, strict=True)
        ],
    }


def figures(strategy: Scored, suite: Suite) -> dict[str, Any]:
    """Return all values derived from the runs of a strategy."""
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
    """Return the digest of the code behind the runs: this program and the strategy's sources."""
    study, number, _ = contest.suite.place(0, 0, place, len(contest.strategies))
    return short(fingerprint([contest.studies[study].configurations[number].scenario.model_dump(mode="json")]))


def card_text(card: Mapping[str, Any]) -> str:
    """Return the text of a card, with one line for the runs of each cell."""
    head, between = json.dumps({**card, "strategies": None}, indent=1, allow_nan=False), ",\n"
    entries = []
    for strategy in card["strategies"]:
        text = json.dumps({**strategy, "runs": None}, indent=1, allow_nan=False)
        runs = between.join(json.dumps(runs, allow_nan=False) for runs in strategy["runs"])
        entries.append(text.replace('"runs": null', f'"runs": [\n{runs}\n]'))
    return head.replace('"strategies": null', f'"strategies": [\n{between.join(entries)}\n]') + "\n"


def read_card(path: Path, suite: Suite) -> dict[str, Any]:
    """Read a card of a suite; raises OutputError unless all values follow from its runs."""
    try:
        card: dict[str, Any] = json.loads(text_of(path))
        if (known := (card["suite"], card["digest"])) != (suite.about.name, suite.digest):
            here = f"{suite.about.name} with digest {suite.digest[:12]}"
            raise OutputError(f"{path}: suite = {known[0]} with digest {str(known[1])[:12]}; allowed: {here}")
        strategies, codes = read_strategies(card), [entry["code"] for entry in card["strategies"]]
        expected = _card(suite, card["repeats"], card["version"], strategies, codes)
        seeds = [[repeat, suite.seed(repeat)] for repeat in range(card["repeats"])]
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, ZeroDivisionError) as error:
        raise OutputError(f"{path}: no card of a benchmark ({type(error).__name__}: {error})") from None
    _compare(path, "", {**card, "strategies": None}, {**expected, "strategies": None})
    for entry, own in zip(card["strategies"], expected["strategies"], strict=True):
        _compare(path, f"{entry['name']}.", entry, own)
        for cell, runs in zip(suite.cells, entry["runs"], strict=True):
            if [run[:2] for run in runs] != seeds:
                where = f"{entry['name']}, {cell.label}"
                raise OutputError(f"{path}: {where}: other repeats or seeds than the suite has; the card was altered")
    return card


def _compare(path: Path, prefix: str, found: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    """Refuse unknown keys and values that differ from the expected ones."""
    for key in found:
        if key not in expected:
            raise OutputError(f"{path}: {prefix}{key}: unknown key; allowed: {', '.join(expected)}")
    for key, value in expected.items():
        if found.get(key) != value:
            said = f"{prefix}{key} = {found.get(key)}: allowed: {value}, which its runs give"
            raise OutputError(f"{path}: {said}; the card was altered")


def read_strategies(card: Mapping[str, Any]) -> list[Scored]:
    """Return the strategies of a card; raises ValueError, KeyError or TypeError if incomplete."""
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


@dataclass(frozen=True)
class Verification:
    """Verification of a card by repeated runs.

    Attributes:
        seed: of the draw of runs.
        n_runs: number of runs in the card.
        other_code: digest in the card and here, by strategy with different code.
        runs: name of each drawn run, and its differences or ""; iteration repeats the runs.
    """

    seed: int
    n_runs: int
    other_code: Mapping[str, tuple[str, str]]
    runs: Iterator[tuple[str, str]]


def verify_card(path: Path, suite: Suite, seed: int, count: int | None = None) -> Verification:
    """Draw runs of a card to repeat.

    ``seed`` must be unknown to the author of the card. ``count`` is by default a tenth of the runs, at least ten.
    Raises OutputError for an altered card or one of another suite, PluginError for an unavailable strategy.
    """
    card = read_card(path, suite)
    strategies = read_strategies(card)
    contest = Contest.of(suite, [strategy.reference for strategy in strategies], card["repeats"])
    here = {entry["name"]: (entry["code"], code_of(contest, at)) for at, entry in enumerate(card["strategies"])}
    known = [
        (place, at, run)
        for place, strategy in enumerate(strategies)
        for at, cell in enumerate(suite.cells)
        for run in strategy.cells[cell]
    ]
    count = min(len(known), max(LEAST_DRAWN, math.ceil(len(known) / 10)) if count is None else count)
    order = sorted(range(len(known)), key=lambda n: hashlib.sha256(f"{seed} {n}".encode()).digest())
    drawn = [known[n] for n in order[:count]]
    other = {name: codes for name, codes in here.items() if codes[0] != codes[1]}
    return Verification(seed, len(known), other, _made_again(contest, strategies, drawn))


def _made_again(
    contest: Contest, strategies: Sequence[Scored], drawn: Sequence[tuple[int, int, CellRun]]
) -> Iterator[tuple[str, str]]:
    plans = [SweepPlan(study) for study in contest.studies]
    for place, at, run in drawn:
        study, number, repeat = contest.suite.place(at, run.repeat, place, len(strategies))
        again = contest.run_of(run_task(plans[study].task(number, repeat)).line, run.repeat, study, number)
        other = [
            f"{column}: was {getattr(run, column)}, now {getattr(again, column)}"
            for column in COLUMNS
            if getattr(run, column) != getattr(again, column)
        ]
        yield f"{strategies[place].name}, {contest.suite.cells[at].label}, repeat {run.repeat}", "; ".join(other)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)
