"""Events of a run, and observers that take part in it.

The simulation takes the next event off its queue and lets it act, as SimPy does: a new kind of event needs no change of
the core. A feature that is on, and the faults of a run, are each an ``Observer``: a method for each event, which does
nothing unless a subclass defines it. A simulation keeps one list for each event, of the methods that are defined (see
``listening``), so an event without a listener costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from remoras.clock import Priority, ShownTime

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
