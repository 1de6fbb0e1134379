"""Advice: which strategy a scenario asks for, by how much, how sure that is, and on which instances it rests."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from missions.advising.experience import Experience, Numbers, TriedInstance, compared
from missions.advising.instances import GROUND
from missions.advising.model import CHOICES, WITHIN, Model, Pooling
from missions.advising.traits import TRAITS, traits_of
from missions.runs.setup import Setup
from missions.scenarios import load
from missions.scenarios.extending import features

TAIL = 0.025
N_NEAREST = 5
ROOM = 0.25
"""Deviations of a trait by which it may be less than the least of the instances, or more than the most."""


@dataclass(frozen=True)
class Rated:
    """One strategy in a scenario.

    Attributes:
        strategy: its name.
        longer: mission time over that of the advised strategy, less 1.
        low, high: where that lies with 95 %, by what the model leaves unexplained of like instances.
        p_within: probability to take at most 3 % longer than the best of all strategies.
    """

    strategy: str
    longer: float
    low: float
    high: float
    p_within: float


@dataclass(frozen=True)
class Near:
    """An instance and how far it is from a scenario, in root mean square of standardised differences."""

    instance: TriedInstance
    distance: float


@dataclass(frozen=True)
class Advice:
    """What is advised.

    Attributes:
        rows: all strategies, the advised one first.
        nearest: instances, the nearest first.
        traits: of the scenario.
        outside: in what the scenario lies outside of what was drawn, in words; nothing where it does not.
    """

    rows: tuple[Rated, ...]
    nearest: tuple[Near, ...]
    traits: tuple[float, ...]
    outside: tuple[str, ...]


@dataclass(frozen=True)
class Adviser:
    """Advises by some experience.

    Attributes:
        choices: how instances may be pooled; with none the single best strategy is advised everywhere.
    """

    experience: Experience
    choices: tuple[Pooling, ...] = CHOICES

    @cached_property
    def model(self) -> Model:
        """What was learned."""
        return Model(self.experience.traits, self.experience.log_times, self.choices)

    def rows(self, traits: Sequence[float]) -> tuple[Rated, ...]:
        """All strategies in a scenario of these traits, the advised one first; of equals the first by name."""
        at, model = np.array(compared(traits)), self.model
        expected = model.predicted(at)[0]
        names = self.experience.strategies
        order = sorted(range(len(names)), key=lambda number: (expected[number], names[number]))
        shares = model.off_by(at)[0]
        drawn = expected + model.unexplained
        beside = drawn - drawn[:, order[0], None]
        within = shares @ (drawn - drawn.min(axis=1, keepdims=True) <= WITHIN)
        return tuple(
            Rated(
                names[number],
                _longer(expected[number] - expected[order[0]]),
                _longer(_quantile(beside[:, number], shares, TAIL)),
                _longer(_quantile(beside[:, number], shares, 1.0 - TAIL)),
                float(within[number]),
            )
            for number in order
        )

    def advice(self, setup: Setup) -> Advice:
        """The advice for a scenario that is resolved.

        Raises:
            ConfigurationError: its mission has no jobs that a strategy could divide.
        """
        traits = traits_of(setup)
        apart = self.model.distances(np.array(compared(traits)))[0]
        nearest = sorted(zip(apart.tolist(), self.experience.instances, strict=True), key=lambda near: near[0])
        return Advice(
            self.rows(traits),
            tuple(Near(instance, distance) for distance, instance in nearest[:N_NEAREST]),
            traits,
            tuple(self._outside(setup, traits, nearest[0][0])),
        )

    def _outside(self, setup: Setup, traits: Sequence[float], nearest: float) -> Iterator[str]:
        """In what a scenario lies outside of what was drawn."""
        drawn = load(GROUND)
        if (mission := setup.scenario.scenario.mission) != drawn.scenario.mission:
            yield f"mission {mission} (all instances: {drawn.scenario.mission})"
        for trait, value, known in zip(TRAITS, traits, self._raw.T, strict=True):
            drawn_as = [trait.compared(each) for each in known.tolist()]
            room = ROOM * float(np.std(drawn_as))
            if not min(drawn_as) - room <= trait.compared(value) <= max(drawn_as) + room:
                unit = "" if trait.unit == "1" else f" {trait.unit}"
                yield f"{trait.name} = {value:g}{unit} ({known.min():g} to {known.max():g})"
        if (policy := setup.scenario.communication.policy) != drawn.communication.policy:
            yield f"policy {policy} (all instances: {drawn.communication.policy})"
        if (n_groups := sum(any(role.job for role in group.roles) for group in setup.agreement.groups)) != 1:
            yield f"{n_groups} groups with jobs (all instances: 1)"
        for name in (name for name, one in features().items() if one in setup.features and name != "uncertainty"):
            yield f"feature {name} (in no instance)"
        for fault in setup.scenario.fault:
            if fault.kind != "lost":
                yield f"fault {fault.kind} (instances: lost)"
        if nearest > self._far:
            yield f"distance {nearest:.2f} from the nearest instance ({self._far:.2f} between instances at most)"

    @property
    def _raw(self) -> Numbers:
        return np.array([instance.traits for instance in self.experience.instances])

    @cached_property
    def _far(self) -> float:
        """The longest distance from an instance to the next."""
        apart = self.model.distances(self.experience.traits)
        np.fill_diagonal(apart, math.inf)
        return float(apart.min(axis=1).max())


def _longer(log_ratio: float) -> float:
    return math.expm1(float(log_ratio))


def _quantile(values: Numbers, shares: Numbers, level: float) -> float:
    """The least of some values that count with shares below which, itself included, lies ``level`` of them."""
    order = np.argsort(values, kind="stable")
    passed = np.cumsum(shares[order])
    return float(values[order][min(int(np.searchsorted(passed, level)), len(values) - 1)])
