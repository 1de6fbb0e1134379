"""Ambient noise of the sea: turbulence, shipping, wind and heat, after Coates (1989) from the curves of Wenz (1962)."""

import math

from exchange.arithmetic import exp, log, log10, power_of_10

STEPS = 64
"""Steps of Simpson's rule over a band; an even number."""


def noise_db_per_hz(frequency_khz: float, shipping: float, wind_mps: float) -> float:
    """Spectral density of the noise, dB re 1 uPa^2 / Hz.

    Args:
        frequency_khz: where in the spectrum.
        shipping: activity of ships, from 0 to 1.
        wind_mps: speed of the wind at the surface.

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
    """Level of the noise in a band, dB re 1 uPa: the integral of its density.

    Args:
        low_khz: lower end of the band, above 0.
        high_khz: upper end of the band.
        shipping: activity of ships, from 0 to 1.
        wind_mps: speed of the wind at the surface.

    >>> round(noise_in_band_db(22.5, 27.5, 0.5, 5.0), 2)
    75.58
    """
    step = log(high_khz / low_khz) / STEPS  # even on the logarithm, over which the density is smooth
    total = 0.0
    for number in range(STEPS + 1):
        weight = 1 if number in (0, STEPS) else 4 if number % 2 else 2
        frequency_khz = low_khz * exp(number * step)
        total += weight * frequency_khz * power_of_10(noise_db_per_hz(frequency_khz, shipping, wind_mps) / 10.0)
    return 10.0 * log10(total * 1000.0 * step / 3.0)
