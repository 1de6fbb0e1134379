"""What a driver is, and the time by which it waits.

A driver carries packets, bytes that the manager has packed, and says when each was heard. It may lose, double, delay
and reorder them: the exchange stands that. It never waits for an answer, and a packet that is lost is not its care.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable


class TimedPacket(NamedTuple):
    """A packet, and when the whole of it was heard (s of the mission)."""

    data: bytes
    time_s: float


@runtime_checkable
class Driver(Protocol):
    """Sends and receives the packets of one vehicle.

    A node calls ``send`` in the own slots of its vehicle, ``receive`` all the time between, and ``close`` once, at its
    end. All three are called from one thread.
    """

    def send(self, data: bytes, now_s: float) -> None:
        """Transmit a packet to whoever hears it; returns without waiting for anybody.

        Args:
            data: the packet, not empty.
            now_s: when its slot opened (s of the mission); it may be sent a little later.
        """
        ...

    def receive(self, until_s: float) -> Sequence[TimedPacket]:
        """What has been heard since the last call, in the order in which it came.

        Returns at once if there is something, else as soon as something comes, and with nothing at ``until_s``. A time
        that is past means: do not wait. What was damaged on the way may be given: the manager refuses it.

        Args:
            until_s: time of the mission (s).
        """
        ...

    def close(self) -> None:
        """Let go of the modem; calling it again does nothing."""
        ...


class Pace(Protocol):
    """Says what time of the mission it is."""

    @property
    def now_s(self) -> float:
        """Time of the mission (s), below 0 before it begins."""
        ...

    @property
    def uncertainty_s(self) -> float:
        """By how much that may be wrong (s)."""
        ...


@dataclass(frozen=True)
class AtOnce:
    """No pace: whatever is to happen is due at once."""

    @property
    def now_s(self) -> float:
        """Later than everything."""
        return math.inf

    @property
    def uncertainty_s(self) -> float:
        """None: nobody waits for it."""
        return 0.0


AT_ONCE = AtOnce()


class Paced:
    """Time of the mission by the clock of the machine, in real time or faster.

    Args:
        start_s: when the mission begins, by ``time.monotonic``, which is the same for all processes of a machine.
        speed: seconds of the mission in a second.
    """

    def __init__(self, start_s: float, speed: float = 1.0) -> None:
        self.start_s = start_s
        self.speed = speed

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        return (time.monotonic() - self.start_s) * self.speed

    @property
    def uncertainty_s(self) -> float:
        """By how much that may be wrong (s): the clock of the machine is taken to be right."""
        return 0.0

    def wait_s(self, until_s: float) -> float:
        """How long it is until a time of the mission, in seconds of the machine; 0 if it is past."""
        return max(0.0, (until_s - self.now_s) / self.speed)
