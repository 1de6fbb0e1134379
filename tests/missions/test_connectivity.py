"""Connectivity of runs: windows of packets, and metrics derived from them."""

from collections.abc import Mapping
from typing import Any

import pytest

import remoras
from missions.runs.fleet_metrics import CONNECTED, CUTTING, Window, windows

pytest.importorskip("networkx")
LOST = [{"vehicle": "AUV02", "kind": "lost", "at_s": 120.0}]


@pytest.fixture(scope="module")
def run() -> remoras.Run:
    return remoras.run("mapping-rendezvous", per=0.4, seed=3, set={"scenario.duration_s": 400.0, "fault": LOST})


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
