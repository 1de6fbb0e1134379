"""Organisation over the time of a run, as seen by one vehicle or by each of itself."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from missions.figure import RunResults
from missions.spans import Span, n_at_once, outside, spans, spans_by
from visualisation import run_records
from visualisation.output import unknown
from visualisation.run_records import GroupNode, RoleKey, group_nodes, outages

CREATED, DISSOLVED, MISSION, SUCCEEDED = "create", "dissolve", "mission", "succeed"
REFUSED = "refused"
OF_GROUPS = (CREATED, DISSOLVED, MISSION)


class Holding(NamedTuple):
    """Role assignment of a vehicle; ``present`` are the parts of ``span`` in the mission."""

    vehicle: str
    span: Span
    present: tuple[Span, ...]

    def holds(self, at_s: float) -> bool:
        """Return True while the role is held."""
        return self.span.holds(at_s)

    def is_present(self, at_s: float) -> bool:
        """Return True while the role is held by a vehicle in the mission."""
        return any(span.holds(at_s) for span in self.present)


class ActMark(NamedTuple):
    """Marked act, or refused request, on a group or one of its roles (empty for the group)."""

    time_s: float
    kind: str
    group: str
    role: str


class View(NamedTuple):
    """Role assignments over time, seen by ``viewer``; empty for the roles that each vehicle assumes for itself.

    ``groups`` include those formed at run time. A group that exists at the end has an infinite span in ``exists``.
    """

    viewer: str
    groups: list[GroupNode]
    holdings: dict[RoleKey, list[Holding]]
    exists: dict[str, list[Span]]
    marks: list[ActMark]

    def vacancies(self, group: GroupNode) -> dict[str, list[Span]]:
        """Return by role the spans with too few holders in the mission."""
        return {
            role.name: [
                stretch
                for span in self.exists[group.name]
                for stretch in _lacking(self.holdings.get((group.name, role.name), ()), role.minimum, span)
            ]
            for role in group.roles
        }


def view_of(results: RunResults, viewer: str = "") -> View:
    """Read the organisation of a run; an empty viewer means each vehicle's view of itself. DrawingError if unknown."""
    names = run_records.vehicle_names(results)
    if viewer and viewer not in names:
        raise unknown("vehicle", viewer, names)
    rows = results.rows("organisation")
    of_roles = [row for row in rows if row["role"] and row["event"] in ("assigned", "left")]
    shown = [row for row in of_roles if row["vehicle"] == (viewer or row["peer"])]
    groups = group_nodes(results.scenario_tables, [(row["group"], row["role"]) for row in rows])
    away = _absences(results, viewer) if viewer else outages(results)
    marks = _marks(rows, viewer)
    return View(
        viewer, groups, _holdings(shown, away), {group.name: _existence(group, marks) for group in groups}, marks
    )


def _holdings(rows: Iterable[dict[str, Any]], away: Mapping[str, list[Span]]) -> dict[RoleKey, list[Holding]]:
    spans = spans_by(
        ((row["group"], row["role"], row["peer"]), row["time_s"], row["event"] == "assigned") for row in rows
    )
    holdings: dict[RoleKey, list[Holding]] = defaultdict(list)
    for (group, role, vehicle), held in spans.items():
        holdings[group, role] += [Holding(vehicle, span, tuple(outside(*span, away.get(vehicle, ())))) for span in held]
    return {key: sorted(own, key=lambda holding: holding.span.start_s) for key, own in holdings.items()}


def _absences(results: RunResults, viewer: str) -> dict[str, list[Span]]:
    rows = [row for row in results.rows("membership") if row["vehicle"] == viewer]
    return spans_by((row["peer"], row["time_s"], row["event"] == "absent") for row in rows)


def _marks(rows: Sequence[dict[str, Any]], viewer: str) -> list[ActMark]:
    """Return the marks that the viewer recorded; without a viewer, acts recorded by their issuers, and all refusals."""
    marks: dict[ActMark, None] = {}
    for row in rows:
        act, vehicle = row.get("act"), row["vehicle"]
        if row["event"] == REFUSED:
            kind, own = REFUSED, vehicle
        elif act == SUCCEEDED or act in OF_GROUPS:
            kind, own = act, row.get("issuer")
        else:
            continue
        if vehicle == (viewer or own):
            marks[ActMark(row["time_s"], kind, row["group"], "" if act in OF_GROUPS else row["role"])] = None
    return list(marks)


def _existence(group: GroupNode, marks: Iterable[ActMark]) -> list[Span]:
    own = [mark for mark in marks if mark.group == group.name and mark.kind in (CREATED, DISSOLVED)]
    # A group whose first mark is its formation did not exist before.
    is_old = group.is_founded and not (own and own[0].kind == CREATED)
    return spans([(0.0, is_old), *((mark.time_s, mark.kind == CREATED) for mark in own)])


def _lacking(holdings: Sequence[Holding], minimum: int, within_s: Span) -> list[Span]:
    counts = n_at_once([within_s, *(span for holding in holdings for span in holding.present)])
    # The interval itself counts as one.
    inside = [
        (span.start_s, n - 1 < minimum) for span, n in counts if within_s.start_s <= span.start_s < within_s.end_s
    ]
    return spans(inside, within_s.end_s)
