"""Driver interface, and the mission time on which drivers wait.

A driver may lose, duplicate, delay and reorder packets. It never waits for an answer and does not retransmit.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable


class TimedPacket(NamedTuple):
    """Packet with the time at which it was completely received (s of the mission)."""

    data: bytes
    time_s: float


@runtime_checkable
class Driver(Protocol):
    """Transmission and reception of the packets of one vehicle, all calls from one thread."""

    def send(self, data: bytes, now_s: float) -> None:
        """Transmit a packet without blocking; ``now_s`` is the slot start (s of the mission)."""

    def receive(self, until_s: float) -> Sequence[TimedPacket]:
        """Return the packets since the last call, in order of reception; damaged ones are allowed.

        It waits for the first packet until ``until_s`` (s of the mission), and not at all if that is past.
        """

    def close(self) -> None:
        """Release the modem; a repeated call has no effect."""


class Paced:
    """Mission time by the machine clock, from ``start_s`` by ``time.monotonic``, ``speed`` times as fast.

    A start at minus infinity gives a run without waits.
    """

    def __init__(self, start_s: float, speed: float = 1.0) -> None:
        self.start_s = start_s
        self.speed = speed

    @property
    def now_s(self) -> float:
        """Mission time (s), negative before the start."""
        return (time.monotonic() - self.start_s) * self.speed

    @property
    def uncertainty_s(self) -> float:
        """Uncertainty of the mission time (s): 0, the machine clock is taken as exact."""
        return 0.0

    def wait_s(self, until_s: float) -> float:
        """Return the wait until a mission time, in seconds of the machine; 0 if it is past."""
        return max(0.0, (until_s - self.now_s) / self.speed)
