"""Driver for the Nanomodem v3 of Newcastle University at a serial port.

It broadcasts 2 to 64 bytes. The host sends ``$B``, the length in two digits and the data; the modem confirms with
``$B`` and the length when it starts to transmit. It reports received broadcasts as ``#B``, sender address in three
digits, length and data. The driver ignores other output, such as ``E`` for errors. 9600 baud, 8N1.
"""

from __future__ import annotations

import os
import re
import select
import termios
import tty
from contextlib import suppress
from pathlib import Path

from exchange.drivers.driver import Paced, TimedPacket
from exchange.errors import ConfigurationError

LEAST_BYTES, MOST_BYTES = 2, 64
"""Limits of the data in one broadcast."""
HEARD = re.compile(rb"#B[0-9]{3}([0-9]{2})")
LONGEST_HEAD = 7
"""Size of ``#B``, address and length (bytes)."""
MOST_AT_ONCE = 4096


class Nanomodem:
    """Modem of one vehicle at a serial port such as ``/dev/ttyUSB0``.

    Raises ConfigurationError for an unusable port.
    """

    def __init__(self, port: Path, pace: Paced) -> None:
        try:
            self._file: int | None = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise ConfigurationError(f"--serial {port}: {error.strerror}; allowed is a serial port") from None
        try:
            # Raw: the line discipline would change or swallow control bytes in the data.
            tty.setraw(self._file)
            settings = termios.tcgetattr(self._file)
            settings[4] = settings[5] = termios.B9600
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
        except termios.error:
            self.close()
            raise ConfigurationError(f"--serial {port}: no serial port; allowed is one such as /dev/ttyUSB0") from None
        self._pace = pace
        self._rest = b""

    def send(self, data: bytes, now_s: float) -> None:
        """Broadcast a packet; drop one of invalid length."""
        if self._file is None or not LEAST_BYTES <= len(data) <= MOST_BYTES:
            return
        with suppress(OSError):  # without the modem the packet is lost
            os.write(self._file, b"$B%02d%b" % (len(data), data))

    def receive(self, until_s: float) -> list[TimedPacket]:
        """Return the received packets; wait until ``until_s`` for the first."""
        while self._file is not None and select.select([self._file], [], [], self._pace.wait_s(until_s))[0]:
            try:
                came = os.read(self._file, MOST_AT_ONCE)
            except OSError:
                came = b""
            if not came:  # port removed
                self.close()
            self._rest += came
            if packets := self._taken():
                return packets
        return []

    def _taken(self) -> list[TimedPacket]:
        packets: list[TimedPacket] = []
        now_s = max(0.0, self._pace.now_s)
        # Packet by packet: data that looks like a head is skipped with its packet.
        while (head := HEARD.search(self._rest)) is not None:
            length = int(head[1])
            if not LEAST_BYTES <= length <= MOST_BYTES:
                self._rest = self._rest[head.end() :]
                continue
            data = self._rest[head.end() : head.end() + length]
            if len(data) < length:
                self._rest = self._rest[head.start() :]
                return packets
            packets.append(TimedPacket(data, now_s))
            self._rest = self._rest[head.end() + length :]
        # An incomplete head may be at the end; all else is other output.
        self._rest = self._rest[-(LONGEST_HEAD - 1) :]
        return packets

    def close(self) -> None:
        """Close the port."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
