"""The driver of UnetStack, against a stand-in that speaks its JSON over TCP on loopback."""

import base64
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from exchange.drivers import Paced
from exchange.drivers.unetstack import DATA, EVERYBODY, PROTOCOL, UnetStack
from exchange.errors import ConfigurationError
from remoras.testing import channels

MTU = 64


class Modems:
    """Modems in one water, each at a port; a frame takes its time, and who transmits meanwhile is refused."""

    def __init__(self, n: int) -> None:
        self.servers = [socket.create_server(("127.0.0.1", 0)) for _ in range(n)]
        self.addresses = [server.getsockname() for server in self.servers]
        self.hosts: list[socket.socket | None] = [None] * n
        self.wanted: list[list[str]] = [[] for _ in range(n)]
        self.said: list[list[dict[str, Any]]] = [[] for _ in range(n)]
        self.physical, self._air_s, self._busy_until_s = "phy", 0.004, [0.0] * n
        for place in range(n):
            threading.Thread(target=self._serve, args=(place,), daemon=True).start()

    def _serve(self, place: int) -> None:
        while True:
            try:
                self.hosts[place], self.wanted[place] = self.servers[place].accept()[0], []
            except OSError:  # switched off
                return
            with suppress(OSError), self.hosts[place].makefile("rb") as lines:  # a host may leave without reading all
                for line in lines:
                    self._take(place, json.loads(line))
            self.hosts[place] = None

    def _take(self, place: int, said: dict[str, Any]) -> None:
        self.said[place].append(said)
        match said.get("action"):
            case "agentForService":
                assert said["service"] == "org.arl.unet.Services.PHYSICAL"
                answer = {"id": said["id"], "inResponseTo": "agentForService"}
                self.tell(place, {**answer, "agentID": self.physical} if self.physical else answer)
            case "wantsMessagesFor":
                self.wanted[place] = said["agentIDs"]
            case "send":
                self._transmit(place, said["message"])

    def _transmit(self, place: int, message: dict[str, Any]) -> None:
        """Every second modem gives its bytes as numbers with a sign, as the protocol allows."""
        asked, now_s = message["data"], time.monotonic()
        assert message["clazz"] == "org.arl.unet.phy.TxFrameReq"
        assert (asked["type"], asked["to"], asked["recipient"]) == (DATA, EVERYBODY, "phy")
        given = asked["data"]
        data = base64.b64decode(given["data"]) if isinstance(given, dict) else bytes(byte % 256 for byte in given)
        is_fit = len(data) <= MTU and now_s >= self._busy_until_s[place]
        reply = {"inReplyTo": asked["msgID"], "sender": "phy", "recipient": asked["sender"], "msgID": "1"}
        clazz = "org.arl.fjage.Message" if is_fit else "org.arl.unet.RefuseRsp"
        self.tell(place, sending(clazz, {**reply, "perf": "AGREE" if is_fit else "REFUSE"}))
        if not is_fit:
            return
        self._busy_until_s[place] = now_s + self._air_s
        signed = [byte - 256 if byte > 127 else byte for byte in data]
        heard = {"msgID": "2", "perf": "INFORM", "sender": "phy", "recipient": "#phy__ntf", "from": place, "to": 0}
        heard |= {"type": DATA, "protocol": asked["protocol"], "rxTime": 1}
        heard["data"] = {"clazz": "[B", "data": base64.b64encode(data).decode()} if place else signed
        told = sending("org.arl.unet.phy.RxFrameNtf", heard)
        threading.Timer(self._air_s, self.tell, (1 - place, told)).start()

    def tell(self, place: int, value: dict[str, Any]) -> None:
        """Say something to a host; a notification to whoever wants those of the physical layer."""
        host = self.hosts[place]
        if host is not None and ("RxFrameNtf" not in json.dumps(value) or "#phy__ntf" in self.wanted[place]):
            with suppress(OSError):
                host.sendall(json.dumps(value).encode() + b"\n")

    def close(self) -> None:
        for open_one in (*self.servers, *(host for host in self.hosts if host is not None)):
            with suppress(OSError):
                open_one.shutdown(socket.SHUT_RDWR)
            open_one.close()


def sending(clazz: str, data: dict[str, Any]) -> dict[str, Any]:
    """A message as the protocol has it."""
    return {"action": "send", "relay": False, "message": {"clazz": clazz, "data": data}}


@pytest.fixture
def modems() -> Iterator[Modems]:
    """They end with the test."""
    made = Modems(2)
    yield made
    made.close()


def test_the_driver_conforms_to_its_interface(modems: Modems) -> None:
    def make() -> tuple[UnetStack, UnetStack, Paced]:
        pace = Paced(time.monotonic())
        one, other = (UnetStack(address, pace) for address in modems.addresses)
        return one, other, pace

    channels.check_driver(make)
    assert {"alive": False} in modems.said[0]


def test_frames_too_long_or_too_early_are_lost(modems: Modems) -> None:
    pace = Paced(time.monotonic())
    one, other = (UnetStack(address, pace) for address in modems.addresses)
    one.send(bytes(MTU + 1), 0.0)
    one.send(b"one", 0.0)
    one.send(b"two", 0.0)  # while the modem is busy
    assert [packet.data for packet in other.receive(pace.now_s + 0.3)] == [b"one"]
    one.close()
    other.close()


def test_invalid_and_foreign_messages_are_skipped_and_requests_answered(modems: Modems) -> None:
    pace = Paced(time.monotonic())
    one = UnetStack(modems.addresses[0], pace)
    one.receive(pace.now_s + 0.05)
    host = modems.hosts[0]
    frame = {"protocol": PROTOCOL, "data": {"clazz": "[B", "data": "*"}}
    for value in (
        sending("org.arl.unet.phy.RxFrameNtf", frame),
        sending("org.arl.unet.phy.RxFrameNtf", {"protocol": PROTOCOL, "data": ["x"]}),
        sending("org.arl.unet.phy.RxFrameNtf", {"protocol": 4, "data": [1]}),
        sending("org.arl.unet.phy.BadFrameNtf", {"protocol": PROTOCOL, "data": [1]}),
        {"message": 3},
        {"action": ["send"], "id": 4},
        {"alive": True},
        {"action": "containsAgent", "id": "5", "agentID": "phy"},
        {"action": "agents", "id": "6"},
    ):
        host.sendall(json.dumps(value).encode() + b"\r\n")
    host.sendall(b'[1]\n{"alive"\n\xff\n\n' + b"[" * 100_000 + b"\n")
    host.sendall(json.dumps(sending("org.arl.unet.phy.RxFrameNtf", {"protocol": PROTOCOL, "data": [-1, 2]})).encode())
    assert one.receive(pace.now_s + 0.1) == []
    host.sendall(b"\n")
    assert [packet.data for packet in one.receive(pace.now_s + 0.3)] == [b"\xff\x02"]
    time.sleep(0.05)
    (name, _) = modems.wanted[0]
    assert {"id": "5", "inResponseTo": "containsAgent", "answer": False} in modems.said[0]
    assert {"id": "6", "inResponseTo": "agents", "agentIDs": [name]} in modems.said[0]
    assert {"alive": True} in modems.said[0]
    modems.close()  # the modem is switched off
    one.send(b"x", 0.0)
    assert one.receive(pace.now_s + 0.1) == []
    one.close()


def test_a_missing_host_or_physical_layer_is_reported_in_one_line(modems: Modems) -> None:
    modems.physical = ""
    with pytest.raises(
        ConfigurationError, match=r"--unet 127\.0\.0\.1:\d+: it names no physical layer; allowed is a modem"
    ):
        UnetStack(modems.addresses[0], Paced(0.0))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(ConfigurationError, match=f"--unet 127.0.0.1:{port}: .*usually port 1100"):
        UnetStack(("127.0.0.1", port), Paced(0.0))
