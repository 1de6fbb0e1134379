"""Missions by slot lists and in ALOHA: lists spread by the exchange itself, and no belief is false."""

from collections.abc import Sequence

import pytest

from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.scenarios import load

ORDER = '["AUV02", "AUV01", "ASV00", "AUV00"]'
SHORT = "scenario.duration_s=800.0"
PLACES = {"AUV02": 0, "AUV01": 1, "ASV00": 2, "AUV00": 3}


def flown(settings: Sequence[str], per: float = 0.3, seed: int = 4) -> Run:
    return run_scenario(load("mapping-rendezvous", [("--set", one) for one in (*settings, f"channel.per={per}")]), seed)


def places(run: Run, from_s: float, until_s: float, n_slots: int = 4) -> dict[str, set[int]]:
    """In which slots of a frame each vehicle spoke meanwhile."""
    found: dict[str, set[int]] = {}
    for slot, time_s, sender, *_ in run.recorder.packets:
        if from_s <= time_s < until_s:
            found.setdefault(sender, set()).add(slot % n_slots)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["ack", "mps-ack-repeat"])
def test_a_list_spreads_and_all_come_to_use_it(policy: str) -> None:
    """By AUV02, whose new slot was that of another: until all have heard of it, packets meet and slots are others'."""
    run = flown([f'slots=[{{by="AUV02", at_s=300.0, order={ORDER}}}]', f"communication.policy={policy}", SHORT])
    assert run.n_false_beliefs == 0
    before, after = places(run, 0.0, 300.0), places(run, 600.0, 800.0)
    assert sorted(map(sorted, before.values())) == [[0], [1], [2], [3]]
    assert before != after == {name: {place} for name, place in PLACES.items()}
    collided = [row[1] for row in run.recorder.packets if row[-1]]
    assert collided
    assert min(collided) >= 300.0
    assert max(collided) < 600.0
    assert any(kind == "slot of others" for _, _, kind, _ in run.recorder.faults)


def test_who_joins_without_a_slot_finds_a_free_one_and_is_heard_by_all() -> None:
    run = flown(
        [
            'communication.slots=["AUV00", "AUV01", "", "ASV00", ""]',
            'fault=[{kind="joins", vehicle="AUV02", at_s=300.0}]',
            "scenario.duration_s=600.0",
        ]
    )
    spoken = [row for row in run.recorder.packets if row[2] == "AUV02"]
    frame_s = run.setup.schedule.frame_s
    assert 300.0 + frame_s <= spoken[0][1] <= 300.0 + 3.0 * frame_s
    assert places(run, 0.0, 600.0, 5)["AUV02"] == {2}
    assert {name for row in spoken for name in row[6]} == {"AUV00", "AUV01", "ASV00"}
    assert run.n_false_beliefs == 0


def test_in_aloha_packets_meet_and_yet_all_come_to_know_the_same() -> None:
    run = flown(['communication.mac="aloha"', SHORT, "scenario.settle_s=600.0"])
    assert run.n_false_beliefs == 0
    assert run.settled is not None
    assert run.settled.complete
    assert run.settled.time_s > 0.0
    assert sum(len(row[-1]) > 0 for row in run.recorder.packets) > 50


def test_the_list_in_the_order_of_the_fleet_sends_as_the_default_does() -> None:
    """Packets are a byte longer at most and acknowledge whole frames; who sends when is the same."""
    short = ["scenario.duration_s=200.0"]
    usual = flown(short)
    names = list(usual.setup.database.names)
    listed = flown([*short, f"communication.slots={names}".replace("'", '"')])
    assert [row[:3] for row in listed.recorder.packets] == [row[:3] for row in usual.recorder.packets]


@pytest.mark.parametrize(
    "setting", ['communication.mac="aloha"', 'communication.slots=["AUV02","AUV00","AUV01","AUV00","ASV00"]']
)
def test_clocks_that_are_off_and_restarts_do_no_harm(setting: str) -> None:
    run = flown(
        [
            setting,
            "communication.clocks={offset_s=0.2, drift_ppm=50.0, apart_s=0.5}",
            'fault=[{kind="restarts", vehicle="AUV01", at_s=100.0, until_s=160.0, memory="kept"}]',
            "scenario.duration_s=400.0",
        ]
    )
    assert run.n_false_beliefs == 0
    assert {row[2] for row in run.recorder.packets if row[1] > 170.0} == set(run.setup.database.names)
