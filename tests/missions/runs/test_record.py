"""The record of a run hangs together: packets, items, knowledge and decisions tell one story."""

import math
from itertools import groupby
from typing import Any

import pytest

from missions.runs.run import Run, run
from missions.scenarios import load

LOSS = ("--set", "channel.per=0.6")


@pytest.fixture(scope="module")
def finished() -> Run:
    return run(load("mapping-rendezvous", [LOSS]), 3)


def rows(of: Run, table: str) -> list[dict[str, Any]]:
    names = of.recorder.tables[table].column_names
    return [dict(zip(names, row, strict=True)) for row in of.recorder.rows(table)]


def test_packets_carry_items_and_status_of_the_record(finished: Run) -> None:
    kinds = {row["uid"]: row["kind"] for row in rows(finished, "items")}
    packets = rows(finished, "packets")
    assert {kinds[uid] for packet in packets for uid in packet["item_uids"]} == {"told"}
    assert {kinds[uid] for packet in packets for uid in packet["status_uids"]} == {"status"}
    assert all(packet["items"] == len(packet["item_uids"]) for packet in packets)
    nodes = {name: node for node, name in enumerate(finished.setup.database.names)}
    said = [(nodes[packet["sender"]], uid) for packet in packets for uid in packet["status_uids"]]
    assert len(said) == len(set(said)) > 1000  # nobody says a status twice
    own = [uid for sender, uid in said if uid.startswith(f"{sender}@")]
    assert len(own) > 0.98 * len(said)  # others relay it only by chance where links lose alike


def test_packets_arrive_after_their_end_as_sound_travels(finished: Run) -> None:
    """The guard of a slot is as long as sound needs over the whole range."""
    slot_s = finished.setup.schedule.slot_s
    for packet in rows(finished, "packets"):
        on_air_s = packet["end_s"] - packet["time_s"]
        assert on_air_s == pytest.approx(finished.setup.modem.packet_s(packet["size_bits"]))
        assert len(packet["arrivals_s"]) == len(packet["receivers"])
        assert all(packet["end_s"] <= at_s <= packet["time_s"] + slot_s + 1e-6 for at_s in packet["arrivals_s"])


def test_an_item_is_received_with_the_first_packet_that_brings_it(finished: Run) -> None:
    first_s: dict[tuple[str, str], float] = {}
    for packet in rows(finished, "packets"):
        for name, at_s in zip(packet["receivers"], packet["arrivals_s"], strict=True):
            for uid in packet["item_uids"]:
                first_s[name, uid] = min(at_s, first_s.get((name, uid), math.inf))
    knowledge = rows(finished, "knowledge")
    own = {(row["vehicle"], row["item"]) for row in knowledge if row["event"] == "observed"}
    end_s = finished.recorder.trajectories[-1][0]
    expected = {key: at_s for key, at_s in first_s.items() if key not in own and at_s <= end_s}
    received = {(row["vehicle"], row["item"]): row["time_s"] for row in knowledge if row["event"] == "received"}
    assert received == expected


def test_signals_are_the_satisfactions_of_their_slot(finished: Run) -> None:
    content = {
        (row["time_s"], row["vehicle"], f"{row['group']}.{row['role']}"): row["value"]
        for row in rows(finished, "satisfaction")
    }
    addressed = {
        (f"{group.name}.{role.name}", f"{group.name}.{to}" if to else "")
        for group in finished.scenario.group
        for role in group.role
        for to in role.influences or ("",)
    }
    n_signals = 0
    for packet in rows(finished, "packets"):
        lists = (packet["signal_roles"], packet["signal_addressed"], packet["signal_values"])
        for role, to, value in zip(*lists, strict=True):
            assert content[packet["time_s"], packet["sender"], role] == value
            assert (role, to) in addressed
            n_signals += 1
    assert n_signals > 1000


def test_a_decision_leads_back_to_the_signal_behind_it(finished: Run) -> None:
    """The call was heard before, addressed the role, and was at least as strong as what it moved the vehicle to."""
    packets = {packet["slot"]: packet for packet in rows(finished, "packets")}
    weight = finished.scenario.decision.weight_external
    moved = [row for row in rows(finished, "decisions") if row["external"] > 0.0]
    assert any(row["chosen"] for row in moved)
    for row in moved:
        packet = packets[row["slot"]]
        assert packet["sender"] == row["source"]
        arrival_s = dict(zip(packet["receivers"], packet["arrivals_s"], strict=True))[row["vehicle"]]
        assert arrival_s <= row["time_s"]
        calls = [
            -value
            for to, value in zip(packet["signal_addressed"], packet["signal_values"], strict=True)
            if to == f"{row['group']}.{row['role']}" and value < 0
        ]
        assert 0.0 < row["external"] <= weight * max(calls) / 128
    assert all((row["source"], row["slot"]) == ("", None) for row in rows(finished, "decisions") if not row["external"])


def test_a_choice_is_of_the_activities_performed(finished: Run) -> None:
    """Whenever activities change there is a decision, and its chosen sets hold them."""
    chosen: dict[tuple[float, str], set[str]] = {}
    for row in rows(finished, "decisions"):
        if row["chosen"]:
            chosen.setdefault((row["time_s"], row["vehicle"]), set()).update(row["activities"])
    for key, changed in groupby(rows(finished, "activities"), key=lambda row: (row["time_s"], row["vehicle"])):
        assert {row["name"] for row in changed} <= chosen[key]


def test_decisions_are_few(finished: Run) -> None:
    """Every 2 s something is decided; what is decided changes some dozen times in a mission."""
    times = {(row["time_s"], row["vehicle"]) for row in rows(finished, "decisions")}
    assert len(times) < 0.05 * len(finished.recorder.trajectories) / finished.scenario.decision.period_s


def test_without_the_weight_of_calls_no_decision_rests_on_one() -> None:
    deaf_to_calls = run(load("mapping-rendezvous", [LOSS, ("--set", "decision.weight_external=0")]), 3)
    assert {(row["external"], row["source"]) for row in rows(deaf_to_calls, "decisions")} == {(0.0, "")}


def test_depths_are_those_of_the_scenario_and_of_the_surface_without_power() -> None:
    weak = run(
        load("mapping-rendezvous", [("--set", "vehicle.AUV01.energy_j=3000"), ("--set", "scenario.duration_s=60")]), 1
    )
    depths_m = {vehicle.name: vehicle.depth_m for vehicle in weak.scenario.vehicle}
    empty_s = next(row["time_s"] for row in rows(weak, "faults") if row["kind"] == "energy")
    assert depths_m["AUV01"] > 0.0
    for row in rows(weak, "trajectories"):
        afloat = row["vehicle"] == "AUV01" and row["time_s"] >= empty_s
        assert row["depth_m"] == (0.0 if afloat else depths_m[row["vehicle"]])


def test_what_a_vehicle_keeps_to_itself_is_marked_so() -> None:
    """Where nobody speaks every fact is kept."""
    silent = run(
        load(
            "mapping-rendezvous",
            [("--strategy", "strategy.name='fixed-partition'"), ("--set", "scenario.duration_s=600")],
        ),
        1,
    )
    assert {row["kind"] for row in rows(silent, "items")} == {"kept"}
    assert silent.recorder.packets == []
