"""The loss draws: the same numbers everywhere, uniform, and independent in every counter."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from exchange.channel import loss
from exchange.channel.loss import uniform

N = 50_000


@cache
def series(counter: str, n: int = N, **fixed: int) -> NDArray[np.float64]:
    """The numbers met when one counter runs from 0 and the others stand still."""
    start = {"seed": 1, "trial": 3, "slot": 7, "sender": 2, "receiver": 1} | fixed
    return np.array([uniform(**(start | {counter: start.get(counter, 0) + step})) for step in range(n)])


COUNTERS = ("seed", "trial", "slot", "receiver")


@pytest.mark.parametrize("counter", COUNTERS)
def test_loss_draws_are_uniform_along_every_counter(counter: str) -> None:
    """Chi-square over 500 bins: mean 499, standard deviation sqrt(2 * 499) = 31.6; mean and variance of U(0, 1)."""
    numbers = series(counter)
    assert numbers.min() >= 0.0
    assert numbers.max() < 1.0
    counts = np.bincount((numbers * 500).astype(int), minlength=500)
    chi_square = float(((counts - N / 500) ** 2).sum() / (N / 500))
    assert abs(chi_square - 499) < 4.5 * math.sqrt(2 * 499)
    assert abs(numbers.mean() - 0.5) < 4.5 / math.sqrt(12 * N)
    assert abs(numbers.var() - 1 / 12) < 4.5 / math.sqrt(180 * N)


@pytest.mark.parametrize(
    "other", [{"seed": 2}, {"trial": 4}, {"sender": 3}, {"receiver": 2}, {"sender": 1, "receiver": 2}]
)
def test_neighbouring_draws_are_uncorrelated(other: dict[str, int]) -> None:
    """Neighbouring seeds, trials, senders, receivers and the two directions of a link, over the slots."""
    correlation = float(((series("slot", slot=0) - 0.5) * (series("slot", slot=0, **other) - 0.5)).mean() * 12)
    assert abs(correlation) < 4.5 / math.sqrt(N)


def test_compiled_and_interpreted_draws_are_the_same() -> None:
    numba = pytest.importorskip("numba")
    from exchange.policy.policies import ACK
    from exchange.study.compiler import make_compilable

    make_compilable(ACK)

    @numba.njit  # type: ignore[untyped-decorator]
    def compiled(seed: int, trial: int, slot: int, sender: int, receiver: int) -> float:
        key = loss.slot_key(loss.trial_key(seed, trial), slot)
        return loss.link_uniform(key, sender, receiver)

    for step in range(2000):
        counters = (step * step, 7 * step, step % 977, step % 64, (step * 31) % 64)
        assert compiled(*counters) == uniform(*counters)
    extreme = ((1 << 62) - 1, 1 << 40, 1 << 40, 65535, 65535)
    assert compiled(*extreme) == uniform(*extreme)
