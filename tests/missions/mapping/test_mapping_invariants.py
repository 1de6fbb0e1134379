"""The invariant of the ground: cells are covered where a working sensor passed them, and nowhere else."""

from types import SimpleNamespace
from typing import Any

import pytest
from surveying import mapper

from missions.mapping.invariants import TrueCoverage
from missions.mapping.sensors import Seabed
from remoras.motion import Motion

WORLD = Seabed.of_areas(25.0, {"area": ((0.0, 0.0), (100.0, 0.0), (100.0, 25.0), (0.0, 25.0))})
"""Four cells in a row."""


@pytest.mark.parametrize(
    ("rows", "share", "wrong"),
    [
        ([(5.0, "AUV00", 1, 0)], 0.25, None),
        ([(5.0, "AUV00", 2, 0)], 0.25, "2 cells are covered on the ground or in the table alone"),
        ([(5.0, "AUV01", 1, 0)], 0.25, "2 cells are covered"),
        ([], 0.0, "1 cells are covered"),
        ([(5.0, "AUV00", 1, 0)], 0.5, "coverage_fraction is 0.5; on the ground it is 0.25"),
    ],
)
def test_the_table_is_held_against_the_ground(rows: list[Any], share: float, wrong: str | None) -> None:
    """A sensor that reaches 12.5 m lies over the second cell."""
    guidance = SimpleNamespace(ground_mps=0.0)
    layer = SimpleNamespace(motion=Motion(37.5, 12.5), data=mapper(), sensing=("mapping",), guidance=guidance)
    condition = SimpleNamespace(dead_sensors=frozenset())
    vehicle = SimpleNamespace(name="AUV00", is_alive=True, functional=layer, condition=condition)
    scene: Any = SimpleNamespace(finished=None, parts=(), fleet=SimpleNamespace(vehicles=[vehicle]))
    invariant = TrueCoverage()
    assert invariant.broken(scene) is None
    scene.finished = SimpleNamespace(
        seed=1, completed=False, mission=SimpleNamespace(world=lambda seed: WORLD),
        recorder=SimpleNamespace(rows={"coverage": rows}.__getitem__),
    )  # fmt: skip
    scene.setup, scene.summary = SimpleNamespace(scenario=None), {"coverage_fraction": share}
    said = invariant.broken(scene)
    assert said is None if wrong is None else str(said).startswith(wrong)
