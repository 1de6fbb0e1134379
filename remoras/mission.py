"""Protocol of missions: all parts of a mission in one class.

A scenario names the class as ``package.module:Class``. The class declares the content of its scenarios and results;
``from_scenario`` creates the mission of one scenario. That object serves all vehicles of the fleet, so it has no state
of a run. Calls:

========================  ===========================================================================================
loading a scenario        ``Scenario``, ``completed``, ``check``, ``sensors``, ``vocabulary``, ``group_missions``,
                          ``needs``
setting a run up          ``from_scenario``, ``jobs``, ``world``, ``nature``, ``founding_objectives``, ``truth``,
                          ``tables``, ``instances``, ``instances_found_per_vehicle``, ``most_observations``,
                          ``vocabulary_used``, ``groups_of``
social layer, in a run    ``social_domain``, ``is_individual``, ``activity_domain``, ``activities``,
                          ``activity_sets``, ``findings``, ``conclusions``, ``completion``
functional layer, in run  ``behaviour_for``
after a run               ``metrics``, ``figures``, ``places``
========================  ===========================================================================================

Loading a scenario also makes one trial of the run setup, to report faults early. Missions of jobs with rendezvous use
``missions.meeting.JobMission``, which has an example.

Subclass ``Mission``: abstract members are required, others have defaults. Vehicles themselves handle collision
avoidance, energy and borders.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self

from remoras.mission_parts import (
    ALLOCATE_ROLES,
    ASSIGN_OBJECTIVE,
    DISSOLVE_GROUP,
    ELEMENTARY_TASKS,
    FORM_GROUP,
    GIVE_MISSION,
    PURSUE,
    Finding,
    FunctionalPart,
    SocialPart,
)  # fmt: skip
from remoras.recorder import Recorder, Table
from remoras.sensor import Quiet, SensorSettings
from remoras.truth import FleetView, Milestone, Truth, VehicleView
from worldmodel import ontology_path

ABILITIES = ontology_path("abilities")
"""Vocabulary for inability of vehicles; a mission lists the file in ``vocabulary``."""
__all__ = [
    "ALLOCATE_ROLES", "ASSIGN_OBJECTIVE", "DISSOLVE_GROUP", "ELEMENTARY_TASKS", "FORM_GROUP", "GIVE_MISSION", "PURSUE",
    "Finding", "FleetView", "FunctionalPart", "Milestone", "Mission", "Quiet", "SocialPart", "Truth", "VehicleView",
]  # fmt: skip


class Mission(SocialPart, FunctionalPart, Protocol):
    """One mission; see the module docstring.

    >>> from missions.mapping.mission import MappingMission
    >>> from missions.scenarios import load
    >>> mission: Mission = MappingMission.from_scenario(load("mapping-rendezvous"))
    >>> list(mission.jobs)
    ['middle', 'left', 'right']
    """

    Scenario: ClassVar[type[Any]]
    """Scenario model of this mission: ``missions.scenarios.Scenario`` or a subclass."""
    group_missions: ClassVar[tuple[str, ...]]
    """Names of possible group missions: tasks of the social domain."""
    delegating_mission: ClassVar[str | None] = None
    """Group mission whose group assigns missions to the other groups."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Attributes required for any success; ``[communication.needs]`` has to list them."""
    vocabulary: ClassVar[tuple[Path, ...]] = ()
    """Turtle files with own classes and attributes, added to the core ontology."""
    sensors: ClassVar[Mapping[str, type[SensorSettings]]] = {}
    """Kinds of sensors for ``type`` in ``[[vehicle.sensor]]``; the first is the default."""
    tables: ClassVar[tuple[Table, ...]] = ()
    """Tables written by its truth; sensors declare their own."""
    metrics: ClassVar[tuple[Any, ...]] = ()
    """Metrics, ``missions.metric.Metric`` values, appended to the common summary fields."""
    figures: ClassVar[tuple[Any, ...]] = ()
    """Figures, ``missions.figure.Figure`` values."""

    @classmethod
    @abstractmethod
    def from_scenario(cls, scenario: Any) -> Self:
        """Return the mission of a valid scenario."""

    @abstractmethod
    def truth(self, recorder: Recorder, world: Any) -> Truth:
        """Return a new truth for one run: ``recorder`` takes its rows, ``world`` is that of the run."""

    def nature(self, world: Any) -> Callable[[FleetView, float], None] | None:
        """Return a function of fleet and true time (s) that changes the world; None by default.

        It is called between vehicles before each observation by the truth, so sensors perceive changes in the next
        motion tick. A vehicle run separately, see ``remoras.fleet.standalone``, refuses such missions.
        """
        return None

    @classmethod
    def check(cls, scenario: Any) -> Iterable[Any]:
        """Return ``missions.errors.ConfigurationFault`` values for conflicts between tables.

        ``scenario`` lacks malformed tables; access to one ends the check.
        """
        return ()

    @classmethod
    def completed(cls, scenario: Any) -> Any:
        """Return the scenario with derived content, such as roles for possible work.

        Called before checks between tables; unchanged by default. The resolved scenario lists its additions, so it must
        leave complete tables unchanged. ``scenario`` is frozen.
        """
        return scenario

    @property
    def vocabulary_used(self) -> tuple[Path, ...]:
        """Files of ``vocabulary`` needed by this scenario, which determine item numbering."""
        return self.vocabulary

    @property
    def instances(self) -> Sequence[tuple[str, str]]:
        """(class, name) of additional instances known to the whole fleet from the start."""
        return ()

    @property
    def instances_found_per_vehicle(self) -> int:
        """Maximum number of instances created by one vehicle's sensors in a run."""
        return 0

    @property
    def most_observations(self) -> int:
        """Limit of sensor observations per vehicle and run; sets number widths on the wire."""
        return 10_000

    @property
    def places(self) -> Sequence[Any]:
        """``missions.figure.Place`` values for figures of its runs."""
        return ()
