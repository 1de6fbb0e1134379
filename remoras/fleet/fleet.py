"""Fleet: time, ground truth, channel and vehicles; it takes no decisions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from mesa import Agent, Model

from exchange.channel.channel import Arrival
from remoras.beliefs import Beliefs, Fact
from remoras.events import Clock, Host, Observer, listening
from remoras.fleet.traffic import Medium, Traffic
from remoras.fleet.vehicle import Vehicle
from remoras.motion.avoidance import SEPARATION_M
from remoras.motion.separation import Separation
from remoras.plugins import RAISED, broken_promise
from remoras.process import rare_collections
from remoras.recorder import Recorder
from remoras.truth import FleetView, HolderCount, Truth


def release(model: Model) -> None:
    """Remove the reference by which Mesa 3.3 keeps a model alive; no agents can be added later."""
    ids = getattr(Agent, "_ids", None)
    if isinstance(ids, dict):
        ids.pop(model, None)


class Fleet(Model, Host):  # type: ignore[misc]  # Mesa is untyped
    """Mission run; ``truth`` observes and ends it, ``nature`` changes the world."""

    def __init__(
        self,
        make_vehicles: Callable[[Fleet], Iterable[Vehicle]],
        make_anew: Callable[[Fleet, Vehicle, bool], Vehicle],
        medium: Medium,
        truth: Truth,
        recorder: Recorder,
        tick_s: float,
        duration_s: float,
        separation_m: float = SEPARATION_M,
        observers: Sequence[Observer] = (),
        nature: Callable[[FleetView, float], None] | None = None,
    ) -> None:
        super().__init__(rng=0)  # Mesa's generators are not used: every draw is keyed by its purpose
        self.vehicles, self.make_anew = tuple(make_vehicles(self)), make_anew
        self.view = FleetView.of(self.vehicles)
        self.clock = Clock()
        self.truth = truth
        self.recorder = recorder
        self.tick_s = tick_s
        self.duration_s = self.last_s = duration_s
        self.n_ticks = 0
        self.completed = False
        self.ended_s = 0.0
        self.reason = ""
        self.n_false_beliefs = 0
        self.holders = HolderCount()
        self._nature = nature
        self.separation = Separation(self.vehicles, separation_m)
        for observer in observers:
            self.separation = observer.separation(self.separation)
        self.medium, self.clocks = medium, medium.clocks
        self.channel, self.schedule = medium.channel, medium.schedule
        self._astray = {node for node, clock in self.clocks.items() if not clock.is_exact}
        self.traffic = Traffic(medium, self.clock)
        for start in listening(observers, "on_start"):
            start(self)
        self._on_tick = listening(observers, "on_tick")
        self._on_slot = listening(observers, "on_slot")
        self._on_received = listening(observers, "on_received")
        self._on_frame_end = listening(observers, "on_frame_end")
        self._on_statement = listening(observers, "on_statement")
        self._on_restart = listening(observers, "on_restart")

    def step(self) -> None:
        """Process all events before the next motion tick, then the tick."""
        now_s, since_s = self.n_ticks * self.tick_s, (self.n_ticks - 1) * self.tick_s
        self.n_ticks += 1
        while (event := self.clock.next_before(now_s)) is not None:
            event(self)
        self.clock.now_s = now_s
        self._move(now_s, since_s)
        self._record(now_s)
        self.recorder.faults.extend(self.separation.conflicts(now_s))
        self._observe(now_s)
        over = now_s + self.tick_s > self.duration_s or self.is_nobody_left or self.truth.is_over
        if self.completed or over:
            self.running = False
            self.ended_s = now_s
            self.reason = self.truth.close(self.view, now_s)

    def _move(self, now_s: float, since_s: float) -> None:
        dt_s = self.tick_s if now_s > 0.0 else 0.0
        # Before any vehicle moves, so that their order does not matter.
        neighbours = self.separation.look()
        for vehicle in self.vehicles:
            shown_s = self.shown_s(vehicle) if self.clocks else now_s
            vehicle.step(shown_s, dt_s, neighbours.get(vehicle.data.node, ()) if neighbours else (), since_s)
            for tell in self._on_tick:
                tell(vehicle)

    @property
    def is_nobody_left(self) -> bool:
        """True once no vehicle is, or ever will be, alive."""
        return all(vehicle.functional.exhausted or vehicle.condition.lost_for_good for vehicle in self.vehicles)

    @rare_collections()
    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Step to completion or the time limit; call ``progress`` with the time (s) every 50 ticks."""
        while self.running:
            self.step()
            if progress is not None and self.n_ticks % 50 == 0:
                progress(self.now_s)

    def close(self) -> None:
        """Release vehicles and record at once; otherwise Mesa's references keep the model alive."""
        self.remove_all_agents()
        release(self)
        self.vehicles = ()
        self.view = FleetView(())
        self._on_tick = self._on_slot = self._on_received = self._on_frame_end = self._on_restart = ()
        del self.recorder

    def _observe(self, now_s: float) -> None:
        if self._nature is not None:
            try:
                self._nature(self.view, now_s)
            except RAISED as error:
                raise broken_promise("the mission", "nature", "a function of fleet view and time", error) from error
        if not self.completed:
            try:
                self.completed = self.truth.observe(self.view, now_s)
            except RAISED as error:
                raise broken_promise("the mission's truth", "observe", "True or False", error) from error

    # Interface for events ------------------------------------------------------------------------

    def await_slot(self, node: int) -> None:
        self.traffic.await_slot(node)

    def shown_s(self, vehicle: Vehicle) -> float:
        return self.medium.shown_s(vehicle.data.node, self.clock.now_s) if self.clocks else self.clock.now_s

    def let_say(self, vehicle: str, facts: Callable[[Beliefs], Sequence[Fact]]) -> bool:
        has_said = super().let_say(vehicle, facts)
        for tell in self._on_statement if has_said else ():
            tell(self.named(vehicle))
        return has_said

    def restart(self, before: Vehicle, remembers: bool) -> Vehicle:
        anew = super().restart(before, remembers)
        self.separation.vehicles = self.vehicles
        self.view = FleetView.of(self.vehicles)
        for tell in self._on_restart:
            tell(anew)
        return anew

    def transmit(self, slot: int, node: int) -> None:
        """Let a vehicle send in its slot, which opens now."""
        sender = self.vehicles[node]
        shown_s = self.traffic.opened(slot, sender, self.clock.now_s)
        if shown_s is None:
            return
        sent = sender.speak(shown_s)
        if sent is not None:
            self.traffic.carry(slot, sender, sent, self.vehicles, self.recorder)
        for tell in self._on_slot:
            tell(sender)

    def deliver(self, arrival: Arrival) -> None:
        """Let a vehicle receive a packet that arrives now."""
        hearer = self.vehicles[arrival.receiver]
        shown_s = self.shown_s(hearer) if self.clocks else self.clock.now_s
        reception = hearer.hear(arrival.data, shown_s)
        if reception is not None:
            for tell in self._on_received if reception.fault is None else ():
                tell(hearer, reception, 8 * len(arrival.data), shown_s)
            for peer, uid in reception.beliefs:
                believed, known = self.vehicles[peer], hearer.radio.manager
                # What it held before a restart is no false belief of a vehicle that has not learnt of the restart.
                is_of_now = known.knows_life(peer, believed.beliefs.model.epoch)
                self.n_false_beliefs += is_of_now and not believed.radio.manager.holds(uid)

    def end_frame(self, frame: int, node: int | None) -> None:
        """Let a vehicle consult at the end of a frame of its clock; None: all with exact clocks."""
        if node is not None:
            self._consult(self.vehicles[node])
            self.traffic.await_frame(frame + 1, node)
            return
        for vehicle in self.vehicles:
            if vehicle.data.node not in self._astray:
                self._consult(vehicle)
        alive = [vehicle for vehicle in self.vehicles if vehicle.functional.is_on]
        self.holders.compare([(vehicle.name, vehicle.social.organisation) for vehicle in alive])
        self._observe(self.clock.now_s)
        self.traffic.await_frame(frame + 1)

    def _consult(self, vehicle: Vehicle) -> None:
        vehicle.consult(self.shown_s(vehicle) if self.clocks else self.clock.now_s)
        for tell in self._on_frame_end:
            tell(vehicle)

    # Recording -----------------------------------------------------------------------------------

    def _record(self, now_s: float) -> None:
        append = self.recorder.trajectories.append
        for vehicle in self.vehicles:
            layer = vehicle.functional
            m = layer.motion
            depth_m = 0.0 if layer.exhausted else layer.depth_m  # without power it floats up
            append((now_s, vehicle.name, m.x_m, m.y_m, m.heading_rad, m.speed_mps, m.energy_j, depth_m))
