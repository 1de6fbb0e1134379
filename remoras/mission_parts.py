"""Parts of a mission that the layers use: its tasks, activities, behaviours and findings."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from remoras.activities import Activity, ActivitySet, Objective
from remoras.behaviours import Behaviour
from remoras.beliefs import Beliefs, Key, Known
from remoras.database import VehicleData
from remoras.htn import Domain, FactsLike, Task
from remoras.motion import Motion
from remoras.organisation import Group, Organisation
from remoras.picture import Picture
from remoras.work import Job, Point

ALLOCATE_ROLES, GIVE_MISSION, ASSIGN_OBJECTIVE = "AllocateRoles", "GiveMission", "AssignObjective"
FORM_GROUP, DISSOLVE_GROUP = "FormGroup", "DissolveGroup"
ELEMENTARY_TASKS = (ALLOCATE_ROLES, GIVE_MISSION, ASSIGN_OBJECTIVE, FORM_GROUP, DISSOLVE_GROUP)
"""Elementary tasks; see ``SocialPart.social_domain``."""
PURSUE = "Pursue"
"""Prefix of the task name for an objective; see ``SocialPart.activity_domain``."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Inferred fact of a vehicle, by names.

    >>> Finding("Operational", "gatheredAt", "operational rally").attribute
    'gatheredAt'
    """

    subject: str
    attribute: str
    value: str | float | bool | Point


class SocialPart(Protocol):
    """Part of a mission used by the social layer."""

    @property
    @abstractmethod
    def social_domain(self) -> Domain:
        """HTN of group missions, with these elementary tasks.

        ``AllocateRoles(group, ...)``, ``GiveMission(group, mission)``, ``AssignObjective(group, role,
        objective, argument)``, ``FormGroup(group)`` and ``DissolveGroup(group)``.
        Preconditions and effects may use the leader's beliefs and these facts:

        * ``("members", "Group.Role")``: present holders; ``("isA", "Instance.Class")``: inferred class;
        * ``("lost", "Group.Role")``: vehicles that left the role or fell silent in it, once per event;
        * ``("allocated", group)``: roles are allocated, and no member has left since;
        * ``("objective", "Group.Role.Objective")``: its argument, once valid;
        * ``("formed", group)``: the group exists; ``("formation", group)``: number of formations at run time;
        * ``("given", "Group.Mission")``: assigned; ``("hasMission", group)``: the newest; ``("data", vehicle)``: data;
        * ``("instances", class)``: names of known instances, asserted or inferred;
        * ``("job", name)``: the job, reduced to its remainder, once known to exist.

        A step ``AssignObjective`` runs until its effects hold, and fails if its role becomes vacant.
        """

    @property
    @abstractmethod
    def jobs(self) -> Mapping[str, Job]:
        """Jobs of the mission by name; roles refer to them."""

    @abstractmethod
    def activity_sets(
        self, objective: Objective, data: VehicleData, facts: FactsLike, position_m: Point
    ) -> tuple[tuple[ActivitySet, ...], frozenset[Key]]:
        """Return the activities for ``objective`` and the facts that this choice depends on.

        Called when the vehicle with ``data`` gets the objective, and after changes of these facts; objectives in
        ``activity_domain`` use ``activities`` instead. ``facts`` include ``("members", "Group.Role")``.
        """

    @property
    def activity_domain(self) -> Domain | None:
        """HTN that decomposes objectives into activities; by default None: ``activity_sets`` only.

        The task of an objective is ``Pursue`` plus its name, with the objective and the ``VehicleData`` as arguments.
        All ready steps of the plan compete as activities. A step ends when its effects hold, and fails with its
        behaviour.
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
        """Return the activities of running steps for ``objective``, and the facts they depend on.

        ``steps`` come with siblings under one task, performed simultaneously; the rest as in ``activity_sets``.
        """
        raise NotImplementedError(f"{type(self).__name__} has an activity_domain, so it must have activities too")

    def founding_objectives(self) -> Sequence[Objective]:
        """Return the initial objectives of roles; none by default."""
        return ()

    def is_individual(self, objective: Objective) -> bool:
        """True if the objective needs no interaction; the default."""
        return True

    def is_enough(self, facts: Known) -> bool:
        """True if the known finished work satisfies the goal; by default the goal needs all jobs."""
        return False

    def groups_of(self, subject: str) -> Collection[str] | None:
        """Return the groups that facts about an instance concern; None: those with its job, or all."""
        return None

    def completion(self, objective: Objective, vehicle: str) -> Finding | None:
        """Return the fact published when ``vehicle`` has completed ``objective``; None by default."""
        return None

    def findings(
        self, group: Group, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """Return the inferences of the leader of ``group`` at each decision; none by default."""
        return ()

    def conclusions(
        self, data: VehicleData, organisation: Organisation, beliefs: Beliefs, picture: Picture, motion: Motion
    ) -> Sequence[Finding]:
        """Return the inferences of any vehicle at each decision; none by default.

        They are sent to interested peers and must not follow from own inferences. `Quiet` defers the next call until
        its end, by the clock and the believed position of the vehicle, or until new information: any received or
        inferred fact except positions and energy, a changed organisation, or changed sensor responses.
        """
        return ()


class FunctionalPart(Protocol):
    """Part of a mission used by the functional layer."""

    @abstractmethod
    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        """Return a new behaviour for the activity set led by ``activity``."""

    def world(self, seed: int) -> Any:
        """Return the world of all sensors, a pure function of the seed; only ``nature`` changes it."""
        return None
