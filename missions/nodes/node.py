"""A vehicle by itself, a driver and a pace: it speaks in its slots and hears what the driver gives, until its end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from exchange.acoustics import loss
from exchange.drivers import Driver, Pace, TimedPacket
from exchange.errors import PeerFault
from missions.nodes.alone import LoneVehicle
from missions.nodes.frontseat import OwnBody, Placed
from missions.nodes.logs import LineKind, LogEntry, NodeLog
from remoras.solo import just_after
from remoras.vehicle import Vehicle

DOUBLES = 40
"""`trial` of the draws that say which packets a receiver hears twice; those of losses are 0, as in a run."""


@dataclass(frozen=True, slots=True)
class Mishaps:
    """What befalls packets at a receiver, beside what their way does to them.

    A draw is a pure function of seed, slot, sender and receiver. Those of losses are the draws of the channel
    ``bernoulli``: a fleet in one process loses the same packets at the same rate.

    Attributes:
        p_lost: share of the packets that is lost; p_doubled: share of the others that is heard twice.
    """

    p_lost: float = 0.0
    p_doubled: float = 0.0

    def copies(self, seed: int, slot: int, sender: int, receiver: int) -> int:
        """How often a packet is heard: 0, 1 or 2.

        Args:
            seed: root of all draws.
            slot: in which it was sent; sender, receiver: nodes.
        """
        if loss.uniform(seed, 0, slot, sender, receiver) < self.p_lost:
            return 0
        return 2 if loss.uniform(seed, DOUBLES, slot, sender, receiver) < self.p_doubled else 1


@dataclass(frozen=True, slots=True)
class NodeOutcome:
    """What came of a node.

    Attributes:
        vehicle: its name; time_s: time of the mission at its end.
        packets_sent, packets_heard: of its own and of others; those that were heard and not taken are packets_refused.
        packets_lost, packets_doubled: drawn at this receiver.
        items: that it holds; open: those that it takes somebody to lack.
        digest: highest contiguous sequence and mask of those above, by the name of the origin, ``.eN`` behind it in
            later epochs.
        state_hash: equal if, and only if, vehicles hold the same items.
        is_alive: True while it has energy and no fault has taken it away.
        late_s: by how much it was behind its pace at most (s of the mission).
        packets_withheld: of its own that were not sent, since its clock was not sure enough.
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
    digest: dict[str, tuple[int, int]]
    state_hash: str
    is_alive: bool
    late_s: float
    packets_withheld: int = 0


class VehicleNode:
    """One vehicle that speaks and hears through a driver.

    Args:
        own: its vehicle.
        driver: carries its packets; closed with the node.
        pace: what time of the mission it is.
        log: takes every packet with its time; None for no log.
        mishaps: drawn for each packet that is heard.
        body: of the vehicle, if it is one of its own, as the plan says; closed with the node.
        witness: is told the vehicle and the time whenever something may have become of it.
    """

    def __init__(
        self,
        own: LoneVehicle,
        driver: Driver,
        pace: Pace,
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
        if log is not None and own.salt and own.lives == 1:
            log.write(LogEntry(LineKind.SALT, own.plan.begins_s, own.salt))

    @property
    def next_s(self) -> float:
        """When something happens next that is not heard (s)."""
        return self.solo.next_s

    def run(self) -> NodeOutcome:
        """Go on until the end of the plan, and close the driver."""
        try:
            while self.next_s < self._plan.end_s:
                self.step()
            self._advance(self._plan.end_s)
            found = self.outcome()
            if self._log is not None:
                self._log.end(found.time_s, found.state_hash)
            return found
        finally:
            self._driver.close()
            if self._body is not None:
                self._body.close()
            if self._log is not None:
                self._log.close()

    def step(self) -> None:
        """Hear what there is to hear, and do what is due next, or wait for either."""
        due_s = self.next_s
        for heard in self._driver.receive(due_s):
            self._hear(heard)
        now_s = self._pace.now_s
        if self._body is not None:
            self._find(self._body, min(now_s, due_s))
        if now_s >= due_s:
            if now_s < self._plan.end_s:
                self._late_s = max(self._late_s, now_s - due_s)
            self._advance(just_after(due_s))

    def outcome(self) -> NodeOutcome:
        """What has come of it so far."""
        vehicle, names = self.solo.vehicle, self._setup.database.names
        model = vehicle.beliefs.model
        digest = {
            f"{names[origin]}.e{epoch}" if epoch else names[origin]: held
            for (origin, epoch), held in sorted(model.digest().items())
        }
        return NodeOutcome(
            vehicle.name,
            self.solo.horizon_s,
            self._counts[LineKind.SENT],
            self._counts[LineKind.HEARD],
            self._counts[LineKind.LOST],
            self._n_doubled,
            self.solo.n_refused,
            sum(highest + 1 + mask.bit_count() for highest, mask in digest.values()),
            vehicle.radio.manager.n_open,
            digest,
            model.state_hash(),
            vehicle.is_alive,
            round(self._late_s, 3),
            self._n_withheld,
        )

    def _hear(self, heard: TimedPacket) -> None:
        copies = self._copies(heard)
        self._n_doubled += copies == 2
        if not copies:
            self._note(LineKind.LOST, heard.time_s, heard.data)
        for _ in range(copies):
            self._note(LineKind.HEARD, self.solo.hear(heard.data, heard.time_s), heard.data)

    def _copies(self, heard: TimedPacket) -> int:
        """How often a packet is heard; one whose head cannot be read once, so that it is refused and counted."""
        try:
            head = self._setup.codec.head(heard.data)
        except PeerFault:
            return 1
        schedule = self._setup.schedule
        slot = schedule.slot_named(head, heard.time_s)
        return self._mishaps.copies(self._plan.seed, slot, head.sender, self.solo.vehicle.data.node)

    def _find(self, body: OwnBody, now_s: float) -> None:
        """Take in where the body is."""
        fix = body.fix()
        if fix is not None and fix.is_sound and self._steered is not None:
            self._note(LineKind.FIX, self.solo.note(Placed(self._steered, fix), now_s), fix.data)

    def _advance(self, until_s: float) -> None:
        for sent in self.solo.advance(until_s):
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
