"""What the figures read out of the results of a run: vehicles, tracks, spans of roles, milestones."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.figure import PointM, RunResults
from missions.files import tables_of
from visualisation.spans import OVER, Span, outages, outside, spans

Floats = NDArray[np.float64]
RoleKey = tuple[str, str]
"""Group and role."""


class PlanTrack(NamedTuple):
    """Positions of one vehicle in time order; arrays of one length."""

    time_s: Floats
    x_m: Floats
    y_m: Floats

    def at(self, time_s: float) -> PointM:
        """Position at a time."""
        x_m, y_m = (float(np.interp(time_s, self.time_s, along)) for along in (self.x_m, self.y_m))
        return x_m, y_m

    def between(self, start_s: float, end_s: float) -> PlanTrack:
        """The part from ``start_s`` to ``end_s``."""
        inside = (self.time_s >= start_s) & (self.time_s <= end_s)
        return PlanTrack(self.time_s[inside], self.x_m[inside], self.y_m[inside])


class Tenure(NamedTuple):
    """One role of one vehicle: when it held the role, and when the role drove it."""

    group: str
    role: str
    held: tuple[Span, ...]
    active: tuple[Span, ...]


class MilestoneRow(NamedTuple):
    """Something reached; vehicle and group are empty where they do not apply."""

    name: str
    vehicle: str
    group: str
    time_s: float

    @property
    def label(self) -> str:
        """Name in words, with the vehicle or the group it is about."""
        return ": ".join(part for part in (self.name.replace("_", " "), self.vehicle or self.group) if part)


class VehicleFault(NamedTuple):
    """What befell a vehicle, from when to when; until the end of the run if it was not over before."""

    vehicle: str
    kind: str
    detail: str
    span: Span


def scenario(results: RunResults) -> dict[str, Any]:
    """The resolved scenario of the run."""
    return tables_of(results.manifest["scenario"], "manifest.json")


def vehicle_names(results: RunResults) -> list[str]:
    """Names of the vehicles in the order of the scenario."""
    return [vehicle["name"] for vehicle in scenario(results).get("vehicle", ())]


def tracks(results: RunResults) -> dict[str, PlanTrack]:
    """Tracks of the vehicles that were recorded, in the order of the scenario."""
    table = results.table("trajectories")
    names = np.asarray(table["vehicle"].to_pylist(), dtype=str)
    columns = [table[name].to_numpy() for name in ("time_s", "x_m", "y_m")]
    own = {name: names == name for name in vehicle_names(results)}
    return {name: PlanTrack(*(column[rows] for column in columns)) for name, rows in own.items() if rows.any()}


def milestones(results: RunResults) -> list[MilestoneRow]:
    """Milestones in time order."""
    found = results.summary["milestones"]
    return [MilestoneRow(m["name"], m["vehicle"], m["group"], float(m["time_s"])) for m in found]


def vehicle_faults(results: RunResults) -> list[VehicleFault]:
    """Faults that the scenario declares and the run had, in the order in which they began."""
    kinds = {fault.get("kind") for fault in scenario(results).get("fault", ())}
    if not kinds or not results.has("faults"):
        return []
    last_s = end_s(results)
    found: list[VehicleFault] = []
    for row in results.table("faults").to_pylist():
        vehicle, kind, time_s = row["vehicle"], row["kind"], float(row["time_s"])
        if kind not in kinds:
            continue  # such as an empty battery
        if row["detail"] != OVER:
            found.append(VehicleFault(vehicle, kind, row["detail"], Span(time_s, last_s)))
            continue
        for at, fault in enumerate(found):
            if (fault.vehicle, fault.kind, fault.span.end_s) == (vehicle, kind, last_s):
                found[at] = fault._replace(span=Span(fault.span.start_s, time_s))
                break
    return found


def end_s(results: RunResults) -> float:
    """When the run ended; a second at least, so that it can be an axis."""
    return max(float(results.summary["mission_time_s"]), 1.0)


def tenures(results: RunResults) -> dict[str, list[Tenure]]:
    """Roles of every vehicle by group, in the order in which the groups, and in them the roles, were met.

    No role drives a vehicle that is out of the mission.
    """
    events: dict[str, dict[RoleKey, list[tuple[float, str]]]] = {name: {} for name in vehicle_names(results)}
    groups: dict[str, int] = {}
    for row in results.table("roles").to_pylist():
        groups.setdefault(row["group"], len(groups))
        of_role = events[row["vehicle"]].setdefault((row["group"], row["role"]), [])
        of_role.append((row["time_s"], row["event"]))
    last_s, out = end_s(results), outages(results)

    return {
        vehicle: [
            Tenure(
                *key,
                tuple(_told(of_role[key], "assigned", ("left",), last_s)),
                tuple(
                    part
                    for span in _told(of_role[key], "active", ("inactive", "left"), last_s)
                    for part in outside(*span, out.get(vehicle, ()))
                ),
            )
            for key in sorted(of_role, key=lambda key: groups[key[0]])
        ]
        for vehicle, of_role in events.items()
    }


def _told(events: Sequence[tuple[float, str]], opening: str, closing: tuple[str, ...], last_s: float) -> list[Span]:
    return spans(((time_s, event == opening) for time_s, event in events if event in (opening, *closing)), last_s)


def satisfaction(results: RunResults) -> dict[str, dict[RoleKey, tuple[Floats, Floats]]]:
    """Times and values of the personal satisfaction of every role of every vehicle."""
    series: dict[str, dict[RoleKey, list[tuple[float, float]]]] = {
        name: defaultdict(list) for name in vehicle_names(results)
    }
    for row in results.table("satisfaction").to_pylist():
        series[row["vehicle"]][row["group"], row["role"]].append((row["time_s"], row["value"]))
    return {
        vehicle: {key: (np.array([p[0] for p in points]), np.array([p[1] for p in points]))
                  for key, points in of_role.items()}
        for vehicle, of_role in series.items()
    }  # fmt: skip


def eventful_times_s(results: RunResults) -> list[float]:
    """Times at which a milestone was reached or a role began or ceased to drive a vehicle, where roles are recorded."""
    roles = results.table("roles")["time_s"].to_pylist() if results.has("roles") else ()
    return sorted({*roles, *(milestone.time_s for milestone in milestones(results))})


def marker_step_s(length_s: float) -> float:
    """A round time between markers on a track, so that there are at most ten in ``length_s``.

    >>> marker_step_s(2062.0)
    300.0
    """
    steps_s = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 43200, 86400)
    return float(next((step for step in steps_s if length_s / step <= 10), length_s))
