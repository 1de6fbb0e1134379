"""The seam of missions: what a mission brings, beside its scenario.

A mission is an object with the tasks of its two HTN domains, the table of its activities and a truth that
watches the run. ``missions/<mission>.py`` makes one from a scenario.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from remoras.activities import Activity, ActivitySet, Objective
from remoras.behaviours import Behaviour, Picture
from remoras.beliefs import Beliefs, Key
from remoras.database import VehicleData
from remoras.htn import Domain, FactsLike
from remoras.motion import Motion
from remoras.organisation import Group, Organisation


@dataclass(frozen=True, slots=True)
class Milestone:
    """Something worth a line in the report: ``vehicle`` or ``group`` may be empty."""

    time_s: float
    name: str
    vehicle: str = ""
    group: str = ""


@dataclass(frozen=True, slots=True)
class Finding:
    """What a leader concludes from the situation: a fact to be recorded, by names."""

    subject: str
    attribute: str
    value: str | float | bool


class Truth(Protocol):
    """Watches the run from outside; it sees everything and tells the vehicles nothing."""

    milestones: Sequence[Milestone]

    def observe(self, fleet: Any, now_s: float) -> bool:
        """Look at the fleet after a step; True if the mission is complete."""
        ...

    def close(self, fleet: Any, now_s: float) -> str:
        """End of the run; the reason if the mission is not complete, else an empty text."""
        ...


class Mission(Protocol):
    """What a mission brings."""

    social_domain: Domain
    """Missions into ``AllocateRoles(group)``, ``AssignObjective(group, role, name, argument)``, ``GiveMission``."""

    def founding_objectives(self) -> Sequence[Objective]:
        """Objectives that roles have from the start."""
        ...

    corners_m: Mapping[str, tuple[tuple[float, float], ...]]
    """Corners of every area, by name."""

    rally_points_m: Mapping[str, tuple[float, float]]
    """Rally points, by name."""

    meets_after: Mapping[str, tuple[str, ...]]
    """Groups that must have gathered before a group's own meeting counts, by group."""

    def is_individual(self, objective: Objective) -> bool:
        """Can the objective be pursued without interacting with others?"""
        ...

    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: tuple[float, float]
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        """Activities by which this vehicle pursues ``objective``, and the facts that this choice rests on.

        ``facts`` answers keys of beliefs and ``("members", "Group.Role")``.
        """
        ...

    def standing_sets(self, data: VehicleData) -> tuple[ActivitySet, ...]:
        """Vital needs, and what a vehicle does in any case."""
        ...

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """Carries out the activity set that ``activity`` leads."""
        ...

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        """What ``vehicle`` makes known when it has done all there was to do for ``objective``."""
        ...

    def truth(self) -> Truth:
        """A new truth, to watch one run."""
        ...

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """What the head of ``group`` concludes from what it has heard."""
        ...
