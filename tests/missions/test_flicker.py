"""No vehicle reverses a decision within 30 s without new information."""

import pytest
from flicker import undone
from recorded import flown

LONG = "lifts.lift_s=400"
UNHEARD = "fault=[{kind='deaf', vehicle='AUV00', at_s=200}, {kind='mute', vehicle='AUV02', at_s=500}]"
ASTRAY = "fault=[{kind='slow', vehicle='IAUV00', factor=0.47, at_s=259}]"
STRONG = "current={east_mps=0.98, north_mps=0.43}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "keys", "most", "least"),
    [
        # leaders and followers
        ("mapping-nine-teams", (), 0, 20),
        # several helpers of one lift, and helpers that are not heard
        pytest.param("recovery-field", (LONG, "lifts.vehicles=4", "channel.per=0.4"), 2, 3, marks=pytest.mark.thorough),
        ("recovery-field", (LONG, UNHEARD), 2, 3),
        # an escort that a current carries out of the area of operations
        ("trident-intervention", ("scenario.duration_s=2500", ASTRAY, STRONG), 1, 2),
        # holders that give up a job
        pytest.param("recovery-field", ("strategy.name=cbba", "mission.wait_s=200", "scenario.duration_s=2500"), 2, 40,
                     marks=pytest.mark.thorough),
        # all that hear the same call
        ("resupply-field", ("channel.per=0.3",), 0, 40),
    ],
)  # fmt: skip
def test_vehicles_rarely_undo_changes_of_behaviour(name: str, keys: tuple[str, ...], most: int, least: int) -> None:
    """Of at least ``least`` changes, at most ``most`` are undone."""
    n_undone, n_changes = undone(flown(name, *keys).recorder.rows("activities"))
    assert n_undone <= most
    assert n_changes >= least
