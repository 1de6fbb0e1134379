"""A run that somebody steps and watches is the run that ``run`` makes at once."""

from missions.runs.results import MemoryResults
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.runs.underway import Underway
from missions.scenarios import load

SHORT = [("--set", "scenario.duration_s=120"), ("--per", "channel.per=0.6")]


def started() -> Underway:
    return Underway(resolved(load("mapping-rendezvous", SHORT)), 3)


def test_a_stepped_run_gives_the_results_of_run() -> None:
    underway = started()
    n_steps = 0
    while underway.is_running:
        underway.step()
        n_steps += 1
    assert n_steps == 121  # a tick each second, both ends included
    stepped, whole = MemoryResults(underway.finish()), MemoryResults(run(load("mapping-rendezvous", SHORT), 3))
    assert stepped.tables == whole.tables
    assert all(stepped.table(name).equals(whole.table(name)) for name in whole.tables)
    assert stepped.summary == whole.summary
    underway.close()  # a second time does no harm


def test_a_packet_is_told_when_all_who_hear_it_have_heard_it() -> None:
    underway = started()
    n_held_back = 0
    while underway.is_running:
        underway.step()
        if not underway.is_running:
            break
        packets = underway.table("packets").to_pylist()
        assert all(max([row["end_s"], *row["arrivals_s"]]) < underway.now_s for row in packets)
        sent = underway.recorder.rows("packets")
        assert 0 <= len(sent) - len(packets) <= 2  # a slot is 1.8 s, and the way to the farthest less than another
        n_held_back += len(sent) > len(packets)
    assert n_held_back > 0


def test_a_run_that_is_underway_says_so() -> None:
    underway = started()
    underway.step()
    assert underway.summary()["is_underway"] is True
    assert underway.summary("crashed")["is_underway"] is False
    assert underway.summary("crashed")["reason"] == "crashed"
