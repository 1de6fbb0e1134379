"""Sonar contacts against all pairs, depth layers, and rows of conflicts."""

import itertools
import random
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from samples import auv

from remoras.motion import Motion
from remoras.motion.avoidance import Neighbour
from remoras.motion.separation import SAME_DEPTH_M, SONAR_M, Separation


@dataclass
class Buoy:
    """A vehicle as far as it has a place."""

    data: Any
    functional: Any
    is_alive: bool = True


def at(number: int, x_m: float, y_m: float, depth_m: float = 20.0) -> Buoy:
    return Buoy(auv(f"AUV{number:02d}", depth_m=depth_m), SimpleNamespace(motion=Motion(x_m, y_m, 0.1 * number, 1.0)))


def by_pairs(fleet: list[Buoy]) -> dict[int, list[Neighbour]]:
    """Contacts of all vehicles, computed by pairs."""
    seen: dict[int, list[Neighbour]] = {}
    for one, other in itertools.permutations(fleet, 2):
        a, b = one.functional.motion, other.functional.motion
        dx_m, dy_m = b.x_m - a.x_m, b.y_m - a.y_m
        in_reach = dx_m * dx_m + dy_m * dy_m <= SONAR_M * SONAR_M
        in_layer = abs(one.data.depth_m - other.data.depth_m) <= SAME_DEPTH_M
        if one.is_alive and other.is_alive and in_reach and in_layer:
            seen.setdefault(one.data.node, []).append(Neighbour(dx_m, dy_m, *b.velocity_mps))
    return seen


@pytest.mark.parametrize("seed", range(5))
def test_grid_search_equals_pairwise_search_in_node_order(seed: int) -> None:
    draw = random.Random(seed)
    fleet = [
        at(number, draw.uniform(-200.0, 200.0), draw.uniform(-200.0, 200.0), draw.choice([18.0, 20.0, 22.5, 40.0, 0.0]))
        for number in range(draw.randint(2, 40))
    ]
    for one in fleet:
        one.is_alive = draw.random() < 0.9
    expected = by_pairs(fleet)
    found = Separation(fleet, 5.0).look()
    assert {node: sorted(seen) for node, seen in found.items()} == {n: sorted(seen) for n, seen in expected.items()}
    assert found == expected


def test_a_conflict_is_one_row_until_the_pair_has_separated() -> None:
    near, far = at(0, 0.0, 0.0), at(1, 10.0, 0.0)
    fleet = [near, far, at(2, 0.0, 1.0, depth_m=40.0)]
    watch = Separation(fleet, 5.0)
    rows = []
    for now_s, x_m in enumerate((10.0, 4.0, 3.0, 6.0, 4.9, 4.9995)):
        watch.look()
        far.functional.motion.x_m = x_m
        rows += watch.conflicts(float(now_s))
    assert rows == [(1.0, "AUV00", "conflict", "AUV01"), (4.0, "AUV00", "conflict", "AUV01")]
