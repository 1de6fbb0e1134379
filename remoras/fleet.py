"""The fleet: time, truth, channel and vehicles. It takes no decisions.

A step is one motion tick. Between two ticks packets are sent and heard at their exact times, from one event queue.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import mesa

from exchange.acoustics.channel import Arrival, Channel
from exchange.acoustics.collisions import Hearing
from exchange.acoustics.modems import Modem
from exchange.schedule import TdmaSchedule
from remoras.avoidance import SEPARATION_M
from remoras.bans import Ban, word
from remoras.beliefs import Beliefs, Fact
from remoras.bound import Bound
from remoras.clock import Clock, Priority
from remoras.faults import OVER, Condition, Fault, FaultKind
from remoras.holders import HolderCount
from remoras.mission import Truth
from remoras.needs import StatedNeed
from remoras.obligations import Obligations
from remoras.own_clock import OwnClock
from remoras.plugins import broken_promise
from remoras.recorder import Recorder
from remoras.separation import Separation
from remoras.slots import NewSlots
from remoras.traffic import FrameBegins, FrameEnds, SlotOpens, Traffic
from remoras.vehicle import Vehicle
from remoras.view import ReadOnlyFleet
from remoras.work import Point

COLLECT_AFTER = 1_000_000
"""New objects after which the garbage collector looks for cycles during a run."""


@contextmanager
def rare_collections() -> Iterator[None]:
    """Let the garbage collector look less often meanwhile.

    A run makes many values and hardly any cycles; searching them for cycles would cost a sixth of its time.
    """
    usual = gc.get_threshold()
    gc.set_threshold(COLLECT_AFTER, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)


@dataclass(frozen=True, slots=True)
class FaultChanges:
    """A fault begins to hold, or is over."""

    fault: Fault
    begins: bool


@dataclass(frozen=True, slots=True)
class BanChanges:
    """A person lets a vehicle ban another, or take that back."""

    ban: Ban
    begins: bool


@dataclass(frozen=True, slots=True)
class NeedChanges:
    """A vehicle comes to need something, or needs it no more."""

    need: StatedNeed
    begins: bool


@dataclass(frozen=True, slots=True)
class SlotsChange:
    """A person lets a vehicle say who sends in which slots."""

    slots: NewSlots


Said = BanChanges | NeedChanges | SlotsChange
Event = SlotOpens | FrameBegins | FrameEnds | FaultChanges | Said | Hearing


def _speaker(event: Said) -> str:
    """Name of the vehicle that says something."""
    match event:
        case NeedChanges(need=need):
            return need.vehicle
        case BanChanges(ban=ban):
            return ban.issuer
        case SlotsChange(slots=slots):
            return slots.issuer


def _facts(event: Said, beliefs: Beliefs) -> list[Fact]:
    """What the vehicle of these beliefs says."""
    match event:
        case NeedChanges(need=need, begins=begins):
            return [beliefs.fact(*fact) for fact in (need.facts() if begins else need.taken_back())]
        case BanChanges(ban=ban, begins=begins):
            return [word(beliefs, ban.vehicle, ban.from_s if begins else None)]
        case SlotsChange(slots=slots):
            return slots.facts(beliefs)


def _schedule(
    clock: Clock[Event],
    bans: Sequence[Ban],
    needs: Sequence[StatedNeed],
    slots: Sequence[NewSlots],
    duration_s: float,
) -> None:
    """Let bans, needs and slots be said, and taken back, at their times; a need of the beginning is agreed."""
    for one in slots:
        clock.schedule(one.at_s, Priority.FAULT, SlotsChange(one))
    for ban in bans:
        clock.schedule(ban.at_s, Priority.FAULT, BanChanges(ban, True))
        if ban.until_s <= duration_s:
            clock.schedule(ban.until_s, Priority.FAULT, BanChanges(ban, False))
    for need in needs:
        if need.from_s > 0.0:
            clock.schedule(need.from_s, Priority.FAULT, NeedChanges(need, True))
        if need.until_s <= duration_s:
            clock.schedule(need.until_s, Priority.FAULT, NeedChanges(need, False))


class Fleet(mesa.Model):  # type: ignore[misc]  # Mesa is untyped
    """A mission run.

    Args:
        make_vehicles: makes the vehicles of this model, one per node, in the order of the nodes.
        channel: carries packets.
        modem: of all vehicles.
        schedule: TDMA.
        truth: watches the run and says when the mission is complete.
        recorder: takes the rows.
        tick_s: length of a step.
        duration_s: end of the run if the mission does not complete before.
        faults: what befalls the vehicles in this run.
        separation_m: distance that vehicles in one depth layer are to keep.
        obligations: that heads judge; None without any.
        bans: that persons order.
        make_anew: makes a vehicle of this model that begins anew now, of the one that it was.
        clocks: of the vehicles, by node; exact ones if empty.
        needs: that vehicles state during the mission.
        slots: lists of slots that persons order.
        seed: of the times at which vehicles send in ALOHA.
    """

    def __init__(
        self,
        make_vehicles: Callable[[Fleet], Sequence[Vehicle]],
        channel: Channel,
        modem: Modem,
        schedule: TdmaSchedule,
        truth: Truth,
        recorder: Recorder,
        tick_s: float,
        duration_s: float,
        faults: Sequence[Fault] = (),
        separation_m: float = SEPARATION_M,
        obligations: Obligations | None = None,
        bans: Sequence[Ban] = (),
        make_anew: Callable[[Fleet, Vehicle, Fault], Vehicle] | None = None,
        clocks: Sequence[OwnClock] = (),
        needs: Sequence[StatedNeed] = (),
        slots: Sequence[NewSlots] = (),
        seed: int = 0,
    ) -> None:
        super().__init__(rng=0)  # Mesa's generators are not used: every draw is keyed by its purpose
        self.vehicles = tuple(make_vehicles(self))
        self.view = ReadOnlyFleet.of(self.vehicles)
        self.clock: Clock[Event] = Clock()
        self.channel = channel
        self.modem = modem
        self.schedule = schedule
        self.truth = truth
        self.recorder = recorder
        self.tick_s = tick_s
        self.duration_s = duration_s
        self.completed = False
        self.ended_s = 0.0
        self.reason = ""
        self.n_false_beliefs = 0
        self.holders = HolderCount()
        leave_layers = any(vehicle.functional.adrift is not None for vehicle in self.vehicles)
        self._separation = Separation(self.vehicles, separation_m, leave_layers)
        self._obligations = obligations
        self._make_anew = make_anew
        self._bound = Bound()
        self._faults = tuple(faults)
        self._holding: dict[str, list[Fault]] = {vehicle.name: [] for vehicle in self.vehicles}
        for fault in self._faults:
            from_s, until_s = fault.span_s
            self.clock.schedule(from_s, Priority.FAULT, FaultChanges(fault, True))
            if until_s <= duration_s:
                self.clock.schedule(until_s, Priority.FAULT, FaultChanges(fault, False))
        _schedule(self.clock, bans, needs, slots, duration_s)
        self.clocks = tuple(clocks) or tuple(OwnClock() for _ in self.vehicles)
        self._astray = {node for node, clock in enumerate(self.clocks) if not clock.is_exact}
        self.traffic = Traffic(channel, modem, schedule, self.clock, self.clocks, self._faults, seed)

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        return self.clock.now_s

    def step(self) -> None:
        """One motion tick, and all that is said and heard before it."""
        now_s = (self.steps - 1) * self.tick_s
        while (event := self.clock.next_before(now_s)) is not None:
            self._handle(event)
        self.clock.now_s = now_s
        dt_s = self.tick_s if now_s > 0.0 else 0.0
        neighbours = self._separation.look()
        for vehicle in self.vehicles:
            vehicle.step(self._clock_of(vehicle).reads(now_s), dt_s, neighbours.get(vehicle.data.node, ()))
            self._share_at_once(vehicle, now_s)
        self._record(now_s)
        self.recorder.faults.extend(self._separation.conflicts(now_s))
        self._observe(now_s)
        over = now_s + self.tick_s > self.duration_s or self._is_nobody_left or self.truth.is_over
        if self.completed or over:
            self.running = False
            self.ended_s = now_s
            self.reason = self.truth.close(self.view, now_s)

    @property
    def _is_nobody_left(self) -> bool:
        """True once no vehicle is alive or ever will be."""
        return all(vehicle.functional.exhausted or vehicle.condition.lost_for_good for vehicle in self.vehicles)

    @rare_collections()
    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Step until the mission is complete or its time is over.

        Args:
            progress: is told the time of the mission now and then.
        """
        while self.running:
            self.step()
            if progress is not None and self.steps % 50 == 0:
                progress(self.now_s)

    def close(self) -> None:
        """Let go of the vehicles and the record, so that their memory does not wait for the garbage collector.

        Mesa refers from a model to itself, and some versions keep every model alive in a table of agents.
        """
        self.remove_all_agents()
        ids = getattr(mesa.Agent, "_ids", None)
        if isinstance(ids, dict):
            ids.pop(self, None)
        self.vehicles = ()
        self.view = ReadOnlyFleet(())
        del self.recorder

    def _observe(self, now_s: float) -> None:
        if self._obligations is not None:
            self._obligations.judge(self.vehicles, now_s)
        if not self.completed:
            try:
                self.completed = self.truth.observe(self.view, now_s)
            except Exception as error:  # it is the mission's: anything may be wrong with it
                raise broken_promise("the mission's truth", "observe", "True or False", error) from error

    # Events --------------------------------------------------------------------------------------

    def _handle(self, event: Event) -> None:
        now_s = self.clock.now_s
        match event:
            case Hearing(arrival=Arrival(receiver=node, data=data), collided=collided):
                if not collided:
                    self._deliver(node, data, now_s)
            case SlotOpens(number=slot, node=node):
                self._transmit(slot, node, now_s)
            case FrameBegins(node=node):
                self.traffic.begins(event, self.vehicles[node], now_s)
            case FaultChanges(fault=fault, begins=begins):
                self._befall(fault, begins, now_s)
            case BanChanges() | NeedChanges() | SlotsChange():
                self._let_say(event, now_s)
            case FrameEnds(number=frame, node=None):
                for vehicle in self.vehicles:
                    if vehicle.data.node not in self._astray:
                        self._consult(vehicle, now_s)
                self.holders.compare([(v.name, v.social.organisation) for v in self.vehicles if v.is_alive])
                self._observe(now_s)
                self.traffic.await_frame(frame + 1)
            case FrameEnds(number=frame, node=int(node)):
                self._consult(self.vehicles[node], now_s)
                self.traffic.await_frame(frame + 1, node)

    def _consult(self, vehicle: Vehicle, now_s: float) -> None:
        vehicle.consult(self._clock_of(vehicle).reads(now_s))
        if vehicle.timekeeper is not None and vehicle.is_alive:
            vehicle.timekeeper.record()
        self._share_at_once(vehicle, now_s)

    def _clock_of(self, vehicle: Vehicle) -> OwnClock:
        return self.clocks[vehicle.data.node]

    def _transmit(self, slot: int, node: int, now_s: float) -> None:
        sender = self.vehicles[node]
        shown_s = self.traffic.opened(slot, sender, now_s)
        if shown_s is None:
            return
        sent = sender.speak(shown_s)
        self._share_at_once(sender, now_s)
        if sent is not None:
            self.traffic.carry(slot, sender, sent, self.vehicles, self.recorder)
        if sender.timekeeper is not None and sender.timekeeper.set_clock():
            self.traffic.await_slot(node)

    def _let_say(self, event: Said, now_s: float) -> None:
        """Let a vehicle say what a person at its console wishes, or what it needs; one not alive cannot."""
        name = _speaker(event)
        vehicle = next(one for one in self.vehicles if one.name == name)
        facts = _facts(event, vehicle.beliefs)
        if vehicle.is_alive:
            vehicle.conclude(facts, self._clock_of(vehicle).reads(now_s))
        elif isinstance(event, BanChanges):
            self.recorder.faults.append((now_s, name, "ban not said", event.ban.vehicle))
        elif isinstance(event, SlotsChange):
            self.recorder.faults.append((now_s, name, "slots not said", "their speaker is away"))
        self._share_at_once(vehicle, now_s)

    def _befall(self, fault: Fault, begins: bool, now_s: float) -> None:
        """Let a fault hold from now on, or no longer; others of the vehicle hold as they did."""
        vehicle = next(one for one in self.vehicles if one.name == fault.vehicle)
        holding = self._holding[fault.vehicle]
        if begins:
            holding.append(fault)
        else:
            holding.remove(fault)
            if fault.kind is FaultKind.RESTARTS and self._make_anew is not None and not vehicle.functional.exhausted:
                vehicle = self._replace(vehicle, self._make_anew(self, vehicle, fault))
                self._bound.share_all(vehicle, self.vehicles, lambda one: self._clock_of(one).reads(now_s))
        vehicle.suffer(Condition.under(holding))
        self.recorder.faults.append((now_s, fault.vehicle, fault.kind.value, fault.detail if begins else OVER))

    def _replace(self, old: Vehicle, new: Vehicle) -> Vehicle:
        """Let a vehicle take the place of what it was before it began anew."""
        self.vehicles = tuple(new if one is old else one for one in self.vehicles)
        self._separation.vehicles = self.vehicles
        self.view = ReadOnlyFleet.of(self.vehicles)
        old.remove()
        return new

    def _deliver(self, node: int, data: bytes, now_s: float) -> None:
        reception = self.vehicles[node].hear(data, self.clocks[node].reads(now_s))
        if reception is not None:
            for peer, uid in reception.beliefs:
                if not self.vehicles[peer].radio.manager.holds(uid):
                    self.n_false_beliefs += 1

    def _share_at_once(self, sender: Vehicle, now_s: float) -> None:
        self._bound.share(sender, self.vehicles, lambda vehicle: self._clock_of(vehicle).reads(now_s))

    # What is so ----------------------------------------------------------------------------------

    def carried_m(self, vehicle: str, sensor: str | None) -> Point | None:
        """Where a vehicle is that is a beacon to others; None while it, or the sensor by which it is one, is silent."""
        carrier = next(one for one in self.vehicles if one.name == vehicle)
        condition = carrier.condition
        is_silent = not carrier.is_alive or condition.is_mute or sensor in condition.dead_sensors
        return None if is_silent else carrier.functional.motion.position_m

    def _record(self, now_s: float) -> None:
        append = self.recorder.trajectories.append
        for vehicle in self.vehicles:
            layer, m = vehicle.functional, vehicle.functional.motion
            depth_m = 0.0 if layer.exhausted else layer.depth_m  # without power it floats up
            append((now_s, vehicle.name, m.x_m, m.y_m, m.heading_rad, m.speed_mps, m.energy_j, depth_m))
