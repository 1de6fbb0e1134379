"""Two-level factorial designs, full and fractional, with resolution and aliases.

A full design of k factors has 2^k runs. A fraction halves it p times: k - p factors form a full design, and each other
column is a product of theirs. Products of columns that equal 1 in all runs are the *words* of the design; the length of
the shortest is its *resolution* (Box and Hunter 1961). At resolution III main effects are aliased with two-factor
interactions, at IV these with each other, at V neither. The design chosen has the highest resolution, then the fewest
words of each length, the shortest first (minimum aberration, Fries and Hunter 1980).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

LOW, HIGH = -1, 1
MOST_FACTORS = 8
ROMAN = ("", "I", "II", "III", "IV", "V", "VI", "VII", "VIII")
Term = frozenset[str]  # factors whose columns are multiplied: one for a main effect, two for an interaction


@dataclass(frozen=True)
class FactorialDesign:
    """Runs of a two-level design; ``generators`` has the factors of each product column."""

    factors: tuple[str, ...]
    generators: Mapping[str, Term]

    @cached_property  # 0.3 ms, asked for each effect of each condition
    def runs(self) -> tuple[Mapping[str, int], ...]:
        """Level of each factor in each run; the last factor that is no product varies fastest."""
        basic = [name for name in self.factors if name not in self.generators]
        runs = []
        for levels in itertools.product((LOW, HIGH), repeat=len(basic)):
            run = dict(zip(basic, levels, strict=True))
            run |= {name: math.prod(run[factor] for factor in factors) for name, factors in self.generators.items()}
            runs.append({name: run[name] for name in self.factors})
        return tuple(runs)

    @property
    def words(self) -> tuple[Term, ...]:
        """Products of factors that are constant over all runs; none for a full design."""
        single = [factors | {name} for name, factors in self.generators.items()]
        words = []
        for count in range(1, len(single) + 1):
            for chosen in itertools.combinations(single, count):
                word: Term = frozenset()
                for generator in chosen:
                    # A squared factor is 1, so that a product is the symmetric difference.
                    word ^= generator
                words.append(word)
        return tuple(sorted(words, key=lambda word: (len(word), sorted(map(self.factors.index, word)))))

    @property
    def resolution(self) -> int | None:
        """Length of the shortest word; None for a full design, which has no aliases."""
        return len(self.words[0]) if self.words else None

    @property
    def terms(self) -> tuple[Term, ...]:
        """Main effects, then two-factor interactions."""
        pairs = itertools.combinations(self.factors, 2)
        return (*(frozenset({name}) for name in self.factors), *(frozenset(pair) for pair in pairs))

    def aliases(self, term: Term) -> tuple[Term, ...]:
        """Return the main effects and two-factor interactions aliased with ``term``."""
        return tuple(other for other in self.terms if other != term and other ^ term in self.words)

    def column(self, term: Term) -> tuple[int, ...]:
        """Return the product of the levels of a term's factors, run by run."""
        return tuple(math.prod(run[name] for name in term) for run in self.runs)

    def named(self, term: Term) -> str:
        """Return the name of a term, its factors in design order."""
        return " x ".join(sorted(term, key=self.factors.index))

    def description(self) -> str:
        """Describe the design in one line: runs, resolution, generators."""
        n, k, p = len(self.runs), len(self.factors), len(self.generators)
        if not p:
            return f"full factorial, 2^{k} = {n} runs: no effects are aliased"
        made = "; ".join(f"{name} = {self.named(factors)}" for name, factors in self.generators.items())
        return f"2^({k}-{p}) = {n} runs, resolution {ROMAN[self.resolution or 0]} ({made})"


def designed(factors: Sequence[str], halvings: int) -> FactorialDesign:
    """Return the minimum-aberration design of these factors; ValueError if ``halvings`` alias main effects.

    >>> designed(("a", "b", "c", "d", "e"), 1).description()
    '2^(5-1) = 16 runs, resolution V (e = a x b x c x d)'
    >>> [design.resolution for design in (designed("abcdef", 2), designed("abcdefg", 4), designed("abc", 0))]
    [4, 3, None]
    """
    if not halvings:
        return FactorialDesign(tuple(factors), {})
    best = min(_candidates(factors, halvings), key=_aberration, default=None)
    if best is None:
        raise ValueError(f"{len(factors)} factors can be halved {most_halvings(len(factors))} times at most")
    return best


def most_halvings(n_factors: int) -> int:
    """Return the most halvings that keep resolution III, so no pair of main effects is aliased."""
    # 2^(n - p) runs distinguish 2^(n - p) - 1 effects, besides the mean.
    return max(p for p in range(n_factors) if n_factors <= (1 << (n_factors - p)) - 1)


def _candidates(factors: Sequence[str], halvings: int) -> Iterator[FactorialDesign]:
    basic, made = factors[:-halvings], factors[-halvings:]
    # ``min`` keeps the first of equal designs: that with the longest products.
    products = [frozenset(p) for size in range(len(basic), 1, -1) for p in itertools.combinations(basic, size)]
    for chosen in itertools.combinations(products, halvings):
        yield FactorialDesign(tuple(factors), dict(zip(made, chosen, strict=True)))


def _aberration(design: FactorialDesign) -> tuple[int, ...]:
    lengths = [len(word) for word in design.words]
    return tuple(lengths.count(length) for length in range(1, len(design.factors) + 1))
