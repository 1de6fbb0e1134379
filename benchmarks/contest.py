"""Compare the strategies of benchmark cards of one split.

Prints scores, pairs without a significant difference (step-down sign flips over instances, 5 %), and regret: the mean
gap per condition (network and unforeseen case) to the best of the nine shipped strategies there, in hindsight. With
``--other``, it also counts the pairs in the same order on another split.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from statistics import fmean

from missions.benchmark.card import read_strategies
from missions.benchmark.running import Scored, against
from missions.comparison.treatments import SIGNIFICANT
from missions.statistics import step_down_p
from remoras.strategies import strategies

Contest = Mapping[str, Scored]


def read(paths: Sequence[Path]) -> Contest:
    """Strategies of cards, the best first; of one that several have the last counts.

    Raises:
        OSError, ValueError, KeyError, TypeError: a file is no card, or they are of several suites or splits.
    """
    cards = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    if len({(card["digest"], card["split"]) for card in cards}) > 1:
        raise ValueError("they are of several suites or splits; allowed: of one, and behind --other of another")
    by_name = {strategy.name: strategy for card in cards for strategy in read_strategies(card)}
    return dict(sorted(by_name.items(), key=lambda of: -of[1].score))


def ranked(contest: Contest) -> list[str]:
    """The nine that are shipped: neither a bound nor one of others."""
    shipped = {name for name, strategy in strategies().items() if strategy.declaration.sharing is None}
    return [name for name in contest if name in shipped]


def apart(contest: Contest, names: Sequence[str]) -> dict[tuple[str, str], bool]:
    """Of each pair, the better one first, whether it is told apart."""
    pairs = list(combinations(names, 2))
    of = {name: contest[name].by_instance for name in names}
    instances = set.intersection(*(set(own) for own in of.values()))
    p = step_down_p([[of[one][at] - of[other][at] for one, other in pairs] for at in instances])
    return {pair: value < SIGNIFICANT for pair, value in zip(pairs, p, strict=True)}


def by_condition(scored: Scored) -> dict[tuple[str, str], float]:
    """Mean efficiency over grounds by network and what is unforeseen."""
    efficiencies: dict[tuple[str, str], list[float]] = defaultdict(list)
    for cell, efficiency in scored.by_cell.items():
        efficiencies[cell.network, cell.unforeseen].append(efficiency)
    return {condition: fmean(values) for condition, values in efficiencies.items()}


def regrets(contest: Contest, names: Sequence[str]) -> dict[str, list[float]]:
    """Of each strategy, by condition, the share that is lacking to the best of some in hindsight."""
    efficiency = {name: by_condition(strategy) for name, strategy in contest.items()}
    best = {condition: max(efficiency[name][condition] for name in names) for condition in efficiency[names[0]]}
    return {name: [1.0 - of[condition] / best[condition] for condition in best] for name, of in efficiency.items()}


def lines(contest: Contest, other: Contest) -> Iterator[str]:
    """All that is said."""
    names = ranked(contest)
    lacking = regrets(contest, names)
    yield "strategy: score [95 %], completed, regret, worst; minus the best of the nine [95 %]"
    for name, one in contest.items():
        mean, interval = against(one, contest[names[0]])
        told = "" if interval is None else f" [{interval[0]:+.3f}, {interval[1]:+.3f}]"
        score = "" if one.interval is None else f" [{one.interval[0]:.3f}, {one.interval[1]:.3f}]"
        yield (
            f"{name}: {one.score:.3f}{score}, {one.completed_share:.1%}, {fmean(lacking[name]):.1%}, "
            f"{max(lacking[name]):.1%}; {mean:+.3f}{told}"
        )
    found = apart(contest, names)
    yield f"{sum(found.values())} of {len(found)} pairs are told apart; not:"
    yield from (f"  {one}, {another}" for (one, another), is_apart in found.items() if not is_apart)
    if other:
        pairs = [(one, another) for one, another in found if one in other and another in other]
        same = sum(other[one].score > other[another].score for one, another in pairs)
        yield f"{same} of {len(pairs)} pairs stand in the same order: Kendall's tau {2 * same / len(pairs) - 1:.2f}"


def main() -> None:
    """Say it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.contest", description=__doc__)
    parser.add_argument("card", nargs="+", type=Path)
    parser.add_argument("--other", nargs="+", type=Path, default=[])
    asked = parser.parse_args()
    try:
        contest, other = read(asked.card), read(asked.other)
    except (OSError, ValueError, KeyError, TypeError) as error:
        parser.error(f"no cards of a benchmark: {error}")
    if not ranked(contest):
        parser.error(f"none of the nine shipped strategies is in these cards, but {', '.join(contest)}")
    print(*lines(contest, other), sep="\n")


if __name__ == "__main__":
    main()
