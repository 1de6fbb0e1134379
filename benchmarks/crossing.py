"""Estimate coverage and runs of ``remoras compare --crossing`` in simulated studies.

    python -m benchmarks.crossing --studies 1000

Each study has six levels and a drawn curve of paired differences with a known crossing, in one of four shapes. Noise
has the stated spread, 0.3 of its variance from the repeat; ``grows`` rises with the level to 1.6 times its mean.
Refined studies start with 8 pairs per level; grids have 32. Results are deterministic.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping
from statistics import median
from typing import NamedTuple

import numpy as np

from benchmarks.intervals import SHAPES as TIMES
from missions.comparison.crossing import Pairs
from missions.errors import OutputError
from missions.statistics import FEW, Array

LEVELS = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 0.9])
FINE = np.linspace(0.0, 0.9, 10)
GRID = 32  # pairs per level of a grid
OF_REPEAT = 0.3  # share of the variance that all pairs of a repeat have in common
Curve = Callable[[Array], Array]


def _line(draws: np.random.Generator, at: float) -> Curve:
    return lambda x: np.asarray(x - at)


def _late(draws: np.random.Generator, at: float) -> Curve:
    power = draws.uniform(1.5, 3.0)
    return lambda x: 1.2 * (x**power - at**power)


def _early(draws: np.random.Generator, at: float) -> Curve:
    power = draws.uniform(0.5, 0.8)
    return lambda x: x**power - at**power


def _step(draws: np.random.Generator, at: float) -> Curve:
    width = draws.uniform(0.25, 0.5)
    return lambda x: np.asarray(0.5 * np.tanh((x - at) / width))


SHAPES: dict[str, Callable[[np.random.Generator, float], Curve]] = {
    "line": _line,
    "late": _late,
    "early": _early,
    "step": _step,
}
NOISES = ("normal", "one in ten slow", "grows")


class Study(NamedTuple):
    """Simulated study: its curve with the crossing ``at``, the luck of its repeats, spread and kind of noise."""

    curve: Curve
    at: float
    luck: Array
    spread: float
    noise: str

    def cell(self, draws: np.random.Generator, level: float, n: int) -> Array:
        """Paired differences of the first ``n`` repeats at a level."""
        scale = self.spread * (0.4 + 1.33 * level if self.noise == "grows" else 1.0)
        own = _noise(draws, self.noise, n)
        mixed = np.sqrt(OF_REPEAT) * self.luck[:n] + np.sqrt(1.0 - OF_REPEAT) * own
        return np.asarray(self.curve(np.full(n, level)) + scale * mixed)


def _noise(draws: np.random.Generator, noise: str, n: int) -> Array:
    if noise == "one in ten slow":
        own = TIMES[noise]
        return np.asarray((own(draws, n) - own(draws, n)) / 0.245)
    return draws.normal(size=n)


def drawn(draws: np.random.Generator, shape: str, spread: float, noise: str) -> Study:
    """Draw a study with its crossing between 0.15 and 0.8."""
    at = draws.uniform(0.15, 0.8)
    return Study(SHAPES[shape](draws, at), at, _noise(draws, noise, 400), spread, noise)


def pairs_of(knots: Array, cells: Mapping[float, Array]) -> Pairs:
    """Return the pairs of a study from its differences by level."""
    levels = np.concatenate([np.full(len(values), level) for level, values in cells.items()])
    repeats = np.concatenate([np.arange(len(values)) for values in cells.values()])
    return Pairs(knots, levels, np.concatenate([*cells.values()]), repeats)


def covers(pairs: Pairs, at: float) -> bool:
    """True if the confidence set contains a level."""
    return any(low <= at <= high for low, high in pairs.confidence_set)


def width(pairs: Pairs) -> float:
    """Sum of the lengths of the confidence set."""
    return sum(high - low for low, high in pairs.confidence_set)


def coverage(
    shape: str, noise: str, spread: float, n: int, n_studies: int, knots: Array = LEVELS, seed: int = 1
) -> tuple[float, float]:
    """Return the share of confidence sets that contain the crossing, and their median width."""
    draws = np.random.Generator(np.random.Philox([seed, n, round(1000 * spread), len(shape), len(noise)]))
    held, widths = 0, []
    for _ in range(n_studies):
        study = drawn(draws, shape, spread, noise)
        pairs = pairs_of(knots, {level: study.cell(draws, level, n) for level in knots})
        held += covers(pairs, study.at)
        widths.append(width(pairs))
    return held / n_studies, median(widths)


def refined(
    shape: str, noise: str, spread: float, knots: Array, n: int, n_studies: int, seed: int = 1
) -> tuple[float, float]:
    """Return coverage and median width of studies of 8 pairs per level, refined by ``n`` pairs."""
    draws = np.random.Generator(np.random.Philox([seed, n, round(1000 * spread), len(shape), len(noise)]))
    held, widths = 0, []
    for _ in range(n_studies):
        study = drawn(draws, shape, spread, noise)
        pairs = pairs_of(knots, {level: study.cell(draws, level, FEW) for level in knots})
        for batch in range(n // FEW):
            try:
                level = pairs.next_level()
            except OutputError:  # no crossing found
                break
            new = study._replace(luck=_noise(draws, noise, FEW)).cell(draws, level, FEW)
            repeats = np.append(pairs.repeats, 1000.0 * (batch + 1) + np.arange(FEW))
            pairs = Pairs(
                knots, np.append(pairs.levels, np.full(FEW, level)), np.append(pairs.differences, new), repeats
            )
        held += covers(pairs, study.at)
        widths.append(width(pairs))
    return held / n_studies, median(widths)


def coverages(n_studies: int) -> Iterator[str]:
    """Yield the rows of coverage as Markdown."""
    for shape in SHAPES:
        for noise in NOISES:
            for spread in (0.2, 0.5):
                rows = [coverage(shape, noise, spread, n, n_studies) for n in (8, 16, 32)]
                values = " | ".join(f"{100 * held:.1f} %, {wide:.2f}" for held, wide in rows)
                yield f"| {shape} | {noise} | {spread:g} | {values} |"


def refinements(n_studies: int) -> Iterator[str]:
    """Yield the rows of refinement as Markdown: grids of 32 pairs per level, and refined studies of six levels."""
    for shape in SHAPES:
        grids = [
            (len(knots) * GRID, *coverage(shape, "normal", 0.2, GRID, n_studies, knots)) for knots in (LEVELS, FINE)
        ]
        starts = [(len(LEVELS) * FEW + n, *refined(shape, "normal", 0.2, LEVELS, n, n_studies)) for n in (48, 64, 112)]
        values = " | ".join(f"{pairs}: {100 * held:.1f} %, {wide:.3f}" for pairs, held, wide in [*grids, *starts])
        yield f"| {shape} | {values} |"


def main() -> None:
    """Print the rows as tables of Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=200, help="simulated studies of each row")
    given = parser.parse_args()
    print("| curve | noise | spread | n = 8: covers, width | n = 16 | n = 32 |\n|---|---|---|---|---|---|")
    for row in coverages(given.studies):
        print(row, flush=True)
    heads = "grid of 6 levels, pairs: covers, width | grid of 10 levels | refined from 6 levels | refined | refined"
    print(f"\n| curve | {heads} |\n|---|---|---|---|---|---|")
    for row in refinements(given.studies):
        print(row, flush=True)


if __name__ == "__main__":
    main()
