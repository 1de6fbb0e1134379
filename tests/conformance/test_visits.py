"""Every shipped strategy divides a mission that is not mapping: all places are visited, none before its turn."""

import pytest
from visiting_mission import NEEDS, PLACES_M, STAY_S, visiting_scenario

from missions.runs.run import run
from remoras.strategies import strategies

SHIPPED = strategies()


@pytest.mark.parametrize("per", [0.0, 0.4])
@pytest.mark.parametrize("name", SHIPPED)
def test_all_places_are_visited_in_their_order(name: str, per: float) -> None:
    finished = run(visiting_scenario(per), seed=3, strategy=SHIPPED[name])
    assert finished.completed, finished.reason
    ended_s: dict[str, list[float]] = {}
    for milestone in finished.milestones:
        ended_s.setdefault(milestone.name, []).append(milestone.time_s)
    for number in range(len(PLACES_M)):
        for end_s in ended_s[f"visited place {number}"]:
            for needed in NEEDS.get(number, ()):
                assert min(ended_s[f"visited {needed}"]) <= end_s - STAY_S, f"place {number} before {needed}"
