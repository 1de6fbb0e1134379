"""When a vehicle gives its area up for others that wait: by what is left of it, by the call, never by a timer."""

from __future__ import annotations

import pytest

from missions.mapping.behaviours import due
from missions.mapping.scenario import MappingSettings
from missions.scenarios import load
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import Perception
from remoras.executive.layer import ExecutiveLayer
from remoras.executive.satisfaction import DecisionConstants

GROUP, OWN, SHARED = "Operational", "Midfield", "Coordinator"
SETTINGS = load("mapping-rendezvous").mission
assert isinstance(SETTINGS, MappingSettings)
HALF_LEFT = SETTINGS.half_left
FRAME_S = 8.0
"""About a TDMA frame of four nodes: each repeats its signal in every one."""


def seconds_to_give_up(share_left: float, value: int, patience_s: float = 3600.0) -> float | None:
    """When a vehicle that maps as fast as planned turns to a call of that strength, repeated in every frame.

    With the importances of the shipped scenario: 0.6 for exploring, 0.3 for the meeting. The work left stays the same,
    so only waiting could wear the vehicle down.
    """
    exploring = ActivitySet(
        Objective(GROUP, OWN, "Exploring", "middle"),
        ActivityKind.INDIVIDUAL,
        (Activity("ZigzagExploring", ActivityType.GUIDANCE),),
        0.6,
    )
    meeting = ActivitySet(
        Objective(GROUP, SHARED, "RendezVous", "rally"),
        ActivityKind.COLLECTIVE,
        (Activity("Homing", ActivityType.GUIDANCE),),
        0.3,
    )
    layer = ExecutiveLayer(DecisionConstants())
    layer.adopt([exploring, meeting], [(GROUP, OWN), (GROUP, SHARED)])
    period_s = layer.period_s
    for step in range(200):  # it works in content before anybody calls
        layer.decide([Perception(due(1.0, HALF_LEFT), 1.0), Perception(1.0)], step * period_s, period_s)
    perceptions = [Perception(due(share_left, HALF_LEFT), 1.0), Perception(1.0)]
    assert layer.decision.chosen == (0,)
    for step in range(200, 200 + int(patience_s / period_s)):
        now_s = step * period_s
        if now_s % FRAME_S == 0.0:
            layer.hear((GROUP, SHARED), "AUV01", "Performer", value, now_s)
        if layer.decide(perceptions, now_s, period_s).chosen == (1,):
            return now_s - 200 * period_s
    return None


def test_with_most_of_the_work_left_nobody_gives_up_however_long_others_wait() -> None:
    """The strongest call there is, for an hour: due(0.88) of the own contentment outweighs it."""
    assert seconds_to_give_up(0.88, -128) is None


def test_with_little_left_a_fleet_that_waits_is_answered_at_once_and_one_that_is_content_is_not() -> None:
    assert seconds_to_give_up(0.03, -128) == pytest.approx(0.0, abs=FRAME_S)
    assert seconds_to_give_up(0.03, 0) is None


def test_the_more_is_left_the_stronger_a_call_has_to_be() -> None:
    """The weakest call that is answered, by what is left: it rises, up to where none is."""

    def weakest(share_left: float) -> int:
        return next((v for v in range(0, 129, 4) if seconds_to_give_up(share_left, -v, 60.0) is not None), 129)

    found = [weakest(share) for share in (0.01, 0.03, 0.1, 0.3)]
    assert found == sorted(found)
    assert found[0] < found[1] < found[2]
    assert found[-1] == 129
