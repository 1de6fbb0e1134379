"""Where vehicles start: those in one depth layer must not be too near to each other.

Many scenarios have vehicles start where their ship is, at one point. Who would start too near to one that is listed
before it starts at the nearest free place of a lattice around that point instead.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

from exchange.arithmetic import distance
from missions.errors import ConfigurationFault
from missions.scenarios.copies import SPACING_M, free_places
from missions.scenarios.tables import PointM, Raw, bounds_of, point_of, table_of
from remoras.avoidance import SEPARATION_M
from remoras.separation import SAME_DEPTH_M, TOLERANCE_M


class _Start(NamedTuple):
    """Where a vehicle starts: its place in the list, its name, depth and position."""

    number: int
    name: object
    depth_m: float
    at_m: PointM

    def shares_layer(self, other: _Start) -> bool:
        """True if the two do not pass freely."""
        return abs(self.depth_m - other.depth_m) <= SAME_DEPTH_M


def with_starts_apart(raw: Raw) -> Raw:
    """The tables, with other starts where vehicles would start too near; as they are where there is no room for it."""
    separation_m, box = _separation_m(raw), bounds_of(raw)
    if separation_m is None or box is None or not all(map(math.isfinite, box)):
        return raw
    placed, moved = list[_Start](), dict[int, PointM]()
    for start in _starts(raw):
        near = [other.at_m for other in placed if start.shares_layer(other)]
        if any(distance(start.at_m, at_m) < separation_m - TOLERANCE_M for at_m in near):
            spacing_m = max(SPACING_M, separation_m)
            for at_m in free_places(start.at_m, spacing_m, box, near, 1):
                moved[start.number] = at_m
        placed.append(start._replace(at_m=moved.get(start.number, start.at_m)))
    if not moved:
        return raw
    vehicles = enumerate(raw["vehicle"])
    apart = [{**one, "start_m": [*moved[number]]} if number in moved else one for number, one in vehicles]
    return {**raw, "vehicle": apart}


def start_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Starts that are nearer to an earlier one in the same layer than vehicles are to come; each is said once."""
    separation_m = _separation_m(raw)
    if separation_m is None:
        return
    said = set()
    for other, start in itertools.combinations(_starts(raw), 2):
        distance_m = distance(start.at_m, other.at_m)
        if distance_m < separation_m - TOLERANCE_M and start.shares_layer(other) and start.name not in said:
            said.add(start.name)
            allowed = (
                f"{distance_m:.3g} m from the start of {other.name}, in the same depth layer, and no place is free; "
                f"allowed: guidance.separation_m = {separation_m:g} m or more, or a depth_m that differs by more "
                f"than {SAME_DEPTH_M:g} m"
            )
            yield ConfigurationFault(f"vehicle.{start.name}.start_m", f"[{start.at_m[0]}, {start.at_m[1]}]", allowed)


def _separation_m(raw: Raw) -> float | None:
    """How near vehicles may come; None if the key is malformed."""
    separation_m = table_of(raw, "guidance").get("separation_m", SEPARATION_M)
    return separation_m if type(separation_m) in (int, float) and math.isfinite(separation_m) else None


def _starts(raw: Raw) -> Iterator[_Start]:
    """Starts of the vehicles that have one."""
    listed = raw.get("vehicle")
    for number, vehicle in enumerate(listed if isinstance(listed, list) else []):
        depth_m = vehicle.get("depth_m", 0.0) if isinstance(vehicle, dict) else None
        if isinstance(depth_m, int | float) and math.isfinite(depth_m):
            for at_m in point_of(vehicle, "start_m"):
                yield _Start(number, vehicle.get("name"), depth_m, at_m)
