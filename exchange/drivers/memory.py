"""Lossless driver without a modem, for vehicles in one process."""

from __future__ import annotations

from collections.abc import Callable

from exchange.drivers.seam import TimedPacket


class Ether:
    """Shared medium of the drivers in one process; ``air_s`` maps bits to transmission time (s)."""

    def __init__(self, air_s: Callable[[int], float]) -> None:
        self._air_s = air_s
        self._waiting: dict[MemoryDriver, list[TimedPacket]] = {}

    def driver(self) -> MemoryDriver:
        """Return a new driver that receives from all others."""
        driver = MemoryDriver(self)
        self._waiting[driver] = []
        return driver

    def carry(self, sender: MemoryDriver, data: bytes, now_s: float) -> None:
        """Deliver a packet to all drivers except the sender."""
        heard = TimedPacket(bytes(data), now_s + self._air_s(8 * len(data)))
        for driver, waiting in self._waiting.items():
            if driver is not sender:
                waiting.append(heard)

    def taken(self, driver: MemoryDriver) -> list[TimedPacket]:
        """Return and clear the packets queued for a driver."""
        packets, self._waiting[driver] = self._waiting[driver], []
        return packets

    def leave(self, driver: MemoryDriver) -> None:
        """Remove a driver."""
        self._waiting.pop(driver, None)


class MemoryDriver:
    """Driver of one vehicle, created by ``Ether.driver``; it never blocks."""

    def __init__(self, ether: Ether) -> None:
        self._ether: Ether | None = ether

    def send(self, data: bytes, now_s: float) -> None:
        """Send a packet to all others."""
        if self._ether is not None:
            self._ether.carry(self, data, now_s)

    def receive(self, until_s: float) -> list[TimedPacket]:
        """Return the packets received since the last call."""
        return [] if self._ether is None else self._ether.taken(self)

    def close(self) -> None:
        """Leave the medium; further calls have no effect."""
        if self._ether is not None:
            self._ether.leave(self)
            self._ether = None
