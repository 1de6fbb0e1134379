"""Site term of the channel ``acoustic``: variation of links by place and time.

Transmission loss at a site is log-normal about a law of the range, with the variance of the site (Stojanovic, Preisig
2009; Llor, Stojanovic 2013). The signal-to-noise ratio of a link from a to b at t is that of the budget plus S(a, b, t)
less N(b):

    S  Gaussian with spread_db, equal from b to a, since sound paths are reciprocal. Its correlation with S(c, d, u) is
       exp(-(|a - c|^2 + |b - d|^2) / (2 L^2) - (t - u)^2 / (2 T^2)), or with c and d exchanged, for the distance L
       and the time T.
    N  Gaussian with receiver_db: noise at the receiver, one draw per vehicle and run. It makes links asymmetric.

S is a sum of ``WAVES`` plane waves over both places and time, each with its reciprocal, with wave numbers and phases
drawn by the seed (spectral method, Shinozuka 1971). Over seeds its correlation is exact, and it is Gaussian except for
a kurtosis below 3 by at most 1.5 / WAVES.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from exchange.arithmetic import PI, exp, normal_quantile, sincos
from exchange.channel import loss
from exchange.channel.link import Transmission
from exchange.channel.link_budget import BudgetLinks

WAVES = 24
LEVELS = 32
"""Number of equiprobable levels in the mean over a site."""
RECEIVERS = 1 << 20
"""Pseudo-number, beyond all waves, for the draws of receiver noise."""
HALF_STEP = 2.0**-54
"""Half of the step between uniform numbers, added to exclude 0."""

PlaceM = tuple[float, float]


class SiteTable(BaseModel):
    """Table ``[channel.site]``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    spread_db: float = Field(
        0.0,
        ge=0.0,
        le=40.0,
        description="acoustic: standard deviation of transmission losses about the law of the range",
    )
    distance_m: float = Field(
        200.0, ge=1.0, le=1e5, description="acoustic: distance over which these differences are correlated"
    )
    time_h: float = Field(
        1.0, ge=0.01, le=1e4, description="acoustic: time over which these differences are correlated (h)"
    )
    receiver_db: float = Field(
        0.0, ge=0.0, le=40.0, description="acoustic: standard deviation of the noise between receivers"
    )

    @property
    def is_on(self) -> bool:
        """True if the site affects links."""
        return self.spread_db > 0.0 or self.receiver_db > 0.0

    def levels_db(self) -> tuple[float, ...]:
        """Return equiprobable differences of links from the budget, by their distribution over places."""
        spread_db = math.sqrt(self.spread_db * self.spread_db + self.receiver_db * self.receiver_db)
        return tuple(spread_db * normal_quantile((number + 0.5) / LEVELS) for number in range(LEVELS))


class Wave(NamedTuple):
    """Plane wave over the sum and difference of two places (rad/m) and time (rad/s)."""

    of_sum: PlaceM
    of_difference: PlaceM
    of_time: float
    phase_rad: float


def _doubling(a: PlaceM, b: PlaceM, distance_m: float) -> float:
    east_m, north_m = a[0] - b[0], a[1] - b[1]
    return 1.0 + exp(-(east_m * east_m + north_m * north_m) / (distance_m * distance_m))


@dataclass(frozen=True, slots=True)
class Site:
    """Effect of a site in one run; ``receivers_db`` is the noise above that of the budget."""

    table: SiteTable
    waves: tuple[Wave, ...]
    receivers_db: tuple[float, ...]

    @classmethod
    def drawn(cls, table: SiteTable, n_nodes: int, seed: int) -> Site:
        """Draw the site of a run by its seed."""

        def normal(number: int, part: int) -> float:
            # Without the half step, a number 0 would give minus infinity.
            return normal_quantile(loss.uniform(seed, loss.SITES, number, part, 0) + HALF_STEP)

        def wave(number: int) -> Wave:
            k = [normal(number, part) / table.distance_m for part in range(4)]
            return Wave(
                ((k[0] + k[2]) / 2.0, (k[1] + k[3]) / 2.0),
                ((k[0] - k[2]) / 2.0, (k[1] - k[3]) / 2.0),
                normal(number, 4) / (3600.0 * table.time_h),
                2.0 * PI * loss.uniform(seed, loss.SITES, number, 5, 0),
            )

        receivers_db = tuple(table.receiver_db * normal(RECEIVERS, node) for node in range(n_nodes))
        return cls(table, tuple(map(wave, range(WAVES))), receivers_db)

    def spread_db(self, a: PlaceM, b: PlaceM, now_s: float) -> float:
        """Return the reciprocal reduction (dB) of transmission loss between two places."""
        (x, y), (u, v) = a, b
        # Product form of the sum of a wave and its reciprocal, equal in both directions.
        total = math.fsum(
            sincos(of_sum[0] * (x + u) + of_sum[1] * (y + v) + of_time * now_s + phase_rad)[1]
            * sincos(of_difference[0] * (x - u) + of_difference[1] * (y - v))[1]
            for of_sum, of_difference, of_time, phase_rad in self.waves
        )
        # Dividing by the variance of wave and reciprocal makes the standard deviation equal at all distances.
        return self.table.spread_db * 2.0 * total / math.sqrt(WAVES * _doubling(a, b, self.table.distance_m))

    def excess_db(self, a: PlaceM, b: PlaceM, receiver: int, now_s: float) -> float:
        """Return the signal-to-noise ratio of a link above that of the budget (dB)."""
        return self.spread_db(a, b, now_s) - self.receivers_db[receiver]


@dataclass(frozen=True, slots=True)
class SiteLinks:
    """Links at a site; without a drawn ``site``, or positions, the mean over equiprobable ``levels_db``."""

    links: BudgetLinks
    levels_db: Sequence[float]
    site: Site | None = None

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the probability that at least one frame of the packet is lost."""
        if self.site is None or not packet.positions_m:
            return self.loss_at(range_m, packet.size_bits)
        a, b = packet.positions_m[packet.sender], packet.positions_m[receiver]
        return self.links.loss_at(range_m, packet.size_bits, self.site.excess_db(a, b, receiver, packet.start_s))

    def loss_at(self, range_m: float, size_bits: int) -> float:
        """Return the mean loss probability of a packet that is received as a whole."""
        losses = (self.links.loss_at(range_m, size_bits, excess_db) for excess_db in self.levels_db)
        return math.fsum(losses) / len(self.levels_db)
