"""Scenario tables of the Arrows mission."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from missions.meeting.job_mission import JobScenario, JobSettings
from remoras.table import PointM, Positive, Probability, Section, Sparse

KINDS = ("amphorae", "wooden hull", "steel hull", "rock")
"""Possible contents of a cell, besides nothing."""
NOTHING, UNKNOWN = "nothing", "unknown"
SITES = KINDS[:3]
"""Kinds that the search is for."""
DETECTORS = ("acoustic", "magnetic")
"""Sweeping detectors, in the order of their numbers on the wire."""
Kind = Literal["amphorae", "wooden hull", "steel hull", "rock"]
Search = Literal["elementary", "lawnmower", "central"]
Rate = Annotated[float, Field(gt=0.0, lt=1.0)]


class ArrowsSettings(JobSettings):
    """Table ``[mission]``."""

    search: Search = Field(
        "elementary",
        description="who says where a vehicle looks next. elementary: itself, by its own map and by what others hold; "
        "lawnmower: lanes that were laid before; central: the head of the group, by its map",
    )
    search_s: Positive = Field(3600.0, description="when the search ends and all come to the rally point")
    repulsion: Probability = Field(
        1.0, description="how much a vehicle leaves to others what lies on their way to where they go; 0: nothing"
    )
    repulsion_m: Positive = Field(150.0, description="how far from that way it leaves something to them")
    contact: bool = Field(
        True, description="false: a vehicle never comes back into contact to tell what it found, or to hear of more"
    )
    contact_loss: float = Field(
        0.3,
        ge=0.0,
        lt=1.0,
        description="a vehicle is in contact where a full packet to the middle is lost no more often than this",
    )
    alone_s: Positive = Field(600.0, description="how long a vehicle may be out of contact under search = central")
    greeting_s: Positive = Field(
        120.0,
        description="a vehicle that is back stays in contact until it is heard, but not for longer than this",
    )
    sure: float = Field(0.9, gt=0.5, lt=1.0, description="an anomaly is identified at this probability")
    picture_s: Positive = Field(60.0, description="how long a vehicle stays to take pictures of a site")
    goal: float = Field(
        0.5, gt=0.0, le=1.0, description="share of the sites in the area that have to be found and rightly identified"
    )


class SearchTable(Section):
    """Table ``[search]``: the search area."""

    x_m: PointM = Field(description="west and east border")
    y_m: PointM = Field(description="south and north border")
    cell_m: float = Field(40.0, ge=5.0, description="side of a cell; a cell holds one thing at most")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield borders in the wrong order."""
        spans_m = {"x_m": self.x_m, "y_m": self.y_m}
        yield from (
            (key, "the lower border first, then the higher") for key, (low, high) in spans_m.items() if low >= high
        )


class KindTable(Sparse):
    """One ``[[kind]]``: a kind of thing, its expected number and distribution."""

    UNSAID: ClassVar[frozenset[str]] = frozenset({"map"})

    name: Kind = Field(description="what it is")
    expected: float = Field(gt=0.0, le=1000.0, description="how many are expected in the whole area")
    uniform_share: Probability = Field(
        0.3, description="share of these that may lie anywhere; the others lie where historic finds lie"
    )
    spread_m: Positive = Field(250.0, description="how far around a historic find others of its kind are expected")
    map: tuple[tuple[float, ...], ...] = Field(
        (), description="in place of the historic finds: share of each cell, row by row from the south; sums to 1"
    )


class HistoricFindTable(Section):
    """One ``[[historic_find]]``: an earlier find, by divers or in nets."""

    kind: Kind = Field(description="what it was")
    position_m: PointM = Field(description="where, x east, y north")


class DetectorTable(Section):
    """Table ``[detector.acoustic]``, ``[detector.magnetic]`` or ``[detector.optical]``."""

    range_m: Positive = Field(description="farthest cell, by its centre, or thing that it notices")
    look_s: Positive = Field(description="time between two looks at a cell that count as independent")
    p_false: Rate = Field(description="rate at which a look at an empty cell gives a contact; optical: an image errs")
    p_detect: dict[Kind, Rate] = Field(
        {}, description="rate at which a look gives a contact, by kind; those left out are as nothing to it"
    )
    sigma_m: float = Field(5.0, gt=0.0, le=32.0, description="standard deviation of the place of what it finds")


class DetectorsTable(Section):
    """Tables below ``[detector]``, known to every vehicle."""

    acoustic: DetectorTable
    magnetic: DetectorTable
    optical: DetectorTable


class ArrowsScenario(JobScenario):
    """Input of a run."""

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
        """Names of possible contents by number: nothing first."""
        return (NOTHING, *(kind.name for kind in self.kinds))

    @property
    def stay_s(self) -> float:
        """Time at an anomaly: two images, and photographs of a site."""
        return 2.0 * self.detector.optical.look_s + self.mission.picture_s
