"""Invariants of missions: the covered ground and the meetings, worked out a second time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import product
from typing import Any, cast

from stress.invariants import TICK, Invariant, Scene
from stress.schedules import AWAY

from exchange.arithmetic import length
from missions.mapping.scenario import MappingScenario
from missions.mapping.sensors import LIMIT_TOLERANCE, Cell, SwathSettings

ROUNDING = 1e-6


class TrueCoverage(Invariant):
    """Cells count as covered if, and only if, a working sensor passed them, and a complete mission has its share."""

    name = "ground"
    moment = TICK

    def __init__(self) -> None:
        self._looked: dict[str, set[tuple[float, float, float]]] = {}
        self._swaths: dict[str, list[tuple[str, float, float]]] = {}  # by vehicle: sensor, limit (m/s), reach (m)

    def broken(self, scene: Scene) -> str | None:
        """Note where working sensors are; at the end compare with the tables and the verdict."""
        if scene.finished is not None:
            return self._judged(scene)
        for vehicle in scene.fleet.vehicles:
            layer, name = vehicle.functional, vehicle.name
            if not layer.sensing or not vehicle.is_alive:
                continue
            if (swaths := self._swaths.get(name)) is None:
                swaths = self._swaths[name] = _swaths_of(layer.data)
            motion, dead = layer.motion, vehicle.condition.dead_sensors
            for sensor, limit_mps, reach_m in swaths:
                if layer.guidance.ground_mps <= limit_mps and sensor in layer.sensing and sensor not in dead:
                    self._looked.setdefault(name, set()).add((motion.x_m, motion.y_m, reach_m))
        return None

    def _judged(self, scene: Scene) -> str | None:
        run, scenario = scene.finished, cast("MappingScenario", scene.setup.scenario)
        world = run.mission.world(run.seed)
        covered = {(name, cell) for name, looked in self._looked.items() for cell in _cells(looked, world)}
        told = {(row[1], (row[2], row[3])) for row in run.recorder.rows("coverage")}
        if covered != told:
            wrong = sorted(covered ^ told)
            return f"{len(wrong)} cells are covered on the ground or in the table alone: {wrong[:3]}"
        cells = {cell for _, cell in covered}
        share = len(cells) / len(world.cells) if world.cells else 0.0
        if abs(scene.summary["coverage_fraction"] - share) > ROUNDING:
            return f"coverage_fraction is {scene.summary['coverage_fraction']}; on the ground it is {share:.6f}"
        if world.features or not run.completed:
            return None
        if share < scenario.mission.goal - ROUNDING:
            return f"completed with {len(cells)} of {len(world.cells)} cells covered; goal {scenario.mission.goal:g}"
        return None


def _swaths_of(data: Any) -> list[tuple[str, float, float]]:
    """Name, greatest speed (m/s) and reach to each side (m) of the swath sensors of a vehicle."""
    factor = data.speed_factor * LIMIT_TOLERANCE
    swaths = [sensor for sensor in data.sensors if isinstance(sensor, SwathSettings)]
    return [(sensor.name, factor * sensor.speed_limit_mps, sensor.swath_m / 2.0) for sensor in swaths]


def _cells(looked: set[tuple[float, float, float]], world: Any) -> set[Cell]:
    """Cells whose centre was within reach of a sensor at one of its places."""
    size, found = world.cell_m, set[Cell]()
    for x_m, y_m, reach_m in looked:
        columns, rows = (
            range(math.floor((at_m - reach_m) / size - 0.5), math.ceil((at_m + reach_m) / size - 0.5) + 1)
            for at_m in (x_m, y_m)
        )
        for cell in product(columns, rows):
            if cell not in found and cell in world.cells:
                dx_m, dy_m = (cell[0] + 0.5) * size - x_m, (cell[1] + 0.5) * size - y_m
                if dx_m * dx_m + dy_m * dy_m <= reach_m * reach_m:
                    found.add(cell)
    return found


ROUNDING_M = ROUNDING_S = 1e-6


class TrueMeeting(Invariant):
    """Where a group counts as gathered, each member has been at the rally point by then, or is named as missing.

    A member is who had a role of the group then, as it saw itself; who got one later came to a group that had met.
    Under faults that keep a vehicle out of contact or take it away nobody waits for it.
    """

    name = "meetings"
    not_under = AWAY | {"deaf", "mute", "drains"}

    def broken(self, scene: Scene) -> str | None:
        """Compare milestones with the tracks."""
        run, meeting = scene.finished, scene.setup.mission.meeting
        if run is None:
            return None
        for met in (milestone for milestone in run.milestones if milestone.name == "gathered"):
            x_m, y_m = meeting.rally_points_m[meeting.groups[met.group].rally_point]
            radius_m = meeting.arrival_radius_m + ROUNDING_M
            known = {
                milestone.vehicle
                for milestone in run.milestones
                if (milestone.name, milestone.group) == ("missed_meeting", met.group)
            }
            for time_s, vehicle, at_x_m, at_y_m, *_ in run.recorder.trajectories:
                if time_s <= met.time_s + ROUNDING_S and length(at_x_m - x_m, at_y_m - y_m) <= radius_m:
                    known.add(vehicle)
            for name in sorted(_members(run.recorder.roles, met.group, met.time_s) - known):
                return f"{met.group} has gathered at {met.time_s:g} s; {name} was not at its rally point"
        return None


def _members(roles: Iterable[tuple[Any, ...]], group: str, until_s: float) -> set[str]:
    """Vehicles that have a role of a group at a time, by the rows of the table of roles."""
    holds: set[tuple[str, str]] = set()
    for time_s, vehicle, of, role, event in roles:
        if of == group and time_s <= until_s + ROUNDING_S:
            if event == "assigned":
                holds.add((vehicle, role))
            elif event == "left":
                holds.discard((vehicle, role))
    return {vehicle for vehicle, _ in holds}
