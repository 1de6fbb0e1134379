"""Driver for UnetStack modems: physical-layer broadcasts, by the JSON over TCP of ``exchange.drivers.fjage``.

A client has a unique name, subscribes to recipients, and receives their messages:

    -> {"action": "agentForService", "id": I, "service": "org.arl.unet.Services.PHYSICAL"}
    <- {"inResponseTo": "agentForService", "id": I, "agentID": "phy"}
    -> {"action": "wantsMessagesFor", "agentIDs": [NAME, "#phy__ntf"], ...}            # its notifications

Frames are of type 2 (data), to 0 (broadcast), of protocol 32 (the first user protocol); others are ignored.
"""

from __future__ import annotations

import select
import socket
import time
import uuid
from typing import Any

from exchange.drivers.driver import Paced, TimedPacket
from exchange.drivers.fjage import Lines, line_of, message_in, packed, sending, unpacked
from exchange.drivers.udp import Address
from exchange.errors import ConfigurationError

PHYSICAL = "org.arl.unet.Services.PHYSICAL"
TRANSMIT, HEARD = "TxFrameReq", "RxFrameNtf"
DATA, EVERYBODY, PROTOCOL = 2, 0, 32
PATIENCE_S = 5.0
"""Timeout of connection and answers (s)."""
_ANSWERS: dict[str, dict[str, Any]] = {
    "services": {"services": []},
    "agentForService": {},
    "agentsForService": {"agentIDs": []},
}


class UnetStack:
    """Modem of one vehicle; UnetStack usually listens at port 1100.

    Raises ConfigurationError without an answer or physical layer. A packet that the modem refuses is lost.
    """

    def __init__(self, address: Address, pace: Paced) -> None:
        where = f"--unet {address[0]}:{address[1]}"
        try:
            self._socket: socket.socket | None = socket.create_connection(address, PATIENCE_S)
        except OSError as error:
            raise ConfigurationError(
                f"{where}: {error}; allowed is where UnetStack listens, usually port 1100"
            ) from None
        self._pace, self._input = pace, Lines()
        self._name = f"remoras-{uuid.uuid4().hex[:8]}"
        asked = str(uuid.uuid4())
        self._say({"action": "agentForService", "id": asked, "service": PHYSICAL})
        self._agent = self._answer(asked)
        if not self._agent:
            self.close()
            raise ConfigurationError(f"{where}: it names no physical layer; allowed is a modem that runs UnetStack")
        wanted = [self._name, f"#{self._agent}__ntf"]
        self._say({"action": "wantsMessagesFor", "id": str(uuid.uuid4()), "agentIDs": wanted})

    def _answer(self, asked: str) -> str:
        until_s = time.monotonic() + PATIENCE_S
        while self._socket is not None and (left_s := until_s - time.monotonic()) > 0.0:
            for message in self._lines(left_s):
                if message.get("id") == asked:
                    return str(message.get("agentID") or "")
        return ""

    def send(self, data: bytes, now_s: float) -> None:
        """Broadcast a packet."""
        frame = {"type": DATA, "to": EVERYBODY, "protocol": PROTOCOL, "data": packed(data)}
        self._say(sending(f"unet.phy.{TRANSMIT}", self._name, self._agent, "REQUEST", **frame))

    def receive(self, until_s: float) -> list[TimedPacket]:
        """Return the received packets; wait until ``until_s`` for the first."""
        while self._socket is not None:
            left_s = self._pace.wait_s(until_s)
            packets = [data for message in self._lines(left_s) if (data := self._heard(message)) is not None]
            # Other messages may arrive first: wait for the rest of the time.
            if packets or left_s <= 0.0:
                return [TimedPacket(data, max(0.0, self._pace.now_s)) for data in packets]
        return []

    def close(self) -> None:
        """Sign off and close the connection."""
        if self._socket is not None:
            self._say({"alive": False})
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _say(self, value: dict[str, Any]) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendall(line_of(value))
        except OSError:  # without the modem the packet is lost
            self._socket.close()
            self._socket = None

    def _lines(self, wait_s: float) -> list[dict[str, Any]]:
        """Return the objects received within ``wait_s`` (s), after answering requests."""
        if self._socket is None or not select.select([self._socket], [], [], wait_s)[0]:
            return []
        try:
            came = self._socket.recv(65_536)
        except OSError:
            came = b""
        if not came:
            self._socket.close()
            self._socket = None
            return []
        messages = self._input.feed(came)
        for message in messages:
            self._answered(message)
        return messages

    def _answered(self, query: dict[str, Any]) -> None:
        action = query.get("action")
        if query.get("alive") is True:
            self._say({"alive": True})
        elif action in ("agents", "containsAgent"):
            mine = {"agentIDs": [self._name]} if action == "agents" else {"answer": query.get("agentID") == self._name}
            self._say({"id": query.get("id"), "inResponseTo": action, **mine})
        elif isinstance(action, str) and action in _ANSWERS:
            self._say({"id": query.get("id"), "inResponseTo": action, **_ANSWERS[action]})

    def _heard(self, received: dict[str, Any]) -> bytes | None:
        match message_in(received):
            case (clazz, {"protocol": protocol, "data": data}) if clazz == HEARD and protocol == PROTOCOL:
                return unpacked(data) or None
        return None
