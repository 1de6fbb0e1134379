import os
import select
import threading
import time
import tty
from calendar import timegm

from exchange.drivers import TimedPacket
from missions.nodes import Fix, Frontseat, Reading


class Port:  # serial port with lines of comma-separated fields; no lines once it is closed
    def __init__(self, path):
        self.file, self.rest = os.open(path, os.O_RDWR | os.O_NOCTTY), b""
        tty.setraw(self.file)

    def write(self, *fields):
        if self.file is not None:
            os.write(self.file, ",".join(map(str, fields)).encode() + b"\n")

    def read(self, wait_s=0.0):
        try:
            if self.file is None or not select.select([self.file], [], [], wait_s)[0]:
                return []
            *lines, self.rest = (self.rest + os.read(self.file, 4096)).split(b"\n")
        except OSError:
            self.file, lines = None, []
        return [line.decode(errors="replace").split(",") for line in lines]

    def close(self):
        self.file = None


class Body(Port):
    def guide(self, target_m, speed_mps):
        self.write("GO", *target_m, speed_mps)

    def fix(self):
        fixes = [fields[1:] for fields in self.read() if fields[0] == "NAV"]
        return Fix(*map(float, fixes[-1])) if fixes else None  # x, y, heading, speed, depth, battery


class Clock(Port):
    def __init__(self, path):
        super().__init__(path)
        self.pulse_s, self.newest = 0.0, None
        threading.Thread(target=self.listen, daemon=True).start()  # to time each pulse on its arrival

    def listen(self):
        while self.file is not None:
            for fields in self.read(1.0):
                if fields[0] == "PPS":
                    self.pulse_s = time.monotonic()
                elif fields[0] == "$GPZDA" and time.monotonic() - self.pulse_s < 1.0:
                    utc_s = timegm(time.strptime(" ".join(fields[1:5]), "%H%M%S.00 %d %m %Y"))
                    self.newest = Reading(utc_s, self.pulse_s, 0.01)

    def reading(self):
        return self.newest


class Modem(Port):
    def __init__(self, path, pace):
        super().__init__(path)
        self.pace = pace

    def send(self, data, now_s):
        self.write("AT*SEND", data.hex())

    def receive(self, until_s):
        while True:
            left_s = self.pace.wait_s(until_s)
            received = [bytes.fromhex(fields[1]) for fields in self.read(left_s) if fields[0] == "RECV"]
            if received or left_s <= 0.0 or self.file is None:
                return [TimedPacket(data, max(0.0, self.pace.now_s)) for data in received]


def boat():
    return Frontseat(Body("/dev/ttyS1"), Clock("/dev/ttyS2"), lambda pace: Modem("/dev/ttyUSB0", pace))
