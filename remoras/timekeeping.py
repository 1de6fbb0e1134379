"""How a vehicle comes to know that its clock differs from its peers', and sets it if it is told to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from exchange.arithmetic import distance, length
from exchange.packets import Reception
from exchange.peering.offsets import Offsets
from exchange.schedule import TdmaSchedule
from remoras.own_clock import CLOCKS, OwnClock
from remoras.recorder import Recorder
from remoras.work import Point

LARGEST_STEP = 0.25
"""A clock is set by at most this share of a slot at once, so that no slot is passed over."""
SMALLEST_STEP_S = 1e-3
"""Less is left, as positions are not known better."""


@dataclass(slots=True)
class Timekeeper:
    """Compares the own clock with those of the peers.

    Attributes:
        names: of all vehicles, by node.
        depths_m: of the vehicles, by node.
        me: own node.
        schedule: TDMA.
        packet_s: time that the modem takes to send so many bits (s).
        sound_speed_mps: in the sea.
        clock: own.
        disciplines: set the clock by what the peers' show.
        recorder: of the fleet, in true time.
    """

    names: Sequence[str]
    depths_m: Sequence[float]
    me: int
    schedule: TdmaSchedule
    packet_s: Callable[[int], float]
    sound_speed_mps: float
    clock: OwnClock
    disciplines: bool
    recorder: Recorder
    offsets: Offsets = field(init=False)

    def __post_init__(self) -> None:
        self.offsets = Offsets(len(self.names))

    def heard(self, reception: Reception, size_bits: int, now_s: float, own_m: Point, peer_m: Point | None) -> None:
        """Learn from when a packet arrived.

        Args:
            reception: of the packet.
            size_bits: of the packet.
            now_s: what the own clock shows.
            own_m: where this vehicle takes itself to be.
            peer_m: where it takes the sender to be, if it knows.
        """
        if peer_m is None or self.schedule.is_aloha:  # nobody knows when it was sent
            return
        peer = reception.sender
        range_m = length(distance(own_m, peer_m), self.depths_m[self.me] - self.depths_m[peer])
        sent_s = now_s - self.packet_s(size_bits) - range_m / self.sound_speed_mps
        self.offsets.note(peer, sent_s - self.schedule.start_s(reception.slot))

    def set_clock(self) -> bool:
        """Set the clock, if it is to be and is off by something that counts. True if it was set."""
        if not self.disciplines:
            return False
        most_s = LARGEST_STEP * self.schedule.slot_s
        by_s = max(-most_s, min(most_s, self.offsets.correction_s()))
        if abs(by_s) < SMALLEST_STEP_S:
            return False
        self.clock.set_by(by_s)
        self.offsets.shift(by_s)
        return True

    def record(self) -> None:
        """Write how far the clock is off, and what is known of it."""
        known = [(name, one) for k, name in enumerate(self.names) if (one := self.offsets.estimate_s(k)) is not None]
        names, leads_s = [name for name, _ in known], [lead_s for _, lead_s in known]
        true_s = self.clock.true_s
        row = true_s, self.names[self.me], self.clock.ahead_s(true_s), names, leads_s
        self.recorder.rows(CLOCKS.name).append(row)
