"""Two-level factorial designs, full and fractional, with their resolution and what they cannot tell apart.

A full design of k factors has 2^k runs. A fraction halves it p times: k - p factors make a full design, and each other
column is a product of theirs. Products of columns that are 1 in all runs are the *words* of the design; the length of
the shortest is its *resolution* (Box and Hunter 1961). At resolution III main effects are mixed with interactions of
two factors, at IV these with each other, at V neither. Of all choices of columns the one of highest resolution is
taken, of these the one with the fewest words of each length, the shortest first (Fries and Hunter 1980, minimum
aberration).
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
Term = frozenset[str]
"""Factors whose columns are multiplied: one for a main effect, two for an interaction."""


@dataclass(frozen=True)
class FactorialDesign:
    """Runs of a two-level design.

    Args:
        factors: names, in the order of the columns.
        generators: of each column that is a product, the factors that are multiplied.
    """

    factors: tuple[str, ...]
    generators: Mapping[str, Term]

    @cached_property  # 0.3 ms, asked for each effect of each condition
    def runs(self) -> tuple[Mapping[str, int], ...]:
        """The level of each factor in each run; the last factor that is no product varies fastest."""
        basic = [name for name in self.factors if name not in self.generators]
        found = []
        for levels in itertools.product((LOW, HIGH), repeat=len(basic)):
            run = dict(zip(basic, levels, strict=True))
            run |= {name: math.prod(run[one] for one in of) for name, of in self.generators.items()}
            found.append({name: run[name] for name in self.factors})
        return tuple(found)

    @property
    def words(self) -> tuple[Term, ...]:
        """Products of factors that are the same in all runs; none of a full design."""
        single = [of | {name} for name, of in self.generators.items()]
        found = []
        for count in range(1, len(single) + 1):
            for chosen in itertools.combinations(single, count):
                word: Term = frozenset()
                for one in chosen:
                    word ^= one
                found.append(word)
        return tuple(sorted(found, key=lambda word: (len(word), sorted(map(self.factors.index, word)))))

    @property
    def resolution(self) -> int | None:
        """Length of the shortest word; None of a full design, in which nothing is mixed."""
        return len(self.words[0]) if self.words else None

    @property
    def terms(self) -> tuple[Term, ...]:
        """Main effects, then interactions of two factors."""
        pairs = itertools.combinations(self.factors, 2)
        return (*(frozenset({name}) for name in self.factors), *(frozenset(pair) for pair in pairs))

    def aliases(self, term: Term) -> tuple[Term, ...]:
        """Main effects and interactions of two factors that no run of the design tells from ``term``."""
        return tuple(other for other in self.terms if other != term and other ^ term in self.words)

    def column(self, term: Term) -> tuple[int, ...]:
        """The product of the levels of the factors of a term, run by run."""
        return tuple(math.prod(run[name] for name in term) for run in self.runs)

    def named(self, term: Term) -> str:
        """A term in words, its factors in the order of the design."""
        return " x ".join(sorted(term, key=self.factors.index))

    def said(self) -> str:
        """The design in one line: runs, resolution, generators."""
        n, k, p = len(self.runs), len(self.factors), len(self.generators)
        if not p:
            return f"full factorial, 2^{k} = {n} runs: nothing is mixed"
        made = "; ".join(f"{name} = {self.named(of)}" for name, of in self.generators.items())
        return f"2^({k}-{p}) = {n} runs, resolution {ROMAN[self.resolution or 0]} ({made})"


def designed(factors: Sequence[str], halvings: int) -> FactorialDesign:
    """The design of so many factors, halved so many times; see the module's text.

    Raises:
        ValueError: there are too many halvings for main effects that are not mixed with each other.

    >>> designed(("a", "b", "c", "d", "e"), 1).said()
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
    """Most halvings that leave resolution III: no two main effects are mixed.

    >>> [most_halvings(n) for n in (2, 3, 5, 7, 8)]
    [0, 1, 2, 4, 4]
    """
    return max(p for p in range(n_factors) if n_factors <= (1 << (n_factors - p)) - 1)


def _candidates(factors: Sequence[str], halvings: int) -> Iterator[FactorialDesign]:
    """All designs in which the last columns are products of others, each of another set of two or more."""
    basic, made = factors[:-halvings], factors[-halvings:]
    products = [frozenset(of) for size in range(len(basic), 1, -1) for of in itertools.combinations(basic, size)]
    for chosen in itertools.combinations(products, halvings):
        yield FactorialDesign(tuple(factors), dict(zip(made, chosen, strict=True)))


def _aberration(design: FactorialDesign) -> tuple[int, ...]:
    """How many words there are of each length, the shortest first: fewer short words are better."""
    lengths = [len(word) for word in design.words]
    return tuple(lengths.count(length) for length in range(1, len(design.factors) + 1))
