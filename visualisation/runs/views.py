"""Organisation over the time of a run, as seen by one vehicle or by each of itself."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

from missions.figure import RunResults
from missions.graphs import GroupNode, RoleKey, group_nodes
from visualisation import run_records
from visualisation.output import DrawingError, unknown
from visualisation.run_records import Span, outages, outside, spans

CREATED, DISSOLVED, MISSION, SUCCEEDED = "create", "dissolve", "mission", "succeed"
"""Marked acts."""
REFUSED = "refused"
"""Event of a row, and mark, of a refused request."""
OF_GROUPS = (CREATED, DISSOLVED, MISSION)


class Holding(NamedTuple):
    """Role assignment of a vehicle; ``present`` are the parts of ``span`` in the mission."""

    vehicle: str
    span: Span
    present: tuple[Span, ...]

    def holds(self, at_s: float) -> bool:
        """Return True while the role is held."""
        return self.span.start_s <= at_s < self.span.end_s

    def is_present(self, at_s: float) -> bool:
        """Return True while the role is held by a vehicle in the mission."""
        return any(span.start_s <= at_s < span.end_s for span in self.present)


class ActMark(NamedTuple):
    """Marked act, or refused request, on a group or one of its roles (empty for the group)."""

    time_s: float
    kind: str
    group: str
    role: str


class View(NamedTuple):
    """Role assignments over time.

    Attributes:
        viewer: name of a vehicle; empty for the roles that each vehicle assumes for itself.
        groups: of the scenario, and those formed at run time.
        holdings: of each role, by start.
        exists: lifetimes of each group; infinite if it exists at the end of the run.
        marks: in time order.
    """

    viewer: str
    groups: list[GroupNode]
    holdings: dict[RoleKey, list[Holding]]
    exists: dict[str, list[Span]]
    marks: list[ActMark]

    def vacancies(self, group: GroupNode) -> dict[str, list[tuple[Span, int]]]:
        """Return by role the spans with too few holders in the mission, and the shortage."""
        return {
            role.name: [
                stretch
                for span in self.exists[group.name]
                for stretch in _lacking(self.holdings.get((group.name, role.name), ()), role.minimum, span)
            ]
            for role in group.roles
        }

    def busiest_s(self, end_s: float) -> float:
        """Return the last time with the most role assignments; ``end_s`` if they last to the end."""
        steps: Counter[float] = Counter()
        for span in (holding.span for own in self.holdings.values() for holding in own):
            steps[span.start_s] += 1
            steps[span.end_s] -= 1
        counts = [*zip(sorted(steps), accumulate(steps[time_s] for time_s in sorted(steps)), strict=True)]
        inside = [(count, time_s) for time_s, count in counts if time_s < end_s]
        return max(inside)[1] if inside and max(inside)[0] > inside[-1][0] else end_s


def view_of(results: RunResults, viewer: str = "") -> View:
    """Read the organisation of a run; an empty viewer means each vehicle's view of itself.

    Raises:
        DrawingError: no such vehicle.
    """
    names = run_records.vehicle_names(results)
    if viewer and viewer not in names:
        raise unknown("vehicle", viewer, names)
    rows = results.rows("organisation")
    of_roles = [row for row in rows if row["role"] and row["event"] in ("assigned", "left")]
    told = [row for row in of_roles if row["vehicle"] == (viewer or row["peer"])]
    groups = group_nodes(results.scenario_tables, [(row["group"], row["role"]) for row in rows])
    away = _absences(results, viewer) if viewer else outages(results)
    marks = _marks(rows, viewer)
    return View(
        viewer, groups, _holdings(told, away), {group.name: _existence(group, marks) for group in groups}, marks
    )


def checked_time_s(at_s: float | None, view: View, end_s: float) -> float:
    """Return the time to show; the busiest by default.

    Raises:
        DrawingError: the time is outside the run.
    """
    if at_s is None:
        return view.busiest_s(end_s)
    if not 0.0 <= at_s <= end_s:
        raise DrawingError(f"at {at_s:g} s: this run lasts from 0 to {end_s:g} s")
    return at_s


def _holdings(rows: Iterable[dict[str, Any]], away: Mapping[str, list[Span]]) -> dict[RoleKey, list[Holding]]:
    told: dict[tuple[str, str, str], list[tuple[float, bool]]] = defaultdict(list)
    for row in rows:
        told[row["group"], row["role"], row["peer"]].append((row["time_s"], row["event"] == "assigned"))
    found: dict[RoleKey, list[Holding]] = defaultdict(list)
    for (group, role, vehicle), events in told.items():
        for span in spans(events):
            found[group, role].append(Holding(vehicle, span, tuple(outside(*span, away.get(vehicle, ())))))
    return {key: sorted(own, key=lambda holding: holding.span.start_s) for key, own in found.items()}


def _absences(results: RunResults, viewer: str) -> dict[str, list[Span]]:
    """Return the spans in which the viewer presumed peers absent."""
    told: dict[str, list[tuple[float, bool]]] = defaultdict(list)
    for row in results.rows("membership"):
        if row["vehicle"] == viewer:
            told[row["peer"]].append((row["time_s"], row["event"] == "absent"))
    return {peer: spans(events) for peer, events in told.items()}


def _marks(rows: Sequence[dict[str, Any]], viewer: str) -> list[ActMark]:
    """Return marks recorded by the viewer; without one, acts at their issuers and all refusals."""
    found: dict[ActMark, None] = {}
    for row in rows:
        act, vehicle = row.get("act"), row["vehicle"]
        if row["event"] == REFUSED:
            kind, own = REFUSED, vehicle
        elif act == SUCCEEDED or act in OF_GROUPS:
            kind, own = act, row.get("issuer")
        else:
            continue
        if vehicle == (viewer or own):
            found[ActMark(row["time_s"], kind, row["group"], "" if act in OF_GROUPS else row["role"])] = None
    return list(found)


def _existence(group: GroupNode, marks: Iterable[ActMark]) -> list[Span]:
    own = [mark for mark in marks if mark.group == group.name and mark.kind in (CREATED, DISSOLVED)]
    is_old = group.is_founded and not (own and own[0].kind == CREATED)
    return spans([(0.0, is_old), *((mark.time_s, mark.kind == CREATED) for mark in own)])


def _lacking(holdings: Sequence[Holding], minimum: int, within_s: Span) -> list[tuple[Span, int]]:
    present = [span for holding in holdings for span in holding.present]
    times_s = {within_s.start_s, within_s.end_s, *(time_s for span in present for time_s in span)}
    cuts_s = sorted(time_s for time_s in times_s if within_s.start_s <= time_s <= within_s.end_s)
    found: list[tuple[Span, int]] = []
    for start_s, end_s in pairwise(cuts_s):
        lacking = minimum - sum(span.start_s <= start_s < span.end_s for span in present)
        if lacking > 0 and found and found[-1][1] == lacking and found[-1][0].end_s == start_s:
            found[-1] = Span(found[-1][0].start_s, end_s), lacking
        elif lacking > 0:
            found.append((Span(start_s, end_s), lacking))
    return found
