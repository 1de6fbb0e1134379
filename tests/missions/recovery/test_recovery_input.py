"""What is wrong with sites and objects is told with file, line, key, value and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from recovering import raw, written

from missions.errors import ConfigurationError
from missions.recovery.mission import with_jobs
from missions.scenarios import load


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"vehicles": 5}, "lifts.vehicles = 5: an object takes more vehicles than there are; allowed: 1 to 4"),
        ({"vehicles": 0}, "lifts.vehicles = 0: .*greater than or equal to 1"),
        ({"length_m": 6.0}, "lifts.length_m = 6.0: allowed: 8.25 or more, so that vehicles keep clear"),
        ({"number": 21}, "lifts.number = 21: .*less than or equal to 20"),
        ({"lift_s": 0.0}, "lifts.lift_s = 0.0: .*greater than 0"),
    ],
)
def test_objects_that_cannot_be(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables["lifts"] |= change
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(tmp_path, tables)))
    assert re.match(rf"{re.escape(str(tmp_path))}/field.toml:\d+: {says}", str(refused.value)), refused.value


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"name": "lift 1"}, 'site.lift 1.name = "lift 1": is taken'),
        ({"name": "site 2"}, 'site.site 2.name = "site 2": is taken'),
        ({"position_m": [900.0, 0.0]}, r"site.site 1.position_m = \[900.0, 0.0\]: outside the world"),
    ],
)
def test_sites_that_cannot_be(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables["site"][0] |= change
    with pytest.raises(ConfigurationError, match=says):
        load(str(written(tmp_path, tables)))


def test_objects_that_nobody_would_find(tmp_path: Path) -> None:
    tables = raw()
    for vehicle in tables["vehicle"]:
        del vehicle["sensor"]
    with pytest.raises(ConfigurationError, match=r"lifts\.number = 4: nobody would find one"):
        load(str(written(tmp_path, tables)))


@pytest.mark.parametrize("tables", [{}, {"group": 3}, {"group": [{"role": 1}]}, {"lifts": {"number": "many"}}])
def test_malformed_tables_are_left_alone(tables: dict[str, Any]) -> None:
    assert with_jobs(tables) == tables


def test_roles_that_are_listed_stay() -> None:
    once = with_jobs(raw())
    assert with_jobs(once) == once
    assert {role["job"] for role in once["group"][0]["role"] if "job" in role} == {
        *(f"site {n}" for n in range(1, 13)), *(f"lift {n}" for n in range(1, 5)),
    }  # fmt: skip
