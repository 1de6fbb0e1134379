"""What is wrong with lines is told with file, line, key, value and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from escorting import raw, written

from missions.errors import ConfigurationError
from missions.escort.mission import with_surveyors
from missions.scenarios import load


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"name": "line 2"}, 'line.line 2.name = "line 2": is taken'),
        ({"to_m": [900.0, 0.0]}, r"line.line 1.to_m = \[900.0, 0.0\]: outside the world"),
        ({"to_m": [-320.0, -95.0]}, r"line.line 1.to_m = \[-320, -95\]: the line is too short; allowed: 10 m or more"),
        ({"escorted": "yes"}, 'line.line 1.escorted = "yes": .*valid boolean'),
    ],
)
def test_lines_that_cannot_be(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables["line"][0] |= change
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(tmp_path, tables)))
    assert re.match(rf"{re.escape(str(tmp_path))}/lines.toml:\d+: {says}", str(refused.value)), refused.value


def test_an_escort_that_the_sonar_would_not_show(tmp_path: Path) -> None:
    tables = raw()
    tables["mission"]["within_m"] = 40.0
    with pytest.raises(ConfigurationError, match=r"mission\.within_m = 40\.0: .*less than or equal to 30"):
        load(str(written(tmp_path, tables)))


def test_a_fleet_of_one_escorts_nobody(tmp_path: Path) -> None:
    tables = raw()
    del tables["vehicle"][1:]
    with pytest.raises(ConfigurationError, match=r"line 2\.escorted = true: takes two vehicles, and there is one"):
        load(str(written(tmp_path, tables)))


@pytest.mark.parametrize("tables", [{}, {"group": 3}, {"group": [{"role": 1}]}, {"line": 3}, {"line": [{}]}])
def test_malformed_tables_are_left_alone(tables: dict[str, Any]) -> None:
    assert with_surveyors(tables) == tables


def test_roles_that_are_listed_stay() -> None:
    once = with_surveyors(raw())
    assert with_surveyors(once) == once
    assert {role["job"] for role in once["group"][0]["role"] if "job" in role} == {f"line {n}" for n in range(1, 15)}
