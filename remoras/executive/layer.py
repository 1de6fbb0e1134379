"""Executive layer: which activities the vehicle performs, by satisfaction and altruism (REMORAS, section V)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from remoras.activities import ActivityKind, ActivitySet, ActivityType, WeighedSet
from remoras.attraction import NO_PULLS, Pulls
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


@dataclass(frozen=True, slots=True)
class HeardSignal:
    """An influence signal as it was heard: satisfaction of the emitter in its role, when, and in which slot."""

    value: int
    heard_s: float
    slot: int | None = None


class ExecutiveLayer:
    """Motivations, satisfactions and the decision of one vehicle.

    Args:
        constants: of the model of satisfaction and altruism.
    """

    def __init__(self, constants: DecisionConstants) -> None:
        self._constants = constants
        self.period_s = constants.period_s
        self._choice = Choice(())
        self._role_of: list[RoleKey | None] = []
        self._effective: list[tuple[int, RoleKey | None, float, bool]] = []  # index, role, importance, hears calls
        self._is_own: list[bool] = []
        self._providers: dict[int, list[int]] = {}  # of each set that needs another one: the sets that have it
        self._heard: dict[RoleKey, dict[tuple[str, str], HeardSignal]] = {}
        self._calling: set[tuple[RoleKey, str, str]] = set()  # of these signals: those of the dissatisfied
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
            (self._calling.add if value < 0 else self._calling.discard)((addressed, emitter, emitter_role))

    def signals(self) -> list[tuple[RoleKey, int]]:
        """Every role of this vehicle, with the signed byte of its satisfaction."""
        return [(role, signal_of(value)) for role, value in self.satisfaction.items()]

    def decide(self, perceptions: Sequence[Perception], now_s: float, dt_s: float) -> Decision:
        """The best combination of activities now.

        Args:
            perceptions: of every set, in the order of the sets.
            dt_s: time since the last decision, by which satisfactions evolve afterwards.

        Returns:
            The same object as before while the choice stays the same.
        """
        if self._at_rest == perceptions and not self._calling:
            return self.decision
        constants = self._constants
        stimuli = self._stimuli if perceptions is self._perceived else self._stimuli_of(perceptions)
        calls = self._strongest_calls(now_s) if self._calling else {}
        own = self._contentment(stimuli) if calls else 0.0
        motivations, external = self.motivations, self._external
        performed = self.decision.chosen
        if calls or performed != self._weighed_for or stimuli != self._stimuli:
            weighed = self._effective
            self._weighed_for = None if calls else performed
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

    def decided_anew(self) -> tuple[int, ...]:
        """What would be chosen by the motivations of the last decision if every combination was looked at again."""
        return self._choice.searched(self.motivations)

    def candidates(self, now_s: float) -> list[WeighedSet]:
        """Every activity set that has an effect, as the last decision, made at ``now_s``, weighed it."""
        found = []
        for index, one in enumerate(self.sets):
            if not one.effective:
                continue
            external, source, slot = self._external[index], "", None
            if external > 0.0 and (role := self._role_of[index]) is not None:
                heard = self._heard[role]
                key = self._loudest(heard, now_s)
                source, slot = key[0], heard[key].slot
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
        if guiding is None or role is None or not heard:
            return NO_PULLS
        equals: dict[str, float] = {}
        callers = {}
        for key, signal in heard.items():
            if key[1] != role[1]:
                callers[key] = signal
            elif signal.value < 0 and now_s - signal.heard_s <= self._constants.signal_memory_s:
                equals[key[0]] = call(signal.value, 0.0, self._constants)
        answered: dict[str, float] = {}
        if callers and self._external[guiding] > 0.0:
            answered[self._loudest(callers, now_s)[0]] = self._external[guiding] / self._constants.weight_external
        own = call(signal_of(self.satisfaction[role]), 0.0, self._constants)
        return Pulls(own, answered, equals)

    def _loudest(self, heard: Mapping[tuple[str, str], HeardSignal], now_s: float) -> tuple[str, str]:
        """Emitter and its role of the signal that calls loudest."""
        return max(heard, key=lambda of: call(heard[of].value, now_s - heard[of].heard_s, self._constants))

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
