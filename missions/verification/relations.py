"""Checks of relations between tables that record the same event (docs/howto/results.md)."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from functools import partial

from missions.verification.ending import KEEP_OWN_JOBS
from missions.verification.mapping import cells_of
from missions.verification.packets import block_of, slot_s
from missions.verification.record import CLOSE_S, CheckReport, Record, Row, WeighedRow

SIX_DIGITS = 5e-6  # tolerance of values derived from numbers of six digits
GRID_M, GRID_SHARE = 0.36, 0.0051  # rounding of reports: places to 0.5 m per axis, battery shares to per cent
RESOLUTION_S = 0.06  # tolerance of observation times (s): half the sent resolution plus rounding
INFLUENCING = ("remoras", "remoras-planned")  # strategies that send satisfaction in each slot
REPORTS = ("position", "batteryFraction")  # attributes that a vehicle reports of itself at the start of its slot
POINT, STATUS = re.compile(r"POINT \((\S+) (\S+)\)"), re.compile(r"\d+(?:\.e\d+)?@([\d.e+-]+):(.+)")
ACTS = {
    "assign": "assigned", "succeed": "assigned", "release": "left", "objective": "given", "mission": "given",
    "create": "formed", "dissolve": "dissolved",
}  # fmt: skip
"""Event in the organisation, by requested act."""
SAID = ("assign", "release", "objective", "mission")  # acts requested by facts of items


def check_relations(record: Record, report: CheckReport) -> None:
    """Check all events that are recorded in more than one table."""
    _check_satisfaction(record, report)
    _check_choices(record, report)
    _check_acknowledgements(record, report)
    _check_facts(record, report)
    _check_plans(record, report)
    if record.of("strategy")["name"] == "oracle":
        report.skip("deliveries and requests", "this bound sends nothing")
        return
    _check_deliveries(record, report)
    _check_requests(record, report)


def _check_satisfaction(record: Record, report: CheckReport) -> None:
    rows = list(record.rows("satisfaction", "time_s vehicle group role value"))
    values = {(time_s, vehicle, f"{group}.{role}"): value for time_s, vehicle, group, role, value in rows}
    stated = [row[:4] for row in rows]
    sent = record.rows("packets", "time_s sender")
    due = [(time_s, sender, *role) for time_s, sender in sent for role in record.roles_at(sender, time_s)]
    is_due = record.of("strategy")["name"] in INFLUENCING
    stated_rows = set(stated)
    due = [row for row in due if row in stated_rows or (is_due and row[1] not in record.newcomers)]
    acting = {vehicle for vehicle, event in record.rows("membership", "vehicle event") if event == "absent"}
    known = set(due)
    # A vehicle acting for others has their roles too.
    stated = [row for row in stated if row in known or row[1] not in acting]
    report.alike("satisfaction", "satisfaction", stated, "its roles and packets", due)
    columns = "time_s sender signal_roles signal_addressed signal_values"
    for wrong, time_s, sender, *signals in report.each("signals", record, "packets", columns, 0):
        report.look("signals", len(signals[0]))
        if len(set(map(len, signals))) > 1 or len(set(zip(*signals, strict=False))) < len(signals[0]):
            wrong(f"{signals} as signals", "three lists of one length, each signal once")
        for role, addressed, value in zip(*signals, strict=False):
            if values.get((time_s, sender, role)) != value:
                wrong(f"{value} as {role}", f"{values.get((time_s, sender, role))}, its satisfaction")
            if addressed and addressed not in record.influenced.get(role, ()):
                wrong(f"signal of {role} to {addressed}", "a role that it influences")


def _check_choices(record: Record, report: CheckReport) -> None:
    """Check that chosen activities run with their roles; check motivations."""
    performed, types = defaultdict[Row, list[Row]](list), dict[str, str]()
    for time_s, vehicle, kind, *activity in record.rows("activities", "time_s vehicle type name role motivation"):
        performed[time_s, vehicle].append(tuple(activity))
        if types.setdefault(activity[0], kind) != kind:
            report.add("choices", "activities", time_s, vehicle, f"{activity[0]} as {kind}", types[activity[0]])
    importance, before = _importances(record), defaultdict[str, set[Row]](set)
    chosen, roles = defaultdict[Row, list[list[Row]]](list), defaultdict[Row, list[set[Row]]](list)
    for time_s, vehicle, rows in record.decisions:
        report.look("choices", len(rows))
        check_weights(record, report, rows, before[vehicle], importance)
        taken = [row for row in rows if row.chosen]
        subjects = {row.about for row in taken}
        if not subjects <= before[vehicle] and (time_s, vehicle) not in performed:
            report.add("choices", "activities", time_s, vehicle, "no row", "activities: another choice was made")
        before[vehicle] = subjects
        roles[time_s, vehicle].append({(row.group, row.role) for row in taken if row.role})
        chosen[time_s, vehicle].append([(act, row.role, row.motivation) for row in taken for act in row.activities])
    for (time_s, vehicle), activities in performed.items():
        when = time_s, vehicle
        several = [*chosen[when], [act for acts in chosen[when] for act in acts]]  # one simultaneous decision, or all
        if len(chosen[when]) > 2:
            continue  # no table has the performed ones
        if vehicle in record.anew and not roles[when]:
            continue  # it decides as before its restart
        if not any(_are_close(sorted(activities), sorted(act)) for act in several):
            report.add("choices", "activities", time_s, vehicle, sorted(activities), f"{chosen[when]}, by its decision")
        driving = record.roles_at(vehicle, time_s, "active")
        if driving not in (roles[when] or [set()]):
            report.add("choices", "roles", time_s, vehicle, f"{sorted(driving)} active", f"{roles[when]}, chosen")
    goes_on: dict[str, list[set[Row]]] = {}
    for when in sorted(performed.keys() | chosen.keys()):
        now = [{act[:2] for act in acts} for acts in chosen[when]]  # any of several simultaneous ones may be the last
        if when in performed:
            goes_on[when[1]] = [*now, {activity[:2] for activity in performed[when]}]
        elif when[1] not in record.anew and not any(acts in goes_on.get(when[1], []) for acts in now):
            report.add("choices", "activities", *when, "no row", f"{chosen[when]}, by its decision")
    for time_s, vehicle, event in record.rows("roles", "time_s vehicle event"):
        if event in ("active", "inactive") and (time_s, vehicle) not in performed:
            report.add("choices", "roles", time_s, vehicle, event, "none: its activities do not change then")


def _are_close(rows: list[Row], other: list[Row]) -> bool:
    pairs = zip(rows, other, strict=False)
    return len(rows) == len(other) and all(a[:2] == b[:2] and abs(a[2] - b[2]) <= SIX_DIGITS for a, b in pairs)


def _importances(record: Record) -> dict[Row, float]:
    """Return the motivation at full stimulus per candidate: the mode of undisturbed rows."""
    ratios, before = defaultdict[Row, Counter[float]](Counter), defaultdict[str, set[Row]](set)
    for _, vehicle, rows in record.decisions:
        for row in rows:
            if row.stimulus and row.about not in before[vehicle]:
                ratios[row.purpose][round(row.own / row.stimulus, 4)] += 1
        before[vehicle] = {row.about for row in rows if row.chosen}
    return {purpose: shares.most_common(1)[0][0] for purpose, shares in ratios.items()}


def check_weights(
    record: Record, report: CheckReport, rows: list[WeighedRow], before: set[Row], importance: dict[Row, float]
) -> None:
    """Check motivations: importance times stimulus, continuation bonus, signals, best mean."""
    weights = record.of("decision")
    weight = float(weights.get("weight_external", 0.0))
    memory_s = float(weights.get("signal_memory_frames", math.inf)) * (slot_s(record) or 0.0) * len(record.vehicles)
    moved = [row.motivation for row in rows if row.chosen and row.best_mean is not None for _ in row.activities]
    mean = math.fsum(moved) / len(moved) if moved else math.inf
    shares_all = record.of("strategy")["name"] == "oracle"  # awards of help come without packets
    for row in rows:
        wrong = partial(report.add, "weights", "decisions", row.time_s, row.vehicle)
        if row.objective and record.given_s.get((row.vehicle, *row[2:6]), math.inf) > row.time_s + CLOSE_S:
            wrong(" ".join(row[2:6]), "none: no vehicle has given it this objective")
        least = importance.get(row.purpose, row.own) * row.stimulus
        most = least + (float(weights.get("weight_continuing", 0.0)) if row.about in before else 0.0)
        error = SIX_DIGITS + 1e-4 * row.stimulus
        if not (least - error <= row.own <= most + error if row.stimulus else row.own == row.external == 0.0):
            wrong(f"own {row.own:g} of {row.purpose} at stimulus {row.stimulus:g}", f"{least:g} to {most:g}")
        sender, heard_s = record.packet_of_slot.get(-1 if row.slot is None else row.slot, ("", {}))
        is_heard = row.slot is None or heard_s.get(row.vehicle, math.inf) <= row.time_s + CLOSE_S
        age_s = max(0.0, row.time_s - heard_s.get(row.vehicle, row.time_s))
        moves = memory_s > 0.0 and weight * math.exp(-age_s / memory_s) > SIX_DIGITS  # smaller values are written as 0
        is_from = sender == row.source or (shares_all and row.slot is None)
        if not is_from or (bool(row.source) is not (row.external > 0.0) and moves) or not is_heard:
            stated = f"external {row.external:g} by {row.source!r} in slot {row.slot}"
            wrong(stated, "a signal that it has received, or none")
        if row.external > weight + SIX_DIGITS:
            wrong(f"external {row.external:g}", f"at most {weight:g}")
        is_least = row.chosen and row.best_mean is not None and row.best_mean < mean - SIX_DIGITS
        if is_least or (row.best_mean or 0.0) > mean + SIX_DIGITS:
            wrong(f"best_mean {row.best_mean:g} of {row.purpose}", f"{mean:g}, of all that is chosen")


def _check_deliveries(record: Record, report: CheckReport) -> None:
    rows = list(record.rows("deliveries", "time_s vehicle item event"))
    known = (row[:3] for row in record.rows("knowledge", "time_s vehicle item event") if row[3] == "acknowledged")
    acknowledged = (row[:3] for row in rows if row[3] == "acknowledged")
    report.alike("deliveries", "deliveries", acknowledged, "knowledge", known)
    recorded = {uid: entry for uid, *entry in record.rows("items", "uid time_s recorded_s origin attribute")}
    observed_s: defaultdict[Row, list[float]] = defaultdict(list)
    for uid, (time_s, _, origin, _) in recorded.items():
        observed_s[origin, uid.partition(":")[2]].append(time_s)
    columns = "time_s vehicle item event reason latency_s"
    for wrong, time_s, _, uid, event, reason, latency_s in report.each("deliveries", record, "deliveries", columns, 0):
        if uid not in recorded:
            wrong(f"{event} {uid}", "none: no vehicle recorded it")
            continue
        if (event == "acknowledged") is not (reason == ""):
            wrong(f"{event} {uid}, {reason!r}", "a reason where it is not acknowledged, and only there")
        is_report = recorded[uid][3] in REPORTS or reason != "superseded"
        if latency_s is not None and record.has_exact_clocks and is_report:  # until the next report that supersedes it
            until_s = [time_s] if reason != "superseded" else observed_s[recorded[uid][2], uid.partition(":")[2]]
            off_s = min(abs(at_s - recorded[uid][0] - latency_s) for at_s in until_s)
            is_later = reason in ("", "superseded") or latency_s > time_s - recorded[uid][0]  # else it ended earlier
            if off_s > RESOLUTION_S and is_later:
                wrong(f"{latency_s:g} s of {uid}", f"{until_s[-1] - recorded[uid][0]:g} s, since it was observed")
    slots = set(record.rows("packets", "slot time_s sender"))
    for slot, time_s, vehicle in set(record.rows("unsaid", "slot time_s vehicle")) - slots:
        report.add("unsaid", "unsaid", time_s, vehicle, f"slot {slot}", "its own slot then, in packets")
    sent = {uid for uids in record["packets"]["status_uids"] for uid in uids}
    gone = {(vehicle, uid): time_s for time_s, vehicle, uid, event in rows if event == "expired"}
    newest: dict[Row, str] = {}
    has_peers = len(record.vehicles) > 1
    for uid, (_, at_s, origin, attribute) in recorded.items():
        if has_peers and attribute in REPORTS and "@" in uid and origin not in record.anew:
            report.look("deliveries")
            before = newest.get((origin, attribute), uid)
            newest[origin, attribute] = uid
            if before != uid and before not in sent and abs(gone.get((origin, before), math.inf) - at_s) > CLOSE_S:
                report.add("deliveries", "deliveries", at_s, origin, f"no row of {before}", f"one: {uid} follows it")
            if uid in sent and (origin, uid) in gone:
                report.add("deliveries", "deliveries", at_s, origin, f"{uid} expired", "none: it has been sent")


def _check_acknowledgements(record: Record, report: CheckReport) -> None:
    if record.access:
        report.skip("acknowledgements", "packets of other programs carry none")
        return
    policy = record.of("communication").get("policy", "")
    if ":" in policy:
        report.skip("acknowledgements", "a policy of the user determines them")
        return
    n, packets, refused = len(record.by_slot), record.packet_of_slot, set(record.rows("refused", "vehicle slot"))
    most = (n - 1) * (n if policy in ("lasting", "lasting-repeat") else n - 1)  # these do not clear a column
    rows = report.each("acknowledgements", record, "packets", "time_s sender slot acks")
    for wrong, at_s, sender, slot, acks in rows:
        # A header acknowledges at least the last packet of each other node, in the n - 1 slots before.
        last = (of for of in range(slot - n + 1, slot) if (sender, of) not in refused)
        least = sum(packets.get(of, ("", {}))[1].get(sender, math.inf) <= at_s for of in last)
        if sender not in record.anew and not least <= acks <= (least if policy == "ack" else most):
            wrong(f"{acks} acknowledgements", f"{least}, number of peers whose last packet it received")


def _check_facts(record: Record, report: CheckReport) -> None:
    kinds, ended, before, listed = dict[str, str](), set[str](), "", set[Row]()
    columns = "recorded_s origin uid time_s subject attribute value kind uncertainty"
    rows = report.each("facts", record, "items", columns, 4)
    # Observation times are rounded to the sent resolution; the usual one is 0.1 s.
    most_off_s = float(record.of("communication").get("time_resolution_s", 0.1)) + 0.2 * RESOLUTION_S
    for wrong, at_s, _, uid, time_s, subject, attribute, value, kind, uncertainty in rows:
        if uid != before and uid in ended and "@" not in uid:
            wrong(f"facts of {uid} again", "all of one item behind each other")
        ended.add(uid)
        listed = listed if uid == before else set()
        if (subject, attribute, value) in listed and (kind == "told" or attribute in REPORTS):
            wrong(f"{subject} {attribute} {value} in {uid} again", "each fact of an item once")
        listed.add((subject, attribute, value))
        before, kind_due = uid, kinds.setdefault(attribute, _kind_of(record, value))
        if kind_due != _kind_of(record, value):
            wrong(f"{attribute} {value!r}", f"a value of the kind {kind_due}")
        if uncertainty and _kind_of(record, uncertainty) != "number":
            wrong(f"uncertainty {uncertainty!r}", "a number, or none")
        if kind != ("status" if "@" in uid else "kept" if "-p" in uid else "told"):
            wrong(f"{uid} {kind}", "the kind that its name states")
        if record.has_exact_clocks and abs(time_s - at_s) > most_off_s:
            wrong(f"{uid} observed at {time_s:g} s", f"{at_s:g} s, when it was recorded")
    _check_reports(record, report)
    if "coverage" in record.tables and not (record.drifts or record.of("uncertainty").get("p_miss")):
        numbers, places = Counter[str](), dict[Row, Row]()
        for cell, area in sorted(cells_of(record).items(), key=lambda item: item[0][::-1]):
            places[cell] = area, numbers[area]
            numbers[area] += 1
        facts = record.rows("items", "recorded_s origin subject value attribute")
        cell_facts = (row[:4] for row in facts if row[4] == "mappedCell" and row[1] not in record.anew)
        mapped = ((*fact, int(float(number))) for *fact, number in cell_facts)
        covered = record.rows("coverage", "time_s vehicle cell_x cell_y")
        due = ((*row[:2], *places.get(row[2:], ())) for row in covered if row[1] not in record.anew)
        report.alike("mapped", "items", mapped, "coverage", due)


def _kind_of(record: Record, value: str) -> str:
    if POINT.fullmatch(value):
        return "point"
    if value in ("true", "false"):
        return "truth"
    if tuple(value.split(".", 1)) in record.declared_roles or value in record.vehicles:
        return "role" if "." in value else "vehicle"
    return "number" if re.fullmatch(r"-?\d+(\.\d+)?(e[-+]\d+)?", value) else "name"


def _check_reports(record: Record, report: CheckReport) -> None:
    sent, names = set(record.rows("packets", "time_s sender")), dict[str, str]()
    columns = "recorded_s origin uid time_s subject attribute value"
    for wrong, at_s, origin, uid, time_s, subject, attribute, value in report.each(
        "reports", record, "items", columns, 0
    ):
        if attribute not in REPORTS:
            continue
        shares_all = record.of("strategy")["name"] == "oracle"
        if ("-p" in uid) is (attribute in record.needed or shares_all):
            wrong(f"{attribute} as {uid}", "a status if a vehicle needs the attribute, else kept")
        if (match := STATUS.fullmatch(uid)) is None:
            continue
        report.look("reports", 2)
        is_slot = (at_s, origin) in sent or shares_all
        due = names.setdefault(f"{origin} {match[2]}", attribute)
        if not is_slot or abs(float(match[1]) - time_s) > RESOLUTION_S or (subject, attribute) != (origin, due):
            wrong(f"{subject} {attribute} as {uid}", f"{due} in a slot of {origin}")
        track = record.tracks[origin]
        row = min(int((at_s + CLOSE_S) / record.tick_s), len(track.time_s) - 1)
        near = {row, max(0, row - (at_s - track.time_s[row] < CLOSE_S))}  # at a tick, either row may precede it
        x_m, y_m, off = track.x_m[row], track.y_m[row], math.inf
        left = 1.0 - track.energy_j[row] / record.vehicles[origin]["energy_j"]
        if attribute == "batteryFraction":
            off = abs(float(value) - max(0.0, left)) / GRID_SHARE
        elif record.drifts and POINT.fullmatch(value):
            off = 0.0
        elif point := POINT.fullmatch(value):
            x, y = float(point[1]), float(point[2])
            off = min(math.hypot(x - track.x_m[n], y - track.y_m[n]) for n in near) / GRID_M
        if off > 1.0:
            wrong(f"{attribute} {value}", f"({x_m:g}, {y_m:g}), {left:.3f} left")


def _check_requests(record: Record, report: CheckReport) -> None:
    due = _requests(record)
    absences = record.rows("membership", "time_s event")
    until_s = min([record.end_s, *(at_s for at_s, event in absences if event == "absent")])
    if until_s < record.end_s:
        report.skip("requests", "a vehicle that acts for an absent one does not report it")
    heads = {key for key, role in record.declared_roles.items() if role.get("head")}  # a successor ends its role
    frame_s, seen = (slot_s(record) or 0.0) * len(record.vehicles), Counter[Row]()
    answered = set[Row]()
    founded: defaultdict[Row, set[str]] = defaultdict(set)
    plays: defaultdict[Row, list[tuple[float, bool]]] = defaultdict(list)
    columns = "time_s vehicle issuer act group role peer objective argument event outcome"
    rows = report.each("requests", record, "organisation", columns)
    for wrong, time_s, vehicle, issuer, act, *terms, event, outcome in rows:
        words = f"{act} {' '.join(filter(None, terms))} by {issuer or 'nobody'}"
        if event != (ACTS.get(act) if outcome == "success" else "refused"):
            wrong(f"{words} {event}, {outcome}", f"{ACTS.get(act)} with success, or refused")
        if event in ("assigned", "left"):
            plays[vehicle, *terms[:3]].append((time_s, event == "assigned"))
        if not issuer:
            founded[(act, *terms)].add(vehicle)
        if not issuer or act not in SAID or time_s >= until_s or _is_unsaid(record, {vehicle, issuer}, *terms[:2]):
            continue
        key = (vehicle, issuer, act, *terms)
        seen[key] += event != "refused"
        answered.add(key)
        n_held = sum(at_s <= time_s + CLOSE_S for at_s in due.get(key, ()))
        off_s = abs(time_s - round(time_s / frame_s) * frame_s) if frame_s and record.has_exact_clocks else 0.0
        if max(seen[key], 1) > n_held and not (act == "release" and tuple(terms[:2]) in heads):
            wrong(f"{words}, {seen[key]} times", f"{n_held} times, by the items that it holds")
        elif off_s > CLOSE_S and not any(abs(at_s - time_s) <= CLOSE_S for at_s in due.get(key, ())):
            wrong(words, f"{math.ceil(time_s / frame_s) * frame_s:.4f} s, the end of the TDMA frame")
    for key, times_s in due.items():
        if key[0] != key[1]:
            continue  # others may defer it until its dependencies arrive
        is_due = any(at_s < until_s - frame_s - 1.0 and not record.is_away(key[0], at_s + frame_s) for at_s in times_s)
        is_known = key[2] == "objective" and (key[0], *key[3:5], *key[6:]) in record.given_s
        is_known |= key[0] in founded.get(key[2:], ())
        is_known |= key[2] in ("assign", "release") and has_no_effect(plays, key, min(times_s), frame_s)
        if is_due and key not in answered and not is_known and not _is_unsaid(record, set(key[:2]), *key[3:5]):
            report.add("requests", "organisation", min(times_s), key[0], "no row", f"{' '.join(key[2:])} by {key[1]}")
    for asked, vehicles in founded.items():
        report.look("founded", len(record.vehicles))
        for vehicle in sorted(set(record.vehicles) - vehicles):
            report.add("founded", "organisation", 0.0, vehicle, "no row", f"{' '.join(asked)}, as others have it")


def has_no_effect(plays: Mapping[Row, Sequence[tuple[float, bool]]], key: Row, then_s: float, frame_s: float) -> bool:
    """True if a request changes nothing in the view of its receiver: at receipt, or after others of its frame."""
    states = [False]
    for at_s, holds in plays.get((key[0], *key[3:6]), ()):
        if at_s <= then_s + frame_s + CLOSE_S:
            states = [holds] if at_s < then_s - CLOSE_S else [*states, holds]
    return (key[2] == "assign") in states


def _is_unsaid(record: Record, vehicles: set[str], group: str, role: str) -> bool:
    """True if facts alone do not determine a role: formed groups, claimed jobs, newcomers."""
    name = record.of("strategy")["name"]
    is_claimed = name in KEEP_OWN_JOBS or ":" in name or name == "contract-net"
    formed = {entry["name"] for entry in record.scenario["group"] if entry.get("formed_by")}
    is_own = is_claimed and (group, role) in record.roles_with_jobs
    return is_own or group in formed or bool(vehicles & record.newcomers)


def _requests(record: Record) -> dict[Row, list[float]]:
    """Return the receipt times of requests, by (vehicle, issuer, act, ..., argument)."""
    asked, held = defaultdict[str, list[Row]](list), dict[tuple[str, str], float]()
    columns = "uid origin recorded_s subject attribute value"
    for uid, issuer, at_s, subject, attribute, value in record.rows("items", columns):
        if attribute in ("playsRole", "leftRole"):
            act = "assign" if attribute == "playsRole" else "release"
            asked[uid].append((issuer, act, *value.split(".", 1), subject, "", ""))
        elif attribute.startswith("objective"):
            asked[uid].append((issuer, "objective", *subject.split(".", 1), "", attribute[len("objective") :], value))
        elif attribute == "hasMission":
            asked[uid].append((issuer, "mission", subject, "", "", "", value))
        if "@" in uid or "-p" in uid:  # own statuses and what nobody else needs
            held[issuer, uid] = at_s
    for time_s, vehicle, uid, event in record.rows("knowledge", "time_s vehicle item event"):
        if event in ("observed", "received"):
            held.setdefault((vehicle, uid), time_s)
    for names, times_s, uids in record.rows("packets", "receivers arrivals_s status_uids"):
        for name, at_s in zip(names, times_s, strict=False):
            held |= {(name, uid): min(at_s, held.get((name, uid), at_s)) for uid in uids}
    receipts: defaultdict[Row, list[float]] = defaultdict(list)
    parts: defaultdict[str, set[str]] = defaultdict(set)
    for uid in set(record["items"]["uid"]):
        parts[block_of(uid)].add(uid)
    for uid, requests in asked.items():  # valid once the whole item is complete
        for vehicle in record.vehicles:
            at_s = max(held.get((vehicle, part), math.inf) for part in parts[block_of(uid)])
            for request in requests if at_s < math.inf else ():
                receipts[(vehicle, *request)].append(at_s)
    return receipts


def _check_plans(record: Record, report: CheckReport) -> None:
    plans: defaultdict[Row, dict[int, Row]] = defaultdict(dict)
    changed_s: dict[Row, float] = {}
    columns = "time_s vehicle group role objective argument node parent task method status expected_time_s"
    rows = report.each("plans", record, "plans", f"{columns} expected_energy_j")
    for add, time_s, vehicle, *goal, node, parent, task, method, status, lasts_s, takes_j in rows:
        if vehicle in record.anew:
            continue  # it plans again after a restart
        plan, key = plans[(vehicle, *goal)], (vehicle, *goal)
        if changed_s.get(key, time_s) != time_s:
            _check_tree(report, changed_s[key], vehicle, plan)
        wrong = partial(add, f"task {node} {task} {status}, {lasts_s} s, {takes_j} J")
        before, row = plan.get(node), (parent, task, method, status, lasts_s, takes_j)
        if before is None and (node != len(plan) or not (parent == -1 if node == 0 else 0 <= parent < node)):
            wrong(f"task {len(plan)} of {goal} next, below an earlier one")
        elif before is not None and (before[:2] != row[:2] or before == row):
            wrong(f"another row of {before[1]} below {before[0]}")
        elif before and None is not before[4] != lasts_s and (lasts_s or status not in ("failed", "dropped")):
            wrong(f"{before[4]} s and {before[5]} J, as before")
        if (lasts_s is None) is not (takes_j is None) or (method and lasts_s is not None):
            wrong("both figures, of an elementary task, or none")
        plan[node], changed_s[key] = row, time_s
    for key, plan in plans.items():
        _check_tree(report, changed_s[key], key[0], plan)


def _check_tree(report: CheckReport, time_s: float, vehicle: str, plan: dict[int, Row]) -> None:
    below: defaultdict[int, set[str]] = defaultdict(set)
    for parent, _, _, status, *_ in plan.values():
        below[parent] |= {status} - {"dropped"}
    for node, (_, task, method, status, *_) in plan.items():
        due = "done" if below[node] <= {"done"} else "running" if below[node] != {"waiting"} else "waiting"
        is_wrong = status != due if method else bool(below[node])
        if is_wrong and status not in ("failed", "dropped") and "failed" not in below[node]:
            report.add("plans", "plans", time_s, vehicle, f"task {node} {task} {status}", f"{due}, by those below")
