"""Vehicle: the only module that knows the order of the layers.

Every tick: act (as decided before) and sense. Every decision period: think. At the end of every TDMA frame the social
layer consults. Calls only go down and return values (``docs/DESIGN.md``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from mesa import Agent, Model

from exchange.packets import Reception, Transmission
from remoras.activities import ActivitySet, ActivityType, Objective
from remoras.behaviours import Perception
from remoras.beliefs import Beliefs, Fact
from remoras.condition import SOUND, Condition
from remoras.database import VehicleData
from remoras.errors import PluginError
from remoras.executive.layer import ExecutiveLayer
from remoras.fleet.radio import Radio
from remoras.fleet.run_log import RunLog
from remoras.functional.layer import FunctionalLayer, Sensed, embody
from remoras.motion.attraction import NO_PULLS
from remoras.motion.avoidance import Neighbour
from remoras.recorder import CANNOT, NO_HEADWAY, Recorder
from remoras.social.layer import NOTHING_CONSIDERED, Considered, SocialLayer
from remoras.strategy import Waits
from worldmodel import Change, WorldModelError
from worldmodel.world_model import remember


class Vehicle(Agent):  # type: ignore[misc]  # Mesa is untyped
    """Autonomous vehicle: three layers, a radio and a world model.

    ``began_s`` is above 0 after a restart; ``made`` is called with the vehicle before its activities are chosen.
    """

    def __init__(
        self,
        model: Model,
        data: VehicleData,
        social: SocialLayer,
        executive: ExecutiveLayer,
        functional: FunctionalLayer,
        radio: Radio,
        beliefs: Beliefs,
        recorder: Recorder,
        began_s: float = 0.0,
        made: Iterable[Callable[[Vehicle], None]] = (),
    ) -> None:
        super().__init__(model)
        self.data = data
        self.name = data.name
        self.social, self.executive, self.functional = social, executive, functional
        self.radio = radio
        self.beliefs = beliefs
        self.condition = SOUND
        self._recorder = recorder
        self._run_log = RunLog(self.name, self.social.database.names, recorder)
        tbox = beliefs.model.tbox
        self._position = tbox.attribute_named("position").uid
        self._battery = tbox.attribute_named("batteryFraction").uid
        self._next_decision_s = 0.0
        self._pulls = NO_PULLS
        self.has_resigned = False
        self._may_have_replanned = True  # since the last rows of plans; saves 1 % of the calls of a mission
        self._weighed: tuple[ActivitySet, ...] = ()
        for tell in made:
            tell(self)
        self._run_log.founded(self.social.organisation, self.social.objectives.values(), began_s)
        self._adopt()

    @property
    def is_alive(self) -> bool:
        """True while energy remains and no fault has removed the vehicle."""
        return self.functional.is_on

    @property
    def exchanges(self) -> bool:
        """True while it is alive, communicates and may send."""
        return self.functional.is_on and self.radio.communicates and not self.social.is_silent

    @property
    def real(self) -> VehicleData:
        """True data of the vehicle."""
        return self.functional.data

    def suffer(self, condition: Condition) -> None:
        """Apply a condition; called by the fleet when a fault begins or ends."""
        self.condition = condition
        self.functional.is_on = condition.is_alive and not self.functional.exhausted
        self.functional.impair(condition)
        if not condition.is_alive:
            self.functional.stop()

    # One tick ------------------------------------------------------------------------------------

    def step(self, now_s: float, dt_s: float, neighbours: Sequence[Neighbour], since_s: float = 0.0) -> None:
        """Act for ``dt_s`` and sense; think if due. ``now_s`` is by its clock, ``since_s`` true."""
        period_s, early_s = self.executive.period_s, self._next_decision_s - now_s
        is_due = early_s <= 0.0 or early_s > period_s  # the latter if its clock was set back
        if is_due:  # the period also runs while the vehicle is off; a set clock restarts it
            self._next_decision_s += period_s
            if not -period_s < self._next_decision_s - now_s <= period_s:
                self._next_decision_s = now_s + period_s
        if not self.functional.is_on:
            return
        if dt_s > 0.0:
            self.functional.act(dt_s, neighbours, since_s)
        for sensed in self.functional.sense(now_s, neighbours):
            self._take_note(sensed, now_s)
        if not self.functional.is_on:
            self._run_log.fault(now_s, "energy", "battery exhausted")
        if is_due:
            self.think(now_s, period_s if dt_s > 0.0 else 0.0)

    def _take_note(self, sensed: Sensed, now_s: float) -> None:
        observation = sensed.observation
        if observation.row:
            self._recorder.rows(sensed.table_of(self.name).name).append((now_s, self.name, *observation.row))
        if observation.facts or observation.found:
            self._share(self._recorded(sensed, now_s), now_s)

    def think(self, now_s: float, dt_s: float) -> None:
        """Perceive and decide, unless the last decision stands; execute parts of the social layer."""
        functional, executive = self.functional, self.executive
        functional.picture.groups.planning_due = bool(self.social.planner.due)
        perceptions: Sequence[Perception] = functional.perceive(executive.decision.chosen, executive.spare)
        if functional.has_events:
            perceptions = self._note_events(perceptions, now_s)
        is_undisturbed = functional.is_at_rest or not functional.picture.body.contacts_m
        stands = is_undisturbed and executive.stands(perceptions, functional.progress)
        if not stands or self.social.planner.due:
            self._decide(perceptions, now_s, dt_s)
        self._infer(now_s)

    def _decide(self, perceptions: Sequence[Perception], now_s: float, dt_s: float) -> None:
        functional, executive = self.functional, self.executive
        before = executive.decision
        renew = partial(functional.renew, before.chosen)
        decision = executive.decide(perceptions, now_s, dt_s, functional.progress, renew)
        if decision is not before or executive.sets is not self._weighed:
            self._weighed = executive.sets
            self._run_log.decided(now_s, decision.driving, executive.candidates(now_s))
            if decision is not before:
                functional.perform(decision.chosen)
        body = functional.picture.body
        pulls = executive.pulls(now_s) if body.contacts_m else NO_PULLS
        if pulls is not self._pulls:
            self._pulls = pulls
            functional.heed(pulls)
            executive.yields_to = functional.guidance.yields_to
            executive.is_hindered = functional.guidance.hindered_s > 0.0
        is_low = body.battery <= body.reserve  # energy for the way home only
        if (is_low or functional.stranded) and not self.has_resigned:
            self.has_resigned = True
            if not is_low:
                self._run_log.fault(now_s, CANNOT, f"{functional.stranded}: {NO_HEADWAY}")
            self.conclude(self.social.resign(), now_s)
        if self.social.planner.due and decision.has(ActivityType.PLANNING):
            self._plan(now_s)

    def _infer(self, now_s: float) -> None:
        functional = self.functional
        if facts := self.social.findings(functional.believed):
            self.conclude(facts, now_s, not self.social.is_cut_off)
        if self.social.judged:
            judged, self.social.judged = self.social.judged, []
            for report, facts in judged:
                self._run_log.fault(now_s, "impossible", report)
                self.conclude(facts, now_s)
        if self.social.conclusions.are_of_its_own:
            context = self.social.present, functional.picture, functional.believed
            self.conclude(self.social.conclusions.of_its_own(self.data, *context), now_s)

    def _note_events(self, perceptions: Sequence[Perception], now_s: float) -> Sequence[Perception]:
        functional, executive = self.functional, self.executive
        sets = executive.sets
        for activities, perception in zip(sets, perceptions, strict=True):
            for observation in perception.concludes:
                self._share(self._recorded(Sensed(activities.name, None, observation), now_s), now_s)
        # The recorded facts have changed the activities: these perceptions are of the former ones.
        if executive.sets is not sets:
            perceptions = functional.perceive(executive.decision.chosen)
        if self._note_what_is_done(perceptions, now_s):
            perceptions = functional.perceive(executive.decision.chosen)
        return perceptions

    def _note_what_is_done(self, perceptions: Sequence[Perception], now_s: float) -> bool:
        """State the first complete or infeasible objective; return whether there was one."""
        for index, perception in enumerate(perceptions):
            objective = self.executive.sets[index].objective
            if perception.failed and objective is not None and self._cope(objective, index, perception, now_s):
                return True
            if perception.done and objective is not None and (facts := self.social.completed(objective)):
                self.conclude(facts, now_s)
                return True
        return False

    def _cope(self, objective: Objective, index: int, perception: Perception, now_s: float) -> bool:
        """Replan a failed activity, or declare its objective infeasible; return whether possible."""
        failed = self.executive.sets[index]
        names = [activity.name for activity in failed.activities]
        if not perception.makes_no_way and self.social.pursuit.fail(objective, names, self.social.facts):
            self._run_log.fault(now_s, "failed step", f"{failed.name} of {objective}")
            self._adopt()
            return True
        if perception.is_beyond_it and (job := self.social.job_of(objective)):
            if facts := self.social.unable_to(job):
                self.conclude(facts, now_s)
            return bool(facts)  # it releases the job at the end of the round
        blind = not perception.makes_no_way and any(activity.sensors for activity in failed.activities)
        if facts := self.social.give_up(objective, blind):
            self._run_log.fault(now_s, CANNOT, str(objective))
            self.conclude(facts, now_s)
        return bool(facts)

    # Consultation --------------------------------------------------------------------------------

    def consult(self, now_s: float) -> None:
        """Consult at the end of a TDMA frame."""
        if not self.functional.is_on:
            return
        self.radio.tidy(now_s)
        # Membership first: claims are judged by the vehicles absent now.
        self._look_around(now_s)
        self._take_effect(now_s)
        if self.social.says_impossible:
            for reason, facts in self.social.leave():
                self._run_log.fault(now_s, CANNOT, reason)
                self.conclude(facts, now_s)
        self._take_effect(now_s)  # its plans and statements so far, else it would give the same jobs again
        executive = self.executive
        calls = executive.calls(now_s) if self.radio.influences else {}
        waits = Waits(calls, executive.waiting(), executive.ended)
        try:
            stated = self.social.negotiate(now_s, self.functional.believed, waits)
            for facts, is_sent in stated:
                self.conclude(facts, now_s, is_sent)
        except WorldModelError as error:
            name = self.social.strategy.name
            raise PluginError(f"strategy {name}: a statement of {self.name} cannot be recorded: {error}") from error
        if stated:
            # Own statements of this round take effect with those of peers, not one frame later.
            self._take_effect(now_s)
        executive.help(self.social.helping, self.functional.picture.peers.heard_slots, now_s)
        if taken_up := self.radio.regroup(self.social.organisation, now_s):
            self.consider(taken_up, now_s)

    def _look_around(self, now_s: float) -> None:
        seen = self.social.look_around(now_s)
        if seen is None:
            return
        self._may_have_replanned = True
        self._run_log.peers(now_s, seen.events)
        self.conclude(seen.facts, now_s)
        for fact in seen.passed_on:
            self.conclude([fact], now_s)
        self._take_on(seen, now_s)

    def _take_effect(self, now_s: float) -> None:
        if self.social.is_due:
            self._may_have_replanned = True
            self._take_on(self.social.consult(), now_s)

    def _take_on(self, result: Considered, now_s: float) -> None:
        self._run_log.rulings(now_s, result.rulings)
        if result.activities_due:
            self._adopt()
            self.think(now_s, 0.0)

    def _adopt(self) -> None:
        sets = self.functional.prepare(self.social.activity_sets(self.functional.believed.position_m))
        self.executive.adopt(sets, [(a.group, a.role) for a in self.social.present.roles_of(self.name)])
        self.functional.perform(self.executive.decision.chosen)
        self._may_have_replanned = True

    # The exchange --------------------------------------------------------------------------------

    def speak(self, now_s: float) -> Transmission | None:
        """Return the packet for the own slot, which opens now; None if not alive or silent."""
        if not self.functional.is_on or self.social.is_silent or not self.radio.is_heard:
            return None
        node = self.data.node
        self.conclude([(node, self._position, self.functional.believed.position_m)], now_s)
        # In per cent: no new fact in every slot.
        battery = round(max(0.0, self.functional.picture.body.battery), 2)
        if self.beliefs.model.value(node, self._battery) != battery:
            self.conclude([(node, self._battery, battery)], now_s)
        influences = self.radio.influences and self.executive.decision.has(ActivityType.COMMUNICATION)
        sent = self.radio.speak(self.executive.signals() if influences else (), now_s)
        if sent is not None:
            self.functional.transmitted(sent.size_bits)
            if self.functional.exhausted:
                self._run_log.fault(now_s, "energy", "battery exhausted")
        return sent

    def hear(self, data: bytes, now_s: float) -> Reception | None:
        """Process a packet; None if not alive."""
        if not self.functional.is_on:
            return None
        reception, emitter, changes, signals = self.radio.hear(data, now_s)
        if reception.fault is not None:
            return reception
        self.consider(changes, now_s)
        shared = self.social.organisation.shared_groups(self.name, emitter) if signals else ()
        heard = [
            (own, role, value)
            for (group, role, addressed), value in signals
            for own in (self.executive.satisfaction if group in shared else ())
            if own[0] == group and own[1] in addressed
        ]
        links = self.functional.picture.peers.links
        p_loss = links[emitter].incoming.p_reckoned if heard and emitter in links else 0.0
        for own, role, value in heard:
            self.executive.hear(own, emitter, role, value, now_s, reception.slot, p_loss)
        # At once, so that the answer makes the next own slot.
        if self.social.planner.due:
            self.think(now_s, 0.0)
        return reception

    # New facts -----------------------------------------------------------------------------------

    def conclude(self, facts: Sequence[Fact], now_s: float, is_sent: bool = True) -> None:
        """Record own facts and, if ``is_sent`` and needed by peers, offer them."""
        if facts:
            private = not self.radio.tells(facts, is_sent)
            self._share(self.beliefs.model.record(facts, now_s, private), now_s, is_sent)

    def _share(self, change: Change, now_s: float, is_sent: bool = True) -> None:
        self.radio.tell(change, self.social.addressed, now_s)
        self.consider([change], now_s, is_sent)

    def consider(self, changes: Sequence[Change], now_s: float, is_sent: bool = True) -> None:
        """Process changes of the world model; ``is_sent`` False: statements for this vehicle alone."""
        self.beliefs.note()
        self.radio.note(changes)
        considered = self.social.consider(changes, is_sent)
        if considered is NOTHING_CONSIDERED and not self._may_have_replanned:
            return
        self._may_have_replanned = False
        if considered.rulings:
            self._run_log.rulings(now_s, considered.rulings)
        if considered.activities_due:
            self._adopt()
        self._run_log.plans(now_s, self.social.planner.executions, self.social.pursuit.executions)

    def _recorded(self, sensed: Sensed, now_s: float) -> Change:
        beliefs, observation = self.beliefs, sensed.observation
        for change in self.condition.readings:
            observation = change(sensed.sensor, observation, beliefs.model.tbox)
        try:
            facts = beliefs.facts_of(observation)
            return beliefs.model.record(facts, now_s, private=not self.radio.tells(facts))
        except (WorldModelError, TypeError, ValueError) as error:
            message = f"sensor {sensed.sensor} of {self.name}: its observation cannot be recorded: {error}"
            raise PluginError(message) from error

    def _plan(self, now_s: float) -> None:
        deliberation = self.social.plan_missions()
        self._may_have_replanned = True
        for no_plan in deliberation.impossible:
            self._run_log.fault(now_s, "no plan", str(no_plan.task))
        facts, is_sent = deliberation.facts, not self.social.is_cut_off
        # A block is accepted whole: one large block would start no vehicle before its last fragment arrives.
        for part in [facts] if self.radio.manager.fits(facts) else deliberation.parts:
            self.conclude(part, now_s, is_sent)

    def go_on(self, before: Vehicle, now_s: float, remembers: bool) -> None:
        """Restart in place of ``before``; with ``remembers``, its facts count as received now."""
        self._next_decision_s = before._next_decision_s
        embody(self.functional, before.functional)
        self._adopt()
        if remembers:
            changes = remember(self.beliefs.model, before.beliefs.model, now_s).changes
            self.radio.manager.resume(now_s)
            self.consider(changes, now_s)
