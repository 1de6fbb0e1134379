"""Link budget: sound speed, absorption, ambient noise, signal-to-noise ratio of a link.

Sources: sound speed by Mackenzie (1981), nine-term equation for sound speed in the oceans; absorption by Thorp (1967)
and Francois and Garrison (1982); noise by Coates (1989) from the curves of Wenz (1962); source level by Urick (1983).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

from exchange.arithmetic import exp, log, log10, power_of_10
from exchange.channel.link import Transmission


def sound_speed_mps(temperature_c: float, salinity_psu: float, depth_m: float) -> float:
    """Return the sound speed; fitted for 2 to 30 deg C, salinity 25 to 40 g/kg, depth to 8000 m.

    >>> round(sound_speed_mps(10.0, 35.0, 100.0), 4)
    1491.4351
    """
    t, d = temperature_c, depth_m
    return (
        1448.96
        + 4.591 * t
        - 5.304e-2 * t * t
        + 2.374e-4 * t * t * t
        + 1.340 * (salinity_psu - 35.0)
        + 1.630e-2 * d
        + 1.675e-7 * d * d
        - 1.025e-2 * t * (salinity_psu - 35.0)
        - 7.139e-13 * t * d * d * d
    )


def thorp_db_per_km(frequency_khz: float) -> float:
    """Return the absorption by Thorp (1967), fitted above 0.4 kHz at 4 deg C and about 1000 m.

    >>> round(thorp_db_per_km(25.0), 4)
    6.1048
    """
    f2 = frequency_khz * frequency_khz
    return 0.11 * f2 / (1.0 + f2) + 44.0 * f2 / (4100.0 + f2) + 2.75e-4 * f2 + 0.003


def francois_garrison_db_per_km(
    frequency_khz: float, temperature_c: float, salinity_psu: float, depth_m: float, ph: float
) -> float:
    """Return the absorption by boric acid, MgSO4 and water (Francois, Garrison 1982).

    Fitted for salinity 30 to 35 g/kg. ``temperature_c`` is in deg C; ``ph`` is 8.1 at the ocean surface.

    >>> round(francois_garrison_db_per_km(25.0, 4.0, 35.0, 1000.0, 8.0), 4)
    4.9757
    """
    f2, t, d = frequency_khz * frequency_khz, temperature_c, depth_m
    speed_mps = 1412.0 + 3.21 * t + 1.19 * salinity_psu + 0.0167 * d
    boric = 8.86 / speed_mps * power_of_10(0.78 * ph - 5.0)
    boric_khz = 2.8 * math.sqrt(salinity_psu / 35.0) * power_of_10(4.0 - 1245.0 / (273.0 + t))
    sulphate = 21.44 * salinity_psu / speed_mps * (1.0 + 0.025 * t)
    sulphate_khz = 8.17 * power_of_10(8.0 - 1990.0 / (273.0 + t)) / (1.0 + 0.0018 * (salinity_psu - 35.0))
    sulphate_pressure = 1.0 - 1.37e-4 * d + 6.2e-9 * d * d
    # Two fits of Francois and Garrison (1982), which meet at 20 deg C.
    if t <= 20.0:
        water = 4.937e-4 - 2.59e-5 * t + 9.11e-7 * t * t - 1.50e-8 * t * t * t
    else:
        water = 3.964e-4 - 1.146e-5 * t + 1.45e-7 * t * t - 6.5e-10 * t * t * t
    water_pressure = 1.0 - 3.83e-5 * d + 4.9e-10 * d * d
    of_boric = boric * boric_khz * f2 / (boric_khz * boric_khz + f2) if salinity_psu > 0.0 else 0.0
    of_sulphate = sulphate * sulphate_pressure * sulphate_khz * f2 / (sulphate_khz * sulphate_khz + f2)
    return of_boric + of_sulphate + water * water_pressure * f2


STEPS = 64
"""Number of steps of Simpson's rule over a band; even."""


def noise_db_per_hz(frequency_khz: float, shipping: float, wind_mps: float) -> float:
    """Return the spectral density of ambient noise, dB re 1 uPa^2 / Hz; ``shipping`` is from 0 to 1.

    >>> round(noise_db_per_hz(25.0, 0.5, 5.0), 3)
    38.548
    """
    log = log10(frequency_khz)
    parts_db = (
        17.0 - 30.0 * log,
        40.0 + 20.0 * (shipping - 0.5) + 26.0 * log - 60.0 * log10(frequency_khz + 0.03),
        50.0 + 7.5 * math.sqrt(wind_mps) + 20.0 * log - 40.0 * log10(frequency_khz + 0.4),
        -15.0 + 20.0 * log,
    )
    return 10.0 * log10(math.fsum(power_of_10(part / 10.0) for part in parts_db))


def noise_in_band_db(low_khz: float, high_khz: float, shipping: float, wind_mps: float) -> float:
    """Return the noise level in a band, dB re 1 uPa; arguments as for ``noise_db_per_hz``.

    >>> round(noise_in_band_db(22.5, 27.5, 0.5, 5.0), 2)
    75.58
    """
    step = log(high_khz / low_khz) / STEPS  # logarithmic steps, since the density is smooth in log f
    total = 0.0
    for number in range(STEPS + 1):
        weight = 1 if number in (0, STEPS) else 4 if number % 2 else 2
        frequency_khz = low_khz * exp(number * step)
        total += weight * frequency_khz * power_of_10(noise_db_per_hz(frequency_khz, shipping, wind_mps) / 10.0)
    return 10.0 * log10(total * 1000.0 * step / 3.0)


@dataclass(frozen=True, slots=True)
class Budget:
    """Parameters of the signal-to-noise ratio of a link, except its range.

    Levels are in dB re 1 uPa, of the source at 1 m, of noise in the band. ``spreading`` is the exponent: 1 cylindrical,
    1.5 practical, 2 spherical. ``margin_db`` is the shortfall of the receiver against its modulation or curve.

    >>> sea = Budget(170.0, 80.0, 0.0, spreading=1.5, absorption_db_per_km=6.1048, band_hz=5000.0, rate_bps=640.0)
    >>> round(sea.loss_db(1000.0), 2)
    51.1
    """

    source_level_db: float
    noise_db: float
    directivity_db: float
    spreading: float
    absorption_db_per_km: float
    band_hz: float
    rate_bps: float
    margin_db: float = 0.0

    def loss_db(self, range_m: float) -> float:
        """Return the transmission loss re 1 m."""
        # The law of spreading has no limit towards 0.
        away_m = max(range_m, 1.0)
        return self.spreading * 10.0 * log10(away_m) + self.absorption_db_per_km * away_m / 1000.0

    def snr_db(self, range_m: float, excess_db: float = 0.0) -> float:
        """Return the in-band signal-to-noise ratio; ``excess_db`` is that of a link above the budget."""
        return self.source_level_db - self.loss_db(range_m) - self.noise_db + (self.directivity_db + excess_db)

    def ebn0_db(self, range_m: float, excess_db: float = 0.0) -> float:
        """Return Eb/N0: the in-band ratio less the margin, times B / R."""
        return self.snr_db(range_m, excess_db) - self.margin_db + 10.0 * log10(self.band_hz / self.rate_bps)


@dataclass(frozen=True)
class BudgetLinks(ABC):
    """Links of one modem in one sea, with losses from range and size alone."""

    budget: Budget
    frame_bits: int

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the probability that at least one frame of the packet is lost."""
        return self.loss_at(range_m, packet.size_bits)

    @abstractmethod
    def loss_at(self, range_m: float, size_bits: int, excess_db: float = 0.0) -> float:
        """Return the loss probability of a packet that is received as a whole; ``excess_db`` as of ``Budget``."""
