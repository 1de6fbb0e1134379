"""Events: what happens at a time, and does it itself; and parts, by which features take part in a run.

The core takes the next event off its queue and lets it act, as that of SimPy does: a new kind of event costs the core
nothing.
A feature that is on gives a run a ``Part``. Whatever is off gives none, so nothing of it is made, entered or asked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, TypeVar

from remoras.clock import Priority, ShownTime

if TYPE_CHECKING:
    from exchange.acoustics.channel import Channel
    from remoras.beliefs import Beliefs, Fact
    from remoras.functional.layer import FunctionalLayer
    from remoras.radio import Radio, RenewedNeeds
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
    """What any event may ask of a simulation: of a fleet, or of a vehicle by itself."""

    recorder: Recorder

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


class Slots(Protocol):
    """What opens the slots of a fleet."""

    def await_slot(self, node: int) -> None:
        """Schedule the next own slot of a vehicle by its clock as set now."""
        ...


class Joined(Protocol):
    """What a part may ask of a fleet, and the hooks to which it may add: each is called with the vehicle concerned."""

    acted: list[Callable[[Vehicle], None]]
    restarted: list[Callable[[Vehicle], None]]
    consulted: list[Callable[[Vehicle], None]]
    sent: list[Callable[[Vehicle], None]]
    separation: Separation

    @property
    def now_s(self) -> float:
        """The true time (s)."""
        ...

    @property
    def vehicles(self) -> Sequence[Vehicle]:
        """Every vehicle, in the order of the nodes."""
        ...

    @property
    def traffic(self) -> Slots:
        """What opens its slots."""
        ...

    def shown_s(self, vehicle: Vehicle) -> float:
        """What the clock of a vehicle shows now (s)."""
        ...


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


@dataclass(frozen=True, slots=True)
class Part:
    """What a feature that is on does in one run.

    Attributes:
        begin: called once, when the fleet, or the vehicle by itself, is made: schedules events.
        equip: called with each vehicle when it is made, and again with what takes its place after a restart: adds to
            its hooks.
        body: called with the functional layer of a vehicle when it is made, before the vehicle is, and so again when it
            begins anew: adds to its hooks and needs, or puts something else in the place of its guidance.
        join: called once with a fleet when it is made, never with a vehicle by itself: adds to the hooks of the fleet.
        clocks: of vehicles whose clocks may be off, by node.
        carries: called with the channel of a fleet when that is made, never of a vehicle by itself; what carries its
            packets instead.
        recorder: called when a vehicle is made, with its node and what takes the rows of all; what takes its rows.
        radio: makes the radios of the vehicles, of what ``remoras.radio.Radio`` takes. At most one part has it.
        lease_frames: TDMA frames after which a silent vehicle is taken to have left; as the scenario says if None.
        knows_vehicles: True if all know how each vehicle really is, not only what the fleet takes it to be.
        needs: called when a vehicle is made, with its world model and the needs that nobody states; who needs what
            instead. At most one part of a run has it.
        vehicle: makes the vehicles, of what ``remoras.vehicle.Vehicle`` takes. At most one part has it.
    """

    begin: Callable[[Host], None] | None = None
    equip: Callable[[Vehicle], None] | None = None
    body: Callable[[FunctionalLayer], None] | None = None
    join: Callable[[Joined], None] | None = None
    clocks: Mapping[int, ShownTime] = field(default_factory=dict)
    carries: Callable[[Channel], Channel] | None = None
    recorder: Callable[[int, Recorder], Recorder] | None = None
    radio: Callable[..., Radio] | None = None
    lease_frames: float | None = None
    knows_vehicles: bool = False
    needs: Callable[[WorldModel, NeedsIndex | GroupNeeds], RenewedNeeds] | None = None
    vehicle: Callable[..., Vehicle] | None = None


def clocks_of(parts: Iterable[Part]) -> dict[int, ShownTime]:
    """Clocks that may be off, by the node of their vehicle."""
    return {node: clock for part in parts for node, clock in part.clocks.items()}


def carrier_for(parts: Iterable[Part], channel: Channel) -> Channel:
    """What carries the packets of a fleet.

    Args:
        parts: of the run.
        channel: that it has.
    """
    for part in parts:
        if part.carries is not None:
            channel = part.carries(channel)
    return channel


def recorder_for(parts: Iterable[Part], node: int, recorder: Recorder) -> Recorder:
    """What takes the rows of one vehicle.

    Args:
        parts: of the run.
        node: of the vehicle.
        recorder: takes the rows of all.
    """
    for part in parts:
        if part.recorder is not None:
            recorder = part.recorder(node, recorder)
    return recorder
