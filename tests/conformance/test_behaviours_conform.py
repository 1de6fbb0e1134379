"""Every general and vital behaviour conforms, and the check finds a behaviour that breaks a rule."""

from collections.abc import Callable

import nonconforming_behaviours as broken
import pytest
from sample_vehicles import AUV

from missions.mapping.behaviours import ZigzagExploring
from missions.mapping.jobs import SurveyJob
from remoras.behaviours import (
    Behaviour,
    FollowingLeader,
    Homing,
    LeadingFollowers,
    Planning,
    Positioning,
    Standing,
    Supervision,
    Working,
)
from remoras.functional.vital import ReturningHome, ReturningToArea
from remoras.testing import behaviours as conformance

CORNERS_M = ((0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0))
MADE: dict[str, Callable[[], Behaviour]] = {
    "Standing": Standing,
    "Planning": Planning,
    "Supervision": lambda: Supervision(60.0),
    "Working": lambda: Working(60.0),
    "Homing": lambda: Homing((10.0, 0.0), 5.0, "Operational", AUV),
    "FollowingLeader": lambda: FollowingLeader(("AUV02", "AUV01"), 40.0, AUV),
    "LeadingFollowers": lambda: LeadingFollowers(("AUV01", "AUV02"), "Operational", 80.0, AUV),
    "Positioning": lambda: Positioning(("AUV01",), "Operational", (0.0, 15.0), AUV),
    "ReturningHome": lambda: ReturningHome(AUV),
    "ReturningToArea": lambda: ReturningToArea((0.0, 0.0), AUV),
    "ZigzagExploring": lambda: ZigzagExploring(SurveyJob("bank", CORNERS_M), AUV),
}


@pytest.mark.parametrize("name", MADE)
def test_every_behaviour_conforms(name: str) -> None:
    conformance.check(MADE[name], AUV)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (broken.Overexcited, "moment 0: stimulus is 1.5"),
        (broken.Undecided, "stimulus is nan"),
        (broken.Mute, "perceive returned None, expected a Perception"),
        (broken.Wordy, "advance is 'forward'"),
        (broken.Restless, "moment 3: what was done comes back"),
        (broken.Jumping, "changed the motion"),
        (broken.Forgetful, "changed the picture"),
        (broken.Lost, "target_m is .*nan"),
        (broken.Backwards, "speed_mps is -1"),
        (broken.Sketchy, r"reference returned \(0.0, 0.0\)"),
        (broken.Wavering, "asked again"),
        (broken.Hasty, "said to hold to 1 m, reference answers"),
        (broken.Individual, "two behaviours made alike"),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_a_behaviour_that_breaks_a_rule_is_found_out(make: Callable[[], Behaviour], says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        conformance.check(make, AUV)


def test_the_lives_hold_all_that_a_vehicle_may_meet() -> None:
    """Else a behaviour could break a rule in a corner that nobody looks into."""
    moments = conformance.story(AUV, ("AUV01",), ("Operational",))
    pictures = [moment.picture for moment in moments]
    assert pictures[0].peers.positions_m == {}
    for one in (
        lambda p: p.peers.headings,
        lambda p: p.groups.gathered,
        lambda p: p.groups.planning_due,
        lambda p: p.body.contacts_m,
        lambda p: p.body.outside_m > 0.0,
        lambda p: p.body.battery <= p.body.reserve,
        lambda p: p.body.now_s == p.peers.last_news_s,
    ):
        assert {bool(one(picture)) for picture in pictures} == {True, False}
    assert {moment.performed for moment in moments} == {True, False}
