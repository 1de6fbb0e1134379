"""Checks of roles, faults, milestones and verdict of a run (docs/howto/results.md)."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from typing import Any

from missions.verification.record import (
    CLOSE_S,
    KINDS,
    OUT_OF_CONTACT,
    PLACE_STEP_M,
    CheckReport,
    Record,
    Role,
)

KEEP_OWN_JOBS = (
    "cbba", "cbba-plain", "status-broadcast", "fixed-partition", "remoras.strategies.grape:GRAPE",
    "remoras.strategies.fmc_ata:FMC_ATA",
)  # fmt: skip
"""Strategies in which each vehicle records its own jobs."""


def check_roles(record: Record, report: CheckReport) -> None:
    """Check the role events of each vehicle against each other and its own view."""
    _check_sequences(record, report)
    _check_views(record, report)


def _check_sequences(record: Record, report: CheckReport) -> None:
    declared = record.declared_roles
    has: set[tuple[str, Role]] = set()
    drives: set[tuple[str, Role]] = set()
    restarts = sorted((spell.until_s, spell.vehicle) for spell in record.spells if spell.kind == "restarts")
    absences = sorted(record.rows("membership", "time_s vehicle peer event"))
    absent: defaultdict[str, set[str]] = defaultdict(set)
    columns = "time_s vehicle group role event"
    for wrong, time_s, vehicle, group, role, event in report.each("roles", record, "roles", columns):
        # A restart ends roles without rows.
        while restarts and restarts[0][0] <= time_s:
            began = restarts.pop(0)[1]
            has, drives = ({row for row in has if row[0] != began}, {row for row in drives if row[0] != began})
        while absences and absences[0][0] <= time_s:
            _, viewer, peer, event_of_peer = absences.pop(0)
            (absent[viewer].add if event_of_peer == "absent" else absent[viewer].discard)(peer)
        key, why = (vehicle, (group, role)), ""
        match event:
            case _ if key[1] not in declared:
                why = "the scenario has no such role"
            case "assigned":
                is_able = record.is_able(vehicle, key[1])
                why = "it has it already" if key in has else "" if is_able else "it is not able to play it"
                has.add(key)
            case "left":
                why = "" if key in has else "it does not have it"
                has.discard(key)
            case "active":
                acts = bool(absent[vehicle])  # it may act for an absent holder before its own assignment
                why = "it drives it already" if key in drives else "" if key in has or acts else "it has it not"
                drives.add(key)
            case "inactive":
                why = "" if key in drives else "it does not drive it"
                drives.discard(key)
        if why:
            wrong(f"{group}.{role} {event}", f"none: {why}")


def _check_views(record: Record, report: CheckReport) -> None:
    changes, columns = ("assigned", "left"), "time_s vehicle group role event"
    views = record.rows("organisation", f"{columns} peer")
    own = (row[:5] for row in views if row[1] == row[5] and row[4] in changes)
    noted = (row for row in record.rows("roles", columns) if row[4] in changes)
    report.alike("views", "roles", noted, "its own view in organisation", own)


ROUNDED_S = 1e-4 + CLOSE_S  # tolerance of milestones, which are rounded to 0.1 ms


def check_ending(record: Record, report: CheckReport) -> None:
    """Check faults, batteries, milestones and verdict."""
    _check_faults(record, report)
    _check_batteries(record, report)
    _check_milestones(record, report)
    _check_verdict(record, report)


def _check_faults(record: Record, report: CheckReport) -> None:
    declared = record.scenario.get("fault", [])
    kinds = {*KINDS, *(fault["kind"] for fault in declared)}  # other kinds are not declared
    begun = [spell for spell in record.spells if spell.kind in kinds]
    left = list(begun)
    for fault in declared:
        report.look("faults")
        if not _is_told(fault):
            continue
        from_s, until_s = _span_s(fault)
        if from_s > record.end_s:
            continue
        own = (spell for spell in left if (spell.vehicle, spell.kind) == (fault["vehicle"], fault["kind"]))
        match = next((spell for spell in own if abs(spell.from_s - from_s) <= CLOSE_S), None)
        if match is None:
            # A fault at the very end may or may not have a row.
            if from_s < record.end_s:
                follows = f"{fault['kind']} from {from_s:g} s, as declared"
                report.add("faults", "faults", from_s, fault["vehicle"], "no row", follows)
            continue
        left.remove(match)
        if until_s < record.end_s and abs(match.until_s - until_s) > CLOSE_S:
            follows = f"{fault['kind']} over at {until_s:g} s, as declared"
            report.add("faults", "faults", until_s, match.vehicle, "no row", follows)
    drawn = [fault for fault in declared if not _is_told(fault)]
    if drawn:
        why = "it is drawn by the seed; only their kinds and numbers are known"
        report.skip("vehicles and times of drawn faults", why)
    for lasting in left:
        fault = next((fault for fault in drawn if fault["kind"] == lasting.kind), None)
        report.look("faults")
        if fault is None:
            stated = f"{lasting.kind} {lasting.detail}"
            report.add("faults", "faults", lasting.from_s, lasting.vehicle, stated, "none: it is not declared")
        else:
            drawn.remove(fault)
    for time_s, vehicle, kind, detail in record.rows("faults", "time_s vehicle kind detail"):
        if detail == "over" and kind in kinds:
            report.look("faults")
            if not any((spell.vehicle, spell.kind, spell.until_s) == (vehicle, kind, time_s) for spell in begun):
                report.add("faults", "faults", time_s, vehicle, f"{kind} over", "none: none was to end then")


def _is_told(fault: dict[str, Any]) -> bool:
    """True if the scenario fixes time and vehicle of a fault; else the seed or the organisation decides."""
    at_s = fault.get("at_s")
    return isinstance(at_s, int | float) and fault["vehicle"] != "any" and not fault["vehicle"].startswith("head of ")


def _span_s(fault: dict[str, Any]) -> tuple[float, float]:
    if fault["kind"] == "joins":
        return 0.0, float(fault["at_s"])
    return float(fault["at_s"]), float(fault.get("until_s", math.inf))


def _check_batteries(record: Record, report: CheckReport) -> None:
    empty = {spell.vehicle for spell in record.spells if spell.kind == "energy"}
    for name, track in record.tracks.items():
        report.look("batteries")
        has_used = bool(track.energy_j[-1] >= float(record.vehicles[name]["energy_j"]) - 0.5)
        if has_used != (name in empty):
            stated = "a row of kind energy" if name in empty else "no row of kind energy"
            follows = f"{track.energy_j[-1]:.0f} J used of {record.vehicles[name]['energy_j']:.0f} J"
            report.add("batteries", "faults", None, name, stated, follows)


def _check_milestones(record: Record, report: CheckReport) -> None:
    stones = record.summary["milestones"]
    report.look("milestones", len(stones))
    for before, after in pairwise(stones):
        if after["time_s"] < before["time_s"]:
            stated = f"milestone {after['name']} behind {before['name']} at {before['time_s']:g} s"
            report.add("milestones", "summary", after["time_s"], after["vehicle"], stated, "the order of time")
    for stone in stones:
        wrong = partial(report.add, "milestones", "summary", stone["time_s"], stone["vehicle"])
        if not 0.0 <= stone["time_s"] <= record.end_s + ROUNDED_S:
            wrong(f"milestone {stone['name']}", f"0 to {record.end_s:g} s, the end of the run")
        for why in _reasons_against(record, stone):
            wrong(f"milestone {stone['name']} {stone['group']}".rstrip(), why)


def _reasons_against(record: Record, stone: dict[str, Any]) -> Iterator[str]:
    """Yield the reasons why a milestone does not follow from the tables."""
    time_s, vehicle = float(stone["time_s"]), stone["vehicle"]
    match stone["name"]:
        case "gathered":
            yield from _against_gathering(record, stone["group"], time_s)
        case "mapping_stopped":
            decided_s = [at_s for name, at_s in record.rows("decisions", "vehicle time_s") if name == vehicle]
            since_s = time_s - record.tick_s  # a decision between two ticks may appear at the next
            until_s = time_s + record.without_decision_s  # without its goal it decides again
            has_decided = any(since_s - ROUNDED_S <= at_s <= until_s + ROUNDED_S for at_s in decided_s)
            is_over = until_s > record.end_s + ROUNDED_S or record.is_away(vehicle, until_s)  # before its next decision
            if not has_decided and not is_over:
                yield "none: it decided nothing then"
        case "mapping_done":
            items = list(record.rows("items", "origin recorded_s attribute"))
            is_said = any(name == vehicle and attribute in ("areaDone", "jobDone") for name, _, attribute in items)
            done = [(name, at_s) for name, at_s, attribute in items if attribute == "areaDone"]
            is_known = any(name == vehicle and at_s <= time_s + ROUNDED_S for name, at_s in done)
            if is_said and done and not is_known:
                yield "none: it recorded no area as done by then"
        case "job_done":
            if "jobs" in record.tables and not _has_row(record.rows("jobs", "vehicle time_s"), vehicle, time_s):
                yield "none: the table of jobs has no such row"
        case "found":
            if not _has_row(record.rows("coverage", "vehicle time_s"), vehicle, time_s):
                yield "none: it covered no cell then"


def _has_row(rows: Any, vehicle: str, time_s: float) -> bool:
    return any(row[0] == vehicle and abs(row[1] - time_s) <= ROUNDED_S for row in rows)


def _against_gathering(record: Record, group: str, time_s: float) -> Iterator[str]:
    """Yield faults for members that neither visited the rally point nor are recorded as missing."""
    table = next((table for table in record.scenario["group"] if table["name"] == group), None)
    place = None if table is None else next(
        (point for point in record.scenario.get("rally_point", []) if point["name"] == table.get("rally_point")), None
    )  # fmt: skip
    if table is None or place is None:
        yield f"none: there is no group {group} with a rally point"
        return
    radius_m = float(record.of("mission").get("arrival_radius_m", math.inf)) + PLACE_STEP_M
    missing = {stone["vehicle"] for stone in record.milestones("missed_meeting") if stone["group"] == group}
    for name in _members(record, group, time_s):
        track = record.tracks[name]
        n = int((track.time_s <= time_s + CLOSE_S).sum())
        apart_m = ((track.x_m[:n] - place["position_m"][0]) ** 2 + (track.y_m[:n] - place["position_m"][1]) ** 2) ** 0.5
        has_come = bool((apart_m <= radius_m).any())
        if not has_come and name not in missing and not record.during(name, OUT_OF_CONTACT, time_s):
            yield f"none: {name} has not been within {radius_m:g} m of {place['name']}"


def _members(record: Record, group: str, time_s: float) -> list[str]:
    names = record.vehicles
    return sorted(name for name in names if any(g == group for g, _ in record.roles_at(name, time_s + CLOSE_S)))


def _check_verdict(record: Record, report: CheckReport) -> None:
    summary, scenario = record.summary, record.of("scenario")
    ended, is_complete = record.milestones("mission_complete"), summary.get("completed")
    report.same("verdict", "summary", "completed", is_complete, bool(ended))
    report.look("verdict", 4)
    wrong = partial(report.add, "verdict", "summary")
    time_s = float(summary["mission_time_s"])
    if not is_complete:
        report.same("verdict", "summary", "mission_time_s", time_s, float(scenario["duration_s"]), ROUNDED_S)
        if not summary.get("reason"):
            wrong(None, "", "not completed, without a reason", "a reason")
        return
    if summary.get("reason"):
        wrong(None, "", f"completed, with the reason {summary['reason']!r}", "no reason")
    if float(summary.get("goal_fraction") or 0.0) < 1.0:
        wrong(None, "", f"completed with {summary['goal_fraction']} of the goal", "not completed")
    if abs(time_s - record.end_s) > ROUNDED_S:
        wrong(None, "", f"mission_time_s is {time_s:g}", f"{record.end_s:g}, time of the last tick")
    # The milestone falls between the last two ticks.
    if ended and not -ROUNDED_S <= record.end_s - ended[-1]["time_s"] <= record.tick_s + ROUNDED_S:
        wrong(ended[-1]["time_s"], "", "milestone mission_complete", f"{record.end_s:g} s, when the run ended")
    met = {milestone["group"] for milestone in record.milestones("gathered")}
    for group in record.scenario["group"]:
        if group.get("rally_point") and not group.get("formed_by") and group["name"] not in met:
            wrong(None, "", f"completed without {group['name']}", "its milestone gathered")
