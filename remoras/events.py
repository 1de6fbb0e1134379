"""Event queue of a run, and observers that take part in the run.

Events at equal times are ordered by lower priority number, then by insertion, so runs are identical in every version of
Mesa and Python. An event is a function of its host, as a callback in SimPy: a new kind needs no change of the core.
Each active feature, and the faults of a run, is an ``Observer``; only overridden methods are called.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from exchange.channel.channel import Channel
    from exchange.manager.manager import OptionalPart
    from exchange.packets import Reception
    from remoras.beliefs import Beliefs, Fact
    from remoras.fleet.radio import RenewedNeeds
    from remoras.fleet.vehicle import Vehicle
    from remoras.motion.separation import Separation
    from remoras.organisation.needs import GroupNeeds
    from remoras.recorder import Recorder
    from worldmodel import NeedsIndex, WorldModel


E = TypeVar("E")


class Priority(IntEnum):
    """Order of events at the same time: faults, reception, motion, consultation, slots."""

    FAULT = 0
    ARRIVAL = 1
    MOTION = 2
    CONSULTATION = 3
    SLOT = 4


class ShownTime(Protocol):
    """Clock of a vehicle that may deviate."""

    @property
    def is_exact(self) -> bool:
        """True if it always shows the true time."""

    def reads(self, true_s: float) -> float:
        """Return its reading (s) at a true time (s)."""

    def true_time_s(self, shown_s: float) -> float:
        """Return the true time (s) of a reading."""

    def set_by(self, by_s: float) -> None:
        """Advance it by that much (s); negative sets it back."""

    def recording(self, recorder: Recorder) -> Recorder:
        """Return a recorder that converts times of rows to true time and passes them on."""


class Clock(Generic[E]):
    """Simulation time and queue of events."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._heap: list[tuple[float, int, int, E]] = []
        self._sequence = 0

    @property
    def next_s(self) -> float:
        """Time of the next event (s), infinite without one."""
        return self._heap[0][0] if self._heap else math.inf

    def schedule(self, time_s: float, priority: int, event: E) -> None:
        """Schedule ``event``, lower priorities first; raise ValueError if ``time_s`` is in the past."""
        if time_s < self.now_s:
            raise ValueError(f"cannot schedule at {time_s} s, it is {self.now_s} s")
        # The sequence number also keeps the heap from comparing events, which have no order.
        heapq.heappush(self._heap, (time_s, int(priority), self._sequence, event))
        self._sequence += 1

    def next_before(self, time_s: float, priority: int = Priority.MOTION) -> E | None:
        """Pop the next event before ``(time_s, priority)``, advance to its time; None without one."""
        heap = self._heap
        if not heap or heap[0][0] > time_s or (heap[0][0] == time_s and heap[0][1] >= priority):
            return None
        self.now_s, _, _, event = heapq.heappop(heap)
        return event

    def keep(self, *priorities: int) -> None:
        """Drop all events of other priorities."""
        self._heap = [entry for entry in self._heap if entry[1] in priorities]
        heapq.heapify(self._heap)


Event = Callable[[Any], object]


class Host:
    """Simulation as events and observers see it: a fleet or a single vehicle.

    After ``last_s`` (s) nothing happens but the exchange. ``make_anew`` makes a restarted vehicle, with memory or not.
    """

    recorder: Recorder
    clock: Clock[Event]
    vehicles: tuple[Vehicle, ...]
    last_s: float
    make_anew: Callable[[Any, Vehicle, bool], Vehicle]

    @property
    def now_s(self) -> float:
        """True time of the mission (s)."""
        return self.clock.now_s

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the simulated vehicles."""
        return tuple(vehicle.name for vehicle in self.vehicles)

    def at(self, time_s: float, priority: Priority, event: Event) -> None:
        """Schedule an event at a true time (s), unless the mission is over by then."""
        if time_s <= self.last_s:
            self.clock.schedule(time_s, priority, event)

    def named(self, vehicle: str) -> Vehicle:
        """Return the current vehicle of that name."""
        return next(candidate for candidate in self.vehicles if candidate.name == vehicle)

    def shown_s(self, vehicle: Vehicle) -> float:
        """Return the current clock reading of a vehicle (s)."""
        return self.now_s

    def await_slot(self, node: int) -> None:
        """Schedule the next own slot of a vehicle by its current clock."""

    def let_say(self, vehicle: str, facts: Callable[[Beliefs], Sequence[Fact]]) -> bool:
        """Let a vehicle record and send facts, built from its beliefs; False if it is not alive."""
        speaker = self.named(vehicle)
        if speaker.is_alive:
            speaker.conclude(facts(speaker.beliefs), self.shown_s(speaker))
        return speaker.is_alive

    def restart(self, before: Vehicle, remembers: bool) -> Vehicle:
        """Replace a vehicle by its restarted one; ``remembers`` is False if its memory is lost."""
        anew = self.make_anew(self, before, remembers)
        self.vehicles = tuple(anew if vehicle is before else vehicle for vehicle in self.vehicles)
        before.remove()
        return anew


class Observer:
    """Participant of one run: subclasses override events; ``clocks`` deviate, by node."""

    # A single vehicle has only ``on_start`` and ``on_vehicle``.
    clocks: Mapping[int, ShownTime] = MappingProxyType({})

    # Replacements at setup ---------------------------------------------------------------------------

    def channel(self, channel: Channel) -> Channel:
        """Return the channel of the fleet, by default the given one."""
        return channel

    def separation(self, separation: Separation) -> Separation:
        """Return the monitor of distances between vehicles, by default the given one."""
        return separation

    def needs(self, model: WorldModel, common: NeedsIndex | GroupNeeds) -> RenewedNeeds | None:
        """Return the information needs of a vehicle; None for the default needs."""
        return None

    # Events of a run ---------------------------------------------------------------------------------

    def on_start(self, host: Host) -> None:
        """Handle the start, when all vehicles exist: schedule events."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Handle a new or restarted vehicle, before its activities are chosen."""

    def on_tick(self, vehicle: Vehicle) -> None:
        """Handle a vehicle after motion, sensing and decision of a tick."""

    def on_slot(self, vehicle: Vehicle) -> None:
        """Handle the slot of a vehicle, after its packet, if any."""

    def on_received(self, vehicle: Vehicle, reception: Reception, size_bits: int, shown_s: float) -> None:
        """Handle a packet of this size received by a vehicle at its clock reading ``shown_s``."""

    def on_frame_end(self, vehicle: Vehicle) -> None:
        """Handle a vehicle after its consultation at the end of a TDMA frame."""

    def on_statement(self, vehicle: Vehicle) -> None:
        """Handle a vehicle after a scheduled statement, see ``say_at``."""

    def on_restart(self, vehicle: Vehicle) -> None:
        """Handle a restarted vehicle that has replaced its predecessor."""


@dataclass(frozen=True)
class LeavingOut(Observer):
    """Observer that leaves an optional part out of every vehicle's exchange manager."""

    part: OptionalPart

    def on_vehicle(self, vehicle: Vehicle) -> None:
        vehicle.radio.manager.leave_out(self.part)


def listening(observers: Iterable[Observer], event: str) -> tuple[Callable[..., Any], ...]:
    """Return the methods of observers that override an event, in order."""
    usual = getattr(Observer, event)
    return tuple(getattr(observer, event) for observer in observers if getattr(type(observer), event) is not usual)


def say_at(
    host: Host,
    time_s: float,
    vehicle: str,
    facts: Callable[[Beliefs], Sequence[Fact]],
    unsaid: tuple[str, ...] = (),
) -> None:
    """Schedule a vehicle's statement at a true time (s); ``unsaid``: fault row if not alive."""

    def say(host: Host) -> None:
        if not host.let_say(vehicle, facts) and unsaid:
            host.recorder.faults.append((host.now_s, vehicle, *unsaid))

    if vehicle in host.names:
        host.at(time_s, Priority.FAULT, say)
