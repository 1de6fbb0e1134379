"""Missions whose vehicles begin anew or are cut off: they end, and nobody believes what is false."""

from collections import Counter
from functools import cache

import pytest

from missions.runs.run import Run, run
from missions.scenarios import load

BACK_S = 340.0


def mission(*settings: str, seed: int = 7) -> Run:
    return run(load("mapping-rendezvous", [("--set", one) for one in ("channel.per=0.4", *settings)]), seed)


@cache
def restarted(policy: str, memory: str) -> Run:
    fault = f"fault=[{{kind='restarts',vehicle='AUV01',at_s=300,until_s={BACK_S},memory='{memory}'}}]"
    return mission(f"communication.policy='{policy}'", fault)


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["ack", "mps-ack-repeat"])
@pytest.mark.parametrize("memory", ["lost", "kept"])
def test_the_next_observations_of_a_restarted_vehicle_reach_all(policy: str, memory: str):
    """Before there were epochs on the air, its next 20 observations were stored by nobody, and acknowledged by all."""
    finished = restarted(policy, memory)
    rows = finished.recorder.knowledge
    told = [row[2] for row in rows if row[1] == "AUV01" and row[4] == "observed" and row[0] >= BACK_S][:20]
    received = Counter(row[2] for row in rows if row[4] == "received" and row[1] != "AUV01" and row[2] in set(told))
    assert len(told) == 20
    assert [received[uid] for uid in told] == [3] * 20
    assert all(uid.startswith("2.e1-") for uid in told)
    assert finished.n_false_beliefs == 0
    assert finished.completed
    assert {row[1] for row in finished.recorder.peers if row[2:] == ("AUV01", "begins anew")} == {
        "AUV00",
        "AUV02",
        "ASV00",
    }


@pytest.mark.slow
def test_what_others_hold_of_its_earlier_life_comes_back_to_it():
    """What it told before, and what others had told it, it receives anew; what it had told nobody is gone."""
    rows = restarted("ack", "lost").recorder.knowledge
    before = {row[2] for row in rows if row[1] == "AUV01" and row[4] == "observed" and row[0] < 300.0}
    held = {row[2] for row in rows if row[4] == "received" and row[1] != "AUV01" and row[0] < 300.0} & before
    back = {row[2] for row in rows if row[1] == "AUV01" and row[4] == "received" and row[0] >= BACK_S} & before
    assert len(held) > 5
    assert held <= back
