"""Exchange stress: managers alone on a faulty channel; vehicles fail, restart, or duplicate a node id.

Real managers with real world models in continuous time. Each copy of each packet is lost, late or doubled as its
``Fate`` says. ``check`` raises ``InvariantBroken`` if the reference record has a flaw; ``calm`` lets a time without
losses pass, after which ``check_agreement`` and ``check_rest`` apply.
"""

from __future__ import annotations

import heapq
import random
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, count, repeat

from stress.reference_record import Incarnation, ReferenceRecord, SentPacket

from benchmarks import manager_fleet
from benchmarks.manager_fleet import AREA_DONE, MAPPED_CELL, POSITION, SLOT_S, TBOX, bay
from exchange.manager.manager import ExchangeManager
from exchange.packets import ItemUid
from exchange.policy.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec
from worldmodel import TYPE_UID, Keeping, Stated, WorldModel, merge, tidy
from worldmodel.world_model import remember

Fate = tuple[float, ...]
"""What becomes of a packet at one receiver: by how many slots each copy comes later than sound needs."""
HEARD: Fate = (0.0,)
LOST: Fate = ()
DOUBLED: Fate = (0.0, 0.05)
TRAVEL_S = 1.0
"""From the start of a slot until the packet is complete at a receiver (s)."""


def chances(seed: int, *fates: tuple[float, Fate]) -> Iterator[Fate]:
    """Endless random packet outcomes by probability; otherwise received."""
    draws, rest = random.Random(seed), 1.0 - sum(chance for chance, _ in fates)
    while True:
        yield from draws.choices([HEARD, *(fate for _, fate in fates)], [rest, *(chance for chance, _ in fates)])


class InvariantBroken(AssertionError):
    """Something happened that must never happen, whatever the sea does."""


NEW_INSTANCES = 16
AREA = TBOX.class_named("Area").uid
PRIORITIES = {MAPPED_CELL: 1, AREA_DONE: 2, TYPE_UID: 3, POSITION: 2}


@cache
def _codec_of(n_nodes: int, policy: str) -> Codec:
    """Names areas that vehicles create too."""
    n_instances = len(manager_fleet.instances(n_nodes)) + n_nodes * NEW_INSTANCES
    fleet = n_instances, n_nodes, POLICIES[policy], manager_fleet.N_BLOCKS, manager_fleet.DURATION_S
    return Codec(TBOX, *fleet)


class Fleet(ReferenceRecord):
    """Managers that need all items of all others, on a sea where everything goes wrong that is asked for.

    Args:
        offsets_s: by how much the clock of each node is ahead (s).
    """

    def __init__(
        self, n_nodes: int, policy: str = "ack", payload_bytes: int = 64, offsets_s: Sequence[float] = ()
    ) -> None:
        super().__init__()
        self.n_nodes, self._policy, self._payload_bits = n_nodes, policy, 8 * payload_bytes
        self.schedule = TdmaSchedule(n_nodes, SLOT_S - 0.5, 0.5)
        self._needs = manager_fleet.needs(range(n_nodes), PRIORITIES)
        self._offsets_s = tuple(offsets_s) or (0.0,) * n_nodes
        self.now_s = 0.0
        self._fates: Iterator[Fate] = repeat(HEARD)
        self._order = count()
        self._events: list[tuple[float, int, Incarnation | int, int | SentPacket]] = []
        for node in range(n_nodes):
            self._begin(node, 0, None)

    # Vehicles ------------------------------------------------------------------------------------

    def _begin(self, node: int, epoch: int, store: WorldModel | None, is_twin: bool = False) -> None:
        before = self.lives.get(node)
        model = WorldModel(
            TBOX, node, manager_fleet.instances(self.n_nodes), n_origins=self.n_nodes,
            run_time_instances_per_origin=NEW_INSTANCES, epoch=epoch, keeping=Keeping(waiting_s=120.0),
        )  # fmt: skip
        codec, policy = _codec_of(self.n_nodes, self._policy), POLICIES[self._policy]
        manager = ExchangeManager(node, model, codec, self.schedule, policy, self._payload_bits, self._needs)
        number = 0 if before is None else before.number + 1
        life = Incarnation(node, number, epoch, model, manager, self._offsets_s[node], is_twin=is_twin)
        if store is not None and before is not None:
            now_s = max(0.0, self.now_s + life.offset_s)
            remember(model, store, now_s)
            manager.resume(now_s)
            life.inherit(before)
        if is_twin:
            self.twins.append(life)
            self.doubled.add(node)
        else:
            self.lives[node] = life
        self._let_speak(life)

    def die(self, node: int) -> None:
        """Switch a vehicle off."""
        self.lives[node].is_alive = False

    def restart(self, node: int, keeps: bool = False) -> None:
        """Switch a vehicle off and on again.

        Args:
            node: which.
            keeps: it begins its next epoch with what its world model held; else it knows nothing.
        """
        self.die(node)
        before = self.lives[node]
        self.past.append(before)
        self._begin(node, before.epoch + 1, before.model if keeps else None)

    def add_twin(self, node: int) -> None:
        """Let a second vehicle use the number of another, and so its slot."""
        self._begin(node, 0, None, is_twin=True)

    def remove_twins(self) -> None:
        """Let the second vehicles of a number go."""
        for life in self.twins:
            life.is_alive = False
        self.past += self.twins
        self.twins.clear()

    # What is recorded ----------------------------------------------------------------------------

    def record(self, who: int | Incarnation, *facts: Stated) -> tuple[ItemUid, ...]:
        """Let a vehicle record facts of its own and offer them; returns the items."""
        life = self.lives[who] if isinstance(who, int) else who
        change = life.model.record(facts, max(0.0, self.now_s + life.offset_s))
        self.note_recorded(life, change.block)
        fragments = life.manager.offer([change])
        life.take(fragments)
        return tuple(fragment.uid for fragment in fragments)

    # Time ----------------------------------------------------------------------------------------

    def run(self, slots: float, fates: Iterable[Fate] = ()) -> None:
        """Let time pass; a packet that is on its way when it ends arrives in the next call.

        Args:
            slots: how long.
            fates: of packets, receiver by receiver in the order of transmissions and nodes; behind them all is heard.
        """
        self._fates = chain(fates, repeat(HEARD))
        end_s = self.now_s + slots * self.schedule.slot_s
        while self._events and self._events[0][0] < end_s:
            self.now_s, _, who, what = heapq.heappop(self._events)
            if isinstance(who, Incarnation) and isinstance(what, int):
                if who.is_alive:
                    self._speak(who, what)
            elif isinstance(who, int) and isinstance(what, SentPacket):
                for life in self.all_alive():
                    if life.node == who and life is not what.sender:
                        self._hear(life, what)
        self.now_s = end_s
        for life in self.all_alive():
            given_up = [fault.guid for fault in tidy(life.model, self.now_s + life.offset_s)]
            life.gave_up.update(given_up)
            if given_up:
                life.manager.give_up(given_up)

    def run_frames(self, n: int, fates: Iterable[Fate] = ()) -> None:
        """Let so many rounds pass."""
        self.run(n * self.n_nodes, fates)

    def _schedule(self, time_s: float, who: Incarnation | int, what: int | SentPacket) -> None:
        heapq.heappush(self._events, (time_s, next(self._order), who, what))

    def _let_speak(self, life: Incarnation) -> None:
        """Await the next slot of a vehicle by its own clock."""
        slot = self.schedule.slot_at(max(0.0, self.now_s + life.offset_s))
        while self.schedule.owner(slot) != life.node or self.schedule.start_s(slot) - life.offset_s < self.now_s:
            slot += 1
        self._schedule(self.schedule.start_s(slot) - life.offset_s, life, slot)

    def _speak(self, life: Incarnation, slot: int) -> None:
        sent = life.manager.packet_to_send(self.schedule.start_s(slot))
        fragments = []
        for uid in sent.items:
            fragment = life.parts.get((uid.origin, uid.epoch, uid.sequence), {}).get(uid.part)
            if fragment is None:
                raise InvariantBroken(f"{life.name} says {uid}, which it was never given")
            fragments.append(fragment)
        aired = SentPacket(life, slot, sent.data, tuple(fragments))
        for node in range(self.n_nodes):
            for late_slots in next(self._fates) if node != life.node else ():
                self._schedule(self.now_s + TRAVEL_S + late_slots * self.schedule.slot_s, node, aired)
        next_slot = slot + self.n_nodes
        self._schedule(self.schedule.start_s(next_slot) - life.offset_s, life, next_slot)

    def _hear(self, life: Incarnation, aired: SentPacket) -> None:
        own_s = self.now_s + life.offset_s
        reception = life.manager.receive(aired.data, own_s)
        life.has_noticed |= reception.conflict is not None
        if reception.fault is None:
            if reception.sender != aired.sender.node:
                raise InvariantBroken(f"{life.name} takes a packet of {aired.sender.node} for {reception.sender}'s")
            self.note_taken(life, aired)
            self.note_decoded(life, reception.items)
        merge(life.model, reception.blocks, own_s)

    def check(self) -> None:
        """Raise InvariantBroken if anything is believed or known that is not so, or was lost."""
        _refuse(self.flaws(), f" at {self.now_s:g} s")

    # Calm ----------------------------------------------------------------------------------------

    def calm(self, frames: int) -> None:
        """Deliver late packets, then let rounds pass without losses."""
        self.remove_twins()
        latest_s = max((time_s for time_s, _, who, _ in self._events if isinstance(who, int)), default=self.now_s)
        self.run((latest_s - self.now_s) / self.schedule.slot_s + 0.5)
        self.run_frames(frames)
        self.check()

    def check_agreement(self, of_all: bool = True) -> None:
        """Raise InvariantBroken if live vehicles hold different items or a queue is not empty.

        Args:
            of_all: also of items whose origin lives no more; else of those whose origin could say them.
        """
        _refuse(self.apart(self.all_alive(), of_all))

    def check_rest(self) -> None:
        """Raise InvariantBroken if a manager still has something to say, or waits for something."""
        _refuse(self.restless(self.all_alive()))


def _refuse(flaws: Iterator[str], when: str = "") -> None:
    """Raise InvariantBroken for the first flaw, if there is one."""
    flaw = next(flaws, None)
    if flaw is not None:
        raise InvariantBroken(f"{flaw}{when}")


def maps(fleet: Fleet, who: int | Incarnation, *cells: int) -> tuple[ItemUid, ...]:
    """Let a vehicle map cells of the bay, in one block."""
    return fleet.record(who, *((bay(fleet.n_nodes), MAPPED_CELL, cell) for cell in cells))


def creates(fleet: Fleet, who: int | Incarnation) -> tuple[ItemUid, ...]:
    """Let a vehicle create an area, and say in another block that it is done: this waits where it comes first."""
    life = fleet.lives[who] if isinstance(who, int) else who
    uid = life.model.new_instance_uid()
    return fleet.record(life, (uid, TYPE_UID, AREA)) + fleet.record(life, (uid, AREA_DONE, life.node))
