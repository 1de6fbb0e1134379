"""Events of a run: the queue that they come out of, and observers that take part in the run.

The queue has exact times, strong references and one total order: (time_s, priority, sequence). At equal times the lower
priority number comes out first, then what was put in first. Nothing else decides, so two runs are alike in every Mesa
and Python. The simulation takes the next event out and lets it act, as SimPy does: a new kind of event needs no change
of the core.

A feature that is on, and the faults of a run, are each an ``Observer``: a method for each event, which does nothing
unless a subclass defines it. A simulation keeps one list for each event, of the methods that are defined (see
``listening``), so an event without a listener costs nothing.
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
    from exchange.acoustics.channel import Channel
    from exchange.packets import Reception
    from remoras.beliefs import Beliefs, Fact
    from remoras.radio import RenewedNeeds
    from remoras.recorder import Recorder
    from remoras.separation import Separation
    from remoras.social.needs import GroupNeeds
    from remoras.vehicle import Vehicle
    from worldmodel import NeedsIndex, WorldModel


E = TypeVar("E")


class Priority(IntEnum):
    """Order of events at the same time: what arrives is heard before anybody moves, decides or speaks.

    A fault comes first: a vehicle that is lost at a time does nothing at that time.
    """

    FAULT = 0
    ARRIVAL = 1
    MOTION = 2
    CONSULTATION = 3
    SLOT = 4


class ShownTime(Protocol):
    """The clock of a vehicle that may be off."""

    @property
    def is_exact(self) -> bool:
        """True if it shows the true time, and always will."""
        ...

    def reads(self, true_s: float) -> float:
        """What it shows at a true time (s)."""
        ...

    def true_time_s(self, shown_s: float) -> float:
        """True time (s) for a clock reading."""
        ...

    def set_by(self, by_s: float) -> None:
        """Put it forward by that much (s); back if it is negative."""
        ...

    def recording(self, recorder: Recorder) -> Recorder:
        """What takes the rows of its vehicle and hands them to a recorder in true time."""
        ...


class Clock(Generic[E]):
    """Time of the simulation and what is still to happen.

    >>> clock = Clock()
    >>> clock.schedule(1.0, Priority.SLOT, "speak"); clock.schedule(1.0, Priority.ARRIVAL, "hear")
    >>> clock.next_before(2.0), clock.now_s, clock.next_before(1.0)
    ('hear', 1.0, None)
    """

    def __init__(self) -> None:
        self.now_s = 0.0
        self._heap: list[tuple[float, int, int, E]] = []
        self._sequence = 0

    @property
    def next_s(self) -> float:
        """Time of the next event (s), infinite without one."""
        return self._heap[0][0] if self._heap else math.inf

    def schedule(self, time_s: float, priority: int, event: E) -> None:
        """Let ``event`` come out at ``time_s``.

        Args:
            time_s: now or later.
            priority: order among events of the same time, the lower number first.
            event: what comes out.

        Raises:
            ValueError: ``time_s`` is in the past.
        """
        if time_s < self.now_s:
            raise ValueError(f"cannot schedule at {time_s} s, it is {self.now_s} s")
        heapq.heappush(self._heap, (time_s, int(priority), self._sequence, event))
        self._sequence += 1

    def next_before(self, time_s: float, priority: int = Priority.MOTION) -> E | None:
        """The next event ordered before ``(time_s, priority)``, whose time is now from then on; None without one."""
        heap = self._heap
        if not heap or heap[0][0] > time_s or (heap[0][0] == time_s and heap[0][1] >= priority):
            return None
        self.now_s, _, _, event = heapq.heappop(heap)
        return event


H_contra = TypeVar("H_contra", contravariant=True)


class Event(Protocol[H_contra]):
    """What happens at a time."""

    def act(self, host: H_contra) -> None:
        """Happen now; called once, by whose queue it is in, when its time has come."""
        ...


class Host(Protocol):
    """What events and observers may ask of a simulation: of a fleet, or of a vehicle by itself.

    Attributes:
        recorder: takes the rows.
    """

    recorder: Recorder

    @property
    def vehicles(self) -> Sequence[Vehicle]:
        """Vehicles that are simulated here, in the order of the nodes."""
        ...

    @property
    def now_s(self) -> float:
        """True time of the mission (s)."""
        ...

    @property
    def names(self) -> Sequence[str]:
        """Names of the vehicles that are simulated here."""
        ...

    def at(self, time_s: float, priority: Priority, event: Event[Host]) -> None:
        """Let an event happen at a true time (s), unless the mission is over by then."""
        ...

    def named(self, vehicle: str) -> Vehicle:
        """The vehicle of that name, as it is now."""
        ...

    def shown_s(self, vehicle: Vehicle) -> float:
        """What the clock of a vehicle shows now (s)."""
        ...

    def await_slot(self, node: int) -> None:
        """Schedule the next own slot of a vehicle by its clock as set now."""
        ...

    def let_say(self, vehicle: str, facts: Callable[[Beliefs], Sequence[Fact]]) -> bool:
        """Let a vehicle conclude and tell facts now; False, and nothing is said, if it is not alive.

        Args:
            vehicle: its name.
            facts: made of the names that its beliefs have.
        """
        ...

    def restart(self, before: Vehicle, remembers: bool) -> Vehicle:
        """The vehicle that begins anew and takes the place of what it was before; False if its memory is lost."""
        ...


class Observer:
    """Takes part in one run. Subclass it and define the events that matter; those that are not defined cost nothing.

    A vehicle by itself has the events ``on_start`` and ``on_vehicle`` alone.

    Attributes:
        clocks: of the vehicles whose clocks may be off, by node.
    """

    clocks: Mapping[int, ShownTime] = MappingProxyType({})

    # In place of the usual, when a run is set up -----------------------------------------------------

    def channel(self, channel: Channel) -> Channel:
        """What carries the packets of a fleet, given what would."""
        return channel

    def separation(self, separation: Separation) -> Separation:
        """What watches the distances between the vehicles of a fleet, given what would."""
        return separation

    def needs(self, model: WorldModel, common: NeedsIndex | GroupNeeds) -> RenewedNeeds | None:
        """Who needs what for a vehicle with this world model; None for the needs that nobody states."""
        return None

    # Events of a run ---------------------------------------------------------------------------------

    def on_start(self, host: Host) -> None:
        """All vehicles are made: schedule events."""

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """A vehicle is made, at the start or to begin anew; its activities are not chosen yet."""

    def on_tick(self, vehicle: Vehicle) -> None:
        """A vehicle has moved, sensed and decided for a motion tick."""

    def on_slot(self, vehicle: Vehicle) -> None:
        """The slot of a vehicle has opened, and it has sent its packet, if any."""

    def on_received(self, vehicle: Vehicle, reception: Reception, size_bits: int, shown_s: float) -> None:
        """A vehicle has taken in a packet of this size, when its clock showed ``shown_s``."""

    def on_frame_end(self, vehicle: Vehicle) -> None:
        """A vehicle has consulted at the end of a TDMA frame."""

    def on_statement(self, vehicle: Vehicle) -> None:
        """A vehicle has stated facts at a time that the scenario gives, see ``Says``."""

    def on_restart(self, vehicle: Vehicle) -> None:
        """A vehicle has begun anew and taken the place of what it was."""


def listening(observers: Iterable[Observer], event: str) -> tuple[Callable[..., Any], ...]:
    """The methods of those observers that define an event, in their order.

    Args:
        observers: of the run.
        event: name of the method.
    """
    usual = getattr(Observer, event)
    return tuple(getattr(one, event) for one in observers if getattr(type(one), event) is not usual)


@dataclass(frozen=True, slots=True)
class Says:
    """A vehicle says something at a time that the scenario gives.

    Attributes:
        vehicle: that says it.
        facts: that it says, made of the names that its beliefs have.
        unsaid: kind and detail of the row of faults if the vehicle is not alive by then; none if empty.
    """

    vehicle: str
    facts: Callable[[Beliefs], Sequence[Fact]]
    unsaid: tuple[str, ...] = ()

    def act(self, host: Host) -> None:
        """Say it."""
        if not host.let_say(self.vehicle, self.facts) and self.unsaid:
            host.recorder.faults.append((host.now_s, self.vehicle, *self.unsaid))


def say_at(host: Host, time_s: float, said: Says) -> None:
    """Let a vehicle say something at a true time (s), if it is simulated here.

    Args:
        host: of the vehicle.
        time_s: when; never if that is infinite.
        said: what.
    """
    if said.vehicle in host.names:
        host.at(time_s, Priority.FAULT, said)
