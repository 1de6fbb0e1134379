"""Channel model ``acoustic``: link budget with fading, or a modem's measured error curve.

The curve gives the packet error rate of a frame at some in-band signal-to-noise ratios, linear in dB between them.
Below the first ratio every frame is lost; above the last its rate holds. A measured curve includes the fading.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from pydantic import Field

from exchange.arithmetic import power_of_10
from exchange.channel.error_rates import Fading, Modulation, block_loss, packet_loss
from exchange.channel.link import LinkModel
from exchange.channel.link_budget import (
    Budget,
    BudgetLinks,
    francois_garrison_db_per_km,
    noise_in_band_db,
    sound_speed_mps,
    thorp_db_per_km,
)
from exchange.channel.models import ChannelModel, Deployment, SettingFault
from exchange.channel.modems import Modem
from exchange.channel.site import Site, SiteLinks, SiteTable

Curve = Sequence[tuple[float, float]]
"""In-band signal-to-noise ratio (dB, rising) and packet error rate of a whole frame."""


def per_at(curve: Curve, snr_db: float) -> float:
    """Return the packet error rate of a whole frame.

    >>> per_at([(-1.0, 0.8), (0.0, 0.5), (2.0, 0.1)], 1.0)
    0.3
    """
    if snr_db < curve[0][0]:
        return 1.0
    for (low_db, worse), (high_db, better) in pairwise(curve):
        if snr_db < high_db:
            return worse + (better - worse) * (snr_db - low_db) / (high_db - low_db)
    return curve[-1][1]


@dataclass(frozen=True)
class MeasuredLinks(BudgetLinks):
    """Links whose losses follow from a modem's measured curve."""

    curve: Curve

    def loss_at(self, range_m: float, size_bits: int, excess_db: float = 0.0) -> float:
        """Return the loss probability of a packet that is received as a whole."""
        per = per_at(self.curve, self.budget.snr_db(range_m, excess_db) - self.budget.margin_db)
        # The logarithm in ``block_loss`` is infinite for a certain loss.
        return per if per in (0.0, 1.0) else block_loss(per, size_bits / self.frame_bits)


RANGES = 200


@dataclass(frozen=True)
class AcousticLinks(BudgetLinks):
    """Links whose losses follow from range and packet size."""

    modulation: Modulation
    fading: Fading

    def loss_at(self, range_m: float, size_bits: int, excess_db: float = 0.0) -> float:
        """Return the loss probability of a packet that is received as a whole."""
        ebn0 = power_of_10(self.budget.ebn0_db(range_m, excess_db) / 10.0)
        return packet_loss(self.modulation, self.fading, size_bits, self.frame_bits, ebn0)


class AcousticChannel(ChannelModel):
    """Losses from sea, modem and path."""

    title = "losses from range, depth, sea and modem: spreading, absorption, noise, modulation and fading"
    counts_depth = True
    carries_beyond_range = True

    source_level_db: float | None = Field(
        None,
        ge=100.0,
        le=250.0,
        description="acoustic: source level, dB re 1 uPa at 1 m, as 170.8 + 10 log10 of the power in W; that of the "
        "modem's profile if left out",
    )
    directivity_db: float = Field(
        0.0, ge=0.0, le=40.0, description="acoustic: directivity index of the receiver, its gain against noise (dB)"
    )
    spreading: float = Field(
        1.5, ge=1.0, le=2.0, description="acoustic: spreading exponent: 1 cylindrical, 1.5 practical, 2 spherical"
    )
    absorption: Literal["francois-garrison", "thorp"] = Field(
        "francois-garrison", description="acoustic: formula of absorption; thorp is twice the other in warm water"
    )
    temperature_c: float = Field(10.0, ge=0.0, le=30.0, description="acoustic: temperature of the water (deg C)")
    salinity_psu: float = Field(35.0, ge=0.0, le=42.0, description="acoustic: salinity of the water (about g/kg)")
    ph: float = Field(8.1, ge=7.0, le=9.0, description="acoustic: pH of the water; only for francois-garrison")
    shipping: float = Field(0.5, ge=0.0, le=1.0, description="acoustic: noise of ships, from 0 (none) to 1 (dense)")
    wind_mps: float = Field(5.0, ge=0.0, le=50.0, description="acoustic: wind at the surface, which makes noise (m/s)")
    fading: Literal["none", "bit", "frame", "packet"] = Field(
        "frame",
        description="acoustic: duration of a Rayleigh fade: a bit, a frame, a packet; none: steady level. A modem "
        "with measured losses (modem.per_at_snr) has the fades of its curve instead",
    )

    site: SiteTable | None = None

    UNSAID = frozenset({"site"})

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return the links of the fleet's modem; only the site is random."""
        return self.links(deployment, seed)

    def links(self, deployment: Deployment, seed: int | None = None) -> BudgetLinks | SiteLinks:
        """Return the links; without a seed those by range and size alone, averaged over the site if there is one."""
        links = self._plain_links(deployment.modem, self.budget(deployment))
        if self.site is None or not self.site.is_on:
            return links
        site = None if seed is None else Site.drawn(self.site, len(deployment.nodes), seed)
        return SiteLinks(links, self.site.levels_db(), site)

    def _plain_links(self, modem: Modem, budget: Budget) -> BudgetLinks:
        if modem.per_at_snr:
            return MeasuredLinks(budget, modem.frame_bits, modem.per_at_snr)
        if modem.modulation is None:
            raise ValueError(f"modem {modem.name} has no modulation")
        return AcousticLinks(budget, modem.frame_bits, Modulation(modem.modulation), Fading(self.fading))

    def mean_per(self, deployment: Deployment) -> float:
        """Return the mean loss of a full packet over ranges from 0 to the declared one."""
        links, bits = self.links(deployment), deployment.modem.payload_bits
        # Middles of equal intervals: the mean over ranges by the midpoint rule.
        ranges_m = ((number + 0.5) / RANGES * deployment.range_m for number in range(RANGES))
        return math.fsum(links.loss_at(range_m, bits) for range_m in ranges_m) / RANGES

    def sound_speed_mps(self, deployment: Deployment) -> float | None:
        """Return the sound speed (m/s) by temperature and salinity at the fleet's mean depth."""
        return sound_speed_mps(self.temperature_c, self.salinity_psu, _mean_depth_m(deployment))

    def budget(self, deployment: Deployment) -> Budget:
        """Return the link budget of a fleet; raises ValueError without band or source level."""
        modem, level_db = deployment.modem, self._source_level_db(deployment.modem)
        if level_db is None:
            raise ValueError(f"modem {modem.name} has no source level")
        if modem.band_khz is None:
            raise ValueError(f"modem {modem.name} has no band")
        low_khz, high_khz = modem.band_khz
        return Budget(
            source_level_db=level_db,
            noise_db=noise_in_band_db(low_khz, high_khz, self.shipping, self.wind_mps),
            directivity_db=self.directivity_db,
            spreading=self.spreading,
            absorption_db_per_km=self._absorption_db_per_km(deployment, (low_khz + high_khz) / 2.0),
            band_hz=1000.0 * (high_khz - low_khz),
            rate_bps=modem.rate_bps,
            margin_db=modem.margin_db,
        )

    def _source_level_db(self, modem: Modem) -> float | None:
        return modem.source_level_db if self.source_level_db is None else self.source_level_db

    def _absorption_db_per_km(self, deployment: Deployment, frequency_khz: float) -> float:
        if self.absorption == "thorp":
            return thorp_db_per_km(frequency_khz)
        depth_m = _mean_depth_m(deployment)
        return francois_garrison_db_per_km(frequency_khz, self.temperature_c, self.salinity_psu, depth_m, self.ph)

    def misfits(self, deployment: Deployment) -> Iterator[SettingFault]:
        """Yield faults for a modem without source level, band or modulation."""
        modem = deployment.modem
        lacking = ["band_khz"] if modem.band_khz is None else []
        lacking += ["modulation"] if modem.modulation is None and not modem.per_at_snr else []
        if lacking:
            allowed = f"needs {' and '.join(lacking)} of the modem {modem.name}: add them to its profile"
            yield SettingFault("name", '"acoustic"', allowed)
        if self._source_level_db(modem) is None:
            allowed = (
                f"missing: the profile {modem.name} has no source_level_db; set channel.source_level_db "
                "(dB re 1 uPa at 1 m), or take another communication.modem"
            )
            yield SettingFault("source_level_db", "", allowed)


def _mean_depth_m(deployment: Deployment) -> float:
    return math.fsum(deployment.depths_m) / len(deployment.depths_m)
