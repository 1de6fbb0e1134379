"""Result card: a citable, verifiable file of a benchmark with every run and the digests of suite and code.

Equal runs give equal bytes, interrupted or not; nothing in it depends on the machine.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from statistics import fmean
from typing import Any

from missions.benchmark.running import DIGITS, CellRun, Contest, Scored, against, variance_share
from missions.benchmark.suite import Cell, Suite
from missions.errors import OutputError
from missions.files import text_of
from missions.statistics import FEW
from missions.sweeps.code import fingerprint, references, short
from missions.sweeps.plan import SweepPlan
from missions.sweeps.worker import run_task
from remoras.strategies import bounds
from remoras.version import __version__

COLUMNS = tuple(field.name for field in fields(CellRun))  # columns of a run in a card, in this order
LEAST_DRAWN = 10


def card_of(contest: Contest, scored: Sequence[Scored]) -> dict[str, Any]:
    """Return the card of completed strategies."""
    codes = [code_of(contest, place) for place in range(len(scored))]
    return _card(contest.suite, contest.repeats, __version__, scored, codes)


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
        "bytes": _mean_of([run.n_bytes for run in strategy.runs]),
        "wrong_beliefs": _mean_of([run.wrong_belief_fraction for run in strategy.runs]),
        "runs_silenced": sum(run.silenced > 0 for run in strategy.runs),
        f"minus_{alike}": {
            other: [round(mean, DIGITS), interval and list(interval)] for other, (mean, interval) in shapes.items()
        },
        "by_cell": [round(strategy.by_cell[cell], DIGITS) for cell in suite.cells],
    }


def code_of(contest: Contest, place: int) -> str:
    """Return the digest of the code behind the runs: this program and the strategy's sources."""
    scenario = contest.study.configurations[contest.suite.number(0, place)].scenario
    return short(fingerprint(references([scenario])))


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
            # Runs with other seeds could have been selected for their results.
            if [run[:2] for run in runs] != seeds:
                where = f"{entry['name']}, {cell.label}"
                raise OutputError(f"{path}: {where}: other repeats or seeds than the suite has; the card was altered")
    return card


def _compare(path: Path, prefix: str, entries: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    # A key without a check could hold a false claim.
    for key in entries:
        if key not in expected:
            raise OutputError(f"{path}: {prefix}{key}: unknown key; allowed: {', '.join(expected)}")
    for key, value in expected.items():
        if entries.get(key) != value:
            fault = f"{prefix}{key} = {entries.get(key)}: allowed: {value}, which its runs give"
            raise OutputError(f"{path}: {fault}; the card was altered")


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
    """Verification of a card by repeated runs, drawn by ``seed``.

    ``other_code`` has both digests of changed strategies; ``runs`` repeats each drawn run, yields its name and
    differences.
    """

    seed: int
    n_runs: int
    other_code: Mapping[str, tuple[str, str]]
    runs: Iterator[tuple[str, str]]


def verify_card(path: Path, suite: Suite, seed: int, count: int | None = None) -> Verification:
    """Draw ``count`` runs of a card to repeat: by default a tenth of them, at least ten.

    ``seed`` must be unknown to the author of the card. Raises OutputError for an altered card or one of another suite,
    PluginError for an unavailable strategy.
    """
    card = read_card(path, suite)
    strategies = read_strategies(card)
    contest = Contest.of(suite, [strategy.reference for strategy in strategies], card["repeats"])
    here = {entry["name"]: (entry["code"], code_of(contest, index)) for index, entry in enumerate(card["strategies"])}
    known = [
        (place, index, run)
        for place, strategy in enumerate(strategies)
        for index, cell in enumerate(suite.cells)
        for run in strategy.cells[cell]
    ]
    count = min(len(known), max(LEAST_DRAWN, math.ceil(len(known) / 10)) if count is None else count)
    # A hash gives the same draw in every version of Python, unlike its generator.
    order = sorted(range(len(known)), key=lambda n: hashlib.sha256(f"{seed} {n}".encode()).digest())
    drawn = [known[n] for n in order[:count]]
    other = {name: codes for name, codes in here.items() if codes[0] != codes[1]}
    return Verification(seed, len(known), other, _made_again(contest, strategies, drawn))


def _made_again(
    contest: Contest, strategies: Sequence[Scored], drawn: Sequence[tuple[int, int, CellRun]]
) -> Iterator[tuple[str, str]]:
    plan = SweepPlan(contest.study)
    for place, index, run in drawn:
        number = contest.suite.number(index, place)
        again = contest.run_of(run_task(plan.task(number, run.repeat)).line, run.repeat, number)
        other = [
            f"{column}: was {getattr(run, column)}, now {getattr(again, column)}"
            for column in COLUMNS
            if getattr(run, column) != getattr(again, column)
        ]
        yield f"{strategies[place].name}, {contest.suite.cells[index].label}, repeat {run.repeat}", "; ".join(other)


def _mean_of(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return round(fmean(known), DIGITS) if known else None


HEADS = ("strategy", "score [95 %]", "completed", "worst cell", "bytes", "wrong beliefs", "instances")


class ScoreTable:
    """Rows of strategies, best first, ranked with ``others`` of another card of the suite."""

    def __init__(
        self, card: Mapping[str, Any], scored: Sequence[Scored], others: Sequence[tuple[Mapping[str, Any], Scored]] = ()
    ) -> None:
        self.card = card
        self._first = scored[0]
        own = list(zip(card["strategies"], scored, strict=True))
        named = {strategy.reference for strategy in scored}
        own += [(entry, strategy) for entry, strategy in others if strategy.reference not in named]
        self._rows = sorted(own, key=lambda row: (-row[0]["score"], row[0]["name"]))

    @property
    def heads(self) -> tuple[str, ...]:
        """Column headings."""
        return (*HEADS, f"{self._first.name} minus it [95 %]")

    def rows(self) -> Iterator[tuple[str, ...]]:
        """Yield the entries of each row."""
        for entry, strategy in self._rows:
            mark = " (bound)" if strategy.reference in bounds() else ""
            yield (
                entry["name"] + mark,
                with_interval(entry["score"], entry["interval"]),
                f"{100.0 * entry['completed']:.1f} %",
                f"{entry['worst']:.3f} ({entry['worst_cell']})",
                "-" if entry["bytes"] is None else f"{entry['bytes']:.0f}",
                "-" if entry["wrong_beliefs"] is None else f"{100.0 * entry['wrong_beliefs']:.1f} %",
                str(len(strategy.by_instance)),
                signed(against(self._first, strategy)),
            )

    def shapes(self) -> Iterator[tuple[str, ...]]:
        """Yield the score differences of each network to the first, after the headings."""
        key = next(key for key in self._rows[0][0] if key.startswith("minus_"))
        networks = list(self._rows[0][0][key])
        if networks:
            alike = key.removeprefix("minus_")
            yield ("strategy", *(f"{network} minus {alike} [95 %]" for network in networks))
            for entry, _ in self._rows:
                yield (entry["name"], *(signed(entry[key][network]) for network in networks))

    @property
    def caption(self) -> str:
        """Suite, version and definition of the score."""
        card = self.card
        n = card["repeats"]
        ranked = [strategy for _, strategy in self._rows if strategy.reference not in bounds()]
        explained = (
            "" if len(ranked) < 2 else f"; the strategy explains {variance_share(ranked):.0%} of the variance in a cell"
        )
        return (
            f"Suite {card['suite']} (digest {card['digest'][:12]}), split {card['split']}, {len(card['cells'])} cells, "
            f"{n} runs of each; remoras {card['version']}. Score: mean of T_bound / T, "
            f"T = {card['limit_s']:g} s if never completed; 95 % intervals over {n} instances "
            f"({FEW} needed){explained}."
        )

    def markdown(self) -> str:
        """Return the tables as Markdown."""
        shapes = list(self.shapes())
        parts = [self.caption, _markdown([self.heads, *self.rows()])]
        return "\n\n".join([*parts, *([_markdown(shapes)] if shapes else [])]) + "\n"

    def latex(self) -> str:
        """Return the first table as LaTeX."""
        lines = [" & ".join(map(_escaped, row)) + r" \\" for row in (self.heads, *self.rows())]
        body = "\n".join([lines[0], r"\hline", *lines[1:]])
        columns = "l" * len(self.heads)
        return f"% {self.caption}\n\\begin{{tabular}}{{{columns}}}\n{body}\n\\end{{tabular}}\n"

    def bibtex(self) -> str:
        """Return a BibTeX entry of suite and version."""
        card = self.card
        return (
            f"@misc{{remoras-{card['suite']},\n"
            "  author = {{The REMORAS simulator authors}},\n"
            f"  title = {{{{REMORAS simulator {card['version']}, benchmark {card['suite']}}}}},\n"
            f"  note = {{Split {card['split']}, {card['repeats']} runs of each cell, suite digest {card['digest']}}},\n"
            "}\n"
        )


def with_interval(mean: float, interval: Sequence[float] | None, sign: str = "") -> str:
    """Return a number with its interval, if any, such as ``0.500 [0.250, 0.750]``."""
    bounds = "" if interval is None else " [" + ", ".join(f"{value:{sign}.3f}" for value in interval) + "]"
    return f"{mean:{sign}.3f}{bounds}"


def signed(difference: Sequence[Any]) -> str:
    """Return a difference with sign and interval, such as ``+0.250``."""
    mean, interval = difference
    return with_interval(mean, interval, "+")


def _markdown(rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def _escaped(text: str) -> str:
    for character in "%_&#":
        text = text.replace(character, f"\\{character}")
    return text
