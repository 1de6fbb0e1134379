"""What is wrong with contacts and imagery is told with file, line, key, value and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from hunting import raw, written

from missions.errors import ConfigurationError
from missions.minehunting.mission import with_views
from missions.scenarios import load


@pytest.mark.parametrize(
    ("table", "change", "says"),
    [
        ("imagery", {"target_strips": 9}, "imagery.target_strips = 9: allowed: 1 to 8, the strips there are"),
        ("imagery", {"sigma_db": 0.0}, "imagery.sigma_db = 0.0: .*greater than 0"),
        ("mission", {"revisits": 41}, "mission.revisits = 41: .*less than or equal to 40"),
        ("mission", {"revisits": 20}, "mission.view_m = 15.0: its views would be 4.46 m apart; 7 m or more"),
        ("mission", {"confidence": 0.5}, "mission.confidence = 0.5: .*greater than 0.5"),
    ],
)
def test_imagery_that_cannot_be(tmp_path: Path, table: str, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables[table] |= change
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(tmp_path, tables)))
    assert re.match(rf"{re.escape(str(tmp_path))}/contacts.toml:\d+: {says}", str(refused.value)), refused.value


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"name": "revisit 1"}, 'contact.revisit 1.name = "revisit 1": is taken'),
        ({"name": "contact 2"}, 'contact.contact 2.name = "contact 2": is taken'),
        ({"position_m": [900.0, 0.0]}, r"contact.contact 1.position_m = \[900.0, 0.0\]: outside the world"),
    ],
)
def test_contacts_that_cannot_be(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables["contact"][0] |= change
    with pytest.raises(ConfigurationError, match=says):
        load(str(written(tmp_path, tables)))


def test_contacts_too_near_to_each_other(tmp_path: Path) -> None:
    tables = raw()
    x_m, y_m = tables["contact"][0]["position_m"]
    tables["contact"][1]["position_m"] = [x_m + 20.0, y_m]
    with pytest.raises(
        ConfigurationError, match=r"contact\.contact 2\.position_m = .*nearer than 45 m to contact\.contact 1"
    ):
        load(str(written(tmp_path, tables)))


def test_contacts_that_nobody_would_see(tmp_path: Path) -> None:
    tables = raw()
    for vehicle in tables["vehicle"]:
        vehicle.pop("sensor", None)
    with pytest.raises(ConfigurationError, match=r"contact = 12: nobody would see one"):
        load(str(written(tmp_path, tables)))


@pytest.mark.parametrize("tables", [{}, {"group": 3}, {"group": [{"role": 1}]}, {"mission": {"revisits": "many"}}])
def test_malformed_tables_are_left_alone(tables: dict[str, Any]) -> None:
    assert with_views(tables) == tables
