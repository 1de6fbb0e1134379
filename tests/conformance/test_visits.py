"""Every shipped strategy completes a mission other than mapping: all places visited, in their order."""

from itertools import product

import pytest
from sampling import sampled
from visiting_mission import NEEDS, PLACES_M, STAY_S, visiting_scenario

from missions.runs.run import run
from missions.scenarios.faults import DeclaredFault
from remoras.strategies import strategies

SHIPPED = strategies()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "per"), sampled(product(SHIPPED, [0.0, 0.4]), ("remoras", 0.0), *((name, 0.4) for name in SHIPPED))
)
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


def test_the_achievable_share_of_any_mission_follows_from_its_jobs() -> None:
    """Its truth says nothing of what is within reach: five visits, all vehicles lost at once, or one able one left."""
    scenario = visiting_scenario(0.0)
    intact = run(scenario)
    assert (intact.completed, intact.goal_fraction, intact.reachable_fraction) == (True, 1.0, 1.0)
    faults = [{"vehicle": f"AUV{n:02d}", "kind": "lost", "at_s": 200.0} for n in range(3)]
    struck = [
        scenario.model_copy(update={"fault": tuple(map(DeclaredFault.model_validate, faults[:n]))}) for n in (2, 3)
    ]
    one_left, none_left = (run(one) for one in struck)
    assert one_left.reachable_fraction == 1.0
    assert not none_left.completed
    assert none_left.goal_fraction == none_left.reachable_fraction < 1.0
