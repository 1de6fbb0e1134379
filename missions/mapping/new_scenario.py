"""Text of a new scenario: adjacent squares and a fleet south of them.

The TOML template repeats the text between ``#: each KIND`` and ``#: end`` for each area, role, vehicle or fault.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from string import Template
from typing import Any

from exchange.arithmetic import length
from missions.errors import ConfigurationError

TEMPLATE = Path(__file__).with_name("new-scenario.toml.txt")
EACH = re.compile(r"^#: each (\w+)\n(.*?)^#: end\n", re.MULTILINE | re.DOTALL)
SWATH_M, SURVEY_MPS, TRANSIT_MPS, POWER_W = 25.0, 1.5, 2.5, 100.0
"""Sensor width and speeds of the template's vehicles; upper limit (W) of their survey power."""
MARGIN_M = 100.0  # distance from the start to the first area, to a cell, and free margin around all areas
CELL_M, MOST_IN_ROW = 25.0, 64  # greatest side of a cell, most cells in a row of an area


def scenario_text(
    name: str,
    ranges_m: Mapping[str, float],
    vehicles: int = 3,
    areas: int = 4,
    side: float = 150.0,
    modem: str = "nanomodem-v3",
    per: float = 0.3,
    lost: int = 0,
) -> str:
    """Return a scenario as TOML text: numbers of AUVs, areas and lost AUVs, side of an area (m), packet error rate.

    The time limit is 1.5 times the time that the vehicles left after all faults need, plus five minutes, rounded up to
    ten. Raises ``ConfigurationError`` if no vehicle remains or a corner is out of modem range (``ranges_m`` by modem).
    """
    for option, value, least, most in (("side", side, 50.0, 1000.0), ("per", per, 0.0, 0.95)):
        if not least <= value <= most:
            raise _refused(option, value, f"{least:g} to {most:g}")
    n_columns = math.ceil(math.sqrt(areas))
    cell_m = _cell_m(side)
    edges_m = [round(cell_m * round(MARGIN_M / cell_m) + side * n, 6) for n in range(n_columns + 1)]
    east_m, north_m = edges_m[-1], edges_m[math.ceil(areas / n_columns)]
    reach_m, carries_m = length(east_m, north_m), ranges_m[modem]
    if lost >= vehicles:
        raise _refused("lost", lost, f"0 to {vehicles - 1}, less than --vehicles")
    if reach_m > carries_m:
        far = f"the farthest corner is {reach_m:.0f} m away, and {modem} carries {carries_m:g} m"
        raise _refused("side", f"{side:g}", f"a shorter side, fewer --areas or another --modem: {far}")
    each_s = side * side / SWATH_M / SURVEY_MPS + 2.0 * reach_m / TRANSIT_MPS
    work_s = math.ceil(areas / (vehicles - lost)) * each_s
    duration_s = 600.0 * math.ceil((1.5 * work_s + 300.0) / 600.0)
    corners = [
        {
            "area": f"area {number + 1}", "role": f"Mapper{number + 1}",
            "west": edges_m[number % n_columns], "east": edges_m[number % n_columns + 1],
            "south": edges_m[number // n_columns], "north": edges_m[number // n_columns + 1],
        }
        for number in range(areas)
    ]  # fmt: skip
    fleet = [{"vehicle": f"AUV{n:02d}", "slot": n, "start_x": 10.0 * n} for n in range(vehicles)]
    faults = [{"earliest_s": round(0.05 * work_s), "latest_s": round(0.25 * work_s)}] * lost
    entries: dict[str, list[dict[str, Any]]] = {"area": corners, "vehicle": fleet, "fault": faults}
    text = EACH.sub(
        lambda match: "".join(Template(match[2]).safe_substitute(entry) for entry in entries[match[1]]),
        TEMPLATE.read_text(encoding="utf-8"),
    )
    once = {
        "name": name, "n_vehicles": vehicles, "n_areas": areas, "side": f"{side:g}", "cell_m": cell_m,
        "duration_s": duration_s, "east_m": east_m + MARGIN_M, "north_m": north_m + MARGIN_M, "modem": modem,
        "per": per, "range_m": 100.0 * math.ceil(reach_m / 100.0),
        "energy_j": 1e6 * math.ceil(POWER_W * duration_s / 1e6),
    }  # fmt: skip
    return Template(text).substitute(once).rstrip() + "\n"


def _cell_m(side_m: float) -> float:
    """Return the greatest side of a cell, in few decimals if possible, that divides the side of an area."""
    least = math.ceil(side_m / CELL_M)
    short = ((n, round(side_m / n, 3)) for n in range(least, min(2 * least, MOST_IN_ROW)))
    return next((cell_m for n, cell_m in short if math.isclose(n * cell_m, side_m)), side_m / least)


def _refused(option: str, value: object, allowed: str) -> ConfigurationError:
    return ConfigurationError.of("new scenario", f"--{option}", str(value), f"allowed: {allowed}")
