"""Worlds of 100 km by 100 km: encoded positions, distant work, completion."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recorded import point, said
from varied import Varied

from missions.errors import ConfigurationError
from missions.mapping import MappingMission
from missions.runs.run import run
from missions.scenarios import load
from worldmodel import TBox, core_ontology_paths, reaching, read_tbox

TBOX = read_tbox(*core_ontology_paths(), *MappingMission.vocabulary)


def wide(folder: Path, half_m: float) -> Path:
    """Two vehicles, and a site near each corner of a square world; all receive each other."""
    field = Varied("recovery-field", "wide.toml")
    raw = field.raw()
    raw["world"] |= {"x_m": [-half_m, half_m], "y_m": [-half_m, half_m]}
    raw["scenario"]["duration_s"] = 100_000.0
    raw["communication"]["range_m"] = 100_000.0
    far_m = half_m - 100.0
    corners = [(far_m, far_m), (-far_m, far_m), (far_m, -far_m), (-far_m, -far_m)]
    raw["site"] = [{"name": f"site {n}", "position_m": at_m, "stay_s": 60.0} for n, at_m in enumerate(corners)]
    raw["lifts"]["number"] = 0
    del raw["vehicle"][2:]
    for vehicle in raw["vehicle"]:
        vehicle |= {"transit_speed_mps": 10.0, "energy_j": 1e9}
    return field.written(folder, raw)


def test_mission_50_km_from_the_origin_completes_and_sends_positions(tmp_path: Path) -> None:
    """The way of either vehicle is 70.6, 99.8 and 70.6 km at 10 m/s: 24,100 s, and as much again is not needed."""
    done = run(load(str(wide(tmp_path, 50_000.0))), 1)
    assert done.completed, done.reason
    assert 24_100.0 <= done.end_s <= 25_500.0
    assert max(abs(point(value)[0]) for *_, value in said(done, "position")) > 49_500.0


def test_a_world_is_100_km_from_the_origin_at_most(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"world\.x_m\.1 = -100001\.0: .*greater than or equal to -100000"):
        load(str(wide(tmp_path, 100_001.0)))


@given(st.floats(10_001.0, 110_000.0))
def test_position_fields_cover_the_world_and_keep_earlier_values(reach_m: float) -> None:
    wider: TBox = reaching(TBOX, reach_m)
    for before, after in zip(TBOX.attributes, wider.attributes, strict=True):
        for old, new in zip(before.fields, after.fields, strict=True):
            if old != new:
                assert new.minimum <= -reach_m
                assert reach_m <= new.maximum
                for value in (old.minimum, old.maximum, old.minimum + 7 * old.resolution):
                    assert new.quantise(value) == value
    east, north = wider.attribute_named("position").fields
    assert (east.quantise(reach_m), north.quantise(-reach_m)) == pytest.approx((reach_m, -reach_m), abs=0.25)
