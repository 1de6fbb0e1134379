import select

from exchange.drivers import TimedPacket


class LineModem:
    """Packets as lines over a stream with ``fileno``, ``recv`` and ``sendall``.

    Args:
        stream: a socket, or a serial port with these methods.
        pace: clock of the mission time.
    """

    def __init__(self, stream, pace):
        self._stream, self._pace, self._rest, self._is_open = stream, pace, b"", True

    def send(self, data, now_s):
        if self._is_open:
            self._stream.sendall(data.hex().encode() + b"\n")

    def receive(self, until_s):
        while self._is_open and select.select([self._stream], [], [], self._pace.wait_s(until_s))[0]:
            data = self._stream.recv(4096)
            if not data:  # the other end has closed
                self._is_open = False
            *lines, self._rest = (self._rest + data).split(b"\n")
            if packets := [packet for line in lines if (packet := self._packet(line)) is not None]:
                return packets
        return []

    def _packet(self, line):
        try:
            return TimedPacket(bytes.fromhex(line.decode()), max(0.0, self._pace.now_s))
        except ValueError:  # noise on the line
            return None

    def close(self):
        self._is_open = False
        self._stream.close()
