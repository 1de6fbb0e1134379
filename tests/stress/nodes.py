"""Nodes: the vehicles of a schedule as separate processes in virtual time, without sockets, under invariants.

They do what a simulated fleet never does: introduce themselves under a key, and go on from their logs once killed.
"""

from __future__ import annotations

from collections import Counter
from heapq import heappop, heappush
from itertools import count
from types import SimpleNamespace
from typing import Any

from stress.fault_injection import Wrapping
from stress.invariants import EVENT, Heard, Scene
from stress.schedules import DECLARED, SETTLE_FRAMES, Schedule
from stress.trial import INVARIANTS, Outcome, effective_kinds, faulty_channel

from missions.nodes import LoneVehicle, NodePlan, alone
from missions.nodes.logs import Began, LineKind, LogEntry, Logged, back
from missions.runs.assembly import channel_of
from missions.runs.run import Root
from missions.runs.setup import resolved
from remoras.fleet.final_exchange import _is_settled
from remoras.fleet.standalone import just_after
from remoras.fleet.vehicle import Vehicle

ACTS_S = 20.0
"""For how long vehicles act on when all is healed (s)."""
PROMISED = {
    "exceptions", "beliefs", "recorded", "remembered", "one-content", "newest", "past",
    "sound-packets", "agreement", "rest",
}  # fmt: skip
"""Invariants of nodes: those of what is known; there are no tables of all vehicles."""


class NodeFleet:
    """Vehicles by themselves that hear each other through a faulty channel; invariants see a fleet."""

    def __init__(self, schedule: Schedule) -> None:
        scenario = schedule.loaded()
        setup, names, self.ended_s = resolved(scenario), scenario.names_by_slot, schedule.heal_s + ACTS_S
        self.frame_s, self.now_s, self._happened = setup.schedule.frame_s, 0.0, Counter[str]()
        quiet_s = SETTLE_FRAMES * self.frame_s
        self._plans = [NodePlan.of(scenario, name, schedule.seed, self.ended_s, quiet_s) for name in names]
        self._logs: list[list[LogEntry]] = [[] for _ in names]
        self._arrivals: list[tuple[float, int, int, bytes]] = []
        self._order = count()
        self._own: list[LoneVehicle | None] = [None] * len(names)
        self._make_anew: dict[str, Any] = {}
        self.make_anew = self._anew
        for node, plan in enumerate(self._plans):
            self._begin(node, alone(plan), LineKind.SALT)
        self._channel = faulty_channel(setup, schedule, channel_of(setup, Root(schedule.seed)), self._happened)
        about = setup, schedule, self, effective_kinds(schedule, setup), self._channel.carried
        self._scene = Scene(*about)  # type: ignore[arg-type]
        self._promised = [
            one() for one in INVARIANTS if one.name in PROMISED and not one.not_under & self._scene.effective
        ]
        self._wrapping = Wrapping(self._scene, self._hear, self._happened)
        self._broken: tuple[str, float, str] | None = None

    def _begin(self, node: int, own: LoneVehicle, kind: LineKind) -> None:
        self._own[node] = own
        self._logs[node].append(LogEntry(kind, self.now_s, own.salt))
        self._make_anew[own.plan.vehicle] = own.solo.make_anew
        own.solo.make_anew = lambda *given: self.make_anew(*given)  # noqa: PLW0108  # it is replaced later

    def _anew(self, model: Any, before: Vehicle, remembers: bool) -> Vehicle:
        vehicle: Vehicle = self._make_anew[before.name](model, before, remembers)
        return vehicle

    @property
    def vehicles(self) -> list[Vehicle]:
        """Vehicles with a live process."""
        return [own.solo.vehicle for own in self._own if own is not None]

    @property
    def view(self) -> Any:
        """The vehicles as seen from outside."""
        there = [one.is_alive and one.condition.is_in_contact for one in self.vehicles]
        return SimpleNamespace(vehicles=[SimpleNamespace(is_in_contact=is_in) for is_in in there])

    def _advance(self, until_s: float) -> None:
        """Let time pass."""
        while True:
            due_s, node = min((own.solo.next_s, node) for node, own in enumerate(self._own) if own is not None)
            if self._arrivals and self._arrivals[0][0] <= min(due_s, until_s):
                time_s, _, node, data = heappop(self._arrivals)
                if (own := self._own[node]) is not None:
                    self._logs[node].append(LogEntry(LineKind.HEARD, own.solo.hear(data, time_s), data))
            elif due_s >= until_s:
                break
            elif (own := self._own[node]) is not None:
                self.now_s, places_m = due_s, [(0.0, 0.0)] * len(self._own)
                for one in self.vehicles:
                    places_m[one.data.node] = one.functional.motion.x_m, one.functional.motion.y_m
                for time_s, packet in own.solo.advance(just_after(due_s)):
                    self._logs[node].append(LogEntry(LineKind.SENT, time_s, packet.data))
                    for heard in self._channel.transmit(packet.slot, node, packet.data, time_s, places_m):
                        heappush(self._arrivals, (heard.time_s, next(self._order), heard.receiver, heard.data))
        self.now_s = until_s

    def run(self) -> Outcome:
        """Run the schedule until all is healed and at rest, or something does not hold."""
        scene, names = self._scene, [plan.vehicle for plan in self._plans]
        killed = [fault for fault in scene.schedule.fault if fault.kind == "killed"]
        for time_s, name in sorted([(at_s, one.vehicle) for one in killed for at_s in (one.at_s, one.until_s or 0.0)]):
            self._advance(time_s)
            self._kill_or_go_on(names.index(name))
        self._advance(self.ended_s)
        self._channel.is_calm, scene.rested = True, False
        for frame in range(1, SETTLE_FRAMES):
            if self._broken is None and not scene.rested:
                self._advance(self.ended_s + frame * self.frame_s)
                scene.rested = frame > 1 and _is_settled(self)  # type: ignore[arg-type]
        for vehicle in self.vehicles:
            scene.lives[vehicle.name].is_alive = vehicle.is_alive
        scene.heard, scene.finished = None, self  # type: ignore[assignment]
        self._check(*self._promised)
        rows = [row for own in self._own if own is not None for row in own.solo.recorder.faults]
        happened = {kind for kind, n in self._happened.items() if n} | {row[2] for row in rows if row[2] in DECLARED}
        judged = tuple(one.name for one in self._promised)
        digest = repr([one.beliefs.model.digest() for one in self.vehicles])
        return Outcome(scene.schedule, self._broken, judged, frozenset(happened), scene.rested, self.now_s, digest)

    def _kill_or_go_on(self, node: int) -> None:
        """End the process of a vehicle, or let it go on from its log."""
        if (own := self._own[node]) is not None:
            self._happened["killed"] += 1
            self._scene.lives[own.plan.vehicle].is_alive = False
            self._own[node] = None
            return
        log = Logged(self._plans[node], tuple(self._logs[node]), None, Began(0.0, 1.0))
        own, difference = back(log, just_after(self.now_s))
        if difference and self._broken is None:
            self._broken = "exceptions", self.now_s, difference
        self._begin(node, own, LineKind.BACK)
        self._wrapping.begin_anew(own.solo.vehicle, remembers=True, logged_s=log.last_s)

    def _hear(self, heard: Heard) -> None:
        self._scene.heard = heard
        self._check(*[one for one in self._promised if one.moment == EVENT])

    def _check(self, *promised: Any) -> None:
        for one in promised:
            if self._broken is None and (text := one.broken(self._scene)) is not None:
                self._broken = one.name, self.now_s, text


def judge_nodes(schedule: Schedule) -> Outcome:
    """Run a schedule as nodes."""
    return NodeFleet(schedule).run()
