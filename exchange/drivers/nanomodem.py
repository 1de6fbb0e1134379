"""A Nanomodem v3 of Newcastle University at a serial port: broadcasts of 2 to 64 bytes.

The host sends ``$B``, the length in two digits and the data; the modem answers ``$B`` and the length as it begins to
transmit. Of others it gives ``#B``, the sender's address in three digits, the length and the data. What else it says
(``E`` for what it cannot do, answers to other commands) is passed over. 9600 baud, 8 bits, no parity, one stop bit.
"""

from __future__ import annotations

import os
import re
import select
import termios
import tty
from contextlib import suppress
from pathlib import Path

from exchange.drivers.seam import Paced, TimedPacket
from exchange.errors import ConfigurationError

LEAST_BYTES, MOST_BYTES = 2, 64
"""Data of one broadcast."""
HEARD = re.compile(rb"#B[0-9]{3}([0-9]{2})")
LONGEST_HEAD = 7
"""Bytes of ``#B``, address and length."""
MOST_AT_ONCE = 4096


class Nanomodem:
    """The modem of one vehicle.

    Args:
        port: device of the serial port, such as ``/dev/ttyUSB0``.
        pace: what time of the mission it is.

    Raises:
        ConfigurationError: the port cannot be opened, or is no serial port.

    Attributes:
        n_unfit: packets that were not sent, since the modem takes none of their length.
    """

    def __init__(self, port: Path, pace: Paced) -> None:
        try:
            self._file: int | None = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise ConfigurationError(f"--serial {port}: {error.strerror}; allowed is a serial port") from None
        try:
            tty.setraw(self._file)
            settings = termios.tcgetattr(self._file)
            settings[4] = settings[5] = termios.B9600
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
        except termios.error:
            self.close()
            raise ConfigurationError(f"--serial {port}: no serial port; allowed is one such as /dev/ttyUSB0") from None
        self._pace = pace
        self._rest = b""
        self.n_unfit = 0

    def send(self, data: bytes, now_s: float) -> None:
        """Let the modem broadcast a packet; one that does not fit is counted, and not sent."""
        if self._file is None:
            return
        if not LEAST_BYTES <= len(data) <= MOST_BYTES:
            self.n_unfit += 1
            return
        with suppress(OSError):  # a modem that is not there is a packet lost
            os.write(self._file, b"$B%02d%b" % (len(data), data))

    def receive(self, until_s: float) -> list[TimedPacket]:
        """The packets that have come; at ``until_s`` none."""
        while self._file is not None and select.select([self._file], [], [], self._pace.wait_s(until_s))[0]:
            try:
                came = os.read(self._file, MOST_AT_ONCE)
            except OSError:
                came = b""
            if not came:  # the port is gone
                self.close()
            self._rest += came
            if heard := self._taken():
                return heard
        return []

    def _taken(self) -> list[TimedPacket]:
        """The whole packets of what has come; data may look like a head, so they are passed over as one."""
        heard: list[TimedPacket] = []
        now_s = max(0.0, self._pace.now_s)
        while (head := HEARD.search(self._rest)) is not None:
            length = int(head[1])
            if not LEAST_BYTES <= length <= MOST_BYTES:
                self._rest = self._rest[head.end() :]
                continue
            data = self._rest[head.end() : head.end() + length]
            if len(data) < length:
                self._rest = self._rest[head.start() :]
                return heard
            heard.append(TimedPacket(data, now_s))
            self._rest = self._rest[head.end() + length :]
        self._rest = self._rest[-(LONGEST_HEAD - 1) :]
        return heard

    def close(self) -> None:
        """Free the port."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
