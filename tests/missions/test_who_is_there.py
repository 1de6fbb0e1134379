"""A head takes a group for gathered by news that is recent."""

from types import SimpleNamespace
from typing import Any

import pytest

from missions.mapping import MappingMission
from missions.meeting.meeting import NEWS_FRAMES
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.organisation import Organisation, RoleAssignment

SETUP = resolved(load("mapping-rendezvous"))
NOW_S, FRAME_S = 1000.0, 7.0
LATE_S = NEWS_FRAMES * FRAME_S
RALLY_M, ELSEWHERE_M = (450.0, 450.0), (100.0, 100.0)


def are_there(age_s: float, position_m: tuple[float, float], contacts_m: tuple[Any, ...] = ()) -> bool:
    """Whether a head has all members there, of whom one was heard so long ago at a place."""
    mission = SETUP.mission
    assert isinstance(mission, MappingMission)
    group = SETUP.agreement.organisation.groups["Operational"]
    played = [
        RoleAssignment("Operational", role, name) for role, name in (("Coordinator", "AUV00"), ("Performer", "AUV01"))
    ]
    beliefs: Any = SimpleNamespace(observed_s=lambda key: NOW_S - age_s)
    picture: Any = SimpleNamespace(
        frame_s=FRAME_S,
        body=SimpleNamespace(now_s=NOW_S, contacts_m=contacts_m),
        peers=SimpleNamespace(positions_m={"AUV01": position_m}, heard_s={}),
        groups=SimpleNamespace(meets_unheard=False),
    )
    return mission.meeting._all_are_there(group, Organisation.of([group], played), beliefs, picture)


@pytest.mark.parametrize(
    ("age_s", "position_m", "contacts_m", "expected"),
    [
        (LATE_S - 1.0, RALLY_M, (), True),
        (LATE_S - 1.0, ELSEWHERE_M, (RALLY_M,), False),
        (LATE_S + 1.0, RALLY_M, (), False),
        (LATE_S + 1.0, RALLY_M, (RALLY_M,), True),
        (LATE_S + 1.0, RALLY_M, (ELSEWHERE_M,), False),
    ],
    ids=["heard", "heard elsewhere", "heard long ago", "seen", "somebody seen elsewhere"],
)
def test_a_member_is_there_if_it_was_heard_or_seen_there_lately(
    age_s: float, position_m: tuple[float, float], contacts_m: tuple[Any, ...], expected: bool
) -> None:
    assert are_there(age_s, position_m, contacts_m) is expected
