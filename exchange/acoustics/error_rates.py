"""Packet error rates from bit error rates of modulations, in white noise and under fading (Proakis 2001).

``ebn0`` is the energy of a bit over the density of the noise, as a ratio; under a fade it is the mean of that.

How bits err together is said by ``Fading``. Under a fade that lasts for a block of L bits, the block is lost with

    P(g) = integral over x from 0 of (1 - (1 - b(x))^L) exp(-x / g) / g

where b is the bit error rate in white noise and g the mean of Eb/N0. Integrated by parts, P is the mean of
1 - exp(-X / g) over a threshold X that exceeds x with probability 1 - (1 - b(x))^L. X is inverted in closed form, and
the mean is summed by a tanh-sinh rule: few points, positive weights, so P lies in [0, 1] and falls with g.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import Enum
from functools import lru_cache
from math import ldexp
from operator import mul

from exchange.arithmetic import PI, erfc, exp, expm1, expm1_of, log, log1p, normal_quantile, power


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


STEP, HALF = 0.25, 12
"""Step of the tanh-sinh rule, and its points on either side of the middle.

From -30 to 50 dB errors stay below 1e-13 of the loss for blocks of 64 bits and more, below 1e-3 for shorter ones.
"""


class Fading(Enum):
    """For how long one fade lasts; the fades of blocks are independent, exponential in energy (Rayleigh)."""

    NONE = "none"
    BIT = "bit"
    FRAME = "frame"
    PACKET = "packet"


def block_loss(bit_error_rate: float, n_bits: float) -> float:
    """Probability that at least one of ``n_bits`` is wrong, if bits err independently.

    >>> round(block_loss(1e-3, 256), 4)
    0.226
    """
    return -expm1(n_bits * log1p(-bit_error_rate))


def faded_block_loss(modulation: Modulation, n_bits: int, ebn0: float) -> float:
    """Probability that a block under one Rayleigh fade has a wrong bit.

    Args:
        modulation: of its bits.
        n_bits: of the block.
        ebn0: mean energy of a bit over the density of the noise, as a ratio.

    >>> round(faded_block_loss(Modulation.FSK_NONCOHERENT, 256, 10.0), 3)
    0.652
    """
    if n_bits == 0:
        return 0.0
    if ebn0 <= 0.0:
        return 1.0 - ldexp(1.0, -n_bits)
    thresholds, weights = _thresholds(modulation, n_bits)
    return -math.fsum(map(mul, weights, expm1_of([-x / ebn0 for x in thresholds])))


@lru_cache(maxsize=4096)
def _thresholds(modulation: Modulation, n_bits: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Values of the threshold X, and their weights, which sum up to the loss where there is nothing but noise."""
    whole = 1.0 - ldexp(1.0, -n_bits)
    weighted = []
    for number in range(-HALF, HALF + 1):
        t = number * STEP
        above, below = 0.5 * exp(t), 0.5 * exp(-t)
        steep = exp(PI * (above - below))
        low, high = 1.0 / (1.0 + 1.0 / steep), 1.0 / (1.0 + steep)
        intact = high * whole + ldexp(1.0, -n_bits)  # 1 - low * whole, exact near the end too
        rate = -expm1((log1p(-low * whole) if low < 0.5 else log(intact)) / n_bits)
        weighted.append((needed_ebn0(modulation, min(rate, 0.5)), (above + below) * low * high))
    total = math.fsum(weight for _, weight in weighted)
    return tuple(x for x, _ in weighted), tuple(whole * weight / total for _, weight in weighted)


def frames(n_bits: int, frame_bits: int) -> Iterator[int]:
    """Sizes of the frames of a packet; the last may be shorter.

    >>> list(frames(1100, 512))
    [512, 512, 76]
    """
    for begun in range(0, n_bits, frame_bits):
        yield min(frame_bits, n_bits - begun)


def frame_loss(modulation: Modulation, fading: Fading, n_bits: int, ebn0: float) -> float:
    """Probability that a frame is lost, whatever becomes of the others of its packet.

    Args:
        modulation: of its bits.
        fading: for how long one fade lasts.
        n_bits: of the frame.
        ebn0: mean energy of a bit over the density of the noise, as a ratio.
    """
    match fading:
        case Fading.NONE:
            return block_loss(steady(modulation, ebn0), n_bits)
        case Fading.BIT:
            return block_loss(faded(modulation, ebn0), n_bits)
        case _:
            return faded_block_loss(modulation, n_bits, ebn0)


def packet_loss(modulation: Modulation, fading: Fading, n_bits: int, frame_bits: int, ebn0: float) -> float:
    """Probability that a packet is lost that is taken whole: all of its frames must pass.

    Args:
        modulation: of its bits.
        fading: for how long one fade lasts; under one that lasts for the packet its frames share their fate.
        n_bits: of the packet.
        frame_bits: of a whole frame.
        ebn0: mean energy of a bit over the density of the noise, as a ratio.
    """
    if fading is Fading.PACKET or n_bits <= frame_bits:
        return frame_loss(modulation, fading, n_bits, ebn0)
    n_whole, rest_bits = divmod(n_bits, frame_bits)
    intact = power(1.0 - frame_loss(modulation, fading, frame_bits, ebn0), n_whole)
    return 1.0 - intact * (1.0 - frame_loss(modulation, fading, rest_bits, ebn0))


def delivered_share(modulation: Modulation, fading: Fading, n_bits: int, frame_bits: int, ebn0: float) -> float:
    """Share of a packet's bits that arrive in the mean, if frames are delivered one by one; arguments as above."""
    if n_bits == 0:
        return 1.0
    intact = (size * (1.0 - frame_loss(modulation, fading, size, ebn0)) for size in frames(n_bits, frame_bits))
    return math.fsum(intact) / n_bits
