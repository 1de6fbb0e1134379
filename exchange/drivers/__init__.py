"""Drivers: interfaces between the exchange of a vehicle and its modem."""

from exchange.drivers.driver import Driver, Paced, TimedPacket
from exchange.drivers.udp import Socket, UdpDriver, address_of

__all__ = [
    "Driver",
    "Paced",
    "Socket",
    "TimedPacket",
    "UdpDriver",
    "address_of",
]
