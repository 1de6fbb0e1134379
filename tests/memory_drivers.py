"""A lossless medium for the vehicles of one process, without waits."""

from __future__ import annotations

import math
from collections.abc import Callable

from exchange.drivers import Paced, TimedPacket

AT_ONCE = Paced(-math.inf)
"""Pace of a run as fast as possible: every event is in the past."""


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
