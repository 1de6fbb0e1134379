"""The driver of the Nanomodem, against two modems of the same serial protocol at pseudo terminals."""

import os
import pty
import re
import select
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from exchange.drivers import Paced
from exchange.drivers.nanomodem import Nanomodem
from exchange.errors import ConfigurationError
from remoras.testing import channels

AIR_S = 0.005
"""A modem's transmission, far shorter here than at sea."""
SENT = re.compile(rb"\$B([0-9]{2})")


class TwoModems:
    """Two modems that hear each other; each has a serial port at which a host speaks."""

    def __init__(self) -> None:
        self.modems, hosts = zip(*(pty.openpty() for _ in range(2)), strict=True)
        for file in (*self.modems, *hosts):
            tty.setraw(file)
        self.ports = [Path(os.ttyname(file)) for file in hosts]
        self._hosts = hosts
        self._given = [b"", b""]
        self.said: list[bytes] = []
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._ends.is_set():
            for file in select.select(self.modems, [], [], 0.01)[0]:
                place = self.modems.index(file)
                self._given[place] += os.read(file, 4096)
                self._speak(place)

    def _speak(self, place: int) -> None:
        while (head := SENT.search(self._given[place])) is not None:
            length = int(head[1])
            data = self._given[place][head.end() : head.end() + length]
            if len(data) < length:
                return
            self._given[place] = self._given[place][head.end() + length :]
            os.write(self.modems[place], b"$B%02d\r\n" % length)
            time.sleep(AIR_S)
            self.said.append(data)
            os.write(self.modems[1 - place], b"#B%03d%02d%b\r\n" % (place, length, data))

    def close(self) -> None:
        self._ends.set()
        self._thread.join()
        for file in (*self.modems, *self._hosts):
            os.close(file)


@pytest.fixture
def modems() -> Iterator[TwoModems]:
    """They end with the test."""
    made = TwoModems()
    yield made
    made.close()


def test_the_driver_conforms_to_its_interface(modems: TwoModems) -> None:
    def make() -> tuple[Nanomodem, Nanomodem, Paced]:
        pace = Paced(time.monotonic())
        one, other = (Nanomodem(port, pace) for port in modems.ports)
        return one, other, pace

    channels.check_driver(make, least_bytes=2)


def test_data_resembling_headers_and_line_noise_are_no_packets(modems: TwoModems) -> None:
    pace = Paced(time.monotonic())
    one, other = (Nanomodem(port, pace) for port in modems.ports)
    os.write(modems.modems[1], b"E\r\n#TO\r\n#B0019")  # an answer, a time-out, half of a head of 64 bytes and more
    os.write(modems.modems[1], b"9")
    tricky = b"#B00305#B00102ab"
    one.send(tricky, 0.0)
    heard = [packet.data for _ in range(3) for packet in other.receive(pace.now_s + 0.2)]
    assert heard == [tricky]
    one.send(bytes(65), 0.0)
    one.send(b"x", 0.0)
    one.close()
    other.close()
    assert modems.said == [tricky]


def test_a_packet_received_byte_by_byte_is_assembled(modems: TwoModems) -> None:
    pace = Paced(time.monotonic())
    modem = Nanomodem(modems.ports[0], pace)
    heard = []
    for byte in b"#B00703a#B\r\n":
        os.write(modems.modems[0], bytes([byte]))
        heard += modem.receive(pace.now_s + 0.02)
    assert [packet.data for packet in heard] == [b"a#B"]
    modem.close()


@pytest.mark.parametrize("port", ["none", "file"])
def test_an_invalid_serial_port_is_named(port: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigurationError, match=r"--serial .*serial port"):
        Nanomodem(tmp_path / port, Paced(0.0))
