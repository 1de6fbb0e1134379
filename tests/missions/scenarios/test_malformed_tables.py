"""Whatever stands where a table, a list or a value belongs: it is a fault of the file and no crash."""

import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st
from small_mission import SMALL

from missions.document import Document
from missions.errors import ConfigurationError
from missions.scenarios.loading import scenario_from

FAULTS = """
[[fault]]
kind = "sensor"
vehicle = "any"
at_s = [100.0, 200.0]
until_s = 300.0
sensor = "mapping"

[[fault]]
kind = "slow"
vehicle = "head of Team"
rate_per_h = 1.0
factor = 0.5

[[fault]]
kind = "joins"
vehicle = "Diver"
at_s = 10.0
"""
POND: dict[str, Any] = tomllib.loads(SMALL.replace("[vehicle.sensor]", "[[vehicle.sensor]]") + FAULTS)
JUNK = st.sampled_from(
    [5, -1.5, True, "text", "", [], {}, [5], [[]], [{}], [[1, 2]], {"name": 5}, [{"name": "A"}], ["A"]]
)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where something stands in the tables, from the outermost to the innermost."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    found = [path] if path else []
    return found + [place for key, one in inner for place in places(one, (*path, key))]


def replaced(place: tuple[Any, ...], by: Any) -> str:
    raw = copy.deepcopy(POND)
    at: Any = raw
    for part in place[:-1]:
        at = at[part]
    at[place[-1]] = by
    return tomli_w.dumps(raw)


@pytest.mark.slow
@settings(max_examples=300)
@given(st.sampled_from(places(POND)), JUNK)
def test_junk_anywhere_is_a_fault_or_as_good_as_what_was_there(place: tuple[Any, ...], junk: Any) -> None:
    said = ""
    try:
        scenario_from(Document.of_text(replaced(place, junk), "pond.toml"))
    except ConfigurationError as error:
        said = str(error)
    assert all(line.startswith("pond.toml") for line in said.splitlines())


def test_the_pond_as_tables_is_in_order() -> None:
    assert scenario_from(Document.of_text(tomli_w.dumps(POND), "pond.toml")).scenario.name == "pond"


@pytest.mark.parametrize("roles", [5, "Skipper", {"Skipper": 1}, [5], [["Skipper"]]])
def test_playable_roles_that_are_no_list_of_names_are_told_by_their_key(roles: Any, tmp_path: Path) -> None:
    text = replaced(("vehicle", 0, "playable_roles"), roles)
    with pytest.raises(ConfigurationError, match=r"vehicle\.Boat\.playable_roles"):
        scenario_from(Document.of_text(text, "pond.toml"))
