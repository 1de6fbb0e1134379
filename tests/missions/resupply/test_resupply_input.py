"""What is wrong with sites, holes and drills is told with file, line, key, value and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from resupplying import raw, written

from missions.errors import ConfigurationError
from missions.resupply.mission import with_samplers
from missions.scenarios import load


@pytest.mark.parametrize(
    ("table", "change", "says"),
    [
        ("transfer", {"berth_m": 6.0}, "transfer.berth_m = 6.0: allowed: 8.25 to 20, so that vehicles keep clear"),
        ("transfer", {"berth_m": 30.0}, "transfer.berth_m = 30.0: allowed: 8.25 to 20"),
        ("transfer", {"efficiency": 1.2}, "transfer.efficiency = 1.2: .*less than or equal to 1"),
        ("transfer", {"power_w": 0.0}, "transfer.power_w = 0.0: .*greater than 0"),
        ("mission", {"wait_s": 0.0}, "mission.wait_s = 0.0: .*greater than 0"),
    ],
)
def test_energy_that_cannot_pass(tmp_path: Path, table: str, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables[table] |= change
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(tmp_path, tables)))
    assert re.match(rf"{re.escape(str(tmp_path))}/field.toml:\d+: {says}", str(refused.value)), refused.value


@pytest.mark.parametrize(
    ("kind", "change", "says"),
    [
        ("boring", {"name": "site 1"}, 'boring.site 1.name = "site 1": is taken'),
        ("site", {"name": "site 2"}, 'site.site 2.name = "site 2": is taken'),
        ("boring", {"position_m": [900.0, 0.0]}, r"boring.hole 1.position_m = \[900.0, 0.0\]: outside the world"),
        (
            "boring",
            {"position_m": [-240.0, 93.0]},
            r"boring.hole 2.position_m = \[-240.0, 90.0\]: more than 4 m from hole 1: a drill is at one hole",
        ),
        ("boring", {"drill": "saw"}, 'boring.hole 1.drill = "saw": no vehicle has such a drill; allowed: auger, corer'),
    ],
)
def test_places_that_cannot_be(tmp_path: Path, kind: str, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables[kind][0] |= change
    with pytest.raises(ConfigurationError, match=says):
        load(str(written(tmp_path, tables)))


@pytest.mark.parametrize("tables", [{}, {"group": 3}, {"group": [{"role": 1}]}, {"boring": "many"}])
def test_malformed_tables_are_left_as_they_are(tables: dict[str, Any]) -> None:
    assert with_samplers(tables) == tables


def test_roles_for_holes_that_are_listed_stay() -> None:
    once = with_samplers(raw())
    assert with_samplers(once) == once
    assert {role["job"] for role in once["group"][0]["role"] if "job" in role} == {
        *(f"site {n}" for n in range(1, 19)), *(f"hole {n}" for n in range(1, 9)),
    }  # fmt: skip
