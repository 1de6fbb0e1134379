"""The traffic of a fleet: when slots open by the clocks of their owners, and what becomes of each packet on its way."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from exchange.acoustics.channel import Arrival, Channel
from exchange.acoustics.collisions import Collisions, Hearing
from exchange.acoustics.modems import Modem
from exchange.packets import Transmission
from exchange.schedule import GRACE_S, TdmaSchedule
from remoras.clock import Clock, Priority
from remoras.faults import Fault, hears_throughout
from remoras.own_clock import OwnClock
from remoras.recorder import PACKETS, Recorder

if TYPE_CHECKING:
    from remoras.fleet import Event
    from remoras.vehicle import Vehicle

__all__ = ["FrameEnds", "Hearing", "SlotOpens", "Traffic"]

SLOT, SENDER, RECEIVERS, ARRIVALS, COLLIDED = map(
    PACKETS.column_names.index, ("slot", "sender", "receivers", "arrivals_s", "collided_at")
)


@dataclass(frozen=True, slots=True)
class SlotOpens:
    """The TDMA slot ``number`` starts, by the clock of its owner."""

    number: int


@dataclass(frozen=True, slots=True)
class FrameEnds:
    """A round of consultation is over; ``number`` counts frames. Of one ``node`` by its clock, if that is off."""

    number: int
    node: int | None = None


class Traffic:
    """Opens slots and carries packets.

    Args:
        channel: carries packets; modem: of all vehicles; schedule: TDMA.
        heap: of the events of the fleet, in true time.
        clocks: of the vehicles, by node.
        faults: by which vehicles do not hear.
    """

    def __init__(
        self,
        channel: Channel,
        modem: Modem,
        schedule: TdmaSchedule,
        heap: Clock[Event],
        clocks: Sequence[OwnClock],
        faults: Sequence[Fault],
    ) -> None:
        self._channel = channel
        self._modem = modem
        self._schedule = schedule
        self._heap = heap
        self._clocks = clocks
        self._faults = faults
        self._air = Collisions()
        self._next_slot = list(range(schedule.n_nodes))
        for node, clock in enumerate(clocks):
            self.await_slot(node)
            if not clock.is_exact:
                self.await_frame(1, node)
        self.await_frame(1)

    def await_slot(self, node: int) -> None:
        """Schedule the next own slot of a vehicle, by its clock as it is set now."""
        slot = self._next_slot[node]
        at_s = self._clocks[node].true_time_s(self._schedule.start_s(slot))
        self._heap.schedule(max(at_s, self._heap.now_s), Priority.SLOT, SlotOpens(slot))

    def await_frame(self, number: int, node: int | None = None) -> None:
        """Schedule the end of a frame, in true time or by the clock of a node."""
        at_s = self._schedule.start_s(number * self._schedule.n_nodes)
        if node is not None:
            at_s = max(self._clocks[node].true_time_s(at_s), self._heap.now_s)
        self._heap.schedule(at_s, Priority.CONSULTATION, FrameEnds(number, node))

    def opened(self, slot: int, now_s: float) -> float | None:
        """What the clock of its owner shows as a slot opens; None if the clock was set since, and the slot is not now.

        Args:
            slot: that was to open now.
            now_s: the true time (s).
        """
        node, start_s = self._schedule.owner(slot), self._schedule.start_s(slot)
        shown_s = self._clocks[node].reads(now_s)
        if slot != self._next_slot[node] or shown_s < start_s - GRACE_S:
            return None
        self._next_slot[node] = slot + self._schedule.n_nodes
        self.await_slot(node)
        return start_s if shown_s <= start_s + GRACE_S else None

    def carry(
        self, slot: int, sender: Vehicle, sent: Transmission, vehicles: Sequence[Vehicle], recorder: Recorder | None
    ) -> None:
        """Send a packet on its way.

        Args:
            slot: in which it is sent.
            sender: of it.
            sent: what it sends.
            vehicles: all of them.
            recorder: takes its row, if it is recorded.
        """
        now_s = self._heap.now_s
        end_s = now_s + self._modem.packet_s(sent.size_bits)
        positions = [vehicle.functional.motion.position_m for vehicle in vehicles]
        arrivals = self._channel.transmit(slot, sender.data.node, sent.data, now_s, positions)
        if self._faults and recorder is not None:
            arrivals = self._heard(sender, arrivals, vehicles)
        hearings, lost = self._air.send(slot, sender.data.node, now_s, end_s, arrivals)
        for hearing in hearings:
            self._heap.schedule(hearing.arrival.time_s, Priority.ARRIVAL, hearing)
        if recorder is None:
            return
        others = [vehicle for vehicle in vehicles if vehicle is not sender and vehicle.is_alive]
        arrival_s = {arrival.receiver: arrival.time_s for arrival in arrivals}
        received = [vehicle for vehicle in others if vehicle.data.node in arrival_s]
        recorder.packets.append(
            (
                slot,
                now_s,
                sender.name,
                sent.size_bits,
                len(sent.items),
                sent.n_acks,
                [vehicle.name for vehicle in received],
                [vehicle.name for vehicle in others if vehicle.data.node not in arrival_s],
                end_s,
                [arrival_s[vehicle.data.node] for vehicle in received],
                [str(uid) for uid in sent.items],
                [str(uid) for uid in sent.status],
                *sender.radio.signals_of(sent),
                [],
            )
        )
        if lost:
            _note_collisions(lost, [vehicle.name for vehicle in vehicles], recorder)

    def _heard(self, sender: Vehicle, arrivals: Sequence[Arrival], vehicles: Sequence[Vehicle]) -> list[Arrival]:
        """Arrivals at those who are able to hear the packet from its start to its end; none from a mute sender."""
        if sender.condition.is_mute:
            return []
        now_s, names = self._heap.now_s, [vehicle.name for vehicle in vehicles]
        return [one for one in arrivals if hears_throughout(self._faults, names[one.receiver], now_s, one.time_s)]


def _note_collisions(lost: Iterable[Hearing], names: Sequence[str], recorder: Recorder) -> None:
    """Take those who lost a packet to another out of its receivers; rows of packets still on their way may change."""
    for one in lost:
        slot, sender, receiver = one.slot, names[one.sender], names[one.arrival.receiver]
        row = next(row for row in reversed(recorder.packets) if (row[SLOT], row[SENDER]) == (slot, sender))
        if receiver in row[RECEIVERS]:
            at = row[RECEIVERS].index(receiver)
            del row[RECEIVERS][at], row[ARRIVALS][at]
            row[COLLIDED].append(receiver)
