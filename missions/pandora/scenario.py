"""Scenario tables of the Pandora mission."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

from pydantic import Field

from missions.meeting.job_mission import JobScenario, JobSettings
from missions.meeting.sequential_tests import threshold
from missions.scenarios.features import water
from remoras.table import Name, PointM, Positive, Section, Sparse

Flow = Callable[[float, float], PointM]  # velocity of the water (m/s, x east, y north) at a depth (m) and time (s)

ANY_VALVE = "any"
KINDS = {"panel": "Panel", "valve": "Valve", "chain": "Chain", "anode": "Anode"}
TOLD = (
    "objectiveServicing", "jobDone", "diagnosis", "anomaly", "outcome", "placedAt", "focusArea", "centre", "radius",
    "toolDead", "unableTo", "isImpossible",
)  # fmt: skip
"""Attributes that vehicles exchange; all others stay private."""
URGENCY = 10


class PartTable(Section):
    """Common keys of all parts."""

    name: Name = Field(description="name of the part; its task is called `service NAME`")
    work_s: Positive = Field(description="duration of a camera observation or of work with a tool, per point")


class PlacedTable(PartTable):
    """One ``[[panel]]`` or ``[[anode]]``."""

    position_m: PointM = Field(description="planned position, x east, y north")

    @property
    def points_m(self) -> tuple[PointM, ...]:
        """Its only point."""
        return (self.position_m,)


class ValveTable(PlacedTable):
    """One ``[[valve]]`` to close."""

    panel: str = Field(description="panel that holds it")


class ChainTable(PartTable):
    """One ``[[chain]]``."""

    points_m: tuple[PointM, ...] = Field(min_length=2, max_length=200, description="points to observe, in order")


class UpsetTable(Sparse):
    """One ``[[upset]]``: deviation of a valve from the plan."""

    UNSAID = frozenset({"distance_m"})

    kind: Literal["moved", "turned", "stuck"] = Field(
        description="moved: distance_m from its position; turned: already closed; stuck: needs a wrench"
    )
    part: str = Field(ANY_VALVE, description="name of a valve; any: drawn, once per run, among those without an upset")
    distance_m: Positive | None = Field(None, description="of kind moved: distance, in a random direction")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.kind == "moved" and self.distance_m is None:
            yield "distance_m", "missing: how far the valve is from its place"
        elif self.kind != "moved" and self.distance_m is not None:
            yield "distance_m", f"not used by kind {self.kind}, only by moved: leave it out"


class PandoraSettings(JobSettings):
    """Table ``[mission]``."""

    adaptation: Literal["none", "tactical", "all"] = Field(
        "all",
        description="none: the plan is executed step by step, each for its planned time; tactical: actions are "
        "assessed and their parameters learnt; all: also repairs the plan by inferred facts",
    )
    false_alarms_per_h: float = Field(0.01, gt=0.0, le=10.0, description="false alarm rate of each sequential test")
    hold_speed_mps: Positive = Field(0.35, description="planned speed through the water while holding a position")
    tolerance_m: Positive = Field(0.5, description="distance within which a position is held")
    late_factor: float = Field(1.5, gt=1.0, description="multiple of the expected time after which an action is late")
    failed_factor: float = Field(4.0, gt=1.0, description="multiple after which it has failed")
    focus_radius_m: Positive = Field(20.0, description="search distance around the position of a part")

    @property
    def assesses(self) -> bool:
        """True if actions are assessed."""
        return self.adaptation != "none"

    @property
    def repairs(self) -> bool:
        """True if plans are repaired."""
        return self.adaptation == "all"

    def alarm_at(self, every_s: float) -> float:
        """Threshold of a two-sided sequential test with a reading every ``every_s``."""
        return threshold(3600.0 / (every_s * self.false_alarms_per_h))


class PandoraScenario(JobScenario):
    """Scenario with the tables of this mission."""

    UNSAID = JobScenario.UNSAID | {"upset"}

    mission: PandoraSettings = PandoraSettings.usual()
    panel: tuple[PlacedTable, ...] = ()
    valve: tuple[ValveTable, ...] = ()
    chain: tuple[ChainTable, ...] = ()
    anode: tuple[PlacedTable, ...] = ()
    upset: tuple[UpsetTable, ...] = ()

    @property
    def parts(self) -> list[tuple[str, PlacedTable | ChainTable]]:
        """Kind and table of every part, by kind."""
        return [(kind, part) for kind in KINDS for part in getattr(self, kind)]

    @property
    def foretold(self) -> Flow | None:
        """Current of the plan, without surges; None for still water."""
        moving = water(self)
        planned = None if moving is None else moving.foretold()
        return None if planned is None else planned.at

    def surges(self, seed: int) -> Sequence[Any]:
        """Unplanned surges of the current in a run, each from ``from_s`` to ``until_s``."""
        moving = water(self)
        return () if moving is None else moving.surges(seed)


def job_of(part: str) -> str:
    """Name of the service task of a part."""
    return f"service {part}"
