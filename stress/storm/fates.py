"""Fates: what becomes of a packet of a storm at one receiver."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import count
from typing import NamedTuple

from exchange.acoustics import loss


class Copy(NamedTuple):
    """One arrival of a packet at one receiver.

    Attributes:
        late_slots: by how much it comes later than sound needs, in slots.
        flips: numbers of the bits that are damaged, counted round the packet.
    """

    late_slots: float = 0.0
    flips: tuple[int, ...] = ()


Fate = tuple[Copy, ...]
"""What becomes of a packet at one receiver: each copy that arrives."""

HEARD: Fate = (Copy(),)
LOST: Fate = ()
DOUBLED: Fate = (Copy(), Copy(0.05))


def late(slots: float) -> Fate:
    """It comes so many slots late."""
    return (Copy(slots),)


def replayed(slots: float) -> Fate:
    """It is heard, and once more so many slots later."""
    return (Copy(), Copy(slots))


def damaged(*flips: int) -> Fate:
    """It comes with these bits flipped."""
    return (Copy(0.0, flips),)


def chances(seed: int, *fates: tuple[float, Fate]) -> Iterator[Fate]:
    """Fates without end, each with its chance; what is left is heard."""
    for index in count():
        number = loss.uniform(seed, 0, index, 0, 0)
        for chance, fate in fates:
            number -= chance
            if number < 0.0:
                yield fate
                break
        else:
            yield HEARD


def flipped(data: bytes, flips: Iterable[int]) -> bytes:
    """The bytes with these bits turned; numbers count round."""
    damaged = bytearray(data)
    for bit in flips:
        byte, place = divmod(bit % (8 * len(damaged)), 8)
        damaged[byte] ^= 128 >> place
    return bytes(damaged)
