"""Structure: planned parts, their true state in a run, and their service jobs.

True states are sampled by seed and number of the upset in a separate stream. Strategies, losses and other faults never
change them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

from exchange.arithmetic import TAU, distance, length, sincos
from exchange.channel import loss
from missions.pandora.scenario import ANY_VALVE, KINDS, PandoraScenario, UpsetTable, ValveTable, job_of
from missions.pandora.sensors import ArmSettings, CameraSettings, Structure, TruePart, WrenchSettings
from remoras.beliefs import Key, Known
from remoras.database import VehicleData
from remoras.work import Outlook, Point

TOOLS = "arm", "wrench"
"""Tools that a vehicle may report dead."""


@dataclass(frozen=True)
class PlannedPart:
    """Planned part with its service task: a ``remoras.work.Job``.

    Attributes:
        of: name of the part.
        points_m: one place; many for chains.
        work_s: time per point, or of a tool.
        panel_m: place of its panel; None without one.
        resists: valve known to need a wrench.
        dead: (vehicle, tool) of tools known to be dead.
        vehicles: that report dead tools; empty without plan repair.
    """

    of: str
    kind: str
    points_m: tuple[Point, ...]
    work_s: float
    panel_m: Point | None = None
    panel: str = ""
    needs: tuple[str, ...] = ()
    resists: bool = False
    dead: tuple[tuple[str, str], ...] = ()
    vehicles: tuple[str, ...] = ()

    @cached_property
    def name(self) -> str:
        """Name of the service task."""
        return job_of(self.of)

    @cached_property
    def way_m(self) -> float:
        """Path length along its points (m)."""
        return math.fsum(distance(*pair) for pair in pairwise(self.points_m))

    @cached_property
    def place_m(self) -> Point:
        """First point."""
        return self.points_m[0]

    @property
    def takes_arm(self) -> bool:
        """True for parts that need a tool."""
        return self.kind in ("Valve", "Anode")

    @property
    def done(self) -> Key:
        """Fact that the task is done."""
        return "jobDone", self.name

    def is_able(self, data: VehicleData) -> bool:
        """Return True for a vehicle with a camera and, if needed, a working tool."""
        if data.sensor(CameraSettings) is None:
            return False
        if not self.takes_arm:
            return True
        kind, tool = (WrenchSettings, "wrench") if self.resists else (ArmSettings, "arm")
        return data.sensor(kind) is not None and (data.name, tool) not in self.dead

    def is_ever_able(self, data: VehicleData) -> bool:
        """Return True if able with either tool."""
        return replace(self, resists=False, dead=()).is_able(data) or replace(self, resists=True, dead=()).is_able(data)

    @property
    def rests_on(self) -> tuple[Key, ...]:
        """Facts about the part's anomaly and dead tools."""
        if not (self.vehicles and self.takes_arm):
            return ()
        return ("anomaly", self.of), *(("toolDead", name) for name in self.vehicles)

    @property
    def hindrances(self) -> tuple[str, ...]:
        """Resistance of the part, and dead tools."""
        resists = (f"{self.of} resists, it takes a wrench",) if self.resists else ()
        return *resists, *(f"the {tool} of {name} is dead" for name, tool in self.dead)

    def left(self, facts: Known) -> PlannedPart:
        """Return the task with known anomalies and dead tools."""
        if not self.rests_on:
            return self
        resists = self.kind == "Valve" and facts.get(("anomaly", self.of)) == "resists"
        told = {name: facts.get(("toolDead", name)) for name in self.vehicles}
        dead = tuple((name, tool) for name, of in told.items() for tool in TOOLS if of in (tool, "both"))
        if (resists, dead) == (self.resists, self.dead):
            return self
        return replace(self, resists=resists, dead=dead)

    def work_there_s(self, data: VehicleData) -> float:
        """Time (s) on site: all points, and travel between them at survey speed."""
        return len(self.points_m) * self.work_s + self.way_m / data.survey_speed_mps

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return the outlook after the service; None if unable."""
        if not self.is_able(data):
            return None
        (from_x_m, from_y_m), (x_m, y_m) = outlook.position_m, self.place_m
        way_s = length(x_m - from_x_m, y_m - from_y_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + self.work_there_s(data), self.points_m[-1])


def planned_parts(scenario: PandoraScenario) -> dict[str, PlannedPart]:
    """Service tasks by name."""
    panels = {panel.name: panel.position_m for panel in scenario.panel}
    hands_on = tuple(vehicle.name for vehicle in scenario.vehicle) if scenario.mission.adaptation == "all" else ()
    found = {}
    for kind, of_class in KINDS.items():
        for table in getattr(scenario, kind):
            points_m = getattr(table, "points_m", None) or (table.position_m,)
            panel = table.panel if isinstance(table, ValveTable) else table.name if kind == "panel" else ""
            found[job_of(table.name)] = PlannedPart(
                table.name, of_class, points_m, table.work_s, panels.get(panel), panel, vehicles=hands_on
            )
    return found


def structure_of(parts: Mapping[str, PlannedPart], upsets: Iterable[UpsetTable], seed: int) -> Structure:
    """Return the true structure of a run."""
    things = {part.of: TruePart(part.of, part.kind, part.points_m, part.work_s) for part in parts.values()}
    free = [part.of for part in parts.values() if part.kind == "Valve"]
    for upset in upsets:
        if upset.part in free:
            free.remove(upset.part)
    for number, upset in enumerate(upsets):
        which, direction = (loss.uniform(seed, loss.FINDS, number, 0, draw) for draw in (0, 1))
        name = free.pop(int(which * len(free))) if upset.part == ANY_VALVE else upset.part
        things[name] = _upset(things[name], upset, direction)
    return Structure(tuple(things.values()), seed)


def _upset(thing: TruePart, upset: UpsetTable, direction: float) -> TruePart:
    if upset.kind == "turned":
        return replace(thing, state="closed", upset=upset.kind)
    if upset.kind == "stuck":
        return replace(thing, is_stuck=True, upset=upset.kind)
    (x_m, y_m), off_m = thing.points_m[0], upset.distance_m or 0.0
    north, east = sincos(TAU * direction)
    moved_m = x_m + off_m * east, y_m + off_m * north
    return replace(thing, points_m=(moved_m,), upset=upset.kind)
