"""Base of missions whose groups do jobs and meet at a rally point; ``remoras new mission NAME`` writes an example."""

from __future__ import annotations

from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import Field, field_validator

from missions.errors import ConfigurationFault, one_of, repeated
from missions.figure import Place
from missions.meeting.meeting import (
    GATHERING,
    MEET,
    NEEDS,
    OBJECTIVES,
    RENDEZ_VOUS,
    SUPERVISION,
    Meeting,
    MeetingSettings,
    Pursuit,
    entrusted,
    importance_of,
)
from missions.meeting.truth import JOBS, JobTruth, MeetingTruth
from missions.scenarios.fleet import VehicleTable
from missions.scenarios.organisation import Role, groups_of
from missions.scenarios.scenario import Scenario
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType, Objective
from remoras.behaviours import ADVANCING, CAPTURE_M, DONE, IDLE, Approach, Behaviour, Perception, Reference, distance_m
from remoras.beliefs import Beliefs, Key, Known
from remoras.database import VehicleData
from remoras.errors import PlanningError, PluginError
from remoras.htn import Domain, FactsLike, Method, Task
from remoras.mission import ABILITIES, ALLOCATE_ROLES, ASSIGN_OBJECTIVE, Finding, Mission
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.recorder import Recorder, Table
from remoras.work import IS_IMPOSSIBLE, Job, Outlook, Point, vehicles_taken

DONE_BY = "jobDone"  # attribute of a job: vehicle that has done it
THERE_M = 2.0


@dataclass(frozen=True)
class AnyonesJob:
    """Base of a ``remoras.work.Job`` that any vehicle can do and no job precedes."""

    name: str
    needs: ClassVar[tuple[str, ...]] = ()

    @property
    def done(self) -> Key:
        """Fact that a vehicle has done it."""
        return DONE_BY, self.name

    def is_able(self, data: VehicleData) -> bool:
        """Return True for every vehicle."""
        return True


@dataclass(frozen=True)
class StayJob(AnyonesJob):
    """Job done by a stay of ``stay_s`` at a place."""

    place_m: Point
    stay_s: float

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after travel and stay."""
        return outlook.stayed(self.place_m, self.stay_s, data)


@dataclass(frozen=True)
class ReportedJob(AnyonesJob):
    """Job done by a stay at a place that is known once reported; a successor restarts the stay."""

    stay_s: float
    place_m: Point = (0.0, 0.0)
    share_left: float = 1.0
    resumed: ClassVar[bool] = False
    placed_by: ClassVar[str]

    def left(self, facts: Known) -> Self | None:
        """Return the job at the reported place; None before any report."""
        place_m = facts.get((self.placed_by, self.name))
        return None if place_m is None else replace(self, place_m=place_m, share_left=self.share_by(facts))

    def share_by(self, facts: Known) -> float:
        """Remaining share by known facts: 1, or 0 once done."""
        return 1.0 if facts.get(self.done) is None else 0.0

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after travel and what is left of the stay; None if unable."""
        if not self.is_able(data):
            return None
        return outlook if self.share_left == 0.0 else outlook.stayed(self.place_m, self.stay_s, data)


def to_stay(place_m: Point, speed_mps: float, motion: Motion) -> Reference:
    """Head for a place; hold there."""
    is_there = distance_m(motion, place_m) <= CAPTURE_M
    return Reference(place_m, 0.0) if is_there else Reference(place_m, speed_mps, CAPTURE_M)


class Stay:
    """Travel to a place and dwell there; an interrupted dwell restarts."""

    def __init__(self, data: VehicleData) -> None:
        self._speed_mps = data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._since_s: float | None = None

    def perceive(self, to_go_m: float, stay_s: float, now_s: float, performed: bool) -> Perception:
        """Pending, nearest first; progresses on the way and on site; done after ``stay_s`` on site."""
        if to_go_m > THERE_M or not performed:
            self._since_s = None
            return self._approach.perceived(to_go_m, now_s, performed)
        self._since_s = now_s if self._since_s is None else self._since_s
        return DONE if now_s - self._since_s >= stay_s else ADVANCING

    def begin_anew(self) -> None:
        """Discard the elapsed dwell."""
        self._since_s = None

    def reference(self, place_m: Point, motion: Motion) -> Reference:
        """Head for the place in transit; hold there."""
        return to_stay(place_m, self._speed_mps, motion)


class Staying(Behaviour):
    """Travel to a job's place, once known, and dwell there."""

    def __init__(self, job: Any, data: VehicleData) -> None:
        self._job, self._stay = job, Stay(data)
        self._place_m: Point | None = None

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the dwell ends, nearest first; progresses on the way and on site."""
        job = self._job.left(picture.facts) if isinstance(self._job, ReportedJob) else self._job
        if job is None:
            return IDLE
        if picture.facts.get(job.done) is not None:
            return DONE
        self._place_m = job.place_m
        return self._stay.perceive(distance_m(motion, job.place_m), job.stay_s, picture.body.now_s, performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return None if self._place_m is None else self._stay.reference(self._place_m, motion)


Tables = TypeVar("Tables", bound=Scenario)


def founding_of(scenario: Scenario) -> list[str]:
    """Return the names of the initially assigned roles of the first group."""
    return [role.name for role in scenario.group[0].role if role.founding]


def job_role(who: str, job: str, influences: Sequence[str] = ()) -> Role:
    """Return the role ``WHO of JOB`` for one vehicle, whose calls address ``influences``."""
    return Role(name=f"{who} of {job}", maximum=1, job=job, influences=tuple(influences))


def with_job_roles(
    scenario: Tables,
    roles: Sequence[Role],
    needs: Mapping[str, int],
    addressed: Sequence[str] = (),
    able: Callable[[VehicleTable], bool] = lambda vehicle: bool(vehicle.playable_roles),
) -> Tables:
    """Return the scenario with roles added to its first group, for ``able`` vehicles, and defaults for needs.

    Signals of initially assigned roles also address ``addressed``.
    """
    first = scenario.group[0]
    listed = {role.job for role in first.role}
    # A role that the scenario lists for a job replaces the generated one.
    new = [role for role in roles if role.job not in listed]
    if not new:
        return scenario
    old = [
        role.model_copy(update={"influences": (*role.influences, *addressed)}) if addressed and role.founding else role
        for role in first.role
    ]
    group = first.model_copy(update={"role": (*old, *new)})
    vehicles = [
        playing(vehicle, [role.name for role in new]) if able(vehicle) else vehicle for vehicle in scenario.vehicle
    ]
    completed = scenario.model_copy(update={"group": (group, *scenario.group[1:]), "vehicle": tuple(vehicles)})
    return with_needs(completed, needs)


def playing(vehicle: VehicleTable, roles: Sequence[str]) -> VehicleTable:
    """Return the vehicle with ``roles`` added to its playable ones."""
    played = vehicle.playable_roles or ()
    return vehicle.model_copy(update={"playable_roles": (*played, *(role for role in roles if role not in played))})


def with_needs(scenario: Tables, needs: Mapping[str, int]) -> Tables:
    """Return the scenario with default urgencies of needed attributes."""
    communication = scenario.communication
    stated = communication.model_copy(update={"needs": {**needs, **communication.needs}})
    return scenario.model_copy(update={"communication": stated})


def numbered(kind: str, number: int) -> tuple[str, ...]:
    """Return numbered names, such as ``lift 1``."""
    return tuple(f"{kind} {n}" for n in range(1, number + 1))


def listed_faults(
    scenario: Scenario, kind: str, *keys: str, taken: Collection[str] = ()
) -> Iterator[ConfigurationFault]:
    """Yield faults of tables ``[[kind]]``: places (``keys``) outside the world, and names in use (``taken``)."""
    tables = getattr(scenario, kind)
    yield from scenario.world.outside((f"{kind}.{t.name}.{key}", getattr(t, key)) for t in tables for key in keys)
    yield from names_apart(scenario, (kind,), taken)


def names_apart(scenario: Scenario, kinds: Sequence[str], taken: Collection[str] = ()) -> Iterator[ConfigurationFault]:
    """Yield faults: names in tables of these kinds used twice, ``taken``, or of vehicles, groups or rally points."""
    others = {*taken, *scenario.taken_names()}
    listed = [(kind, table.name) for kind in kinds for table in getattr(scenario, kind)]
    counts = Counter(name for _, name in listed)
    for kind, name in dict.fromkeys(listed):
        if (n_uses := counts[name] + (name in others)) > 1:
            allowed = f"used {n_uses} times; each {kind} needs a name of its own"
            yield ConfigurationFault(f"{kind}.{name}.name", "", allowed)


def importance_faults(scenario: Any, objectives: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Yield unknown roles and objectives in ``[mission.importance]``."""
    for key in scenario.mission.importance:
        path, dot, objective = key.rpartition(".")
        names = [f"{group}.{name}" if "." in path else name for group, name in scenario.roles]
        yield from one_of(f"mission.importance.{key}", objective, objectives)
        yield from one_of(f"mission.importance.{key}", path if dot else None, names)


WORK = "Work"  # key of the default importance of job objectives; task of (group, role, job)
WORKING = (ALLOCATE_ROLES, WORK, MEET)
IMPORTANCE = {WORK: 0.6, RENDEZ_VOUS: 0.3, GATHERING: 0.18, SUPERVISION: 0.1}


class JobSettings(MeetingSettings):
    """Table ``[mission]``; missions with additional settings subclass it.

    >>> JobSettings(importance={"Work": 0.8}).importance["RendezVous"]
    0.3
    """

    importance: dict[str, Annotated[float, Field(ge=0.0, le=1.0)]] = Field(
        IMPORTANCE, description=f"importance of objectives, by Role.Objective or by Objective: {', '.join(IMPORTANCE)}"
    )

    @field_validator("importance")
    @classmethod
    def _beside_the_others(cls, importance: dict[str, float]) -> dict[str, float]:
        return {**IMPORTANCE, **importance}


class JobScenario(Scenario):
    """Input of a run; missions with additional tables subclass it.

    >>> from missions.scenarios import load
    >>> scenario = load("recovery-field")
    >>> isinstance(scenario, JobScenario), scenario.mission.arrival_radius_m
    (True, 25.0)
    """

    mission: JobSettings = JobSettings.usual()


class JobMission(Mission):
    """Mission of jobs, see the module; built from a scenario that has passed every check.

    >>> from missions.fieldwork.mission import RecoveryMission
    >>> from missions.scenarios import load
    >>> mission: JobMission = RecoveryMission.from_scenario(load("recovery-field"))
    >>> mission.objective, list(mission.jobs)[:2]
    ('Recovering', ['site 1', 'site 2'])
    """

    Scenario: ClassVar[type[Any]] = JobScenario
    needs = NEEDS
    tables: ClassVar[tuple[Table, ...]] = (JOBS,)
    objective: ClassVar[str]
    """Objective and activity of every role with a job; suffix of ``objective...``."""
    other_objectives: ClassVar[tuple[str, ...]] = ()
    """Further objectives of its roles, beside those of the meeting."""
    collective: ClassVar[tuple[str, ...]] = ()
    """Objectives that need interaction, beside those of the meeting."""
    kind: ClassVar[str] = "Job"

    def __init__(self, scenario: Any) -> None:
        if not getattr(self, "objective", ""):
            raise PluginError(f"{type(self).__name__} lacks objective, the name of the objective of roles with a job")
        self.scenario = scenario
        jobs = list(self.jobs_of(scenario))
        self._jobs = {job.name: job for job in jobs}
        for name, _ in repeated(job.name for job in jobs):
            raise PluginError(f"{type(self).__name__}.jobs_of gives several jobs the name {name!r}; rename one")
        self.groups = {group.name: group for group in groups_of(scenario)}
        self.meeting = Meeting(
            self.groups,
            {point.name: point.position_m for point in scenario.rally_point},
            scenario.mission,
            scenario.mission.importance,
            self.meets_from_s(scenario),
            self._jobs,
            ABILITIES in self.vocabulary_used,
        )

    @classmethod
    def check(cls, scenario: Any) -> Iterable[ConfigurationFault]:
        return importance_faults(scenario, (WORK, *OBJECTIVES, cls.objective, *cls.other_objectives))

    # Interface for subclasses --------------------------------------------------------------------

    @abstractmethod
    def jobs_of(self, scenario: Any) -> Iterable[Job]:
        """Return the jobs of a scenario; called once."""

    def behaviour_at(self, job: Any, data: VehicleData) -> Behaviour:
        """Create the behaviour that travels to a job, does it and reports its end; by default a dwell."""
        if (n_taken := vehicles_taken(job)) > 1:
            raise PlanningError(f"job {job.name!r} takes {n_taken} vehicles at once; give it a behaviour of its own")
        if hasattr(job, "stay_s"):
            return Staying(job, data)
        raise PlanningError(f"job {job.name!r} has no behaviour")

    def switched_on(self, job: Job, data: VehicleData) -> tuple[str, ...]:
        """Return the sensors switched on for a job; by default all."""
        return tuple(sensor.name for sensor in data.sensors)

    def meets_from_s(self, scenario: Any) -> float:
        """Earliest time (s) of the rendezvous; 0 by default."""
        return 0.0

    # Defaults ------------------------------------------------------------------------------------

    @classmethod
    def from_scenario(cls, scenario: Any) -> Self:
        return cls(scenario)

    @property
    def jobs(self) -> Mapping[str, Job]:
        return self._jobs

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        return [(self.kind, name) for name in self._jobs]

    @property
    def places(self) -> Sequence[Place]:
        sites = (Place(job.name, self.kind.lower(), (job.place_m,)) for job in self._jobs.values())
        return [*self.rally_places, *sites]

    @property
    def rally_places(self) -> list[Place]:
        """Rally points."""
        return [Place(name, "rally point", (at_m,)) for name, at_m in self.meeting.rally_points_m.items()]

    @property
    def social_domain(self) -> Domain:
        return Domain.of(
            self.meeting.operators(self.objective),
            {**dict.fromkeys(self.group_missions, self._methods()), WORK: entrusted(self._orders)}
            | self.meeting.methods(),
        )

    def _methods(self) -> list[Method]:
        def together(facts: FactsLike, group: str) -> bool:
            return facts.get(("gatheredAt", group)) is not None

        def work(facts: FactsLike, group: str) -> list[Task]:
            tasks = [Task(WORK, (group, role, job)) for role, job in self._unfinished(facts, group)]
            return [Task(ALLOCATE_ROLES, (group,)), *tasks, Task(MEET, (group,))]

        return [
            Method.fixed("stay together", applicable=together),
            Method("work, then meet", work, lambda facts, group: bool(self._unfinished(facts, group)), WORKING),
            Method("meet", lambda facts, group: [Task(MEET, (group,))], uses=(MEET,)),
        ]

    def _orders(self, group: str, role: str) -> list[Task]:
        declared = self.groups[group].role(role)
        job = None if declared is None else declared.job
        return [] if job is None else [Task(ASSIGN_OBJECTIVE, (group, role, self.objective, job))]

    def _unfinished(self, facts: FactsLike, group: str) -> list[tuple[str, str]]:
        roles = [(role.name, role.job) for role in self.groups[group].roles if role.job is not None]
        return [(role, job) for role, job in roles if facts.get(self._jobs[job].done) is None]

    def _open(self, facts: FactsLike, group: str) -> bool:
        says_impossible = self.meeting.says_impossible
        return any(
            not (says_impossible and facts.get((IS_IMPOSSIBLE, job))) for _, job in self._unfinished(facts, group)
        )

    def ends_of(self, job: str) -> frozenset[Key]:
        """Facts that end a job: done or, for jobs of several vehicles, impossible."""
        work = self._jobs[job]
        impossible = {(IS_IMPOSSIBLE, job)} if self.meeting.says_impossible and vehicles_taken(work) > 1 else set[Key]()
        return frozenset({work.done, *impossible})

    def founding_objectives(self) -> Sequence[Objective]:
        return self.meeting.founding_objectives()

    def is_individual(self, objective: Objective) -> bool:
        return objective.name not in (*OBJECTIVES, *self.collective)

    def activity_sets(self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point) -> Pursuit:
        if objective.name in OBJECTIVES:
            return self.meeting.activity_sets(objective, data.name, facts)
        job = self._jobs[objective.argument]
        ends = self.ends_of(job.name) | {("gatheredAt", objective.group)}
        # A leader may withdraw that a job is impossible, which leaves the fact False.
        if any(facts.get(key) not in (None, False) for key in ends):
            return (), ends
        doing = Activity(self.objective, ActivityType.GUIDANCE, (job.name,), self.switched_on(job, data))
        return (ActivitySet(objective, ActivityKind.INDIVIDUAL, (doing,), self.importance_of(objective)),), ends

    def importance_of(self, objective: Objective, default: float | None = None) -> float:
        """Importance of an objective: its own, or the default, by default that of jobs."""
        usual = self.meeting.importance[WORK] if default is None else default
        return importance_of({objective.name: usual, **self.meeting.importance}, objective)

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        behaviour = self.meeting.behaviour(activity, data)
        return self.behaviour_at(self._jobs[activity.parameters[0]], data) if behaviour is None else behaviour

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        if objective.name != self.objective:
            return None
        attribute, job = self._jobs[objective.argument].done
        return Finding(job, attribute, vehicle)

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """Return the leader's finding that its group has gathered: its jobs are over, or the deadline is."""
        if self._open(beliefs, group.name) and not self.meeting.is_overdue(group, beliefs, picture):
            return ()
        return self.meeting.findings(group, organisation, beliefs, picture, motion)

    def truth(self, recorder: Recorder, world: Any) -> MeetingTruth:
        return JobTruth(self.meeting, self.objective, recorder)
