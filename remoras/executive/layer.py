"""Executive layer: activity selection by satisfaction and altruism (REMORAS, section V)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, WeighedSet
from remoras.behaviours import Perception
from remoras.executive.decision import (
    LOWEST,
    Choice,
    DecisionConstants,
    answered,
    call,
    contentment,
    evolved,
    motivation,
    signal_of,
)
from remoras.motion.attraction import NO_PULLS, UNMOVED, Pulls, own_signal, passed_signal

RoleKey = tuple[str, str]  # (group, role)
Call = tuple[RoleKey, str, str]  # the role addressed, the emitter and its role

STILL_PASSING = -32
"""Weakest call of a vehicle that has called for passage and is still obstructed."""
ANSWERING = 1.0 / 16.0
"""Bonus of the call being answered, above the satisfaction change of a few decisions."""
NO_PROGRESS: Mapping[int, float | None] = MappingProxyType({})
NO_EQUALS: Mapping[RoleKey, Collection[RoleKey]] = MappingProxyType({})

_GUIDING = 1 << ActivityType.GUIDANCE
_DRIVING = (1 << ActivityType.GUIDANCE) | (1 << ActivityType.PRODUCTIVE) | (1 << ActivityType.PLANNING)


@dataclass(frozen=True, slots=True)
class Decision:
    """Activities until the next decision; roles are ``driving`` if they guide, work or plan; ``guiding`` is a set."""

    chosen: tuple[int, ...] = ()
    driving: frozenset[RoleKey] = frozenset()
    types: int = 0
    guiding: int | None = None

    def has(self, activity_type: ActivityType) -> bool:
        """Return whether an activity of that type is performed."""
        return bool(self.types >> activity_type & 1)


class HeardSignal(NamedTuple):
    """Received influence signal: satisfaction of the emitter in its role, time (s), slot; ``stretch`` of its memory."""

    value: int
    heard_s: float
    slot: int | None = None
    stretch: float = 1.0

    def age_s(self, now_s: float) -> float:
        """Age by which the signal fades."""
        return (now_s - self.heard_s) / self.stretch


class ExecutiveLayer:
    """Motivations, satisfactions and the decision of one vehicle.

    Roles ``working`` on a job call for help; only acts that end the wait for the job respond. Roles of equal rank
    (``equals``) receive calls for passage, relayed by yielding vehicles if ``passes_on``. ``yields_to`` is the strength
    of the call to which the vehicle yields, 0..1; 0 if none.
    """

    def __init__(
        self,
        constants: DecisionConstants,
        name: str = "",
        working: Collection[RoleKey] = frozenset(),
        equals: Mapping[RoleKey, Collection[RoleKey]] = NO_EQUALS,
        passes_on: bool = True,
    ) -> None:
        self._equals, self._passes_on = equals, passes_on
        self.yields_to, self.is_hindered = 0.0, False
        self._now_s = 0.0  # of the last decision
        self._claims: list[tuple[float, float]] = []  # times and strengths of its calls for passage
        self._constants = constants
        self._name = name
        self._working = working
        self.period_s = constants.period_s
        self._choice = Choice(())
        self._role_of: list[RoleKey | None] = []
        self._effective: list[tuple[int, RoleKey | None, float, bool]] = []  # index, role, importance, is collective
        self._called_as: list[list[RoleKey]] = []  # by set: own roles of its group with the same activities
        self._is_own: list[bool] = []
        self._providers: dict[int, list[int]] = {}  # by set with a need: the sets that provide it
        self._resting: list[list[int]] = []  # by set: itself and the sets with a need for it
        self._heard: dict[RoleKey, dict[tuple[str, str], HeardSignal]] = {}
        self._calling: set[Call] = set()  # signals of dissatisfied emitters
        self._waiting: set[Call] = set()  # signals of dissatisfied emitters in roles with a job
        self._ending: dict[int, Call] = {}  # by set that ends a wait: its call
        self._helping: set[tuple[str, str, str]] = set()  # (group, vehicle, role): jobs to help with
        self._perceived: Sequence[Perception] | None = None  # at the last decision
        self._progress: Mapping[int, float | None] = NO_PROGRESS  # likewise
        self._is_weighed = False  # motivations are current, except for new stimuli and satisfaction that has evolved
        self._has_evolved = False
        self._given: dict[int, float | None] = {}  # advances that perceptions state
        self._advances: dict[RoleKey, float] = {}
        self.sets: tuple[ActivitySet, ...] = ()
        self.satisfaction: dict[RoleKey, float] = {}
        self.motivations: list[float] = []
        self._stimuli: list[float] = []
        self._external: list[float] = []
        self.decision = Decision()

    def adopt(self, sets: Sequence[ActivitySet], roles: Sequence[RoleKey]) -> None:
        """Replace candidate activity sets and roles; keep the satisfaction of retained roles."""
        going_on = {self.sets[index] for index in self.decision.chosen}
        self.sets = tuple(sets)
        self._choice = Choice(sets)
        self._role_of = [(s.objective.group, s.objective.role) if s.objective is not None else None for s in sets]
        self._effective = [
            (index, role, activities.importance, activities.kind is ActivityKind.COLLECTIVE)
            for index, (activities, role) in enumerate(zip(sets, self._role_of, strict=True))
            if activities.effective
        ]
        roles_with: dict[tuple[str, tuple[Activity, ...]], list[RoleKey]] = {}
        for role, activities in zip(self._role_of, sets, strict=True):
            if role is not None:
                roles_with.setdefault((role[0], activities.activities), []).append(role)
        # A vehicle that waits at a rally point in two roles must not alternate between them with the latest call.
        self._called_as = [
            [] if role is None else roles_with[role[0], activities.activities]
            for role, activities in zip(self._role_of, sets, strict=True)
        ]
        self._is_own = [s.kind is ActivityKind.INDIVIDUAL and s.objective is not None for s in sets]
        self._providers = {
            index: [n for n, other in enumerate(sets) if any(a.name == activities.needs for a in other.activities)]
            for index, activities in enumerate(sets)
            if activities.needs is not None
        }
        self._resting = [[index] for index in range(len(sets))]
        for resting in self._resting:
            for index in resting:  # those found are followed, too
                resting += [n for n, on in self._providers.items() if index in on and n not in resting]
        self.satisfaction = {role: self.satisfaction.get(role, 0.0) for role in roles}
        self._heard = {role: signals for role, signals in self._heard.items() if role in self.satisfaction}
        self._calling = {caller for caller in self._calling if caller[0] in self.satisfaction}
        self._waiting = {caller for caller in self._waiting if caller[0] in self.satisfaction}
        self._ending = {}
        self._perceived, self._is_weighed = None, False
        self.motivations = [0.0] * len(sets)
        self._stimuli, self._external = [0.0] * len(sets), [0.0] * len(sets)
        self.decision = self._decision(tuple(index for index, s in enumerate(sets) if s in going_on))

    def hear(
        self,
        addressed: RoleKey,
        emitter: str,
        emitter_role: str,
        value: int,
        now_s: float,
        slot: int | None = None,
        p_loss: float = 0.0,
    ) -> None:
        """Record an influence signal, -128..127, if it addresses an own role; replace an older one."""
        if addressed in self.satisfaction:
            heard = HeardSignal(value, now_s, slot, self._constants.stretch(p_loss))
            self._heard.setdefault(addressed, {})[emitter, emitter_role] = heard
            role = addressed[0], emitter_role
            if addressed in self._equals and role in self._equals[addressed]:
                return  # it affects guidance only
            calling = self._waiting if role in self._working else self._calling
            (calling.add if value < 0 else calling.discard)((addressed, emitter, emitter_role))

    def waiting(self) -> tuple[RoleKey, ...]:
        """Return the own roles whose job waits for another vehicle."""
        perceived = self._perceived or ()
        waiting = [self._role_of[index] for index in self.decision.chosen if perceived and perceived[index].waits]
        return tuple(role for role in waiting if role is not None and role in self._working)

    def ended(self, caller: str, role: str) -> float:
        """Return the share of a wait that this vehicle would end, less its satisfaction with own work, 0..1."""
        perceived = zip(self._stimuli, self._perceived or (), strict=False)
        ended = max([p.ends(caller, role) for s, p in perceived if s > 0.0 and p.ends is not None], default=0.0)
        return answered(1.0, ended, self._contentment(self._stimuli))

    def help(self, jobs: Collection[tuple[str, str, str]], slots: Mapping[str, int], now_s: float) -> None:
        """Respond to these (group, vehicle, role) as to calls of the greatest strength, no longer to former ones."""
        for group, vehicle, role in sorted(self._helping.union(jobs)):
            value = LOWEST if (group, vehicle, role) in jobs else 0
            for addressed in self.satisfaction:
                if addressed[0] == group:
                    self.hear(addressed, vehicle, role, value, now_s, slots.get(vehicle))
        self._helping = set(jobs)

    def stands(self, perceptions: Sequence[Perception], progress: Mapping[int, float | None]) -> bool:
        """Return whether ``decide`` with the same lists as last time would change nothing."""
        is_called = self._calling or self._waiting or self.yields_to > 0.0 or self.is_hindered
        is_same = perceptions is self._perceived and progress is self._progress
        return is_same and self._is_weighed and not (self._has_evolved or is_called)

    def signals(self) -> list[tuple[RoleKey, int]]:
        """Return each role with the byte of its satisfaction, or of a relayed call."""
        signals = [(role, signal_of(value)) for role, value in self.satisfaction.items()]
        if self._equals:
            guiding = self.decision.guiding
            guided = None if guiding is None else self._role_of[guiding]
            signals = [(role, self._told(role, value, role == guided)) for role, value in signals]
        return signals

    def _told(self, role: RoleKey, value: int, guides: bool) -> int:
        """Return a role's influence signal: among equals, a call only if obstructed or yielding."""
        if role not in self._equals:
            return value
        if guides and self.yields_to > 0.0:
            return passed_signal(self.yields_to) if self._passes_on else 0
        if not (guides and self.is_hindered):
            return own_signal(max(0, value))
        since_s, signal = self._now_s - self._constants.signal_memory_s, own_signal(value)
        self._claims = [claim for claim in self._claims if claim[0] >= since_s]
        # It calls while obstructed, however satisfied: else the other vehicle would return before it has passed.
        if self._claims:
            signal = min(signal, STILL_PASSING)
        if signal < 0:
            self._claims.append((self._now_s, call(signal, 0.0, self._constants)))
        return signal

    def spare(self, index: int) -> float:
        """Return by how much the stimulus of a set may change without effect on the decision."""
        spare, motivations, sets = self._choice.spare, self.motivations, self.sets
        return min([spare(motivations, n) / (sets[n].importance or 1.0) for n in self._resting[index]])

    def decide(
        self,
        perceptions: Sequence[Perception],
        now_s: float,
        dt_s: float,
        progress: Mapping[int, float | None] = NO_PROGRESS,
        renew: Callable[[], Sequence[Perception]] | None = None,
    ) -> Decision:
        """Return the best combination (the same object while unchanged), then evolve satisfactions.

        ``progress`` has the advances that the same list of perceptions leaves open. ``renew`` returns the
        perceptions without the deviations that ``spare`` allows.
        """
        self._now_s, self._progress = now_s, progress
        constants, performed = self._constants, self.decision.chosen
        is_weighed = self._weigh(perceptions, now_s)
        if is_weighed and renew is not None and not self._choice.holds(self.motivations):
            self._weigh(renew(), now_s)
        chosen = self._choice.best(self.motivations) if is_weighed else performed
        if chosen != performed:
            self.decision, self._is_weighed = self._decision(chosen), False
        self._has_evolved = True  # as far as known
        if dt_s > 0.0:
            advances = self._advances_of({**self._given, **progress}) if progress else self._advances
            if not constants.updates_satisfy:
                given = {**self._given, **progress}
                advances = self._advances_of({index: given.get(index) for index in self.decision.chosen})
            self._has_evolved = self._evolve(dt_s, advances)
        return self.decision

    def _weigh(self, perceptions: Sequence[Perception], now_s: float) -> bool:
        """Update motivations; return whether any may have changed."""
        constants, performed = self._constants, self.decision.chosen
        anew: Collection[int] = performed if self._has_evolved else ()
        if perceptions is not self._perceived:
            before, self._perceived, self._stimuli = self._stimuli, perceptions, self._stimuli_of(perceptions)
            anew = {*anew, *(n for n, stimulus in enumerate(self._stimuli) if stimulus != before[n])}
            self._given = {n: p.advance for n, p in enumerate(perceptions) if isinstance(p.advance, float | int)}
            self._advances = self._advances_of(self._given)
        stimuli = self._stimuli
        calls = self._strongest_calls(now_s) if self._calling else {}
        waits = self._louder_waits(now_s) if self._waiting else ()
        own = self._contentment(stimuli) if calls or waits else 0.0
        motivations, external = self.motivations, self._external
        if calls or waits or not self._is_weighed:
            weighed = self._effective
        else:
            weighed = [entry for entry in self._effective if entry[0] in anew] if anew else []
        self._is_weighed = not (calls or waits)
        for index, role, importance, listens in weighed:
            stimulus = stimuli[index]
            if stimulus <= 0.0:
                motivations[index] = external[index] = 0.0
                continue
            heeded = 0.0
            if (
                calls
                and listens
                and (strength := max([calls.get(r, 0.0) for r in self._called_as[index]], default=0.0)) > 0
            ):
                heeded = answered(strength, perceptions[index].settled, own)
            if waits and listens and perceptions[index].ends is not None:
                heeded = self._ended(index, role, perceptions[index], waits, own)
            satisfaction = None if role is None or index not in performed else self.satisfaction[role]
            motivations[index] = motivation(importance, stimulus, satisfaction, heeded, constants)
            external[index] = constants.weight_external * heeded
        return bool(weighed)

    def candidates(self, now_s: float) -> list[WeighedSet]:
        """Return all effective activity sets as evaluated by the last decision, at ``now_s``."""
        candidates = []
        for index, acts in enumerate(self.sets):
            if not acts.effective:
                continue
            external, source, slot = self._external[index], "", None
            if external > 0.0 and (key := self._caller(index, now_s)) is not None:
                source, slot = key[1], self._heard[key[0]][key[1:]].slot
            motivation, chosen = self.motivations[index], index in self.decision.chosen
            mean = self._choice.best_mean(self.motivations, index)
            candidates.append(WeighedSet(acts, self._stimuli[index], motivation, external, source, slot, chosen, mean))
        return candidates

    def _stimuli_of(self, perceptions: Sequence[Perception]) -> list[float]:
        stimuli = [perception.stimulus for perception in perceptions]
        for _ in self._providers:  # length of the longest chain of needs
            for needy, providers in self._providers.items():
                stimuli[needy] = min(stimuli[needy], max((stimuli[index] for index in providers), default=0.0))
        return stimuli

    def _contentment(self, stimuli: Sequence[float]) -> float:
        return max(
            (
                contentment(stimuli[index], self.satisfaction[role])
                for index in self.decision.chosen
                if self._is_own[index] and (role := self._role_of[index]) is not None
            ),
            default=0.0,
        )

    def calls(self, now_s: float) -> dict[str, float]:
        """Return the dissatisfaction 0..1 of vehicles that call on any role of this one."""
        strengths: dict[str, float] = {}
        for signals in self._heard.values():
            for (emitter, _), signal in signals.items():
                if (strength := call(signal.value, signal.age_s(now_s), self._constants)) > 0.0:
                    strengths[emitter] = max(strength, strengths.get(emitter, 0.0))
        return dict(sorted(strengths.items()))

    def pulls(self, now_s: float) -> Pulls:
        """Return attraction and repulsion inputs of the decision (``remoras.motion.attraction``)."""
        guiding = self.decision.guiding
        role = None if guiding is None else self._role_of[guiding]
        signals = {} if role is None else self._heard.get(role, {})
        if guiding is None or role is None or not (signals or role in self._equals):
            return NO_PULLS
        if self._constants.weight_external == 0.0:  # no signal moves it
            return UNMOVED if role in self._equals else NO_PULLS
        equals: dict[str, float] = {}
        passed: dict[str, float] = {}
        has_callers = False
        for (emitter, emitter_role), signal in signals.items():
            if not self._are_equals(role, emitter_role):
                has_callers = True
            elif signal.value < 0 and signal.age_s(now_s) <= self._constants.signal_memory_s:
                callers = passed if role in self._equals and signal.value % 2 else equals
                # At full weight whatever its age: if remembered calls faded, both vehicles would consider their own
                # call stronger.
                callers[emitter] = max(callers.get(emitter, 0.0), call(signal.value, 0.0, self._constants))
        answered: dict[str, float] = {}
        if has_callers and self._external[guiding] > 0.0 and (key := self._caller(guiding, now_s)) is not None:
            answered[key[1]] = self._external[guiding] / self._constants.weight_external
        own = call(signal_of(self.satisfaction[role]), 0.0, self._constants)
        since_s = now_s - self._constants.signal_memory_s
        # Including calls sent lately, since the received ones may answer them.
        own = max([own, *(strength for sent_s, strength in self._claims if sent_s >= since_s)])
        return Pulls(own, answered, equals, passed, role in self._equals)

    def _are_equals(self, role: RoleKey, other: str) -> bool:
        return role in self._equals and (role[0], other) in self._equals[role]

    def _caller(self, index: int, now_s: float) -> Call | None:
        """Return the signal that moves a set: of a waiting vehicle, or the strongest without a job."""
        if index in self._ending:
            return self._ending[index]
        calls = [
            (role, *emitter)
            for role in self._called_as[index]
            for emitter in self._heard.get(role, ())
            if (role[0], emitter[1]) not in self._working
        ]
        return max(calls, key=lambda key: self._strength(key, now_s), default=None)

    def _strength(self, key: Call, now_s: float) -> float:
        signal = self._heard[key[0]][key[1:]]
        return call(signal.value, signal.age_s(now_s), self._constants)

    def _louder_waits(self, now_s: float) -> list[tuple[Call, float]]:
        """Return calls of job holders above the own call in such a role, with strength 0..1."""
        # As with Simonin and Ferber, a vehicle responds to no signal weaker than its own; on a tie the first name wins.
        constants, own = self._constants, 0.0
        answered = {self._ending.get(index) for index in self.decision.chosen}
        for role, value in self.satisfaction.items():
            if role in self._working:
                own = max(own, call(signal_of(value), 0.0, constants))
        louder = []
        for key in sorted(self._waiting):
            signal = self._heard[key[0]][key[1:]]
            # Without fading, since the own call has age 0. The bonus keeps a vehicle from changing sides midway.
            age_s, loud = signal.age_s(now_s), call(signal.value, 0.0, constants)
            loud += ANSWERING if key in answered else 0.0
            if age_s <= constants.signal_memory_s and (loud > own or (loud == own and key[1] < self._name)):
                louder.append((key, call(signal.value, age_s, constants)))
        return louder

    def _ended(
        self, index: int, role: RoleKey | None, perception: Perception, waits: Sequence[tuple[Call, float]], own: float
    ) -> float:
        """Return the effect 0..1 of the waits that an activity ends, and record the strongest."""
        heeded = 0.0
        self._ending.pop(index, None)
        for key, strength in waits:
            if key[0] == role and perception.ends is not None:
                moved = answered(strength, perception.ends(key[1], key[2]), own)
                if moved > heeded:
                    heeded, self._ending[index] = moved, key
        return heeded

    def _strongest_calls(self, now_s: float) -> dict[RoleKey, float]:
        strongest: dict[RoleKey, float] = {}
        for key in self._calling:
            strongest[key[0]] = max(self._strength(key, now_s), strongest.get(key[0], 0.0))
        return strongest

    def _evolve(self, dt_s: float, advances: Mapping[RoleKey, float]) -> bool:
        has_evolved, satisfaction, constants = False, self.satisfaction, self._constants
        for role, value in satisfaction.items():
            after = evolved(value, advances.get(role), dt_s, constants)
            if after != value:
                satisfaction[role], has_evolved = after, True
        return has_evolved

    def _advances_of(self, advances: Mapping[int, float | None]) -> dict[RoleKey, float]:
        greatest: dict[RoleKey, float] = {}
        for index, advance in advances.items():
            if advance is not None and (role := self._role_of[index]) is not None:
                greatest[role] = max(advance, greatest.get(role, advance))
        return greatest

    def _decision(self, chosen: tuple[int, ...]) -> Decision:
        types, guiding = 0, None
        driving = set()
        for index in chosen:
            of_set, role = self.sets[index].types, self._role_of[index]
            types |= of_set
            if of_set & _GUIDING:
                guiding = index
            if role is not None and of_set & _DRIVING:
                driving.add(role)
        return Decision(chosen, frozenset(driving), types, guiding)
