"""Drivers: interfaces between the exchange of a vehicle and its modem."""

from exchange.drivers.driver import AT_ONCE, AtOnce, Driver, Ether, MemoryDriver, Pace, Paced, TimedPacket
from exchange.drivers.udp import Socket, UdpDriver, address_of

__all__ = [
    "AT_ONCE",
    "AtOnce",
    "Driver",
    "Ether",
    "MemoryDriver",
    "Pace",
    "Paced",
    "Socket",
    "TimedPacket",
    "UdpDriver",
    "address_of",
]
