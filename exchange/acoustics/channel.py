"""The acoustic broadcast channel: who hears a packet, and when."""

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
