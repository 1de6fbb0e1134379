"""FMC_ATA: market clearing, equilibrium of small markets with a known solution, robustness to loss."""

import itertools
from collections.abc import Callable, Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.strategies.fmc_ata import BIDS_PER_BLOCK, MONEY, allotted, in_whole_parts, responses

Worths = Mapping[str, Mapping[str, float]]


# The market


def traded(worths: Worths, elasticity: float, steps: int, is_lost: Callable[[], bool] = lambda: False) -> Worths:
    """Bids by buyer after so many steps; what is lost leaves the others with the bids that they heard last."""
    bids = {buyer: responses(worth, dict.fromkeys(worth, 1.0), elasticity) for buyer, worth in worths.items()}
    known = {buyer: dict(bids) for buyer in worths}
    for _ in range(steps):
        for buyer, worth in worths.items():
            prices = {good: sum(of[good] for of in known[buyer].values()) for good in worth}
            shares = {good: known[buyer][buyer][good] / prices[good] for good in worth}
            bids[buyer] = responses(worth, shares, elasticity)
        for buyer, other in itertools.product(worths, worths):
            if buyer == other or not is_lost():
                known[buyer][other] = bids[other]
    return bids


def prices_of(bids: Worths) -> dict[str, float]:
    return {good: sum(of[good] for of in bids.values()) for good in next(iter(bids.values()))}


MARKETS = {
    # Each has the good that it prefers, at a price of all its money: 2 / 1 > 1 / 1 for either buyer.
    "opposed": ({"A": {"x": 2.0, "y": 1.0}, "B": {"x": 1.0, "y": 2.0}}, {"x": 1.0, "y": 1.0}, 1.0),
    # A buys both, so 1 / p = 3 / q, and p + q = 2: p = 1/2, q = 3/2. B buys y alone: 9 / q = 6 > 1 / p = 2.
    "one good shared": ({"A": {"x": 1.0, "y": 3.0}, "B": {"x": 1.0, "y": 9.0}}, {"x": 0.5, "y": 1.5}, 0.5),
}
"""Markets of linear gains: worths, prices in equilibrium, and what A spends on x there."""


@pytest.mark.parametrize("name", MARKETS)
def test_proportional_response_converges_to_a_known_market_equilibrium(name: str) -> None:
    """Zhang 2011: the prices at which each has spent all its money on what gives it most for it."""
    worths, prices, spent = MARKETS[name]
    bids = traded(worths, 1.0, 400)
    assert prices_of(bids) == pytest.approx(prices, abs=1e-3)
    assert bids["A"]["x"] == pytest.approx(spent, abs=1e-3)


def test_goods_are_shared_where_gains_are_concave() -> None:
    """Elasticity 1/2 at prices 1: x / y = (2 / 1)^(1/2 / (1 - 1/2)) = 2, so A spends 2/3 on x."""
    bids = traded(MARKETS["opposed"][0], 0.5, 100)
    assert bids["A"] == pytest.approx({"x": 2 / 3, "y": 1 / 3}, abs=1e-6)


@given(st.dictionaries(st.text(min_size=1, max_size=3), st.floats(1e-3, 1e6), min_size=1, max_size=30))
def test_bidders_spend_their_whole_budget(worth: dict[str, float]) -> None:
    bids = responses(worth, dict.fromkeys(worth, 0.5), 0.9)
    assert sum(bids.values()) == pytest.approx(1.0)
    told = in_whole_parts(bids, MONEY, BIDS_PER_BLOCK)
    assert sum(told.values()) == MONEY
    assert len(told) <= BIDS_PER_BLOCK
    assert max(told.values()) <= 255


@given(st.lists(st.integers(1, 255), min_size=1, max_size=6), st.none() | st.integers(1, 3), st.floats(0.0, 1.0))
def test_a_good_is_assigned_whole_up_to_its_capacity(bids, room, least) -> None:
    shares = allotted({f"AUV{n:02d}": bid for n, bid in enumerate(bids)}, room, least)
    assert sum(shares.values()) == pytest.approx(1.0)
    assert len(shares) <= (room or 6)
    assert bids[int(next(iter(shares))[3:])] == max(bids)
    assert allotted({"A": 9.0, "B": 1.0}, 2, 0.25) == {"A": 1.0}
    assert allotted({"A": 9.0, "B": 1.0}, 2, 0.1) == {"A": 0.9, "B": 0.1}


# The fleet
