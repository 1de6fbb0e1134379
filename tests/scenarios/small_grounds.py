"""Small grounds, on which a mission takes a fraction of the time."""

import json
from typing import NamedTuple

from missions.mapping.scenario import MappingScenario
from missions.scenarios import load

SMALLER = 0.4


class Ground(NamedTuple):
    """A scenario, and what is set in it."""

    scenario: str
    settings: tuple[str, ...] = ()


def areas(side_m: float) -> Ground:
    """Three areas side by side, with rally points beyond them."""
    near, middle, far = 0.5 * side_m, 1.5 * side_m, 2.5 * side_m
    squares = {"middle": (near, near), "left": (middle, near), "right": (near, middle)}
    found = ["communication.lease_frames=10", f"mission.meeting_deadline_s={3.6 * side_m:g}"]
    for name, (x_m, y_m) in squares.items():
        corners = [[x_m, y_m], [x_m, y_m + side_m], [x_m + side_m, y_m + side_m], [x_m + side_m, y_m]]
        found.append(f"area.{name}.corners_m={json.dumps(corners)}")
    for name, at_m in (("operational rally", 2.0 * side_m), ("coordination rally", far - 0.1 * side_m)):
        found.append(f'rally_point."{name}".position_m={json.dumps([at_m, at_m])}')
    return Ground("mapping-rendezvous", tuple(found))


def made_smaller(scenario: str) -> Ground:
    """A mapping ground with all lengths times 0.4, and shorter leases and waits."""
    own = load(scenario)
    assert isinstance(own, MappingScenario)
    deadline_s = SMALLER * own.mission.meeting_deadline_s
    found = ["communication.lease_frames=10", f"mission.meeting_deadline_s={deadline_s:g}"]
    for area in own.area:
        corners = [[SMALLER * one for one in corner] for corner in area.corners_m]
        found.append(f'area."{area.name}".corners_m={json.dumps(corners)}')
    for point in own.rally_point:
        at_m = [SMALLER * one for one in point.position_m]
        found.append(f'rally_point."{point.name}".position_m={json.dumps(at_m)}')
    return Ground(scenario, tuple(found))


def ground_of(name: str) -> Ground:
    """Return ``areas-50m`` and its kind, a scaled mapping scenario (``NAME-small``), or a scenario as shipped."""
    if name.startswith("areas-"):
        return areas(float(name.removeprefix("areas-").removesuffix("m")))
    return made_smaller(name.removesuffix("-small")) if name.endswith("-small") else Ground(name)
