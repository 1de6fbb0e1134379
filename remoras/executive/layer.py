"""Executive layer: which activities the vehicle performs, by satisfaction and altruism (REMORAS, section V)."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from remoras.activities import ActivityKind, ActivitySet, ActivityType, WeighedSet
from remoras.attraction import NO_PULLS, UNMOVED, Pulls, own_signal, passed_signal
from remoras.behaviours import Perception
from remoras.executive.decision import Choice
from remoras.executive.satisfaction import (
    DecisionConstants,
    answered,
    call,
    contentment,
    evolved,
    motivation,
    signal_of,
)

RoleKey = tuple[str, str]  # (group, role)
Call = tuple[RoleKey, str, str]  # the role addressed, the emitter and its role

STILL_PASSING = -32
"""Weakest call of a vehicle that has called for room and is hindered still."""
ANSWERING = 1.0 / 16.0
"""Advantage of a call that is being answered: satisfactions change by less in a few decisions."""
NO_EQUALS: Mapping[RoleKey, Collection[RoleKey]] = MappingProxyType({})
"""Of vehicles of which none is another's equal."""

_GUIDING = 1 << ActivityType.GUIDANCE
_DRIVING = (1 << ActivityType.GUIDANCE) | (1 << ActivityType.PRODUCTIVE) | (1 << ActivityType.PLANNING)


@dataclass(frozen=True, slots=True)
class Decision:
    """What the vehicle does until it decides anew.

    Attributes:
        chosen: indices of the activity sets.
        driving: roles that drive the vehicle: one of their activities guides, works or plans.
        types: bit word over ``ActivityType``.
    """

    chosen: tuple[int, ...] = ()
    driving: frozenset[RoleKey] = frozenset()
    types: int = 0

    def has(self, activity_type: ActivityType) -> bool:
        """True if an activity of that type is performed."""
        return bool(self.types >> activity_type & 1)


class HeardSignal(NamedTuple):
    """An influence signal as it was heard: satisfaction of the emitter in its role, when, and in which slot."""

    value: int
    heard_s: float
    slot: int | None = None


class ExecutiveLayer:
    """Motivations, satisfactions and the decision of one vehicle.

    Args:
        constants: of the model of satisfaction and altruism.
        name: of the vehicle.
        working: roles with a job that call on others, for help: no act is an answer but what ends the wait for the job.
        equals: by role, those whose holders are its equals: to them it calls for room.
        passes_on: whoever gives way to an equal passes its call on.

    Attributes:
        yields_to: strength of the call to which the vehicle gives way, 0..1; 0 if to none.
        is_hindered: another one has lately been in its way, and did not go the same way.
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
        self._claims: list[tuple[float, float]] = []  # times and strengths of calls for room that it has sent
        self._constants = constants
        self._name = name
        self._working = working
        self.period_s = constants.period_s
        self._choice = Choice(())
        self._role_of: list[RoleKey | None] = []
        self._effective: list[tuple[int, RoleKey | None, float, bool]] = []  # index, role, importance, hears calls
        self._is_own: list[bool] = []
        self._providers: dict[int, list[int]] = {}  # of each set that needs another one: the sets that have it
        self._heard: dict[RoleKey, dict[tuple[str, str], HeardSignal]] = {}
        self._calling: set[Call] = set()  # of these signals: those of the dissatisfied
        self._waiting: set[Call] = set()  # those of the dissatisfied in roles with a job
        self._ending: dict[int, Call] = {}  # by set that ends a wait: whose
        self._at_rest: Sequence[Perception] | None = None  # under which nothing changed at the last decision
        self._perceived: Sequence[Perception] | None = None  # at the last decision
        self._weighed_for: tuple[int, ...] | None = None  # what was performed when all was weighed
        self._advances: dict[RoleKey, float] = {}
        self.sets: tuple[ActivitySet, ...] = ()
        self.satisfaction: dict[RoleKey, float] = {}
        self.motivations: list[float] = []
        self._stimuli: list[float] = []
        self._external: list[float] = []
        self.decision = Decision()

    def adopt(self, sets: Sequence[ActivitySet], roles: Sequence[RoleKey]) -> None:
        """Consider ``sets`` from now on, in ``roles``; satisfaction in a role that is kept is kept too."""
        going_on = {self.sets[index] for index in self.decision.chosen}
        self.sets = tuple(sets)
        self._choice = Choice(sets)
        self._role_of = [(s.objective.group, s.objective.role) if s.objective is not None else None for s in sets]
        self._effective = [
            (index, role, one.importance, one.kind is ActivityKind.COLLECTIVE)
            for index, (one, role) in enumerate(zip(sets, self._role_of, strict=True))
            if one.effective
        ]
        self._is_own = [s.kind is ActivityKind.INDIVIDUAL and s.objective is not None for s in sets]
        self._providers = {
            index: [n for n, other in enumerate(sets) if any(a.name == one.needs for a in other.activities)]
            for index, one in enumerate(sets)
            if one.needs is not None
        }
        self.satisfaction = {role: self.satisfaction.get(role, 0.0) for role in roles}
        self._heard = {role: heard for role, heard in self._heard.items() if role in self.satisfaction}
        self._calling = {caller for caller in self._calling if caller[0] in self.satisfaction}
        self._waiting = {caller for caller in self._waiting if caller[0] in self.satisfaction}
        self._ending = {}
        self._at_rest = self._perceived = self._weighed_for = None
        self.motivations = [0.0] * len(sets)
        self._stimuli, self._external = [0.0] * len(sets), [0.0] * len(sets)
        self.decision = self._decision(tuple(index for index, s in enumerate(sets) if s in going_on))

    def hear(
        self, addressed: RoleKey, emitter: str, emitter_role: str, value: int, now_s: float, slot: int | None = None
    ) -> None:
        """Take note of an influence signal; a newer one replaces an older one.

        Args:
            addressed: a role; the signal is let go of if this vehicle does not play it.
            emitter, emitter_role: the vehicle that sent it, and the role it speaks of.
            value: satisfaction of the emitter in that role, -128..127.
            slot: in which it was sent.
        """
        if addressed in self.satisfaction:
            self._heard.setdefault(addressed, {})[emitter, emitter_role] = HeardSignal(value, now_s, slot)
            role = addressed[0], emitter_role
            if addressed in self._equals and role in self._equals[addressed]:
                return  # it moves guidance alone
            calling = self._waiting if role in self._working else self._calling
            (calling.add if value < 0 else calling.discard)((addressed, emitter, emitter_role))

    def signals(self) -> list[tuple[RoleKey, int]]:
        """Every role of this vehicle, with the signed byte of its satisfaction, or of a call that it passes on."""
        found = [(role, signal_of(value)) for role, value in self.satisfaction.items()]
        if self._equals:
            guiding = self._guiding_role()
            found = [(role, self._told(role, value, role == guiding)) for role, value in found]
        return found

    def _told(self, role: RoleKey, value: int, guides: bool) -> int:
        """The signal of a role: to equals it says whose call it is.

        Nothing but who hinders the vehicle makes one of its own. Whoever has called goes on until nobody hinders it any
        more, however satisfied it is meanwhile: else the other one would come back before it has passed.
        """
        if role not in self._equals:
            return value
        if guides and self.yields_to > 0.0:
            return passed_signal(self.yields_to) if self._passes_on else 0
        if not (guides and self.is_hindered):
            return own_signal(max(0, value))
        since_s, told = self._now_s - self._constants.signal_memory_s, own_signal(value)
        self._claims = [claim for claim in self._claims if claim[0] >= since_s]
        if self._claims:
            told = min(told, STILL_PASSING)
        if told < 0:
            self._claims.append((self._now_s, call(told, 0.0, self._constants)))
        return told

    def _guiding_role(self) -> RoleKey | None:
        """The role by which the vehicle is guided, if it is by one."""
        guiding = next((index for index in self.decision.chosen if self.sets[index].types & _GUIDING), None)
        return None if guiding is None else self._role_of[guiding]

    def decide(self, perceptions: Sequence[Perception], now_s: float, dt_s: float) -> Decision:
        """The best combination of activities now.

        Args:
            perceptions: of every set, in the order of the sets.
            dt_s: time since the last decision, by which satisfactions evolve afterwards.

        Returns:
            The same object as before while the choice stays the same.
        """
        self._now_s = now_s
        if self._at_rest == perceptions and not (self._calling or self._waiting):
            return self.decision
        constants = self._constants
        stimuli = self._stimuli if perceptions is self._perceived else self._stimuli_of(perceptions)
        calls = self._strongest_calls(now_s) if self._calling else {}
        waits = self._louder_waits(now_s) if self._waiting else ()
        own = self._contentment(stimuli) if calls or waits else 0.0
        motivations, external = self.motivations, self._external
        performed = self.decision.chosen
        if calls or waits or performed != self._weighed_for or stimuli != self._stimuli:
            weighed = self._effective
            self._weighed_for = None if calls or waits else performed
        else:  # only satisfaction moves the vehicle otherwise than before
            weighed = [one for one in self._effective if one[0] in performed]
        self._stimuli = stimuli
        for index, role, importance, listens in weighed:
            stimulus = stimuli[index]
            if stimulus <= 0.0:
                motivations[index] = external[index] = 0.0
                continue
            heeded = 0.0
            if calls and role in calls and listens:
                heeded = answered(calls[role], perceptions[index].settled, own)
            if waits and listens and perceptions[index].ends is not None:
                heeded = self._ended(index, role, perceptions[index], waits, own)
            satisfaction = None if role is None or index not in performed else self.satisfaction[role]
            motivations[index] = motivation(importance, stimulus, satisfaction, heeded, constants)
            external[index] = constants.weight_external * heeded
        chosen = self._choice.best(motivations)
        if chosen != performed:
            self.decision = self._decision(chosen)
        is_steady = dt_s > 0.0 and self._evolve(perceptions, dt_s)
        self._perceived = perceptions
        self._at_rest = perceptions if is_steady and chosen == performed else None
        return self.decision

    def candidates(self, now_s: float) -> list[WeighedSet]:
        """Every activity set that has an effect, as the last decision, made at ``now_s``, weighed it."""
        found = []
        for index, one in enumerate(self.sets):
            if not one.effective:
                continue
            external, source, slot = self._external[index], "", None
            if external > 0.0 and (key := self._caller(index, now_s)) is not None:
                source, slot = key[1], self._heard[key[0]][key[1:]].slot
            motivation, chosen = self.motivations[index], index in self.decision.chosen
            mean = self._choice.best_mean(self.motivations, index)
            found.append(WeighedSet(one, self._stimuli[index], motivation, external, source, slot, chosen, mean))
        return found

    def _stimuli_of(self, perceptions: Sequence[Perception]) -> list[float]:
        """Stimulus of every set; what needs another activity is worth as much as that one, and all that it needs."""
        stimuli = [perception.stimulus for perception in perceptions]
        for _ in self._providers:  # as often as the longest chain of needs takes
            for needy, providers in self._providers.items():
                stimuli[needy] = min(stimuli[needy], max((stimuli[index] for index in providers), default=0.0))
        return stimuli

    def _contentment(self, stimuli: Sequence[float]) -> float:
        """How content the vehicle is with work of its own, and how much of it is left, 0..1; 0 without work."""
        return max(
            (
                contentment(stimuli[index], self.satisfaction[role])
                for index in self.decision.chosen
                if self._is_own[index] and (role := self._role_of[index]) is not None
            ),
            default=0.0,
        )

    def calls(self, now_s: float) -> dict[str, float]:
        """How dissatisfied the vehicles are that call on any role of this one, 0..1 by name; others are missing."""
        found: dict[str, float] = {}
        for heard in self._heard.values():
            for (emitter, _), signal in heard.items():
                if (strength := call(signal.value, now_s - signal.heard_s, self._constants)) > 0.0:
                    found[emitter] = max(strength, found.get(emitter, 0.0))
        return dict(sorted(found.items()))

    def pulls(self, now_s: float) -> Pulls:
        """How signals pull at the vehicle while it does what it has decided; see ``remoras.attraction``."""
        guiding = next((index for index in self.decision.chosen if self.sets[index].types & _GUIDING), None)
        role = None if guiding is None else self._role_of[guiding]
        heard = {} if role is None else self._heard.get(role, {})
        if guiding is None or role is None or not (heard or role in self._equals):
            return NO_PULLS
        if self._constants.weight_external == 0.0:  # no signal moves it
            return UNMOVED if role in self._equals else NO_PULLS
        equals: dict[str, float] = {}
        passed: dict[str, float] = {}
        has_callers = False
        for (emitter, emitter_role), signal in heard.items():
            if not self._are_equals(role, emitter_role):
                has_callers = True
            elif signal.value < 0 and now_s - signal.heard_s <= self._constants.signal_memory_s:
                of = passed if role in self._equals and signal.value % 2 else equals
                of[emitter] = max(of.get(emitter, 0.0), call(signal.value, 0.0, self._constants))
        answered: dict[str, float] = {}
        if has_callers and self._external[guiding] > 0.0 and (key := self._caller(guiding, now_s)) is not None:
            answered[key[1]] = self._external[guiding] / self._constants.weight_external
        own = call(signal_of(self.satisfaction[role]), 0.0, self._constants)
        since_s = now_s - self._constants.signal_memory_s
        own = max([own, *(strength for sent_s, strength in self._claims if sent_s >= since_s)])
        return Pulls(own, answered, equals, passed, role in self._equals)

    def _are_equals(self, role: RoleKey, other: str) -> bool:
        """True if the holders of a role and of another one of its group are equals."""
        return other == role[1] or (role in self._equals and (role[0], other) in self._equals[role])

    def _caller(self, index: int, now_s: float) -> Call | None:
        """The signal that moves an activity set: of who waits for it, or the loudest of those without a job."""
        role = self._role_of[index]
        if index in self._ending or role is None:
            return self._ending.get(index)
        heard = self._heard[role]
        idle = [of for of in heard if (role[0], of[1]) not in self._working]
        loudest = max(idle, key=lambda of: call(heard[of].value, now_s - heard[of].heard_s, self._constants))
        return role, *loudest

    def _louder_waits(self, now_s: float) -> list[tuple[Call, float]]:
        """Calls of holders of jobs that are louder than the vehicle's own in such a role, and their strength, 0..1.

        As with Simonin and Ferber nobody answers a signal that is weaker than the one that it emits itself; of two
        alike that of the vehicle whose name comes first is the louder one. They are compared in full while remembered.
        A vehicle that answers a call goes on until its own is louder by ``ANSWERING``.
        """
        constants, own = self._constants, 0.0
        answered = {self._ending.get(index) for index in self.decision.chosen}
        for role, value in self.satisfaction.items():
            if role in self._working:
                own = max(own, call(signal_of(value), 0.0, constants))
        found = []
        for key in sorted(self._waiting):
            signal = self._heard[key[0]][key[1:]]
            age_s, loud = now_s - signal.heard_s, call(signal.value, 0.0, constants)
            loud += ANSWERING if key in answered else 0.0
            if age_s <= constants.signal_memory_s and (loud > own or (loud == own and key[1] < self._name)):
                found.append((key, call(signal.value, age_s, constants)))
        return found

    def _ended(
        self, index: int, role: RoleKey | None, of: Perception, waits: Sequence[tuple[Call, float]], own: float
    ) -> float:
        """What the waits of others that an activity ends move the vehicle to, 0..1."""
        heeded = 0.0
        self._ending.pop(index, None)
        for key, strength in waits:
            if key[0] == role and of.ends is not None:
                moved = answered(strength, of.ends(key[1], key[2]), own)
                if moved > heeded:
                    heeded, self._ending[index] = moved, key
        return heeded

    def _strongest_calls(self, now_s: float) -> dict[RoleKey, float]:
        """How loud the loudest call on each role is, 0..1; roles that nobody calls are missing."""
        found: dict[RoleKey, float] = {}
        for role, emitter, emitter_role in self._calling:
            signal = self._heard[role][emitter, emitter_role]
            strength = call(signal.value, now_s - signal.heard_s, self._constants)
            found[role] = max(strength, found.get(role, 0.0))
        return found

    def _evolve(self, perceptions: Sequence[Perception], dt_s: float) -> bool:
        """Personal satisfaction follows the best advance that is perceived in each role, whatever was chosen.

        Returns:
            True if all is as it was, and will be as long as the same is perceived.
        """
        if perceptions is not self._perceived:
            self._advances = self._advances_of(perceptions)
        advances = self._advances
        is_steady, satisfaction, constants = True, self.satisfaction, self._constants
        for role, value in satisfaction.items():
            after = evolved(value, advances.get(role), dt_s, constants)
            if after != value:
                satisfaction[role], is_steady = after, False
        return is_steady

    def _advances_of(self, perceptions: Sequence[Perception]) -> dict[RoleKey, float]:
        """The best advance that is perceived in each role; roles in which none is are missing."""
        advances: dict[RoleKey, float] = {}
        for perception, role in zip(perceptions, self._role_of, strict=True):
            perceived = perception.advance
            if perceived is not None and role is not None:
                known = advances.get(role)
                if known is None or perceived > known:
                    advances[role] = perceived
        return advances

    def _decision(self, chosen: tuple[int, ...]) -> Decision:
        types = 0
        driving = set()
        for index in chosen:
            types |= self.sets[index].types
            role = self._role_of[index]
            if role is not None and self.sets[index].types & _DRIVING:
                driving.add(role)
        return Decision(chosen, frozenset(driving), types)
