"""One vehicle without its fleet, as it is in a process, or in a hull, of its own.

It is the vehicle of the fleet, stepped by its own clock: motion ticks, TDMA frames, its own slots, and the packets that
are heard. Of the others it knows what packets say and nothing else: its obstacle sonar sees nobody.

All comes from one queue of events, so what it says is a pure function of its scenario, seed and start, and of the
packets heard with their times. That is why a log of these repeats it (``missions.nodes.logs``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from mesa import Model

from exchange.packets import Reception, Transmission
from exchange.schedule import TdmaSchedule
from remoras.beliefs import Beliefs, Fact
from remoras.events import Clock, Event, Observer, Priority, listening
from remoras.recorder import Recorder
from remoras.vehicle import Vehicle

if TYPE_CHECKING:
    from exchange.wire.definitions import Introductions


@dataclass(frozen=True, slots=True)
class Times:
    """When things happen in the life of a vehicle by itself.

    Attributes:
        tick_s: length of a motion tick.
        begins_s: when it is there; before that it neither moves, speaks nor hears.
        until_s: when it stops to act: from then on it stands still, and its exchange goes on.
    """

    tick_s: float
    begins_s: float
    until_s: float


class Sent(NamedTuple):
    """A packet and when its slot opened (s)."""

    time_s: float
    packet: Transmission


@dataclass(frozen=True, slots=True)
class _Tick:
    number: int

    def act(self, solo: Solo) -> None:
        solo.tick(self.number)


@dataclass(frozen=True, slots=True)
class _SlotOpens:
    number: int

    def act(self, solo: Solo) -> None:
        solo.speak(self.number)


@dataclass(frozen=True, slots=True)
class _FrameEnds:
    number: int

    def act(self, solo: Solo) -> None:
        solo.end_frame(self.number)


@dataclass(frozen=True, slots=True)
class _Arrives:
    data: bytes

    def act(self, solo: Solo) -> None:
        solo.take_in(self.data)


class Solo(Model):  # type: ignore[misc]  # Mesa is untyped
    """A vehicle by itself.

    Args:
        make_vehicle: makes the vehicle of this model.
        make_anew: makes one that begins anew now, of the one that it was; False if its memory is lost.
        schedule: TDMA.
        recorder: takes the rows of this vehicle.
        times: when it acts.
        introductions: of the vehicle, where packets are encrypted.
        observers: of the features that are on, and of the faults that befall it.

    Attributes:
        n_refused: packets that were heard and not taken.
    """

    def __init__(
        self,
        make_vehicle: Callable[[Solo], Vehicle],
        make_anew: Callable[[Solo, Vehicle, bool], Vehicle],
        schedule: TdmaSchedule,
        recorder: Recorder,
        times: Times,
        introductions: Introductions | None = None,
        observers: Sequence[Observer] = (),
    ) -> None:
        super().__init__(rng=0)  # Mesa's generators are not used: every draw is keyed by its purpose
        self._clock: Clock[Event[Solo]] = Clock()
        self._said: list[Sent] = []
        self._horizon_s = 0.0
        self._make_anew = make_anew
        self._schedule = schedule
        self._times = times
        self._introductions = introductions
        self.recorder = recorder
        self.vehicle = make_vehicle(self)
        self.n_refused = 0
        for start in listening(observers, "on_start"):
            start(self)
        self.at(0.0, Priority.MOTION, _Tick(0))
        self.at(schedule.frame_s, Priority.CONSULTATION, _FrameEnds(1))
        self.await_slot(self.vehicle.data.node)

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        return self._clock.now_s

    @property
    def horizon_s(self) -> float:
        """All that happens before this time (s) is over: a packet is heard then, or later."""
        return self._horizon_s

    @property
    def next_s(self) -> float:
        """When something happens next (s); its own slots never end."""
        return self._clock.next_s

    def hear(self, data: bytes, time_s: float) -> float:
        """Let a packet be heard, at a time or as soon after it as can be; returns when that is (s)."""
        return self.note(_Arrives(data), time_s)

    def note(self, event: Event[Solo], time_s: float) -> float:
        """Let something come from outside, at a time or as soon after it as can be; returns when that is (s)."""
        time_s = max(time_s, self._horizon_s)
        self._clock.schedule(time_s, Priority.ARRIVAL, event)
        return time_s

    def advance(self, until_s: float) -> list[Sent]:
        """Do all that is due before ``until_s``; returns what was said meanwhile."""
        self._said = []
        while (event := self._clock.next_before(until_s, Priority.FAULT)) is not None:
            event.act(self)
        self._horizon_s = max(self._horizon_s, until_s)
        return self._said

    def await_slot(self, node: int) -> None:
        """Schedule the own slot with that number."""
        self._clock.schedule(self._schedule.start_s(node), Priority.SLOT, _SlotOpens(node))

    # What events ask for -------------------------------------------------------------------------

    @property
    def vehicles(self) -> tuple[Vehicle, ...]:
        """The vehicle."""
        return (self.vehicle,)

    @property
    def names(self) -> tuple[str, ...]:
        """The name of the vehicle."""
        return (self.vehicle.name,)

    def at(self, time_s: float, priority: Priority, event: Event[Solo]) -> None:
        """Let something happen at a time (s), unless the vehicle has stopped to act by then."""
        if time_s < self._times.until_s:
            self._clock.schedule(time_s, priority, event)

    def named(self, vehicle: str) -> Vehicle:
        """The vehicle, whose name is given."""
        assert vehicle == self.vehicle.name
        return self.vehicle

    def shown_s(self, vehicle: Vehicle) -> float:
        """What its clock shows now (s): in a process of its own that of its hull is right."""
        return self.now_s

    def let_say(self, vehicle: str, facts: Callable[[Beliefs], Sequence[Fact]]) -> bool:
        """Let the vehicle conclude and tell facts now; False, and nothing is said, if it is not alive."""
        speaker = self.named(vehicle)
        if speaker.is_alive:
            speaker.conclude(facts(speaker.beliefs), self.now_s)
        return speaker.is_alive

    def restart(self, before: Vehicle, remembers: bool) -> Vehicle:
        """The vehicle that begins anew and takes the place of what it was before; False if its memory is lost."""
        self.vehicle = self._make_anew(self, before, remembers)
        before.remove()
        return self.vehicle

    def tick(self, number: int) -> None:
        """Let the vehicle move for a tick."""
        tick_s = self._times.tick_s
        self.vehicle.step(self.now_s, tick_s if number else 0.0, (), (number - 1) * tick_s)
        self.at((number + 1) * self._times.tick_s, Priority.MOTION, _Tick(number + 1))

    def end_frame(self, frame: int) -> None:
        """Let the vehicle consult at the end of a frame."""
        self.vehicle.consult(self.now_s)
        self.at(self._schedule.frame_start_s(frame + 1), Priority.CONSULTATION, _FrameEnds(frame + 1))

    def take_in(self, data: bytes) -> None:
        """Let the vehicle hear a packet."""
        reception = self._hear(data, self.now_s)
        if reception is not None and reception.fault is not None:
            self.n_refused += 1
            if self._introductions is not None:
                self._introductions.miss(reception.sender)

    def speak(self, slot: int) -> None:
        """Let the vehicle speak in an own slot that opens now."""
        self.await_slot(slot + self._schedule.n_nodes)
        sent = self._introduction(slot, self.now_s) or self._packet(self.now_s)
        if sent is not None and not self.vehicle.condition.is_mute:
            self._said.append(Sent(self.now_s, sent))

    def _packet(self, now_s: float) -> Transmission | None:
        """What is said now; a vehicle that has stopped says what is still open."""
        vehicle = self.vehicle
        if now_s < self._times.until_s:
            return vehicle.speak(now_s)
        if vehicle.is_alive and vehicle.radio.communicates and not vehicle.social.is_silent:
            return vehicle.radio.speak((), now_s)
        return None

    def _introduction(self, slot: int, now_s: float) -> Transmission | None:
        """What the vehicle introduces itself by in an own slot that opens now; None if another packet may go."""
        vehicle = self.vehicle
        if self._introductions is None or not vehicle.is_alive or not vehicle.radio.communicates:
            return None
        if vehicle.social.is_silent:
            return None
        data = self._introductions.packet(slot)
        if data is None:
            return None
        vehicle.functional.transmitted(8 * len(data))
        return Transmission(vehicle.radio.manager.keep_silent(now_s), data, 8 * len(data), (), 0)

    def _hear(self, data: bytes, now_s: float) -> Reception | None:
        """What a packet brings; a vehicle that has stopped only takes it in."""
        vehicle = self.vehicle
        if vehicle.condition.is_deaf:
            return None
        if self._introductions is not None and vehicle.is_alive and self._introductions.hear(data, now_s):
            return None
        if now_s < self._times.until_s:
            return vehicle.hear(data, now_s)
        if not vehicle.is_alive:
            return None
        heard = vehicle.radio.hear(data, now_s)
        vehicle.beliefs.note()
        return heard.reception


def just_after(time_s: float) -> float:
    """The least time later than ``time_s``: what happens then is over when a vehicle has advanced to it."""
    return math.nextafter(time_s, math.inf)
