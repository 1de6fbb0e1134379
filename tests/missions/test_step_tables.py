"""Tables of a sample of runs say what the recorder said, to the unit they are kept in."""

import io
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from missions.errors import OutputError
from missions.runs.run import run
from missions.runs.step_tables import encoded, merge, write_part
from missions.scenarios import load
from remoras.recorder import TABLES, TIME, VEHICLE, Column, Recorder, Table


@pytest.fixture(scope="module")
def recorder() -> Recorder:
    return run(load("mapping-rendezvous", [("--set", "scenario.duration_s=60")])).recorder


def test_values_come_back_within_half_a_unit(recorder: Recorder) -> None:
    table = pq.read_table(io.BytesIO(encoded(recorder, "k")["trajectories"])).to_pylist()
    rows = sorted(recorder.trajectories, key=lambda row: (row[1], row[0]))
    assert len(table) == len(rows) > 200
    for packed, row in zip(table, rows, strict=True):
        assert packed["vehicle"] == row[1]
        assert packed["x_cm"] / 100 == pytest.approx(row[2], abs=0.00501)
        assert packed["heading_mrad"] / 1000 == pytest.approx(row[4], abs=0.000501)
        assert packed["time_ms"] / 1000 == pytest.approx(row[0], abs=0.000501)


def test_every_table_is_kept_with_its_units(recorder: Recorder) -> None:
    files = encoded(recorder, "k")
    assert set(files) == {table.name for table in TABLES} | {"coverage", "goal"}
    packets = pq.read_table(io.BytesIO(files["packets"]))
    assert packets.schema.field("time_ms").metadata[b"unit"] == b"ms"
    assert packets.column("lost_by").to_pylist() == [row[7] for row in recorder.packets]


def test_parts_merge_to_the_same_bytes_in_any_order(tmp_path: Path, recorder: Recorder) -> None:
    for at_once in (True, False):
        parts, tables = tmp_path / f"parts{at_once}", tmp_path / f"tables{at_once}"
        for key in ("b", "a", "c"):
            write_part(parts, key, encoded(recorder, key))
            if not at_once:
                merge(parts, tables, {"a", "b", "c"})
        if at_once:
            merge(parts, tables, {"a", "b", "c"})
        assert not parts.exists()
    one, two = ((tmp_path / f"tables{at_once}" / "packets.parquet").read_bytes() for at_once in (True, False))
    assert one == two
    merged = pq.ParquetFile(tmp_path / "tablesTrue" / "packets.parquet")
    assert [merged.metadata.row_group(n).column(0).statistics.min for n in range(3)] == ["a", "b", "c"]


def test_a_value_that_a_table_of_a_sweep_cannot_hold_is_refused_by_name() -> None:
    """2^31 - 1 thousandths are the most."""
    counts = Table("counts", (TIME, VEHICLE, Column("shells", "float", "1")))
    recorder = Recorder([counts])
    recorder.rows("counts").append((1.0, "A", 2_147_483.0))
    (kept,) = pq.read_table(io.BytesIO(encoded(recorder, "k")["counts"])).to_pylist()
    assert kept["shells_milli"] == 2_147_483_000
    recorder.rows("counts").append((2.0, "A", 3.0e6))
    with pytest.raises(OutputError, match=r"table counts: shells is up to 3e\+06 1, and tables of sweeps hold 2\.147"):
        encoded(recorder, "k")
