"""Tables of a sample of runs say what the recorder said, to the unit they are kept in."""

import io
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from missions.runs.run import run
from missions.runs.tables import encoded, merge, write_part
from missions.scenarios import load
from remoras.recorder import TABLES, Recorder


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
    assert set(files) == {table.name for table in TABLES} | {"coverage", "goal"}
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
                merge(parts, tables, {"a", "b", "c"})
        if at_once:
            merge(parts, tables, {"a", "b", "c"})
        assert not parts.exists()
    one, two = ((tmp_path / f"tables{at_once}" / "packets.parquet").read_bytes() for at_once in (True, False))
    assert one == two
    merged = pq.ParquetFile(tmp_path / "tablesTrue" / "packets.parquet")
    assert [merged.metadata.row_group(n).column(0).statistics.min for n in range(3)] == ["a", "b", "c"]
