"""A MOOS community beside a node, by the UDP of its pShare: where a body is comes in, where it is to go goes out.

A datagram is one message, as CMOOSMsg writes it. Numbers are little-endian; a text is its length (int32) and its bytes:

    int32 bytes in all   int32 id   char type, N of a notification   char kind: D number, S text, B bytes
    text source   text auxiliary source   text community   text name of the variable
    double time (Unix, s)   double value   double second value   text value

Source: ``CMOOSMsg::Serialize`` of core-moos (Core/libMOOS/Comms/MOOSMsg.cpp, ec9c77c) and ``ApplyRoutes`` of pShare
(essential-moos). Libraries that were built with ``DISABLE_AUX_SOURCE`` leave one text out; theirs are refused.

With a port to listen on, the body is the community's: ``NAV_X`` and ``NAV_Y`` (m), ``NAV_HEADING`` (degrees from north,
clockwise), ``NAV_SPEED`` (m/s), ``NAV_DEPTH`` (m). A waypoint behaviour of the helm is guided by ``REMORAS_WAYPOINT``,
its updates (``point=X,Y#speed=V``), and ``REMORAS_GO``, true or false, its condition: it takes no speed of 0. Without
one, the simulated body is told to the community under the same names.
"""

from __future__ import annotations

import math
import struct
import time
from typing import NamedTuple

from exchange.drivers import Socket
from exchange.drivers.udp import MOST_AT_ONCE, Address
from missions.nodes.frontseat import Fix
from remoras.vehicle import Vehicle
from remoras.work import Point

HEAD, LENGTH, NUMBERS = struct.Struct("<iicc"), struct.Struct("<i"), struct.Struct("<ddd")
NOTIFY, NUMBER, TEXT, BYTES = b"N", b"D", b"S", b"B"
NOT_SET = -1.0
"""What CMOOSMsg has in a number that is not set, and in its id."""
SOURCE = "remoras"
NAV = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "NAV_DEPTH")
WAYPOINT, GO = "REMORAS_WAYPOINT", "REMORAS_GO"


class MoosMessage(NamedTuple):
    """A notification of a variable.

    Attributes:
        name: of the variable; value: of it.
        time_s: when it was told (Unix, s); source: the program that told it; community: in which.
        auxiliary: what the program said of its source beside.
    """

    name: str
    value: float | str | bytes
    time_s: float
    source: str = SOURCE
    community: str = ""
    auxiliary: str = ""

    @property
    def data(self) -> bytes:
        """As a datagram."""
        kind = NUMBER if isinstance(self.value, float) else TEXT if isinstance(self.value, str) else BYTES
        number = self.value if isinstance(self.value, float) else NOT_SET
        content = self.value.encode() if isinstance(self.value, str) else b""
        content = self.value if isinstance(self.value, bytes) else content
        texts = (text.encode() for text in (self.source, self.auxiliary, self.community, self.name))
        body = b"".join(LENGTH.pack(len(text)) + text for text in texts)
        body += NUMBERS.pack(self.time_s, number, NOT_SET) + LENGTH.pack(len(content)) + content
        return HEAD.pack(HEAD.size + len(body), int(NOT_SET), NOTIFY, kind) + body

    @classmethod
    def of(cls, data: bytes) -> MoosMessage:
        """The message that a datagram is.

        Raises:
            ValueError: it is none, or no notification.
        """
        if len(data) < HEAD.size:
            raise ValueError("cut off")
        length, _, what, kind = HEAD.unpack_from(data)
        if length != len(data) or what != NOTIFY or kind not in (NUMBER, TEXT, BYTES):
            raise ValueError("no notification")
        at = HEAD.size
        texts = []
        for _ in range(4):
            text, at = _text(data, at)
            texts.append(text.decode())
        if len(data) < at + NUMBERS.size:
            raise ValueError("cut off")
        time_s, number, _ = NUMBERS.unpack_from(data, at)
        content, at = _text(data, at + NUMBERS.size)
        source, auxiliary, community, name = texts
        if at != len(data) or not name:
            raise ValueError("no notification")
        value = number if kind == NUMBER else content.decode() if kind == TEXT else content
        return cls(name, value, time_s, source, community, auxiliary)


def _text(data: bytes, at: int) -> tuple[bytes, int]:
    """A text that begins at a place, and where it ends."""
    if len(data) < at + LENGTH.size:
        raise ValueError("cut off")
    (length,) = LENGTH.unpack_from(data, at)
    begin = at + LENGTH.size
    if not 0 <= length <= len(data) - begin:
        raise ValueError("cut off")
    return data[begin : begin + length], begin + length


class MoosShare:
    """What a vehicle and its community share: a body as the node takes it, or a witness of a simulated one.

    Args:
        port: to send from, and to listen on; closed with it.
        to: where pShare of the community listens.
        vehicle: name of the vehicle, told as community.

    Attributes:
        n_taken: messages of variables that are asked for; n_refused: datagrams that are none, or have no number.
    """

    def __init__(self, port: Socket, to: Address, vehicle: str) -> None:
        self._port, self._to, self._vehicle = port, to, vehicle
        self._known: dict[str, float] = {}
        self._news: set[str] = set()
        self._is_open = True
        self._told_s = -math.inf
        self.n_taken = self.n_refused = 0

    def fix(self) -> Fix | None:
        """Where the community says that the vehicle is, once both coordinates are new; others may be older, or 0."""
        for _ in range(MOST_AT_ONCE):
            if not self._is_open or (came := self._port.take()) is None:
                break
            try:
                message = MoosMessage.of(came[0])
                if message.name in NAV:
                    self._take(message)
            except ValueError:
                self.n_refused += 1
        if not self._news.issuperset(NAV[:2]):
            return None
        self._news.clear()
        x_m, y_m, heading_deg, speed_mps, depth_m = (self._known.get(name, 0.0) for name in NAV)
        return Fix(x_m, y_m, math.radians(90.0 - heading_deg), speed_mps, depth_m)

    def _take(self, message: MoosMessage) -> None:
        if not isinstance(message.value, float) or not math.isfinite(message.value):
            raise ValueError("no number")
        self._known[message.name] = message.value
        self._news.add(message.name)
        self.n_taken += 1

    def guide(self, target_m: Point, speed_mps: float) -> None:
        """Tell the helm where to go, or at speed 0 to stop; each time anew, since a datagram may be lost."""
        if speed_mps > 0.0:
            self._tell(WAYPOINT, f"point={target_m[0]:.2f},{target_m[1]:.2f}#speed={speed_mps:.2f}")
        self._tell(GO, "true" if speed_mps > 0.0 else "false")

    def witness(self, vehicle: Vehicle, now_s: float) -> None:
        """Tell the community where a simulated vehicle is.

        Args:
            vehicle: of the node.
            now_s: time of the mission; once for each of them.
        """
        if now_s > self._told_s:
            self._told_s = now_s
            layer, motion = vehicle.functional, vehicle.functional.motion
            heading_deg = (90.0 - motion.heading_rad / math.radians(1.0)) % 360.0
            values = (motion.x_m, motion.y_m, heading_deg, layer.guidance.ground_mps, layer.depth_m)
            for name, value in zip(NAV, values, strict=True):
                self._tell(name, float(value))

    def _tell(self, name: str, value: float | str) -> None:
        if self._is_open:
            self._port.put(MoosMessage(name, value, time.time(), community=self._vehicle).data, self._to)

    def close(self) -> None:
        """Free the port; calling it again does nothing."""
        self._is_open = False
        self._port.close()
