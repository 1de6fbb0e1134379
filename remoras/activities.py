"""Activities of a vehicle and their compatibility (REMORAS, section V.B)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property
from typing import Any, NamedTuple


class ActivityType(IntEnum):
    """Types of activities; a decision holds at most one of each.

    ORGANISATIONAL ones are perceived, not performed: a leader's information satisfies its role. PLANNING also allocates
    roles and forms groups. Of the paper's types navigation and control are always on (``remoras.motion``), and survival
    is the kind vital.

    >>> ActivityType.GUIDANCE in EFFECTIVE, ActivityType.PRODUCTIVE in EFFECTIVE
    (True, False)
    """

    ORGANISATIONAL = 0
    PLANNING = 1
    GUIDANCE = 2
    PRODUCTIVE = 3
    COMMUNICATION = 4


EFFECTIVE = frozenset({ActivityType.GUIDANCE, ActivityType.PLANNING, ActivityType.COMMUNICATION})
"""Types with an effect by themselves; other activities need a sensor."""


class ActivityKind(Enum):
    """Source of an activity's motivation: own aims, group aims, or (first of all) own integrity.

    >>> ActivityKind("vital")
    <ActivityKind.VITAL: 'vital'>
    """

    INDIVIDUAL = "individual"
    COLLECTIVE = "collective"
    VITAL = "vital"


@dataclass(frozen=True, slots=True)
class Activity:
    """Activity of an objective, named as in Table II of the paper; ``sensors`` are switched on.

    >>> Activity("Looking", ActivityType.PRODUCTIVE, sensors=("camera",)).has_effect
    True
    """

    name: str
    type: ActivityType
    parameters: tuple[Any, ...] = ()
    sensors: tuple[str, ...] = ()

    @property
    def has_effect(self) -> bool:
        """True if it guides, plans, sends, or switches on a sensor; else the decision ignores it."""
        return bool(self.sensors) or self.type in EFFECTIVE


@dataclass(frozen=True, slots=True)
class Objective:
    """Abstract task of a role: ``Exploring`` somewhere, ``RendezVous`` at a rally point.

    >>> print(Objective("Operational", "LeftWinger", "Exploring", "left"))
    LeftWinger: Exploring(left)
    """

    group: str
    role: str
    name: str
    argument: str

    def __str__(self) -> str:
        return f"{self.role}: {self.name}({self.argument})"


@dataclass(frozen=True)
class ActivitySet:
    """Activities of one objective to be performed simultaneously.

    ``objective`` is None for vital and background activities; ``kind`` decides whether influence signals apply. The
    first of the ``activities``, of distinct types, names the set. ``importance`` is the weight of the objective in the
    scenario; ``needs`` names an activity of another set that this one requires.

    >>> surfacing = Activity("Surfacing", ActivityType.GUIDANCE)
    >>> ActivitySet(None, ActivityKind.VITAL, (surfacing,), importance=1.0).name
    'Surfacing'
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
        return sum({1 << activity.type for activity in self.effective})

    @property
    def name(self) -> str:
        """Name of the first activity."""
        return self.activities[0].name


ROOM = "room to move"
"""Wait of a vehicle that others have stopped."""


class Wait(NamedTuple):
    """Awaited vehicle or condition, as text, end and begin of the wait (s), and number of helpers that end it."""

    what: str
    until_s: float
    since_s: float = 0.0
    n_peers: int = 1

    def __str__(self) -> str:
        return self.what if self.until_s == math.inf else f"{self.what} until {self.until_s:.0f} s"


class WeighedSet(NamedTuple):
    """Activity set as evaluated by a decision.

    ``external`` is the part of the motivation due to the influence signal of ``source`` in ``slot``, if any.
    ``best_mean``: mean motivation of the best combination with this set; None for vital sets, or without one.
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
