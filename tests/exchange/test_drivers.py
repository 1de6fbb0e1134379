"""UDP in place of a modem: addresses, ports, unknown senders, time of reception."""

import socket
import time

import pytest

from exchange.drivers import Paced, Socket, UdpDriver, address_of
from exchange.drivers.udp import HEAD, MAGIC
from exchange.errors import ConfigurationError

AIR_S = 0.25
FAR_S = 1e6
"""The mission began so long ago (s): all that is sent now is past."""


def pair() -> tuple[UdpDriver, Socket, Socket, Paced]:
    """A driver, its port, that of its only peer, and its pace."""
    own, peer, pace = Socket(), Socket(), Paced(time.monotonic() - FAR_S)
    return UdpDriver(own, [peer.address], pace, lambda size_bits: AIR_S), own, peer, pace


def waiting(driver: UdpDriver, pace: Paced) -> list[tuple[bytes, float]]:
    return [tuple(heard) for heard in driver.receive(pace.now_s + 2.0)]


def test_a_port_in_use_is_one_line_with_a_remedy() -> None:
    taken = Socket()
    address = taken.address
    with pytest.raises(
        ConfigurationError, match=r"--bind 127.0.0.1:\d+: Address already in use; allowed is an address"
    ):
        Socket(address)
    taken.close()
    Socket(address).close()


def test_an_address_of_another_machine_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="allowed is an address of this machine"):
        Socket(("192.0.2.1", 0))  # of the block that stands for examples (RFC 5737): nobody has it


@pytest.mark.parametrize("text", ["", "47000", ":47000", "a:", "a:65536", "a:-1", "a" * 300 + ":1"])
def test_an_invalid_address_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"--bind .*allowed is HOST:PORT"):
        address_of(text, "--bind")


def test_a_packet_is_delivered_after_the_air_time_of_the_modem() -> None:
    driver, own, peer, pace = pair()
    peer.put(HEAD.pack(MAGIC, 700.0) + b"data", own.address)
    assert waiting(driver, pace) == [(b"data", 700.0 + AIR_S)]


@pytest.mark.parametrize(
    "datagram",
    [b"", b"RMR1", HEAD.pack(MAGIC, 1.0), HEAD.pack(b"RMR2", 1.0) + b"x", HEAD.pack(MAGIC, float("nan")) + b"x"],
)
def test_datagrams_that_are_no_packets_are_skipped(datagram: bytes) -> None:
    driver, own, peer, pace = pair()
    peer.put(datagram, own.address)
    peer.put(HEAD.pack(MAGIC, 1.0) + b"good", own.address)
    assert [data for data, _ in waiting(driver, pace) or waiting(driver, pace)] == [b"good"]


def test_datagrams_of_unknown_senders_are_skipped() -> None:
    driver, own, _, pace = pair()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(HEAD.pack(MAGIC, 1.0) + b"data", own.address)
        assert driver.receive(pace.now_s + 0.2) == []


class Flooded(Socket):
    """Port with a datagram of an unknown sender at any time; a caller that takes more than 1000 never ends."""

    n_taken = 0

    def wait(self, wait_s: float) -> bool:
        return True

    def take(self) -> tuple[bytes, tuple[str, int]]:
        self.n_taken += 1
        assert self.n_taken <= 1000
        return HEAD.pack(MAGIC, 700.0) + b"data", ("192.0.2.1", 47000)


def test_a_flood_of_datagrams_does_not_delay_the_next_slot() -> None:
    pace = Paced(time.monotonic() - FAR_S)
    driver = UdpDriver(port := Flooded(), [("127.0.0.1", 47000)], pace, lambda size_bits: AIR_S)
    assert driver.receive(pace.now_s - 1.0) == []
    assert port.heard_start_s([("127.0.0.1", 47000)], 0.0, 1.0) is None


def test_a_missing_peer_causes_no_error() -> None:
    driver, _, peer, pace = pair()
    peer.close()
    for _ in range(3):
        driver.send(b"data", pace.now_s)
        assert driver.receive(pace.now_s) == []


def test_the_start_time_follows_from_the_first_received_packet() -> None:
    """At ten times real time a slot that opened at 50 s lies 5 s behind the start of the mission."""
    listener, peer = Socket(), Socket()
    assert listener.heard_start_s([peer.address], 0.01, 10.0) is None
    peer.put(HEAD.pack(MAGIC, 50.0) + b"data", listener.address)
    start_s = listener.heard_start_s([peer.address], 5.0, 10.0)
    assert start_s is not None
    assert 5.0 <= time.monotonic() - start_s < 6.0
