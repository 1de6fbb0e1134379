"""Scenario tables of the Trident mission."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from missions.meeting.job_mission import JobScenario, JobSettings
from remoras.table import Name, PointM, Positive, Section, SpanM

Response = Literal["fixed", "repair", "matching"]


class TridentSettings(JobSettings):
    """Table ``[mission]``."""

    response: Response = Field(
        "matching",
        description="reaction to a failed service. fixed: none, each activity has the service that the plan "
        "names; repair: after a failed step, the next service in the plan, all of one vehicle; "
        "matching: any working service of the fleet whose inferred class fits",
    )
    inference: bool = Field(True, description="false: matching compares names of classes, without inference")
    escort_m: float = Field(
        80.0,
        ge=0.0,
        description="distance that an escort keeps while it gives fixes to another vehicle; 0: no escort",
    )
    tile_m: float = Field(20.0, ge=5.0, description="side of a tile of the map")
    goal: float = Field(0.85, gt=0.0, le=1.0, description="share of the tiles of all blocks to chart, by ground truth")
    patience_work_s: Positive = Field(60.0, description="time without result after which a step has failed")
    search_m: float = Field(40.0, gt=0.0, description="search distance around the position of a candidate")
    reach_limit_s: Positive = Field(
        1200.0, description="time after its choice at which a candidate not found again counts as absent"
    )
    p_mistaken: float = Field(
        0.01, gt=0.0, lt=0.5, description="allowed rate of decoys accepted as the target by close observations"
    )
    p_missed: float = Field(
        0.01, gt=0.0, lt=0.5, description="allowed rate of targets rejected as decoys by close observations"
    )
    surveys_again: int = Field(
        1,
        ge=0,
        le=10,
        description="repeated surveys of all blocks once all candidates are rejected, under matching",
    )
    looks_again: int = Field(
        2,
        ge=0,
        le=10,
        description="later observations of a rejected candidate, once none is left",
    )


class BlockTable(Section):
    """One ``[[block]]``: a part of the site to survey."""

    name: Name = Field(description="name of the block")
    x_m: SpanM = Field(description="west and east border")
    y_m: SpanM = Field(description="south and north border")
    service: str = Field(description="planned service, as `vehicle module`")
    spare: tuple[str, ...] = Field((), description="alternative services in the plan")


class RecoveryTable(Section):
    """Table ``[recovery]``: the target and its decoys."""

    name: Name = Field("recovery", description="name of the job")
    target_m: PointM | None = Field(None, description="position of the target; drawn in the blocks if absent")
    decoys: int = Field(3, ge=0, le=8, description="similar objects at drawn positions")


class ActivityTable(Section):
    """One table of ``[activity]``: required class of service, and planned services."""

    requires: str = Field(description="class of suitable services")
    service: str = Field("", description="planned service, as `vehicle module`; of blocks for a survey")
    spare: tuple[str, ...] = Field((), description="alternative services in the plan")


class Activities(Section):
    """Tables ``[activity.*]``."""

    survey: ActivityTable = Field(description="survey of a block")
    choose: ActivityTable = Field(description="choice of the target among the candidates")
    fix: ActivityTable = Field(description="bounding the navigation error before the transit to the target")
    find: ActivityTable = Field(description="finding the target again")
    hold: ActivityTable = Field(description="holding on at the target")
    handle: ActivityTable = Field(description="handling the target")


class TransponderTable(Section):
    """Table ``[transponder]``."""

    position_m: PointM = Field(description="position, x east, y north; a [[beacon]] there gives the fix")
    range_m: Positive = Field(60.0, description="maximum range of reception")


class MessageTable(Section):
    """One ``[[choreography.message]]``: sender and content allowed in a state, and next state."""

    state: str = Field(description="state in which it is allowed")
    says: str = Field(description="attribute of the sent fact")
    value: str = Field("", description="value of the fact, as tables write it; any if absent")
    by: str = Field("", description="sending vehicle, or its role; any if absent")
    to: str = Field(description="next state")


class StateTable(Section):
    """One ``[[choreography.state]]``."""

    name: Name = Field(description="name of the state")
    final: bool = Field(False, description="no message has to follow")
    within_s: Positive | None = Field(None, description="time limit for a message; any if absent")


class ChoreographyTable(Section):
    """Table ``[choreography]``: message pattern, starting in the first state."""

    state: tuple[StateTable, ...] = Field((), description="states, the first one first")
    message: tuple[MessageTable, ...] = Field((), description="messages that lead from state to state")


class TridentScenario(JobScenario):
    """Scenario with the tables of this mission."""

    mission: TridentSettings = TridentSettings()
    block: tuple[BlockTable, ...] = Field(min_length=1)
    recovery: RecoveryTable = RecoveryTable()
    transponder: TransponderTable | None = None
    activity: Activities
    choreography: ChoreographyTable = ChoreographyTable()
