"""A driver without a modem: vehicles of one process hear each other through memory, and nothing is lost."""

from __future__ import annotations

from collections.abc import Callable

from exchange.drivers.seam import TimedPacket


class Ether:
    """What the drivers of one process share.

    Args:
        air_s: how long a packet of so many bits takes (s).
    """

    def __init__(self, air_s: Callable[[int], float]) -> None:
        self._air_s = air_s
        self._waiting: dict[MemoryDriver, list[TimedPacket]] = {}

    def driver(self) -> MemoryDriver:
        """A driver more, which all others hear from now on."""
        driver = MemoryDriver(self)
        self._waiting[driver] = []
        return driver

    def carry(self, sender: MemoryDriver, data: bytes, now_s: float) -> None:
        """Let all but the sender hear a packet."""
        heard = TimedPacket(bytes(data), now_s + self._air_s(8 * len(data)))
        for driver, waiting in self._waiting.items():
            if driver is not sender:
                waiting.append(heard)

    def taken(self, driver: MemoryDriver) -> list[TimedPacket]:
        """What a driver has not given yet."""
        packets, self._waiting[driver] = self._waiting[driver], []
        return packets

    def leave(self, driver: MemoryDriver) -> None:
        """Let a driver hear nothing from now on."""
        self._waiting.pop(driver, None)


class MemoryDriver:
    """One vehicle's driver; ``Ether.driver`` makes it. It never waits: who shares a process has nobody to wait for."""

    def __init__(self, ether: Ether) -> None:
        self._ether: Ether | None = ether

    def send(self, data: bytes, now_s: float) -> None:
        """Let all others hear it."""
        if self._ether is not None:
            self._ether.carry(self, data, now_s)

    def receive(self, until_s: float) -> list[TimedPacket]:
        """What has been heard since the last call."""
        return [] if self._ether is None else self._ether.taken(self)

    def close(self) -> None:
        """Leave."""
        if self._ether is not None:
            self._ether.leave(self)
            self._ether = None
