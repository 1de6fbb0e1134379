"""Metrics of the fleet from tables that every run has: idle time, separation, recovery."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from operator import itemgetter

from missions.fault import EMPTY, OVER, Absence, absence, absences, kind_of_row
from missions.metric import NOT_APPLICABLE, Absent, MeasuredRun
from missions.scenarios.scenario import Scenario
from missions.spans import Span, spans
from remoras.motion.separation import SAME_DEPTH_M, TOLERANCE_M


def idle_s(run: MeasuredRun) -> float | None:
    """Mean idle time (s) until the run's end, over the vehicles able to do a job; None without such vehicles.

    A vehicle is busy while its executive decision serves a role with a job, travel included. It is idle while it waits,
    follows or heads for a rendezvous, but not before it joins or after its loss.
    """
    work, lost_s = job_roles(run.scenario), _first_s(run, Absence.LOSS, False)
    away, back = (_first_s(run, Absence.BEFORE, is_over) for is_over in (False, True))
    joined_s = {vehicle: back.get(vehicle, math.inf) for vehicle in away}
    idle = []
    for vehicle in vehicles_for_jobs(run.scenario):
        end_s = min(run.ended_s, lost_s.get(vehicle, run.ended_s))
        working_s = math.fsum(end - begin for begin, end in _working(run, vehicle, work, end_s))
        idle.append(max(0.0, end_s - joined_s.get(vehicle, 0.0) - working_s))
    return round(math.fsum(idle) / len(idle), 4) if idle else None


def _first_s(run: MeasuredRun, how: Absence, over: bool) -> dict[str, float]:
    reached = [
        (row[1], row[0])
        for row in run.recorder.rows("faults")
        if (row[3] == OVER) == over and row[2] != EMPTY and absence(row[2]) is how
    ]
    # Reversed, so that the first time of a vehicle remains.
    return dict(reversed(reached))


def _working(run: MeasuredRun, vehicle: str, work: set[tuple[str, str]], end_s: float) -> list[Span]:
    def changes() -> Iterator[tuple[float, bool]]:
        serving: set[tuple[str, str]] = set()
        for time_s, name, group, role, event in run.recorder.rows("roles"):
            if name == vehicle and (group, role) in work and event in ("active", "inactive") and time_s <= end_s:
                serving = serving | {(group, role)} if event == "active" else serving - {(group, role)}
                yield time_s, bool(serving)

    return spans(changes(), end_s)


def job_roles(scenario: Scenario) -> set[tuple[str, str]]:
    """Return the roles with a job, as (group, role)."""
    return {(group.name, role.name) for group in scenario.group for role in group.role if role.job is not None}


def vehicles_for_jobs(scenario: Scenario) -> tuple[str, ...]:
    """Return the vehicles able to play a role with a job."""
    roles = job_roles(scenario)
    return tuple(vehicle.name for vehicle in scenario.vehicle if any(vehicle.can_play(*role) for role in roles))


def closest_approach_m(run: MeasuredRun) -> float | None:
    """Least distance (m) between vehicles in one depth layer; None if none ever shared one."""
    least_m = _least_distances_m(run)
    return round(min(least_m), 3) if least_m else None


def conflicts(run: MeasuredRun) -> int:
    """Number of vehicle pairs in one depth layer that violated the separation."""
    allowed_m = run.scenario.guidance.separation_m - TOLERANCE_M
    return sum(distance_m < allowed_m for distance_m in _least_distances_m(run))


def _least_distances_m(run: MeasuredRun) -> list[float]:
    import numpy as np  # slow to load, and checking a scenario loads these metrics

    rows = run.recorder.rows("trajectories")  # all vehicles with a track, in the same order at every tick
    names = [row[1] for row in itertools.takewhile(lambda row: row[0] == rows[0][0], rows)]
    if not names:
        return []
    columns = [np.fromiter(map(itemgetter(number), rows), np.float64, len(rows)) for number in (0, 2, 3, 7)]
    by_time = np.array(columns).reshape(4, -1, len(names))
    times_s, present = by_time[0, :, 0], np.ones(by_time.shape[1:], dtype=bool)
    for at_s, vehicle, is_absent in absences(run.recorder.rows("faults")):
        if vehicle in names:
            present[np.searchsorted(times_s, at_s) :, names.index(vehicle)] = not is_absent
    least_m = []
    for first, other in itertools.combinations(range(len(names)), 2):
        apart_m = by_time[1:, :, first] - by_time[1:, :, other]
        meet = present[:, first] & present[:, other] & (np.abs(apart_m[2]) <= SAME_DEPTH_M)
        if meet.any():
            east_m, north_m = apart_m[0, meet], apart_m[1, meet]
            least_m.append(math.sqrt((east_m * east_m + north_m * north_m).min()))
    return least_m


def recovery_time_s(run: MeasuredRun) -> float | Absent | None:
    """Time (s) from the first disabling fault until peers hold its vehicle's roles with jobs.

    Roles not taken over before completion had no work left and are ignored. None if the mission did not complete and
    such a role was never taken over. Not applicable without such a fault or if the vehicle held no work.
    """
    faults = (row for row in run.recorder.rows("faults") if row[3] != OVER)
    first = next((row for row in faults if (kind := kind_of_row(row[2])) is not None and kind.DISABLES), None)
    if first is None:
        return NOT_APPLICABLE
    at_s, vehicle = first[0], first[1]
    work = job_roles(run.scenario)
    held: set[tuple[str, str]] = set()
    taken_s: dict[tuple[str, str], float] = {}
    for time_s, name, group, role, event in run.recorder.rows("roles"):
        if (group, role) not in work:
            continue
        if time_s <= at_s and name == vehicle and event in ("assigned", "left"):
            held = held | {(group, role)} if event == "assigned" else held - {(group, role)}
        elif time_s > at_s and name != vehicle and event == "assigned":
            taken_s.setdefault((group, role), time_s)
    times_s = [taken_s[job] - at_s for job in held if job in taken_s]
    if len(times_s) < len(held) and not run.completed:
        return None
    return round(max(times_s), 4) if times_s else NOT_APPLICABLE
