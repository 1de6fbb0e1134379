"""Node: one vehicle with a driver and a pace, until the end of its plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from exchange.channel import loss
from exchange.drivers import Driver, Paced, TimedPacket
from exchange.errors import PeerFault
from missions.nodes.alone import LoneVehicle
from missions.nodes.frontseat import OwnBody, placed
from missions.nodes.logs import LineKind, LogEntry, NodeLog
from remoras.fleet.standalone import just_after
from remoras.fleet.vehicle import Vehicle

DOUBLES = 40  # `trial` of the draws of duplicated packets; those of losses use 0, as in a run


@dataclass(frozen=True, slots=True)
class Mishaps:
    """Random loss and duplication (of packets not lost) at a receiver, in addition to the channel.

    Losses use the draws of the channel ``bernoulli``, so a simulated fleet loses the same packets at the same rate.
    """

    p_lost: float = 0.0
    p_doubled: float = 0.0

    def copies(self, seed: int, slot: int, sender: int, receiver: int) -> int:
        """Return the number of copies received: 0, 1 or 2."""
        if loss.uniform(seed, 0, slot, sender, receiver) < self.p_lost:
            return 0
        return 2 if loss.uniform(seed, DOUBLES, slot, sender, receiver) < self.p_doubled else 1


@dataclass(frozen=True, slots=True)
class NodeOutcome:
    """Final state of a node; packets are ``withheld`` because of clock uncertainty.

    ``items`` are stored, ``open`` ones outstanding; ``late_s`` is the maximum delay behind the pace (s of the mission).
    """

    vehicle: str
    time_s: float
    packets_sent: int
    packets_heard: int
    packets_lost: int
    packets_doubled: int
    packets_refused: int
    items: int
    open: int
    state_hash: str
    is_alive: bool
    late_s: float
    packets_withheld: int = 0


class VehicleNode:
    """Vehicle that exchanges packets through a driver; it owns and closes ``driver``, ``log`` and ``body``.

    ``witness`` is called with vehicle and time after each step.
    """

    def __init__(
        self,
        own: LoneVehicle,
        driver: Driver,
        pace: Paced,
        log: NodeLog | None = None,
        mishaps: Mishaps | None = None,
        body: OwnBody | None = None,
        witness: Callable[[Vehicle, float], None] | None = None,
    ) -> None:
        self._plan, self._setup, self.solo = own.plan, own.setup, own.solo
        self._body, self._steered, self._witness = body, own.steered, witness
        self._driver = driver
        self._pace = pace
        self._log = log
        self._mishaps = mishaps or Mishaps()
        self._counts: Counter[LineKind] = Counter()
        self._n_doubled = self._n_withheld = 0
        self._late_s = 0.0
        self._tolerance_s = own.setup.scenario.communication.clock_tolerance_s
        # A resumed node logs its salt in the line of its restart.
        if log is not None and own.salt and own.lives == 1:
            log.write(LogEntry(LineKind.SALT, own.plan.begins_s, own.salt))

    def run(self) -> NodeOutcome:
        """Run until the end of the plan; close driver, body and log."""
        try:
            while self.solo.next_s < self._plan.end_s:
                self.step()
            self._advance(self._plan.end_s)
            outcome = self.outcome()
            if self._log is not None:
                self._log.end(outcome.time_s, outcome.state_hash)
            return outcome
        finally:
            self._driver.close()
            if self._body is not None:
                self._body.close()
            if self._log is not None:
                self._log.close()

    def step(self) -> None:
        """Process received packets and the next due event, or wait for either."""
        due_s = self.solo.next_s  # except receptions
        for packet in self._driver.receive(due_s):
            self._hear(packet)
        now_s = self._pace.now_s
        if self._body is not None:
            self._find(self._body, min(now_s, due_s))
        if now_s >= due_s:
            if now_s < self._plan.end_s:
                self._late_s = max(self._late_s, now_s - due_s)
            self._advance(just_after(due_s))

    def outcome(self) -> NodeOutcome:
        """Return packet counts, stored and open items, and the hash of the world model."""
        vehicle = self.solo.vehicle
        model = vehicle.beliefs.model
        return NodeOutcome(
            vehicle.name,
            self.solo.horizon_s,
            self._counts[LineKind.SENT],
            self._counts[LineKind.HEARD],
            self._counts[LineKind.LOST],
            self._n_doubled,
            self.solo.n_refused,
            sum(highest + 1 + mask.bit_count() for highest, mask in model.digest().values()),
            vehicle.radio.manager.n_open,
            model.state_hash(),
            vehicle.is_alive,
            round(self._late_s, 3),
            self._n_withheld,
        )

    def _hear(self, packet: TimedPacket) -> None:
        copies = self._copies(packet)
        self._n_doubled += copies == 2
        if not copies:
            self._note(LineKind.LOST, packet.time_s, packet.data)
        # The vehicle may accept a packet later than it came; the log has the time that a replay must repeat.
        for _ in range(copies):
            self._note(LineKind.HEARD, self.solo.hear(packet.data, packet.time_s), packet.data)

    def _copies(self, packet: TimedPacket) -> int:
        """Return the number of copies; 1 for an unreadable packet, which is then rejected."""
        try:
            head = self._setup.codec.head(packet.data)
        except PeerFault:
            return 1
        schedule = self._setup.schedule
        slot = schedule.slot_named(head, packet.time_s)
        return self._mishaps.copies(self._plan.seed, slot, head.sender, self.solo.vehicle.data.node)

    def _find(self, body: OwnBody, now_s: float) -> None:
        fix = body.fix()
        if fix is not None and fix.is_sound and self._steered is not None:
            self._note(LineKind.FIX, self.solo.note(placed(self._steered, fix), now_s), fix.data)

    def _advance(self, until_s: float) -> None:
        for sent in self.solo.advance(until_s):
            # A withheld packet is logged too: for the vehicle itself it is sent.
            self._note(LineKind.SENT, sent.time_s, sent.packet.data)
            if self._pace.uncertainty_s <= self._tolerance_s:
                self._driver.send(sent.packet.data, sent.time_s)
            else:
                self._n_withheld += 1
        if self._body is not None and self._steered is not None and (goal := self._steered.goal) is not None:
            is_over = until_s >= self._plan.until_s or not self.solo.vehicle.is_alive
            self._body.guide(goal.target_m, 0.0 if is_over else goal.speed_mps)
        if self._witness is not None:
            self._witness(self.solo.vehicle, until_s)

    def _note(self, kind: LineKind, time_s: float, data: bytes) -> None:
        self._counts[kind] += 1
        if self._log is not None:
            self._log.write(LogEntry(kind, time_s, data))
