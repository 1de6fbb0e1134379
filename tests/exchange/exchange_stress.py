"""Exchange stress: managers alone on a faulty channel; vehicles fail, restart, or duplicate a node id.

Real managers with real world models in continuous time. Each copy of each packet is lost, late, doubled or damaged as
its ``Fate`` says. ``check`` raises ``InvariantBroken`` if the reference record has a flaw; ``calm`` lets a time without
losses pass, after which ``check_agreement`` and ``check_rest`` apply.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain, count, repeat
from typing import NamedTuple

from stress.reference_record import Flaw, Incarnation, ReferenceRecord, SentPacket

from benchmarks import manager_fleet
from benchmarks.manager_fleet import AREA_DONE, MAPPED_CELL, POSITION, SLOT_S, TBOX, bay
from exchange.channel import loss
from exchange.manager.manager import ExchangeManager
from exchange.packets import ItemUid, Reception
from exchange.policy.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Framing
from worldmodel import TYPE_UID, Keeping, Stated, WorldModel, merge, tidy
from worldmodel.world_model import remember


class Copy(NamedTuple):
    """One arrival of a packet at one receiver.

    Attributes:
        late_slots: by how much it comes later than sound needs, in slots.
        flips: numbers of the bits that are damaged, counted round the packet.
    """

    late_slots: float = 0.0
    flips: tuple[int, ...] = ()


Fate = tuple[Copy, ...]
"""What becomes of a packet at one receiver: each copy that arrives."""

HEARD: Fate = (Copy(),)
LOST: Fate = ()
DOUBLED: Fate = (Copy(), Copy(0.05))


def late(slots: float) -> Fate:
    """It comes so many slots late."""
    return (Copy(slots),)


def replayed(slots: float) -> Fate:
    """Received now, and again so many slots later."""
    return (Copy(), Copy(slots))


def damaged(*flips: int) -> Fate:
    """It comes with these bits flipped."""
    return (Copy(0.0, flips),)


def chances(seed: int, *fates: tuple[float, Fate]) -> Iterator[Fate]:
    """Endless random packet outcomes by probability; otherwise received."""
    for index in count():
        number = loss.uniform(seed, 0, index, 0, 0)
        for chance, fate in fates:
            number -= chance
            if number < 0.0:
                yield fate
                break
        else:
            yield HEARD


def flipped(data: bytes, flips: Iterable[int]) -> bytes:
    """The bytes with these bits turned; numbers count round."""
    damaged = bytearray(data)
    for bit in flips:
        byte, place = divmod(bit % (8 * len(damaged)), 8)
        damaged[byte] ^= 128 >> place
    return bytes(damaged)


class InvariantBroken(AssertionError):
    """Something happened that must never happen, whatever the sea does."""


Make = Callable[[int, int, WorldModel | None, float], tuple[WorldModel, ExchangeManager]]
"""Makes world model and manager of a node in an epoch, at a time; with the world model of its life before if kept."""


class Fleet(ReferenceRecord):
    """Managers on a sea where everything goes wrong that is asked for.

    Args:
        make: makes a vehicle.
        schedule: of all.
        offsets_s: by how much the clock of each node is ahead (s).
        travel_s: from the start of a slot until the packet is complete at a receiver (s).
    """

    def __init__(
        self,
        make: Make,
        schedule: TdmaSchedule,
        offsets_s: Sequence[float] = (),
        travel_s: float = 1.0,
    ) -> None:
        super().__init__()
        self.make = make
        self.schedule = schedule
        self.n_nodes = schedule.n_nodes
        self.offsets_s = tuple(offsets_s) or (0.0,) * self.n_nodes
        self.travel_s = travel_s
        self.now_s = 0.0
        self.faults: list[tuple[float, int, str]] = []
        self.aired: list[SentPacket] = []
        self._fates: Iterator[Fate] = repeat(HEARD)
        self._order = count()
        self._events: list[tuple[float, int, Incarnation | int, int | tuple[SentPacket, tuple[int, ...]]]] = []
        for node in range(self.n_nodes):
            self._begin(node, 0, None)

    # Vehicles ------------------------------------------------------------------------------------

    def _begin(self, node: int, epoch: int, store: WorldModel | None, is_twin: bool = False) -> None:
        before = self.lives.get(node)
        model, manager = self.make(node, epoch, store, max(0.0, self.now_s + self.offsets_s[node]))
        number = 0 if before is None else before.number + 1
        life = Incarnation(node, number, epoch, model, manager, self.offsets_s[node], is_twin=is_twin)
        if store is not None and before is not None:
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
            elif isinstance(who, int) and not isinstance(what, int):
                self._arrive(who, *what)
        self.now_s = end_s
        for life in self.all_alive():
            given_up = [fault.guid for fault in tidy(life.model, self.now_s + life.offset_s)]
            life.gave_up.update(given_up)
            if given_up:
                life.manager.give_up(given_up)

    def run_frames(self, n: int, fates: Iterable[Fate] = ()) -> None:
        """Let so many rounds pass."""
        self.run(n * self.n_nodes, fates)

    def _schedule(self, time_s: float, who: Incarnation | int, what: int | tuple[SentPacket, tuple[int, ...]]) -> None:
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
        self.aired.append(aired)
        for node in range(self.n_nodes):
            if node != life.node:
                self.send(aired, node, next(self._fates))
        next_slot = slot + self.n_nodes
        self._schedule(self.schedule.start_s(next_slot) - life.offset_s, life, next_slot)

    def send(self, aired: SentPacket, receiver: int, fate: Fate) -> None:
        """Let copies of a packet arrive at a receiver."""
        for copy in fate:
            arrival_s = self.now_s + self.travel_s + copy.late_slots * self.schedule.slot_s
            self._schedule(arrival_s, receiver, (aired, copy.flips))

    def _arrive(self, node: int, aired: SentPacket, flips: tuple[int, ...]) -> None:
        data = flipped(aired.data, flips)
        for life in self.all_alive():
            if life.node == node and life is not aired.sender:
                self._hear(life, aired, data)

    def _hear(self, life: Incarnation, aired: SentPacket, data: bytes) -> Reception:
        own_s = self.now_s + life.offset_s
        reception = life.manager.receive(data, own_s)
        life.has_noticed |= reception.conflict is not None
        if reception.fault is not None:
            self.faults.append((self.now_s, life.node, reception.fault))
        elif data != aired.data:
            raise InvariantBroken(f"{life.name} takes a damaged packet of {aired.sender.name} for good")
        else:
            if reception.sender != aired.sender.node:
                raise InvariantBroken(f"{life.name} takes a packet of {aired.sender.node} for {reception.sender}'s")
            self.note_taken(life, aired)
            self.note_decoded(life, reception.items)
        merge(life.model, reception.blocks, own_s)
        return reception

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


def _refuse(flaws: Iterator[Flaw], when: str = "") -> None:
    """Raise InvariantBroken for the first flaw, if there is one."""
    flaw = next(flaws, None)
    if flaw is not None:
        raise InvariantBroken(f"{flaw.breach}{when}: {flaw.text}")


# Vehicles ----------------------------------------------------------------------------------------

NEW_INSTANCES = 16
AREA = TBOX.class_named("Area").uid
PRIORITIES = {MAPPED_CELL: 1, AREA_DONE: 2, TYPE_UID: 3, POSITION: 2}


@cache
def _codec_of(n_nodes: int, policy: str, crc_bits: int) -> Codec:
    """Names areas that vehicles create too."""
    n_instances = len(manager_fleet.instances(n_nodes)) + n_nodes * NEW_INSTANCES
    fleet = n_instances, n_nodes, POLICIES[policy], manager_fleet.N_BLOCKS, manager_fleet.DURATION_S
    return Codec(TBOX, *fleet, framing=Framing(crc_bits))


def fleet_of(
    n_nodes: int,
    policy: str = "ack",
    payload_bytes: int = 64,
    offsets_s: Sequence[float] = (),
    crc_bits: int = 0,
) -> Fleet:
    """Vehicles that need all items of all others."""
    schedule, everything = TdmaSchedule(n_nodes, SLOT_S - 0.5, 0.5), manager_fleet.needs(range(n_nodes), PRIORITIES)

    def make(node: int, epoch: int, store: WorldModel | None, now_s: float) -> tuple[WorldModel, ExchangeManager]:
        model = WorldModel(
            TBOX, node, manager_fleet.instances(n_nodes), n_origins=n_nodes,
            run_time_instances_per_origin=NEW_INSTANCES, epoch=epoch, keeping=Keeping(waiting_s=120.0),
        )  # fmt: skip
        manager = ExchangeManager(
            node, model, _codec_of(n_nodes, policy, crc_bits), schedule, POLICIES[policy], 8 * payload_bytes,
            everything,
        )  # fmt: skip
        if store is not None:
            remember(model, store, now_s)
            manager.resume(now_s)
        return model, manager

    return Fleet(make, schedule, offsets_s)


def maps(fleet: Fleet, who: int | Incarnation, *cells: int) -> tuple[ItemUid, ...]:
    """Let a vehicle map cells of the bay, in one block."""
    return fleet.record(who, *((bay(fleet.n_nodes), MAPPED_CELL, cell) for cell in cells))


def creates(fleet: Fleet, who: int | Incarnation) -> tuple[ItemUid, ...]:
    """Let a vehicle create an area, and say in another block that it is done: this waits where it comes first."""
    life = fleet.lives[who] if isinstance(who, int) else who
    uid = life.model.new_instance_uid()
    return fleet.record(life, (uid, TYPE_UID, AREA)) + fleet.record(life, (uid, AREA_DONE, life.node))
