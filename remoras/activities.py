"""Activities: what a vehicle can do at one time, and what may be done together (REMORAS, section V.B)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property
from typing import Any, NamedTuple


class ActivityType(IntEnum):
    """The eight types; a decision holds at most one activity of each."""

    ORGANISATIONAL = 0
    PLANNING = 1
    NAVIGATION = 2
    GUIDANCE = 3
    CONTROL = 4
    PRODUCTIVE = 5
    COMMUNICATION = 6
    SURVIVAL = 7


EFFECTIVE = frozenset({ActivityType.GUIDANCE, ActivityType.PLANNING, ActivityType.COMMUNICATION})
"""Types of which every activity has an effect; one of another type has an effect if it switches on a sensor."""


class ActivityKind(Enum):
    """Where an activity's motivation comes from: own aims, aims shared in the group, own integrity.

    What is vital comes before the others, see ``remoras.executive.decision``.
    """

    INDIVIDUAL = "individual"
    COLLECTIVE = "collective"
    VITAL = "vital"


@dataclass(frozen=True, slots=True)
class Activity:
    """One activity of one objective.

    Attributes:
        name: as Table II of the paper writes it, for example ``ZigzagExploring``.
        parameters: what the functional layer needs, for example the grid of points.
        sensors: names of the sensors of the vehicle that it switches on.
    """

    name: str
    type: ActivityType
    parameters: tuple[Any, ...] = ()
    sensors: tuple[str, ...] = ()

    @property
    def has_effect(self) -> bool:
        """True if performing it changes what the vehicle does: it guides, plans, sends, or switches on a sensor.

        What has no effect takes no part in the decision; it neither takes a place in it nor dilutes its mean.
        """
        return bool(self.sensors) or self.type in EFFECTIVE


@dataclass(frozen=True, slots=True)
class Objective:
    """An abstract task given to a role: ``Exploring`` somewhere, ``RendezVous`` at a rally point."""

    group: str
    role: str
    name: str
    argument: str

    def __str__(self) -> str:
        return f"{self.role}: {self.name}({self.argument})"


@dataclass(frozen=True)
class ActivitySet:
    """Activities of one objective that must be performed simultaneously.

    Attributes:
        objective: what they are for; None for vital needs and for what the vehicle does in any case.
        kind: whether influence signals move it.
        activities: one or more, of different types; the first one names the set.
        needs: name of an activity of some other set without which this one is pointless, or None.
        importance: weight of the objective, from the scenario.
    """

    objective: Objective | None
    kind: ActivityKind
    activities: tuple[Activity, ...]
    importance: float
    needs: str | None = None

    @cached_property
    def effective(self) -> tuple[Activity, ...]:
        """Those of its activities that have an effect."""
        return tuple(activity for activity in self.activities if activity.has_effect)

    @cached_property
    def types(self) -> int:
        """Types of its activities that have an effect, as a bit word over ``ActivityType``."""
        word = 0
        for activity in self.effective:
            word |= 1 << activity.type
        return word

    @property
    def name(self) -> str:
        """Name of the first activity."""
        return self.activities[0].name


class Wait(NamedTuple):
    """What a vehicle waits for, in words: another vehicle or a condition; and until when (s)."""

    what: str
    until_s: float

    def __str__(self) -> str:
        return f"{self.what} until {self.until_s:.0f} s"


class WeighedSet(NamedTuple):
    """An activity set as the decision weighed it.

    Attributes:
        of: the set.
        stimulus: 0..1, as perceived.
        motivation: of each of its activities.
        external: the part of it that an influence signal makes.
        source, slot: vehicle that sent that signal, and the slot in which it did; empty and None without one.
        chosen: it is performed.
        best_mean: mean motivation of the best combination with it, of which the highest is performed; None for what is
            vital, and for what no combination holds.
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
        """The part of the motivation that own aims make."""
        return self.motivation - self.external
