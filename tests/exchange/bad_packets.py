"""Random strings and mutated packets of managers alone, thrown at a vehicle; `many_packets` throws those of missions.

Everything goes the whole way: `receive`, and the merge of what it let pass. Nothing may be raised. A victim is
made anew after some hundred packets, since without a checksum it believes most of what was damaged. First it hears
enough of good packets to know that its peers are of its own kind.
"""

from __future__ import annotations

import gc
import random
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache

from storm_vehicles import creates, maker, maps, schedule_of, storm_of
from tools.mangling import Way

from remoras.testing import LOST, Make, chances
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


def throw(
    n: int,
    ways: Sequence[Way],
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
    ways: Sequence[Way],
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
