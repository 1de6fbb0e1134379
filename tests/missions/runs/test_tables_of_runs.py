"""Tables of a sample of runs say what the recorder said, to the unit they are kept in."""

import io
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from missions.errors import OutputError
from missions.runs.run import run
from missions.runs.tables import arrow_table, encoded, merge_tables, table_writer, write_part, write_table
from missions.scenarios import load
from remoras.recorder import PACKETS, TABLES, TIME, VEHICLE, Column, Recorder, Table


@pytest.fixture(scope="module")
def recorder() -> Recorder:
    return run(load("mapping-rendezvous", [("--set", "scenario.duration_s=60")])).recorder


def test_values_come_back_within_half_a_unit(recorder: Recorder) -> None:
    table = pq.read_table(io.BytesIO(encoded(recorder, "k")["trajectories"])).to_pylist()
    rows = sorted(recorder.trajectories, key=lambda row: (row[1], row[0]))
    assert len(table) == len(rows) > 200
    for packed, row in zip(table, rows, strict=True):
        assert packed["vehicle"] == row[1]
        assert packed["x_m"] == pytest.approx(row[2], abs=0.5 / 128)
        assert packed["heading_rad"] == pytest.approx(row[4], abs=0.5 / 1024)
        assert packed["energy_j"] == pytest.approx(row[6], abs=0.5)
        assert packed["time_s"] == pytest.approx(row[0], abs=0.5 / 4096)


def test_every_table_is_kept_with_its_units(recorder: Recorder) -> None:
    files = encoded(recorder, "k")
    assert set(files) == {table.name for table in TABLES} | {"coverage", "goal", "deliveries", "unsaid"}
    packets = pq.read_table(io.BytesIO(files["packets"]))
    assert packets.schema.field("time_s").metadata[b"unit"] == b"s"
    assert packets.schema.field("arrivals_s").metadata[b"unit"] == b"s"
    assert packets.column("lost_by").to_pylist() == [row[7] for row in recorder.packets]


def test_parts_merge_to_the_same_bytes_in_any_order(tmp_path: Path, recorder: Recorder) -> None:
    for at_once in (True, False):
        parts, tables = tmp_path / f"parts{at_once}", tmp_path / f"tables{at_once}"
        for key in ("b", "a", "c"):
            write_part(parts, key, encoded(recorder, key))
            if not at_once:
                merge_tables(parts, tables, {"a", "b", "c"})
        if at_once:
            merge_tables(parts, tables, {"a", "b", "c"})
        assert not parts.exists()
    one, two = ((tmp_path / f"tables{at_once}" / "packets.parquet").read_bytes() for at_once in (True, False))
    assert one == two
    merged = pq.read_table(tmp_path / "tablesTrue" / "packets.parquet")
    n_rows = len(recorder.packets)
    assert merged.column("key").to_pylist() == [key for key in "abc" for _ in range(n_rows)]
    for number in range(3):
        of_run = merged.slice(number * n_rows, n_rows).drop_columns(["key"])
        assert of_run.equals(arrow_table(PACKETS, recorder.packets))


@pytest.mark.parametrize(
    ("most", "groups"),
    [(1, [40, 60, 50]), (50, [40 + 60, 50]), (150, [40 + 60 + 50]), (1000, [40 + 60 + 50])],
    ids=["none", "two", "exact", "all"],
)
def test_runs_share_row_groups_whole(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, most: int, groups: list[int]
) -> None:
    """A group is closed by the run with which it has enough rows; a run without rows stands nowhere."""
    monkeypatch.setattr("missions.runs.tables.GROUP_ROWS", most)
    looks = Table("looks", (TIME, VEHICLE))
    sizes = {"a": 40, "b": 60, "c": 0, "d": 50}

    def part(key: str) -> None:
        rows = [(float(number), key) for number in range(sizes[key])]
        content = io.BytesIO()
        write_table(content, arrow_table(looks, rows, key))
        write_part(tmp_path / "parts", key, {"looks": content.getvalue()})

    for key in "db":  # the later ones go between those that are there
        part(key)
    merge_tables(tmp_path / "parts", tmp_path / "tables", set("db"))
    for key in "ca":
        part(key)
    merge_tables(tmp_path / "parts", tmp_path / "tables", set("abcd"))
    merged = pq.ParquetFile(tmp_path / "tables" / "looks.parquet")
    assert [merged.metadata.row_group(n).num_rows for n in range(merged.num_row_groups)] == groups
    assert merged.read().column("vehicle").to_pylist() == [key for key, size in sizes.items() for _ in range(size)]


def test_a_run_that_the_ledger_has_no_longer_is_left_out(tmp_path: Path, recorder: Recorder) -> None:
    parts, tables = tmp_path / "parts", tmp_path / "tables"
    for key in "ab":
        write_part(parts, key, encoded(recorder, key))
    merge_tables(parts, tables, {"a", "b"})
    write_part(parts, "c", encoded(recorder, "c"))
    merge_tables(parts, tables, {"a", "c"})
    assert set(pq.read_table(tables / "roles.parquet").column("key").to_pylist()) == {"a", "c"}


def test_a_table_of_another_version_is_not_mixed_with_new_ones(tmp_path: Path, recorder: Recorder) -> None:
    """The parts stay, so that nothing is lost."""
    parts, tables = tmp_path / "parts", tmp_path / "tables"
    write_part(parts, "a", encoded(recorder, "a"))
    merge_tables(parts, tables, {"a"})
    older = pq.read_table(tables / "packets.parquet")
    older = older.rename_columns([name.replace("_s", "_ms") for name in older.column_names])
    with table_writer(tables / "packets.parquet", older.schema) as out:
        out.write_table(older)
    write_part(parts, "b", encoded(recorder, "b"))
    with pytest.raises(
        OutputError, match=r"packets\.parquet: has the columns key, slot, time_ms.*move packets\.parquet"
    ):
        merge_tables(parts, tables, {"a", "b"})
    assert (parts / "b" / "packets.parquet").is_file()


def test_a_run_and_a_sweep_keep_the_same_columns_and_values(recorder: Recorder) -> None:
    files = encoded(recorder, "k")
    for name, table in recorder.tables.items():
        of_run, of_sweep = arrow_table(table, recorder.rows(name)), pq.read_table(io.BytesIO(files[name]))
        assert of_sweep.column_names == ["key", *of_run.column_names]
        assert of_sweep.drop_columns(["key"]).equals(of_run)


def test_what_is_missing_or_not_finite_stays_so() -> None:
    """A number that is large stays exact; a step of a unit holds beside a null, and in lists; joules are whole."""
    columns = (Column("depth_m", "float", "m"), Column("beams_m", "floats", "m"), Column("used_j", "float", "J"))
    echoes = Table("echoes", (TIME, *columns))
    rows = [(1.00001, None, [1.0031, 2.0], 1.6), (2.0, float("inf"), [], None), (3.0e9, -4.999, [-0.001], float("inf"))]
    kept = arrow_table(echoes, rows).to_pydict()
    assert kept["used_j"] == [2, None, None]
    assert kept["time_s"] == [1.0, 2.0, 3.0e9]
    assert kept["depth_m"] == [None, float("inf"), -5.0]
    assert kept["beams_m"] == [[1.0, 2.0], [], [0.0]]  # 0.0031 m is less than half of 1/128 m
    assert str(kept["beams_m"][2][0]) == "0.0"


@pytest.mark.parametrize("row", [(1.0,), (1.0, "A", 2), ("now", "A")])
def test_a_row_that_does_not_fit_is_refused_with_its_table(row: tuple[object, ...]) -> None:
    looks = Table("looks", (TIME, VEHICLE))
    with pytest.raises(OutputError, match=r"table looks: a row does not fit its columns time_s \(float\), vehicle"):
        arrow_table(looks, [(1.0, "A"), row])


def test_an_energy_beyond_all_integers_is_refused() -> None:
    uses = Table("uses", (TIME, Column("used_j", "float", "J")))
    with pytest.raises(OutputError, match=r"table uses: a row does not fit its columns time_s \(float\), used_j"):
        arrow_table(uses, [(1.0, 1.0e19)])
