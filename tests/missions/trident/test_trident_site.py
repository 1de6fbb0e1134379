"""The site: tiles of blocks, lanes over them, and where objects lie."""

import math

import pytest

from missions.trident.behaviours import survey_lanes
from missions.trident.site import APART_M, RIM_M, Lying, SeabedBlock, Site, lying

WEST = SeabedBlock("west", 0.0, 100.0, 100.0, 200.0, 20.0)
EAST = SeabedBlock("east", 150.0, 100.0, 250.0, 200.0, 20.0)


def test_a_block_has_the_tiles_whose_centre_lies_in_it() -> None:
    assert len(WEST.tiles) == 5 * 5
    assert all(WEST.west_m < (c + 0.5) * 20.0 < WEST.east_m and 100.0 < (r + 0.5) * 20.0 < 200.0 for c, r in WEST.tiles)
    assert SeabedBlock("off", 5.0, 5.0, 45.0, 25.0, 20.0).tiles == ((0, 0), (1, 0))  # centres at 10 and 30, and at 10
    assert WEST.centre_of(0) == (10.0, 110.0)


def test_tiles_below_are_those_whose_centre_is_in_reach() -> None:
    site = Site((WEST, EAST))
    assert site.below((10.0, 110.0), 19.9) == [(0, 5)]  # the next centres are 20 m away, rows begin at 100 m
    assert sorted(site.below((10.0, 110.0), 20.0)) == [(0, 5), (0, 6), (1, 5)]
    assert site.below((125.0, 150.0), 20.0) == []  # between the blocks


@pytest.mark.parametrize("reach_m", [8.0, 14.0, 20.0, 60.0])
@pytest.mark.parametrize("block", [WEST, SeabedBlock("tall", 0.0, 0.0, 40.0, 120.0, 20.0)], ids=lambda one: one.name)
def test_lanes_pass_every_tile_in_reach(block: SeabedBlock, reach_m: float) -> None:
    found = list(survey_lanes(block, reach_m))
    assert frozenset().union(*(lane.tiles for lane in found)) == frozenset(range(len(block.tiles)))
    for lane in found:
        (x_m, y_m), (to_x_m, _) = lane.begin_m, lane.end_m
        for number in lane.tiles:
            at_m = block.centre_of(number)
            across_m = abs(at_m[1] - y_m) if to_x_m != x_m else abs(at_m[0] - x_m)
            assert across_m <= reach_m + 1e-9


def test_objects_lie_inside_blocks_and_apart() -> None:
    for seed in range(50):
        found = lying((WEST, EAST), None, 2, seed)
        assert [one.is_target for one in found] == [True, False, False]
        for one in found:
            assert any(
                block.west_m + RIM_M <= one.position_m[0] <= block.east_m - RIM_M
                and block.south_m + RIM_M <= one.position_m[1] <= block.north_m - RIM_M
                for block in (WEST, EAST)
            )
        gaps = [math.dist(a.position_m, b.position_m) for a in found for b in found if a is not b]
        assert min(gaps) >= APART_M


def test_one_decoy_more_moves_no_other_object() -> None:
    assert lying((WEST, EAST), None, 4, 7)[:3] == lying((WEST, EAST), None, 2, 7)


def test_the_place_of_the_target_may_be_given() -> None:
    target, *_ = lying((WEST,), (33.0, 144.0), 1, 3)
    assert target == Lying("target", (33.0, 144.0), True)
