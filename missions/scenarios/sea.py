"""The sea between tables: a current has to leave every vehicle a way against it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from missions.errors import ConfigurationFault
from missions.scenarios.tables import Raw, entries, table_of
from remoras.current import Current


def current_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """A current that is as fast as the slowest vehicle at its depth, or faster."""
    table = table_of(raw, "current")
    given = {key: table.get(key, 0.0) for key in ("east_mps", "north_mps")}
    shear_depth_m = table.get("shear_depth_m", math.inf)
    spread = table_of(raw, "uncertainty").get("speed_spread", 0.0)
    if not all(_is_number(one) for one in (*given.values(), spread)) or not _is_positive(shear_depth_m):
        return
    current = Current(**given, shear_depth_m=shear_depth_m)
    worst: tuple[float, str] | None = None
    for vehicle in entries(raw, "vehicle"):
        depth_m, speed_mps = vehicle.get("depth_m", 0.0), vehicle.get("survey_speed_mps")
        if not _is_number(depth_m) or not _is_number(speed_mps):
            continue
        runs_mps, slowest_mps = current.greatest_mps(depth_m), speed_mps * (1.0 - spread)
        excess_mps = runs_mps - slowest_mps
        if runs_mps >= slowest_mps > 0.0 and (worst is None or excess_mps > worst[0]):
            allowed = (
                f"the current runs at {runs_mps:.3g} m/s at the {depth_m:g} m of {vehicle.get('name')}, which could "
                f"not stay where it is; allowed: less than {slowest_mps:.3g} m/s, its survey_speed_mps"
                + (f" less the uncertainty.speed_spread of {spread:g}" if spread else "")
            )
            worst = excess_mps, allowed
    if worst is not None:
        key = max(given, key=lambda key: abs(given[key]))
        yield ConfigurationFault(f"current.{key}", str(given[key]), worst[1])


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and math.isfinite(value)  # type: ignore[arg-type]


def _is_positive(value: object) -> bool:
    return type(value) in (int, float) and value > 0.0  # type: ignore[operator]
