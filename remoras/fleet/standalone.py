"""Single vehicle with its own event queue, in its own process or hull.

It knows others only by packets; its obstacle sonar sees no vehicle. Its output is a pure function of scenario, seed,
start, and packets received with their times, so a log of these reproduces it (``missions.nodes.logs``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from mesa import Model

from exchange.packets import Reception, Transmission
from exchange.schedule import TdmaSchedule
from remoras.events import Clock, Event, Host, Observer, Priority, listening
from remoras.fleet.vehicle import Vehicle
from remoras.recorder import Recorder

if TYPE_CHECKING:
    from exchange.wire.definitions import Introductions


class Sent(NamedTuple):
    """Packet and start of its slot (s)."""

    time_s: float
    packet: Transmission


class Solo(Model, Host):  # type: ignore[misc]  # Mesa is untyped
    """Single vehicle; ``n_refused`` counts refused packets.

    All is processed before ``horizon_s``; packets arrive then or later. From ``until_s`` it only exchanges outstanding
    items. ``introductions`` are for encrypted packets.
    """

    def __init__(
        self,
        make_vehicle: Callable[[Solo], Vehicle],
        make_anew: Callable[[Solo, Vehicle, bool], Vehicle],
        schedule: TdmaSchedule,
        recorder: Recorder,
        tick_s: float,
        until_s: float,
        introductions: Introductions | None = None,
        observers: Sequence[Observer] = (),
    ) -> None:
        super().__init__(rng=0)  # Mesa's generators are not used: every draw is keyed by its purpose
        self.clock = Clock()
        self._said: list[Sent] = []
        self.horizon_s = 0.0
        self.make_anew = make_anew
        self._schedule = schedule
        self._tick_s, self._until_s, self.last_s = tick_s, until_s, math.nextafter(until_s, -math.inf)
        self._introductions = introductions
        self.recorder = recorder
        self.vehicles = (make_vehicle(self),)
        self.n_refused = 0
        for start in listening(observers, "on_start"):
            start(self)
        self._await_tick(0)
        self._await_frame(1)
        self._await_slot(self.vehicle.data.node)

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self.vehicles[0]

    @property
    def next_s(self) -> float:
        """Time of the next event (s); its own slots never end."""
        return self.clock.next_s

    def hear(self, data: bytes, time_s: float) -> float:
        """Schedule a packet at a time or as soon as possible after it; return when (s)."""
        return self.note(lambda solo: solo.take_in(data), time_s)

    def note(self, event: Event, time_s: float) -> float:
        """Schedule an external event at a time or as soon as possible after it; return when (s)."""
        time_s = max(time_s, self.horizon_s)
        self.clock.schedule(time_s, Priority.ARRIVAL, event)
        return time_s

    def advance(self, until_s: float) -> list[Sent]:
        """Process all events before ``until_s``; return the packets sent."""
        self._said = []
        while (event := self.clock.next_before(until_s, Priority.FAULT)) is not None:
            event(self)
        self.horizon_s = max(self.horizon_s, until_s)
        return self._said

    def _await_slot(self, number: int) -> None:
        self.clock.schedule(self._schedule.start_s(number), Priority.SLOT, lambda solo: solo.transmit(number))

    # Interface for events ------------------------------------------------------------------------

    def _await_tick(self, number: int) -> None:
        self.at(number * self._tick_s, Priority.MOTION, lambda solo: solo.tick(number))

    def tick(self, number: int) -> None:
        """Step the vehicle for a tick."""
        self.vehicle.step(self.now_s, self._tick_s if number else 0.0, (), (number - 1) * self._tick_s)
        self._await_tick(number + 1)

    def _await_frame(self, number: int) -> None:
        self.at(self._schedule.frame_start_s(number), Priority.CONSULTATION, lambda solo: solo.end_frame(number))

    def end_frame(self, number: int) -> None:
        """Let the vehicle consult at the end of a frame."""
        self.vehicle.consult(self.now_s)
        self._await_frame(number + 1)

    def take_in(self, data: bytes) -> None:
        """Let the vehicle receive a packet; count refusals."""
        reception = self._hear(data, self.now_s)
        if reception is not None and reception.fault is not None:
            self.n_refused += 1
            if self._introductions is not None:
                self._introductions.miss(reception.sender)

    def transmit(self, slot: int) -> None:
        """Send in an own slot that opens now."""
        self._await_slot(slot + self._schedule.n_nodes)
        sent = self._introduction(slot, self.now_s) or self._packet(self.now_s)
        if sent is not None and not self.vehicle.condition.is_mute:
            self._said.append(Sent(self.now_s, sent))

    def _packet(self, now_s: float) -> Transmission | None:
        vehicle = self.vehicle
        if now_s < self._until_s:
            return vehicle.speak(now_s)
        return vehicle.radio.speak((), now_s) if vehicle.exchanges else None

    def _introduction(self, slot: int, now_s: float) -> Transmission | None:
        """Return the handshake packet for an own slot; None if another packet may be sent."""
        vehicle = self.vehicle
        if self._introductions is None or not vehicle.exchanges:
            return None
        data = self._introductions.packet(slot)
        if data is None:
            return None
        vehicle.functional.transmitted(8 * len(data))
        return Transmission(vehicle.radio.manager.keep_silent(now_s), data, 8 * len(data), (), 0)

    def _hear(self, data: bytes, now_s: float) -> Reception | None:
        vehicle = self.vehicle
        if vehicle.condition.is_deaf:
            return None
        if self._introductions is not None and vehicle.is_alive and self._introductions.hear(data, now_s):
            return None
        if now_s < self._until_s:
            return vehicle.hear(data, now_s)
        if not vehicle.is_alive:
            return None
        packet = vehicle.radio.hear(data, now_s)
        vehicle.beliefs.note()
        return packet.reception


def just_after(time_s: float) -> float:
    """Return the next larger time: events at ``time_s`` are processed before it."""
    return math.nextafter(time_s, math.inf)
