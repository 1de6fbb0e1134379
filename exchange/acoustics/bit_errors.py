"""Bit error rates of modulations: in white noise, and in the mean over a Rayleigh fade (Proakis 2001).

``ebn0`` is the energy of a bit over the density of the noise, as a ratio; under a fade it is the mean of that.
"""

import math
from enum import Enum

from exchange.arithmetic import erfc, exp, log, normal_quantile


class Modulation(Enum):
    """How a modem writes bits; PSK of two phases, or of four with Gray's code, which errs alike bit by bit."""

    FSK_NONCOHERENT = "fsk-noncoherent"
    FSK_COHERENT = "fsk-coherent"
    PSK = "psk"
    DPSK = "dpsk"


def steady(modulation: Modulation, ebn0: float) -> float:
    """Bit error rate in white noise alone.

    >>> round(steady(Modulation.FSK_NONCOHERENT, 10.0), 6)
    0.003369
    """
    match modulation:
        case Modulation.FSK_NONCOHERENT:
            return 0.5 * exp(-ebn0 / 2.0)
        case Modulation.FSK_COHERENT:
            return 0.5 * erfc(math.sqrt(ebn0 / 2.0))
        case Modulation.PSK:
            return 0.5 * erfc(math.sqrt(ebn0))
        case Modulation.DPSK:
            return 0.5 * exp(-ebn0)


def faded(modulation: Modulation, ebn0: float) -> float:
    """Bit error rate in the mean over a Rayleigh fade.

    >>> round(faded(Modulation.FSK_NONCOHERENT, 10.0), 5)
    0.08333
    """
    match modulation:
        case Modulation.FSK_NONCOHERENT:
            return 1.0 / (2.0 + ebn0)
        case Modulation.FSK_COHERENT:
            return 1.0 / (2.0 + ebn0 + math.sqrt(ebn0 * (2.0 + ebn0)))  # (1 - sqrt(g / (2 + g))) / 2
        case Modulation.PSK:
            return 0.5 / (1.0 + ebn0 + math.sqrt(ebn0 * (1.0 + ebn0)))  # (1 - sqrt(g / (1 + g))) / 2
        case Modulation.DPSK:
            return 0.5 / (1.0 + ebn0)


def needed_ebn0(modulation: Modulation, rate: float) -> float:
    """Energy of a bit over the density of white noise at which bits err at this rate; the inverse of ``steady``.

    Args:
        modulation: of the bits.
        rate: above 0, at most 0.5.
    """
    quantile = normal_quantile(rate)
    match modulation:
        case Modulation.FSK_NONCOHERENT:
            return -2.0 * log(2.0 * rate)
        case Modulation.FSK_COHERENT:
            return quantile * quantile
        case Modulation.PSK:
            return 0.5 * quantile * quantile
        case Modulation.DPSK:
            return -log(2.0 * rate)
