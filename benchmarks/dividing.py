"""The division of jobs: 80 surveys among 80 vehicles, against a matrix of their costs and SciPy's assignment.

The matrix asks each job once how long each vehicle takes for it; SciPy then gives one job to each vehicle, at least
cost in all. The allocator sees to the end of the last vehicle, to vehicles that may do several jobs and to ties as
well. Goal: at most 3 times the matrix with its assignment.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.measuring import row
from missions.mapping.jobs import SurveyJob
from missions.mapping.sensors import SwathSettings
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import job_plan
from remoras.work import Outlook, Work

N_JOBS = 80
REPEATS = 5
SIDE_M, APART_M, PER_ROW = 100.0, 120.0, 9
TEAM = "Team"
SWATH = SwathSettings(type="swath", name="sonar", swath_m=25.0, speed_limit_mps=1.25)


def vehicle(node: int) -> VehicleData:
    """One of a fleet, at the same place as the others, without sensors."""
    return VehicleData(
        f"AUV{node:04d}", "AUV", node, True, (0.0, 0.0), 10.0, 100.0, 2.0, 1.5, 0.5, 0.5, 1e6, 40.0, 15.0, 0.01,
        ("Head", "Member", "Worker"),
    )  # fmt: skip


def work(size: int) -> Work:
    """As many areas as vehicles, of which each is able to survey any."""
    roles = tuple(RoleSpecification(f"Surveyor{number:02d}", 1, 1, job=f"area {number:02d}") for number in range(size))
    group = Group(TEAM, (RoleSpecification("Member", 1, founding=True), *roles))
    jobs = {}
    for number, role in enumerate(roles):
        x_m, y_m = APART_M * (number % PER_ROW), APART_M * (number // PER_ROW)
        corners = ((x_m, y_m), (x_m, y_m + SIDE_M), (x_m + SIDE_M, y_m + SIDE_M), (x_m + SIDE_M, y_m))
        jobs[role.job or ""] = SurveyJob(role.job or "", corners)
    vehicles = AUVDatabase(tuple(
        replace(
            vehicle(node), start_m=(10.0 * (37 * node % 101), 10.0 * (53 * node % 97)), sensors=(SWATH,),
            playable_roles=tuple(role.name for role in group.roles),
        )
        for node in range(size)
    ))  # fmt: skip
    members = [RoleAssignment(TEAM, "Member", name) for name in vehicles]
    return Work(group, Organisation.of([group], members), vehicles, jobs)


def matched(of: Work) -> Any:
    """What each vehicle takes for each job, and the assignment of least cost."""
    starts = [Outlook(0.0, of.position_m(data.name)) for data in of.workers]
    costs = np.full((len(of.vacant), len(starts)), math.inf)
    for line, role in enumerate(of.vacant):
        for column, (start, data) in enumerate(zip(starts, of.workers, strict=True)):
            then = of.after(start, data, role)
            if then is not None:
                costs[line, column] = then.free_s
    return linear_sum_assignment(costs)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, measured in turn, each of work that nobody has asked before."""
    best = {"allocator": math.inf, "matrix": math.inf}
    ways: dict[str, Callable[[Work], Any]] = {"allocator": job_plan, "matrix": matched}
    asked = work(N_JOBS)
    for _ in range(REPEATS):
        for name, way in ways.items():
            fresh = replace(asked)
            began = time.process_time()
            way(fresh)
            best[name] = min(best[name], time.process_time() - began)
    own_ms, floor_ms = 1e3 * best["allocator"], 1e3 * best["matrix"]
    return [row(f"{N_JOBS} jobs to {N_JOBS} vehicles", own_ms, "ms CPU", "matrix and SciPy", floor_ms)]
