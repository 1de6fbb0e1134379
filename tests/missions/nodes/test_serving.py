"""Programs of others in a served sea, over UDP and the UnetStack API on loopback; counts at both ends."""

import json
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

import pytest

from exchange.drivers import Paced
from exchange.errors import ConfigurationError
from missions.nodes import serving
from missions.nodes.recording import of_network, of_scenario
from missions.nodes.sea import Sea
from missions.nodes.serving import Ports
from missions.runs.setup import Setup, resolved

HOST = "127.0.0.1"
EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
FAST = "modem.fast={payload_bytes=64,rate_bps=1e6,range_m=2000.0}"
"""Modem by which tests are short: a packet takes half a millisecond."""
PATIENCE_S = 10.0


@cache
def setup(*overrides: str) -> Setup:
    fast = [("--set", text) for text in (FAST, "communication.modem=fast", *overrides)]
    return resolved(of_scenario("mapping-rendezvous", "free", fast))


@cache
def measured() -> Setup:
    fast = [("--set", text) for text in (FAST, "communication.modem=fast")]
    return resolved(of_network("mission-2012", "free", [], fast))


@contextmanager
def served(setup: Setup, seed: int = 1, token: bytes = b"", port: int = 0) -> Iterator[Ports]:
    """Ports of a sea in a thread, at free numbers or from ``port`` on."""
    ports = Ports(Sea(setup, seed), Paced(time.monotonic()), (HOST, port), {}, token)
    thread = threading.Thread(target=ports.run, args=(1e6,))
    thread.start()
    try:
        yield ports
    finally:
        ports.stop()
        thread.join(PATIENCE_S)
        ports.close()
        assert not thread.is_alive()


def program(ports: Ports, station: str) -> socket.socket:
    """A UDP socket of a program that has introduced itself."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.connect((HOST, ports.numbers[station]))
    made.settimeout(PATIENCE_S)
    made.send(b"")
    return made


def connected(ports: Ports, station: str) -> socket.socket:
    made = socket.create_connection((HOST, ports.numbers[station]), PATIENCE_S)
    made.settimeout(PATIENCE_S)
    return made


def until(what, patience_s: float = PATIENCE_S) -> None:
    end_s = time.monotonic() + patience_s
    while not what() and time.monotonic() < end_s:
        time.sleep(0.01)
    assert what()


def counted(ports: Ports, key: str) -> int:
    return sum(station.counts[key] for station in ports.sea.stations)


def drained(made: socket.socket) -> list[bytes]:
    made.setblocking(False)
    packets = []
    with suppress(BlockingIOError):
        while True:
            packets.append(made.recv(100))
    return packets


def test_programs_receive_what_is_recorded_within_milliseconds_of_the_model():
    with served(setup("channel.per=0.3"), 5) as ports:
        names = list(ports.numbers)
        programs = {name: program(ports, name) for name in names}
        time.sleep(0.1)
        sent_s = []
        for number in range(60):
            sent_s.append(time.monotonic())
            programs[names[number % 4]].send(b"%02d" % number)
            time.sleep(0.005)
        until(lambda: counted(ports, "sent") == 60)
        time.sleep(0.2)
        start_s = ports.pace.start_s
        received = {name: drained(made) for name, made in programs.items()}
        for made in programs.values():
            made.close()
    rows = ports.sea.recorder.packets
    assert len(rows) == 60
    assert {name: len(packets) for name, packets in received.items()} == {
        name: sum(name in row[6] for row in rows) for name in names
    }
    assert sum(len(row[7]) for row in rows) > 0
    # The median, since the machine may be busy.
    delays_s = sorted(row[1] + start_s - at_s for row, at_s in zip(rows, sent_s, strict=True))
    assert delays_s[30] < 0.005


def test_two_programs_exchange_data_through_a_measured_sea():
    with served(measured(), 3) as ports:
        one, other = program(ports, "21"), program(ports, "29")
        time.sleep(0.05)
        for number in range(30):
            one.send(b"%02d" % number)
            time.sleep(0.01)
        until(lambda: counted(ports, "sent") == 30)
        time.sleep(0.5)  # 366 m of water
        heard = drained(other)
        one.close()
        other.close()
    recorded = [b"%02d" % number for number, row in enumerate(ports.sea.recorder.packets) if "29" in row[6]]
    assert heard == recorded
    assert 10 < len(heard) < 30


def test_unmodified_mavlink_programs_count_the_losses_of_the_sea():
    mavutil = pytest.importorskip("pymavlink.mavutil")
    heartbeat = mavutil.mavlink.MAV_TYPE_SUBMARINE, mavutil.mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0
    with served(measured(), 3) as ports:
        one, other = (mavutil.mavlink_connection(f"udpout:{HOST}:{ports.numbers[name]}") for name in ("21", "29"))
        other.mav.heartbeat_send(*heartbeat)
        until(lambda: counted(ports, "sent") == 1)
        time.sleep(0.5)  # 366 m of water
        for _ in range(30):
            one.mav.heartbeat_send(*heartbeat)
            time.sleep(0.01)
        until(lambda: counted(ports, "sent") == 31)
        time.sleep(0.5)
        numbers = []
        while (message := other.recv_match(type="HEARTBEAT")) is not None:
            numbers.append(message.get_seq())
        one.close()
        other.close()
    recorded = ["29" in row[6] for row in ports.sea.recorder.packets[1:]]
    assert numbers == [number for number, is_received in enumerate(recorded) if is_received]
    assert 10 < len(numbers) < 30
    # Its own count, from the gaps of sequence numbers: none is known before the first message and after the last.
    assert other.mav_loss == numbers[-1] - numbers[0] + 1 - len(numbers)


def test_an_unmodified_unetpy_sends_receives_ranges_and_asks():
    unetpy = pytest.importorskip("unetpy")
    with served(setup(), 1) as ports:
        one = unetpy.UnetSocket(HOST, ports.numbers["ASV00"])
        other = unetpy.UnetSocket(HOST, ports.numbers["AUV01"])
        try:
            assert (one.getLocalAddress(), other.getLocalAddress()) == (1, 3)
            assert one.host("AUV01") == 3
            assert one.agentForService(unetpy.Services.TRANSPORT) is None
            phy = one.agentForService(unetpy.Services.PHYSICAL)
            assert (phy.MTU, phy.propagationSpeed, phy.nothing) == (64, 1500.0, None)
            other.setTimeout(5000)
            assert one.send(b"to one \xff", to=3, protocol=unetpy.Protocol.USER)
            heard = other.receive()
            assert (heard.from_, heard.to, heard.protocol) == (1, 3, 32)
            assert bytes(byte % 256 for byte in heard.data) == b"to one \xff"
            one.setSendMode(unetpy.UnetSocket.BLOCKING)
            assert one.send("to all", to=0)
            assert bytes(other.receive().data) == b"to all"
            assert one.send(bytes(65), to=3) is False
            one.setReliability(True)
            assert one.send(b"surely", to=3) is False
            ranging = one.agentForService(unetpy.Services.RANGING)
            assert ranging.request(unetpy.RangeReq(to=3)).perf == unetpy.Performative.AGREE
            found = one.getGateway().receive(unetpy.RangeNtf, 5000)
            assert found.range == pytest.approx(10.0)  # both vehicles are at their starts
            assert ranging.request(unetpy.RangeReq(to=99)).perf == unetpy.Performative.REFUSE
            assert one.getGateway().request(unetpy.CapabilityReq(recipient=phy)).perf.name == "NOT_UNDERSTOOD"
            node = one.agent("node")
            node.location = [5.0, 0.0, 0.0]
            until(lambda: ports.sea.stations[0].at_m == (5.0, 0.0))
            assert node.location[:2] == [5.0, 0.0]
        finally:
            one.close()
            other.close()
        until(lambda: not any(station.listeners[1:] for station in ports.sea.stations))


def test_bad_frames_floods_and_half_open_connections_do_not_disturb_others(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(serving, "GREETING_S", 0.3)
    with served(setup(), 1) as ports:
        one, other, flooder = (program(ports, name) for name in ("ASV00", "AUV00", "AUV02"))
        silent = [connected(ports, "AUV01") for _ in range(serving.MOST_CONNECTIONS)]
        until(lambda: ports.sea.stations[2].listeners[serving.MOST_CONNECTIONS :])
        crowded = connected(ports, "AUV01")
        until(lambda: counted(ports, "crowded") == 1)
        assert crowded.recv(1) == b""
        until(lambda: counted(ports, "half-open") == serving.MOST_CONNECTIONS)
        wild = connected(ports, "AUV02")
        wild.sendall(b'{"action": "agents", "id": "1"}\n')
        assert json.loads(wild.recv(1000))["agentIDs"] == ["node", "phy", "ranging"]
        bad = (b"noise\n", b"[1]\n", b'{"action": 3}\n', b'{"action": "send", "message": {"clazz": "x", "data": 4}}\n')
        wild.sendall(b"".join(bad) * 3)
        until(lambda: wild.send(b"\n"))
        stranger = program(ports, "ASV00")
        stranger.send(b"not of this program")
        for _ in range(500):
            flooder.send(bytes(65))
        heard = []
        for number in range(20):
            one.send(b"%02d" % number)
            heard.append(other.recv(100))
        assert heard == [b"%02d" % number for number in range(20)]
        until(lambda: counted(ports, "strangers") == 2)
        wild.sendall(b"".join(bad) * 3)
        with suppress(ConnectionError):
            while wild.recv(1000):
                pass
        until(lambda: counted(ports, "bad") > serving.MOST_BAD)
        for made in (one, other, flooder, stranger, wild, crowded, *silent):
            made.close()
    assert counted(ports, "refused") > 0
    assert counted(ports, "sent") == 20


def test_a_program_that_reads_nothing_is_cut_off(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(serving, "MOST_UNREAD", 1 << 12)
    with served(setup(), 1) as ports:
        deaf, one = connected(ports, "AUV01"), program(ports, "AUV00")
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 10)
        query = json.dumps({"action": "services", "id": "x" * 900}).encode() + b"\n"
        with suppress(OSError):
            for _ in range(20_000):
                deaf.send(query)
                if counted(ports, "unread"):
                    break
        until(lambda: counted(ports, "unread") == 1)
        one.send(b"still here")
        until(lambda: counted(ports, "sent") == 1)
        deaf.close()
        one.close()


def test_with_a_token_only_programs_that_know_it_are_served():
    with served(setup(), 1, b"00" * 16) as ports:
        stranger, knows = program(ports, "ASV00"), program(ports, "AUV00")
        stranger.send(b"00" * 15)
        knows.send(b"00" * 16)
        until(lambda: counted(ports, "strangers") == 3)
        knows.send(b"served")
        until(lambda: counted(ports, "sent") == 1)
        with connected(ports, "AUV01") as refused:
            refused.sendall(b'{"action": "agents", "id": "1"}\n')
            assert refused.recv(1000) == b""
        with connected(ports, "AUV01") as admitted:
            admitted.sendall(b"00" * 16 + b'\n{"action": "agents", "id": "1"}\n')
            assert b"ranging" in admitted.recv(1000)
        stranger.close()
        knows.close()
    assert counted(ports, "sent") == 1


def started(name: str, *arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def test_the_examples_exchange_data_through_a_measured_sea():
    with served(measured(), 3) as ports:
        shore = started("shore.py", ports.numbers["29"], PATIENCE_S)
        try:
            time.sleep(1.0)  # it may start later: its first answers are then missing
            said, _ = started("buoy.py", ports.numbers["21"], 1.0).communicate(timeout=60.0)
        finally:
            shore.kill()
    answers = sum("21" in row[6] for row in ports.sea.recorder.packets if row[2] == "29")
    assert len(said.splitlines()) == 10
    assert said.count("received sample") == answers
    assert 0 < answers < 10


def test_the_example_of_unetpy_exchanges_data_through_a_measured_sea():
    """It takes stations 21 and 29 at ports that are four apart."""
    pytest.importorskip("unetpy")
    for first in range(47_600, 47_700, 5):  # free ones
        with suppress(ConfigurationError), served(measured(), 3, port=first) as ports:
            said, _ = started("unet_pair.py", ports.numbers["21"]).communicate(timeout=60.0)
            break
    lines = said.splitlines()
    assert lines[0] == "MTU 64"
    received = {row[0] for row in ports.sea.recorder.packets if row[2] == "21" and "29" in row[6]}
    assert lines[1:11] == [f"sample {n}" if 5 * n in received else f"sample {n} lost" for n in range(10)]
    assert lines[11] in ("365.9 m", "no answer")  # hypot(199, 307) m
