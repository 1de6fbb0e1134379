"""What is wrong with a scenario of the structure is told with file, line, key and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from servicing import raw, written

from missions.errors import ConfigurationError
from missions.pandora.scenario import with_roles
from missions.scenarios import load


def refusal(folder: Path, tables: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(folder, tables)))
    return str(refused.value)


@pytest.mark.parametrize(
    ("table", "entry", "change", "says"),
    [
        ("valve", 1, {"position_m": [-43.0, 1.0]}, "valve A2.position_m.*: 1 m from valve A1; allowed: 2.5 m or more"),
        ("valve", 0, {"position_m": [-943.0, 1.0]}, "valve.valve A1.position_m = .*outside the world"),
        ("valve", 0, {"panel": "panel Z"}, 'valve.valve A1.panel = "panel Z": allowed: panel A'),
        ("valve", 0, {"name": "panel A"}, "panel.panel A.name = .*used 2 times"),
        ("valve", 0, {"name": "AUV00"}, 'valve.AUV00.name = "AUV00": used 2 times'),
        ("valve", 0, {"name": "any"}, "valve.any.name = .*stands for a valve that is drawn"),
        ("anode", 0, {"work_s": 0.0}, "anode.*work_s = 0.0: input should be greater than 0"),
        ("anode", 0, {"work_s": float("nan")}, "anode.*work_s = nan: .*finite"),
    ],
)  # fmt: skip
def test_a_part_that_cannot_be(tmp_path: Path, table: str, entry: int, change: dict[str, Any], says: str) -> None:
    tables = raw()
    tables[table][entry] |= change
    found = refusal(tmp_path, tables)
    assert re.search(says, found), found
    assert re.match(rf"{re.escape(str(tmp_path))}/little.toml:\d+: ", found)


@pytest.mark.parametrize(
    ("upsets", "says"),
    [
        ([{"kind": "moved"}], "upset.1.distance_m: missing: how far the valve is from its place"),
        ([{"kind": "stuck", "distance_m": 2.0}], "upset.1.distance_m = 2.0: not used by kind stuck, only by moved"),
        ([{"kind": "stuck", "part": "valve A9"}], 'upset.1.part = "valve A9": allowed: valve A1, valve A2, valve A3'),
        ([{"kind": "stuck", "part": "valve A1"}] * 2, 'upset.2.part = "valve A1": is upset already'),
        ([{"kind": "stuck"}] * 4, "upset = 4 tables: each befalls another valve, and there are 3"),
        ([{"kind": "moved", "distance_m": 900.0}], "upset.1.distance_m = 900: at most "),
        ([{"kind": "melted"}], "'moved', 'turned' or 'stuck'"),
    ],
)  # fmt: skip
def test_an_upset_that_cannot_be(tmp_path: Path, upsets: list[dict[str, Any]], says: str) -> None:
    assert says in refusal(tmp_path, {**raw(), "upset": upsets})


def test_settings_that_contradict_each_other(tmp_path: Path) -> None:
    tables = raw()
    tables["mission"] |= {"late_factor": 3.0, "failed_factor": 2.0}
    assert "an action fails after it is late: allowed: above late_factor" in refusal(tmp_path, tables)
    tables = raw()
    tables["mission"]["adaptation"] = "some"
    assert "'none', 'tactical' or 'all'" in refusal(tmp_path, tables)


def test_a_surge_that_cannot_be(tmp_path: Path) -> None:
    surge = {"between_s": [0.0, 10.0], "lasts_s": 5.0, "east_mps": 0.7}
    tables = raw()
    tables["current"]["surge"] = [{**surge, "between_s": [20.0, 10.0]}]
    assert "the earliest start may not be later than the latest" in refusal(tmp_path, tables)
    tables["current"]["surge"] = [surge]
    assert "could not stay where it is" in refusal(tmp_path, tables)
    tables["current"]["surge"] = [{**surge, "east_mps": 0.5}]
    assert load(str(written(tmp_path, tables))).current.surge[0].lasts_s == 5.0


def test_a_structure_of_nothing(tmp_path: Path) -> None:
    tables = raw()
    for key in ("panel", "valve", "anode"):
        del tables[key]
    assert "there is nothing to be serviced: give one of [[panel]], [[valve]], [[chain]], [[anode]]" in refusal(
        tmp_path, tables
    )


def test_roles_are_added_once() -> None:
    once = with_roles(raw())
    assert with_roles(once) == once
    jobs = [role.get("job") for role in once["group"][0]["role"]]
    assert jobs[2:] == [f"service {part}" for part in ("panel A", "valve A1", "valve A2", "valve A3", "anode NW")]


def test_a_panel_in_the_place_of_another(tmp_path: Path) -> None:
    tables = raw()
    (panel,) = tables["panel"]
    near = {**panel, "name": "panel Z", "position_m": [panel["position_m"][0], panel["position_m"][1] + 0.25]}
    said = refusal(tmp_path, {**tables, "panel": [panel, near]})
    assert "panel.panel Z.position_m" in said
    assert "0.25 m from panel A; allowed: 0.5 m or more" in said


def test_a_surge_that_begins_after_the_end(tmp_path: Path) -> None:
    tables = raw()
    end_s = tables["scenario"]["duration_s"]
    tables["current"]["surge"] = [{"between_s": [end_s, end_s + 1.0], "lasts_s": 60.0, "east_mps": 0.1}]
    assert "current.surge.1.between_s" in refusal(tmp_path, tables)
