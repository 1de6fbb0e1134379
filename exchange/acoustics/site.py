"""The site term of the channel ``acoustic``: ``[channel.site]``, by which links of one length differ, and change.

Transmission loss in a place is log-normal about a law of the range, with a variance that is that of the site
(Stojanovic, Preisig 2009; Llor, Stojanovic 2013). Here the ratio of signal to noise of a link from a to b at t is that
of the budget plus S(a, b, t) less N(b):

    S  Gaussian, spread_db in all places, the same from b to a, since sound takes the same ways back. With S(c, d, u)
       it is correlated by exp(-(|a - c|^2 + |b - d|^2) / (2 L^2) - (t - u)^2 / (2 T^2)), or by that with c and d
       exchanged, over the distance L and the time T.
    N  Gaussian, receiver_db: noise near the receiver, drawn once per vehicle and run. By it links are asymmetric.

S is a sum of ``WAVES`` plane waves over both places and time, whose wave numbers and phases are drawn by the seed
(spectral method, Shinozuka 1971), each with the same wave in the other direction. So it is a pure function of seed,
places and time, whatever is asked before, and does not depend on strategy, policy or what is said. Over seeds it has
that correlation exactly, and is Gaussian but for its kurtosis, which is below 3 by 1.5 / WAVES at most.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from pydantic import BaseModel, ConfigDict, Field

from exchange.acoustics import loss
from exchange.acoustics.link import Transmission
from exchange.arithmetic import PI, exp, normal_quantile, sincos

WAVES = 24
"""Plane waves of which a site is made."""
LEVELS = 32
"""Levels of equal probability over which the mean of a site is taken."""
RECEIVERS = 1 << 20
"""Stands where the numbers of waves stand in draws, beyond all of them: those of the noise of receivers."""
HALF_STEP = 2.0**-54
"""Half of the step between two uniform numbers: with it none is 0."""

PlaceM = tuple[float, float]


class Links(Protocol):
    """Links whose losses follow from range and size."""

    def loss_at(self, range_m: float, size_bits: int) -> float:
        """Probability that a packet is lost that is taken whole."""
        ...

    def delivered_at(self, range_m: float, size_bits: int) -> float:
        """Share of a packet that arrives in the mean where each frame is delivered for itself."""
        ...

    def shifted(self, excess_db: float) -> Links:
        """The same links where the ratio of signal to noise is by so much above that of the budget."""
        ...


class SiteTable(BaseModel):
    """The table ``[channel.site]``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    spread_db: float = Field(
        0.0,
        ge=0.0,
        le=40.0,
        description="acoustic: standard deviation of transmission losses about the law of the range",
    )
    distance_m: float = Field(
        200.0, ge=1.0, le=1e5, description="acoustic: distance of places over which these differences are correlated"
    )
    time_h: float = Field(
        1.0, ge=0.01, le=1e4, description="acoustic: time over which these differences are correlated (h)"
    )
    receiver_db: float = Field(
        0.0, ge=0.0, le=40.0, description="acoustic: standard deviation of the noise from one receiver to the other"
    )

    @property
    def is_on(self) -> bool:
        """True if links differ by it."""
        return self.spread_db > 0.0 or self.receiver_db > 0.0


class Wave(NamedTuple):
    """A plane wave over two places and time: in their sum, in their difference, in time (rad/m, rad/m, rad/s)."""

    of_sum: PlaceM
    of_difference: PlaceM
    of_time: float
    phase_rad: float


def correlation(one: tuple[PlaceM, PlaceM], other: tuple[PlaceM, PlaceM], distance_m: float) -> float:
    """Correlation of the transmission losses of two links at one time, by the places of their ends.

    >>> round(correlation(((0.0, 0.0), (900.0, 0.0)), ((900.0, 0.0), (0.0, 200.0)), 200.0), 4)
    0.6065
    """

    def along(places: tuple[PlaceM, PlaceM]) -> float:
        apart = zip(one, places, strict=True)
        squares = [(a[axis] - b[axis]) * (a[axis] - b[axis]) for a, b in apart for axis in (0, 1)]
        return exp(-math.fsum(squares) / (2.0 * distance_m * distance_m))

    norm = math.sqrt(_doubling(*one, distance_m) * _doubling(*other, distance_m))
    return (along(other) + along((other[1], other[0]))) / norm


def _doubling(a: PlaceM, b: PlaceM, distance_m: float) -> float:
    """Variance of a wave and the same in the other direction, over that of one: 2 where both ends are in one place."""
    east_m, north_m = a[0] - b[0], a[1] - b[1]
    return 1.0 + exp(-(east_m * east_m + north_m * north_m) / (distance_m * distance_m))


@dataclass(frozen=True, slots=True)
class Site:
    """What a site does to links in one run.

    Args:
        table: of the site.
        waves: that are drawn.
        receivers_db: noise near each receiver, above that of the budget.
    """

    table: SiteTable
    waves: tuple[Wave, ...]
    receivers_db: tuple[float, ...]

    @classmethod
    def drawn(cls, table: SiteTable, n_nodes: int, seed: int) -> Site:
        """The site of the run with that seed."""

        def normal(number: int, part: int) -> float:
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
        """How far the transmission loss between two places lies below the law (dB); the same in both directions."""
        (x, y), (u, v) = a, b
        total = math.fsum(
            sincos(of_sum[0] * (x + u) + of_sum[1] * (y + v) + of_time * now_s + phase_rad)[1]
            * sincos(of_difference[0] * (x - u) + of_difference[1] * (y - v))[1]
            for of_sum, of_difference, of_time, phase_rad in self.waves
        )
        return self.table.spread_db * 2.0 * total / math.sqrt(WAVES * _doubling(a, b, self.table.distance_m))

    def excess_db(self, a: PlaceM, b: PlaceM, receiver: int, now_s: float) -> float:
        """Ratio of signal to noise of a link, above that of the budget (dB)."""
        return self.spread_db(a, b, now_s) - self.receivers_db[receiver]


@dataclass(frozen=True, slots=True)
class SiteMean:
    """Links in the mean over a site, where nobody says between which places.

    Args:
        levels: the same links at levels of equal probability.
    """

    levels: Sequence[Links]

    @classmethod
    def over(cls, links: Links, table: SiteTable) -> SiteMean:
        """The mean of links over a site."""
        spread_db = math.sqrt(table.spread_db * table.spread_db + table.receiver_db * table.receiver_db)
        excesses_db = [spread_db * normal_quantile((number + 0.5) / LEVELS) for number in range(LEVELS)]
        return cls([links.shifted(excess_db) for excess_db in excesses_db])

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Probability that one frame of the packet or more are lost."""
        return self.loss_at(range_m, packet.size_bits)

    def loss_at(self, range_m: float, size_bits: int) -> float:
        """Probability that a packet is lost that is taken whole."""
        return math.fsum(links.loss_at(range_m, size_bits) for links in self.levels) / len(self.levels)

    def delivered_at(self, range_m: float, size_bits: int) -> float:
        """Share of a packet that arrives in the mean where each frame is delivered for itself."""
        return math.fsum(links.delivered_at(range_m, size_bits) for links in self.levels) / len(self.levels)


@dataclass(frozen=True, slots=True)
class SiteLinks:
    """Links of one run in a site.

    Args:
        links: by the budget alone.
        site: of the run.
        mean: over the site, for packets of which nobody says where the nodes are.
    """

    links: Links
    site: Site
    mean: SiteMean

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Probability that one frame of the packet or more are lost."""
        if not packet.positions_m:
            return self.mean.loss_at(range_m, packet.size_bits)
        a, b = packet.positions_m[packet.sender], packet.positions_m[receiver]
        excess_db = self.site.excess_db(a, b, receiver, packet.start_s)
        return self.links.shifted(excess_db).loss_at(range_m, packet.size_bits)
