"""Where vehicles start: those in one depth layer must not be too near to each other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from missions.errors import ConfigurationFault
from missions.scenarios.tables import Raw, entries, point_of, table_of
from remoras.avoidance import SEPARATION_M
from remoras.separation import SAME_DEPTH_M, TOLERANCE_M


def start_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """Starts that are nearer to an earlier one in the same layer than vehicles are to come; each is said once."""
    separation_m = table_of(raw, "guidance").get("separation_m", SEPARATION_M)
    if type(separation_m) not in (int, float) or not math.isfinite(separation_m):
        return
    placed = []
    for vehicle in entries(raw, "vehicle"):
        depth_m = vehicle.get("depth_m", 0.0)
        if type(depth_m) in (int, float) and math.isfinite(depth_m):
            placed += [(vehicle.get("name"), depth_m, at_m) for at_m in point_of(vehicle, "start_m")]
    said = set()
    for (other, other_depth_m, other_m), (name, depth_m, at_m) in itertools.combinations(placed, 2):
        distance_m = math.dist(at_m, other_m)
        is_too_near = distance_m < separation_m - TOLERANCE_M and abs(depth_m - other_depth_m) <= SAME_DEPTH_M
        if is_too_near and name not in said:
            said.add(name)
            allowed = (
                f"{distance_m:.3g} m from the start of {other}, in the same depth layer; allowed: "
                f"guidance.separation_m = {separation_m:g} m or more, or a depth_m that differs by more than "
                f"{SAME_DEPTH_M:g} m"
            )
            yield ConfigurationFault(f"vehicle.{name}.start_m", f"[{at_m[0]}, {at_m[1]}]", allowed)
