"""Driver interface, the mission time on which drivers wait, and a lossless driver in memory.

A driver may lose, duplicate, delay and reorder packets. It never waits for an answer and does not retransmit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
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


class Pace(Protocol):
    """Clock of the mission time."""

    @property
    def now_s(self) -> float:
        """Mission time (s), negative before the start."""

    @property
    def uncertainty_s(self) -> float:
        """Uncertainty of the mission time (s)."""


@dataclass(frozen=True)
class AtOnce:
    """Clock of a run as fast as possible, without waits."""

    @property
    def now_s(self) -> float:
        """Infinity: every event is in the past, so that no caller waits."""
        return math.inf

    @property
    def uncertainty_s(self) -> float:
        """Zero (s): simulated time is exact."""
        return 0.0


AT_ONCE = AtOnce()


class Paced:
    """Mission time by the machine clock, from ``start_s`` by ``time.monotonic``, ``speed`` times as fast."""

    def __init__(self, start_s: float, speed: float = 1.0) -> None:
        self.start_s = start_s
        self.speed = speed

    @property
    def now_s(self) -> float:
        """Mission time (s)."""
        return (time.monotonic() - self.start_s) * self.speed

    @property
    def uncertainty_s(self) -> float:
        """Uncertainty of the mission time (s): 0, the machine clock is taken as exact."""
        return 0.0

    def wait_s(self, until_s: float) -> float:
        """Return the wait until a mission time, in seconds of the machine; 0 if it is past."""
        return max(0.0, (until_s - self.now_s) / self.speed)


class Ether:
    """Shared medium of the drivers in one process; ``air_s`` maps bits to transmission time (s)."""

    def __init__(self, air_s: Callable[[int], float]) -> None:
        self.air_s = air_s
        self.drivers: list[MemoryDriver] = []
        """Drivers not yet closed."""

    def driver(self) -> MemoryDriver:
        """Return a new driver that receives from all others."""
        driver = MemoryDriver(self)
        self.drivers.append(driver)
        return driver


class MemoryDriver:
    """Driver of one vehicle, created by ``Ether.driver``; it never blocks."""

    def __init__(self, ether: Ether) -> None:
        self._ether = ether
        self._waiting: list[TimedPacket] = []

    def send(self, data: bytes, now_s: float) -> None:
        """Send a packet to all others."""
        drivers = self._ether.drivers
        packet = TimedPacket(bytes(data), now_s + self._ether.air_s(8 * len(data)))
        # A closed driver neither sends nor receives.
        for driver in drivers if self in drivers else ():
            if driver is not self:
                driver._waiting.append(packet)

    def receive(self, until_s: float) -> list[TimedPacket]:
        """Return the packets received since the last call."""
        packets, self._waiting = self._waiting, []
        return packets

    def close(self) -> None:
        """Leave the medium; further calls have no effect."""
        if self in self._ether.drivers:
            self._ether.drivers.remove(self)
            self._waiting.clear()
