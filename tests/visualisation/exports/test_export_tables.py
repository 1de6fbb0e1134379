"""netCDF and CSV, by readers that share nothing with the writers."""

import csv
from pathlib import Path

import h5netcdf
import numpy as np
import pytest

from missions.runs.results import Results
from visualisation.exports import Exported, export


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


def test_netcdf_says_what_it_is(netcdf: Exported) -> None:
    """The rules of CF 1.8, 9.3.3 and appendix A for a contiguous ragged array of trajectories."""
    with h5netcdf.File(netcdf.path, "r") as file:
        said = (file.attrs["Conventions"], file.attrs["featureType"], file.variables["trajectory"].attrs["cf_role"])
        assert said == ("CF-1.8", "trajectory", "trajectory_id")
        assert file.variables["row_size"].attrs["sample_dimension"] == "obs"
        found = [file.variables[name].attrs["units"] for name in ("time", "latitude", "longitude", "depth")]
        units = [unit.decode() if isinstance(unit, bytes) else unit for unit in found]
        assert units == ["seconds since 1970-01-01 00:00:00 UTC", "degrees_north", "degrees_east", "m"]
        assert file.variables["depth"].attrs["positive"] == "down"
        state = file.variables["state"]
        meanings = str(state.attrs["flag_meanings"]).split(" ")
        assert len(meanings) == len(state.attrs["flag_values"])
        assert set(np.unique(state[...])) <= set(state.attrs["flag_values"])


def test_a_checker_of_cf_has_no_complaint(netcdf: Exported, tmp_path: Path) -> None:
    suite = pytest.importorskip("compliance_checker.runner")
    suite.CheckSuite.load_all_available_checkers()
    report = tmp_path / "report.txt"
    passed, broken = suite.ComplianceChecker.run_checker(
        str(netcdf.path), ["cf:1.8"], 0, "normal", output_filename=str(report), output_format="text"
    )
    assert (passed, broken) == (True, False), report.read_text()


def test_csv_has_every_table_with_its_rows(run: Results, tmp_path: Path) -> None:
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
