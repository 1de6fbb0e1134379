"""The seam of organisational strategies: how groups form and re-form, and who gets which task.

A strategy runs inside a vehicle's social layer. It sees data that the whole fleet shares and what this vehicle
believes, never the truth. A Python caller passes the object; a scenario names it. Three questions are put to it:

* ``form``, before the mission: who founds the groups;
* ``adapt``, to the head of a group whose mission is planned: who gets which role;
* ``negotiator``, to every member of a group with areas: an object that is asked at the end of every TDMA frame what
  this vehicle states next. What it states are facts: they travel in the same packets and slots as everything else.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.work import Point

Fact = tuple[str, str, str | float | bool]
"""(subject, attribute, value), by names."""


@dataclass(frozen=True, slots=True)
class Declaration:
    """What a strategy is and what it takes from the vehicles.

    Attributes:
        source: the publication it follows.
        messages: what its vehicles tell each other to organise themselves: attributes, and what they say.
        planned_before: missions are planned, and objectives known to all, before the mission; else heads plan them
            and tell the others.
        communicates: vehicles send packets at all.
        influences: vehicles send influence signals.
        blocks_per_round: most blocks that a vehicle states in a round of consultation, for each area.
    """

    source: str
    messages: Mapping[str, str]
    planned_before: bool = True
    communicates: bool = True
    influences: bool = False
    blocks_per_round: int = 0


@dataclass(frozen=True, slots=True)
class Evidence:
    """What an allocation goes by.

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

    def position_m(self, vehicle: str) -> Point:
        return self.positions_m.get(vehicle, self.database[vehicle].start_m)


@dataclass(frozen=True, slots=True)
class Statement:
    """Facts that a vehicle states together.

    Attributes:
        told: to the others too; else the vehicle only notes them for itself.
    """

    facts: tuple[Fact, ...]
    told: bool = True


@dataclass(frozen=True, slots=True)
class Heard:
    """Facts that a peer stated together."""

    issuer: str
    time_s: float
    facts: tuple[Fact, ...]


@dataclass(frozen=True, slots=True)
class Situation:
    """What a vehicle knows at the end of a round of consultation.

    Attributes:
        now_s: time that what is stated now will bear; round: number of the TDMA frame that ends.
        organisation: who plays which role, as this vehicle knows.
        evidence: with the vehicle's own position as it is.
        rally_m: where the group meets, if it does.
        heard: what peers stated of the strategy's attributes and of roles, since the last round.
        heard_s: when a packet of each peer was last heard; peers never heard are missing.
        unheard: peers that have not acknowledged roles which this vehicle stated they play, and these roles by name.
    """

    now_s: float
    round: int
    organisation: Organisation
    evidence: Evidence
    rally_m: Point | None
    heard: tuple[Heard, ...]
    heard_s: Mapping[str, float]
    unheard: Mapping[str, Collection[str]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Move:
    """What a vehicle makes of a round.

    Attributes:
        statements: what it states.
        holding: the group is not to be taken for gathered, since there is work to be given out.
    """

    statements: tuple[Statement, ...] = ()
    holding: bool = False


class Negotiator(Protocol):
    """One vehicle's part in allocating the areas of one group; it keeps what it has heard."""

    def negotiate(self, situation: Situation) -> Move:
        """What to state now."""
        ...


class Strategy(Protocol):
    """An organisational strategy; its parameters are the fields of a frozen dataclass."""

    @property
    def name(self) -> str: ...

    @property
    def declaration(self) -> Declaration: ...

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """The organisation that is agreed before the mission: groups and their founding roles."""
        ...

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        """Roles that are allocated when the group's mission is planned, to members of the group only."""
        ...

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """What ``me`` allocates areas of ``group`` with during the mission; None if nothing is left to allocate."""
        ...
