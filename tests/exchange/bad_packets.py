"""Random strings and mutated packets thrown at a vehicle: `python tests/exchange/bad_packets.py 1000000`.

Everything goes the whole way: `receive`, and the merge of what it let pass. Nothing may be raised. A victim is
made anew after some hundred packets, since without a checksum it believes most of what was damaged. First it hears
enough of good packets to know that its peers are of its own kind.
"""

from __future__ import annotations

import gc
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache

from storm_vehicles import creates, maker, maps, schedule_of, storm_of

from exchange.policies import POLICIES
from remoras.testing import LOST, Make, chances, flipped
from worldmodel import merge

VICTIM = 3
N_NODES = 4
BATCH = 300
"""Bad packets that a victim lives through."""

GOOD = 5 * (N_NODES - 1)
"""Good packets that it hears first."""


@dataclass
class Toll:
    """What came of bad packets.

    Attributes:
        refused: how many were counted as a fault of a peer.
        taken: how many passed for good ones.
        worst_s: the longest time that one took (CPU).
        worst: that packet.
        slow: those over a limit, each with its slot.
    """

    refused: int = 0
    taken: int = 0
    worst_s: float = 0.0
    worst: bytes = b""
    slow: list[tuple[int, bytes]] = field(default_factory=list)


@cache
def traffic(policy: str, payload_bytes: int, crc_bits: int = 0) -> tuple[tuple[int, bytes], ...]:
    """Slots and packets of the peers of the victim, in a busy fleet on a lossy sea."""
    storm = storm_of(N_NODES, policy, payload_bytes, crc_bits=crc_bits)
    fates = chances(1, (0.3, LOST))
    for frame in range(40):
        for node in range(N_NODES):
            n_cells = 9 if (frame + node) % 7 == 0 else 1
            maps(storm, node, *range(10 * frame, 10 * frame + n_cells))
        if frame % 10 == 0:
            creates(storm, frame // 10)
        storm.run_frames(1, fates)
    return tuple((aired.slot, aired.data) for aired in storm.aired if aired.sender.node != VICTIM)


# Ways to make a packet bad ------------------------------------------------------------------------


def noise(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """A random string, of any length that a modem may deliver."""
    return draws.randbytes(draws.randrange(len(data) + 8))


def noise_behind_the_head(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """The first bytes are those of a packet."""
    kept = draws.choice([1, 2, 3, 4])
    return data[:kept] + draws.randbytes(draws.randrange(max(1, 2 * len(data))))


def a_few_flips(draws: random.Random, data: bytes, other: bytes) -> bytes:
    """One to four bits turned."""
    return flipped(data, [draws.randrange(8 * len(data)) for _ in range(draws.randint(1, 4))])


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


STRINGS = (noise, noise_behind_the_head)
MUTATIONS = (a_few_flips, a_burst, another_length, spliced, runs)


def throw(
    n: int,
    ways: Sequence[Callable[[random.Random, bytes, bytes], bytes]],
    policy: str,
    payload_bytes: int = 64,
    crc_bits: int = 0,
    seed: int = 0,
    limit_s: float = 0.01,
) -> Toll:
    """Throw ``n`` bad packets at victims.

    Args:
        n: how many.
        ways: to make a packet bad, in turn.
        policy: name of the exchange policy.
        payload_bytes: size of the packets that are made bad.
        crc_bits: size of their checksum.
        seed: of what is drawn.
        limit_s: longer than this no packet should take (CPU, s).
    """
    packets = traffic(policy, payload_bytes, crc_bits)
    with collections_put_off():
        return _thrown(n, ways, packets, maker(N_NODES, policy, payload_bytes, crc_bits=crc_bits), seed, limit_s)


@contextmanager
def collections_put_off() -> Iterator[None]:
    """Let the garbage collector wait: the time that it takes is not the packet's."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _thrown(
    n: int,
    ways: Sequence[Callable[[random.Random, bytes, bytes], bytes]],
    packets: Sequence[tuple[int, bytes]],
    make: Make,
    seed: int,
    limit_s: float,
) -> Toll:
    slot_s = schedule_of(N_NODES).slot_s
    draws = random.Random(seed)
    toll = Toll()
    for first in range(0, n, BATCH):
        model, victim = make(VICTIM, 0, None, 0.0)
        for slot, data in packets[:GOOD]:
            merge(model, victim.receive(data, slot * slot_s + 1.0).blocks, slot * slot_s + 1.0)
        chosen = sorted(draws.randrange(GOOD, len(packets)) for _ in range(min(BATCH, n - first)))
        for number, which in enumerate(chosen):
            slot, data = packets[which]
            bad = ways[number % len(ways)](draws, data, draws.choice(packets)[1])
            now_s = slot * slot_s + 1.0
            began_s = time.process_time()
            reception = victim.receive(bad, now_s)
            merge(model, reception.blocks, now_s)
            took_s = time.process_time() - began_s
            if reception.fault is None:
                toll.taken += bad != data
            else:
                toll.refused += 1
            if took_s > toll.worst_s:
                toll.worst_s, toll.worst = took_s, bad
            if took_s > limit_s:
                toll.slow.append((slot, bad))
    return toll


def main(n: int) -> None:
    """Throw so many strings, and as many mutations, at victims of every policy, and print what came of them."""
    for name, ways in (("strings", STRINGS), ("mutations", MUTATIONS)):
        for crc_bits in (0, 16):
            for number, policy in enumerate(sorted(POLICIES)):
                toll = throw(n // (2 * len(POLICIES)), ways, policy, (32, 64)[number % 2], crc_bits, number)
                print(
                    f"{name:10} crc {crc_bits:2} {policy:15} refused {toll.refused:7} taken {toll.taken:7} "
                    f"worst {1e3 * toll.worst_s:6.2f} ms, over 10 ms {len(toll.slow)}, {toll.worst.hex()}",
                    flush=True,
                )


if __name__ == "__main__":
    main(int(sys.argv[1]))
