"""What the page tells of packets that collided or were refused, of parked peers, and of estimates of links.

The tables are those of a run to which such rows were added by hand.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from browsing import Window
from chromium import opened, written
from replayed import LOSSY, asked, data_of, recorded

from missions.runs.results import Results

UNTIL_S = 300.0
COLLIDED = "collided_at"
PARKED_S, AGAIN_S = 100.0, 200.0
FATES = "([run]) => run.packets.map(({ to }) => to.map(({ v, why }) => [v, why || 'heard']))"
BETWEEN = """([run], [v, peer]) => [40, 99, 101, 160, 201].map((t) => [
  run.isParked(v, peer, t), run.linkAt(v, peer, t), run.isParked(peer, v, t),
])"""
SAID = """() => {
  const view = R.app.views[0], said = [], own = CanvasRenderingContext2D.prototype, fill = own.fillText;
  R.app.clock.seek(150);
  view.showTab("matrix");
  own.fillText = function (text, ...rest) { said.push(text); fill.call(this, text, ...rest); };
  view.map.paint();
  view.sheet.paint();
  own.fillText = fill;
  return said;
}"""
"""Texts that are drawn on the map and the matrix."""
ESTIMATES = [(50.0, "incoming", 0.25, 8), (50.0, "outgoing", 0.5, 4), (150.0, "incoming", 0.75, 16)]


def with_failures(results: Results) -> Results:
    """In every fifth slot all that was lost collided; the first who heard the others in every seventh refused them."""
    folder, packets = results.folder, results.table("packets")
    packets = packets.select([name for name in packets.column_names if name != COLLIDED])
    rows = packets.to_pylist()
    collided = [row["lost_by"] if row["slot"] % 5 == 0 else [] for row in rows]
    pq.write_table(
        packets.append_column(COLLIDED, pa.array(collided, pa.list_(pa.string()))), folder / "packets.parquet"
    )
    refused = [
        (row["arrivals_s"][0], row["receivers"][0], row["sender"], row["slot"] + 99, "older epoch")
        for row in rows[::7] if row["receivers"]
    ]  # fmt: skip
    _write(results, "refused", ("time_s", "vehicle", "sender", "slot", "reason"), refused)
    links = [(time_s, "AUV00", "AUV01", *more) for time_s, *more in ESTIMATES]
    _write(results, "links", ("time_s", "vehicle", "peer", "direction", "p_loss", "n"), links)
    own = [(PARKED_S, "AUV00", "AUV01", "parked"), (AGAIN_S, "AUV00", "AUV01", "heard again")]
    _write(results, "peers", ("time_s", "vehicle", "peer", "event"), own)
    return Results.read(folder)


def _write(results: Results, name: str, columns: tuple[str, ...], rows: list[tuple[Any, ...]]) -> None:
    table = pa.table([pa.array(column) for column in zip(*rows, strict=True)], names=list(columns))
    metadata = results.table("faults").schema.metadata
    pq.write_table(table.replace_schema_metadata(metadata), results.folder / f"{name}.parquet")


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return with_failures(
        recorded(tmp_path_factory.mktemp("failing") / "run", LOSSY, f"scenario.duration_s={UNTIL_S:g}")
    )


def test_every_packet_that_failed_tells_how(failing: Results, tmp_path: Path) -> None:
    told = asked([data_of(failing)], FATES, tmp_path)
    names = [vehicle.name for vehicle in failing.scenario.vehicle]
    refused = {(row["vehicle"], row["time_s"]) for row in failing.table("refused").to_pylist()}
    n = {"heard": 0, "lost": 0, "collided": 0, "refused": 0}
    for row, found in zip(failing.table("packets").to_pylist(), told, strict=True):
        so = {name: "collided" if name in row["collided_at"] else "lost" for name in row["lost_by"]}
        for name, time_s in zip(row["receivers"], row["arrivals_s"], strict=True):
            so[name] = "refused" if (name, time_s) in refused else "heard"
        assert {names[v]: why for v, why in found} == so
        for why in so.values():
            n[why] += 1
    assert min(n.values()) > 5


def test_peers_are_parked_and_links_estimated_as_the_tables_say(failing: Results, tmp_path: Path) -> None:
    names = [vehicle.name for vehicle in failing.scenario.vehicle]
    v, peer = names.index("AUV00"), names.index("AUV01")
    told = asked([data_of(failing)], BETWEEN, tmp_path, [v, peer])
    assert [parked for parked, _, _ in told] == [False, False, True, True, False]
    assert not any(other for _, _, other in told)
    early, late = {"p_loss": pytest.approx(0.25), "n": 8}, {"p_loss": pytest.approx(0.75), "n": 16}
    incoming = [link["incoming"] for _, link, _ in told]
    assert incoming == [None, early, early, late, late]
    assert told[-1][1]["outgoing"] == {"p_loss": pytest.approx(0.5), "n": 4}


@pytest.fixture
def failed(chrome: Any, failing: Results, tmp_path: Path) -> Iterator[Window]:
    with opened(chrome, written(tmp_path, failing)) as found:
        yield found


@pytest.mark.slow
def test_the_page_shows_them(failed: Window) -> None:
    """The legend names what there is, the matrix frames who is done without, the tip has the estimates."""
    ends = failed.ask("() => R.app.views[0].facts.ends")
    assert ends == ["collided", "refused"]
    texts = failed.ask(SAID)
    assert {"collided", "refused", "row: who knows; column: of whom; framed: does without it"} <= set(texts)
