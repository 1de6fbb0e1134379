"""Bursts fitted to traces of known chains: which model is chosen, and how often intervals hold the truth.

``python -m benchmarks.bursts 100`` draws so many traces of each chain and length from the channel ``gilbert-elliott``,
a packet in each slot, and fits them as ``remoras bursts`` does. The tables of docs/seas.md are its lines.
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np

from exchange.acoustics.bursts import WARRANTED, BurstModel, NoBurstsError, Recorded, best, fits
from exchange.acoustics.link import GilbertElliott
from exchange.acoustics.loss import link_uniform, slot_key, trial_key

CHAINS = {
    "long spells": BurstModel(0.02, 0.1, 0.05, 0.8),
    "short spells": BurstModel(0.1, 0.3, 0.05, 0.8),
    "of Gilbert": BurstModel(0.01, 0.03, 0.0, 0.7),
    "plain Markov": BurstModel(0.1, 0.4, 0.0, 1.0),
    "alike, 0.1": BurstModel(0.5, 0.5, 0.1, 0.1),
    "alike, 0.4": BurstModel(0.5, 0.5, 0.4, 0.4),
    "alike, 0.8": BurstModel(0.5, 0.5, 0.8, 0.8),
}
LENGTHS = (300, 1000, 3000)


class Told(NamedTuple):
    """What a fit says of one trace: the model chosen, if that is far from independent losses, intervals by parameter.

    ``held`` says of each parameter that has an interval whether the truth is in it.
    """

    chosen: str
    is_strong: bool
    held: dict[str, bool]


def outcomes(model: BurstModel, n: int, seed: int, every: int = 1, receiver: int = 1) -> list[bool]:
    """Which of ``n`` packets the channel ``gilbert-elliott`` loses that are sent over one link each ``every`` slots."""
    link, key = GilbertElliott(*model, seed), trial_key(seed, 0)
    found = []
    for slot in range(0, n * every, every):
        per = model.per_bad if link.is_bad(slot, 0, receiver) else model.per_good
        found.append(link_uniform(slot_key(key, slot), 0, receiver) < per)
    return found


def told(chain: str, n: int, seed: int) -> Told:
    """What the fit says of one trace of a chain."""
    model = CHAINS[chain]
    lost = np.array(outcomes(model, n, seed))
    try:
        found = fits(Recorded(lost, np.arange(n) == 0, {("A", "B"): (n, int(lost.sum()))}, 1.0))
    except NoBurstsError:
        return Told("refused", False, {})
    chosen = best(found)
    held = {name: low <= getattr(model, name) <= high for name, (low, high) in found[-1].intervals.items()}
    return Told(chosen.name, found[0].bic - chosen.bic >= WARRANTED, held)


def main() -> None:
    """Print a line for each chain and length."""
    n_traces = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    with ProcessPoolExecutor(2) as pool:
        for chain in CHAINS:
            for n in LENGTHS:
                came = list(pool.map(told, *zip(*((chain, n, seed) for seed in range(n_traces)), strict=True)))
                chosen = Counter(one.chosen for one in came)
                names = ", ".join(f"{name} {count}" for name, count in chosen.most_common())
                held = ", ".join(
                    f"{name} {sum(one.held[name] for one in having)}/{len(having)}"
                    for name in BurstModel._fields
                    if (having := [one for one in came if name in one.held])
                )
                strong = sum(one.is_strong for one in came)
                print(f"{chain:<13} {n:>5}  {names}; very strong {strong}; in the interval: {held}", flush=True)


if __name__ == "__main__":
    main()
