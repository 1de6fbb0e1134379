"""Vehicles by themselves that send by a slot list, by one that changes, and in ALOHA: all come to know the same."""

import pytest
from test_nodes import plan_of, together

NAMES = ("ASV00", "AUV00", "AUV01", "AUV02")


@pytest.mark.parametrize(
    "setting",
    [
        {"communication__mac": '"aloha"'},
        {"communication__slots": '["AUV02","AUV00",["AUV01"],"AUV00",""]'},
        {"slots": '[{by="AUV00",at_s=50.0,order=["AUV02","AUV00","AUV01","ASV00"]}]'},
    ],
    ids=["aloha", "list", "new list"],
)
def test_all_come_to_know_the_same(setting: dict[str, str]) -> None:
    nodes, outcomes = together([plan_of(name, **setting) for name in NAMES])
    assert len({one.state_hash for one in outcomes}) == 1
    assert [one.open for one in outcomes] == [0, 0, 0, 0]
    assert min(one.packets_sent for one in outcomes) > 10
    if "slots" in setting:
        turns = [node.solo.vehicle.radio.manager.turns for node in nodes]
        assert [one.slots[0] % 4 for one in turns] == [3, 1, 2, 0]
