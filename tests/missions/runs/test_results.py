"""Results of a run: summary, manifest and tables with units, written atomically and reproducibly."""

import json
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_mission import SMALL, pond

from missions.errors import OutputError
from missions.runs.results import LIBRARIES, MemoryResults, Results, summary, write_results
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.runs.tables import arrow_table
from missions.scenarios import load
from missions.verification.folder import columns_of
from remoras.recorder import TABLES, TIME, VEHICLE, Column, Recorder, Table

SUMMARY = """scenario, strategy, policy, channel, per, seed, n_vehicles, completed, reason, mission_time_s,
goal_fraction, reachable_fraction, distance_m, energy_j, modem_energy_j, n_packets, n_bytes,
bits_headers, bits_assignments, bits_claims, bits_status, bits_signals, bits_observations,
delivery_ratio, observations_per_min, mean_latency_s, p95_latency_s, consistency_time_s, consistent_fraction,
false_beliefs,
wrong_belief_fraction, view_divergence, holder_conflict_fraction, malformed_s,
n_refused_acts, idle_s, deadlock_s, closest_approach_m, conflicts,
coverage_fraction, time_to_50_s, time_to_80_s, time_to_95_s, time_to_100_s,
duplicate_fraction, least_mapped_fraction,
drawn, milestones""".replace("\n", " ").split(", ")

NAMES = [
    "trajectories", "roles", "membership", "organisation", "activities", "decisions", "satisfaction", "coverage",
    "goal", "packets", "items", "knowledge", "plans", "peers", "links", "faults", "refused", "deliveries", "unsaid",
]  # fmt: skip
"""Of tables; their columns are those that the independent reader expects."""
UNITS = {"s": "s", "m": "m", "rad": "rad", "mps": "m/s", "j": "J", "bits": "bit"}
"""Unit by the last part of a column's name."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run_scenario(pond(tmp_path_factory.mktemp("scenario")), 1)


@pytest.fixture(scope="module")
def folder(finished: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("results") / "pond"
    write_results(finished, made)
    return made


# The files ----------------------------------------------------------------------------------------


def test_a_folder_holds_summary_manifest_and_every_table(folder: Path):
    expected = {"summary.json", "manifest.json", *(f"{name}.parquet" for name in NAMES)}
    assert {path.name for path in folder.iterdir()} == expected
    assert [path.name for path in folder.parent.iterdir()] == ["pond"]  # no drafts are left beside it


@pytest.mark.parametrize("table", NAMES)
def test_tables_have_documented_columns_and_units(folder: Path, table: str):
    results = Results.read(folder)
    assert set(results.table(table).column_names) == columns_of(table).keys()
    units = results.units(table)
    for name in results.table(table).column_names:
        suffix = name.rsplit("_", 1)[-1]
        if "_" in name and suffix in UNITS:
            assert units[name] == UNITS[suffix]
    rows = results.table(table).to_pylist()  # of each vehicle, or facts as recorded, in the order of time
    keys = [(row["vehicle"] if table == "trajectories" else "", row.get("recorded_s", row["time_s"])) for row in rows]
    assert keys == sorted(keys)


def test_run_is_reproduced_from_its_manifest(folder: Path, finished: Run, tmp_path: Path):
    manifest = Results.read(folder).manifest
    assert manifest["seed"] == 1
    assert set(manifest["libraries"]) == set(LIBRARIES)
    file = tmp_path / "again.toml"
    file.write_text(manifest["scenario"], encoding="utf-8")
    assert load(str(file)) == finished.scenario
    again = run_scenario(load(str(file)), manifest["seed"])
    assert again.recorder.packets == finished.recorder.packets
    assert again.milestones == finished.milestones


# The summary --------------------------------------------------------------------------------------


def test_summary_has_documented_fields_in_order(folder: Path, finished: Run):
    written = Results.read(folder).summary
    assert list(written) == [*SUMMARY, "run_id"]
    assert list(summary(finished)) == SUMMARY
    assert all(list(each) == ["name", "vehicle", "group", "time_s"] for each in written["milestones"])
    times_s = [each["time_s"] for each in written["milestones"]]
    assert times_s == sorted(times_s)
    assert written["false_beliefs"] == 0


def test_ratio_and_latency_without_packets_are_null_instead_of_nan(tmp_path: Path):
    report = summary(run_scenario(pond(tmp_path, SMALL, "scenario.duration_s=0.5"), 1))
    assert (report["n_packets"], report["delivery_ratio"], report["mean_latency_s"]) == (0, None, None)
    assert json.loads(json.dumps(report, allow_nan=False)) == report


# What is read -------------------------------------------------------------------------------------


def copy_of(folder: Path, target: Path) -> Path:
    return Path(shutil.copytree(folder, target))


@pytest.mark.parametrize("table", ["trajectories", "unsaid"])
def test_folder_without_an_optional_table_is_read(folder: Path, tmp_path: Path, table: str) -> None:
    """An older version, or another mission, did not write it."""
    partly = copy_of(folder, tmp_path / "partly")
    (partly / f"{table}.parquet").unlink()
    results = Results.read(partly)
    assert results.tables == tuple(sorted(set(NAMES) - {table}))
    assert not results.has(table)
    assert results.summary == Results.read(folder).summary
    with pytest.raises(OutputError, match=rf"no table '{table}'; there are .*"):
        results.table(table)
    with pytest.raises(OutputError, match=r"no table 'coverag'; there are .*; did you mean 'coverage'\?|no.*lacks"):
        Results.read(folder).table("coverag")
    other = next(name for name in NAMES if name != table)
    assert results.table(other) == Results.read(folder).table(other)


def test_table_of_an_unknown_schema_is_refused_with_its_columns(folder: Path, tmp_path: Path) -> None:
    """Additional columns are accepted: a later version may have added them."""
    other = copy_of(folder, tmp_path / "other")
    packets = pq.read_table(folder / "packets.parquet")
    pq.write_table(
        packets.drop_columns(["sender", "acks"]).append_column("who", packets["sender"]), other / "packets.parquet"
    )
    with pytest.raises(OutputError, match=r"packets\.parquet: a table of an unknown schema") as caught:
        Results.read(other).table("packets")
    said = str(caught.value)
    assert "lacks sender, acks" in said
    assert "has slot, time_s, size_bits, items, receivers, lost_by, end_s" in said
    assert "run the scenario again" in said
    pq.write_table(packets.append_column("who", packets["sender"]), other / "packets.parquet")
    assert Results.read(other).table("packets").drop_columns(["who"]) == packets


# In memory ----------------------------------------------------------------------------------------


def alike(memory: MemoryResults, written: Results) -> None:
    """Assert equal results of two readers, to the stored digits."""
    assert memory.tables == written.tables
    for name in memory.tables:
        assert memory.has(name)
        assert memory.table(name) == written.table(name)
        assert memory.units(name) == written.units(name)
    assert memory.scenario == written.scenario
    assert memory.manifest == written.manifest
    assert json.loads(json.dumps(memory.summary)) == written.summary


def test_results_in_memory_equal_written_ones(folder: Path, finished: Run) -> None:
    alike(MemoryResults(finished), Results.read(folder))


FINITE = st.floats(-1e6, 1e6)
VALUES = {
    "float": FINITE, "int": st.integers(-(2**31), 2**31), "str": st.text(), "list": st.lists(st.text(), max_size=3),
}  # fmt: skip
OWN = Table(
    "own",
    (TIME, VEHICLE, Column("depth_m", "float", "m"), Column("share", "float", "1"), Column("n", "int"),
     Column("heard", "list"), Column("temperature_c", "float", "degC")),
)  # fmt: skip


@settings(max_examples=25)
@given(st.data())
def test_drawn_rows_are_equal_in_memory_and_on_disk(finished: Run, data: st.DataObject) -> None:
    recorder = Recorder([OWN])
    recorder.trajectories.append(finished.recorder.trajectories[-1])  # the energy of the summary is from its last rows
    for table in (OWN, *(table for table in TABLES if table.name in ("roles", "activities", "faults"))):
        row = st.tuples(*(VALUES[column.kind] for column in table.columns))
        recorder.rows(table.name).extend(data.draw(st.lists(row, max_size=4), label=table.name))
    mine = replace(finished, recorder=recorder)
    with tempfile.TemporaryDirectory() as made:
        write_results(mine, Path(made) / "out")
        alike(MemoryResults(mine), Results.read(Path(made) / "out"))


@pytest.mark.parametrize("n_rows", [1_001, 20_000])
def test_long_table_is_written_completely(finished: Run, tmp_path: Path, n_rows: int) -> None:
    """Tables of whole missions have ten thousands of rows; those of the pond and of drawn tables are short."""
    recorder = Recorder([OWN])
    recorder.trajectories.append(finished.recorder.trajectories[-1])  # the energy of the summary is from its last rows
    recorder.rows("own").extend((float(row), "AUV00", 1.0, 0.5, row, [], 4.0) for row in range(n_rows))
    write_results(replace(finished, recorder=recorder), tmp_path / "out")
    read = Results.read(tmp_path / "out").table("own")
    assert read.column("n").to_pylist() == list(range(n_rows))


# Nothing is lost ----------------------------------------------------------------------------------


def test_folder_without_results_is_refused_with_missing_files(folder: Path, tmp_path: Path):
    with pytest.raises(OutputError, match=r"no results of a run, missing: summary\.json, manifest\.json"):
        Results.read(tmp_path)
    for name in ("summary.json", "manifest.json"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    with pytest.raises(OutputError, match=r"missing: trajectories\.parquet, .*packets\.parquet"):
        Results.read(tmp_path)


# Alike every time ---------------------------------------------------------------------------------


def test_table_with_invalid_column_names_is_damaged(folder: Path, tmp_path: Path) -> None:
    broken = copy_of(folder, tmp_path / "broken")
    path = broken / "roles.parquet"
    path.write_bytes(path.read_bytes().replace(b"vehicle", b"vehi\xadle"))
    with pytest.raises(OutputError, match=r"roles\.parquet: damaged"):
        Results.read(broken).table("roles")


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [("summary", "milestones", 3), ("summary", "mission_time_s", "long"), ("manifest", "scenario", 3)],
)
def test_value_of_another_type_is_damage(folder: Path, tmp_path: Path, name: str, key: str, value: object) -> None:
    path = copy_of(folder, tmp_path / "broken") / f"{name}.json"
    path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), key: value}), encoding="utf-8")
    with pytest.raises(OutputError, match=rf"{name}\.json: damaged: '{key}' is missing or of a wrong type"):
        getattr(Results.read(path.parent), name)


def test_nulls_and_infinities_are_kept_when_values_are_rounded() -> None:
    """A number that is large stays exact; a step of a unit holds beside a null, and in lists; joules are whole."""
    columns = (Column("depth_m", "float", "m"), Column("beams_m", "floats", "m"), Column("used_j", "float", "J"))
    echoes = Table("echoes", (TIME, *columns, Column("heading_rad", "float", "rad")))
    rows = [
        (1.00001, None, [1.0031, 2.0], 1.6, 0.0004), (2.0, float("inf"), [], None, 1.0),
        (3.0e9, -4.999, [-0.001], float("inf"), None),
    ]  # fmt: skip
    kept = arrow_table(echoes, rows).to_pydict()
    assert kept["used_j"] == [2, None, None]
    assert kept["heading_rad"] == [0.0, 1.0, None]  # 0.0004 rad is less than half of 1/1024 rad
    assert kept["time_s"] == [1.0, 2.0, 3.0e9]
    assert kept["depth_m"] == [None, float("inf"), -5.0]
    assert kept["beams_m"] == [[1.0, 2.0], [], [0.0]]  # 0.0031 m is less than half of 1/128 m
    assert str(kept["beams_m"][2][0]) == "0.0"


@pytest.mark.parametrize("row", [(1.0,), (1.0, "A", 2), ("now", "A")])
def test_row_that_does_not_fit_is_refused_with_its_table(row: tuple[object, ...]) -> None:
    looks = Table("looks", (TIME, VEHICLE))
    with pytest.raises(OutputError, match=r"table looks: a row does not fit its columns time_s \(float\), vehicle"):
        arrow_table(looks, [(1.0, "A"), row])
