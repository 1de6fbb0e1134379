"""Ground truth: referee of a run, its views, and the achievable share of the goal.

``goal_fraction`` is relative to all declared work, whatever vehicles remain, so it shows failure but not its cause. The
reachable fraction adds what remaining vehicles are able to do: below 1, vehicles were lacking, at 1, planning or time.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from remoras.activities import Objective, Wait
from remoras.database import VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.work import Job, Point, vehicles_taken

if TYPE_CHECKING:
    from remoras.executive.layer import Decision
    from remoras.fleet.vehicle import Vehicle

COMPLETE = "mission_complete"
"""Milestone of a mission with its goal and rendezvous complete."""


@dataclass(frozen=True, slots=True)
class Milestone:
    """Event of the report; ``vehicle`` or ``group`` may be empty.

    >>> Milestone(1774.0, "mapping_done", "AUV01").group
    ''
    """

    time_s: float
    name: str
    vehicle: str = ""
    group: str = ""


class VehicleView:
    """Read-only view of a vehicle for the referee: ``name``, true ``data`` in this run, and more.

    >>> from missions.runs.assembly import assemble
    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> fleet = assemble(resolved(load("mapping-rendezvous")), 1)
    >>> vehicle: VehicleView = fleet.view.vehicles[0]
    >>> vehicle.name, vehicle.position_m, vehicle.leads("Operational")
    ('ASV00', (0.0, 0.0), False)
    """

    __slots__ = ("_decision", "_functional", "_performed", "_social", "_vehicle", "data", "name")
    name: Final[str]
    data: Final[VehicleData]

    def __init__(self, vehicle: Vehicle) -> None:
        self.name, self.data = vehicle.name, vehicle.functional.data
        self._vehicle, self._social, self._functional = vehicle, vehicle.social, vehicle.functional
        self._decision: Decision | None = None
        self._performed: tuple[str, ...] = ()

    @property
    def position_m(self) -> Point:
        """True position."""
        motion = self._functional.motion
        return motion.x_m, motion.y_m

    @property
    def speed_mps(self) -> float:
        """True speed over ground."""
        return self._functional.guidance.ground_mps

    @property
    def makes_headway(self) -> bool:
        """False while it makes no progress towards its target (``remoras.functional.guidance``)."""
        return not self._functional.headway.is_lost

    @property
    def waits(self) -> Wait | None:
        """Condition that it waits for; None without one or if not alive."""
        return self._functional.waits if self._functional.is_on else None

    @property
    def is_alive(self) -> bool:
        """True while energy remains and no fault has removed it."""
        return self._functional.is_on

    @property
    def is_in_contact(self) -> bool:
        """True while alive and able to send and receive; modem faults count only if it communicates."""
        vehicle = self._vehicle
        condition = vehicle.condition
        is_cut_off = (condition.is_mute or condition.is_deaf) and vehicle.radio.communicates
        return self._functional.is_on and not is_cut_off

    @property
    def communicates(self) -> bool:
        """True if it sends and receives packets."""
        return self._vehicle.radio.communicates

    @property
    def will_return(self) -> bool:
        """True while it has energy and a temporary fault keeps it out of contact."""
        vehicle = self._vehicle
        return vehicle.condition.will_return and not (self.is_in_contact or vehicle.functional.exhausted)

    @property
    def able_data(self) -> VehicleData | None:
        """Its data without permanently failed sensors; None if it can do no more work."""
        vehicle, condition = self._vehicle, self._vehicle.condition
        if self._functional.exhausted or vehicle.has_resigned or condition.lost_for_good or not self.makes_headway:
            return None
        if not condition.dead_for_good:
            return self.data
        working = tuple(sensor for sensor in self.data.sensors if sensor.name not in condition.dead_for_good)
        return replace(self.data, sensors=working)

    @property
    def sensing(self) -> tuple[str, ...]:
        """Names of its sensors that were on and worked in the last motion tick."""
        sensing = self._functional.sensors.looking
        return sensing if sensing and self._functional.is_on else ()

    @property
    def organisation(self) -> Organisation:
        """Groups and roles in its view."""
        return self._social.organisation

    @property
    def performed(self) -> tuple[str, ...]:
        """Names of performed activity sets; the same object until the next decision."""
        executive = self._vehicle.executive
        if self._decision is not executive.decision:  # saves 2.6 % of the instructions of a mission
            self._decision = executive.decision
            self._performed = tuple(executive.sets[index].name for index in executive.decision.chosen)
        return self._performed

    @property
    def finished(self) -> Sequence[Objective]:
        """Completed objectives, in order."""
        return tuple(self._social.finished)

    @property
    def issued(self) -> Iterable[RoleAssignment]:
        """Role assignments that it has given."""
        return frozenset(self._social.planner.orders.issued)

    @property
    def issued_objectives(self) -> Iterable[Objective]:
        """Objectives that it has given to roles."""
        return frozenset(self._social.planner.orders.issued_objectives)

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        """Return the objectives of ``vehicle`` in its view."""
        return self._social.objectives_of(vehicle)

    def leads(self, group: str) -> bool:
        """Return whether it leads ``group`` and has the social layer."""
        return self._social.leads(group)

    def has_planned(self, group: str) -> bool:
        """Return whether it has planned the mission of ``group``."""
        return self._social.planner.has_planned(group)

    def gives_out(self, group: str) -> bool:
        """Return whether ``group`` has work that it has to assign or to confirm."""
        return self._social.gives_out(group)

    def can_play(self, group: str, role: str) -> bool:
        """Return whether it is able to play that role of the group."""
        return self._vehicle.data.can_play(group, role)

    @property
    def is_patient(self) -> bool:
        """True during the grace period: while isolated it leaves the jobs of others alone."""
        return self._social.is_patient

    def has_met(self, group: str) -> bool:
        """Return whether it believes ``group`` gathered."""
        return group in self._vehicle.functional.picture.groups.gathered


class FleetView(NamedTuple):
    """Read-only view of the fleet for the referee: all vehicles in node order.

    >>> from missions.runs.assembly import assemble
    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> fleet = assemble(resolved(load("mapping-rendezvous")), 1)
    >>> view: FleetView = fleet.view
    >>> [vehicle.name for vehicle in view.vehicles]
    ['ASV00', 'AUV00', 'AUV01', 'AUV02']
    """

    vehicles: tuple[VehicleView, ...]

    @classmethod
    def of(cls, vehicles: Iterable[Vehicle]) -> FleetView:
        """Create the view of these vehicles."""
        return cls(tuple(VehicleView(vehicle) for vehicle in vehicles))


class Truth(Protocol):
    """Referee of one run: observes everything, sends nothing to vehicles.

    It may define ``reachable_fraction(fleet)``, the share of the goal reached or achievable; else jobs determine it.

    >>> from missions.runs.assembly import assemble
    >>> from missions.runs.setup import resolved
    >>> from missions.scenarios import load
    >>> fleet = assemble(resolved(load("mapping-rendezvous")), 1)
    >>> truth: Truth = fleet.truth
    >>> truth.goal_fraction, truth.is_over, truth.milestones
    (0.0, False, [])
    """

    @property
    def milestones(self) -> Sequence[Milestone]:
        """Milestones to date."""

    @property
    def goal_fraction(self) -> float:
        """Achieved share, 0..1, of all declared work, whatever vehicles remain; 1 is complete."""

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Observe the fleet after a motion tick or consultation round; True if complete."""

    @property
    def is_over(self) -> bool:
        """True once an incomplete run cannot progress; the run ends then."""

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Return the reason if the mission is not complete, else an empty text."""


def left(fleet: FleetView) -> list[tuple[VehicleView, VehicleData]]:
    """Return the remaining vehicles with their remaining abilities."""
    return [(vehicle, data) for vehicle in fleet.vehicles if (data := vehicle.able_data) is not None]


def within_reach(
    jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView, done: Collection[str]
) -> frozenset[str]:
    """Return the jobs done or achievable by remaining vehicles, prerequisites included.

    A vehicle needs the job's abilities and a role with it, if any; a job for several needs as many in contact.
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

    reachable = set(done) & jobs.keys()
    able = [name for name in jobs if name not in reachable and can_be_done(name)]
    # A job done may open others: repeat until none is added.
    while opened := [name for name in able if name not in reachable and reachable.issuperset(jobs[name].needs)]:
        reachable.update(opened)
    return frozenset(reachable)


def reachable_by_jobs(
    reached: float, jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView, done: Collection[str]
) -> float:
    """Return the achievable share of a goal: 0.75 if of four jobs two are done, one achievable."""
    n_open = sum(name not in done for name in jobs)
    if not n_open:
        # Without open jobs, any remaining vehicle can do the rest.
        return 1.0 if left(fleet) else reached
    n_within = sum(name not in done for name in within_reach(jobs, groups, fleet, done))
    if not n_within:
        return reached  # exact: compared with the reached share
    return 1.0 - (1.0 - reached) * (n_open - n_within) / n_open


def reachable_fraction(truth: Truth, jobs: Mapping[str, Job], groups: Iterable[Group], fleet: FleetView) -> float:
    """Return the share of the goal reached or achievable, 0..1, by the truth or else by jobs."""
    reached, own = truth.goal_fraction, getattr(truth, "reachable_fraction", None)
    if own is not None:
        return max(reached, float(own(fleet)))
    done = {objective.argument for vehicle in fleet.vehicles for objective in vehicle.finished} & jobs.keys()
    return reachable_by_jobs(reached, jobs, groups, fleet, done)


class HolderCount:
    """Count of vehicles' beliefs about the holders of others' jobs, and of the wrong ones."""

    def __init__(self) -> None:
        self.n_believed = 0
        self.n_wrong = 0
        self._last: Sequence[tuple[str, Organisation]] = ()
        self._last_counts = 0, 0

    def compare(self, believed: Sequence[tuple[str, Organisation]]) -> None:
        """Add the beliefs of living vehicles at one time; holders are those in their own view."""
        if believed != self._last:  # saves 0.9 % of the instructions of a mission
            self._last, self._last_counts = believed, self._counts(believed)
        n_believed, n_wrong = self._last_counts
        self.n_believed += n_believed
        self.n_wrong += n_wrong

    def _counts(self, believed: Sequence[tuple[str, Organisation]]) -> tuple[int, int]:
        if not believed:
            return 0, 0
        jobs = [(g.name, role.name) for g in believed[0][1].groups.values() for role in g.roles if role.job is not None]
        counts = [self._counts_of_role(believed, group, role) for group, role in jobs]
        return sum(n for n, _ in counts), sum(n for _, n in counts)

    @staticmethod
    def _counts_of_role(believed: Sequence[tuple[str, Organisation]], group: str, role: str) -> tuple[int, int]:
        named = {name: organisation.members(group, role) for name, organisation in believed}
        holders = {name for name, own in named.items() if name in own}
        # Unknown holders are not wrong: vehicles with private claims name none.
        of_others = [own for name, own in named.items() if own and own != (name,)]
        return len(of_others), sum(not holders.issuperset(own) for own in of_others)

    @property
    def wrong_fraction(self) -> float | None:
        """Share of wrong pairs; None without any."""
        return round(self.n_wrong / self.n_believed, 6) if self.n_believed else None
