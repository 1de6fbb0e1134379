"""What vehicles of a run knew, written and asked: against the tables, at any time, refused in one line."""

from pathlib import Path

import pyoxigraph
import pytest

from missions.errors import OutputError
from missions.runs.knowledge import knowledge, query, write_knowledge
from missions.runs.results import Results, write_results
from missions.runs.run import run
from missions.scenarios import load
from worldmodel.rdf.writing import RdfFormat

SETTINGS = (
    "scenario.duration_s=400",
    "channel.per=0.4",
    "communication.policy=mps-ack-repeat",
    "scenario.settle_s=2000",
)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("knowledge") / "run"
    write_results(run(load("mapping-rendezvous", [("--set", one) for one in SETTINGS]), 7), folder)
    return Results.read(folder)


def test_every_reception_is_of_a_packet_that_brought_it(results: Results) -> None:
    """Sender and time are those of a packet which the vehicle heard; who repeats is not the origin."""
    names = [one.name for one in results.scenario.vehicle]
    nodes = {one.vehicle: one.model.owner for one in (results.known(name, 100.0) for name in names)}
    packets = {
        (nodes[row["sender"]], at_s, receiver, uid)
        for row in results.table("packets").to_pylist()
        for receiver, at_s in zip(row["receivers"], row["arrivals_s"], strict=True)
        for uid in (*row["item_uids"], *row["status_uids"])
    }
    n_relayed = 0
    for name in names:
        known = results.known(name, 400.0)
        items = [one for one in known.receptions if one.block.is_item]
        assert {one.block for one in items} == {b for b in known.model.blocks() if b.origin != known.model.owner}
        for one in items:
            uid = f"{one.block.origin}-{one.block.sequence}"
            found = {p for p in packets if p[:3] == (one.sender, one.time_s, name) and p[3].partition(".")[0] == uid}
            assert found, one
            n_relayed += one.sender != one.block.origin
    assert n_relayed > 0


def test_time_and_vehicle_say_whose_knowledge_and_when(results: Results) -> None:
    asked = "SELECT (COUNT(?f) AS ?n) { ?f sit:ofAttribute rm:mappedCell }"
    counts = [query(results, asked, "AUV01", at_s)[1][0][0] for at_s in (0.0, 200.0, 400.0)]
    assert counts[0] == 0 < counts[1] < counts[2]
    columns, rows = query(results, asked)
    assert columns == ("vehicle", "n")
    assert [row[0] for row in rows] == list(knowledge(results))
    late = "SELECT ?f { ?r sit:received ?f ; sit:receivedAt ?at FILTER(?at > 200) }"
    assert query(results, late, "AUV01", 200.0)[1] == []
    assert query(results, late, "AUV01", 400.0)[1] != []


def test_after_settling_all_write_the_same_items(results: Results, tmp_path: Path) -> None:
    names, texts = list(knowledge(results)), []
    for name in names:
        counts = write_knowledge(results, RdfFormat.N_TRIPLES, tmp_path / f"{name}.nt", vehicle=name, items=True)
        assert list(counts) == [name]
        texts.append((tmp_path / f"{name}.nt").read_bytes())
    assert len(set(texts)) == 1
    before = []
    for name in names:
        write_knowledge(
            results, RdfFormat.N_TRIPLES, tmp_path / "x.nt", force=True, vehicle=name, at_s=300.0, items=True
        )
        before.append((tmp_path / "x.nt").read_bytes())
    assert len(set(before)) > 1  # while the mission goes on they do not


def test_a_file_of_all_vehicles_has_a_graph_for_each(results: Results, tmp_path: Path) -> None:
    write_knowledge(results, RdfFormat.TRIG, tmp_path / "all.trig", at_s=75.0)
    quads = list(pyoxigraph.parse((tmp_path / "all.trig").read_bytes(), format=pyoxigraph.RdfFormat.TRIG))
    graphs = {quad.graph_name for quad in quads} - {pyoxigraph.DefaultGraph()}
    labels = {quad.object.value for quad in quads if quad.subject in graphs}
    assert labels == set(knowledge(results))


def test_what_cannot_be_written_or_asked_is_one_line(results: Results, tmp_path: Path) -> None:
    (tmp_path / "there.ttl").write_text("mine", encoding="utf-8")
    for about, says in (
        ({"vehicle": "AUV1"}, "no vehicle 'AUV1'; there are .*; did you mean 'AUV01'"),
        ({"at_s": 1e6}, "at_s is 1000000.0; allowed: 0 to "),
        ({"at_s": -1.0}, "at_s is -1.0; allowed: 0 to "),
        ({"items": True}, "--items: the canonical graph of items is written as nt, and the format is ttl"),
    ):
        with pytest.raises(OutputError, match=says) as caught:
            write_knowledge(results, RdfFormat.TURTLE, tmp_path / "new.ttl", **about)  # type: ignore[arg-type]
        assert "\n" not in str(caught.value)
        assert not (tmp_path / "new.ttl").exists()
    with pytest.raises(OutputError, match=r"there.ttl: exists; name another with --out or add --force"):
        write_knowledge(results, RdfFormat.TURTLE, tmp_path / "there.ttl")
    assert (tmp_path / "there.ttl").read_text(encoding="utf-8") == "mine"
    with pytest.raises(OutputError, match="is a folder; name a file"):
        write_knowledge(results, RdfFormat.TURTLE, tmp_path)
    with pytest.raises(OutputError, match="no vehicle"):
        query(results, "ASK {}", "nobody")
