"""Work: the jobs of a mission, and what one vehicle knows of who does them.

A mission brings jobs; a strategy divides them among vehicles. Neither knows the other's words: a survey, a docking and
a search are divided alike. A role names the job that its holder does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from remoras.beliefs import Key
from remoras.database import VehicleData

Point = tuple[float, float]


@dataclass(frozen=True, slots=True, order=True)
class Outlook:
    """When (s) and where a vehicle is expected to have done what it holds."""

    free_s: float
    position_m: Point


class Job(Protocol):
    """Something to be done once by one vehicle, at a place.

    A runnable example::

        @dataclass(frozen=True)
        class Visit:
            name: str
            place_m: Point
            stay_s: float = 60.0
            needs: tuple[str, ...] = ()

            @property
            def done(self) -> Key:
                return "jobDone", self.name

            def is_able(self, data: VehicleData) -> bool:
                return True

            def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
                way_s = math.dist(outlook.position_m, self.place_m) / data.transit_speed_mps
                return Outlook(outlook.free_s + way_s + self.stay_s, self.place_m)
    """

    @property
    def name(self) -> str:
        """Name of its instance in the ontology, unique in the scenario."""
        ...

    @property
    def place_m(self) -> Point:
        """Where it is, for messages and pictures."""
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        """Jobs that must be done before it may be begun."""
        ...

    @property
    def done(self) -> Key:
        """The fact (attribute, instance) that says, once it is known, that the job is done."""
        ...

    def is_able(self, data: VehicleData) -> bool:
        """True if a vehicle has what the job takes (a sensor, an arm, the depth); roles are asked for apart."""
        ...

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """When and where the vehicle will be free if it does this job next; None if it is not able.

        Asked thousands of times in a run: remember what depends on the job alone.
        """
        ...
