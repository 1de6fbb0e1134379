"""Reach: what of a mission's goal was reached, or could still be reached by the vehicles that are left.

``goal_fraction`` is judged over the whole of the work, so it says that a mission has failed and not why. Beside it the
reachable fraction tells want of vehicles (below 1) from want of sense or time (1): at the end of a run, what was done
and what those left are able to do. A vehicle is left if it is alive or will be back, has energy to spare for work, and
its sensors work, or will. How long the rest would take, and whether the energy lasts for it, is not asked.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from remoras.database import VehicleData
from remoras.organisation import Group
from remoras.truth import FleetView, Truth, VehicleView
from remoras.work import Job


def left(fleet: FleetView) -> list[tuple[VehicleView, VehicleData]]:
    """Vehicles that are left for work, each with the data of what it is left with."""
    return [(vehicle, data) for vehicle in fleet.vehicles if (data := vehicle.able_data) is not None]


def within_reach(
    jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView, done: Collection[str]
) -> frozenset[str]:
    """Names of the jobs that are done, or that somebody left is able to do, as all that must be done before.

    Who is able has what the job takes and can play a role that has it; a job without a role is open to all.

    Args:
        jobs: by name.
        groups: with the roles that have them.
        fleet: at the end, or at any other moment.
        done: names of jobs that are done.
    """
    paths: dict[str, list[tuple[str, str]]] = {}
    for group in groups:
        for role in group.roles:
            if role.job is not None:
                paths.setdefault(role.job, []).append((group.name, role.name))
    workers = left(fleet)

    def is_able(name: str, vehicle: VehicleView, data: VehicleData) -> bool:
        may = name not in paths or any(vehicle.can_play(*path) for path in paths[name])
        return may and jobs[name].is_able(data)

    found = set(done) & jobs.keys()
    able = [name for name in jobs if name not in found and any(is_able(name, *worker) for worker in workers)]
    while opened := [name for name in able if name not in found and found.issuperset(jobs[name].needs)]:
        found.update(opened)
    return frozenset(found)


def reachable_by_jobs(
    reached: float, jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView, done: Collection[str]
) -> float:
    """Share of a goal that is within reach: of what is not reached, the share of the open jobs that are.

    With half of four jobs done, and somebody left who is able to do one of the others, it is 0.75. Where no job is
    open, what is missing is within reach of whoever is left.

    Args:
        reached: share of the goal, 0..1.
        jobs, groups, fleet, done: as of ``within_reach``.
    """
    n_open = sum(name not in done for name in jobs)
    if not n_open:
        return 1.0 if left(fleet) else reached
    n_within = sum(name not in done for name in within_reach(jobs, groups, fleet, done))
    if not n_within:
        return reached  # not a rounding error beside it: it is compared
    return 1.0 - (1.0 - reached) * (n_open - n_within) / n_open


def reachable_fraction(truth: Truth, jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView) -> float:
    """Share of the goal of a mission that is reached, or within reach of those left, 0..1.

    A truth may say it itself. Else it follows from the jobs of the mission: done are those that a vehicle has finished.

    Args:
        truth: of the run.
        jobs, groups, fleet: as of ``within_reach``.
    """
    reached, own = truth.goal_fraction, getattr(truth, "reachable_fraction", None)
    if own is not None:
        return max(reached, float(own(fleet)))
    done = {objective.argument for vehicle in fleet.vehicles for objective in vehicle.finished} & jobs.keys()
    return reachable_by_jobs(reached, jobs, groups, fleet, done)
