"""Ground truth: the interface of its views, and the achievable share of the goal.

The goal is the whole of the work that a scenario declares, whoever is left to do it: losing vehicles never brings it
nearer. What those who are left could still reach is told beside it, see ``remoras.truth``.

``goal_fraction`` is judged over the whole of the work, so it says that a mission has failed and not why. Beside it the
reachable fraction tells want of vehicles (below 1) from want of sense or time (1): at the end of a run, what was done
and what those left are able to do. A vehicle is left if it is alive or will be back, has energy to spare for work,
makes headway, and its sensors work, or will. How long the rest would take, and whether the energy lasts for it, is not
asked.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from remoras.activities import Objective, Wait
from remoras.database import VehicleData
from remoras.organisation import Group, Organisation
from remoras.work import Job, Point, vehicles_taken

COMPLETE = "mission_complete"
"""The milestone of a mission that has all of its goal and its meetings."""


@dataclass(frozen=True, slots=True)
class Milestone:
    """Something worth a line in the report: ``vehicle`` or ``group`` may be empty."""

    time_s: float
    name: str
    vehicle: str = ""
    group: str = ""


class VehicleView(Protocol):
    """Read-only view of a vehicle for the mission's referee."""

    @property
    def name(self) -> str:
        """Name of the vehicle."""

    @property
    def position_m(self) -> Point:
        """Where it really is."""

    @property
    def speed_mps(self) -> float:
        """How fast it really moves."""

    @property
    def makes_headway(self) -> bool:
        """False once it came no nearer to where it was guided for long, until it does again."""

    @property
    def waits(self) -> Wait | None:
        """What it waits for; None while it gets on by itself, or is not alive."""

    @property
    def data(self) -> VehicleData:
        """What it really is in this run."""

    @property
    def is_alive(self) -> bool:
        """True while it has energy and no fault has taken it away."""

    @property
    def is_in_contact(self) -> bool:
        """True while it is alive, hears and is heard; where the strategy uses no modem, whatever that does."""

    @property
    def communicates(self) -> bool:
        """True if it sends and hears packets."""

    @property
    def will_return(self) -> bool:
        """True while a fault keeps it out of contact that will be over, and it has energy."""

    @property
    def able_data(self) -> VehicleData | None:
        """What it is left with for work: its data, without sensors that are dead for good.

        None once it is gone for good, its battery is empty, it has resigned, or while it makes no headway.
        """

    @property
    def sensing(self) -> tuple[str, ...]:
        """Names of its sensors that were on, and worked, in the last motion tick."""

    @property
    def organisation(self) -> Organisation:
        """Groups and roles as the vehicle sees them."""

    @property
    def performed(self) -> tuple[str, ...]:
        """Names of the activity sets that it performs; the same object until it decides anew."""

    @property
    def finished(self) -> Sequence[Objective]:
        """Objectives for which it has done all there was to do, in order."""

    @property
    def issued(self) -> Iterable[Any]:
        """Role assignments that it has given out."""

    @property
    def issued_objectives(self) -> Iterable[Objective]:
        """Objectives that it has given to roles."""

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Objectives that ``vehicle`` has, as this one sees it."""

    def leads(self, group: str) -> bool:
        """True if it is a head of ``group`` and has the social layer."""

    def has_planned(self, group: str) -> bool:
        """True once it has planned the mission of ``group``."""

    def gives_out(self, group: str) -> bool:
        """True while ``group`` has work that it still has to give out or to see done."""

    def can_play(self, group: str, role: str) -> bool:
        """True if it is able to play that role of the group."""

    @property
    def is_patient(self) -> bool:
        """True while it is cut off and leaves to others what it will do itself if they do not come."""

    def has_met(self, group: str) -> bool:
        """True if it takes ``group`` for gathered."""


class FleetView(Protocol):
    """Read-only view of the fleet for the mission's referee."""

    @property
    def vehicles(self) -> Sequence[VehicleView]:
        """Every vehicle, in the order of the nodes."""
        ...


class Truth(Protocol):
    """Watches one run from outside; it sees everything and tells the vehicles nothing.

    It may also have ``reachable_fraction(fleet) -> float``, the share of its goal that is reached or that the vehicles
    left could still reach. Without it that follows from the jobs of the mission, see ``remoras.truth``.
    """

    @property
    def milestones(self) -> Sequence[Milestone]:
        """What has happened so far."""
        ...

    @property
    def goal_fraction(self) -> float:
        """Share of the mission's whole declared goal that is reached on the ground, 0..1; 1 is needed to complete.

        It counts all of the work, whoever is left to do it.
        """
        ...

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Look at the fleet after a motion tick or a round of consultation; True if the mission is complete."""
        ...

    @property
    def is_over(self) -> bool:
        """True once nothing more will come of the run although the mission is not complete: it ends then."""
        ...

    def close(self, fleet: FleetView, now_s: float) -> str:
        """End of the run: the reason if the mission is not complete, else an empty text."""
        ...


def left(fleet: FleetView) -> list[tuple[VehicleView, VehicleData]]:
    """Vehicles that are left for work, each with the data of what it is left with."""
    return [(vehicle, data) for vehicle in fleet.vehicles if (data := vehicle.able_data) is not None]


def within_reach(
    jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView, done: Collection[str]
) -> frozenset[str]:
    """Names of the jobs that are done, or that those left are able to do, as all that must be done before.

    Who is able has what the job takes and can play a role that has it; a job without a role is open to all. A job that
    takes several vehicles at once takes as many who are in contact, or will be.

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

    def can_be_done(name: str) -> bool:
        n_taken = vehicles_taken(jobs[name])
        if n_taken == 1:
            return any(is_able(name, *worker) for worker in workers)
        crew = [worker for worker in workers if worker[0].is_in_contact or worker[0].will_return]
        return sum(is_able(name, *worker) for worker in crew) >= n_taken

    found = set(done) & jobs.keys()
    able = [name for name in jobs if name not in found and can_be_done(name)]
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
