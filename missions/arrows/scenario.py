"""Scenario tables of the Arrows mission."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from missions.meeting.job_mission import JobScenario, JobSettings
from remoras.table import PointM, Positive, Probability, Section, SpanM, Sparse

KINDS = ("amphorae", "wooden hull", "steel hull", "rock")
NOTHING, UNKNOWN = "nothing", "unknown"
SITES = KINDS[:3]
DETECTORS = ("acoustic", "magnetic")  # sweeping detectors, in the order of their numbers on the wire
Kind = Literal["amphorae", "wooden hull", "steel hull", "rock"]
Search = Literal["elementary", "lawnmower", "central"]
Share = Annotated[float, Field(ge=0.0)]
Rate = Annotated[float, Field(gt=0.0, lt=1.0)]


class ArrowsSettings(JobSettings):
    """Table ``[mission]``."""

    search: Search = Field(
        "elementary",
        description="selection of the next cell of a vehicle. elementary: itself, by its map and the targets of "
        "others; lawnmower: lanes planned before; central: the group leader, by its map",
    )
    search_s: Positive = Field(3600.0, description="end of the search, when all go to the rally point")
    repulsion: Probability = Field(
        1.0, description="strength with which a vehicle avoids cells near the path of others; 0: not at all"
    )
    repulsion_m: Positive = Field(150.0, description="distance from that path up to which it avoids cells")
    contact: bool = Field(True, description="false: a vehicle never returns into contact to exchange updates")
    contact_loss: float = Field(
        0.3,
        ge=0.0,
        lt=1.0,
        description="a vehicle is in contact where the loss of a full packet to the middle is at most this",
    )
    alone_s: Positive = Field(600.0, description="longest time out of contact under search = central")
    greeting_s: Positive = Field(
        120.0,
        description="longest time that a returned vehicle stays in contact until it is received",
    )
    sure: float = Field(0.9, gt=0.5, lt=1.0, description="probability at which an anomaly is identified")
    picture_s: Positive = Field(60.0, description="duration of taking pictures of a site")
    goal: float = Field(
        0.5, gt=0.0, le=1.0, description="share of the sites in the area to find and identify correctly"
    )


class SearchTable(Section):
    """Table ``[search]``: the search area."""

    x_m: SpanM = Field(description="west and east border")
    y_m: SpanM = Field(description="south and north border")
    cell_m: float = Field(40.0, ge=5.0, description="side of a cell; a cell holds at most one object")


class KindTable(Sparse):
    """One ``[[kind]]``: a kind of thing, its expected number and distribution."""

    UNSAID: ClassVar[frozenset[str]] = frozenset({"map"})

    name: Kind = Field(description="kind of object")
    expected: float = Field(gt=0.0, le=1000.0, description="expected number in the whole area")
    uniform_share: Probability = Field(
        0.3, description="share of these that may lie anywhere; the others lie near historic finds"
    )
    spread_m: Positive = Field(250.0, description="distance from historic finds at which others are expected")
    map: tuple[tuple[Share, ...], ...] = Field(
        (), description="in place of the historic finds: share of each cell, row by row from the south; sums to 1"
    )


class HistoricFindTable(Section):
    """One ``[[historic_find]]``: an earlier find, by divers or in nets."""

    kind: Kind = Field(description="kind of the find")
    position_m: PointM = Field(description="position, x east, y north")


class DetectorTable(Section):
    """Table ``[detector.acoustic]``, ``[detector.magnetic]`` or ``[detector.optical]``."""

    range_m: Positive = Field(description="maximum range to the centre of a cell, or to an object")
    look_s: Positive = Field(description="time between independent observations of a cell")
    p_false: Rate = Field(description="contact probability in an empty cell per observation; optical: image error")
    p_detect: dict[Kind, Rate] = Field(
        {}, description="probability of a contact per observation, by kind; others look like an empty cell"
    )
    sigma_m: float = Field(5.0, gt=0.0, le=32.0, description="standard deviation of the position of detections")


class DetectorsTable(Section):
    """Tables below ``[detector]``, known to every vehicle."""

    acoustic: DetectorTable
    magnetic: DetectorTable
    optical: DetectorTable


class ArrowsScenario(JobScenario):
    """Scenario with the tables of this mission."""

    mission: ArrowsSettings = ArrowsSettings.usual()
    search: SearchTable
    kind: tuple[KindTable, ...] = Field(min_length=1)
    historic_find: tuple[HistoricFindTable, ...] = ()
    detector: DetectorsTable

    @property
    def kinds(self) -> tuple[KindTable, ...]:
        """Possible contents of a cell, numbered from 1 in a fixed order."""
        return tuple(sorted(self.kind, key=lambda kind: KINDS.index(kind.name)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of possible contents by number, that of an empty cell first."""
        return (NOTHING, *(kind.name for kind in self.kinds))

    @property
    def stay_s(self) -> float:
        """Time at an anomaly: two images, and photographs of a site."""
        return 2.0 * self.detector.optical.look_s + self.mission.picture_s
