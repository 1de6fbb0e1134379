"""The seam of missions: everything that a mission brings, in one class.

A scenario names the class as ``package.module:Class``. ``missions/mapping`` is one; a how-to writes another. The class
says what its scenarios and results may hold; ``from_scenario`` makes the mission of one scenario. The object then
serves all vehicles of the fleet, so it keeps no state of a run.

Who calls what, and when:

========================  ===========================================================================================
loading a scenario        ``Scenario``, ``completed``, ``check``, ``sensors``, ``vocabulary``, ``group_missions``,
                          ``needs``
setting a run up          ``from_scenario``, ``jobs``, ``world``, ``nature``, ``founding_objectives``, ``truth``,
                          ``tables``, ``instances``, ``instances_found_per_vehicle``, ``most_observations``,
                          ``vocabulary_used``, ``groups_of``
social layer, at sea      ``social_domain``, ``is_individual``, ``activity_domain``, ``activities``,
                          ``activity_sets``, ``findings``, ``conclusions``, ``completion``
functional layer, at sea  ``behaviour_for``
after a run               ``metrics``, ``figures``, ``places``
========================  ===========================================================================================

When a scenario is loaded, what sets a run up is asked once too, so that a fault is said before the run. A mission whose
groups do jobs and then meet is written soonest as a ``missions.meeting.JobMission``, which has an example.

Subclass ``Mission``: what is abstract is compulsory, the rest has a default. Collision avoidance, care for energy and
staying within the borders are the vehicle's own; a mission need not and cannot care for them.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self

from remoras.activities import Activity, ActivitySet, Objective
from remoras.behaviours import Behaviour
from remoras.beliefs import Beliefs, Key, Known
from remoras.database import VehicleData
from remoras.htn import Domain, FactsLike, Task
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.recorder import Recorder, Table
from remoras.sensor import SensorSettings
from remoras.truth import FleetView, Milestone, Truth, VehicleView
from remoras.work import Job, Point
from worldmodel import ontology_path

ABILITIES = ontology_path("abilities")
"""Words by which vehicles say what they are not able to do; a mission lists the file in its ``vocabulary``."""
__all__ = [
    "ALLOCATE_ROLES", "ASSIGN_OBJECTIVE", "DISSOLVE_GROUP", "ELEMENTARY_TASKS", "FORM_GROUP", "GIVE_MISSION", "PURSUE",
    "Finding", "FleetView", "FunctionalPart", "Milestone", "Mission", "Nothing", "SocialPart", "Truth", "VehicleView",
]  # fmt: skip

ALLOCATE_ROLES, GIVE_MISSION, ASSIGN_OBJECTIVE = "AllocateRoles", "GiveMission", "AssignObjective"
FORM_GROUP, DISSOLVE_GROUP = "FormGroup", "DissolveGroup"
ELEMENTARY_TASKS = (ALLOCATE_ROLES, GIVE_MISSION, ASSIGN_OBJECTIVE, FORM_GROUP, DISSOLVE_GROUP)
"""What carries out the elementary tasks of a group's mission; see ``SocialPart.social_domain``."""
PURSUE = "Pursue"
"""The task by which an objective is pursued is called so, with the name of the objective behind; see
``SocialPart.activity_domain``."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A conclusion of a vehicle: a fact to be recorded, by names."""

    subject: str
    attribute: str
    value: str | float | bool | Point


class Nothing(Sequence[Finding]):
    """No finding, and none before a time as long as there is no news: until then a vehicle need not be asked.

    News is any fact that is told or found out but where vehicles are and what energy they have left, another
    organisation, and other sensors of the vehicle that answer.

    Args:
        until_s: by the vehicle's clock (s); infinite if time alone changes nothing.

    Raises:
        ValueError: that is not a number.
    """

    __slots__ = ("until_s",)

    def __init__(self, until_s: float = math.inf) -> None:
        if math.isnan(until_s):
            raise ValueError("nothing is concluded until a time that is not a number: give seconds, or infinity")
        self.until_s = until_s

    def __len__(self) -> int:
        return 0

    def __getitem__(self, place: Any) -> Any:
        raise IndexError(f"finding {place} of none")


class SocialPart(Protocol):
    """What the social layer of a vehicle needs of its mission."""

    @property
    @abstractmethod
    def social_domain(self) -> Domain:
        """HTN that turns missions of groups into elementary tasks, each carried out by the handler that it names.

        Handlers are ``AllocateRoles(group, ...)``, ``GiveMission(group, mission)`` and ``AssignObjective(group, role,
        objective, argument)``, ``FormGroup(group)`` and ``DissolveGroup(group)``; a task that names none is carried out
        by the one of its own name. Beside what the head of the group believes, tests and effects may be of these facts:

        * ``("members", "Group.Role")``: who plays the role and is there; ``("isA", "Instance.Class")``: it is inferred;
        * ``("lost", "Group.Role")``: who has left the role or fallen silent in it, as often as that happened;
        * ``("allocated", group)``: the strategy has allocated the roles, and nobody has left since;
        * ``("objective", "Group.Role.Objective")``: its argument, once it counts;
        * ``("formed", group)``: the group is there; ``("formation", group)``: how often it has been formed at sea;
        * ``("given", "Group.Mission")``: it has it; ``("hasMission", group)``: the newest; ``("data", vehicle)``: data;
        * ``("instances", class)``: names of all that is seen to be of a class, told or concluded.

        A step ``AssignObjective`` runs until its effects hold. If its role falls vacant meanwhile, it has failed.
        """
        ...

    @property
    @abstractmethod
    def jobs(self) -> Mapping[str, Job]:
        """The jobs of the mission by name; roles name them."""
        ...

    @abstractmethod
    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        """Activities by which a vehicle pursues ``objective``, and the facts that this choice rests on.

        Called when the vehicle gets the objective, and again when one of those facts has changed; for an objective that
        ``activity_domain`` plans, ``activities`` is asked in its place.

        Args:
            data: of the vehicle that plans.
            facts: answers keys of beliefs, and ``("members", "Group.Role")``.
            position_m: where the vehicle is.
        """
        ...

    @property
    def activity_domain(self) -> Domain | None:
        """HTN that turns objectives into activities; None by default: ``activity_sets`` alone says what to do.

        The task for an objective is called ``Pursue`` with its name behind, and has the objective and the
        ``VehicleData`` as arguments. A vehicle carries the plan out as a tree: all steps that may start do, and stand
        to choice as activities. A step ends when its effects hold; it has failed when its behaviour says so.
        """
        return None

    def activities(
        self,
        steps: Sequence[Sequence[Task]],
        objective: Objective,
        data: VehicleData,
        facts: FactsLike,
        position_m: Point,
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        """Activities for the running steps of the plan for ``objective``, and the facts that they rest on.

        Args:
            steps: each with those that stand beside it under one task: they are performed simultaneously.
            data, facts, position_m: as of ``activity_sets``.
        """
        raise NotImplementedError(f"{type(self).__name__} has an activity_domain, so it must have activities too")

    def founding_objectives(self) -> Sequence[Objective]:
        """Objectives that roles have from the start; none by default."""
        return ()

    def is_individual(self, objective: Objective) -> bool:
        """True if the objective is pursued without interacting with others; so all are by default."""
        return True

    def is_enough(self, facts: Known) -> bool:
        """True if the goal asks for no more than what is known to be done; by default it asks for all jobs."""
        return False

    def groups_of(self, subject: str) -> Collection[str] | None:
        """Groups that facts about an instance of the mission's own concern, where needs follow from groups.

        None by default: those with a role for the job that the instance, or the fact of its being done, is about; and
        everybody if there is none.
        """
        return None

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        """What ``vehicle`` makes known when it has done all there was to do for ``objective``; nothing by default."""
        return None

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """What the head of ``group`` concludes at each decision from what it has heard; nothing by default."""
        return ()

    def conclusions(
        self, data: VehicleData, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """What a vehicle concludes for itself at each decision, whomever it leads; nothing by default.

        It is told to whoever needs it. What is concluded once should not be concluded again from what follows. Who
        returns `Nothing` is not asked again before there is news, or the time that it names.
        """
        return ()


class FunctionalPart(Protocol):
    """What the functional layer of a vehicle needs of its mission."""

    @abstractmethod
    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """A new behaviour that carries out the activity set which ``activity`` leads."""
        ...

    def world(self, seed: int) -> Any:
        """What sensors perceive in the run with that seed: a pure function of it, since metrics ask for it again.

        All vehicles and the truth of a run share the object: nothing may change in it, but by ``Mission.nature``.
        """
        return None


class Mission(SocialPart, FunctionalPart, Protocol):
    """One mission; see the text of this module."""

    Scenario: ClassVar[type[Any]]
    """Tables that a scenario of this mission has: ``missions.scenarios.Scenario`` or a subclass of it."""
    group_missions: ClassVar[tuple[str, ...]]
    """Names of the missions that a group may have: tasks of the social domain."""
    delegating_mission: ClassVar[str | None] = None
    """Of these, the one whose group gives the others theirs."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Attributes without which nothing would come of the mission; ``[communication.needs]`` has to list them."""
    vocabulary: ClassVar[tuple[Path, ...]] = ()
    """Turtle files with classes and attributes of the mission's own; they are read beside the core ontology."""
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {}
    """Kinds of sensors that ``type`` in ``[[vehicle.sensor]]`` names; the first is meant where it is absent."""
    tables: ClassVar[tuple[Table, ...]] = ()
    """Tables that its truth writes; those of sensors are declared by them."""
    metrics: ClassVar[tuple[Any, ...]] = ()
    """Metrics of its runs, ``missions.metric.Metric`` values: fields of the summary behind those of every run."""
    figures: ClassVar[tuple[Any, ...]] = ()
    """Figures of its runs, ``missions.figure.Figure`` values."""

    @classmethod
    @abstractmethod
    def from_scenario(cls, scenario: Any) -> Self:
        """The mission of a scenario that has passed every check."""
        ...

    @abstractmethod
    def truth(self, recorder: Recorder, world: Any) -> Truth:
        """A new truth, to watch one run.

        Args:
            recorder: takes the rows of the mission's own tables.
            world: of the run, the object that sensors perceive.
        """
        ...

    def nature(self, world: Any) -> Callable[[FleetView, float], None] | None:
        """What changes the world of a run: called with the fleet and the true time (s) whenever truth looks, before it.

        It happens between vehicles, whether truth looks or not, so that a sensor perceives it in the next motion tick.
        None by default: nothing changes. A vehicle by itself, see ``remoras.solo``, is refused a mission that has it.
        """
        return None

    @classmethod
    def check(cls, scenario: Any) -> Iterable[Any]:
        """``missions.errors.ConfigurationFault`` values for what is wrong between the tables; none by default.

        Args:
            scenario: a ``Scenario`` of this mission. A malformed table is no attribute of it; a check ends at it.
        """
        return ()

    @classmethod
    def completed(cls, scenario: Any) -> Any:
        """The scenario with what follows from its tables, such as roles for possible work; unchanged by default.

        Called before any check between tables. The resolved scenario lists what it added, so it must leave tables alone
        that are complete.

        Args:
            scenario: a ``Scenario`` of this mission, frozen.
        """
        return scenario

    @property
    def vocabulary_used(self) -> tuple[Path, ...]:
        """Of ``vocabulary``, the files that this scenario needs, all by default: items are numbered by their words."""
        return self.vocabulary

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        """(class, name) of what the whole fleet has names for from the start, beside vehicles, groups and the like."""
        return ()

    @property
    def instances_found_per_vehicle(self) -> int:
        """Most instances that the sensors of one vehicle create in a run; none by default."""
        return 0

    @property
    def most_observations(self) -> int:
        """Most observations that the sensors of one vehicle make in a run; numbers on the wire are as wide as this."""
        return 10_000

    @property
    def places(self) -> Sequence[Any]:
        """``missions.figure.Place`` values that pictures of its runs show; none by default."""
        return ()
