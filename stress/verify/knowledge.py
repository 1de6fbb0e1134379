"""Who knew what: what was observed was recorded, what was received was heard, who told it held it.

docs/howto/results.md has the names of items; docs/model/exchange.md,
"What is said", "Who needs what" and "Absence", the rules.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator

from stress.verify.findings import CheckReport
from stress.verify.kinds import forgets, kind_of
from stress.verify.record import TIME_STEP_S, Record

CLOSE_S = 2.0 * TIME_STEP_S
NAME = re.compile(r"(\d+)(?:\.e\d+)?[-@]")
"""How a name of an item or a status begins: with the number of its origin."""
THERE = frozenset({"present", "heard again", "begins anew", "slot conflict"})
"""Events of a peer that is there; all others say why it is not waited for."""
Heard = dict[tuple[str, str], list[float]]
NEVER = [math.inf]


def origin_of(record: Record, uid: str) -> str | None:
    """The vehicle that an item is of, by its name; None if the name is of none."""
    found = NAME.match(uid)
    number = -1 if found is None else int(found[1])
    return record.by_slot[number] if 0 <= number < len(record.by_slot) else None


def check_knowledge(record: Record, report: CheckReport) -> None:
    """Compare the tables of items, packets and knowledge."""
    recorded = _check_items(record, report)
    heard = _heard(record)
    held = _check_events(record, report, recorded, heard)
    _check_senders(record, report, recorded, held)
    _check_that_all_is_received(record, report, heard, held)


def _check_items(record: Record, report: CheckReport) -> dict[str, tuple[float, str, str]]:
    """When, by whom and to what end each item was recorded, by its name."""
    found: dict[str, tuple[float, str, str]] = {}
    table = record["items"]
    for uid, origin, time_s, recorded_s, kind in table.rows("uid", "origin", "time_s", "recorded_s", "kind"):
        report.look("items")
        known = found.setdefault(uid, (recorded_s, origin, kind))
        by_name = origin_of(record, uid)
        if by_name != origin:
            report.add("items", "items", recorded_s, origin, f"item {uid} of {origin}", f"of {by_name}, by its name")
        elif known[1:] != (origin, kind):
            report.add(
                "items", "items", recorded_s, origin, f"item {uid} {kind}", f"{known[2]} of {known[1]}, as before"
            )
        elif record.has_exact_clocks and time_s > recorded_s + 1.0:
            report.add(
                "items", "items", recorded_s, origin, f"{uid} observed at {time_s:g} s", "no later than recorded"
            )
    return found


def _heard(record: Record, column: str = "item_uids") -> Heard:
    """When each vehicle heard each item, or what else a column of packets names, by (vehicle, name), in time order."""
    found: Heard = defaultdict(list)
    names = ("receivers", "arrivals_s", column)
    for receivers, arrivals_s, uids in record["packets"].rows(*names):
        for vehicle, arrival_s in zip(receivers, arrivals_s, strict=False):
            for uid in uids:
                found[vehicle, uid].append(arrival_s)
    for times_s in found.values():
        times_s.sort()
    return found


def _check_events(
    record: Record, report: CheckReport, recorded: dict[str, tuple[float, str, str]], heard: Heard
) -> dict[tuple[str, str], float]:
    """From when on each vehicle held each item, by (vehicle, item)."""
    held: dict[tuple[str, str], float] = {}
    aside: dict[tuple[str, str], float] = {}
    table, brought = record["knowledge"], _brought(record)
    for time_s, vehicle, uid, origin, event in table.rows("time_s", "vehicle", "item", "origin", "event"):
        report.look("knowledge")
        known, key = recorded.get(uid), (vehicle, uid)

        def wrong(follows: str, stated: str = f"{event} {uid}", at: tuple[float, str] = (time_s, vehicle)) -> None:
            report.add("knowledge", "knowledge", *at, stated, follows)

        if known is None:
            wrong("none: nobody recorded it")
            continue
        if origin != known[1]:
            wrong(f"origin {known[1]}, as it was recorded", f"{uid} of origin {origin}")
        if event == "observed":
            if vehicle != known[1] or abs(time_s - known[0]) > CLOSE_S:
                wrong(f"observed by {known[1]} at {known[0]:.4f} s")
            elif key in held:
                wrong("none: it has observed it before")
            held.setdefault(key, time_s)
        elif event in ("received", "set aside"):
            times_s = heard.get(key, [])
            was_aside = event == "received" and key in aside
            is_heard = was_aside or any(abs(time - time_s) <= CLOSE_S for time in times_s)
            if not is_heard and brought.get(key) != time_s:
                wrong("none: no packet with it arrived then")
            elif event == "received" and held.get(key, time_s) < time_s and not _let_go(record, *key, held, time_s):
                wrong(f"none: it has held it since {held[key]:g} s")
            (held if event == "received" else aside).setdefault(key, time_s)
        elif event == "acknowledged" and vehicle != known[1] and key not in held and key not in aside:
            wrong("none: it does not hold it itself")
    if record.of("strategy")["name"] == "oracle":
        report.skip("observed", "in this bound nothing is told, so nothing is noted as observed")
        return {}
    lacking = [uid for uid, (_, origin, kind) in recorded.items() if kind == "told" and (origin, uid) not in held]
    report.look("observed", len(recorded))
    for uid in lacking:
        recorded_s, origin, _ = recorded[uid]
        report.add("observed", "knowledge", recorded_s, origin, f"no row of {uid} observed", "one: it was recorded")
    _check_acknowledged(record, report, held, aside)
    return {key: min(held.get(key, aside.get(key, 0.0)), aside.get(key, held.get(key, 0.0))) for key in {*held, *aside}}


def _brought(record: Record) -> dict[tuple[str, str], float]:
    """When each gateway took an item in at its other address, by (address, item), of what passes from cell to cell."""
    cells = record.cells
    if not cells.first_of:
        return {}
    of_item = dict(record["items"].rows("uid", "attribute"))
    names = ("time_s", "vehicle", "item", "origin", "event")
    return {
        (cells.other_of[vehicle], uid): time_s
        for time_s, vehicle, uid, origin, event in record["knowledge"].rows(*names)
        if event == "received"
        and vehicle in cells.other_of
        and cells.passes(origin, cells.other_of[vehicle], of_item.get(uid, ""))
    }


def _let_go(record: Record, vehicle: str, uid: str, held: dict[tuple[str, str], float], now_s: float) -> bool:
    """True if a vehicle has lost its memory since it held an item, or has given up blocks for what they rest on."""
    for spell in record.spells:
        if spell.vehicle == vehicle:
            is_blank = forgets(spell.kind, spell.detail)
            at_s = spell.until_s if is_blank else spell.from_s
            if (is_blank or spell.kind == "lacking" or "block" in spell.kind) and held[vehicle, uid] <= at_s <= now_s:
                return True
    return False


def _out_of_count(record: Record) -> dict[tuple[str, str], list[tuple[float, bool]]]:
    """When a vehicle began and ceased not to wait for a peer: which events say."""
    found: dict[tuple[str, str], list[tuple[float, bool]]] = defaultdict(list)
    for table in ("peers", "membership"):
        for time_s, vehicle, peer, event in record[table].rows("time_s", "vehicle", "peer", "event"):
            found[vehicle, peer].append((time_s, event not in THERE))
    for events in found.values():
        events.sort()
    return found


def _check_acknowledged(
    record: Record, report: CheckReport, held: dict[tuple[str, str], float], aside: dict[tuple[str, str], float]
) -> None:
    """What a vehicle takes all others to hold they hold, but for those that it does not wait for."""
    if not record.all_need_all:
        report.skip("acknowledged", "needs differ between vehicles: the tables do not say whose were met when")
        return
    if any(kind_of(spell.kind).begins_anew for spell in record.spells):
        report.skip("acknowledged", "a vehicle began anew: what it held before is not in the tables of its new life")
        return
    out = _out_of_count(record)
    table = record["knowledge"]
    for time_s, vehicle, uid, event in table.rows("time_s", "vehicle", "item", "event"):
        if event != "acknowledged":
            continue
        report.look("acknowledged")
        for peer in record.cells.peers(vehicle):
            since_s = held.get((peer, uid), aside.get((peer, uid)))
            if peer == vehicle or (since_s is not None and since_s <= time_s + CLOSE_S):
                continue
            before = [is_out for at_s, is_out in out.get((vehicle, peer), []) if at_s <= time_s + CLOSE_S]
            if not any(before):
                stated = f"takes all to hold {uid}"
                report.add("acknowledged", "knowledge", time_s, vehicle, stated, f"{peer} does not, and is waited for")


def _check_senders(
    record: Record, report: CheckReport, recorded: dict[str, tuple[float, str, str]], held: dict[tuple[str, str], float]
) -> None:
    """Who sends an item holds it; a status is its sender's own, or its sender has heard it."""
    heard = _heard(record, "status_uids") if record.of("communication").get("relaying", True) else {}
    names = ("time_s", "sender", "item_uids", "status_uids")
    for time_s, sender, items, statuses in record["packets"].rows(*names):
        report.look("senders", len(items) + len(statuses))
        for uid in items:
            since_s = held.get((sender, uid))
            if uid not in recorded:
                report.add("senders", "packets", time_s, sender, f"item {uid}", "none: nobody recorded it")
            elif since_s is None or since_s > time_s + CLOSE_S:
                report.add("senders", "packets", time_s, sender, f"item {uid}", "none: it does not hold it yet")
        for uid in statuses:
            if uid not in recorded or recorded[uid][0] > time_s + CLOSE_S:
                report.add("senders", "packets", time_s, sender, f"status {uid}", "none: nobody has recorded it")
            elif recorded[uid][1] != sender and not min(heard.get((sender, uid), NEVER)) <= time_s + CLOSE_S:
                report.add("senders", "packets", time_s, sender, f"status {uid}", f"none: it is {recorded[uid][1]}'s")


def _check_that_all_is_received(
    record: Record, report: CheckReport, heard: Heard, held: dict[tuple[str, str], float]
) -> None:
    """What a vehicle heard first it holds from then on, unless the packet was refused or its block was not whole."""
    refused: dict[str, list[float]] = defaultdict(list)
    for time_s, vehicle in record["refused"].rows("time_s", "vehicle"):
        refused[vehicle].append(time_s)
    set_aside = {vehicle for vehicle, kind in record["faults"].rows("vehicle", "kind") if "block" in kind}
    parts = {uid.rpartition(".")[0] for uid in _parts(record)}
    end_s = record.end_s
    for (vehicle, uid), times_s in heard.items():
        report.look("received")
        at_s = times_s[0]
        if (vehicle, uid) in held and held[vehicle, uid] <= at_s + CLOSE_S:
            continue
        is_excused = at_s > end_s - CLOSE_S or vehicle in set_aside or uid in parts or uid.rpartition(".")[0] in parts
        is_excused |= bool(
            record.during(vehicle, ("energy",), [at_s]).any()
        )  # its battery ended while it was on the way
        if is_excused or any(abs(time_s - at_s) <= CLOSE_S for time_s in refused[vehicle]):
            continue
        report.add("received", "knowledge", at_s, vehicle, f"no row of {uid} received", "one: a packet with it arrived")


def _parts(record: Record) -> Iterator[str]:
    """Names of the later parts of items that take several packets."""
    for uid in set(record["items"]["uid"]):
        _, _, number = uid.partition("-")
        if "." in number and "@" not in uid:
            yield uid
