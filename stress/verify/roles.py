"""Roles: sequences that can be, holders that a role allows, and figures of the organisation.

docs/howto/results.md, tables ``roles`` and ``organisation``.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import Any

from stress.verify.findings import CheckReport
from stress.verify.kinds import AWAY, kind_of
from stress.verify.record import TIME_STEP_S, Record

Role = tuple[str, str]
KEEP_OWN_JOBS = (
    "cbba", "cbba-plain", "status-broadcast", "fixed-partition", "missions.benchmark.grape:GRAPE",
    "missions.benchmark.fmc_ata:FMC_ATA", "remoras.strategies.reorganising:REORGANISING",
)  # fmt: skip
"""Strategies under which each vehicle notes its jobs for itself."""


def declared_roles(record: Record) -> dict[Role, dict[str, Any]]:
    """Roles of the scenario by group and name."""
    return {(group["name"], role["name"]): role for group in record.scenario["group"] for role in group.get("role", [])}


def check_roles(record: Record, report: CheckReport) -> None:
    """Look at the events of each role of each vehicle, and hold them against the vehicle's view of itself."""
    _check_sequences(record, report)
    _check_views(record, report)


def _check_sequences(record: Record, report: CheckReport) -> None:
    """A role is assigned and left in turn; what drives a vehicle begins while it has the role, and ends once."""
    declared = declared_roles(record)
    has: set[tuple[str, Role]] = set()
    drives: set[tuple[str, Role]] = set()
    restarts = sorted((spell.until_s, spell.vehicle) for spell in record.spells if kind_of(spell.kind).begins_anew)
    rows = list(record["roles"].rows("time_s", "vehicle", "group", "role", "event"))
    absences = sorted(record["membership"].rows("time_s", "vehicle", "peer", "event"))
    absent: defaultdict[str, set[str]] = defaultdict(set)
    for time_s, vehicle, group, role, event in rows:
        report.look("roles")
        while restarts and restarts[0][0] <= time_s:
            began = restarts.pop(0)[1]
            has, drives = (
                {row for row in has if row[0] != began},
                {row for row in drives if row[0] != began},
            )
        while absences and absences[0][0] <= time_s:
            _, viewer, peer, event_of_peer = absences.pop(0)
            (absent[viewer].add if event_of_peer == "absent" else absent[viewer].discard)(peer)
        key, why = (vehicle, (group, role)), ""
        playable = record.vehicles[vehicle].get("playable_roles")
        match event:
            case _ if key[1] not in declared:
                why = "the scenario has no such role"
            case "assigned":
                is_able = playable is None or not {role, f"{group}.{role}"}.isdisjoint(playable)
                why = "it has it already" if key in has else "" if is_able else "it is not able to play it"
                has.add(key)
            case "left":
                why = "" if key in has else "it does not have it"
                has.discard(key)
            case "active":
                acts = bool(absent[vehicle])  # for a holder that it takes for absent, before it is assigned the role
                why = "it drives it already" if key in drives else "" if key in has or acts else "it has it not"
                drives.add(key)
            case "inactive":
                why = "" if key in drives else "it does not drive it"
                drives.discard(key)
        if why:
            report.add("roles", "roles", time_s, vehicle, f"{group}.{role} {event}", f"none: {why}")


def _check_views(record: Record, report: CheckReport) -> None:
    """Roles of a vehicle are those that it has in its own view."""
    own: Counter[tuple[float, str, str, str, str]] = Counter()
    names = ("time_s", "vehicle", "peer", "group", "role", "event")
    for time_s, vehicle, peer, group, role, event in record["organisation"].rows(*names):
        if vehicle == peer and event in ("assigned", "left"):
            own[time_s, vehicle, group, role, event] += 1
    rows = record["roles"].rows("time_s", "vehicle", "group", "role", "event")
    noted = Counter(row for row in rows if row[4] in ("assigned", "left"))
    report.look("views", sum(own.values()) + sum(noted.values()))
    for row in noted - own:
        stated = f"{row[2]}.{row[3]} {row[4]}"
        report.add("views", "roles", row[0], row[1], stated, "none: it is not so in its own view, in organisation")
    for row in own - noted:
        follows = f"{row[2]}.{row[3]} {row[4]}, as in its own view, in organisation"
        report.add("views", "roles", row[0], row[1], "no row", follows)


class Views:
    """Who takes whom to hold which roles, and who is in the mission."""

    def __init__(self, record: Record) -> None:
        self.inside = set(record.vehicles)
        self.roles: dict[tuple[str, str], set[Role]] = defaultdict(set)

    def own(self, name: str) -> set[Role]:
        """Roles that a vehicle takes itself to hold."""
        return self.roles[name, name]

    def holders(self, role: Role) -> list[str]:
        """Vehicles in the mission that take themselves to hold a role."""
        return [name for name in sorted(self.inside) if role in self.roles[name, name]]


def views_with_durations(record: Record, end_s: float) -> Iterator[tuple[float, Views]]:
    """Views, each time with how long they stood so (s)."""
    changes: list[tuple[float, int, Any]] = []
    for time_s, vehicle, kind, _ in record["faults"].rows("time_s", "vehicle", "kind", "detail"):
        if kind in AWAY:
            changes.append((time_s, 0, vehicle))
    names = ("time_s", "vehicle", "peer", "group", "role", "event")
    for time_s, *row in record["organisation"].rows(*names):
        if row[4] in ("assigned", "left"):
            changes.append((time_s, 1, row))
    changes.sort(key=lambda change: change[:2])
    views, before_s = Views(record), 0.0
    for time_s, order, change in changes:
        if time_s >= end_s:
            break
        if time_s > before_s:
            yield time_s - before_s, views
            before_s = time_s
        if order == 0:
            (views.inside.discard if record.is_away(change, time_s) else views.inside.add)(change)
        else:
            vehicle, peer, group, role, event = change
            (views.roles[vehicle, peer].add if event == "assigned" else views.roles[vehicle, peer].discard)(
                (group, role)
            )
    yield end_s - before_s, views


def organisation_figures(record: Record, end_s: float) -> dict[str, float | None]:
    """Figures of the organisation over the run; without a time they are None."""
    roles = declared_roles(record)
    by_groups = record.of("communication").get("needs_follow", "all") == "groups" or len(record.cells.tables) > 1
    keeps = record.of("strategy")["name"] in KEEP_OWN_JOBS
    left_out = {key for key, role in roles.items() if keeps and role.get("job") is not None}
    conflict_s, apart_s, pairs_s, malformed_s = [], [], [], []
    for spell_s, views in views_with_durations(record, end_s):
        n_inside = len(views.inside)
        if n_inside > 1:
            pairs_s.append(spell_s)
            apart_s.append(spell_s * _n_wrong(views, left_out, by_groups) / (n_inside * (n_inside - 1)))
        is_full = any(
            role.get("maximum") is not None and len(views.holders(key)) > role["maximum"] for key, role in roles.items()
        )
        conflict_s.append(spell_s * is_full)
        malformed_s.append(spell_s * any(_is_malformed(views, key, role) for key, role in roles.items()))
    return {
        "view_divergence": math.fsum(apart_s) / math.fsum(pairs_s) if math.fsum(pairs_s) else None,
        "holder_conflict_fraction": math.fsum(conflict_s) / end_s if end_s else None,
        "malformed_s": math.fsum(malformed_s),
    }


def _n_wrong(views: Views, left_out: set[Role], by_groups: bool) -> int:
    """Pairs of vehicles in the mission of which the one errs on which roles the other plays."""
    n = 0
    for viewer in views.inside:
        groups = {group for group, _ in views.own(viewer)}
        for peer in views.inside - {viewer}:
            wrong = (views.roles[viewer, peer] ^ views.own(peer)) - left_out
            n += any(not by_groups or group in groups for group, _ in wrong)
    return n


def _is_malformed(views: Views, key: Role, role: dict[str, Any]) -> bool:
    """True if a founding role has too few holders, a role too many, or one who may not hold it."""
    holders = views.holders(key)
    least = max(int(role.get("minimum", 0)), int(role.get("head", False))) if role.get("founding") else 0
    if len(holders) < least or (role.get("maximum") is not None and len(holders) > role["maximum"]):
        return True
    above = role.get("played_by")
    return above is not None and any(tuple(above.split(".", 1)) not in views.own(name) for name in holders)


CLOSE_S = 2.0 * TIME_STEP_S
