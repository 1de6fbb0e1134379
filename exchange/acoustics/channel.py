"""The acoustic broadcast channel: who hears a packet, and when.

Packets that meet: who sends hears nothing meanwhile, and packets that overlap at a receiver are both lost there.

A packet of length L that starts at t is at a receiver in the distance d during [t + d/c, t + d/c + L], and keeps its
sender from hearing during [t, t + L]. Two packets meet at a receiver if these spans overlap. There is no capture: the
nearer one is lost, too. What does not reach a receiver, or is lost there to noise, disturbs nothing there.

How many packets arrive when they are drawn one by one, through the channel as runs use it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from exchange.acoustics import loss
from exchange.acoustics.link import LinkModel, Transmission
from exchange.acoustics.modems import Modem
from exchange.arithmetic import length


class Arrival(NamedTuple):
    """A packet as one receiver hears it, complete at ``time_s``."""

    receiver: int
    time_s: float
    data: bytes


@dataclass(frozen=True, slots=True)
class Blackout:
    """A time in which a node is neither heard nor hears, or in which nothing passes between parts of the fleet.

    Args:
        from_s: a packet that starts at this time, or later,
        until_s: but before this one, is cut off.
        node: whom it befalls; everybody if None.
        between: sets of nodes that hear nothing of each other, in place of ``node``; who is in none of them hears all.
    """

    from_s: float
    until_s: float
    node: int | None = None
    between: tuple[frozenset[int], ...] = ()

    def cut_off(self, sender: int) -> frozenset[int | None]:
        """Nodes that nothing of a sender's reaches while it lasts; with None in it, or the sender, that is all."""
        if not self.between:
            return frozenset((self.node,))
        own = [side for side in self.between if sender in side]
        return frozenset(node for side in self.between if own and side not in own for node in side)


class Channel(Protocol):
    """Carries packets; it knows geometry and loss, never content."""

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Arrivals of ``data``, sent at ``now_s`` in ``slot``, at those who do not lose it.

        Args:
            positions_m: (x east, y north) of every node, shape (n_nodes, 2), metres.
        """
        ...


@dataclass(frozen=True, slots=True)
class BroadcastChannel:
    """One packet at a time in one sea: straight rays, one sound speed, a range, a loss model.

    A packet is lost at a receiver if the draw of ``loss.uniform(seed, trial, slot, sender, receiver)``
    lies below the link's probability, or if sender or receiver is blacked out when the packet starts, or if it comes
    too late or from too far, see ``carries_beyond_range``.

    Args:
        modem: of all nodes.
        link: how likely a packet is lost on each link.
        seed: of the run.
        trial: number of the run, or 0.
        sound_speed_mps: in the sea.
        range_m: the declared range, for which the guard of the slots is made.
        blackouts: times without communication.
        depths_m: of the nodes, for ranges in three dimensions; ranges are those on the chart if it is empty.
        carries_beyond_range: how far a packet carries is left to the link. It is only lost if it is not complete before
            its slot ends, after the time of the longest packet and the guard. Else nothing is heard beyond ``range_m``.
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
    _trial_key: list[int] = field(default_factory=list, init=False, repr=False, compare=False)  # once it is asked for

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Arrivals at all whom it reaches in time, who are not blacked out and do not lose the packet."""
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
            slot_ends_s = now_s + self.modem.packet_s(self.modem.payload_bits) + self.range_m / self.sound_speed_mps
        draws: int | None = None  # nothing is drawn where nothing can be lost
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
                if draws is None:
                    if not self._trial_key:
                        self._trial_key.append(loss.trial_key(self.seed, self.trial))
                    draws = loss.slot_key(self._trial_key[0], slot)
                if loss.link_uniform(draws, sender, receiver) < p_loss:
                    continue
            arrivals.append(Arrival(receiver, time_s, data))
        return arrivals


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


@dataclass(slots=True)
class CachedLinks:
    """Links between vehicles that stay where they are: each is asked once."""

    links: LinkModel
    known: dict[int, float] = field(default_factory=dict)

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """The answer that the links gave for this receiver at first."""
        if receiver not in self.known:
            self.known[receiver] = self.links.p_loss(packet, receiver, range_m)
        return self.known[receiver]


def n_arrived(links: LinkModel, modem: Modem, ranges_m: Sequence[float], n_packets: int, seed: int) -> list[int]:
    """Full packets of one sender that arrive at each of some receivers.

    Args:
        links: whose losses depend on range and size alone.
        modem: of all.
        ranges_m: of the receivers.
        n_packets: that are sent, one in each slot.
        seed: of the draws.
    """
    channel = BroadcastChannel(modem, CachedLinks(links), seed, carries_beyond_range=True)
    positions_m = [(0.0, 0.0), *((range_m, 0.0) for range_m in ranges_m)]
    counts = [0] * len(ranges_m)
    data = bytes(modem.payload_bytes)
    for slot in range(n_packets):
        for arrival in channel.transmit(slot, 0, data, 0.0, positions_m):
            counts[arrival.receiver - 1] += 1
    return counts
