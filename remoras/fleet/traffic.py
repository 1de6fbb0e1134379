"""Traffic of a fleet: slots by their owners' clocks, and the outcome of each packet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from exchange.channel.channel import Arrival, Channel, Collisions, Hearing
from exchange.channel.modems import Modem
from exchange.packets import Transmission
from exchange.schedule import GRACE_S, TdmaSchedule
from remoras.events import Clock, Event, Priority, ShownTime
from remoras.faults import Fault, hears_throughout
from remoras.recorder import PACKETS, Recorder

if TYPE_CHECKING:
    from remoras.fleet.vehicle import Vehicle

SLOT, SENDER, RECEIVERS, ARRIVALS, COLLIDED = map(
    PACKETS.column_names.index, ("slot", "sender", "receivers", "arrivals_s", "collided_at")
)


def _arrival(hearing: Hearing) -> Event:
    return lambda fleet: None if hearing.collided else fleet.deliver(hearing.arrival)


@dataclass(frozen=True, slots=True)
class Medium:
    """Channel of a fleet, schedule, deviating clocks by node, and faults that block reception."""

    channel: Channel
    modem: Modem
    schedule: TdmaSchedule
    clocks: Mapping[int, ShownTime]
    faults: Sequence[Fault] = ()

    def recorder_of(self, node: int, recorder: Recorder) -> Recorder:
        """Return a recorder for a vehicle's rows that converts them to true time."""
        clock = self.clocks.get(node)
        return recorder if clock is None else clock.recording(recorder)

    def shown_s(self, node: int, true_s: float) -> float:
        """Return the clock reading (s) of a vehicle at a true time (s)."""
        clock = self.clocks.get(node)
        return true_s if clock is None else clock.reads(true_s)

    def true_time_s(self, node: int, shown_s: float) -> float:
        """Return the true time (s) of a clock reading of a vehicle."""
        clock = self.clocks.get(node)
        return shown_s if clock is None else clock.true_time_s(shown_s)


class Traffic:
    """Scheduling of slots and transport of packets; ``heap`` has the events of the fleet."""

    def __init__(self, medium: Medium, heap: Clock[Event]) -> None:
        self._channel = medium.channel
        self._modem = medium.modem
        self._schedule = schedule = medium.schedule
        self._medium = medium
        self._faults = medium.faults
        self._heap = heap
        self._air = Collisions()
        self._next_slots = [*range(schedule.n_nodes)]  # by node
        for node in range(schedule.n_nodes):
            self.await_slot(node)
            clock = medium.clocks.get(node)
            if clock is not None and not clock.is_exact:
                self.await_frame(1, node)
        self.await_frame(1)

    def await_slot(self, node: int) -> None:
        """Schedule the next own slot of a vehicle by its current clock."""
        slot = self._next_slots[node]
        at_s = self._medium.true_time_s(node, self._schedule.start_s(slot))
        # A clock set forward may have passed the start of the slot.
        self._heap.schedule(max(at_s, self._heap.now_s), Priority.SLOT, lambda fleet: fleet.transmit(slot, node))

    def await_frame(self, number: int, node: int | None = None) -> None:
        """Schedule the end of a frame, in true time or by the clock of a node."""
        at_s = self._schedule.frame_start_s(number)
        if node is not None:
            at_s = max(self._medium.true_time_s(node, at_s), self._heap.now_s)
        self._heap.schedule(at_s, Priority.CONSULTATION, lambda fleet: fleet.end_frame(number, node))

    def opened(self, slot: int, owner: Vehicle, now_s: float) -> float | None:
        """Return the owner's clock reading as a slot opens; None if its clock was set meanwhile."""
        node = owner.data.node
        start_s, shown_s = self._schedule.start_s(slot), self._medium.shown_s(node, now_s)
        if self._next_slots[node] != slot or shown_s < start_s - GRACE_S:
            return None
        self._next_slots[node] = slot + self._schedule.n_nodes
        self.await_slot(node)
        return start_s if shown_s <= start_s + GRACE_S else None

    def carry(
        self, slot: int, sender: Vehicle, sent: Transmission, vehicles: Sequence[Vehicle], recorder: Recorder | None
    ) -> None:
        """Send a packet to all vehicles in reach, and write its row if there is a recorder."""
        now_s = self._heap.now_s
        end_s = now_s + self._modem.packet_s(sent.size_bits)
        motions = [vehicle.functional.motion for vehicle in vehicles]
        positions = [(motion.x_m, motion.y_m) for motion in motions]
        arrivals = self._channel.transmit(slot, sender.data.node, sent.data, now_s, positions)
        if self._faults and recorder is not None:
            arrivals = self._heard(sender, arrivals, vehicles)
        hearings, lost = self._air.send(slot, sender.data.node, now_s, end_s, arrivals)
        for hearing in hearings:
            self._heap.schedule(hearing.arrival.time_s, Priority.ARRIVAL, _arrival(hearing))
        if recorder is None:
            return
        others = [(v.data.node, v.name) for v in vehicles if v is not sender and v.functional.is_on]
        receivers, lacking, received_s = fates(arrivals, others)
        recorder.packets.append(
            (
                slot,
                now_s,
                sender.name,
                sent.size_bits,
                len(sent.items),
                sent.n_acks,
                receivers,
                lacking,
                end_s,
                received_s,
                [str(uid) for uid in sent.items],
                [str(uid) for uid in sent.status],
                *sender.radio.signals_of(sent),
                [],
            )
        )
        if lost:
            note_collisions(lost, [vehicle.name for vehicle in vehicles], recorder)

    def _heard(self, sender: Vehicle, arrivals: Sequence[Arrival], vehicles: Sequence[Vehicle]) -> list[Arrival]:
        if sender.condition.is_mute:
            return []
        now_s, names = self._heap.now_s, [vehicle.name for vehicle in vehicles]
        return [
            arrival
            for arrival in arrivals
            if hears_throughout(self._faults, names[arrival.receiver], now_s, arrival.time_s)
        ]


def fates(arrivals: Iterable[Arrival], others: Iterable[tuple[int, str]]) -> tuple[list[str], list[str], list[float]]:
    """Return the receivers of a packet, those that lost it, and the times (s) of reception; ``others``: node, name."""
    arrival_s = {arrival.receiver: arrival.time_s for arrival in arrivals}
    known = list(others)
    receivers = [(name, arrival_s[node]) for node, name in known if node in arrival_s]
    lacking = [name for node, name in known if node not in arrival_s]
    return [name for name, _ in receivers], lacking, [at_s for _, at_s in receivers]


def note_collisions(lost: Iterable[Hearing], names: Sequence[str], recorder: Recorder) -> None:
    """Move receivers that lost a packet to a collision, in rows of packets still under way."""
    for hearing in lost:
        slot, sender, receiver = hearing.slot, names[hearing.sender], names[hearing.arrival.receiver]
        # From the end: packets still under way are among the last.
        row = next(row for row in reversed(recorder.packets) if (row[SLOT], row[SENDER]) == (slot, sender))
        if receiver in row[RECEIVERS]:
            index = row[RECEIVERS].index(receiver)
            del row[RECEIVERS][index], row[ARRIVALS][index]
            row[COLLIDED].append(receiver)
