"""Drivers: what stands between a vehicle's exchange and a modem. The manager knows nothing of them."""

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
