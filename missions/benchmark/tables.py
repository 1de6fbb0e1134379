"""Tables of a benchmark, for pages, papers and terminals; and how to cite it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from missions.benchmark.scoring import Scored, against
from missions.comparison.intervals import FEW
from remoras.strategies import bounds

HEADS = ("strategy", "score [95 %]", "completed", "worst cell", "bytes", "wrong beliefs", "instances")


class ScoreTable:
    """Rows of strategies, best first.

    Args:
        card: whose strategies are placed.
        scored: these with their runs.
        others: entries of another card of the suite with their runs, to place them among.
    """

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
        """Heads of the columns."""
        return (*HEADS, f"{self._first.name} minus it [95 %]")

    def rows(self) -> Iterator[tuple[str, ...]]:
        """Entries of each row."""
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
        """What networks of the same mean loss come to: score of each minus that of the first; the heads first."""
        key = next(key for key in self._rows[0][0] if key.startswith("minus_"))
        networks = list(self._rows[0][0][key])
        if networks:
            alike = key.removeprefix("minus_")
            yield ("strategy", *(f"{network} minus {alike} [95 %]" for network in networks))
            for entry, _ in self._rows:
                yield (entry["name"], *(signed(entry[key][network]) for network in networks))

    @property
    def caption(self) -> str:
        """What the numbers are of."""
        card = self.card
        n = card["repeats"]
        return (
            f"Suite {card['suite']} (digest {card['digest'][:12]}), split {card['split']}, {len(card['cells'])} cells, "
            f"{n} runs of each; remoras {card['version']}. Score: mean of T_bound / T, "
            f"T = {card['limit_s']:g} s if never completed; 95 % intervals over {n} instances ({FEW} needed)."
        )

    def markdown(self) -> str:
        """The tables as Markdown."""
        shapes = list(self.shapes())
        parts = [self.caption, _markdown([self.heads, *self.rows()])]
        return "\n\n".join([*parts, *([_markdown(shapes)] if shapes else [])]) + "\n"

    def latex(self) -> str:
        """The first table as LaTeX."""
        lines = [" & ".join(map(_escaped, row)) + r" \\" for row in (self.heads, *self.rows())]
        body = "\n".join([lines[0], r"\hline", *lines[1:]])
        columns = "l" * len(self.heads)
        return f"% {self.caption}\n\\begin{{tabular}}{{{columns}}}\n{body}\n\\end{{tabular}}\n"

    def bibtex(self) -> str:
        """How to cite suite and version."""
        card = self.card
        return (
            f"@misc{{remoras-{card['suite']},\n"
            "  author = {{The REMORAS simulator authors}},\n"
            f"  title = {{{{REMORAS simulator {card['version']}, benchmark {card['suite']}}}}},\n"
            f"  note = {{Split {card['split']}, {card['repeats']} runs of each cell, suite digest {card['digest']}}},\n"
            "}\n"
        )


def with_interval(mean: float, interval: Sequence[float] | None, sign: str = "") -> str:
    """A number with its interval, if it has one.

    >>> with_interval(0.5, [0.25, 0.75]), with_interval(0.0, None, "+")
    ('0.500 [0.250, 0.750]', '+0.000')
    """
    bounds = "" if interval is None else " [" + ", ".join(f"{value:{sign}.3f}" for value in interval) + "]"
    return f"{mean:{sign}.3f}{bounds}"


def signed(difference: Sequence[Any]) -> str:
    """A difference with its interval.

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
