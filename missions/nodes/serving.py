"""Ports of a sea: each station has one of UDP for datagrams, and of TCP for the UnetStack API, of equal number.

One thread serves all. It reads little of each port at a time, so that a flood at one delays the others by less than a
millisecond, and limits everything that a program may leave behind: packets, connections, bytes, time.
"""

from __future__ import annotations

import hmac
import selectors
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from exchange.drivers import Paced, Socket
from exchange.drivers.fjage import Lines, Object, line_of
from exchange.drivers.udp import Address
from exchange.errors import ConfigurationError
from missions.nodes.sea import Packet, Received, Sea, Station
from missions.nodes.unet import UnetProgram
from remoras.process import rare_collections

DATAGRAMS_AT_ONCE, BYTES_AT_ONCE = 8, 4096
"""Input that one port gives before the others have their turn."""
MOST_CONNECTIONS = 8
"""Connections of a station."""
MOST_BAD = 16
"""Invalid lines after which a connection is closed."""
MOST_UNREAD = 1 << 18
"""Bytes that a program may leave unread before its connection is closed."""
GREETING_S = 10.0
"""Time (s) in which a new connection must send a request; half-open ones end then."""
SILENT_S = 10.0
"""Time (s) without a datagram after which another program may take over a station."""
ANSWER_S = 0.02
"""Delay (s) of answers about agents: fjagepy 2.2 fails if one comes before it waits."""
LONGEST_WAIT_S = 0.5
"""Longest wait (s) for input, after which the deadlines of connections are checked."""


class DatagramPort:
    """UDP port of a station: a datagram to it is a packet, and received packets go to its program.

    The program is ``fixed``, or the sender of the first datagram. With a token, its first datagram must be the token.
    """

    def __init__(self, sea: Sea, station: Station, port: Socket, pace: Paced, fixed: Address | None, token: bytes):
        self.socket = port
        self._sea, self._station, self._pace, self._token = sea, station, pace, token
        self._fixed = self._program = fixed
        self._silent_s = 0.0  # time at which another program may take over
        station.listeners.append(self._heard)

    def ready(self, events: int) -> None:
        """Read datagrams."""
        for _ in range(DATAGRAMS_AT_ONCE):
            if (taken := self.socket.take()) is None:
                return
            data, sender = taken
            if self._admits(data, sender) and data:
                self._sea.offer(self._station, Packet(data))

    def _admits(self, data: bytes, sender: Address) -> bool:
        now_s, is_known = self._pace.now_s, sender == self._program
        is_free = self._fixed is None and (self._program is None or now_s > self._silent_s)
        is_let_in = is_free and (not self._token or hmac.compare_digest(data, self._token))
        if not is_known and not is_let_in:
            self._station.counts["strangers"] += 1
            return False
        self._program, self._silent_s = sender, now_s + SILENT_S * self._pace.speed
        # An empty datagram, or the token, only introduces a program.
        return is_known or not self._token

    def _heard(self, received: Received) -> None:
        if self._program is not None:
            self.socket.put(received.packet.data, self._program)


class Connection:
    """TCP connection of a program with the UnetStack API of a station."""

    def __init__(self, ports: Ports, station: Station, stream: socket.socket, token: bytes) -> None:
        self.socket, self.station = stream, station
        self.deadline_s: float | None = ports.pace.now_s + GREETING_S * ports.pace.speed
        self._ports, self._token = ports, token
        self._input, self._unsent = Lines(), b""
        self._program = UnetProgram(ports.sea, station, self._say, ANSWER_S * ports.pace.speed)

    def ready(self, events: int) -> None:
        """Send what is due, read requests."""
        if events & selectors.EVENT_WRITE:
            self._flush()
        if not events & selectors.EVENT_READ or self.socket.fileno() < 0:  # closed by an earlier one
            return
        try:
            came = self.socket.recv(BYTES_AT_ONCE)
        except BlockingIOError:
            return
        except OSError:
            came = b""
        if self._token and came:
            first, end, came = came.partition(b"\n")
            if not end or not hmac.compare_digest(first.strip(), self._token):
                self.close("strangers")
                return
            self._token = b""
        elif not came:
            self.close()
            return
        for value in self._input.feed(came):
            if value.get("alive") is False:
                self.close()
                return
            if self._program.take(value):
                self.deadline_s = None
            else:
                self._input.n_bad += 1
        if self._input.n_bad > MOST_BAD:
            self.close()

    def close(self, reason: str = "") -> None:
        """Close the connection; count a reason. A repeated call has no effect."""
        if self.socket.fileno() < 0:
            return
        self.station.counts.update({"bad": self._input.n_bad} | ({reason: 1} if reason else {}))
        self._program.close()
        self._ports.leave(self)
        self.socket.close()

    def _say(self, value: Object) -> None:
        self._unsent += line_of(value)
        self._flush()
        if len(self._unsent) > MOST_UNREAD:
            self.close("unread")

    def _flush(self) -> None:
        if self.socket.fileno() < 0:
            return
        try:
            self._unsent = self._unsent[self.socket.send(self._unsent) :]
        except BlockingIOError:
            pass
        except OSError:
            self.close()
            return
        self._ports.wait_for(self, selectors.EVENT_READ | (selectors.EVENT_WRITE if self._unsent else 0))


class Ports:
    """Ports of all stations at ``first`` and the next; ``late_s`` is the largest delay (s of the sea) of the service.

    Raises ConfigurationError for an unusable address. ``programs`` are fixed UDP addresses, by station.
    """

    def __init__(
        self, sea: Sea, pace: Paced, first: Address, programs: Mapping[str, Address], token: bytes = b""
    ) -> None:
        self.sea, self.pace, self.late_s = sea, pace, 0.0
        self.numbers: dict[str, int] = {}
        self._token, self._is_stopped = token, False
        self._selector = selectors.DefaultSelector()
        self._connections: list[Connection] = []
        try:
            for station in sea.stations:
                listener, port = _listening(first[0], first[1] and first[1] + station.data.node)
                self._watch(listener, lambda events, *at: self._accept(*at), listener, station)
                datagrams = DatagramPort(sea, station, port, pace, programs.get(station.data.name), token)
                self._watch(port, datagrams.ready)
                self.numbers[station.data.name] = port.address[1]
        except ConfigurationError:
            self.close()
            raise

    def _watch(self, at: Any, ready: Callable[..., None], *more: Any) -> None:
        self._selector.register(at, selectors.EVENT_READ, lambda events: ready(events, *more))

    def stop(self) -> None:
        """End ``run`` within ``LONGEST_WAIT_S``; a signal handler may call it."""
        self._is_stopped = True

    @rare_collections()  # a full one takes a tenth of a second
    def run(self, until_s: float, keep: Callable[[float], None] = lambda now_s: None) -> None:
        """Serve until a time of the sea (s) or a call of ``stop``; ``keep`` is called with the time after events."""
        while (now_s := self.pace.now_s) < until_s and not self._is_stopped:
            self.late_s = max(self.late_s, now_s - self.sea.clock.next_s)
            self.sea.advance(now_s)
            keep(now_s)
            for connection in [one for one in self._connections if one.deadline_s and one.deadline_s < now_s]:
                connection.close("half-open")
            due_s = min(self.sea.clock.next_s, until_s)
            ready = self._selector.select(min(self.pace.wait_s(due_s), LONGEST_WAIT_S))
            # Events that became due meanwhile come before the input.
            self.sea.advance(min(self.pace.now_s, until_s))
            for key, events in ready:
                key.data(events)
        self.sea.advance(min(now_s, until_s))

    def close(self) -> None:
        """Close all ports and connections."""
        for connection in tuple(self._connections):
            connection.close()
        for key in tuple(self._selector.get_map().values()):
            self._selector.unregister(key.fileobj)
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()

    def wait_for(self, connection: Connection, events: int) -> None:
        """Wait for these events of a connection."""
        if connection in self._connections and self._selector.get_key(connection.socket).events != events:
            self._selector.modify(connection.socket, events, connection.ready)

    def leave(self, connection: Connection) -> None:
        """Forget a connection."""
        if connection in self._connections:
            self._connections.remove(connection)
            self._selector.unregister(connection.socket)

    def _accept(self, listener: socket.socket, station: Station) -> None:
        with suppress(OSError):
            stream, _ = listener.accept()
            stream.setblocking(False)
            stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)  # ends with a vanished host
            if sum(one.station is station for one in self._connections) >= MOST_CONNECTIONS:
                station.counts["crowded"] += 1
                stream.close()
                return
            connection = Connection(self, station, stream, self._token)
            self._connections.append(connection)
            self._selector.register(stream, selectors.EVENT_READ, connection.ready)


def _listening(host: str, number: int) -> tuple[socket.socket, Socket]:
    """Return a TCP and a UDP port of one number; 0 takes a free one."""
    for is_last in (bool(number), False, False, True):  # the other kind of a free port may be in use
        listener = None
        try:
            listener = socket.create_server((host, number))
            port = Socket((host, listener.getsockname()[1]))
        except (OSError, OverflowError, ConfigurationError) as error:
            if listener is not None:
                listener.close()
            if is_last:
                why = getattr(error, "strerror", None) or "not free, or no port"
                allowed = "allowed: an address of this machine with a free port for each station, or port 0 for any"
                raise ConfigurationError(f"--port: {host}:{number}: {why}; {allowed}") from None
            continue
        listener.setblocking(False)
        return listener, port
    raise AssertionError
