"""Sparsely connected fleets: the value of second-hand reports and relaying."""

from itertools import combinations

import pytest
from recorded import flown

from missions.files import toml_value
from missions.runs.run import Run
from remoras.picture import Peers

FLEET = ("ASV00", "AUV00", "AUV01", "AUV02")
LINE = {("ASV00", "AUV00"), ("AUV00", "AUV01"), ("AUV01", "AUV02")}
"""Pairs that hear each other seven times in ten; the others never."""


def sailed(*settings: str) -> Run:
    """A mission that may take 3000 s."""
    cut = [pair for pair in combinations(FLEET, 2) if pair not in LINE]
    links = [{"sender": a, "receiver": b, "per": 1.0} for pair in cut for a, b in (pair, pair[::-1])]
    given = ("channel.name=matrix", "channel.per=0.3", f"channel.link={toml_value(links)}", "scenario.duration_s=3000")
    return flown("mapping-rendezvous", *given, *settings)


def taken_for_absent(finished: Run) -> int:
    return sum(row[3] == "absent" for row in finished.recorder.membership)


def test_a_vehicle_received_by_others_is_not_declared_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    together = sailed()
    assert together.completed
    assert taken_for_absent(together) == 0
    monkeypatch.setattr(Peers, "word_s", property(lambda peers: peers.heard_s))
    assert taken_for_absent(sailed()) >= 6


def test_without_relaying_the_mission_is_never_complete() -> None:
    assert not sailed("communication.relaying=false").completed
