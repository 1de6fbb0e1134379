"""Drivers: interfaces between the exchange of a vehicle and its modem."""

from exchange.drivers.memory import Ether, MemoryDriver
from exchange.drivers.seam import AT_ONCE, AtOnce, Driver, Pace, Paced, TimedPacket
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
