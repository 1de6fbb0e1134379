import os
import select
import threading
import time
import tty
from calendar import timegm

from exchange.drivers import TimedPacket
from missions.nodes import Fix, Frontseat, Reading


class Lines:  # of words, at a serial port; empty once it is closed
    def __init__(self, port):
        self.file, self.rest = os.open(port, os.O_RDWR | os.O_NOCTTY), b""
        tty.setraw(self.file)

    def say(self, *words):
        if self.file is not None:
            os.write(self.file, ",".join(map(str, words)).encode() + b"\n")

    def heard(self, wait_s=0.0):
        try:
            if self.file is None or not select.select([self.file], [], [], wait_s)[0]:
                return []
            *lines, self.rest = (self.rest + os.read(self.file, 4096)).split(b"\n")
        except OSError:
            self.file, lines = None, []
        return [line.decode(errors="replace").split(",") for line in lines]

    def close(self):
        self.file = None


class Body(Lines):
    def guide(self, target_m, speed_mps):
        self.say("GO", *target_m, speed_mps)

    def fix(self):
        said = [words[1:] for words in self.heard() if words[0] == "NAV"]
        return Fix(*map(float, said[-1])) if said else None  # x, y, heading, speed, depth, battery


class Clock(Lines):
    def __init__(self, port):
        super().__init__(port)
        self.pulse_s, self.found = 0.0, None
        threading.Thread(target=self.listen, daemon=True).start()  # so that a pulse is noted when it comes

    def listen(self):
        while self.file is not None:
            for words in self.heard(1.0):
                if words[0] == "PPS":
                    self.pulse_s = time.monotonic()
                elif words[0] == "$GPZDA" and time.monotonic() - self.pulse_s < 1.0:
                    utc_s = timegm(time.strptime(" ".join(words[1:5]), "%H%M%S.00 %d %m %Y"))
                    self.found = Reading(utc_s, self.pulse_s, 0.01)

    def reading(self):
        return self.found


class Modem(Lines):
    def __init__(self, port, pace):
        super().__init__(port)
        self.pace = pace

    def send(self, data, now_s):
        self.say("AT*SEND", data.hex())

    def receive(self, until_s):
        while True:
            left_s = self.pace.wait_s(until_s)
            heard = [bytes.fromhex(words[1]) for words in self.heard(left_s) if words[0] == "RECV"]
            if heard or left_s <= 0.0 or self.file is None:
                return [TimedPacket(data, max(0.0, self.pace.now_s)) for data in heard]


def boat():
    return Frontseat(Body("/dev/ttyS1"), Clock("/dev/ttyS2"), lambda pace: Modem("/dev/ttyUSB0", pace))
