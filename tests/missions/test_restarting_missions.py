"""Missions whose vehicles begin anew or are cut off: they end, and nobody believes what is false."""

from collections import Counter
from functools import cache

import pytest

from missions.runs.assembly import assemble
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.radio import SUSPECTED

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


def test_where_all_is_known_at_once_so_it_is_to_who_begins_anew():
    """Under the bound it holds what the others hold as soon as it is back, though it has lost its memory."""
    fault = f"fault=[{{kind='restarts',vehicle='AUV01',at_s=300,until_s={BACK_S},memory='lost'}}]"
    fleet = assemble(resolved(load("mapping-rendezvous", [("--set", "strategy.name='oracle'"), ("--set", fault)])), 7)
    while fleet.now_s < BACK_S + 1.0:
        fleet.step()
    held = {one.name: {guid for guid, _ in one.beliefs.model.items()} for one in fleet.vehicles}
    fleet.close()
    assert len(held["AUV00"]) > 20
    assert held["AUV01"] == held["AUV00"]


def news_s(finished: Run, names: set[str], since_s: float) -> float:
    """Mean time from observation to arrival at each of the others."""
    rows = finished.recorder.knowledge
    told = {row[2]: row[0] for row in rows if row[4] == "observed" and row[1] in names and row[0] >= since_s}
    took = [row[0] - told[row[2]] for row in rows if row[4] == "received" and row[1] in names and row[2] in told]
    return sum(took) / len(took)


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["ack", "mps-ack-repeat"])
def test_one_that_is_cut_off_holds_up_the_others_by_less_than_a_fifth(policy: str):
    """Against a fleet of which one is not there from the first second; without parking they wait far longer."""
    names, common = {"AUV00", "AUV01", "ASV00"}, (f"communication.policy='{policy}'", "scenario.duration_s=1200")
    cut_off = "fault=[{kind='deaf',vehicle='AUV02',at_s=200},{kind='mute',vehicle='AUV02',at_s=200}]"
    of_three = "fault=[{kind='lost',vehicle='AUV02',at_s=1}]"
    usual, waiting, three = (
        news_s(mission(*common, *settings, seed=1), names, 200.0)
        for settings in ((cut_off,), (cut_off, "communication.parking=false"), (of_three,))
    )
    assert usual <= 1.2 * three
    assert waiting > usual


def test_no_position_is_suspected_in_a_sound_mission():
    finished = mission("scenario.duration_s=600")
    assert [row for row in finished.recorder.faults if row[2] == SUSPECTED] == []
    assert finished.recorder.links
    assert finished.n_false_beliefs == 0
