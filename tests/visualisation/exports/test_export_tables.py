"""NetCDF, CSV and GeoJSON exports, read back by libraries independent of the writers."""

import csv
import itertools
import json
import math
from pathlib import Path

import h5netcdf
import numpy as np
import pytest

from missions.figure import Place
from missions.runs.results import Results
from visualisation.exports import Exported, export
from visualisation.exports.voyage import Datum, Voyage


@pytest.fixture(scope="session")
def netcdf(run: Results, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    return export(run, "netcdf", tmp_path_factory.mktemp("netcdf") / "run.nc")


def test_netcdf_has_the_rows_of_the_table_by_vehicle(run: Results, netcdf: Exported) -> None:
    table = run.table("trajectories").to_pandas()
    with h5netcdf.File(netcdf.path, "r") as file:
        names = [b"".join(row).rstrip(b"\0").decode() for row in file.variables["trajectory"][...]]
        assert names == ["ASV00", "AUV00", "AUV01", "AUV02"]
        assert file.dimensions["obs"].size == netcdf.counts["points"] == len(table)
        ends = np.cumsum(file.variables["row_size"][...])
        for name, end, size in zip(names, ends, file.variables["row_size"][...], strict=True):
            own = table[table.vehicle == name]
            rows = slice(end - size, end)
            for variable, column in (("time", "time_s"), ("x", "x_m"), ("depth", "depth_m"), ("energy", "energy_j")):
                assert np.array_equal(file.variables[variable][rows], own[column])
            east = np.degrees(own.heading_rad)
            assert np.allclose(np.cos(np.radians(file.variables["heading"][rows] + east - 90.0)), 1.0)


def test_netcdf_passes_the_checker_of_cf_conventions(netcdf: Exported, tmp_path: Path) -> None:
    suite = pytest.importorskip("compliance_checker.runner")
    suite.CheckSuite.load_all_available_checkers()
    report = tmp_path / "report.txt"
    passed, broken = suite.ComplianceChecker.run_checker(
        str(netcdf.path), ["cf:1.8"], 0, "normal", output_filename=str(report), output_format="text"
    )
    assert (passed, broken) == (True, False), report.read_text()


def test_csv_has_every_table_with_all_rows(run: Results, tmp_path: Path) -> None:
    made = export(run, "csv", tmp_path / "run-csv")
    assert set(made.counts) == set(run.tables)
    for name, count in made.counts.items():
        with (made.path / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == count == run.table(name).num_rows
        for row, own in zip(rows[:20], run.table(name).to_pylist(), strict=False):
            for column, value in own.items():
                if isinstance(value, float):
                    assert float(row[column]) == value
                elif isinstance(value, str):
                    assert row[column] == value
                elif isinstance(value, list):
                    assert row[column] == ";".join(map(str, value))


# Latitudes and longitudes, and states of vehicles


MAJOR_M, FLATTENING = 6378137.0, 1 / 298.257223563


def distance_m(from_deg: tuple[float, float], to_deg: tuple[float, float]) -> float:
    """Length of a short way on WGS 84, by the radii of curvature in the middle of it."""
    middle_rad = math.radians((from_deg[0] + to_deg[0]) / 2)
    e2 = FLATTENING * (2 - FLATTENING)
    across_m = MAJOR_M / math.sqrt(1 - e2 * math.sin(middle_rad) ** 2)
    along_m = across_m**3 * (1 - e2) / MAJOR_M**2
    north_rad, east_rad = (math.radians(to - at) for at, to in zip(from_deg, to_deg, strict=True))
    return math.hypot(along_m * north_rad, across_m * math.cos(middle_rad) * math.remainder(east_rad, math.tau))


@pytest.mark.parametrize("origin", [(43.35, 3.75), (-33.9, 151.3), (70.0, -179.99), (0.5, 0.0)])
@pytest.mark.parametrize(("x_m", "y_m"), [(450.0, 450.0), (-7000.0, 7000.0), (9000.0, -100.0), (3.0, -8000.0)])
def test_degrees_keep_distances_from_the_datum(origin: tuple[float, float], x_m: float, y_m: float) -> None:
    """Within 10 km to 3 cm: arc and tangent differ by d**3 / (3 R**2), 0.8 cm at 10 km, and the digits by 1 mm."""
    latitude, longitude = (float(one) for one in Datum(*origin).degrees(x_m, y_m))
    assert distance_m(origin, (latitude, longitude)) == pytest.approx(math.hypot(x_m, y_m), abs=0.03)
    assert (latitude > origin[0]) == (y_m > 5.0 * x_m**2 * math.tan(math.radians(origin[0])) / MAJOR_M)
    assert -180.0 <= longitude < 180.0


def test_geojson_features_equal_rows_of_the_tables(run: Results, places: tuple[Place, ...], tmp_path: Path) -> None:
    made = export(run, "geojson", tmp_path / "run.geojson", places=places)
    whole = json.loads(made.path.read_text(encoding="utf-8"))
    assert whole["type"] == "FeatureCollection"
    assert whole["remoras"]["seed"] == "3"
    kinds = [one["properties"]["kind"] for one in whole["features"]]
    assert {kind: kinds.count(kind) for kind in made.counts} == made.counts
    assert made.counts["place"] == len(places)
    rows = run.table("trajectories").to_pylist()
    for one in whole["features"]:
        said, points = one["properties"], one["geometry"]["coordinates"]
        if said["kind"] == "track":
            own = [row for row in rows if row["vehicle"] == said["name"]]
            assert said["times_s"] == [row["time_s"] for row in own]
            assert len(points) == len(own)
            reached_m = distance_m((43.35, 3.75), (points[-1][1], points[-1][0]))
            assert reached_m == pytest.approx(math.hypot(own[-1]["x_m"], own[-1]["y_m"]), abs=0.01)
            assert points[-1][2] == -own[-1]["depth_m"]
        elif one["geometry"]["type"] == "Polygon":
            (ring,) = points
            assert ring[0] == ring[-1]
            doubled = sum(x * b - a * y for (x, y), (a, b) in itertools.pairwise(ring))
            assert doubled > 0.0  # anticlockwise, as RFC 7946 has outer rings


def test_state_is_out_while_the_vehicle_is_out_of_the_mission(run: Results) -> None:
    """Exactly for the times in the scenario; then its earlier role is active again."""
    states = Voyage(run, ()).states
    out = {name: [one.time_s for one in states if one.vehicle == name and one.text == "out"] for name in
           ("ASV00", "AUV00", "AUV01", "AUV02")}  # fmt: skip
    assert out == {"ASV00": [0.0], "AUV00": [], "AUV01": [60.0], "AUV02": [90.0]}
    assert min(one.time_s for one in states if one.vehicle == "ASV00" and one.text != "out") == 20.0
    of_auv01 = [one for one in states if one.vehicle == "AUV01"]
    lost = next(n for n, one in enumerate(of_auv01) if one.is_out)
    assert (of_auv01[lost + 1].time_s, of_auv01[lost + 1].roles) == (80.0, of_auv01[lost - 1].roles)
    assert [one for one in states if one.vehicle == "AUV02"][-1].is_out
