"""Shipped modem drivers conform to the interface, and the checks detect those that do not."""

import time

import pytest
from memory_drivers import Ether, MemoryDriver

from exchange.drivers import Paced, Socket, TimedPacket, UdpDriver
from remoras.testing import channels as conformance


def air_s(size_bits: int) -> float:
    return size_bits / 640.0


def in_memory() -> conformance.Pair:
    ether = Ether(air_s)
    return ether.driver(), ether.driver(), Paced(time.monotonic())


def over_udp() -> conformance.Pair:
    one, other, pace = Socket(), Socket(), Paced(time.monotonic())
    return UdpDriver(one, [other.address], pace, air_s), UdpDriver(other, [one.address], pace, air_s), pace


class Deaf(MemoryDriver):
    """Receives nothing."""

    def receive(self, until_s: float) -> list[TimedPacket]:
        return []


class Cutting(MemoryDriver):
    """Leaves out the last byte."""

    def receive(self, until_s: float) -> list[TimedPacket]:
        return [TimedPacket(heard.data[:-1], heard.time_s) for heard in super().receive(until_s)]


@pytest.mark.parametrize("make", [in_memory, over_udp])
def test_shipped_drivers_conform(make) -> None:
    conformance.check_driver(make)


@pytest.mark.parametrize("kind", [Deaf, Cutting])
def test_a_driver_that_breaks_a_rule_is_detected(kind: type[MemoryDriver]) -> None:
    def make() -> conformance.Pair:
        one, other, pace = in_memory()
        other.__class__ = kind
        return one, other, pace

    with pytest.raises(AssertionError, match="never received"):
        conformance.check_driver(make)
