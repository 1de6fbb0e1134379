"""Every general and vital behaviour conforms, and the check detects a behaviour that breaks a rule."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import pytest
from sample_vehicles import AUV

from missions.mapping.behaviours import WorkLeft, ZigzagExploring
from missions.mapping.jobs import SurveyJob
from remoras.behaviours import (
    DONE,
    DUE,
    Behaviour,
    FollowingLeader,
    Homing,
    LeadingFollowers,
    Perception,
    Planning,
    Positioning,
    Reference,
    Standing,
    Supervision,
    Working,
)
from remoras.functional.vital import ReturningHome, ReturningToArea
from remoras.motion import Motion
from remoras.testing import behaviours as conformance

BANK = SurveyJob("bank", ((0.0, 0.0), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0)))
MADE: dict[str, Callable[[], Behaviour]] = {
    "Standing": Standing,
    "Planning": Planning,
    "Supervision": lambda: Supervision(60.0),
    "Working": lambda: Working(60.0),
    "Homing": lambda: Homing((10.0, 0.0), 5.0, "Operational", AUV),
    "FollowingLeader": lambda: FollowingLeader(("AUV02", "AUV01"), "Operational", 40.0, AUV),
    "LeadingFollowers": lambda: LeadingFollowers(("AUV01", "AUV02"), "Operational", 80.0, AUV),
    "Positioning": lambda: Positioning(("AUV01",), "Operational", (0.0, 15.0), AUV),
    "ReturningHome": lambda: ReturningHome(AUV),
    "ReturningToArea": lambda: ReturningToArea((-100.0, -100.0, 100.0, 100.0), AUV),
    "ZigzagExploring": lambda: ZigzagExploring(BANK, AUV, WorkLeft([BANK], 0.0)),
}
POLLED: set[str] = set()
"""Behaviours without deadlines, which are asked at every decision."""


@pytest.mark.parametrize("name", MADE)
def test_every_behaviour_conforms(name: str) -> None:
    """A stated deadline is reported as such."""
    assert conformance.check(MADE[name], AUV) is (name not in POLLED)


N_MADE = itertools.count()
Answer = Callable[..., Any]


def counted(answer: Callable[[int], Any]) -> Answer:
    """It answers by how often it was asked."""

    def answering(self: Any, *asked: Any) -> Any:
        self.n_asked = getattr(self, "n_asked", 0) + 1
        return answer(self.n_asked)

    return answering


def moving(self: Any, motion: Motion, *asked: Any) -> Perception:
    motion.x_m += 1.0
    return Perception(1.0, 1.0)


def individual(self: Any, *asked: Any) -> Perception:
    """By how many of its kind were made before."""
    self.number = getattr(self, "number", None) or next(N_MADE)
    return Perception(1.0 / (1.0 + self.number))


PERCEIVES: list[tuple[Answer, str]] = [
    (lambda *asked: Perception(1.5), "moment 0: stimulus is 1.5"),
    (lambda *asked: Perception(math.nan), "stimulus is nan"),
    (lambda *asked: None, "perceive returned None, expected a Perception"),
    (lambda *asked: Perception(1.0, "forward"), "advance is 'forward'"),
    (counted(lambda n: DONE if n == 3 else DUE), "moment 3: what was done comes back"),
    (moving, "changed the motion"),
    (
        lambda self, motion, *asked: Perception(1.0 if motion.x_m > 0.0 else 0.5, until_s=math.inf),
        "asked only when its until_s, peers and holds_m require it",
    ),
    (
        lambda self, _, picture, *asked: Perception(1.0 if picture.groups.meets_unheard else 0.5, until_s=math.inf),
        "asked only when its until_s, peers and holds_m require it",
    ),
    (
        lambda self, _, picture, *asked: Perception(0.5 + 0.5 * (picture.body.now_s < 107.0), until_s=200.0),
        "asked only when its until_s, peers and holds_m require it",
    ),
    (
        lambda self, motion, *asked: Perception(0.5 + 0.5 * (motion.x_m > 0.0), until_s=math.inf, until_m=1e4),
        "asked only when its until_s, peers and holds_m require it",
    ),
    (
        lambda self, motion, *asked: Perception(1.0 / (2.0 + abs(motion.x_m)), until_s=math.inf, per_m=1e-4),
        "its stimulus has changed by .* but per_m is 0.0001",
    ),
    (lambda *asked: Perception(1.0, until_s=math.nan), "until_s is nan"),
    (lambda *asked: Perception(1.0, until_m=math.nan), "until_m is nan"),
    (lambda *asked: Perception(1.0, per_m=-1.0), "per_m is -1.0"),
    (individual, "two behaviours made alike"),
]
REFERS: list[tuple[Answer, str]] = [
    (lambda self, motion, picture: picture.peers.positions_m.clear(), "changed the picture"),
    (lambda *asked: Reference((math.nan, 0.0), 1.0), "target_m is .*nan"),
    (lambda *asked: Reference((0.0, 0.0), -1.0), "speed_mps is -1"),
    (lambda *asked: (0.0, 0.0), r"reference returned \(0.0, 0.0\)"),
    (counted(lambda n: Reference((float(n), 0.0), 1.0)), "asked again"),
    (
        lambda self, motion, picture: Reference((1000.0, 0.0), 2.0 if motion.x_m < 300.0 else 1.0, 1.0),
        "said to hold to 1 m, reference answers",
    ),
]


@pytest.mark.parametrize(
    ("part", "answer", "says"), [("perceive", *one) for one in PERCEIVES] + [("reference", *one) for one in REFERS]
)
def test_a_behaviour_that_breaks_a_rule_is_detected(part: str, answer: Answer, says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        conformance.check(type("Broken", (Standing,), {part: answer}), AUV)


def test_checked_situations_cover_all_that_a_vehicle_may_meet() -> None:
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
