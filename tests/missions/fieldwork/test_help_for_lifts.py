"""Help at lifts that take two vehicles: true completion, random positions, effect of calls."""

import itertools
import math

import pytest
from varied import Varied

from missions.runs.run import Run

flown = Varied("recovery-field", "field.toml").flown
SHORT, LONG = "scenario.duration_s=900.0", "scenario.duration_s=2000.0"


def events(of: Run, event: str) -> dict[str, float]:
    """When a lift came to an event, by name."""
    return {row[2]: row[0] for row in of.recorder.rows("lifts") if row[3] == event}


@pytest.mark.parametrize("seed", [1, 185449697741568])
def test_lift_is_reported_as_done_only_after_it_was(seed: int) -> None:
    """In the last of them a vehicle swings round its end as it comes, and is too far off for a moment."""
    done = flown(seed, LONG)
    lifted = events(done, "lifted")
    claimed = {row[4]: row[3] for row in reversed(done.recorder.items) if row[5] == "jobDone" and row[4] in lifted}
    assert len(claimed) == 4
    assert all(claimed[name] >= lifted[name] for name in claimed)
    assert done.completed


def test_positions_of_objects_depend_on_the_seed_and_are_near_sites() -> None:
    """Any vehicle that surveys the site detects the object, under any strategy."""
    sites_m = [site.position_m for site in flown(1, SHORT).scenario.site]
    worlds = [flown(1, SHORT).mission.world(seed) for seed in range(20)]
    assert worlds == [flown(1, SHORT, "decision.weight_external=0.0").mission.world(seed) for seed in range(20)]
    assert len({lying for world in worlds for lying in world.items()}) == 80
    for at_m in itertools.chain(*(world.values() for world in worlds)):
        assert 5.0 <= min(math.dist(at_m, site_m) for site_m in sites_m) <= 36.0
