"""Fault injection: a faulty channel, wrapped vehicles, forged packets and statements; the product has no part in it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from random import Random
from types import SimpleNamespace
from typing import Any

from stress.invariants import Heard, Scene
from stress.reference_record import Incarnation, SentPacket
from stress.schedules import LINKS, OTHERS, PACKETS, Schedule, StressFault, befalls

from exchange.channel import loss
from exchange.channel.channel import Arrival, Channel
from exchange.errors import ExchangeError
from exchange.packets import Fragment, Packet, Transmission
from exchange.policy.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, Framing
from exchange.wire.definitions import Introductions
from remoras.beliefs import Fact
from remoras.fleet.fleet import Fleet
from remoras.fleet.radio import HeardPacket
from remoras.fleet.vehicle import Vehicle
from remoras.sensor import Observation
from remoras.strategy import Declaration
from remoras.work import Job, share_left
from worldmodel import Change, PropertyValue, TBox, WorldModel
from worldmodel.facts import Guid

# Channel ------------------------------------------------------------------------------------------

Forge = Callable[[bytes, int, int], bytes]
"""Makes another packet of one: ``forge(data, slot, draw)``."""

Foreign = Callable[[int, int], bytes]
"""Makes a packet of another fleet: ``foreign(sender, slot)``."""


class FaultyChannel:
    """Carries packets as the channel of the scenario does, changed by the faults of a schedule until ``is_calm``."""

    def __init__(
        self, calm: Channel, schedule: Schedule, slots: TdmaSchedule, forge: Forge, foreign: Foreign,
        happened: Counter[str], node_of: Mapping[str, int],
    ) -> None:  # fmt: skip
        self.is_calm, self._foreign = False, foreign
        self.carried: list[tuple[float, int, frozenset[int]]] = []
        """Of each packet when it was sent (s), by whom and who heard it."""
        self._calm, self._slots, self._forge, self._happened, self._seed = calm, slots, forge, happened, schedule.seed
        self._faults = [
            (number, fault, node_of.get(fault.vehicle), node_of.get(fault.peer))
            for number, fault in schedule.numbered()
            if fault.kind in LINKS | OTHERS
        ]

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Arrivals of the scenario's channel, changed by the faults."""
        arrivals = self._calm.transmit(slot, sender, data, now_s, positions_m)
        for number, fault, vehicle, peer in () if self.is_calm else self._faults:
            if not fault.holds(now_s):
                continue
            if fault.kind in OTHERS:
                if befalls(self._seed, number, slot, 0, fault.share):
                    self._happened[fault.kind] += 1
                    arrivals += self._others(number, fault, slot, sender, now_s)
                continue
            if fault.kind == "echo":
                if sender == vehicle and befalls(self._seed, number, slot, sender, fault.share):
                    self._happened["echo"] += 1
                    late_s = self._slots.packet_s + fault.slots * self._slots.slot_s
                    arrivals.append(Arrival(sender, now_s + late_s, data))
                continue
            changed: list[Arrival] = []
            for one in arrivals:
                ends = [(sender, one.receiver)]
                if fault.kind == "partition" and not fault.one_way:
                    ends.append((one.receiver, sender))
                is_meant = any(vehicle in (None, a) and peer in (None, b) for a, b in ends)
                found = self._befallen(number, fault, slot, one) if is_meant else [one]
                self._happened[fault.kind] += found != [one]
                changed += found
            arrivals = changed
        self.carried.append((now_s, sender, frozenset(arrival.receiver for arrival in arrivals)))
        return sorted(arrivals, key=lambda arrival: (arrival.receiver, arrival.time_s))

    def _others(self, number: int, fault: StressFault, slot: int, sender: int, now_s: float) -> list[Arrival]:
        """Receptions of all in a slot beside its packet: noise, or a packet of another fleet."""
        heard_s, dice = now_s + self._slots.packet_s, Random(f"{self._seed} {number} {slot}")
        if fault.kind == "noise":
            packets = [dice.randbytes(dice.randrange(1, 65)) for _ in range(fault.packets)]
        else:
            packets = [self._foreign(sender, slot)]
        receivers = range(self._slots.n_nodes)
        return [Arrival(node, heard_s, data) for data in packets for node in receivers if node != sender]

    def _befallen(self, number: int, fault: StressFault, slot: int, one: Arrival) -> list[Arrival]:
        """Apply a fault to one arrival."""
        moment = int(slot // fault.slots) if fault.kind == "bursts" else slot
        if fault.kind == "partition":
            return []
        if not befalls(self._seed, number, moment, one.receiver, fault.share):
            return [one]
        draw = int(loss.uniform(self._seed, PACKETS + 1, number & 0xFFFF, slot & 0xFFFF, one.receiver) * (1 << 30))
        later = Arrival(one.receiver, one.time_s + fault.slots * self._slots.slot_s, one.data)
        match fault.kind:
            case "loss" | "bursts":
                return []
            case "twice":
                return [one, later]
            case "late":
                return [later]
            case "bits":
                return [Arrival(one.receiver, one.time_s, _flipped(one.data, fault.bits, draw))]
            case "cut":
                return [Arrival(one.receiver, one.time_s, one.data[: draw % max(1, len(one.data))])]
        return [Arrival(one.receiver, one.time_s, self._forge(one.data, slot, draw))]


def _flipped(data: bytes, bits: int, draw: int) -> bytes:
    """The bytes with so many bits turned, at different places."""
    damaged, n_bits = bytearray(data), 8 * len(data)
    for bit in range(min(bits, n_bits)):
        byte, place = divmod((draw + bit * (1 + draw % (n_bits // bits or 1))) % n_bits, 8)
        damaged[byte] ^= 128 >> place
    return bytes(damaged)


# Forged packets -----------------------------------------------------------------------------------

LATER_EVERY, LATER_S = 4, (20.0, 200.0, 2000.0)
"""In one of so many forged packets a time is later by one of these, in the others a value is another one."""


def forger(codec: Codec, slots: TdmaSchedule, model: WorldModel) -> Forge:
    """Forge packets of a fleet, in good form; ``model`` knows which values are in range."""

    def forge(data: bytes, slot: int, draw: int) -> bytes:
        frame, start_s = slots.frame_of(slot), slots.start_s(slot)
        try:
            packet = codec.decode(data, frame, start_s, codec.era_of(data, frame) or 0).packet
            forged = _forged(packet, draw, model)
            if forged == packet:
                return data
            return codec.encode(
                forged.sender, forged.acks, forged.fragments, forged.signals, frame, forged.epoch, start_s,
                forged.summary,
            )  # fmt: skip
        except ExchangeError:
            return data  # damaged before: it stays what it is

    return forge


def stranger(tbox: TBox, slots: TdmaSchedule, crc_bits: int, is_keyed: bool) -> Foreign:
    """Speak as another fleet, with another key if this one has one; then in every third frame by an introduction."""
    n_nodes, key = slots.n_nodes, bytes(range(16)) if is_keyed else None
    other = Codec(tbox, 3, n_nodes, POLICIES["ack"], 7, 1e5, framing=Framing(crc_bits, key))
    greetings = [Introductions(node, bytes(range(16)), bytes(8), other, slots, 2048, 1.0) for node in range(n_nodes)]

    def speak(sender: int, slot: int) -> bytes:
        frame = slots.frame_of(slot)
        if key is not None and (data := greetings[sender].packet(slot)) is not None:
            greetings[sender].miss((sender + 1) % n_nodes)
            return data
        return other.encode(sender, 0, frame=frame, slot_start_s=slots.start_s(slot))

    return speak


def _forged(packet: Packet, draw: int, model: WorldModel) -> Packet:
    """The packet with one time or value of one of its fragments changed; as it is if it has none that could be."""
    fragments = list(packet.fragments)
    if fragments and draw % LATER_EVERY == 0:
        at, later_s = draw // LATER_EVERY % len(fragments), LATER_S[draw // LATER_EVERY % len(LATER_S)]
        fragments[at] = _with(fragments[at], fragments[at].facts, fragments[at].time_s + later_s)
        return packet._replace(fragments=tuple(fragments))
    for index in range(len(fragments)):
        one = fragments[at := (draw + index) % len(fragments)]
        fact = one.facts[draw % len(one.facts)]
        for other in (fact._replace(value=value) for value in _other_values(fact.value, draw)):
            if other != fact and _may_record(model, other):
                fragments[at] = _with(one, tuple(other if told is fact else told for told in one.facts), one.time_s)
                return packet._replace(fragments=tuple(fragments))
    return packet._replace(signals=tuple(signal._replace(value=-128) for signal in packet.signals))


def _with(one: Fragment, facts: tuple[PropertyValue, ...], time_s: float) -> Fragment:
    return Fragment(one.origin, one.sequence, time_s, facts, one.index, one.count, one.epoch)


def _other_values(value: Any, draw: int) -> list[Any]:
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, tuple):
        return [(value[0] + far_m, value[1] - far_m) for far_m in (5000.0, 300.0, -200.0)]
    if isinstance(value, int | float):
        return [type(value)(value + step) for step in (1 + draw % 7, -(1 + draw % 7), 1)]
    return []


def _may_record(model: WorldModel, fact: PropertyValue) -> bool:
    """True if the value of a fact is of the kind of its attribute and in range."""
    try:
        model.tbox.attributes[fact.attribute].quantise(fact.value)
    except (TypeError, ValueError):
        return False
    return True


# Forged statements --------------------------------------------------------------------------------


@dataclass(frozen=True)
class ForgedStatement:
    """A forged statement: facts by uid to be recorded, and who says what of which role or instance."""

    facts: tuple[tuple[int, int, Any], ...]
    issuer: str
    about: str
    kind: str


def forged_statement(fault: StressFault, vehicle: Vehicle, scene: Scene) -> ForgedStatement | None:
    """A statement that a vehicle has no right to make; None where there is none."""
    organisation, beliefs, me = vehicle.social.organisation, vehicle.beliefs, vehicle.name
    match fault.kind:
        case "forged-role":  # the lead of a group whose head it is not
            for group in organisation.groups.values():
                if group.head_role is not None and me not in organisation.heads(group.name):
                    path = group.path(group.head_role)
                    return ForgedStatement((beliefs.fact(me, "playsRole", path)[:3],), me, path, "role")
        case "forged-objective":
            return _forged_objective(vehicle, scene)
        case "forged-done":  # a job that nobody is known to have done
            for job in scene.setup.mission.jobs.values():
                attribute, subject = job.done
                uid = beliefs.model.tbox.attribute_named(attribute).uid
                for value in (vehicle.data.node, True) if beliefs.get(job.done) is None else ():
                    fact = PropertyValue(beliefs.uid(subject), uid, value)
                    if _may_record(beliefs.model, fact):
                        return ForgedStatement((fact[:3],), me, subject, "done")
        case "forged-lead":  # of a group, its own rather, whose head is another that is there
            groups = sorted(organisation.groups, key=lambda name: (not organisation.is_member(me, name), name))
            for name in groups:
                heads = organisation.heads(name)
                if heads and me not in heads and vehicle.social.absent.isdisjoint(heads):
                    facts = beliefs.fact(name, "headedBy", me)[:3], beliefs.fact(name, "headTerm", fault.term)[:3]
                    return ForgedStatement(facts, me, name, "lead")
    return None


def _forged_objective(vehicle: Vehicle, scene: Scene) -> ForgedStatement | None:
    """A given objective, for a role of a group of which the vehicle is, and was, no member, and cannot come to form."""
    organisation, beliefs = vehicle.social.organisation, vehicle.beliefs
    named = {one.uid: one.name for one in beliefs.model.tbox.attributes}
    recorded = [
        fact for _, blocks in sorted(scene.reference.recorded.items()) for block in blocks for fact in block.facts
        if named[fact.attribute].startswith("objective") and named[fact.attribute] != "objective"
    ]  # fmt: skip
    for group in organisation.groups.values():
        own = [name for name in (group.name, group.formed_by) if name is not None]
        known = organisation, scene.setup.agreement.organisation
        is_member = any(one.is_member(vehicle.name, name) for one in known for name in own)
        if recorded and not is_member and group.roles:
            path = group.path(group.roles[0].name)
            facts = ((beliefs.uid(path), recorded[0].attribute, recorded[0].value),)
            return ForgedStatement(facts, vehicle.name, path, "objective")
    return None


def is_found_out(jobs: Collection[Job], declaration: Declaration) -> bool:
    """True if a false word is: of every job it shows in other facts how much is left, and vehicles tell each other."""
    done = {job.done for job in jobs}
    told = SimpleNamespace(  # knows that the jobs are done, and nothing else
        get=lambda key, default=None: "somebody" if key in done else default,
        values=lambda key: frozenset({"somebody"} if key in done else ()),
        instances=lambda of_class: (),
        n_changes=len(done),
    )
    left = [getattr(job, "left", lambda _: None)(told) if hasattr(job, "share_left") else None for job in jobs]
    return declaration.tells and all(state is not None and share_left(state) == 1.0 for state in left)


# Vehicles -----------------------------------------------------------------------------------------

LEAST = -128


class Wrapping:
    """Wraps the functions by which vehicles record, offer, send, receive and sense; those that begin anew too.

    Wrappers pass on what they are given, changed where a fault holds, and keep the reference record.
    """

    def __init__(self, scene: Scene, listen: Callable[[Heard], None], happened: Counter[str]) -> None:
        self._scene, self._listen, self._happened = scene, listen, happened
        self._numbered = list(scene.schedule.numbered())
        self._aired: dict[bytes, SentPacket] = {}
        self._seen: dict[tuple[str, str], list[Observation]] = {}
        fleet = scene.fleet
        for vehicle in fleet.vehicles:
            self._begin(vehicle)
        make_anew = fleet.make_anew

        def wrapped_anew(model: Fleet, before: Vehicle, remembers: bool) -> Vehicle:
            scene.lives[before.name].is_alive = False
            vehicle = make_anew(model, before, remembers)
            self.begin_anew(vehicle, remembers)
            return vehicle

        fleet.make_anew = wrapped_anew

    def begin_anew(self, vehicle: Vehicle, remembers: bool, logged_s: float = math.inf) -> None:
        """Let a vehicle begin a life behind another, wrapped; it loses what it recorded itself after ``logged_s``."""
        old = self._scene.lives[vehicle.name]
        life = self._begin(vehicle)
        if remembers:
            life.inherit(old)
            model, since_s = old.model, math.inf if logged_s == math.inf else old.model.quantise_time(logged_s)
            own = {guid for guid in old.had if guid[0] == life.node and (block := model.arrived(guid)) is not None
                   and block.time_s >= since_s}  # fmt: skip
            life.had = {guid for guid in old.had - own if model.has_arrived(guid)}

    def _begin(self, vehicle: Vehicle) -> Incarnation:
        """Let a vehicle begin a life, wrapped."""
        reference, node, model = self._scene.reference, vehicle.data.node, vehicle.beliefs.model
        before = reference.lives.get(node)
        if before is not None:
            reference.past.append(before)
        life = Incarnation(node, 0 if before is None else before.number + 1, model.epoch, model, vehicle.radio.manager)
        reference.lives[node] = self._scene.lives[vehicle.name] = life
        self._wrap_exchange(vehicle, life)
        kinds = {fault.kind for _, fault in self._numbered if fault.vehicle == vehicle.name}
        if kinds & {"random", "frozen"}:
            self._wrap_sensors(vehicle)
        if "sulks" in kinds:
            signals = vehicle.executive.signals

            def signalled() -> list[tuple[tuple[str, str], int]]:
                is_on = bool(self._befalling("sulks", vehicle))
                self._happened["sulks"] += is_on
                return [(role, LEAST) for role, _ in signals()] if is_on else signals()

            vehicle.executive.signals = signalled  # type: ignore[method-assign]
        return life

    def _befalling(self, kind: str, vehicle: Vehicle) -> list[tuple[int, StressFault]]:
        """Faults of a kind that befall a vehicle in this tick."""
        seed, now_s, node = self._scene.schedule.seed, self._scene.now_s, vehicle.data.node
        return [
            (number, fault) for number, fault in self._numbered
            if (fault.kind, fault.vehicle) == (kind, vehicle.name) and fault.holds(now_s)
            and befalls(seed, number, int(now_s), node, fault.share)
        ]  # fmt: skip

    def _wrap_exchange(self, vehicle: Vehicle, life: Incarnation) -> None:
        reference, manager, radio, model = self._scene.reference, life.manager, vehicle.radio, life.model
        record, offer, send = model.record, manager.offer, manager.packet_to_send
        give_up, hear = manager.give_up, radio.hear

        def recorded(facts: Sequence[Fact], now_s: float, private: bool = False) -> Change:
            change = record(self._misplaced(vehicle, facts), now_s, private)
            if not private:
                reference.note_recorded(life, change.block)
            return change

        def offered(changes: Iterable[Change], addressed: Collection[int] = ()) -> tuple[Fragment, ...]:
            fragments = offer(list(changes), addressed)
            life.take(fragments)
            return fragments

        def sent(now_s: float) -> Transmission:
            packet = send(now_s)
            parts = [life.parts.get((u.origin, u.epoch, u.sequence), {}).get(u.part) for u in packet.items]
            self._aired[packet.data] = SentPacket(life, packet.slot, packet.data, tuple(filter(None, parts)))
            return packet

        def gave_up(guids: Iterable[Guid]) -> None:
            names = list(guids)
            life.gave_up.update(names)
            give_up(names)

        def heard(data: bytes, now_s: float) -> HeardPacket:
            found, aired = hear(data, now_s), self._aired.get(data)
            life.has_noticed |= found.reception.conflict is not None
            if found.reception.fault is None and aired is not None:
                reference.note_taken(life, aired)
                aside = [fragment.uid for fragment in found.reception.aside]
                reference.note_decoded(life, [*found.reception.items, *aside])
            self._listen(Heard(vehicle, life, aired, found.reception, found.changes, now_s))
            return found

        model.record, radio.hear = recorded, heard  # type: ignore[method-assign]
        manager.offer, manager.packet_to_send, manager.give_up = offered, sent, gave_up  # type: ignore[method-assign]

    def _misplaced(self, vehicle: Vehicle, facts: Sequence[Fact]) -> Sequence[Fact]:
        """Facts with the vehicle's own position far off while a fault holds."""
        far_m = sum(fault.by_m for _, fault in self._befalling("misplaced", vehicle))
        own = vehicle.data.node, vehicle.beliefs.model.tbox.attribute_named("position").uid
        self._happened["misplaced"] += sum(fact[:2] == own for fact in facts) if far_m else 0
        return [
            (*own, (fact[2][0] + far_m, fact[2][1])) if far_m and fact[:2] == own else fact  # type: ignore[index]
            for fact in facts
        ]

    def _wrap_sensors(self, vehicle: Vehicle) -> None:
        sense = vehicle.functional.sense

        def sensed(now_s: float, neighbours: Sequence[Any]) -> list[Any]:
            found = sense(now_s, neighbours)
            for index, one in enumerate(found):
                seen = self._seen.setdefault((vehicle.name, one.sensor), [])
                if one.observation.found or not one.observation.facts:
                    continue
                seen.append(one.observation)
                others = [
                    ("random", (7 * len(seen) + number) % len(seen)) for number, _ in self._befalling("random", vehicle)
                ]
                others += [("frozen", 0) for _ in self._befalling("frozen", vehicle)]
                for kind, at in others:
                    self._happened[kind] += seen[at] != one.observation
                    found[index] = one._replace(observation=replace(one.observation, facts=seen[at].facts))
            return found

        vehicle.functional.sense = sensed  # type: ignore[method-assign]
