"""Graphs of runs: equal to the tables, and metrics derived from them."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

import pytest

import remoras
from missions.errors import OutputError
from missions.runs.fleet_metrics import CONNECTED, CUTTING, Window, windows

pytest.importorskip("networkx")
LOST = [{"vehicle": "AUV02", "kind": "lost", "at_s": 120.0}]


@pytest.fixture(scope="module")
def run() -> remoras.Run:
    return remoras.run("mapping-rendezvous", per=0.4, seed=3, set={"scenario.duration_s": 400.0, "fault": LOST})


def test_organisation_graph_has_the_roles_each_vehicle_holds(run: remoras.Run) -> None:
    for at_s in (0.0, 100.0, 400.0):
        graph = run.graph("organisation", at_s=at_s)
        for vehicle in ("ASV00", "AUV00", "AUV01", "AUV02"):
            known = run.known(vehicle, at_s=at_s).organisation.roles_of(vehicle)
            assert set(graph[vehicle]) == {f"{of.group}.{of.role}" for of in known}, (vehicle, at_s)
    held = graph["ASV00"]["Coordination.MissionAdministrator"]
    assert held["kind"] == "plays"
    assert set(graph["Operational.Performer"]) == {"Operational"}
    assert set(graph["Operational"]) == {"Coordination"}
    assert graph.graph["units"] == {"since_s": "s"}


def test_organisation_graph_of_a_viewer_equals_its_knowledge(run: remoras.Run) -> None:
    views = {}
    for viewer in ("ASV00", "AUV01"):
        for at_s in (5.0, 60.0, 390.0):
            known = run.known(viewer, at_s=at_s)
            graph = run.graph("organisation", at_s=at_s, viewer=viewer)
            played = {(v, r) for v, r, edge in graph.edges(data=True) if edge["kind"] == "plays"}
            names = [name for name, data in graph.nodes(data=True) if data["kind"] == "vehicle"]
            assert played == {(v, f"{of.group}.{of.role}") for v in names for of in known.organisation.roles_of(v)}
            absent = {name for name, data in graph.nodes(data=True) if data.get("is_absent")}
            assert absent == known.absent
            views[viewer, at_s] = played, absent
    assert any(absent for _, absent in views.values())


def test_reception_graph_counts_packets_of_the_window(run: remoras.Run) -> None:
    rows = run.table("packets")
    for from_s, until_s in ((0.0, 400.0), (100.0, 150.0)):
        inside = rows[(rows.time_s >= from_s) & (rows.time_s < until_s)]
        counts: Counter[tuple[str, str, str]] = Counter()
        bits: Counter[tuple[str, str]] = Counter()
        for row in inside.itertuples():
            for what in ("receivers", "lost_by", "collided_at"):
                counts.update((row.sender, other, what) for other in getattr(row, what))
            bits.update({(row.sender, other): row.size_bits for other in row.receivers})
        graph = run.graph("heard", from_s=from_s, until_s=None if until_s == 400.0 else until_s)
        links = {(one, two) for one, two, _ in counts}
        assert set(graph.edges) == links
        for one, two in links:
            heard, lost, collided = (counts[one, two, what] for what in ("receivers", "lost_by", "collided_at"))
            assert graph.edges[one, two] == {
                "kind": "heard", "n_heard": heard, "n_lost": lost, "n_collided": collided, "heard_bits": bits[one, two],
                "heard_fraction": heard / (heard + lost + collided),
            }  # fmt: skip
        assert {name: data["n_sent"] for name, data in graph.nodes(data=True)} == {
            name: int((inside.sender == name).sum()) for name in graph
        }
    assert graph.graph["units"] == {"heard_bits": "bit", "heard_fraction": "1", "sent_bits": "bit"}


def test_unknown_graph_or_argument_is_refused_in_one_line(run: remoras.Run) -> None:
    for asked, told in (
        ({"name": "herd"}, "graph 'herd': allowed are .*did you mean 'heard'"),
        ({"name": "heard", "at_s": 5.0}, "takes from_s and until_s; not at_s"),
        ({"name": "jobs", "viewer": "AUV00"}, "takes nothing else; not viewer"),
        ({"name": "plan", "viewer": "AUV09"}, "viewer 'AUV09': there are ASV00"),
        ({"name": "organisation", "at_s": 1e9}, "at_s is .*allowed: 0 to 400"),
        ({"name": "heard", "from_s": 50.0, "until_s": 50.0}, "from_s is 50; allowed: below until_s"),
        ({"name": "organisation", "at_s": True}, "at_s is True"),
    ):
        with pytest.raises(OutputError, match=told):
            run.graph(**asked)  # type: ignore[arg-type]


def packet(slot: int, sender: str, *receivers: str) -> Mapping[str, Any]:
    return {"slot": slot, "time_s": 3.0 * slot, "sender": sender, "receivers": list(receivers)}


LINE = [packet(0, "A", "B"), packet(1, "B", "A", "C"), packet(2, "C", "B")]
"""A - B - C in a line: all depends on B."""


def test_vehicle_whose_loss_disconnects_the_fleet_is_named() -> None:
    closed, one_way = [*LINE, packet(3, "A", "C"), packet(5, "C", "A")], LINE[:2]
    assert list(windows("ABC", LINE)) == [Window(0.0, True, 1, frozenset("B"))]
    assert list(windows("ABC", closed)) == [Window(0.0, True, 1, frozenset())]
    assert list(windows("ABC", one_way)) == [Window(0.0, False, 2, frozenset())]


def test_lost_vehicle_is_disconnected_and_a_lossless_fleet_connected(run: remoras.Run) -> None:
    calm = remoras.run("mapping-rendezvous", per=0.0, set={"scenario.duration_s": 400.0})
    assert (calm.metric(CONNECTED), calm.metric(CUTTING)) == (1.0, 0.0)
    struck = run.metric("missions.runs.fleet_metrics:CONNECTED")
    assert struck is not None
    assert 0.1 < struck < 0.4  # AUV02 is lost after 120 of 400 s, so that it is at most connected before
    assert (run.metric(CUTTING) or 0.0) > 0.0
