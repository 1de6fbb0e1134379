"""Packets: who may send when, how long it takes, and who hears it.

docs/model/channel.md, "Slots", "Collisions" and "Channel", and docs/model/vehicle.md, "Faults".
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stress.verify.findings import CheckReport
from stress.verify.kinds import NOT_HEARING, kind_of
from stress.verify.record import PLACE_STEP_M, TIME_STEP_S, Record

CLOSE_S = 2.0 * TIME_STEP_S


def check_packets(record: Record, report: CheckReport) -> None:
    """Each packet keeps to its slot and to the size of its modem, and every other vehicle has one fate."""
    table = record["packets"]
    senders = set(record.vehicles)
    for time_s, sender in table.rows("time_s", "sender"):
        if sender not in senders:
            report.add("packets", "packets", time_s, sender, "a packet", "none: no vehicle has that name")
            return
    _check_slots(record, report)
    _check_sizes(record, report)
    _check_fates(record, report)


def sound_mps(record: Record) -> float | None:
    """Speed of sound; None where a channel of somebody else may have its own."""
    channel = record.of("channel")
    if channel["name"] != "acoustic":
        return float(record.of("world")["sound_speed_mps"]) if ":" not in channel["name"] else None
    t, s = channel.get("temperature_c"), channel.get("salinity_psu")
    if t is None or s is None:
        return None
    z = sum(float(vehicle["depth_m"]) for vehicle in record.vehicles.values()) / len(record.vehicles)
    return float(
        1448.96 + 4.591 * t - 5.304e-2 * t**2 + 2.374e-4 * t**3 + 1.340 * (s - 35.0) + 1.630e-2 * z
        + 1.675e-7 * z**2 - 1.025e-2 * t * (s - 35.0) - 7.139e-13 * t * z**3
    )  # fmt: skip


def slot_s(record: Record) -> float | None:
    """Length of a slot: the longest packet and the guard; None where the folder does not say."""
    communication, speed_mps = record.of("communication"), sound_mps(record)
    if record.packet_s is None or record.modem is None or speed_mps is None:
        return None
    longest_s = record.packet_s[0] + 8 * int(record.modem["payload_bytes"]) * record.packet_s[1]
    if communication.get("guard_s") is not None:
        return longest_s + float(communication["guard_s"])
    return longest_s + float(communication["range_m"]) / speed_mps


def _check_slots(record: Record, report: CheckReport) -> None:
    table, communication = record["packets"], record.of("communication")
    cells = record.cells
    is_listed = bool(communication.get("slots") or record.scenario.get("slots"))
    is_aloha, length_s = communication.get("mac", "tdma") == "aloha", slot_s(record)
    if is_listed:
        report.skip("slots", "by a list, vehicles say at sea who sends in which slot")
        return
    report.look("slots", len(table))
    is_timed = length_s is not None and record.has_exact_clocks
    if not is_timed:
        report.skip("times of slots", "clocks are off, or the manifest has no modem profile")
    n_turns, turns = 1, [0] * len(cells.tables)
    if len(cells.tables) > 1 and is_timed and length_s is not None:
        n_turns, turns = cells.turns(table.rows("slot", "time_s", "sender"), length_s, CLOSE_S)
        for one, other in cells.disturbing(turns):
            report.add("slots", "packets", None, "", f"cells {one} and {other} send at once", "turns of their own")
    taken: dict[tuple[int, int], str] = {}
    for slot, time_s, sender, end_s in table.rows("slot", "time_s", "sender", "end_s"):
        number = cells.number_of[sender]
        n, before = len(cells.members[number]), taken.get((number, slot))
        if before is not None:
            report.add("slots", "packets", time_s, sender, f"slot {slot}", f"none: {before} has sent in it")
        taken[number, slot] = sender
        owner = cells.members[number][slot % n]
        if owner != sender:
            report.add("slots", "packets", time_s, sender, f"slot {slot}", f"a slot of its own: this is {owner}'s")
        elif is_timed and length_s is not None:
            begin_s = slot // n * n * length_s if is_aloha else (slot * n_turns + turns[number]) * length_s
            latest_s = begin_s + n * length_s if is_aloha else begin_s
            if not begin_s - CLOSE_S <= time_s <= latest_s + CLOSE_S or (is_aloha and end_s > latest_s + CLOSE_S):
                follows = f"{begin_s:.4f} s" if not is_aloha else f"{begin_s:.4f} to {latest_s:.4f} s"
                report.add("slots", "packets", time_s, sender, f"slot {slot} at {time_s:.4f} s", follows)


def _check_sizes(record: Record, report: CheckReport) -> None:
    """Time on the air is one line over the size; counts are those of the lists."""
    table = record["packets"]
    report.look("sizes", 2 * len(table))
    size_bits = np.asarray(table["size_bits"])
    on_air_s = np.asarray(table["end_s"]) - np.asarray(table["time_s"])
    if record.packet_s is not None and record.modem is not None:
        due_s = record.packet_s[0] + record.packet_s[1] * size_bits
        most_bits = 8 * int(record.modem["payload_bytes"])
    else:
        report.skip("sizes of packets", "the manifest has no modem profile")
        due_s, most_bits = on_air_s, int(size_bits.max(initial=0))
    wrong = (np.abs(on_air_s - due_s) > CLOSE_S) | (size_bits > most_bits) | (size_bits <= 0)
    for at in np.flatnonzero(wrong):
        stated = f"{size_bits[at]} bits in {on_air_s[at]:.4f} s"
        follows = f"{due_s[at]:.4f} s, at most {most_bits} bits"
        report.add("sizes", "packets", table["time_s"][at], table["sender"][at], stated, follows)
    for time_s, sender, items, uids in table.rows("time_s", "sender", "items", "item_uids"):
        if items != len(uids):
            report.add("sizes", "packets", time_s, sender, f"{items} items", f"{len(uids)}, as many as are listed")


def _check_fates(record: Record, report: CheckReport) -> None:
    """All who are not away received a packet, lost it, or lost it to another; nobody else had any of these."""
    table, speed_mps = record["packets"], sound_mps(record)
    hidden = record.of("channel")["name"] == "acoustic"
    if speed_mps is None:
        report.skip("times of arrival", "the channel has a speed of sound of its own")
    reach_m = (
        math.inf if hidden or ":" in record.of("channel")["name"] else float(record.of("communication")["range_m"])
    )
    names = ("time_s", "sender", "receivers", "lost_by", "collided_at", "end_s", "arrivals_s")
    for time_s, sender, receivers, lost_by, collided_at, end_s, arrivals_s in table.rows(*names):
        report.look("receivers")
        told = [*receivers, *lost_by, *collided_at]
        before, after = (
            {name for name in record.cells.peers(sender) if not record.is_away(name, at_s)}
            for at_s in (time_s - CLOSE_S, time_s + CLOSE_S)  # who goes or comes just then may be either
        )
        due = sorted((before & after) - {sender})
        if sender not in before | after:
            report.add("receivers", "packets", time_s, sender, "a packet", "none: its sender is away")
        elif len(set(told)) < len(told) or not set(due) <= set(told) <= (before | after) - {sender}:
            report.add("receivers", "packets", time_s, sender, f"fates of {sorted(told)}", f"one of each of {due}")
        elif len(arrivals_s) != len(receivers):
            report.add("receivers", "packets", time_s, sender, f"{len(arrivals_s)} arrivals", f"{len(receivers)}")
        else:
            for name, arrival_s in zip(receivers, arrivals_s, strict=True):
                why = _why_not_heard(record, sender, name, time_s, arrival_s)
                if why:
                    report.add("receivers", "packets", time_s, sender, f"received by {name}", f"it was not: {why}")
                _check_arrival(record, report, (time_s, sender, end_s), name, arrival_s, speed_mps, reach_m)


def _why_not_heard(record: Record, sender: str, name: str, time_s: float, arrival_s: float) -> str:
    """Why a vehicle cannot have heard a packet; empty if it can."""
    for spell in record.spells:
        if spell.vehicle == sender and kind_of(spell.kind).is_mute and spell.from_s <= time_s < spell.until_s:
            return f"{sender} is mute"
        is_out = spell.vehicle == name and spell.kind in NOT_HEARING
        if is_out and spell.from_s <= arrival_s and time_s < spell.until_s:
            return f"{name} is not able to hear from its start to its end"
    for blackout in record.of("channel").get("blackout", []):
        is_about = blackout.get("vehicle") in (None, "", "all", sender, name)
        if sides := blackout.get("between"):
            of = [[at for at, side in enumerate(sides) if one in side] for one in (sender, name)]
            is_about = [] not in of and of[0] != of[1]
        if is_about and blackout["from_s"] + CLOSE_S <= time_s < blackout["until_s"] - CLOSE_S:
            return "there is a blackout"
    return ""


def _check_arrival(
    record: Record,
    report: CheckReport,
    sent: tuple[float, str, float],
    name: str,
    arrival_s: float,
    speed_mps: float | None,
    reach_m: float,
) -> None:
    """A packet arrives when its end has come as far as its receiver is, by their places at the tick before it."""
    time_s, sender, end_s = sent
    a, b = (record.tracks.get(record.cells.body(one)) for one in (sender, name))
    if speed_mps is None or a is None or b is None:
        return
    report.look("arrivals")
    data: dict[str, Any] = record.vehicles
    deeper_m = 0.0 if reach_m < math.inf else data[sender]["depth_m"] - data[name]["depth_m"]
    nearest: tuple[float, float] | None = None
    last = min(len(a.time_s), len(b.time_s)) - 1
    either_side = {int((time_s + shift_s) / record.tick_s) for shift_s in (-CLOSE_S / 2.0, CLOSE_S / 2.0)}
    for at in (max(0, min(tick, last)) for tick in either_side):  # at a tick, rounding hides which came first
        level_m = math.hypot(a.x_m.item(at) - b.x_m.item(at), a.y_m.item(at) - b.y_m.item(at))
        apart_m = math.hypot(level_m, deeper_m)
        off_s = abs(arrival_s - end_s - apart_m / speed_mps)
        nearest = min(nearest or (off_s, apart_m), (off_s, apart_m))
    off_s, apart_m = nearest or (0.0, 0.0)
    if apart_m > reach_m + PLACE_STEP_M * 2.0:
        report.add(
            "arrivals", "packets", time_s, sender, f"received by {name}", f"it was not: it is {apart_m:.1f} m off"
        )
    if off_s > CLOSE_S + PLACE_STEP_M * 2.0 / speed_mps:
        due_s = end_s + apart_m / speed_mps
        stated = f"{name} has heard it at {arrival_s:.4f} s"
        report.add("arrivals", "packets", time_s, sender, stated, f"{due_s:.4f} s, over {apart_m:.1f} m")
