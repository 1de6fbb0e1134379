"""Sea as a service: packets of other programs on the channel of the simulator, without sockets or waits.

A station is the modem of one program. It queues packets, sends them in its TDMA slots or, with free access, at once,
and receives nothing meanwhile. The simulator's channel and collisions decide the fate of each packet. Losses are drawn
by slot; with free access the n-th packet of a station counts as sent in its n-th slot. So the losses of a station's
packets depend on seed and order, whatever their times.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import NamedTuple

from exchange.arithmetic import atan2, distance
from exchange.channel.channel import Collisions, Hearing
from missions.nodes.recording import Trace
from missions.runs.assembly import channel_of
from missions.runs.run import Root
from missions.runs.setup import Setup, recorder_of_mission
from remoras.database import VehicleData
from remoras.events import Clock, Priority
from remoras.fleet.traffic import fates, note_collisions
from remoras.work import Point

EVERYBODY = 0
"""Address of broadcasts."""
MOST_QUEUED = 64
"""Packets that a station queues; more are refused."""
PING_BYTES = 8
"""Size of a packet that measures a range, and of its answer."""


class Ranging:
    """Two-way measurement of a range; ``end`` receives it (m), or None without an answer in time."""

    def __init__(self, end: Callable[[float | None], None]) -> None:
        self.ways_s: list[float] = []
        self._end: Callable[[float | None], None] | None = end

    def over(self, range_m: float | None) -> None:
        """End the measurement; a second end has no effect."""
        if self._end is not None:
            end, self._end = self._end, None
            end(range_m)


class Packet(NamedTuple):
    """Packet of a program to a station or to all; ``sent`` is called at the end of its transmission."""

    data: bytes
    to: int = EVERYBODY
    protocol: int = 0
    sent: Callable[[], None] | None = None
    ranging: Ranging | None = None


class Received(NamedTuple):
    """Packet as received: address of its sender, time (s) of complete reception."""

    packet: Packet
    sender: int
    time_s: float


class Station:
    """Modem of a program: ``target_m`` is the reported position, ``counts`` are of packets and refusals."""

    def __init__(self, data: VehicleData, address: int, trace: Trace) -> None:
        self.data, self.address, self.trace = data, address, trace
        self.at_m: Point = data.start_m
        self.target_m: Point = data.start_m
        self.heading_rad = self.energy_j = 0.0
        self.n_started = 0
        self.is_sending = False
        self.queue: deque[Packet] = deque()
        self.listeners: list[Callable[[Received], None]] = []
        self.counts: Counter[str] = Counter()


def addresses_of(names: Sequence[str]) -> list[int]:
    """Return the addresses of stations: their names if all are numbers from 1 to 255, else 1, 2 and so on.

    >>> addresses_of(["21", "29"]), addresses_of(["AUV00", "2"])
    ([21, 29], [1, 2])
    """
    numbers = {int(name) for name in names if name.isascii() and name.isdigit() and 0 < int(name) < 256}
    return [int(name) for name in names] if len(numbers) == len(names) else [*range(1, len(names) + 1)]


class Sea:
    """Stations in a sea, advanced by the caller; ``setup`` is of a scenario of ``missions.nodes.recording``."""

    def __init__(self, setup: Setup, seed: int, traces: Mapping[str, Trace] | None = None) -> None:
        self.setup, self.seed, names = setup, Root(seed), setup.database.names
        self.clock: Clock[Callable[[], None]] = Clock()
        self.recorder = recorder_of_mission(setup.mission, [])
        self.stations = [
            Station(setup.database[name], address, (traces or {}).get(name, ()))
            for name, address in zip(names, addresses_of(names), strict=True)
        ]
        self.by_address = {station.address: station for station in self.stations}
        self._has_slots = setup.scenario.mission.access == "slots"  # type: ignore[attr-defined]
        self._tick_s = setup.scenario.scenario.tick_s
        self._channel = channel_of(setup, self.seed)
        self._air = Collisions()
        self._tick(0)

    @property
    def now_s(self) -> float:
        """Time of the sea (s)."""
        return self.clock.now_s

    def advance(self, until_s: float) -> None:
        """Process all events up to a time (s)."""
        while (event := self.clock.next_before(until_s, Priority.SLOT + 1)) is not None:
            event()
        self.clock.now_s = max(self.clock.now_s, until_s)

    def offer(self, station: Station, packet: Packet) -> str:
        """Queue a packet; return the reason of a refusal, else an empty text."""
        size, most = len(packet.data), self.setup.modem.payload_bytes
        if not 0 < size <= most or len(station.queue) >= MOST_QUEUED:
            station.counts["refused"] += 1
            is_full = 0 < size <= most
            return f"{MOST_QUEUED} packets are waiting" if is_full else f"payload of {size} bytes; allowed: 1 to {most}"
        station.queue.append(packet)
        if not station.is_sending:
            self._await(station)
        return ""

    def measure(self, station: Station, to: int, end: Callable[[float | None], None]) -> str:
        """Measure the range to another station; return the reason of a refusal, else an empty text."""
        return self.offer(station, Packet(bytes(PING_BYTES), to, ranging=Ranging(end)))

    def place(self, station: Station, x_m: float, y_m: float) -> None:
        """Send a station to a position at its transit speed; count one outside the world as refused."""
        if self.setup.scenario.world.holds((x_m, y_m)):
            station.target_m = x_m, y_m
        else:
            station.counts["refused"] += 1

    def finish(self) -> float:
        """Stop sending, complete the last tick, and return its time (s)."""
        end_s = max(1, math.ceil(self.now_s / self._tick_s)) * self._tick_s
        for station in self.stations:
            station.counts["unsent"] += len(station.queue)
            station.queue.clear()
        self.advance(end_s)
        return end_s

    def _await(self, station: Station) -> None:
        node, schedule, start_s = station.data.node, self.setup.schedule, self.now_s
        slot = station.n_started * schedule.n_nodes + node
        if self._has_slots:
            slot = schedule.slot_at(start_s)
            slot += (node - slot) % schedule.n_nodes
            if schedule.start_s(slot) < start_s:
                slot += schedule.n_nodes
            start_s = schedule.start_s(slot)
        station.n_started += 1
        station.is_sending = True
        self.clock.schedule(start_s, Priority.SLOT, lambda: self._transmit(station, slot))

    def _transmit(self, station: Station, slot: int) -> None:
        if not station.queue:  # the service ends
            return
        packet, now_s, node, name = station.queue.popleft(), self.now_s, station.data.node, station.data.name
        size_bits, schedule = 8 * len(packet.data), self.setup.schedule
        end_s = now_s + self.setup.modem.packet_s(size_bits)
        station.energy_j += self.setup.scenario.communication.transmit_power_w * (end_s - now_s)
        positions = [other.at_m for other in self.stations]
        arrivals = self._channel.transmit(slot, node, packet.data, now_s, positions)
        hearings, collided = self._air.send(slot, node, now_s, end_s, arrivals)
        for hearing in hearings:
            receive = partial(self._receive, hearing, packet, end_s)
            self.clock.schedule(hearing.arrival.time_s, Priority.ARRIVAL, receive)
        self.clock.schedule(end_s, Priority.ARRIVAL, lambda: self._sent(station, packet))
        if (ranging := packet.ranging) is not None and not ranging.ways_s:
            wait_s = schedule.frame_s if self._has_slots else schedule.slot_s
            self.clock.schedule(end_s + 2.0 * wait_s, Priority.SLOT, lambda: ranging.over(None))
        names = self.setup.database.names
        heard, lost, heard_s = fates(arrivals, [(to, names[to]) for to in range(len(names)) if to != node])
        self.recorder.packets.append(
            (slot, now_s, name, size_bits, 0, 0, heard, lost, end_s, heard_s, [], [], [], [], [], [])
        )
        note_collisions(collided, names, self.recorder)
        for other in self.stations:
            other.counts["lost"] += other.data.name in lost
        for hearing in collided:
            self.stations[hearing.arrival.receiver].counts["collided"] += 1

    def _sent(self, station: Station, packet: Packet) -> None:
        station.counts["sent"] += 1
        station.is_sending = False
        if packet.sent is not None:
            packet.sent()
        if station.queue:
            self._await(station)

    def _receive(self, hearing: Hearing, packet: Packet, end_s: float) -> None:
        if hearing.collided:
            return
        station, sender = self.stations[hearing.arrival.receiver], self.stations[hearing.sender]
        station.counts["received"] += 1
        if packet.to not in (EVERYBODY, station.address):
            return
        if packet.ranging is None:
            for listener in tuple(station.listeners):
                listener(Received(packet, sender.address, self.now_s))
            return
        ways_s = packet.ranging.ways_s
        ways_s.append(self.now_s - end_s)
        if len(ways_s) == 1:
            self.offer(station, packet._replace(to=sender.address))
        else:
            packet.ranging.over(math.fsum(ways_s) / 2.0 * self.setup.scenario.sound_speed_mps)

    def _tick(self, number: int) -> None:
        now_s, tick_s = number * self._tick_s, self._tick_s
        for station in self.stations:
            target_m = _at(station.trace, now_s) if station.trace else station.target_m
            apart_m = distance(station.at_m, target_m)
            step_m = min(apart_m, station.data.transit_speed_mps * tick_s) if number else 0.0
            if step_m:
                (x_m, y_m), (to_x_m, to_y_m), share = station.at_m, target_m, step_m / apart_m
                station.heading_rad = atan2(to_y_m - y_m, to_x_m - x_m)
                station.at_m = x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)
            moves = *station.at_m, station.heading_rad, step_m / tick_s, station.energy_j, station.data.depth_m
            self.recorder.trajectories.append((now_s, station.data.name, *moves))
        self.clock.schedule((number + 1) * tick_s, Priority.MOTION, lambda: self._tick(number + 1))


def _at(trace: Trace, now_s: float) -> Point:
    later = bisect_right(trace, now_s, key=itemgetter(0))
    if later in (0, len(trace)):
        return trace[min(later, len(trace) - 1)][1]
    (before_s, (x_m, y_m)), (after_s, (to_x_m, to_y_m)) = trace[later - 1 : later + 1]
    share = (now_s - before_s) / (after_s - before_s)
    return x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)
