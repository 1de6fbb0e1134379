"""Fit the site term of channel ``acoustic`` to half of a measured network and test the rest.

The excess of a link of mission-2012 is the loss (dB) above the budget that explains its packet loss. The model has an
unknown level, S of the link, N of the receiver (``exchange.channel.site``) and a residual of ``REST_DB``: a Gaussian
process. Its two deviations maximise the restricted likelihood on a grid. The score of held-out links is the mean
log-likelihood of packets, p log q + (1 - p) log (1 - q), for predicted loss q and measured loss p.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from exchange.channel.acoustic import AcousticChannel
from exchange.channel.link import Transmission
from exchange.channel.models import Deployment
from exchange.channel.modems import modems
from exchange.channel.network import network_of
from exchange.channel.site import PlaceM, SiteTable

NETWORK = "mission-2012"
MODEM = "s2c-18-34"
"""Nobody says which modem lost the packets; this one sends in 18 to 34 kHz."""
SEA: dict[str, Any] = {"spreading": 2.0, "temperature_c": 29.0, "source_level_db": 180.0}
DISTANCE_M = 200.0
"""Nodes are 281 m apart and more, so the losses say next to nothing of it: it is assumed."""
REST_DB = 1.0
QUARTILES = (0.25, 0.5, 0.75)
WITHIN_QUARTILE, WITHIN_ASYMMETRY, WITHIN = 0.1, 0.06, 0.8
"""Differences that are allowed, and the share of them up to which a drawn network is taken for alike."""
Array = npt.NDArray[np.float64]
SPREADS_DB: Array = np.arange(0.0, 12.1, 0.5)
RECEIVERS_DB: Array = np.arange(0.0, 8.1, 0.5)
LEVELS_DB: Array = np.arange(-48.0, -42.0, 0.5)


def correlation(one: tuple[PlaceM, PlaceM], other: tuple[PlaceM, PlaceM], distance_m: float) -> float:
    """Return the correlation of the transmission losses of two simultaneous links.

    Each loss is the sum of a term along the link and its reciprocal.

    >>> round(correlation(((0.0, 0.0), (900.0, 0.0)), ((900.0, 0.0), (0.0, 200.0)), 200.0), 4)
    0.6065
    """

    def along(link: tuple[PlaceM, ...], way: tuple[PlaceM, ...]) -> float:
        squares = [math.dist(a, b) ** 2 for a, b in zip(link, way, strict=True)]
        return math.exp(-math.fsum(squares) / (2.0 * distance_m * distance_m))

    variances = [1.0 + along(link, link[::-1]) for link in (one, other)]
    return (along(one, other) + along(one, other[::-1])) / math.sqrt(math.prod(variances))


def quartiles(losses: Array) -> Array:
    """Quartiles along the last axis, after Hazen: halfway between two of twenty."""
    parts: Array = np.quantile(losses, QUARTILES, axis=-1, method="hazen")
    return parts


@dataclass(frozen=True)
class Fit:
    """What was fitted on some links.

    Attributes:
        spread_db, receiver_db: deviations of the site.
        level_db: above the budget.
        inverse: of the covariance of these links.
        residuals_db: of their excess above the level.
    """

    spread_db: float
    receiver_db: float
    level_db: float
    inverse: Array
    residuals_db: Array


@dataclass(frozen=True)
class Measured:
    """The links of the network, as the budget of a channel sees them."""

    @cached_property
    def deployment(self) -> Deployment:
        """Its nodes as a fleet that stays where it is."""
        depths_m = tuple(node.depth_m or 0.0 for node in network_of(NETWORK).node)
        nodes = {name: number for number, name in enumerate(network_of(NETWORK).nodes)}
        return Deployment(nodes, depths_m, modems()[MODEM], 1000.0, 3600.0)

    @cached_property
    def positions_m(self) -> list[tuple[float, float]]:
        """Of its nodes."""
        return [node.position_m or (0.0, 0.0) for node in network_of(NETWORK).node]

    @cached_property
    def links(self) -> list[tuple[int, int]]:
        """Sender and receiver of each."""
        n = len(self.positions_m)
        return [(sender, receiver) for sender in range(n) for receiver in range(n) if sender != receiver]

    @cached_property
    def losses(self) -> Array:
        """Share lost of each."""
        names = network_of(NETWORK).nodes
        return np.array([network_of(NETWORK).per[names[sender], names[receiver]] for sender, receiver in self.links])

    @cached_property
    def ranges_m(self) -> list[float]:
        """Of each, in three dimensions."""
        places = np.column_stack((self.positions_m, self.deployment.depths_m))
        return [float(np.linalg.norm(places[a] - places[b])) for a, b in self.links]

    @cached_property
    def plain(self) -> Any:
        """The links of the channel without a site."""
        return AcousticChannel.model_validate(SEA).links(self.deployment)

    def loss(self, number: int, excess_db: float) -> float:
        """Loss of a full packet on a link, by so much above the budget."""
        bits = self.deployment.modem.payload_bits
        return float(self.plain.loss_at(self.ranges_m[number], bits, float(excess_db)))

    @cached_property
    def excesses_db(self) -> Array:
        """Above the budget, at which a link would lose what it lost."""
        return np.array([self._excess_db(number) for number in range(len(self.links))])

    def _excess_db(self, number: int) -> float:
        low_db, high_db = -100.0, 100.0
        for _ in range(50):
            middle_db = (low_db + high_db) / 2.0
            is_low = self.loss(number, middle_db) > self.losses[number]
            low_db, high_db = (middle_db, high_db) if is_low else (low_db, middle_db)
        return low_db

    def asymmetry(self, losses: Array) -> Array:
        """Mean difference of the two directions of a link; losses stand along the last axis."""
        pairs = [(n, self.links.index((b, a))) for n, (a, b) in enumerate(self.links) if a < b]
        found: Array = np.mean([np.abs(losses[..., n] - losses[..., back]) for n, back in pairs], axis=0)
        return found

    @cached_property
    def alike(self) -> Array:
        """Correlation of S of any two links."""
        ends = [(self.positions_m[sender], self.positions_m[receiver]) for sender, receiver in self.links]
        return np.array([[correlation(one, other, DISTANCE_M) for other in ends] for one in ends])

    @cached_property
    def share_receiver(self) -> Array:
        """1 of two links with one receiver."""
        receivers = np.array([receiver for _, receiver in self.links])
        found: Array = (receivers[:, None] == receivers[None, :]).astype(np.float64)
        return found

    def covariance(self, spread_db: float, receiver_db: float) -> Array:
        """Of the excesses of all links, but for the rest."""
        found: Array = spread_db**2 * self.alike + receiver_db**2 * self.share_receiver
        return found

    def misfit(self, spread_db: float, receiver_db: float, level_db: float) -> float:
        """Minus twice the log-likelihood of all excesses, but for a constant."""
        covariance = self.covariance(spread_db, receiver_db) + REST_DB**2 * np.eye(len(self.links))
        residuals_db = self.excesses_db - level_db
        return float(residuals_db @ np.linalg.solve(covariance, residuals_db) + np.linalg.slogdet(covariance)[1])

    def fitted(self, on: Sequence[int], spreads_db: Array = SPREADS_DB, receivers_db: Array = RECEIVERS_DB) -> Fit:
        """The site of the greatest restricted likelihood on some links, the level being unknown."""
        chosen, excesses_db = np.ix_(on, on), self.excesses_db[list(on)]
        best: tuple[float, Fit] | None = None
        for spread_db in map(float, spreads_db):
            for receiver_db in map(float, receivers_db):
                covariance = self.covariance(spread_db, receiver_db)[chosen] + REST_DB**2 * np.eye(len(on))
                inverse: Array = np.linalg.inv(covariance).astype(np.float64)
                level_db = float(inverse.sum(axis=0) @ excesses_db / inverse.sum())
                residuals_db = excesses_db - level_db
                misfit = float(residuals_db @ inverse @ residuals_db + np.log(inverse.sum()))
                misfit += float(np.linalg.slogdet(covariance)[1])
                if best is None or misfit < best[0]:
                    best = misfit, Fit(spread_db, receiver_db, level_db, inverse, residuals_db)
        assert best is not None
        return best[1]

    def predicted(self, fit: Fit, on: Sequence[int], held: Sequence[int]) -> Array:
        """Losses of links that were held back: in the mean over what is not known of their excess."""
        covariance = self.covariance(fit.spread_db, fit.receiver_db)
        across: Array = covariance[np.ix_(held, on)] @ fit.inverse
        mean_db = fit.level_db + across @ fit.residuals_db
        of_level = 1.0 - across.sum(axis=1)
        variance = np.diag(covariance[np.ix_(held, held)] - across @ covariance[np.ix_(on, held)]) + REST_DB**2
        deviation_db = np.sqrt(variance + of_level**2 / fit.inverse.sum())
        points, weights = np.polynomial.hermite_e.hermegauss(21)
        found = [
            [self.loss(link, mean + deviation * point) for point in points]
            for link, mean, deviation in zip(held, mean_db, deviation_db, strict=True)
        ]
        means: Array = np.array(found) @ weights / weights.sum()
        return means


def score(losses: Array, said: Array | float) -> float:
    """Mean log-likelihood of packets, of which these shares were lost."""
    q = np.clip(said, 1e-9, 1.0 - 1e-9)
    return float(np.mean(losses * np.log(q) + (1.0 - losses) * np.log(1.0 - q)))


def splits(n_links: int, n_splits: int, seed: int = 1) -> list[tuple[list[int], list[int]]]:
    """Halves of the links, drawn: those that are fitted on, those that are held back."""
    dice = np.random.Generator(np.random.Philox(seed))
    orders = [dice.permutation(n_links) for _ in range(n_splits)]
    return [(sorted(order[: n_links // 2].tolist()), sorted(order[n_links // 2 :].tolist())) for order in orders]


def held_back(measured: Measured, n_splits: int) -> dict[str, Array]:
    """Scores of links that were held back, of each split: of the site, of the law alone, and of two means."""
    none: Array = np.zeros(1)
    scores: dict[str, list[float]] = {"site": [], "law alone": [], "mean of the fitted": [], "their own mean": []}
    for on, held in splits(len(measured.links), n_splits):
        losses, law = measured.losses[held], measured.fitted(on, none, none)
        scores["site"].append(score(losses, measured.predicted(measured.fitted(on), on, held)))
        scores["law alone"].append(score(losses, np.array([measured.loss(link, law.level_db) for link in held])))
        scores["mean of the fitted"].append(score(losses, float(measured.losses[on].mean())))
        scores["their own mean"].append(score(losses, float(losses.mean())))
    return {name: np.array(values) for name, values in scores.items()}


def matched(measured: Measured, n_draws: int = 400) -> tuple[float, float, float]:
    """Spread, noise of receivers and level of the likeliest site whose networks are like the measured one.

    Alike is what differs in mean quartiles and mean asymmetry by ``WITHIN`` of what is allowed at most.
    """
    ratios_db = np.linspace(-60.0, 120.0, 2000)
    by_ratio = np.array([measured.loss(0, ratio_db) for ratio_db in ratios_db])
    near_db = measured.plain.budget.loss_db(measured.ranges_m[0])
    farther_db = np.array([measured.plain.budget.loss_db(range_m) - near_db for range_m in measured.ranges_m])
    drawn = np.random.Generator(np.random.Philox(2)).standard_normal((n_draws, 2, len(measured.links)))
    little = 1e-6 * np.eye(len(measured.links))
    spread = drawn[:, 0] @ np.linalg.cholesky(measured.alike + little).T
    noise = drawn[:, 1] @ np.linalg.cholesky(measured.share_receiver + little).T
    wanted, asymmetry = quartiles(measured.losses), measured.asymmetry(measured.losses)
    fits = []
    for spread_db in map(float, SPREADS_DB):
        for receiver_db in map(float, RECEIVERS_DB):
            for level_db in map(float, LEVELS_DB):
                excesses_db = level_db + spread_db * spread + receiver_db * noise - farther_db
                losses = np.interp(excesses_db, ratios_db, by_ratio)
                off = np.abs(quartiles(losses).mean(axis=1) - wanted).max() / WITHIN_QUARTILE
                off_asymmetry = abs(measured.asymmetry(losses).mean() - asymmetry) / WITHIN_ASYMMETRY
                if max(off, off_asymmetry) <= WITHIN:
                    fits.append((measured.misfit(spread_db, receiver_db, level_db), spread_db, receiver_db, level_db))
    return min(fits)[1:]


def simulated(measured: Measured, level_db: float, table: SiteTable, n_seeds: int) -> Array:
    """Losses of all links under the channel itself, a row for each seed."""
    sea = {**SEA, "source_level_db": SEA["source_level_db"] + level_db, "site": table}
    channel, bits = AcousticChannel.model_validate(sea), measured.deployment.modem.payload_bits
    rows = []
    for seed in range(1, n_seeds + 1):
        links = channel.link_model(measured.deployment, seed)
        rows.append(
            [
                links.p_loss(Transmission(0, sender, 0.0, bits, measured.positions_m), receiver, range_m)
                for (sender, receiver), range_m in zip(measured.links, measured.ranges_m, strict=True)
            ]
        )
    return np.array(rows)


def main() -> None:
    """Print what is found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.site", description=__doc__)
    parser.add_argument("--splits", type=int, default=100, help="halves of the links")
    parser.add_argument("--seeds", type=int, default=1000, help="runs of the channel")
    arguments = parser.parse_args()
    measured = Measured()
    scores = held_back(measured, arguments.splits)
    for name, values in scores.items():
        better = (
            "" if name == "site" else f", the site is better in {np.mean(scores['site'] > values):.0%} of the halves"
        )
        print(f"links held back, {name}: score {values.mean():.3f}{better}")
    fit, none = measured.fitted(range(len(measured.links))), 0.0
    named = {
        "likeliest": (fit.spread_db, fit.receiver_db, fit.level_db),
        "likeliest that is alike": matched(measured),
        "without a site": (none, none, fit.level_db),
    }
    print(f"measured: quartiles {quartiles(measured.losses)}, asymmetry {measured.asymmetry(measured.losses):.3f}")
    for name, (spread_db, receiver_db, level_db) in named.items():
        table = SiteTable(spread_db=spread_db, distance_m=DISTANCE_M, receiver_db=receiver_db)
        losses = simulated(measured, level_db, table, arguments.seeds)
        asymmetries = measured.asymmetry(losses)
        print(
            f"{name}: spread {spread_db:g}, receivers {receiver_db:g}, level {level_db:.1f} dB: quartiles "
            f"{np.round(quartiles(losses).mean(axis=1), 3)}, mean {losses.mean():.3f}, asymmetry "
            f"{asymmetries.mean():.3f}, deviation of it over seeds {asymmetries.std():.3f}"
        )


if __name__ == "__main__":
    main()
