"""Faults between the tables of the mapping mission."""

import copy
import tomllib
from typing import Any

import pytest
from small_mission import SMALL, checked

from missions.errors import ConfigurationFault
from missions.mapping import MappingMission
from missions.mapping.mission import MAX_CELLS

POND: dict[str, Any] = tomllib.loads(SMALL)
SQUARE = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]]


def pond() -> dict[str, Any]:
    return copy.deepcopy(POND)


def faults(raw: dict[str, Any]) -> list[ConfigurationFault]:
    return checked(MappingMission, raw)


def with_areas(*areas: Any, cell_m: float = 10.0) -> dict[str, Any]:
    raw = pond()
    raw["area"] = [{"name": "north bank", "corners_m": SQUARE}, *areas]
    raw["world"]["cell_m"] = cell_m
    return raw


@pytest.mark.parametrize("name", ["north bank", "Boat", "Team", "jetty"])
def test_area_names_must_be_unique(name: str) -> None:
    (fault,) = faults(with_areas({"name": name, "corners_m": SQUARE}))
    assert (fault.key, fault.given) == (f"area.{name}.name", f'"{name}"')
    assert fault.allowed == "used 2 times; each area needs a name of its own"


@pytest.mark.parametrize(("depth_m", "is_allowed"), [(30.0, True), (31.0, False)])
def test_area_must_be_within_the_depth_limit_of_a_vehicle_with_a_sensor(depth_m: float, is_allowed: bool) -> None:
    raw = pond()
    raw["area"][0]["depth_m"] = depth_m
    found = {fault.key: fault.allowed for fault in faults(raw)}
    assert ("area.north bank.depth_m" not in found) == is_allowed
    if not is_allowed:
        assert found["area.north bank.depth_m"].endswith("allowed: above 0 to depth_limit_m = 30")


@pytest.mark.parametrize(
    ("corners", "says"),
    [
        ([[0, 0], [100, 100], [100, 0], [0, 100]], "convex polygon in order"),
        ([[0, 0], [100, 0], [100, 400]], "outside the world"),
        ([[0, 0], [5, 0], [5, 5], [0, 4]], f"1 to {MAX_CELLS}"),  # no centre of a cell of 10 m
    ],
)
def test_an_area_is_a_convex_polygon_in_the_world_with_some_cells(corners: list[list[float]], says: str) -> None:
    found = faults(with_areas({"name": "shoal", "corners_m": corners}))
    assert {fault.key for fault in found} == {"area.shoal.corners_m"}
    assert any(says in fault.allowed for fault in found)


@pytest.mark.parametrize(
    ("corners", "is_refused"),
    [
        (SQUARE, True), (SQUARE[::-1], True),
        ([[-10.0, 40.0], [110.0, 40.0], [110.0, 60.0], [-10.0, 60.0]], True),  # across
        ([[100.0, 0.0], [200.0, 0.0], [200.0, 100.0], [100.0, 100.0]], False),  # common border
        ([[101.0, 99.0], [200.0, 0.0], [200.0, 200.0]], False),  # apart, though their boxes are not
    ],
)  # fmt: skip
def test_areas_may_touch_but_not_overlap(corners: list[list[float]], is_refused: bool) -> None:
    raw = with_areas({"name": "again", "corners_m": corners})
    raw["world"] |= {"x_m": [-100.0, 300.0], "y_m": [-100.0, 300.0]}
    found = [(fault.key, fault.allowed) for fault in faults(raw) if fault.key != "mission.goal"]
    assert len(found) == is_refused
    assert all(key == "area.again.corners_m" and "same ground as north bank" in said for key, said in found)


@pytest.mark.parametrize(("cell_m", "n"), [(100 / 64, 0), (100 / 65, 1), (0.1, 1)])
def test_an_area_has_at_most_4096_cells(cell_m: float, n: int) -> None:
    """64 by 64 cells are 4096, 65 by 65 are 4225: an index of 12 bits has 4096 values."""
    found = faults(with_areas(cell_m=cell_m))
    assert len(found) == n
    assert all("4096; change world.cell_m" in fault.allowed for fault in found)


def test_job_of_a_role_must_be_an_area_that_a_vehicle_can_map() -> None:
    raw = pond()
    assert faults(raw) == []
    raw["group"][0]["role"][3]["job"] = "north bnak"
    (fault,) = faults(raw)
    assert (fault.key, fault.given) == ("group.Team.role.Scout.job", '"north bnak"')
    assert "allowed: north bank; did you mean 'north bank'" in fault.allowed
    raw = pond()
    del raw["vehicle"][1]["sensor"]
    (fault,) = faults(raw)
    assert (fault.key, "to play it has a [vehicle.sensor]" in fault.allowed) == ("group.Team.role.Scout", True)
    raw = pond()
    raw["mission"]["importance"]["Hnad.RendezVous"] = 0.5
    (fault,) = faults(raw)
    assert (fault.key, "did you mean 'Hand'" in fault.allowed) == ("mission.importance.Hnad.RendezVous", True)


@pytest.mark.parametrize("left_out", ["Skipper.RendezVous", "Hand.RendezVous", "Mapper.Mapping", "Scout.Exploring"])
def test_every_role_has_an_importance_for_its_objective(left_out: str) -> None:
    """Its holders would idle for good; by name, with the group or for all roles are three ways to give it."""
    raw = pond()
    role, _, objective = left_out.partition(".")
    own = {name: f"{name}.{objective}" for name in ("Skipper", "Hand", "Mapper", "Scout") if name != role}
    del raw["mission"]["importance"][objective]
    raw["mission"]["importance"] |= dict.fromkeys(own.values(), 0.0)
    (fault,) = faults(raw)
    assert (fault.key, fault.allowed[:7]) == (f"mission.importance.{left_out}", "missing")
    for key in (objective, left_out, f"Team.{left_out}"):
        given = copy.deepcopy(raw)
        given["mission"]["importance"][key] = 0.0
        assert faults(given) == []


def test_goal_above_the_share_of_assigned_areas_is_refused() -> None:
    """Two areas of 100 cells; no role has the second one, so half of all can be had."""
    south = {"name": "south bank", "corners_m": [[0.0, 100.0], [100.0, 100.0], [100.0, 200.0], [0.0, 200.0]]}
    raw = with_areas(south)
    raw["mission"]["goal"] = 0.5
    assert faults(raw) == []
    raw["mission"]["goal"] = 0.51
    (fault,) = faults(raw)
    assert (fault.key, fault.given) == ("mission.goal", "0.51")
    assert "job south bank; allowed: above 0 to 0.5" in fault.allowed


@pytest.mark.parametrize(("limits", "n"), [((2,), 0), ((1,), 1), ((1, None), 0), ((1, 1), 0)])
def test_vehicles_that_may_explore_must_be_able_to_play_a_mapper(limits: tuple[int | None, ...], n: int) -> None:
    """Else a vehicle would explore with its sensor off for ever: here two vehicles explore."""
    raw = pond()
    raw["vehicle"][0] |= {"sensor": raw["vehicle"][1]["sensor"], "playable_roles": ["Skipper", "Scout"]}
    raw["group"][0]["role"] = [role for role in raw["group"][0]["role"] if role["name"] != "Mapper"] + [
        {"name": f"Mapper{number}"} | ({} if limit is None else {"maximum": limit})
        for number, limit in enumerate(limits)
    ]
    found = [fault for fault in faults(raw) if ".Mapper" in fault.key]
    assert len(found) == n
    assert all("allowed: 2 or more, or none; 2 vehicles may explore" in fault.allowed for fault in found)


def test_area_must_not_have_the_name_of_a_mission() -> None:
    (fault,) = faults(with_areas({"name": "AreaMapping", "corners_m": SQUARE}))
    assert (fault.key, fault.allowed) == ("area.AreaMapping.name", "is the name of a mission")
