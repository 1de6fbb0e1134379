"""Driver for UnetStack modems: physical-layer broadcasts, by JSON over TCP.

The agents of UnetStack use fjage (JSON Protocol Specifications, https://fjage.readthedocs.io), one JSON object per
line. A client has a unique name, subscribes to recipients, and receives their messages in objects ``message``:

    -> {"action": "agentForService", "id": I, "service": "org.arl.unet.Services.PHYSICAL"}
    <- {"inResponseTo": "agentForService", "id": I, "agentID": "phy"}
    -> {"action": "wantsMessagesFor", "agentIDs": [NAME, "#phy__ntf"], ...}            # its notifications
    -> {"action": "send", "message": {"clazz": "org.arl.unet.phy.TxFrameReq", "data": {"data": [bytes], ...}}}
    <- {"action": "send", "message": {"clazz": "org.arl.unet.phy.RxFrameNtf", "data": {"data": [bytes], ...}}}

Bytes are base64 in ``{"clazz": "[B", "data": ...}``, or a list of numbers. Frames are of type 2 (data), to 0
(broadcast), of protocol 32 (the first user protocol); others are ignored.
"""

from __future__ import annotations

import base64
import json
import select
import socket
import time
import uuid
from contextlib import suppress
from typing import Any

from exchange.drivers.driver import Paced, TimedPacket
from exchange.drivers.udp import Address
from exchange.errors import ConfigurationError

PHYSICAL = "org.arl.unet.Services.PHYSICAL"
TRANSMIT, HEARD = "TxFrameReq", "RxFrameNtf"
DATA, EVERYBODY, PROTOCOL = 2, 0, 32
PATIENCE_S = 5.0
"""Timeout of connection and answers (s)."""
MOST_BYTES = 1 << 20
"""Maximum length of a line; longer input is discarded."""
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
        self._pace, self._rest = pace, b""
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
        request = {
            "msgID": str(uuid.uuid4()),
            "perf": "REQUEST",
            "sender": self._name,
            "recipient": self._agent,
            "type": DATA,
            "to": EVERYBODY,
            "protocol": PROTOCOL,
            "data": {"clazz": "[B", "data": base64.b64encode(data).decode()},
        }
        message = {"clazz": f"org.arl.unet.phy.{TRANSMIT}", "data": request}  # clazz must be the first key
        self._say({"action": "send", "relay": True, "message": message})

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
            self._socket.sendall(json.dumps(value).encode() + b"\n")
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
        # A line may arrive in parts: the last one is complete once its end arrives.
        *lines, self._rest = (self._rest + came).replace(b"\r", b"\n").split(b"\n")
        self._rest = self._rest if len(self._rest) <= MOST_BYTES else b""
        messages = []
        for line in filter(None, lines):
            with suppress(ValueError, RecursionError):
                value = json.loads(line)
                if isinstance(value, dict):
                    self._answered(value)
                    messages.append(value)
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
        message = received.get("message")
        content = message.get("data") if isinstance(message, dict) else None
        if not isinstance(message, dict) or not isinstance(content, dict):
            return None
        if not str(message.get("clazz")).endswith(f".{HEARD}") or content.get("protocol") != PROTOCOL:
            return None
        data = content.get("data")
        try:
            if isinstance(data, dict):
                data = base64.b64decode(data["data"], validate=True)
            elif isinstance(data, list):  # Java bytes are signed
                data = bytes(byte % 256 for byte in data)
        except (KeyError, ValueError, TypeError):
            return None
        return data if isinstance(data, bytes) and data else None
