"""Checks of packets (slots, sizes, outcomes) and of the holders of items (docs/model/channel.md, exchange.md)."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from functools import partial
from typing import Any

import numpy as np

from missions.verification.record import CLOSE_S, NOT_HEARING, PLACE_STEP_M, CheckReport, Record


def check_packets(record: Record, report: CheckReport) -> None:
    """Check slots and sizes of packets, and one outcome per other vehicle."""
    _check_slots(record, report)
    _check_sizes(record, report)
    _check_fates(record, report)


def sound_mps(record: Record) -> float | None:
    """Return the sound speed (m/s); None for an external channel model."""
    channel = record.of("channel")
    if channel["name"] != "acoustic":
        return float(record.of("world")["sound_speed_mps"]) if ":" not in channel["name"] else None
    t, s = channel.get("temperature_c"), channel.get("salinity_psu")
    if t is None or s is None:
        return None
    # Mackenzie, Journal of the Acoustical Society of America 70 (1981), 807-812.
    z = sum(float(vehicle["depth_m"]) for vehicle in record.vehicles.values()) / len(record.vehicles)
    return float(
        1448.96 + 4.591 * t - 5.304e-2 * t**2 + 2.374e-4 * t**3 + 1.340 * (s - 35.0) + 1.630e-2 * z
        + 1.675e-7 * z**2 - 1.025e-2 * t * (s - 35.0) - 7.139e-13 * t * z**3
    )  # fmt: skip


def slot_s(record: Record) -> float | None:
    """Return the slot length (s): longest packet plus guard; None if unknown."""
    communication, speed_mps = record.of("communication"), sound_mps(record)
    if record.packet_s is None or record.modem is None or speed_mps is None:
        return None
    longest_s = record.packet_s[0] + 8 * int(record.modem["payload_bytes"]) * record.packet_s[1]
    return longest_s + float(communication["range_m"]) / speed_mps


def _check_slots(record: Record, report: CheckReport) -> None:
    owners, length_s = record.by_slot, slot_s(record)
    is_timed = length_s is not None and record.has_exact_clocks and record.access != "free"
    if not is_timed:
        report.skip("times of slots", "access is free, clocks are off, or the manifest has no modem profile")
    taken: dict[int, str] = {}
    until_s: dict[str, float] = {}
    for wrong, time_s, sender, slot, end_s in report.each("slots", record, "packets", "time_s sender slot end_s"):
        if slot in taken:
            wrong(f"slot {slot}", f"none: {taken[slot]} has sent in it")
        taken[slot] = sender
        owner = owners[slot % len(owners)]
        if owner != sender:
            wrong(f"slot {slot}", f"a slot of its own: this is {owner}'s")
        elif is_timed and length_s is not None and abs(time_s - slot * length_s) > CLOSE_S:
            wrong(f"slot {slot} at {time_s:.4f} s", f"{slot * length_s:.4f} s")
        elif time_s < until_s.get(sender, 0.0) - CLOSE_S:
            wrong(f"slot {slot} at {time_s:.4f} s", f"none: it sends until {until_s[sender]:.4f} s")
        until_s[sender] = end_s


def _check_sizes(record: Record, report: CheckReport) -> None:
    table = record["packets"]
    report.look("sizes", len(table))
    size_bits = np.asarray(table["size_bits"])
    on_air_s = np.asarray(table["end_s"]) - np.asarray(table["time_s"])
    if record.packet_s is not None and record.modem is not None:
        due_s = record.packet_s[0] + record.packet_s[1] * size_bits
        most_bits = 8 * int(record.modem["payload_bytes"])
    else:
        report.skip("sizes of packets", "the manifest has no modem profile")
        due_s, most_bits = on_air_s, int(size_bits.max(initial=0))
    wrong = (np.abs(on_air_s - due_s) > CLOSE_S) | (size_bits > most_bits) | (size_bits <= 0)
    for row in np.flatnonzero(wrong):
        stated = f"{size_bits[row]} bits in {on_air_s[row]:.4f} s"
        follows = f"{due_s[row]:.4f} s, at most {most_bits} bits"
        report.add("sizes", "packets", table["time_s"][row], table["sender"][row], stated, follows)
    for add, _, _, items, uids in report.each("sizes", record, "packets", "time_s sender items item_uids"):
        if items != len(uids):
            add(f"{items} items", f"{len(uids)}, as many as are listed")


def _check_fates(record: Record, report: CheckReport) -> None:
    speed_mps = sound_mps(record)
    hidden = record.of("channel")["name"] == "acoustic"
    if speed_mps is None:
        report.skip("times of arrival", "the channel has a speed of sound of its own")
    is_bounded = not hidden and ":" not in record.of("channel")["name"]
    reach_m = float(record.of("communication")["range_m"]) if is_bounded else math.inf
    rows = report.each("receivers", record, "packets", "time_s sender receivers lost_by collided_at end_s arrivals_s")
    for wrong, time_s, sender, receivers, lost_by, collided_at, end_s, arrivals_s in rows:
        fates = [*receivers, *lost_by, *collided_at]
        before, after = (
            {name for name in record.vehicles if not record.is_away(name, at_s)}
            for at_s in (time_s - CLOSE_S, time_s + CLOSE_S)  # a change at this time allows both states
        )
        due = sorted((before & after) - {sender})
        if sender not in before | after:
            wrong("a packet", "none: its sender is away")
        elif len(set(fates)) < len(fates) or not set(due) <= set(fates) <= (before | after) - {sender}:
            wrong(f"fates of {sorted(fates)}", f"one of each of {due}")
        elif len(arrivals_s) != len(receivers):
            wrong(f"{len(arrivals_s)} arrivals", f"{len(receivers)}")
        else:
            for name, arrival_s in zip(receivers, arrivals_s, strict=True):
                if why := _why_not_heard(record, sender, name, time_s, arrival_s):
                    wrong(f"received by {name}", f"it was not: {why}")
                _check_arrival(record, report, (time_s, sender, end_s), name, arrival_s, speed_mps, reach_m)


def _why_not_heard(record: Record, sender: str, name: str, time_s: float, arrival_s: float) -> str:
    """Return the reason why a vehicle cannot have received a packet; empty if it can."""
    for spell in record.spells:
        if spell.vehicle == sender and spell.kind == "mute" and spell.from_s <= time_s < spell.until_s:
            return f"{sender} is mute"
        is_out = spell.vehicle == name and spell.kind in NOT_HEARING
        if is_out and spell.from_s <= arrival_s and time_s < spell.until_s:
            return f"{name} is not able to hear from its start to its end"
    for blackout in record.of("channel").get("blackout", []):
        is_about = blackout.get("vehicle") in (None, "", "all", sender, name)
        if sides := blackout.get("between"):
            own = [[n for n, side in enumerate(sides) if vehicle in side] for vehicle in (sender, name)]
            is_about = [] not in own and own[0] != own[1]
        # At its rounded ends either outcome is right.
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
    time_s, sender, end_s = sent
    a, b = (record.tracks.get(v) for v in (sender, name))
    if speed_mps is None or a is None or b is None:
        return
    report.look("arrivals")
    data: dict[str, Any] = record.vehicles
    deeper_m = 0.0 if reach_m < math.inf else data[sender]["depth_m"] - data[name]["depth_m"]
    last = min(len(a.time_s), len(b.time_s)) - 1
    # At a tick, rounding hides the order.
    either_side = {int((time_s + shift_s) / record.tick_s) for shift_s in (-CLOSE_S / 2.0, CLOSE_S / 2.0)}
    near = [max(0, min(tick, last)) for tick in either_side]
    apart = [math.hypot(*(own.item(k) - to.item(k) for own, to in ((a.x_m, b.x_m), (a.y_m, b.y_m)))) for k in near]
    ways_m = [math.hypot(level_m, deeper_m) for level_m in apart]
    off_s, apart_m = min((abs(arrival_s - end_s - way_m / speed_mps), way_m) for way_m in ways_m)
    if apart_m > reach_m + PLACE_STEP_M * 2.0:
        follows = f"it was not: it is {apart_m:.1f} m off"
        report.add("arrivals", "packets", time_s, sender, f"received by {name}", follows)
    if off_s > CLOSE_S + PLACE_STEP_M * 2.0 / speed_mps:
        due_s = end_s + apart_m / speed_mps
        stated = f"{name} received it at {arrival_s:.4f} s"
        report.add("arrivals", "packets", time_s, sender, stated, f"{due_s:.4f} s, over {apart_m:.1f} m")


NAME = re.compile(r"(\d+)(?:\.e\d+)?[-@]")  # prefix of the name of an item or status: the number of its origin
THERE = frozenset({"present", "heard again", "begins anew", "slot conflict"})
"""Events of a present peer; all others end the wait for it."""
Heard = dict[tuple[str, str], list[float]]
NEVER = [math.inf]


def origin_of(record: Record, uid: str) -> str | None:
    """Return the origin of an item, by its name; None if unknown."""
    match = NAME.match(uid)
    number = -1 if match is None else int(match[1])
    return record.by_slot[number] if 0 <= number < len(record.by_slot) else None


def block_of(uid: str) -> str:
    """Return the name of the block that contains an item part: the name of its first part."""
    return uid.rpartition(".")[0] if "." in uid.partition("-")[2] else uid


def check_knowledge(record: Record, report: CheckReport) -> None:
    """Compare the tables of items, packets and knowledge."""
    recorded = _check_items(record, report)
    receptions = _heard(record)
    held = _check_events(record, report, recorded, receptions)
    _check_senders(record, report, recorded, held)
    _check_that_all_is_received(record, report, receptions, held)


def _check_items(record: Record, report: CheckReport) -> dict[str, tuple[float, str, str]]:
    recorded: dict[str, tuple[float, str, str]] = {}
    for wrong, recorded_s, origin, uid, kind in report.each("items", record, "items", "recorded_s origin uid kind"):
        known = recorded.setdefault(uid, (recorded_s, origin, kind))
        by_name = origin_of(record, uid)
        if by_name != origin:
            wrong(f"item {uid} of {origin}", f"of {by_name}, by its name")
        elif known[1:] != (origin, kind):
            wrong(f"item {uid} {kind}", f"{known[2]} of {known[1]}, as before")
    return recorded


def _heard(record: Record, column: str = "item_uids") -> Heard:
    receptions: Heard = defaultdict(list)
    for receivers, arrivals_s, uids in record.rows("packets", f"receivers arrivals_s {column}"):
        for vehicle, arrival_s in zip(receivers, arrivals_s, strict=False):
            for uid in uids:
                receptions[vehicle, uid].append(arrival_s)
    for times_s in receptions.values():
        times_s.sort()
    return receptions


def _check_events(
    record: Record, report: CheckReport, recorded: dict[str, tuple[float, str, str]], receptions: Heard
) -> dict[tuple[str, str], float]:
    held: dict[tuple[str, str], float] = {}
    aside: dict[tuple[str, str], float] = {}
    is_coded = record.of("communication").get("policy") == "adaptive"
    brought = _brought(record, receptions, is_coded)
    rows = report.each("knowledge", record, "knowledge", "time_s vehicle item origin event")
    for add, time_s, vehicle, uid, origin, event in rows:
        known, key = recorded.get(uid), (vehicle, uid)
        wrong = partial(add, f"{event} {uid}")
        if known is None:
            wrong("none: no vehicle recorded it")
            continue
        if origin != known[1]:
            add(f"{uid} of origin {origin}", f"origin {known[1]}, as it was recorded")
        if event == "observed":
            if vehicle != known[1] or abs(time_s - known[0]) > CLOSE_S:
                wrong(f"observed by {known[1]} at {known[0]:.4f} s")
            elif key in held:
                wrong("none: it has observed it before")
            held.setdefault(key, time_s)
        elif event in ("received", "set aside"):
            was_aside = event == "received" and key in aside
            is_heard = is_coded or min(receptions.get(key, NEVER)) <= time_s + CLOSE_S
            times_s = brought[vehicle, "" if is_coded else block_of(uid)]
            if not was_aside and not (is_heard and any(abs(at_s - time_s) <= CLOSE_S for at_s in times_s)):
                wrong("none: no packet with it arrived then")
            elif event == "received" and held.get(key, time_s) < time_s and not _let_go(record, *key, held, time_s):
                wrong(f"none: it has held it since {held[key]:g} s")
            (held if event == "received" else aside).setdefault(key, time_s)
        elif event == "acknowledged" and vehicle != known[1] and key not in held and key not in aside:
            wrong("none: it does not hold it itself")
    if record.of("strategy")["name"] == "oracle":
        report.skip("observed", "this bound sends nothing, so nothing is recorded as observed")
        return {}
    lacking = [uid for uid, (_, origin, kind) in recorded.items() if kind == "told" and (origin, uid) not in held]
    report.look("observed", len(recorded))
    for uid in lacking:
        recorded_s, origin, _ = recorded[uid]
        report.add("observed", "knowledge", recorded_s, origin, f"no row of {uid} observed", "one: it was recorded")
    _check_acknowledged(record, report, held, aside)
    return {key: min(held.get(key, aside.get(key, 0.0)), aside.get(key, held.get(key, 0.0))) for key in {*held, *aside}}


def _brought(record: Record, receptions: Heard, is_coded: bool) -> Heard:
    """Return the possible completion times of blocks; a coded packet may complete any."""
    completions: Heard = defaultdict(list)
    for (vehicle, uid), times_s in receptions.items():
        completions[vehicle, block_of(uid)] += times_s
    for _, heard_s in record.packet_of_slot.values() if is_coded else ():
        for name, at_s in heard_s.items():
            completions[name, ""].append(at_s)
    return completions


def _let_go(record: Record, vehicle: str, uid: str, held: dict[tuple[str, str], float], now_s: float) -> bool:
    """True if a vehicle lost its memory or discarded blocks since it held an item."""
    for spell in record.spells:
        lets_go = spell.forgets or spell.kind == "lacking" or "block" in spell.kind
        at_s = spell.until_s if spell.forgets else spell.from_s
        if spell.vehicle == vehicle and lets_go and held[vehicle, uid] <= at_s <= now_s:
            return True
    return False


def _out_of_count(record: Record) -> dict[tuple[str, str], list[tuple[float, bool]]]:
    """Return the times at which a vehicle stopped or resumed waiting for a peer."""
    changes: dict[tuple[str, str], list[tuple[float, bool]]] = defaultdict(list)
    for table in ("peers", "membership"):
        for time_s, vehicle, peer, event in record.rows(table, "time_s vehicle peer event"):
            changes[vehicle, peer].append((time_s, event not in THERE))
    for events in changes.values():
        events.sort()
    return changes


def _check_acknowledged(
    record: Record, report: CheckReport, held: dict[tuple[str, str], float], aside: dict[tuple[str, str], float]
) -> None:
    if not record.all_need_all:
        report.skip("acknowledged", "needs differ between vehicles: the tables do not have the times when each was met")
        return
    if record.anew:
        report.skip("acknowledged", "a vehicle restarted: its earlier items are not in the tables of its new epoch")
        return
    out = _out_of_count(record)
    for wrong, time_s, vehicle, uid, event in report.each(
        "acknowledged", record, "knowledge", "time_s vehicle item event", 0
    ):
        if event != "acknowledged":
            continue
        report.look("acknowledged")
        for peer in record.vehicles:
            since_s = held.get((peer, uid), aside.get((peer, uid)))
            if peer == vehicle or (since_s is not None and since_s <= time_s + CLOSE_S):
                continue
            # The item may have been settled at any time while the peer was not waited for.
            before = [is_out for at_s, is_out in out.get((vehicle, peer), []) if at_s <= time_s + CLOSE_S]
            if not any(before):
                wrong(f"takes all to hold {uid}", f"{peer} does not, and is waited for")


def _check_senders(
    record: Record, report: CheckReport, recorded: dict[str, tuple[float, str, str]], held: dict[tuple[str, str], float]
) -> None:
    receptions = _heard(record, "status_uids") if record.of("communication").get("relaying", True) else {}
    rows = report.each("senders", record, "packets", "time_s sender item_uids status_uids", 0)
    for wrong, time_s, sender, items, statuses in rows:
        report.look("senders", len(items) + len(statuses))
        for uid in items:
            since_s = held.get((sender, uid))
            if uid not in recorded:
                wrong(f"item {uid}", "none: no vehicle recorded it")
            elif since_s is None or since_s > time_s + CLOSE_S:
                wrong(f"item {uid}", "none: it does not hold it yet")
        for uid in statuses:
            if uid not in recorded or recorded[uid][0] > time_s + CLOSE_S:
                wrong(f"status {uid}", "none: no vehicle has recorded it")
            elif recorded[uid][1] != sender and not min(receptions.get((sender, uid), NEVER)) <= time_s + CLOSE_S:
                wrong(f"status {uid}", f"none: it is {recorded[uid][1]}'s")


def _check_that_all_is_received(
    record: Record, report: CheckReport, receptions: Heard, held: dict[tuple[str, str], float]
) -> None:
    refused: dict[str, list[float]] = defaultdict(list)
    for time_s, vehicle in record.rows("refused", "time_s vehicle"):
        refused[vehicle].append(time_s)
    set_aside = {vehicle for vehicle, kind in record.rows("faults", "vehicle kind") if "block" in kind}
    parts = {block_of(uid) for uid in record["items"]["uid"] if "@" not in uid and block_of(uid) != uid}
    end_s = record.end_s
    for (vehicle, uid), times_s in receptions.items():
        report.look("received")
        at_s = times_s[0]
        if (vehicle, uid) in held and held[vehicle, uid] <= at_s + CLOSE_S:
            continue
        is_excused = at_s > end_s - CLOSE_S or vehicle in set_aside or uid in parts or uid.rpartition(".")[0] in parts
        # its battery may have run out during the propagation
        is_excused |= bool(record.drained(vehicle, at_s))
        if is_excused or any(abs(time_s - at_s) <= CLOSE_S for time_s in refused[vehicle]):
            continue
        report.add("received", "knowledge", at_s, vehicle, f"no row of {uid} received", "one: a packet with it arrived")
