"""A vehicle: the only file that knows the order of the layers.

Every tick: act (as decided before) and sense. Every decision period: think. What arrives in between is heard at
its time; a mission to be planned is planned at once, so that the answer makes the vehicle's next slot. At the
end of every TDMA frame the social layer consults.

The walk of one observation: ``_sense`` records it in the world model (a Change), ``manager.offer`` makes it an
item, ``speak`` puts it into a packet; at the peer ``hear`` takes the block out of the packet, ``merge`` makes it a
Change, ``_consider`` asks the social layer what rests on it, ``_adopt`` plans anew and hands the activities to
the executive and the functional layer. Every step returns a value; nothing calls back up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mesa

from exchange.manager import ExchangeManager, Reception, Transmission
from exchange.packets import InfluenceSignal, ItemUid
from remoras.activities import ActivityType
from remoras.behaviours import Perception
from remoras.beliefs import Beliefs
from remoras.database import VehicleData
from remoras.executive.layer import Decision, ExecutiveLayer
from remoras.functional.layer import FunctionalLayer
from remoras.recorder import Recorder
from remoras.sensors import Neighbour, Seabed
from remoras.social.layer import SocialLayer
from worldmodel import Block, Change, WorldModel, merge


class Vehicle(mesa.Agent):  # type: ignore[misc]  # Mesa is untyped
    """One autonomous vehicle: three layers, a world model and an exchange manager.

    Args:
        model: the fleet.
        data: static data; the node index is the vehicle's TDMA slot, its origin and its instance uid.
    """

    def __init__(
        self,
        model: mesa.Model,
        data: VehicleData,
        social: SocialLayer,
        executive: ExecutiveLayer,
        functional: FunctionalLayer,
        beliefs: Beliefs,
        manager: ExchangeManager,
        seabed: Seabed,
        recorder: Recorder,
    ) -> None:
        super().__init__(model)
        self.data = data
        self.name = data.name
        self.social = social
        self.executive = executive
        self.functional = functional
        self.beliefs = beliefs
        self.world_model: WorldModel = beliefs.model
        self.manager = manager
        self._seabed = seabed
        self._recorder = recorder
        tbox = self.world_model.tbox
        self._position = tbox.attribute_named("position").uid
        self._battery = tbox.attribute_named("batteryFraction").uid
        self._mapped_cell = tbox.attribute_named("mappedCell").uid
        self._gathered_at = tbox.attribute_named("gatheredAt").uid
        self._area_class = tbox.class_named("Area").uid
        self._area_uids = {name: beliefs.uid(name) for name, _ in set(seabed.cells.values())}
        self._signalled = {
            beliefs.uid(group.path(role.name)): (group.name, role.name, role.influences)
            for group in social.organisation.groups.values()
            for role in group.roles
        }
        self._next_decision_s = 0.0
        self._resigned = False
        self._driving: frozenset[tuple[str, str]] = frozenset()
        self._unheard: dict[tuple[str, ItemUid], set[str]] = {}  # by vehicle and item: roles not known to have arrived
        for assignment in social.organisation.roles_of(self.name):
            self._record_role(0.0, assignment.group, assignment.role, "assigned")
        self._adopt()

    @property
    def is_alive(self) -> bool:
        """Is there energy left?"""
        return not self.functional.exhausted

    # One tick ------------------------------------------------------------------------------------

    def step(self, now_s: float, dt_s: float, neighbours: Sequence[Neighbour]) -> None:
        """Act for the ``dt_s`` that end now, sense, think."""
        if self.functional.exhausted:
            return
        if dt_s > 0.0:
            self.functional.act(dt_s)
        self._sense(now_s, neighbours)
        if now_s >= self._next_decision_s:
            self._next_decision_s += self.executive.period_s
            self.think(now_s, self.executive.period_s if dt_s > 0.0 else 0.0)

    def _sense(self, now_s: float, neighbours: Sequence[Neighbour]) -> None:
        for cell in self.functional.sense(now_s, neighbours):
            self._recorder.coverage.append((now_s, self.name, *cell))
            self.functional.picture.last_yield_s = now_s
            area, index = self._seabed.cells[cell]
            self._conclude([(self._area_uids[area], self._mapped_cell, index)], now_s)
        if self.functional.exhausted:
            self._recorder.faults.append((now_s, self.name, "energy", "battery exhausted"))

    def think(self, now_s: float, dt_s: float) -> None:
        """Perceive, decide, and do at once what the decision asks of the social layer."""
        functional, executive = self.functional, self.executive
        functional.picture.planning_due = self.social.planning_due
        perceptions = functional.perceive(executive.decision.chosen)
        if self._note_what_is_done(perceptions, now_s):
            perceptions = functional.perceive(executive.decision.chosen)
        before = executive.decision
        decision = executive.decide(perceptions, now_s, dt_s)
        if decision is not before:
            functional.perform(executive.sets, decision.chosen)
            self._record_decision(now_s, decision)
        if functional.must_go_home and not self._resigned:
            self._resigned = True
            self._conclude(self.social.resign(), now_s)
        if decision.has(ActivityType.PLANNING) and self.social.planning_due:
            self._plan(now_s)
        self._conclude(self.social.findings(functional.picture, functional.motion), now_s)

    def _note_what_is_done(self, perceptions: Sequence[Perception], now_s: float) -> bool:
        """Make known the first objective for which all has been done; True if there was one."""
        for index, perception in enumerate(perceptions):
            objective = self.executive.sets[index].objective
            if perception.done and objective is not None and (facts := self.social.completed(objective)):
                self._conclude(facts, now_s)
                return True
        return False

    def _plan(self, now_s: float) -> None:
        deliberation = self.social.plan_missions(self.functional.picture)
        for no_plan in deliberation.impossible:
            self._recorder.faults.append((now_s, self.name, "no plan", str(no_plan.task)))
        self._conclude(deliberation.facts, now_s)

    # Consultation --------------------------------------------------------------------------------

    def consult(self, now_s: float) -> bool:
        """End of a TDMA frame: what was heard in it counts, and what is made of it. True if something changed here."""
        if self.functional.exhausted:
            return False
        changed = self._take_effect(now_s)
        for facts, told in self.social.negotiate(now_s, self.functional.picture, self.functional.motion):
            self._conclude(facts, now_s, told)
        return self._take_effect(now_s) or changed

    def _take_effect(self, now_s: float) -> bool:
        """Roles and objectives stated so far count from now on."""
        if not self.social.consultation_due:
            return False
        result = self.social.consult()
        for assignment in result.assigned:
            self._record_role(now_s, assignment.group, assignment.role, "assigned")
        for assignment in result.left:
            self._record_role(now_s, assignment.group, assignment.role, "left")
        for detail in result.refused:
            self._recorder.faults.append((now_s, self.name, "refused assignment", detail))
        if result.activities_due:
            self._adopt()
            self.think(now_s, 0.0)
        return True

    def _adopt(self) -> None:
        sets = self.social.activity_sets(self.functional.motion.position_m)
        roles = [(a.group, a.role) for a in self.social.organisation.roles_of(self.name)]
        self.executive.adopt(sets, roles)
        self.functional.prepare(sets)
        self.functional.perform(sets, self.executive.decision.chosen)

    # The exchange --------------------------------------------------------------------------------

    def speak(self, now_s: float) -> Transmission | None:
        """The packet for the own slot that opens now; None from a vehicle without energy or words."""
        declaration = self.social.optimiser.declaration
        if self.functional.exhausted or not declaration.communicates:
            return None
        self._conclude([(self.data.node, self._position, self.functional.motion.position_m)], now_s)
        battery = round(max(0.0, self.functional.picture.battery), 2)
        if self.world_model.value(self.data.node, self._battery) != battery:
            self._conclude([(self.data.node, self._battery, battery)], now_s)
        if declaration.influences and self.executive.decision.has(ActivityType.COMMUNICATION):
            self.manager.offer_signals(self._signals(now_s))
        sent = self.manager.packet_to_send(now_s)
        self.functional.transmitted(sent.size_bits)
        return sent

    def _signals(self, now_s: float) -> list[InfluenceSignal]:
        signals = []
        for (group, role), value in self.executive.signals():
            self._recorder.satisfaction.append((now_s, self.name, group, role, value))
            signals.append(InfluenceSignal(self.beliefs.uid(f"{group}.{role}"), value))
        return signals

    def hear(self, data: bytes, now_s: float) -> Reception | None:
        """Take in a packet; None from a vehicle without energy."""
        if self.functional.exhausted:
            return None
        reception = self.manager.receive(data, now_s)
        if reception.fault is not None:
            self._recorder.faults.append((now_s, self.name, "bad packet", reception.fault))
            return reception
        for uid in reception.items:
            self._record_item(now_s, uid, "received")
        if self._unheard and reception.beliefs:
            names = self.social.auv_database.names
            for peer, uid in reception.beliefs:
                self._unheard.pop((names[peer], uid), None)
            self._note_unheard()
        for uid in reception.settled:
            self._record_item(now_s, uid, "acknowledged")
        self._merge(reception.blocks, now_s)
        emitter = self.social.auv_database.names[reception.sender]
        self.functional.picture.heard_s[emitter] = now_s
        for signal in reception.signals:
            self._hear_signal(emitter, signal, now_s)
        if self.social.planning_due:
            self.think(now_s, 0.0)
        return reception

    def _hear_signal(self, emitter: str, signal: InfluenceSignal, now_s: float) -> None:
        group, role, addressed_roles = self._signalled.get(signal.role, ("", "", ()))
        organisation = self.social.organisation
        if not (organisation.is_member(self.name, group) and organisation.is_member(emitter, group)):
            return  # not of our groups, or no role at all
        for addressed in addressed_roles:
            self.executive.hear((group, addressed), emitter, role, signal.value, now_s)

    def _merge(self, blocks: Sequence[Block], now_s: float) -> None:
        merged = merge(self.world_model, blocks)
        for fault in merged.faults:
            self._recorder.faults.append((now_s, self.name, f"refused block: {fault.code}", fault.detail))
        if merged.changes:
            picture = self.functional.picture
            if any(self._is_news(change) for change in merged.changes):
                picture.last_news_s = now_s
            self._consider(merged.changes)

    def _is_news(self, change: Change) -> bool:
        return any(
            self.world_model.tbox.attributes[fact.attribute].domain == self._area_class for fact in change.block.facts
        )

    # What the vehicle itself finds out ----------------------------------------------------------

    def _conclude(self, facts: Sequence[tuple[int, int, Any]], now_s: float, told: bool = True) -> None:
        """Record facts in the own world model and, if they are to be told, offer them to the others."""
        if not facts:
            return
        change = self.world_model.record(facts, now_s)
        if told and self.social.optimiser.declaration.communicates:
            for uid in self.manager.offer([change]):
                self._record_item(now_s, uid, "observed")
                if addressed := self.social.addressed(change):
                    self._unheard |= {(name, uid): roles for name, roles in addressed.items()}
                    self._note_unheard()
        self._consider([change])

    def _note_unheard(self) -> None:
        unheard: dict[str, set[str]] = {}
        for (name, _), roles in self._unheard.items():
            unheard.setdefault(name, set()).update(roles)
        self.social.unheard = unheard

    def _consider(self, changes: Sequence[Change]) -> None:
        picture = self.functional.picture
        for change in changes:
            for fact in change.new_latest:
                if fact.attribute == self._position:
                    picture.saw(self.beliefs.name(fact.subject), fact.value)  # type: ignore[arg-type]
                elif fact.attribute == self._gathered_at:
                    picture.gathered = self.social.gathered()
        if self.social.consider(changes):
            self._adopt()

    # Recording -----------------------------------------------------------------------------------

    def _record_item(self, now_s: float, uid: Any, event: str) -> None:
        origin = self.social.auv_database.names[uid.origin]
        self._recorder.knowledge.append((now_s, self.name, str(uid), origin, event))

    def _record_role(self, now_s: float, group: str, role: str, event: str) -> None:
        self._recorder.roles.append((now_s, self.name, group, role, event))

    def _record_decision(self, now_s: float, decision: Decision) -> None:
        executive = self.executive
        for group, role in sorted(self._driving - decision.driving):
            self._record_role(now_s, group, role, "inactive")
        for group, role in sorted(decision.driving - self._driving):
            self._record_role(now_s, group, role, "active")
        self._driving = decision.driving
        for index in decision.chosen:
            activity_set = executive.sets[index]
            role = activity_set.objective.role if activity_set.objective is not None else ""
            for activity in activity_set.activities:
                self._recorder.activities.append(
                    (
                        now_s,
                        self.name,
                        activity.type.name.lower(),
                        activity.name,
                        role,
                        executive.motivations[index],
                    )
                )
