"""A rough sea for exchange managers: whatever befalls packets and vehicles, and a record of what is true meanwhile.

`Storm` runs real managers with real world models in continuous time. Each copy of each packet is lost, heard, late,
doubled or damaged as a `Fate` says; vehicles die, restart with or without memory, join late, use another's number and
have clocks of their own. An independent record knows what was recorded, by content, and what each vehicle was given.
It is made of what went into `record` and of which packets were taken, not of what managers say of each other.

The law. Vehicle v believes that peer p holds item u. This is false if p, in its present life, does not hold the
content that v holds under the name u. It is excused while v has not taken any packet of p's present life, provided it
is not p's first: v cannot know of a restart before it hears of it. Nothing else is excused, with one exception. While
two vehicles use one number, their items have the same names: those are excused that have not noticed, and all others
as to items of that number; with ``forgives_names`` even the two as to names that both have given. What a vehicle gave
up (parts of a block that never came whole, a block that waited too long) it does not hold; peers know it at the latest
when a calm is over.

`check` raises `LawBroken` if there is a false belief, a value that nobody recorded, a part of a block in a world model,
or if a vehicle lost what it held. `calm` lets a time without losses pass and checks that all who live agree and are
at rest. Nothing here needs Hypothesis; the same calls make a scripted test.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, count, repeat
from typing import Protocol

from storm_lives import HEARD, Aired, Fate, Life, flipped

from exchange.manager import ExchangeManager
from exchange.packets import ItemUid, Reception
from exchange.schedule import TdmaSchedule
from worldmodel import Block, PropertyValue, Stated, WorldModel, merge, tidy
from worldmodel.facts import Guid


class LawBroken(AssertionError):
    """Something happened that must never happen, whatever the sea does."""


class Make(Protocol):
    """Makes the world model and the manager of a vehicle that begins a life."""

    def __call__(
        self, node: int, epoch: int, store: WorldModel | None, now_s: float
    ) -> tuple[WorldModel, ExchangeManager]:
        """Make them; ``store`` is the world model of the life before, if it was kept."""


class Storm:
    """Managers on a sea where everything goes wrong that is asked for.

    Args:
        make: makes a vehicle.
        schedule: of all.
        offsets_s: by how much the clock of each node is ahead (s).
        absent: nodes that are not there from the beginning.
        travel_s: from the start of a slot until the packet is complete at a receiver (s).
        tolerates_damage: do not regard it as a breach if a damaged packet passes for a good one.
    """

    def __init__(
        self,
        make: Make,
        schedule: TdmaSchedule,
        offsets_s: Sequence[float] = (),
        absent: Iterable[int] = (),
        travel_s: float = 1.0,
        tolerates_damage: bool = False,
    ) -> None:
        self.make = make
        self.schedule = schedule
        self.n_nodes = schedule.n_nodes
        self.offsets_s = tuple(offsets_s) or (0.0,) * self.n_nodes
        self.travel_s = travel_s
        self.tolerates_damage = tolerates_damage
        self.now_s = 0.0
        self.recorded: dict[Guid, set[Block]] = {}
        self.statuses: set[tuple[int, float, PropertyValue]] = set()
        self.faults: list[tuple[float, int, str]] = []
        self.lives: dict[int, Life] = {}
        self.past: list[Life] = []
        self.twins: list[Life] = []
        self.doubled: set[int] = set()
        self.forgives_names = False
        self.aired: list[Aired] = []
        self._fates: Iterator[Fate] = repeat(HEARD)
        self._order = count()
        self._events: list[tuple[float, int, Life | int, int | tuple[Aired, tuple[int, ...]]]] = []
        for node in range(self.n_nodes):
            if node not in set(absent):
                self._begin(node, 0, None)

    # Vehicles ------------------------------------------------------------------------------------

    def _begin(self, node: int, epoch: int, store: WorldModel | None, is_twin: bool = False) -> Life:
        before = self.lives.get(node)
        model, manager = self.make(node, epoch, store, max(0.0, self.now_s + self.offsets_s[node]))
        number = 0 if before is None else before.number + 1
        life = Life(node, number, epoch, model, manager, self.offsets_s[node], is_twin=is_twin)
        if store is not None and before is not None:
            for guid, parts in before.parts.items():
                if before.is_whole(guid) and model.has_arrived(guid):
                    life.take(part for part in parts.values() if before.holds(part))
        if is_twin:
            self.twins.append(life)
            self.doubled.add(node)
        else:
            self.lives[node] = life
        self._let_speak(life)
        return life

    def all_alive(self) -> list[Life]:
        """The vehicles that are switched on, twins behind the others."""
        return [life for life in (*self.lives.values(), *self.twins) if life.is_alive]

    def is_alive(self, node: int) -> bool:
        """True while the vehicle is switched on."""
        return node in self.lives and self.lives[node].is_alive

    def die(self, node: int) -> None:
        """Switch a vehicle off."""
        self.lives[node].is_alive = False

    def start(self, node: int, keeps: bool = False) -> Life:
        """Switch a vehicle on that is off, or was never there.

        Args:
            node: which.
            keeps: it begins its next epoch with what its world model held; else it knows nothing.
        """
        before = self.lives.get(node)
        if before is None:
            return self._begin(node, 0, None)
        self.past.append(before)
        return self._begin(node, before.epoch + 1, before.model if keeps else None)

    def restart(self, node: int, keeps: bool = False) -> Life:
        """Switch a vehicle off and on again."""
        self.die(node)
        return self.start(node, keeps)

    def add_twin(self, node: int, epoch: int = 0) -> Life:
        """Let a second vehicle use the number of another, and so its slot."""
        return self._begin(node, epoch, None, is_twin=True)

    def remove_twins(self) -> None:
        """Let the second vehicles of a number go."""
        for life in self.twins:
            life.is_alive = False
        self.past += self.twins
        self.twins.clear()

    # What is recorded ----------------------------------------------------------------------------

    def record(self, who: int | Life, *facts: Stated) -> tuple[ItemUid, ...]:
        """Let a vehicle record facts of its own and offer them; returns the items."""
        life = self.lives[who] if isinstance(who, int) else who
        change = life.model.record(facts, max(0.0, self.now_s + life.offset_s))
        block = change.block
        if block.is_status:
            self.statuses |= {(block.origin, block.time_s, fact) for fact in block.facts}
        else:
            self.recorded.setdefault(block.guid, set()).add(block)
        fragments = life.manager.offer([change])
        life.take(fragments)
        if not block.is_status:
            life.had.add(block.guid)
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
            if isinstance(who, Life) and isinstance(what, int):
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

    def _schedule(self, time_s: float, who: Life | int, what: int | tuple[Aired, tuple[int, ...]]) -> None:
        heapq.heappush(self._events, (time_s, next(self._order), who, what))

    def _let_speak(self, life: Life) -> None:
        """Await the next slot of a vehicle by its own clock."""
        slot = self.schedule.slot_at(max(0.0, self.now_s + life.offset_s))
        while self.schedule.owner(slot) != life.node or self.schedule.start_s(slot) - life.offset_s < self.now_s:
            slot += 1
        self._schedule(self.schedule.start_s(slot) - life.offset_s, life, slot)

    def _speak(self, life: Life, slot: int) -> None:
        sent = life.manager.packet_to_send(self.schedule.start_s(slot))
        fragments = []
        for uid in sent.items:
            fragment = life.parts.get((uid.origin, uid.epoch, uid.sequence), {}).get(uid.part)
            if fragment is None:
                raise LawBroken(f"{self._name(life)} says {uid}, which it was never given")
            fragments.append(fragment)
        aired = Aired(life, slot, sent.data, tuple(fragments))
        self.aired.append(aired)
        for node in range(self.n_nodes):
            if node != life.node:
                self.send(aired, node, next(self._fates))
        next_slot = slot + self.n_nodes
        self._schedule(self.schedule.start_s(next_slot) - life.offset_s, life, next_slot)

    def send(self, aired: Aired, receiver: int, fate: Fate) -> None:
        """Let copies of a packet arrive at a receiver."""
        for copy in fate:
            arrival_s = self.now_s + self.travel_s + copy.late_slots * self.schedule.slot_s
            self._schedule(arrival_s, receiver, (aired, copy.flips))

    def _arrive(self, node: int, aired: Aired, flips: tuple[int, ...]) -> None:
        data = flipped(aired.data, flips)
        for life in self.all_alive():
            if life.node == node and life is not aired.sender:
                self._hear(life, aired, data)

    def _hear(self, life: Life, aired: Aired, data: bytes) -> Reception:
        own_s = self.now_s + life.offset_s
        reception = life.manager.receive(data, own_s)
        life.has_noticed |= reception.conflict is not None
        if reception.fault is not None:
            self.faults.append((self.now_s, life.node, reception.fault))
        elif data != aired.data:
            life.took_damaged += 1
            if not self.tolerates_damage:
                raise LawBroken(f"{self._name(life)} takes a damaged packet of {self._name(aired.sender)} for good")
        else:
            if reception.sender != aired.sender.node:
                raise LawBroken(f"{self._name(life)} takes a packet of {aired.sender.node} for {reception.sender}'s")
            life.take(aired.fragments)
            known = life.heard.get(aired.sender.node)
            if known is None or known.number <= aired.sender.number:
                life.heard[aired.sender.node] = aired.sender
        merge(life.model, reception.blocks, own_s)
        return reception

    # What is true --------------------------------------------------------------------------------

    def check(self) -> None:
        """Raise LawBroken if anything is believed or known that is not so, or was lost."""
        if false := self.false_beliefs():
            v, p, uid = false[0]
            raise LawBroken(f"{len(false)} false beliefs; at {self.now_s:g} s {v} believes that {p} holds {uid}")
        for life in self.all_alive():
            self._check_knowledge(life)

    def false_beliefs(self) -> list[tuple[str, str, ItemUid]]:
        """Who believes of whom what is false, and not excused."""
        found = []
        for life in self.all_alive():
            doubled = self.doubled - {life.node}
            if (self.twins or life.is_twin) and not life.has_noticed:
                continue
            for peer in self.lives.values():
                first = peer.number == 0
                if peer.node == life.node or not (first or life.heard.get(peer.node) is peer):
                    continue
                found += [
                    (self._name(life), self._name(peer), fragment.uid)
                    for fragment in life.fragments()
                    if fragment.origin not in doubled
                    and not (self.forgives_names and len(self.recorded[fragment.block.guid]) > 1)
                    and life.manager.believes(peer.node, fragment.uid)
                    and fragment.block.guid not in peer.gave_up
                    and not peer.holds(fragment)
                ]
        return found

    def _check_knowledge(self, life: Life) -> None:
        """Raise LawBroken if a world model has what nobody recorded, or lost what it had."""
        if life.took_damaged:
            return
        model, name = life.model, self._name(life)
        for block in chain(model.blocks(), model.arrivals.waiting.values(), model.arrivals.refused.values()):
            if block not in self.recorded.get(block.guid, ()):
                raise LawBroken(f"{name} knows {block}; recorded was {self.recorded.get(block.guid)}")
            life.had.add(block.guid)
        for status in model.statuses():
            for fact in status.facts:
                if (status.origin, status.time_s, fact) not in self.statuses:
                    raise LawBroken(f"{name} knows {status}, which nobody recorded")
        lost = [guid for guid in life.had if guid not in life.gave_up and not model.has_arrived(guid)]
        if lost:
            raise LawBroken(f"{name} lost {lost}")
        for guid in life.parts:
            if guid[0] in self.doubled or guid in life.gave_up:
                continue
            if life.is_whole(guid) and not model.has_arrived(guid):
                raise LawBroken(f"{name} was given all of {guid} and does not have it")

    # Calm ----------------------------------------------------------------------------------------

    def calm(self, frames: int) -> None:
        """Let what is late arrive, and then rounds pass in which all is heard."""
        self.remove_twins()
        latest_s = max((time_s for time_s, _, who, _ in self._events if isinstance(who, int)), default=self.now_s)
        self.run((latest_s - self.now_s) / self.schedule.slot_s + 0.5)
        self.run_frames(frames)
        self.check()

    def check_agreement(self, of_all: bool = True) -> None:
        """Raise LawBroken if those who live do not hold the same, or somebody is not at rest.

        Args:
            of_all: also of items whose origin lives no more; else of those whose origin could say them.
        """
        alive = self.all_alive()
        for life in alive:
            for other in alive:
                origins = {(one.node, one.epoch) for one in alive}
                missing = [
                    guid
                    for guid in other.had
                    if (of_all or guid[:2] in origins)
                    and other.model.has_arrived(guid)
                    and not life.model.has_arrived(guid)
                ]
                if missing:
                    raise LawBroken(f"{self._name(life)} lacks {missing[:5]} of {self._name(other)}: {len(missing)}")

    def check_rest(self) -> None:
        """Raise LawBroken if a manager still has something to say, or waits for something."""
        for life in self.all_alive():
            if life.manager.n_open:
                raise LawBroken(f"{self._name(life)} has {life.manager.n_open} items open")
            if waiting := life.model.arrivals.waiting:
                raise LawBroken(f"{self._name(life)}: {len(waiting)} blocks wait")

    def _name(self, life: Life) -> str:
        return f"{life.node}" + (f" (life {life.number})" if life.number else "") + (" (twin)" if life.is_twin else "")
