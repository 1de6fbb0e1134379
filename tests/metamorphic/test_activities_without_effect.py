"""Activities without effect change no byte of any table."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from recorded import flown

from missions.mapping import MappingMission
from missions.runs.run import Run
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour, Standing
from remoras.database import VehicleData


class WithIdling(MappingMission):
    """The mapping mission with an activity for every objective that does nothing."""

    type: ClassVar[ActivityType]
    importance: ClassVar[float]
    first: ClassVar[bool]

    def activity_sets(self, objective: Objective, data: VehicleData, facts: Any, position_m: Any) -> Any:
        return self._idling(objective, *super().activity_sets(objective, data, facts, position_m))

    def activities(self, steps: Any, objective: Objective, data: VehicleData, facts: Any, position_m: Any) -> Any:
        return self._idling(objective, *super().activities(steps, objective, data, facts, position_m))

    def _idling(self, objective: Objective, sets: tuple[ActivitySet, ...], rests_on: Any) -> Any:
        idling = ActivitySet(objective, ActivityKind.COLLECTIVE, (Activity("Idling", self.type),), self.importance)
        return ((idling, *sets) if self.first else (*sets, idling)), rests_on

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        return Standing() if activity.name == "Idling" else super().behaviour_for(activity, data)


class Organising(WithIdling):
    type, importance, first = ActivityType.ORGANISATIONAL, 0.18, True


class Working(WithIdling):
    type, importance, first = ActivityType.PRODUCTIVE, 1.0, False


def of(mission: str | None) -> Run:
    """A run of the scenario, with that mission in the place of its own."""
    own = [] if mission is None else [f"scenario.mission={mission}"]
    return flown("mapping-rendezvous", "channel.per=0.5", *own)


def tables(finished: Run) -> dict[str, list[Any]]:
    return {name: list(finished.recorder.rows(name)) for name in finished.recorder.tables}


@pytest.mark.slow
def test_an_activity_without_effect_changes_no_byte() -> None:
    """Of whatever type and importance, before the others or behind them: it takes no place and dilutes no mean."""
    usual = tables(of(None))
    for mission in (Organising, Working):
        assert tables(of(f"{__name__}:{mission.__name__}")) == usual, mission.__name__
