"""Scores of strategies and their tables.

The efficiency of a run is ``T_bound / T``, a lower bound of the mission time over its actual time, or over the suite's
limit if not completed. The score is the mean of the cell means.

All n-th runs are one instance: one fleet and seed, on the grounds of the suite or one random ground. Cells share
these draws, so an instance has one value, its mean over the cells. Intervals are those of paired differences over
instances (``missions.statistics.difference_interval``); below 8 instances there is none.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from missions.benchmark.suite import Cell
from missions.statistics import FEW, Interval, NoInterval, difference_interval
from remoras.strategies import bounds

DIGITS = 6
"""Decimal digits in cards."""


@dataclass(frozen=True)
class CellRun:
    """Result of one run of a cell.

    Attributes:
        bound_s: lower bound of its time.
        time_s: its time; the limit if not completed.
        n_bytes: bytes sent; None if failed.
        wrong_belief_fraction: share of wrong beliefs about job holders; None if failed.
        failed: the strategy raised an error or ended its process.
        silenced: decisions over the time limit; their vehicles send nothing afterwards.
    """

    repeat: int
    seed: int
    bound_s: float
    time_s: float
    completed: bool
    n_bytes: float | None
    wrong_belief_fraction: float | None
    failed: bool = False
    silenced: int = 0

    @property
    def efficiency(self) -> float:
        """Efficiency, 0 to 1."""
        return self.bound_s / self.time_s


@dataclass(frozen=True)
class Scored:
    """Strategy with its runs in order of repeats; ``reference`` is the name given by the user."""

    name: str
    reference: str
    cells: Mapping[Cell, Sequence[CellRun]]

    @property
    def runs(self) -> list[CellRun]:
        """All runs."""
        return [run for runs in self.cells.values() for run in runs]

    @property
    def by_cell(self) -> dict[Cell, float]:
        """Mean efficiency of each cell."""
        return {cell: _mean([run.efficiency for run in runs]) for cell, runs in self.cells.items()}

    @property
    def score(self) -> float:
        """Mean of the cell means."""
        return _mean(list(self.by_cell.values()))

    @property
    def interval(self) -> Interval | None:
        """95 % interval of the score; None for few instances."""
        return _over_instances(self.by_instance.values())[1]

    @property
    def by_instance(self) -> dict[int, float]:
        """Mean efficiency over the cells by instance, for instances in all cells."""
        return _by_instance([{run.repeat: run.efficiency for run in runs} for runs in self.cells.values()])

    @property
    def worst(self) -> Cell:
        """Cell with the lowest mean efficiency."""
        return min(self.by_cell, key=lambda cell: (self.by_cell[cell], cell))

    @property
    def completed_share(self) -> float:
        """Share of completed runs."""
        return _mean([float(run.completed) for run in self.runs])

    @property
    def mean_bytes(self) -> float | None:
        """Mean bytes sent in a run."""
        return _mean_of([run.n_bytes for run in self.runs])

    @property
    def mean_wrong(self) -> float | None:
        """Mean share of wrong beliefs about job holders."""
        return _mean_of([run.wrong_belief_fraction for run in self.runs])

    def difference(self, network: str, other: str) -> tuple[float, Interval | None]:
        """Return the paired difference in efficiency between two networks, with its interval."""
        pairs = [
            {run.repeat: run.efficiency - twin.efficiency for run, twin in zip(runs, self.cells[at], strict=True)}
            for cell, runs in self.cells.items()
            if cell.network == network and (at := cell._replace(network=other)) in self.cells
        ]
        return _over_instances(_by_instance(pairs).values())


def against(one: Scored, other: Scored) -> tuple[float, Interval | None]:
    """Return the difference in score over common instances, with its interval."""
    both = one.by_instance.keys() & other.by_instance.keys()
    return _over_instances([one.by_instance[at] - other.by_instance[at] for at in sorted(both)])


def _by_instance(cells: Sequence[Mapping[int, float]]) -> dict[int, float]:
    values: dict[int, list[float]] = defaultdict(list)
    for cell in cells:
        for repeat, value in cell.items():
            values[repeat].append(value)
    return {repeat: _mean(own) for repeat, own in values.items() if len(own) == len(cells)}


def _over_instances(values: Collection[float]) -> tuple[float, Interval | None]:
    interval = difference_interval(list(values))
    if isinstance(interval, NoInterval):
        return _mean(list(values)), None
    return _mean(list(values)), (round(interval[0], DIGITS), round(interval[1], DIGITS))


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _mean_of(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return _mean(known) if known else None


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
        return (
            f"Suite {card['suite']} (digest {card['digest'][:12]}), split {card['split']}, {len(card['cells'])} cells, "
            f"{n} runs of each; remoras {card['version']}. Score: mean of T_bound / T, "
            f"T = {card['limit_s']:g} s if never completed; 95 % intervals over {n} instances ({FEW} needed)."
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
    """Return a number with its interval, if any.

    >>> with_interval(0.5, [0.25, 0.75]), with_interval(0.0, None, "+")
    ('0.500 [0.250, 0.750]', '+0.000')
    """
    bounds = "" if interval is None else " [" + ", ".join(f"{value:{sign}.3f}" for value in interval) + "]"
    return f"{mean:{sign}.3f}{bounds}"


def signed(difference: Sequence[Any]) -> str:
    """Return a difference with sign and interval.

    >>> signed((0.25, None))
    '+0.250'
    """
    mean, interval = difference
    return with_interval(mean, interval, "+")


def _markdown(rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def _escaped(text: str) -> str:
    for character in "%_&#":
        text = text.replace(character, f"\\{character}")
    return text
