"""The order of roles in a file decides nothing, and the name of a vehicle is a name only."""

from functools import cache

import pytest
from sampling import sampled
from test_strategies_conform import IN_THE_SAME_CODE

from missions.runs.run import Run, run
from missions.scenarios.scenario import Scenario
from remoras.strategies import strategies
from remoras.testing.sample_worlds import small_patches

DURATION_S = 600.0
NAMES = sampled(strategies(), *(name for name in strategies() if name not in IN_THE_SAME_CODE))


@cache
def usual(strategy: str) -> list[tuple[object, ...]]:
    return tracks(run(scenario_of(strategy)))


def scenario_of(strategy: str) -> Scenario:
    return small_patches(strategy, f"scenario.duration_s={DURATION_S}")


def tracks(finished: Run) -> list[tuple[object, ...]]:
    """Where the vehicles were, in the order of the nodes, without their names."""
    return [row[:1] + row[2:] for row in finished.recorder.trajectories]


def changed(scenario: Scenario, **update: object) -> Scenario:
    return scenario.model_copy(update=update)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_roles_in_a_file_decides_nothing(name: str) -> None:
    scenario = scenario_of(name)
    groups = [group.model_copy(update={"role": group.role[::-1]}) for group in scenario.group]
    assert tracks(run(changed(scenario, group=groups))) == usual(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_name_of_a_vehicle_is_a_name_only(name: str) -> None:
    """Names that sort the other way round."""
    scenario = scenario_of(name)
    vehicles = [
        vehicle.model_copy(update={"name": f"V{len(scenario.vehicle) - n:02d}"})
        for n, vehicle in enumerate(scenario.vehicle)
    ]
    assert tracks(run(changed(scenario, vehicle=vehicles))) == usual(name)
