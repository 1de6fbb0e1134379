"""FMC_ATA: a market that clears, comes to the equilibrium of small markets that are known, and goes on under loss."""

import itertools
import random
from collections.abc import Callable, Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.strategies.fmc_ata import (
    BIDS_PER_BLOCK,
    FMC_ATA,
    MONEY,
    Buyer,
    FmcAta,
    allotted,
    in_whole_parts,
    responses,
)
from remoras.strategy import Heard, Strategy
from remoras.testing.sample_worlds import KINDS_OF_JOBS, Team, never
from remoras.testing.strategies import CHECKS, check_deterministic

PLACES_M = tuple((300.0 * x, 200.0 * y) for x in range(2) for y in range(3))
STARTS_M = ((0.0, 0.0), (250.0, 0.0), (0.0, 350.0))
Worths = Mapping[str, Mapping[str, float]]


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_it_conforms(check: object) -> None:
    assert callable(check)
    check(FMC_ATA)


@pytest.mark.slow
def test_it_is_deterministic() -> None:
    check_deterministic("remoras.strategies.fmc_ata:FMC_ATA")


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
def test_proportional_response_comes_to_the_equilibrium_of_a_market_with_a_known_answer(name: str) -> None:
    """Zhang 2011: the prices at which each has spent all its money on what gives it most for it."""
    worths, prices, spent = MARKETS[name]
    bids = traded(worths, 1.0, 400)
    assert prices_of(bids) == pytest.approx(prices, abs=1e-3)
    assert bids["A"]["x"] == pytest.approx(spent, abs=1e-3)


def test_with_losses_it_comes_to_the_same_equilibrium() -> None:
    worths, prices, _ = MARKETS["one good shared"]
    drawn = random.Random(7)
    assert prices_of(traded(worths, 1.0, 2000, lambda: drawn.random() < 0.6)) == pytest.approx(prices, abs=1e-3)


def test_where_gains_grow_less_than_the_share_goods_are_shared() -> None:
    """Elasticity 1/2 at prices 1: x / y = (2 / 1)^(1/2 / (1 - 1/2)) = 2, so A spends 2/3 on x."""
    bids = traded(MARKETS["opposed"][0], 0.5, 100)
    assert bids["A"] == pytest.approx({"x": 2 / 3, "y": 1 / 3}, abs=1e-6)


@given(st.dictionaries(st.text(min_size=1, max_size=3), st.floats(1e-3, 1e6), min_size=1, max_size=30))
def test_all_of_the_money_is_spent(worth: dict[str, float]) -> None:
    bids = responses(worth, dict.fromkeys(worth, 0.5), 0.9)
    assert sum(bids.values()) == pytest.approx(1.0)
    told = in_whole_parts(bids, MONEY, BIDS_PER_BLOCK)
    assert sum(told.values()) == MONEY
    assert len(told) <= BIDS_PER_BLOCK
    assert max(told.values()) <= 255


@given(st.lists(st.integers(1, 255), min_size=1, max_size=6), st.none() | st.integers(1, 3), st.floats(0.0, 1.0))
def test_a_good_is_given_out_whole_to_as_many_as_it_has_room_for(
    bids: list[int], room: int | None, least: float
) -> None:
    shares = allotted({f"AUV{n:02d}": bid for n, bid in enumerate(bids)}, room, least)
    assert sum(shares.values()) == pytest.approx(1.0)
    assert len(shares) <= (room or 6)
    assert bids[int(next(iter(shares))[3:])] == max(bids)
    assert allotted({"A": 9.0, "B": 1.0}, 2, 0.25) == {"A": 1.0}
    assert allotted({"A": 9.0, "B": 1.0}, 2, 0.1) == {"A": 0.9, "B": 0.1}


# The fleet


def team(strategy: Strategy = FMC_ATA, starts_m: tuple[tuple[float, float], ...] = STARTS_M) -> Team:
    return Team(strategy, starts_m, KINDS_OF_JOBS["visits"](PLACES_M), never)


def buyers(of: Team) -> dict[str, Buyer]:
    found = {name: member.negotiator for name, member in of.members.items()}
    return {name: buyer for name, buyer in sorted(found.items()) if isinstance(buyer, Buyer)}


def test_prices_sum_to_the_money_and_all_reckon_the_same_shares() -> None:
    of = team(FmcAta(settle_rounds=1000))
    of.run(6)
    found = buyers(of)
    told = [buyer._told[1] for buyer in found.values()]
    assert sum(sum(bids.values()) for bids in told) == MONEY * len(STARTS_M)
    assert len({str(sorted(buyer._shares.items())) for buyer in found.values()}) == 1
    assert [[sum(bids.values()) for bids in buyer._heard.values()] for buyer in found.values()] == [[MONEY] * 2] * 3


def test_the_order_of_vehicles_and_of_messages_changes_nothing() -> None:
    ends = []
    for order in itertools.permutations(range(3)):
        of = team()
        of.members = {name: of.members[name] for name in (list(of.members)[n] for n in order)}
        of.run(30)
        ends.append([(name, b._told, b._at, of.members[name].finished) for name, b in buyers(of).items()])
    assert all(end == ends[0] for end in ends)


class Deaf(Buyer):
    """A buyer that hears where others are, and not what they bid."""

    def _hear(self, heard: Heard) -> bool:
        super()._hear(heard)
        self._heard = {}
        return False


class DeafMarket(FmcAta):
    def negotiator(self, me: str, group: object) -> Deaf:
        return Deaf(me, group, self)  # type: ignore[arg-type]


def test_without_the_bids_of_others_jobs_go_elsewhere_and_more_is_done_twice() -> None:
    """All start at one place, and want the same jobs: what parts them is the bids."""
    twice, firsts = {}, {}
    for market in (FmcAta(), DeafMarket()):
        of = team(market, ((0.0, 0.0), (10.0, 0.0), (0.0, 10.0)))
        n_together = 0
        for _ in range(200):
            of.round()
            n_together += of.at_one_job()
        assert of.done
        twice[type(market)], firsts[type(market)] = n_together, [m.finished for m in of.members.values()]
    assert firsts[FmcAta] != firsts[DeafMarket]
    assert twice[FmcAta] < twice[DeafMarket], twice


def test_an_older_message_and_one_of_another_group_are_left_aside() -> None:
    of = team()
    buyer = buyers(of)["AUV00"]

    def said(made: int, bid: int, group: str = "Team") -> Heard:
        return Heard("AUV01", 9.0, (("AUV01", "claimsOf", made), (f"{group}.Role1", "claim", bid)))

    assert buyer._hear(said(5, 100))
    assert not buyer._hear(said(4, 200))
    assert not buyer._hear(said(6, 200, "Others"))
    assert buyer._heard == {"AUV01": {"Role1": 100}}


def test_who_is_heard_no_more_still_counts_with_its_last_bids() -> None:
    """After three frames one vehicle is heard by nobody; its share of what it bid for stays with it."""
    of = Team(
        FmcAta(settle_rounds=1000), STARTS_M, KINDS_OF_JOBS["visits"](PLACES_M), lambda n, a, b: n > 3 and a == "AUV02"
    )
    of.run(3)
    last = dict(buyers(of)["AUV02"]._told[1])
    of.run(5)
    assert buyers(of)["AUV00"]._heard["AUV02"] == last
    assert any("AUV02" in shares for shares in buyers(of)["AUV00"]._shares.values())
