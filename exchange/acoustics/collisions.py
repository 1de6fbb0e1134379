"""Packets that meet: who sends hears nothing meanwhile, and packets that overlap at a receiver are both lost there.

A packet of length L that starts at t is at a receiver in the distance d during [t + d/c, t + d/c + L], and keeps its
sender from hearing during [t, t + L]. Two packets meet at a receiver if these spans overlap. There is no capture: the
nearer one is lost, too. What does not reach a receiver, or is lost there to noise, disturbs nothing there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from exchange.acoustics.channel import Arrival

TOUCH_S = 1e-6
"""Packets that overlap by less only touch: one ends when the other begins."""


@dataclass(eq=False, slots=True)
class Hearing:
    """A packet on its way to one receiver.

    Attributes:
        slot, sender: of the packet.
        arrival: when it is complete, and with what.
        from_s: when its first bit arrives.
        collided: True once another packet is known to meet it.
    """

    slot: int
    sender: int
    arrival: Arrival
    from_s: float
    collided: bool = False


def _meet(from_s: float, until_s: float, other_from_s: float, other_until_s: float) -> bool:
    """True if two spans of time overlap by more than rounding."""
    return from_s < other_until_s - TOUCH_S and other_from_s < until_s - TOUCH_S


class Collisions:
    """Follows the packets that are on their way.

    >>> ahead, behind = Arrival(2, 2.0, b""), Arrival(2, 2.5, b"")
    >>> air = Collisions()
    >>> [one.collided for one in air.send(0, 0, 0.0, 1.0, [ahead])[0]]
    [False]
    >>> hearings, lost = air.send(1, 1, 0.5, 1.5, [behind])
    >>> [(one.sender, one.arrival.receiver) for one in lost]
    [(0, 2), (1, 2)]
    """

    def __init__(self) -> None:
        self._sending: dict[int, tuple[float, float]] = {}
        self._hearings: dict[int, list[Hearing]] = {}
        self._silent_from_s = -math.inf  # nothing is on its way from then on

    def send(
        self, slot: int, sender: int, from_s: float, until_s: float, arrivals: Sequence[Arrival]
    ) -> tuple[list[Hearing], list[Hearing]]:
        """Let a packet set out.

        Args:
            slot: in which it is sent.
            sender: that hears nothing meanwhile.
            from_s: when its first bit is sent.
            until_s: when its last one is.
            arrivals: of the packet, if it met no other.

        Returns:
            Its hearings, and all that are now known to be lost, those of packets before it among them.
        """
        if from_s >= self._silent_from_s:
            self._sending.clear()
            self._hearings.clear()
        self._silent_from_s = max([self._silent_from_s, until_s, *[arrival.time_s for arrival in arrivals]])
        lost = []
        for hearing in self._on_their_way(sender, from_s) if sender in self._hearings else ():
            if not hearing.collided and _meet(hearing.from_s, hearing.arrival.time_s, from_s, until_s):
                hearing.collided = True
                lost.append(hearing)
        self._sending[sender] = from_s, until_s
        hearings = []
        for arrival in arrivals:
            hearing, receiver = Hearing(slot, sender, arrival, arrival.time_s - (until_s - from_s)), arrival.receiver
            if receiver in self._hearings:
                others = self._on_their_way(receiver, from_s)
            else:
                others = self._hearings[receiver] = []
            for other in others:
                if _meet(other.from_s, other.arrival.time_s, hearing.from_s, arrival.time_s):
                    lost += [] if other.collided else [other]
                    other.collided = hearing.collided = True
            own = self._sending.get(receiver)
            if own is not None and _meet(*own, hearing.from_s, arrival.time_s):
                hearing.collided = True
            if hearing.collided:
                lost.append(hearing)
            others.append(hearing)
            hearings.append(hearing)
        return hearings, lost

    def _on_their_way(self, receiver: int, now_s: float) -> list[Hearing]:
        """Packets that a receiver may still hear now, or later."""
        still = [hearing for hearing in self._hearings.get(receiver, ()) if hearing.arrival.time_s > now_s]
        self._hearings[receiver] = still
        return still
