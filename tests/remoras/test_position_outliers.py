"""Position outliers: suspected, confirmed, and unfiltered reports."""

import pytest

from remoras.fleet.radio import MARGIN, SLACK_M, Jumps
from worldmodel import STATUS, Block, PropertyValue

POSITION, PEER, SPEED_MPS, FRAME_S = 3, 1, 2.0, 7.0
REACH_M = SLACK_M + MARGIN * SPEED_MPS * FRAME_S
"""78 m: as far as a peer may seem to have gone from one report to the next."""


def said(frame: int, x_m: float, subject: int = PEER, origin: int = PEER) -> Block:
    return Block(origin, STATUS, FRAME_S * frame, (PropertyValue(subject, POSITION, (x_m, 0.0)),))


def suspected(*blocks: Block) -> list[bool]:
    jumps = Jumps(POSITION, {PEER: SPEED_MPS})
    return [bool(jumps.suspected(one)) for one in blocks]


@pytest.mark.parametrize(("beyond_m", "is_suspected"), [(0.0, False), (0.1, True)])
def test_plausible_reach_is_top_speed_plus_margins(beyond_m: float, is_suspected: bool) -> None:
    assert suspected(said(0, 0.0), said(1, REACH_M + beyond_m)) == [False, is_suspected]


def test_an_implausible_report_is_ignored_and_the_next_plausible_one_accepted() -> None:
    assert suspected(said(0, 0.0), said(1, 512.0), said(2, 20.0), said(3, 30.0)) == [False, True, False, False]


def test_a_second_consistent_report_confirms_a_jump() -> None:
    """It was carried off, or its first report was the wrong one."""
    assert suspected(said(0, 900.0), said(1, 0.0), said(2, 10.0), said(3, 20.0)) == [False, True, False, False]


def test_second_hand_and_non_vehicle_positions_are_not_filtered() -> None:
    blocks = [said(0, 0.0, origin=2), said(1, 900.0, origin=2), said(0, 0.0, subject=7), said(1, 900.0, subject=7)]
    assert suspected(*blocks) == [False] * 4


def test_relayed_copies_and_older_reports_confirm_no_jump() -> None:
    once, again = said(2, 512.0), said(2, 512.0)
    assert suspected(said(0, 0.0), once, again, said(1, 900.0), said(3, 30.0)) == [False, True, True, True, False]
    assert suspected(said(5, 0.0), said(3, 900.0), said(6, 5.0)) == [False, False, False]
