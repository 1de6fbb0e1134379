"""Packet corruptions: each makes bytes from random draws, a packet and another packet."""

from __future__ import annotations

import random
from collections.abc import Callable

Way = Callable[[random.Random, bytes, bytes], bytes]


def noise(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """A random string, of any length that a modem may deliver."""
    return draws.randbytes(draws.randrange(len(data) + 8))


def noise_behind_the_head(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """The first bytes are those of a packet."""
    kept = draws.choice([1, 2, 3, 4])
    return data[:kept] + draws.randbytes(draws.randrange(max(1, 2 * len(data))))


def a_few_flips(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """One to eight bits turned."""
    damaged = bytearray(data)
    for bit in draws.sample(range(8 * len(data)), draws.randint(1, 8)):
        damaged[bit // 8] ^= 128 >> bit % 8
    return bytes(damaged)


def a_burst(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """Up to five bytes in a row are noise."""
    start, length = draws.randrange(len(data)), draws.randint(1, 5)
    return data[:start] + draws.randbytes(len(data[start : start + length])) + data[start + length :]


def another_length(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """Cut short, or with bytes behind it."""
    if draws.random() < 0.5:
        return data[: draws.randrange(len(data))]
    return data + draws.choice([b"\0", b"\xff", draws.randbytes(3)]) * draws.randint(1, 8)


def spliced(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """The beginning of one packet and the end of another."""
    return data[: draws.randrange(len(data))] + other[draws.randrange(len(other)) :]


def runs(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """Bits of one kind from somewhere on: the largest and the smallest numbers that fields hold."""
    start = draws.randrange(1, len(data))
    length = draws.randint(1, len(data))
    return data[:start] + draws.choice([b"\0", b"\xff"]) * length + data[start + length :]


def stuttered(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """Some bytes in a row come twice, at the cost of the end or not."""
    start, length = draws.randrange(len(data)), draws.randint(1, 8)
    found = data[: start + length] + data[start:]
    return found[: len(data)] if draws.random() < 0.5 else found


def replayed(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """Another packet, as it was sent, at the wrong time."""
    return other


STRINGS: tuple[Way, ...] = (noise, noise_behind_the_head)
MUTATIONS: tuple[Way, ...] = (a_few_flips, a_burst, another_length, spliced, runs, stuttered, replayed)
