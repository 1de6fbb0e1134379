"""Acoustic broadcast channel: receivers and reception times of each packet, and collisions.

A packet of duration L sent at t occupies a receiver at distance d during [t + d/c, t + d/c + L], and its sender during
[t, t + L]. Two packets collide at a receiver if these intervals overlap: both are lost, without capture of the nearer
one, and a sender receives nothing while it transmits. A packet out of range or lost to noise does not interfere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from exchange.arithmetic import length
from exchange.channel import loss
from exchange.channel.link import LinkModel, Transmission
from exchange.channel.modems import Modem


class Arrival(NamedTuple):
    """Packet at one receiver, complete at ``time_s``."""

    receiver: int
    time_s: float
    data: bytes


@dataclass(frozen=True, slots=True)
class Blackout:
    """Period without communication of ``node`` (None for all) or ``between`` sets of nodes.

    It covers packets that start at ``from_s`` or later, but before ``until_s`` (s).
    """

    from_s: float
    until_s: float
    node: int | None = None
    between: tuple[frozenset[int], ...] = ()

    def cut_off(self, sender: int) -> frozenset[int | None]:
        """Return the nodes that a sender cannot reach; None or the sender itself in it means all."""
        if not self.between:
            return frozenset((self.node,))
        own = [side for side in self.between if sender in side]
        return frozenset(node for side in self.between if own and side not in own for node in side)


class Channel(Protocol):
    """Carrier of packets by geometry and loss."""

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Return the arrivals of ``data``; ``positions_m`` is (x east, y north) of every node."""


@dataclass(frozen=True, slots=True)
class BroadcastChannel:
    """Broadcast channel: straight rays, one sound speed, a range, a loss model.

    A receiver loses a packet if ``loss.uniform(seed, trial, slot, sender, receiver)`` is below the loss probability of
    the link. Without ``depths_m`` ranges are horizontal. With ``carries_beyond_range``, only the link and the end of
    the slot limit the range.
    """

    modem: Modem
    link: LinkModel
    seed: int
    trial: int = 0
    sound_speed_mps: float = 1500.0
    range_m: float = math.inf
    blackouts: tuple[Blackout, ...] = ()
    depths_m: tuple[float, ...] = ()
    carries_beyond_range: bool = False

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Return the arrivals in range and in time that neither blackout nor loss prevents."""
        cut_off: frozenset[int | None] = frozenset()
        for blackout in self.blackouts:
            if blackout.from_s <= now_s < blackout.until_s:
                cut_off |= blackout.cut_off(sender)
        if None in cut_off or sender in cut_off:
            return []
        x_m, y_m = positions_m[sender]
        packet = Transmission(slot, sender, now_s, 8 * len(data), positions_m)
        sent_s = now_s + self.modem.packet_s(packet.size_bits)
        reach_m, slot_ends_s = self.range_m, math.inf
        if self.carries_beyond_range:
            reach_m = math.inf
            # A later arrival would meet the packet of the next slot; the exchange assumes that slots do not overlap.
            slot_ends_s = now_s + self.modem.packet_s(self.modem.payload_bits) + self.range_m / self.sound_speed_mps
        draws: int | None = None  # no draw without a loss probability: results state whether the seed was used
        arrivals = []
        for receiver, (other_x_m, other_y_m) in enumerate(positions_m):
            if receiver == sender or receiver in cut_off:
                continue
            east_m, north_m = other_x_m - x_m, other_y_m - y_m
            range_m = math.sqrt(east_m * east_m + north_m * north_m)
            if self.depths_m:
                range_m = length(range_m, self.depths_m[receiver] - self.depths_m[sender])
            time_s = sent_s + range_m / self.sound_speed_mps
            if range_m > reach_m or time_s > slot_ends_s:
                continue
            p_loss = self.link.p_loss(packet, receiver, range_m)
            if p_loss > 0.0:
                # The state of the slot serves all receivers.
                if draws is None:
                    draws = loss.slot_key(loss.trial_key(self.seed, self.trial), slot)
                if loss.link_uniform(draws, sender, receiver) < p_loss:
                    continue
            arrivals.append(Arrival(receiver, time_s, data))
        return arrivals


TOUCH_S = 1e-6
"""Overlap (s) below which packets do not collide."""


@dataclass(eq=False, slots=True)
class Hearing:
    """Packet in flight to one receiver, whose first bit arrives at ``from_s``."""

    slot: int
    sender: int
    arrival: Arrival
    from_s: float
    collided: bool = False


def _meet(from_s: float, until_s: float, other_from_s: float, other_until_s: float) -> bool:
    return from_s < other_until_s - TOUCH_S and other_from_s < until_s - TOUCH_S


class Collisions:
    """Tracker of packets in flight and their collisions.

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
        self._silent_from_s = -math.inf  # end of the last packet in flight

    def send(
        self, slot: int, sender: int, from_s: float, until_s: float, arrivals: Sequence[Arrival]
    ) -> tuple[list[Hearing], list[Hearing]]:
        """Add a packet with its possible arrivals; return its receptions, and all receptions now known to be lost."""
        # Nothing sent before is still under way.
        if from_s >= self._silent_from_s:
            self._sending.clear()
            self._hearings.clear()
        self._silent_from_s = max([self._silent_from_s, until_s, *[arrival.time_s for arrival in arrivals]])
        lost = []
        # The own transmission destroys receptions that have begun.
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
            # A node cannot receive while it transmits.
            own = self._sending.get(receiver)
            if own is not None and _meet(*own, hearing.from_s, arrival.time_s):
                hearing.collided = True
            if hearing.collided:
                lost.append(hearing)
            others.append(hearing)
            hearings.append(hearing)
        return hearings, lost

    def _on_their_way(self, receiver: int, now_s: float) -> list[Hearing]:
        still = [hearing for hearing in self._hearings.get(receiver, ()) if hearing.arrival.time_s > now_s]
        self._hearings[receiver] = still
        return still
