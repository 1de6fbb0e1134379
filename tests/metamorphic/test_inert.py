"""What has no effect changes nothing: not a byte of any table."""

from __future__ import annotations

from itertools import product
from typing import Any, ClassVar

import pytest
from sampling import sampled

from missions.mapping import MappingMission
from missions.runs.run import Run, run
from missions.scenarios import load
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Behaviour, Standing
from remoras.database import VehicleData

SCENARIO = "mapping-rendezvous"


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


class Surviving(WithIdling):
    type, importance, first = ActivityType.SURVIVAL, 0.01, True


def of(mission: str | None, strategy: str, per: float) -> Run:
    """A run of the scenario, with that mission in the place of its own."""
    options = [("--set", f"strategy.name={strategy}"), ("--set", f"channel.per={per}")]
    if mission is not None:
        options.append(("--set", f"scenario.mission={mission}"))
    return run(load(SCENARIO, options))


def tables(finished: Run) -> dict[str, list[Any]]:
    return {name: list(finished.recorder.rows(name)) for name in finished.recorder.tables}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("strategy", "per"), sampled(product(["remoras", "central"], [0.0, 0.5]), ("remoras", 0.5), ("central", 0.0))
)
def test_an_activity_without_effect_changes_no_byte(strategy: str, per: float) -> None:
    """Of whatever type and importance, before the others or behind them: it takes no place and dilutes no mean."""
    usual = tables(of(None, strategy, per))
    for mission in (Organising, Working, Surviving):
        assert tables(of(f"{__name__}:{mission.__name__}", strategy, per)) == usual, mission.__name__
