"""Ground truth: referee of a run, its views, and the achievable share of the goal.

``goal_fraction`` is relative to all declared work, whatever vehicles remain, so it shows failure but not its cause. The
reachable fraction adds what remaining vehicles are able to do: below 1, vehicles were lacking, at 1, planning or time.
A vehicle remains if it is alive or will return, has energy to spare, makes headway, and has working sensors. Time and
energy for the rest are not considered.
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
"""Milestone of a mission with its goal and rendezvous complete."""


@dataclass(frozen=True, slots=True)
class Milestone:
    """Event of the report; ``vehicle`` or ``group`` may be empty."""

    time_s: float
    name: str
    vehicle: str = ""
    group: str = ""


class VehicleView(Protocol):
    """Read-only view of a vehicle for the referee."""

    @property
    def name(self) -> str:
        """Name of the vehicle."""

    @property
    def position_m(self) -> Point:
        """True position."""

    @property
    def speed_mps(self) -> float:
        """True speed."""

    @property
    def makes_headway(self) -> bool:
        """False while it has not approached its target for long."""

    @property
    def waits(self) -> Wait | None:
        """Condition that it waits for; None while it progresses, or is not alive."""

    @property
    def data(self) -> VehicleData:
        """True properties in this run."""

    @property
    def is_alive(self) -> bool:
        """True while it has energy and no fault has removed it."""

    @property
    def is_in_contact(self) -> bool:
        """True while alive, sending and receiving; without a modem in the strategy, while alive."""

    @property
    def communicates(self) -> bool:
        """True if it sends and receives packets."""

    @property
    def will_return(self) -> bool:
        """True during a temporary fault of contact, with energy left."""

    @property
    def able_data(self) -> VehicleData | None:
        """Data of its remaining abilities, without permanently failed sensors.

        None if permanently lost, without energy, withdrawn, or while it makes no headway.
        """

    @property
    def sensing(self) -> tuple[str, ...]:
        """Names of sensors that were on and working in the last motion tick."""

    @property
    def organisation(self) -> Organisation:
        """Organisation as the vehicle knows it."""

    @property
    def performed(self) -> tuple[str, ...]:
        """Names of the performed activity sets; the same object until the next decision."""

    @property
    def finished(self) -> Sequence[Objective]:
        """Completed objectives, in order."""

    @property
    def issued(self) -> Iterable[Any]:
        """Role assignments issued by it."""

    @property
    def issued_objectives(self) -> Iterable[Objective]:
        """Objectives that it gave to roles."""

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Return the objectives of ``vehicle``, as known to this one."""

    def leads(self, group: str) -> bool:
        """True if it is a leader of ``group`` with the social layer."""

    def has_planned(self, group: str) -> bool:
        """True once it has planned the mission of ``group``."""

    def gives_out(self, group: str) -> bool:
        """True while ``group`` has work to assign or unfinished assignments."""

    def can_play(self, group: str, role: str) -> bool:
        """True if it is able to play that role of the group."""

    @property
    def is_patient(self) -> bool:
        """True during the isolation grace period: it still leaves the jobs of others alone."""

    def has_met(self, group: str) -> bool:
        """True if it believes ``group`` gathered."""


class FleetView(Protocol):
    """Read-only view of the fleet for the referee."""

    @property
    def vehicles(self) -> Sequence[VehicleView]:
        """All vehicles in node order."""
        ...


class Truth(Protocol):
    """Referee of one run: observes everything, sends nothing to vehicles.

    It may define ``reachable_fraction(fleet) -> float``, the share of the goal reached or achievable by remaining
    vehicles. By default that follows from the jobs of the mission, see ``remoras.truth``.
    """

    @property
    def milestones(self) -> Sequence[Milestone]:
        """Milestones to date."""
        ...

    @property
    def goal_fraction(self) -> float:
        """Achieved share of the declared goal, 0..1; 1 is required to complete.

        It includes all work, whatever vehicles remain.
        """
        ...

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Observe the fleet after a motion tick or consultation round; True if complete."""
        ...

    @property
    def is_over(self) -> bool:
        """True once an incomplete run cannot progress; the run ends then."""
        ...

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Return the reason if the mission is not complete, else an empty text."""
        ...


def left(fleet: FleetView) -> list[tuple[VehicleView, VehicleData]]:
    """Return the remaining vehicles with their remaining abilities."""
    return [(vehicle, data) for vehicle in fleet.vehicles if (data := vehicle.able_data) is not None]


def within_reach(
    jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView, done: Collection[str]
) -> frozenset[str]:
    """Return the jobs done or achievable by remaining vehicles, prerequisites included.

    A vehicle needs the abilities of the job and a role with it; a job without a role is open to all. A job for several
    vehicles needs as many in contact, now or later.

    Args:
        groups: with the roles that have jobs.
        done: names of finished jobs.
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
    """Return the achievable share of a goal, from the share of open jobs within reach.

    With half of four jobs done and one of the others achievable, it is 0.75. Without open jobs, the rest is achievable
    by any remaining vehicle.
    """
    n_open = sum(name not in done for name in jobs)
    if not n_open:
        return 1.0 if left(fleet) else reached
    n_within = sum(name not in done for name in within_reach(jobs, groups, fleet, done))
    if not n_within:
        return reached  # exact: compared with the reached share
    return 1.0 - (1.0 - reached) * (n_open - n_within) / n_open


def reachable_fraction(truth: Truth, jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView) -> float:
    """Return the share of a mission's goal reached or achievable, 0..1.

    The truth may define it; else it follows from the jobs, with objectives finished by any vehicle as done.
    """
    reached, own = truth.goal_fraction, getattr(truth, "reachable_fraction", None)
    if own is not None:
        return max(reached, float(own(fleet)))
    done = {objective.argument for vehicle in fleet.vehicles for objective in vehicle.finished} & jobs.keys()
    return reachable_by_jobs(reached, jobs, groups, fleet, done)
