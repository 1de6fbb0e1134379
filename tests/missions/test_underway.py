"""A run that somebody steps and watches is the run that ``run`` makes at once."""

from missions.runs.setup import resolved
from missions.runs.underway import Underway
from missions.scenarios import load

SHORT = [("--set", "scenario.duration_s=120"), ("--per", "channel.per=0.6")]


def started() -> Underway:
    return Underway(resolved(load("mapping-rendezvous", SHORT)), 3)


def test_a_packet_is_told_when_all_who_hear_it_have_heard_it() -> None:
    underway = started()
    n_held_back = 0
    while underway.is_running:
        underway.step()
        if not underway.is_running:
            break
        assert underway.summary()["is_underway"] is True
        packets = underway.table("packets").to_pylist()
        assert all(max([row["end_s"], *row["arrivals_s"]]) < underway.now_s for row in packets)
        sent = underway.recorder.rows("packets")
        assert 0 <= len(sent) - len(packets) <= 2  # a slot is 1.8 s, and the way to the farthest less than another
        n_held_back += len(sent) > len(packets)
    assert n_held_back > 0
    crashed = underway.summary("crashed")
    assert (crashed["is_underway"], crashed["reason"]) == (False, "crashed")
