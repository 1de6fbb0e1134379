"""Scenario tables of the Trident mission."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from missions.meeting.job_mission import JobScenario, JobSettings
from remoras.table import Name, PointM, Positive, Section

Response = Literal["fixed", "repair", "matching"]


class TridentSettings(JobSettings):
    """Table ``[mission]``."""

    response: Response = Field(
        "matching",
        description="what follows when a service fails. fixed: nothing, each activity has the service that the plan "
        "names; repair: once a step has failed, the next service that the plan lists, all of one vehicle; matching: "
        "any service of the fleet that says it works and whose class the world model concludes to fit",
    )
    inference: bool = Field(
        True, description="false: matching compares names of classes, without what the world model concludes"
    )
    escort_m: float = Field(
        80.0,
        ge=0.0,
        description="a vehicle that gives fixes to others keeps so near to one that is out; 0: it escorts nobody",
    )
    tile_m: float = Field(20.0, ge=5.0, description="side of a tile of the map")
    goal: float = Field(
        0.85, gt=0.0, le=1.0, description="share of the tiles of all blocks that must really be charted"
    )
    patience_work_s: Positive = Field(
        60.0, description="a step that yields nothing for so long, where it should, has failed"
    )
    search_m: float = Field(40.0, gt=0.0, description="how far around its place a candidate is searched for")
    reach_limit_s: Positive = Field(
        1200.0, description="a candidate that is not found again so long after the choice counts as absent"
    )
    p_mistaken: float = Field(
        0.01, gt=0.0, lt=0.5, description="rate at which looks from near may take a decoy for the target"
    )
    p_missed: float = Field(
        0.01, gt=0.0, lt=0.5, description="rate at which looks from near may take the target for a decoy"
    )
    surveys_again: int = Field(
        1,
        ge=0,
        le=10,
        description="how often all blocks are surveyed anew once each candidate was seen to be none, under matching",
    )
    looks_again: int = Field(
        2,
        ge=0,
        le=10,
        description="how often a candidate that was rejected is looked at anew after that, once none is left",
    )


class BlockTable(Section):
    """One ``[[block]]``: a part of the site to survey."""

    name: Name = Field(description="name of the block")
    x_m: PointM = Field(description="west and east border")
    y_m: PointM = Field(description="south and north border")
    service: str = Field(description="service, as `vehicle module`, that the plan names for it")
    spare: tuple[str, ...] = Field((), description="services that the plan lists behind it")

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield borders in the wrong order."""
        yield from (
            (key, "allowed: the smaller border first") for key in ("x_m", "y_m") if not _rises(getattr(self, key))
        )


def _rises(span_m: PointM) -> bool:
    return span_m[0] < span_m[1]


class RecoveryTable(Section):
    """Table ``[recovery]``: the target and its decoys."""

    name: Name = Field("recovery", description="name of the job")
    target_m: PointM | None = Field(None, description="where the target lies; drawn in the blocks if absent")
    decoys: int = Field(3, ge=0, le=8, description="objects that look similar; where they lie is drawn")


class ActivityTable(Section):
    """One table of ``[activity]``: required class of service, and planned services."""

    requires: str = Field(description="class of services that are able to do it")
    service: str = Field("", description="service, as `vehicle module`, that the plan names; of blocks for a survey")
    spare: tuple[str, ...] = Field((), description="services that the plan lists behind it")


class Activities(Section):
    """Tables ``[activity.*]``."""

    survey: ActivityTable = Field(description="survey of a block")
    choose: ActivityTable = Field(description="choice of the target among the candidates")
    fix: ActivityTable = Field(description="bounding the navigation error before the target is gone to")
    find: ActivityTable = Field(description="finding the target again")
    hold: ActivityTable = Field(description="holding on at the target")
    handle: ActivityTable = Field(description="handling the target")


class TransponderTable(Section):
    """Table ``[transponder]``."""

    position_m: PointM = Field(description="where it stands, x east, y north; a [[beacon]] there gives the fix")
    range_m: Positive = Field(60.0, description="within which it is heard")


class MessageTable(Section):
    """One ``[[choreography.message]]``: sender and content allowed in a state, and next state."""

    state: str = Field(description="state in which it may be said")
    says: str = Field(description="attribute of the fact that is said")
    value: str = Field("", description="value of the fact, as tables write it; any if absent")
    by: str = Field("", description="vehicle that says it, or role that it plays; any if absent")
    to: str = Field(description="state that follows")


class StateTable(Section):
    """One ``[[choreography.state]]``."""

    name: Name = Field(description="name of the state")
    final: bool = Field(False, description="nothing has to follow")
    within_s: Positive | None = Field(None, description="time in which something of it has to be said; any if absent")


class ChoreographyTable(Section):
    """Table ``[choreography]``: message pattern, starting in the first state."""

    state: tuple[StateTable, ...] = Field((), description="states, the first one first")
    message: tuple[MessageTable, ...] = Field((), description="messages that lead from state to state")


class TridentScenario(JobScenario):
    """Input of a run."""

    mission: TridentSettings = TridentSettings()
    block: tuple[BlockTable, ...] = Field(min_length=1)
    recovery: RecoveryTable = RecoveryTable()
    transponder: TransponderTable | None = None
    activity: Activities
    choreography: ChoreographyTable = ChoreographyTable()
