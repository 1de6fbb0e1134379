"""A small mission for trials: three areas of 100 m, so that a run takes a fifth of the time."""

from functools import cache

from stress.drawing import Plan, plan_of

SMALL = (
    "area.middle.corners_m=[[50,50],[50,150],[150,150],[150,50]]",
    "area.left.corners_m=[[150,50],[150,150],[250,150],[250,50]]",
    "area.right.corners_m=[[50,150],[50,250],[150,250],[150,150]]",
    'rally_point."operational rally".position_m=[200,200]',
    'rally_point."coordination rally".position_m=[240,240]',
    "communication.lease_frames=10",
    "mission.meeting_deadline_s=360",
)


@cache
def small_plan(*kinds: str, strategy: str = "remoras", settings: tuple[str, ...] = (), draws: str = "none") -> Plan:
    """The plan of the small mission with these kinds; all if there are none."""
    return plan_of("mapping-rendezvous", strategy, (*SMALL, *settings), kinds, draws)
