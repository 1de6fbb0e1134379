"""Activities of a vehicle and their compatibility (REMORAS, section V.B)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property
from typing import Any, NamedTuple


class ActivityType(IntEnum):
    """Types of activities; a decision holds at most one of each."""

    ORGANISATIONAL = 0
    PLANNING = 1
    NAVIGATION = 2
    GUIDANCE = 3
    CONTROL = 4
    PRODUCTIVE = 5
    COMMUNICATION = 6
    SURVIVAL = 7


EFFECTIVE = frozenset({ActivityType.GUIDANCE, ActivityType.PLANNING, ActivityType.COMMUNICATION})
"""Types with an effect by themselves; other activities need a sensor."""


class ActivityKind(Enum):
    """Source of an activity's motivation: own aims, group aims, own integrity (these take precedence)."""

    INDIVIDUAL = "individual"
    COLLECTIVE = "collective"
    VITAL = "vital"


@dataclass(frozen=True, slots=True)
class Activity:
    """One activity of an objective.

    Attributes:
        name: as in Table II of the paper, for example ``ZigzagExploring``.
        parameters: for the functional layer, for example a grid of points.
        sensors: names of sensors switched on.
    """

    name: str
    type: ActivityType
    parameters: tuple[Any, ...] = ()
    sensors: tuple[str, ...] = ()

    @property
    def has_effect(self) -> bool:
        """True if it guides, plans, sends, or switches on a sensor; others are ignored by the decision."""
        return bool(self.sensors) or self.type in EFFECTIVE


@dataclass(frozen=True, slots=True)
class Objective:
    """Abstract task of a role: ``Exploring`` somewhere, ``RendezVous`` at a rally point."""

    group: str
    role: str
    name: str
    argument: str

    def __str__(self) -> str:
        return f"{self.role}: {self.name}({self.argument})"


@dataclass(frozen=True)
class ActivitySet:
    """Activities of one objective to be performed simultaneously.

    Attributes:
        objective: None for vital and background activities.
        kind: decides whether influence signals apply.
        activities: of distinct types; the first one names the set.
        importance: weight of the objective, from the scenario.
        needs: name of an activity of another set that this one requires, or None.
    """

    objective: Objective | None
    kind: ActivityKind
    activities: tuple[Activity, ...]
    importance: float
    needs: str | None = None

    @cached_property  # 0.3 % of a mission
    def effective(self) -> tuple[Activity, ...]:
        """Activities with an effect."""
        return tuple(activity for activity in self.activities if activity.has_effect)

    @cached_property  # 0.4 % of a mission
    def types(self) -> int:
        """Types of the effective activities, as bits over ``ActivityType``."""
        types = 0
        for activity in self.effective:
            types |= 1 << activity.type
        return types

    @property
    def name(self) -> str:
        """Name of the first activity."""
        return self.activities[0].name


class Wait(NamedTuple):
    """Awaited vehicle or condition, as text, and end of the wait (s)."""

    what: str
    until_s: float

    def __str__(self) -> str:
        return f"{self.what} until {self.until_s:.0f} s"


class WeighedSet(NamedTuple):
    """Activity set as evaluated by a decision.

    Attributes:
        external: part of the motivation due to an influence signal.
        source, slot: sender and slot of that signal; empty and None without one.
        best_mean: mean motivation of the best combination with this set; the highest one is performed. None for vital
            sets, and for sets in no combination.
    """

    of: ActivitySet
    stimulus: float
    motivation: float
    external: float
    source: str
    slot: int | None
    chosen: bool
    best_mean: float | None

    @property
    def own(self) -> float:
        """Part of the motivation due to own aims."""
        return self.motivation - self.external
