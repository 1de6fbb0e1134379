"""UDP in place of a modem, on one machine: one datagram per packet and peer.

A datagram is ``RMR1``, the start of the slot (s of the mission, big-endian double) and the packet. The reception time
includes the transmission time of a modem, which the network lacks.
"""

from __future__ import annotations

import math
import select
import socket
import struct
import time
from collections.abc import Callable, Iterable
from contextlib import suppress

from exchange.drivers.driver import Paced, TimedPacket
from exchange.errors import ConfigurationError

Address = tuple[str, int]
"""IPv4 address of a host, and port."""
HEAD = struct.Struct(">4sd")
MAGIC = b"RMR1"
LARGEST_BYTES = 65_507
MOST_AT_ONCE = 64
"""Maximum number of datagrams per call, so that a flood does not delay own slots."""


def address_of(text: str, option: str) -> Address:
    """Parse ``HOST:PORT``; raises ConfigurationError that names ``option``."""
    host, colon, port = text.rpartition(":")
    try:
        if not colon or not host or not port.isascii() or not port.isdigit() or int(port) > 65_535:
            raise ValueError
        return socket.gethostbyname(host), int(port)
    except (OSError, ValueError):  # UnicodeError, from an invalid host name, is a ValueError
        raise ConfigurationError(
            f"{option} {text}: allowed is HOST:PORT with a host that is known and a port up to 65535, such as "
            "127.0.0.1:47000"
        ) from None


class Socket:
    """UDP port of this machine, 0 for a free one; raises ConfigurationError if unavailable."""

    def __init__(self, address: Address = ("127.0.0.1", 0)) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(address)
        except OSError as error:
            self._socket.close()
            allowed = "allowed is an address of this machine with a free port, or port 0 for any free one"
            raise ConfigurationError(f"--bind {address[0]}:{address[1]}: {error.strerror}; {allowed}") from None
        self._socket.setblocking(False)

    @property
    def address(self) -> Address:
        """Bound address."""
        host, port = self._socket.getsockname()
        return host, port

    def fileno(self) -> int:
        """Return the descriptor of the port, to wait for several."""
        return self._socket.fileno()

    def wait(self, wait_s: float) -> bool:
        """True as soon as there is a datagram; False after ``wait_s`` (s) without one."""
        return bool(select.select([self._socket], [], [], wait_s)[0])

    def take(self) -> tuple[bytes, Address] | None:
        """Return the next datagram and its sender; None without one or after a failed send."""
        try:
            data, sender = self._socket.recvfrom(LARGEST_BYTES)
        except OSError:
            return None
        return data, (sender[0], sender[1])

    def put(self, data: bytes, to: Address) -> None:
        """Send a datagram; ignore an unreachable receiver."""
        with suppress(OSError):
            self._socket.sendto(data, to)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def heard_start_s(self, peers: Iterable[Address], wait_s: float, speed: float) -> float | None:
        """Return the start of the peers' mission by ``time.monotonic``; None after ``wait_s`` (s)."""
        known, until_s = frozenset(peers), time.monotonic() + wait_s
        while (left_s := until_s - time.monotonic()) > 0.0 and self.wait(left_s):
            datagram = self.take()
            if datagram is not None and datagram[1] in known and (opened := _opened(datagram[0])) is not None:
                return time.monotonic() - opened[0] / speed
        return None


def _opened(datagram: bytes) -> tuple[float, bytes] | None:
    if len(datagram) <= HEAD.size:
        return None
    magic, sent_s = HEAD.unpack_from(datagram)
    return (sent_s, datagram[HEAD.size :]) if magic == MAGIC and math.isfinite(sent_s) else None


class UdpDriver:
    """Packets by UDP to and from peers of known addresses.

    It closes ``port``. ``air_s`` maps bits to the transmission time of a modem (s).
    """

    def __init__(self, port: Socket, peers: Iterable[Address], pace: Paced, air_s: Callable[[int], float]) -> None:
        self._port = port
        self._peers = tuple(peers)
        self._pace = pace
        self._air_s = air_s
        self._is_open = True

    def send(self, data: bytes, now_s: float) -> None:
        """Send the packet to each peer; after ``close`` do nothing."""
        if self._is_open:
            datagram = HEAD.pack(MAGIC, now_s) + data
            for peer in self._peers:
                self._port.put(datagram, peer)

    def receive(self, until_s: float) -> list[TimedPacket]:
        """Return the packets of peers; wait until ``until_s`` for the first."""
        packets: list[TimedPacket] = []
        left_s = math.inf
        # Other datagrams may arrive first: wait for the rest of the time.
        while self._is_open and not packets and left_s > 0.0:
            left_s = self._pace.wait_s(until_s)
            packets = self._taken() if self._port.wait(left_s) else []
        return packets

    def _taken(self) -> list[TimedPacket]:
        packets: list[TimedPacket] = []
        for _ in range(MOST_AT_ONCE):
            if (datagram := self._port.take()) is None:
                break
            opened = _opened(datagram[0]) if datagram[1] in self._peers else None
            if opened is not None:
                sent_s, data = opened
                # No packet counts as sent in the future, even if the clock of its sender is ahead.
                packets.append(TimedPacket(data, min(sent_s, self._pace.now_s) + self._air_s(8 * len(data))))
        return packets

    def close(self) -> None:
        """Close the port."""
        self._is_open = False
        self._port.close()
