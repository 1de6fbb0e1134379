"""What is wrong with a passage and with deliveries is told with file, line, key, value and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from ferrying import raw, written

from missions.errors import ConfigurationError
from missions.ferry.mission import with_carriers
from missions.scenarios import load


def refusal(folder: Path, tables: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(folder, tables)))
    return str(refused.value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"width_m": 4.0}, "passage.width_m = 4.0: narrower than the separation; allowed: guidance.separation_m = 5"),
        ({"width_m": -1.0}, "passage.width_m = -1.0: .*greater than 0"),
        ({"width_m": "wide"}, "passage.width_m = .*number"),
        ({"x_m": [40.0, -40.0]}, r"passage.x_m = .*: allowed: a western and an eastern border within the world, x -20"),
        ({"x_m": [-40.0, 400.0]}, r"passage.x_m = .*: allowed: a western and an eastern border within the world"),
        ({"y_m": 119.0}, "passage.y_m = 119.0: allowed: -117 to 117, so that it lies within the world"),
    ],
)  # fmt: skip
def test_a_passage_that_cannot_be(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables["passage"] |= change
    found = refusal(tmp_path, tables)
    assert re.match(rf"{re.escape(str(tmp_path))}/reef.toml:\d+: {says}", found), found


@pytest.mark.parametrize(
    ("table", "change", "says"),
    [
        ("vehicle", {"start_m": [0.0, 0.0]}, r"vehicle.AUV00.start_m = .*in the reef, x -42.5 to 42.5, or its passage"),
        ("rally_point", {"position_m": [0.0, 80.0]}, r"rally_point.tender.position_m = .*in the reef"),
        ("delivery", {"from_m": [10.0, 0.0]}, r"delivery.load 1.from_m = \[10, 0\]: in the reef or its passage"),
        ("delivery", {"to_m": [900.0, 0.0]}, "delivery.load 1.to_m = .*outside the world"),
        ("delivery", {"name": "AUV03"}, 'delivery.AUV03.name = "AUV03": is taken'),
    ],
)
def test_what_lies_in_the_reef_or_outside(tmp_path: Path, table: str, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables[table][0] |= change
    assert re.search(says, refusal(tmp_path, tables))


@pytest.mark.parametrize("tables", [{}, {"group": 3}, {"group": [{"role": 1}]}, {"delivery": [{"name": 1}]}])
def test_malformed_tables_are_left_alone(tables: dict[str, Any]) -> None:
    assert with_carriers(tables) == tables


def test_carriers_and_founders_address_each_other() -> None:
    once = with_carriers(raw())
    roles = {role["name"]: role for role in once["group"][0]["role"]}
    assert with_carriers(once) == once
    assert "Carrier of load 1" in roles["Hand"]["influences"]
    assert {"Carrier of load 2", "Hand", "Leader"} <= set(roles["Carrier of load 1"]["influences"])
