"""Packet error rates of modulations, in white noise and under fading (Proakis 2001).

``ebn0`` is the ratio of bit energy to noise density, under fading its mean. ``Fading`` gives the correlation of bit
errors. A block of L bits under one fade is lost with probability

    P(g) = integral over x from 0 of (1 - (1 - b(x))^L) exp(-x / g) / g

where b is the bit error rate in white noise and g the mean of Eb/N0. By parts, P is the mean of 1 - exp(-X / g) over a
threshold X that exceeds x with probability 1 - (1 - b(x))^L. X has a closed inverse, and a tanh-sinh rule sums the
mean: few points and positive weights, so P lies in [0, 1] and decreases with g.
"""

from __future__ import annotations

import math
from enum import Enum
from functools import lru_cache
from math import ldexp
from operator import mul

from exchange.arithmetic import PI, erfc, exp, expm1, expm1_of, log, log1p, normal_quantile, power


class Modulation(Enum):
    """Modulation of a modem; PSK has two phases, or four with Gray code (equal bit error rate)."""

    FSK_NONCOHERENT = "fsk-noncoherent"
    FSK_COHERENT = "fsk-coherent"
    PSK = "psk"
    DPSK = "dpsk"


AT_HALF_ENERGY = {Modulation.FSK_NONCOHERENT: Modulation.DPSK, Modulation.FSK_COHERENT: Modulation.PSK}
"""Phase modulation with the bit error rates of an FSK at half of its Eb/N0."""


def steady(modulation: Modulation, ebn0: float) -> float:
    """Return the bit error rate in white noise.

    >>> round(steady(Modulation.FSK_NONCOHERENT, 10.0), 6)
    0.003369
    """
    if modulation in AT_HALF_ENERGY:
        return steady(AT_HALF_ENERGY[modulation], ebn0 / 2.0)
    return 0.5 * (exp(-ebn0) if modulation is Modulation.DPSK else erfc(math.sqrt(ebn0)))


def faded(modulation: Modulation, ebn0: float) -> float:
    """Return the mean bit error rate under Rayleigh fading.

    >>> round(faded(Modulation.FSK_NONCOHERENT, 10.0), 5)
    0.08333
    """
    if modulation in AT_HALF_ENERGY:
        return faded(AT_HALF_ENERGY[modulation], ebn0 / 2.0)
    # Of PSK (1 - sqrt(g / (1 + g))) / 2, without the difference.
    return 0.5 / (1.0 + ebn0 + (0.0 if modulation is Modulation.DPSK else math.sqrt(ebn0 * (1.0 + ebn0))))


def needed_ebn0(modulation: Modulation, rate: float) -> float:
    """Return the Eb/N0 of a bit error rate in (0, 0.5]: the inverse of ``steady``."""
    if modulation in AT_HALF_ENERGY:
        return 2.0 * needed_ebn0(AT_HALF_ENERGY[modulation], rate)
    quantile = normal_quantile(rate)
    return -log(2.0 * rate) if modulation is Modulation.DPSK else 0.5 * quantile * quantile


STEP, HALF = 0.25, 12
"""Step of the tanh-sinh rule, and points on either side: errors below 1e-13 of the loss from 64 bits on."""


class Fading(Enum):
    """Duration of one fade; fades are independent and exponential in energy (Rayleigh)."""

    NONE = "none"
    BIT = "bit"
    FRAME = "frame"
    PACKET = "packet"


def block_loss(bit_error_rate: float, n_bits: float) -> float:
    """Return the probability of at least one error in ``n_bits`` independent bits.

    >>> round(block_loss(1e-3, 256), 4)
    0.226
    """
    return -expm1(n_bits * log1p(-bit_error_rate))


def faded_block_loss(modulation: Modulation, n_bits: int, ebn0: float) -> float:
    """Return the probability of a bit error in a block under one Rayleigh fade.

    >>> round(faded_block_loss(Modulation.FSK_NONCOHERENT, 256, 10.0), 3)
    0.652
    """
    if n_bits == 0:
        return 0.0
    # Without signal each bit is a guess.
    if ebn0 <= 0.0:
        return 1.0 - ldexp(1.0, -n_bits)
    thresholds, weights = _thresholds(modulation, n_bits)
    return -math.fsum(map(mul, weights, expm1_of([-x / ebn0 for x in thresholds])))


@lru_cache(maxsize=4096)  # 40 % of a mission on the acoustic channel
def _thresholds(modulation: Modulation, n_bits: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    whole = 1.0 - ldexp(1.0, -n_bits)
    weighted = []
    for number in range(-HALF, HALF + 1):
        t = number * STEP
        above, below = 0.5 * exp(t), 0.5 * exp(-t)
        # Tanh-sinh abscissa on (0, 1), as both of its distances from the ends, since one of them is tiny.
        steep = exp(PI * (above - below))
        low, high = 1.0 / (1.0 + 1.0 / steep), 1.0 / (1.0 + steep)
        intact = high * whole + ldexp(1.0, -n_bits)  # 1 - low * whole, also exact near low = 1
        # Inverse of 1 - (1 - rate)^L, by the branch that is exact for small or for large loss.
        rate = -expm1((log1p(-low * whole) if low < 0.5 else log(intact)) / n_bits)
        weighted.append((needed_ebn0(modulation, min(rate, 0.5)), (above + below) * low * high))
    # Normalised, so that without signal the loss is exactly that of guessed bits.
    total = math.fsum(weight for _, weight in weighted)
    return tuple(x for x, _ in weighted), tuple(whole * weight / total for _, weight in weighted)


def frame_loss(modulation: Modulation, fading: Fading, n_bits: int, ebn0: float) -> float:
    """Return the loss probability of one frame."""
    match fading:
        case Fading.NONE:
            return block_loss(steady(modulation, ebn0), n_bits)
        case Fading.BIT:
            return block_loss(faded(modulation, ebn0), n_bits)
        case _:
            return faded_block_loss(modulation, n_bits, ebn0)


def packet_loss(modulation: Modulation, fading: Fading, n_bits: int, frame_bits: int, ebn0: float) -> float:
    """Return the loss probability of a packet that needs all frames of ``frame_bits``."""
    if fading is Fading.PACKET or n_bits <= frame_bits:
        return frame_loss(modulation, fading, n_bits, ebn0)
    # Frames fade independently: all must be intact.
    n_whole, rest_bits = divmod(n_bits, frame_bits)
    intact = power(1.0 - frame_loss(modulation, fading, frame_bits, ebn0), n_whole)
    return 1.0 - intact * (1.0 - frame_loss(modulation, fading, rest_bits, ebn0))
