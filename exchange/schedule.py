"""TDMA schedule: slots, their times and owners."""

from __future__ import annotations

from dataclasses import dataclass, field

from exchange.errors import ConfigurationError
from exchange.packets import Head

FRAMES_TOLD = 4
"""Modulus of the frame number in a packet."""
GRACE_S = 1e-6
"""Rounding tolerance for a packet over the whole range that ends in the next slot."""


@dataclass(frozen=True, slots=True)
class TdmaSchedule:
    """Slots of equal length: node s sends in the slots t with ``t mod n_nodes == s``.

    A slot holds the longest packet (``packet_s``) and a guard (``guard_s``) for its propagation to the farthest
    receiver, so that packets of different slots never collide.

    >>> schedule = TdmaSchedule(n_nodes=4, packet_s=1.106, guard_s=1000.0 / 1500.0)
    >>> round(schedule.slot_s, 3), round(schedule.frame_s, 2), schedule.owner(6)
    (1.773, 7.09, 2)

    Attributes:
        n_nodes: size of the fleet; packet_s, guard_s: of a slot.
    """

    n_nodes: int
    packet_s: float
    guard_s: float
    slot_s: float = field(init=False, repr=False, compare=False)
    """Length of a slot."""
    frame_s: float = field(init=False, repr=False, compare=False)
    """Length of a frame."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "slot_s", self.packet_s + self.guard_s)
        object.__setattr__(self, "frame_s", self.n_nodes * self.slot_s)
        if self.n_nodes < 1 or self.packet_s <= 0.0 or self.guard_s < 0.0:
            raise ConfigurationError(f"a TDMA schedule needs n_nodes >= 1, packet_s > 0 and guard_s >= 0, not {self}")

    def owner(self, slot: int) -> int:
        """Return the node that sends in a slot."""
        return slot % self.n_nodes

    def frame_of(self, slot: int) -> int:
        """Return the frame of a slot."""
        return slot // self.n_nodes

    def frame_start_s(self, frame: int) -> float:
        """Start time of a frame."""
        return self.start_s(frame * self.n_nodes)

    def start_s(self, slot: int) -> float:
        """Start time of a slot."""
        return slot * self.slot_s

    def slot_at(self, now_s: float) -> int:
        """Return the slot that is open at ``now_s``, start inclusive."""
        slot = int(now_s / self.slot_s)
        if now_s >= (slot + 1) * self.slot_s:  # the division may round either way at a boundary
            return slot + 1
        return slot if now_s >= slot * self.slot_s else slot - 1

    def slot_named(self, head: Head, arrival_s: float) -> int:
        """Return the slot that a head names by its frame modulo 4: the nearest to the arrival.

        >>> TdmaSchedule(4, 1.5, 0.5).slot_named(Head(sender=1, epoch=0, frame=2), arrival_s=51.0)
        25
        """
        first, period = head.frame % FRAMES_TOLD * self.n_nodes + head.sender, FRAMES_TOLD * self.n_nodes
        # Half a slot is the middle of the arrivals in a slot, so that early and late ones are tolerated alike.
        lap = round((arrival_s / self.slot_s - first - 0.5) / period)
        return first + max(0, lap) * period

    def may_arrive(self, slot: int, arrival_s: float, tolerance_s: float) -> bool:
        """True if a packet of a slot can be complete at ``arrival_s`` with this clock tolerance.

        The tolerance is limited so that a packet a frame early or late, such as a replay, is refused.
        """
        tolerance_s = min(tolerance_s, (self.frame_s - self.slot_s) / 2.0) + GRACE_S
        start_s = slot * self.slot_s
        return start_s - tolerance_s <= arrival_s <= start_s + self.slot_s + tolerance_s

    def slot_of_arrival(self, now_s: float) -> int:
        """Return the slot of a packet complete at ``now_s``: at a boundary, the earlier one."""
        return self.slot_at(max(0.0, now_s - GRACE_S))
