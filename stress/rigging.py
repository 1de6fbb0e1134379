"""Rigging: what stands between a vehicle and its seams in a trial, to befall it and to bear witness.

Each vehicle gets its own functions in front of those by which it records, offers, packs, hears and senses. They pass on
what they are given, changed where a fault holds, and tell the witness. A vehicle that begins anew is rigged anew.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from exchange.packets import Fragment, Transmission
from remoras.avoidance import Neighbour
from remoras.beliefs import Fact
from remoras.fleet import Fleet
from remoras.radio import HeardPacket
from remoras.sensor import Observation
from remoras.vehicle import Vehicle
from stress.draws import befalls
from stress.invariants.seam import Heard, Scene
from stress.lives import Aired, Life
from stress.minds import sulking
from stress.schedule import Schedule, StressFault
from worldmodel import Change
from worldmodel.facts import Guid

if TYPE_CHECKING:
    from remoras.functional.sensing import Sensed

MOST_AIRED = 4096
"""Packets that are remembered, in case one comes late."""


class Rigging:
    """Stands between the vehicles of a fleet and their seams.

    Args:
        scene: of the trial.
        listen: is told of each packet heard.
        happened: counts what a kind has changed.
    """

    def __init__(
        self,
        scene: Scene,
        listen: Callable[[Heard], None],
        happened: Counter[str],
    ) -> None:
        self._scene = scene
        self._listen = listen
        self._happened = happened
        self._schedule: Schedule = scene.schedule
        self._seed = self._schedule.stress.seed
        self._numbered = list(self._schedule.numbered())
        self._aired: dict[bytes, Aired] = {}
        self._seen: dict[tuple[str, str], list[Observation]] = {}
        fleet = scene.fleet
        for vehicle in fleet.vehicles:
            self._begin(vehicle)
        make_anew = fleet.makers.anew

        def rigged_anew(model: Fleet, before: Vehicle, remembers: bool) -> Vehicle:
            old = scene.lives[before.name]
            old.is_alive = False
            vehicle = make_anew(model, before, remembers)
            life = self._begin(vehicle)
            if remembers:
                life.inherit(old)
                life.had = {guid for guid in old.had if old.model.has_arrived(guid)}
            return vehicle

        fleet.makers = fleet.makers._replace(anew=rigged_anew)

    def _begin(self, vehicle: Vehicle) -> Life:
        """Let a vehicle begin a life, rigged."""
        scene, witness, node = self._scene, self._scene.witness, vehicle.data.node
        before = witness.lives.get(node)
        if before is not None:
            witness.past.append(before)
        model = vehicle.beliefs.model
        number = 0 if before is None else before.number + 1
        life = Life(node, number, model.epoch, model, vehicle.radio.manager)
        witness.lives[node] = scene.lives[vehicle.name] = life
        self._rig(vehicle, life)
        return life

    def _holding(self, kind: str, vehicle: str) -> list[tuple[int, StressFault]]:
        now_s = self._scene.now_s
        return [
            one for one in self._numbered if (one[1].kind, one[1].vehicle) == (kind, vehicle) and one[1].holds(now_s)
        ]

    def _has(self, vehicle: str, *kinds: str) -> bool:
        return any(fault.kind in kinds and fault.vehicle == vehicle for fault in self._schedule.fault)

    def _rig(self, vehicle: Vehicle, life: Life) -> None:
        """Put functions in front of those of a vehicle."""
        witness, manager, radio, beliefs = self._scene.witness, life.manager, vehicle.radio, vehicle.beliefs
        record, offer, pack, give_up, hear = (
            beliefs.record, manager.offer, manager.packet_to_send, manager.give_up, radio.hear,
        )  # fmt: skip

        def recorded(facts: Sequence[Fact], now_s: float, private: bool) -> Change:
            change = record(self._misplaced(vehicle, facts), now_s, private)
            if not private:
                witness.note_recorded(life, change.block)
            return change

        def offered(changes: Iterable[Change], addressed: Collection[int] = ()) -> tuple[Fragment, ...]:
            fragments = offer(changes, addressed)
            life.take(fragments)
            return fragments

        def packed(now_s: float) -> Transmission:
            sent = pack(now_s)
            parts = [life.parts.get((u.origin, u.epoch, u.sequence), {}).get(u.part) for u in sent.items]
            if len(self._aired) >= MOST_AIRED:
                del self._aired[next(iter(self._aired))]
            self._aired[sent.data] = Aired(
                life, sent.slot, sent.data, tuple(part for part in parts if part is not None)
            )
            return sent

        def gave_up(guids: Iterable[Guid]) -> None:
            names = list(guids)
            life.gave_up.update(names)
            give_up(names)

        def heard(data: bytes, now_s: float) -> HeardPacket:
            found = hear(data, now_s)
            aired = self._aired.get(data)
            life.has_noticed |= found.reception.conflict is not None
            if found.reception.fault is None:
                if aired is None:
                    life.took_damaged += 1
                else:
                    witness.note_taken(life, aired)
                    witness.note_decoded(life, found.reception.items)
            self._listen(Heard(vehicle, life, aired, found.reception, found.changes, now_s))
            return found

        rigged: dict[str, tuple[Any, Callable[..., Any]]] = {
            "record": (beliefs, recorded), "offer": (manager, offered), "packet_to_send": (manager, packed),
            "give_up": (manager, gave_up), "hear": (radio, heard),
        }  # fmt: skip
        for name, (whose, function) in rigged.items():
            setattr(whose, name, function)
        if self._has(vehicle.name, "random", "frozen"):
            self._rig_sensors(vehicle)
        if self._has(vehicle.name, "sulks"):
            self._rig_signals(vehicle)

    # What befalls a vehicle ----------------------------------------------------------------------

    def _misplaced(self, vehicle: Vehicle, facts: Sequence[Fact]) -> Sequence[Fact]:
        """Facts with the vehicle's own position far off while a fault holds."""
        if not self._has(vehicle.name, "misplaced"):
            return facts
        node, tick = vehicle.data.node, int(self._scene.now_s)
        position = vehicle.beliefs.model.tbox.attribute_named("position").uid
        holding = self._holding("misplaced", vehicle.name)
        far_m = sum(fault.by_m for number, fault in holding if befalls(self._seed, number, tick, node, fault.share))
        if not far_m:
            return facts
        found: list[Fact] = []
        for fact in facts:
            is_own = fact[:2] == (node, position)
            self._happened["misplaced"] += is_own
            found.append((node, position, (fact[2][0] + far_m, fact[2][1])) if is_own else fact)
        return found

    def _rig_sensors(self, vehicle: Vehicle) -> None:
        sense, node = vehicle.functional.sense, vehicle.data.node

        def sensed(now_s: float, neighbours: Sequence[Neighbour]) -> list[Sensed]:
            found = sense(now_s, neighbours)
            for index, one in enumerate(found):
                seen = self._seen.setdefault((vehicle.name, one.sensor), [])
                if one.observation.found or not one.observation.facts:
                    continue
                seen.append(one.observation)
                for number, fault in self._holding("random", vehicle.name):
                    if befalls(self._seed, number, int(self._scene.now_s), node, fault.share):
                        other = seen[(7 * len(seen) + number) % len(seen)]
                        self._happened["random"] += other != one.observation
                        found[index] = one._replace(observation=replace(one.observation, facts=other.facts))
                for _ in self._holding("frozen", vehicle.name):
                    self._happened["frozen"] += seen[0] != one.observation
                    found[index] = one._replace(observation=replace(one.observation, facts=seen[0].facts))
            return found

        vehicle.functional.sense = sensed  # type: ignore[method-assign]

    def _rig_signals(self, vehicle: Vehicle) -> None:
        executive, node = vehicle.executive, vehicle.data.node

        def is_on() -> bool:
            tick = int(self._scene.now_s)
            on = [n for n, f in self._holding("sulks", vehicle.name) if befalls(self._seed, n, tick, node, f.share)]
            self._happened["sulks"] += bool(on)
            return bool(on)

        executive.signals = sulking(executive.signals, is_on)  # type: ignore[method-assign]
