"""The seam of organisational strategies: how groups form and re-form, and who gets which task.

A strategy runs inside a vehicle's social layer. It sees data that the whole fleet shares and what this vehicle
believes (``Evidence``), never the truth. A Python caller passes the object; a scenario names it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.survey import Point


@dataclass(frozen=True, slots=True)
class Evidence:
    """What the optimiser goes by.

    Attributes:
        database: static data of all vehicles.
        positions_m: last positions known, by vehicle; the start where none has been heard.
        corners_m: corners of every area, by name.
        done: areas known to be finished.
    """

    database: AUVDatabase
    positions_m: Mapping[str, Point]
    corners_m: Mapping[str, tuple[Point, ...]]
    done: frozenset[str]


class Strategy(Protocol):
    """An organisational strategy."""

    name: str

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """The organisation that is agreed before the mission: groups and their founding roles."""
        ...

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        """Roles that the head of ``group`` allocates now, to members of the group only."""
        ...
