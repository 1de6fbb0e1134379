"""Scenario tables of the mapping mission."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from missions.mapping.sensors import ObjectTable
from missions.meeting.meeting import MeetingSettings
from missions.scenarios.organisation import GroupTable, Role
from missions.scenarios.scenario import Scenario, World
from remoras.table import Name, PointM, Positive, Section, Sparse

STATED_OBJECTIVES = ("MissionGathering", "RendezVous", "Exploring", "Mapping")  # vehicles need their facts


class MappingSettings(MeetingSettings):
    """Table ``[mission]``."""

    formation_spacing_m: float = Field(
        gt=0.0,
        description="spacing of the formation; more if the leader or the vehicle needs a larger distance to turn",
    )
    goal: float = Field(0.95, gt=0.0, le=1.0, description="share of the cells of all areas to map")
    half_left: float = Field(
        0.1, ge=0.0, le=1.0, description="remaining share of an area at which its stimulus is midway between its bounds"
    )
    importance: dict[str, Annotated[float, Field(ge=0.0, le=1.0)]] = Field(
        description="importance of objectives, by Role.Objective or by Objective"
    )


class MappingWorld(World):
    """Table ``[world]``, with the grid of the seabed."""

    cell_m: float = Field(ge=0.1, description="side of a seabed cell")


class Area(Sparse):
    """One ``[[area]]``: a job of the mission."""

    UNSAID = frozenset({"depth_m"})

    name: Name = Field(description="name of the area")
    corners_m: tuple[PointM, ...] = Field(min_length=3, description="corners of a convex polygon, in order")
    depth_m: Positive | None = Field(
        None, description="depth of the area, required of its explorers; any vehicle may if absent"
    )

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield a fault unless the corners form a convex polygon."""
        at_m = self.corners_m
        # The cross products of successive sides of a convex polygon have one sign, whichever way round it goes.
        turns = [
            (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
            for a, b, c in zip(at_m, at_m[1:] + at_m[:1], at_m[2:] + at_m[:2], strict=True)
        ]
        if not (all(turn > 0 for turn in turns) or all(turn < 0 for turn in turns)):
            yield "corners_m", "not the corners of a convex polygon in order"


class MappingRole(Role):
    """One ``[[group.role]]``, with its place in the formation."""

    job: str | None = Field(None, description="area that its holder explores, or feature")
    position: tuple[Literal["top", "bottom"], Literal["left", "middle", "right"]] | None = Field(
        None, description="place in the formation: row and side"
    )


class MappingGroup(GroupTable):
    """One ``[[group]]``."""

    role: tuple[MappingRole, ...] = Field(min_length=1, description="roles of the group")


class FindsTable(Section):
    """Table ``[finds]``: features of the seabed that need a closer pass once detected."""

    MOST: ClassVar[int] = 64

    number: int = Field(0, ge=0, le=MOST, description="unknown features, drawn once per run")
    close_speed_mps: float = Field(0.6, gt=0.0, le=20.0, description="maximum speed for an inspection")
    close_radius_m: float = Field(8.0, ge=2.0, description="maximum distance for an inspection")
    shortest_stay_s: float = Field(60.0, gt=0.0, description="minimum duration of an inspection")
    longest_stay_s: float = Field(600.0, gt=0.0, le=604_800.0, description="maximum duration, drawn uniformly")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.longest_stay_s < self.shortest_stay_s:
            yield "longest_stay_s", f"allowed: shortest_stay_s = {self.shortest_stay_s:g} or more"

    @property
    def mean_stay_s(self) -> float:
        """Mean dwell of an inspection, assumed by plans."""
        return (self.shortest_stay_s + self.longest_stay_s) / 2.0


class MappingScenario(Scenario):
    """Scenario with the tables of this mission."""

    UNSAID = Scenario.UNSAID | {"object"}

    world: MappingWorld
    mission: MappingSettings
    area: tuple[Area, ...] = ()
    finds: FindsTable | None = None
    object: tuple[ObjectTable, ...] = ()
    group: tuple[MappingGroup, ...] = Field(min_length=1)

    @property
    def n_finds(self) -> int:
        """Number of features that need a closer pass."""
        return 0 if self.finds is None else self.finds.number
